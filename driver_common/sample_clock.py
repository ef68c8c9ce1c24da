# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""When a sample was taken, on the host's clocks, from its place in the stream.

A sensor samples at a steady pace, known to about 100 ppm before anything arrives; its frames
arrive late, by a changing amount, but never early. What follows from that is kept in two parts:

- the estimate (`driver_common.arrivals`): the line that the sensor's clock is behind the arrivals,
  made anew with each block of frames; it may step;
- the stamps (`Stamps`): a line through the samples that follows the estimate, but never back,
  never later than a frame arrived, and within 1 % of the sensor's pace.

Only a break lets the stamps step: the start; arrivals that the line cannot explain, because the
sensor paused unnoticed or the host slept; and a frame so early that 1 % does not suffice. Breaks
are counted. What a busy host read late is no break: a backlog grows or shrinks, and ends at the
line, while the frames of a sensor that paused stay late at its own pace.

All is done on the monotonic clock, which nobody sets; `HostClock` turns it into the time of day.
docs/timing.md says what is promised and what trials have shown.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from driver_common.arrivals import Envelope, Floats, Line, Prior, Queue
from driver_common.clocks import host_offset

TOLERANCE = 150e-6  # standard deviation of a crystal's drift before anything arrives
JITTER = 30e3  # ns that the least delays of blocks vary by, before anything arrives
KNOWN_BLOCKS = 50  # after which the drift is known
BLOCK = 0.1e9  # ns of arrivals that are looked at together
FIRST_BLOCK = 0.01e9  # ns; each of the first ones is twice as long as the one before
START, START_BLOCKS = 0.2e9, 3  # ns after which a stream has settled; blocks where it jitters less
BACK_OFF = 20e6  # ns from the first stamp to its arrival: nobody knows how late that is
QUEUE_EXCESS = 0.3e6  # ns of mean excess of the envelope from which frames may queue …
QUEUE_FRAMES = 20  # … in blocks of so many
SLEW = 0.009  # largest correction of the pace
CATCH_UP = 0.2e9  # ns in which the stamps meet the estimate, where that is slow enough
MARGIN, MARGIN_MAX = 2e3, 150e3  # ns that stamps keep before an envelope, beside …
UNCERTAINTIES = 4.0  # … so much of its uncertainty, for the earlier frames that will come
QUEUE_MARGIN = 30e3  # ns before a queue's line: hardly any frame comes that near
LATE, EARLY = 2e6, 0.5e6  # ns from which frames are not of the line, at least
START_EARLY, START_POINTS = 1e9, 10  # the same until the envelope has so many points
EXCESSES, JITTERS = 8.0, 2.0  # the same in mean excesses of the envelope, and in usual jitters
STEADY, STEADY_BLOCKS = 0.4e9, 4  # ns and blocks of a lateness after which the sensor had paused
GROWTH = 4.0  # mean excesses of the envelope by which a steady lateness does not grow
FALLING_BEHIND = 10e9  # ns for which a host may take frames slower than they come
SET = 1_000_000  # ns by which the time of day changes only where somebody sets it
PROMPT, WAITED_MOST = 5_000_000, 60_000_000_000  # ns that what is on a bus waits: usually, at most
RESTART = 1e9  # ns by which numbers go back only where a stream begins anew
SET_BACK = 50e6  # ns by which arrivals go back only where somebody sets the clock
PIECES = 16  # of the stamps' line that are remembered
WAITED = 50e6  # ns of delay that are no jitter: such a frame waited for the host
MEMORY = 100  # blocks that the figures of the delays look back
SYSTEMATIC = 5e3  # ns; polls in step with the frames can hide as much


class HostClock:
    """The host's time of day against its monotonic clock.

    Attributes:
        offset: What to add to monotonic ns, for ns since the epoch.
        rest: What is still to be added to the offset: the clock is being corrected.
        steps: How often the clock was set.
    """

    def __init__(self, read: Callable[[], int] = host_offset) -> None:
        """Read both clocks; `read` returns their difference in ns."""
        self._read = read
        self.offset = read()
        self.rest = 0
        self.steps = 0

    def follow(self) -> None:
        """Read both clocks, because somebody may have set or corrected the time of day."""
        self.rest = self._read() - self.offset
        if abs(self.rest) > SET:
            self.steps += 1
            self.offset += self.rest
            self.rest = 0

    def slew(self, most: int) -> None:
        """Correct the offset by at most so many ns."""
        change = min(max(self.rest, -most), most)
        self.offset += change
        self.rest -= change

    def when(self, bus_time: float, seen: int) -> int:
        """Return when something was on a bus, in monotonic ns.

        Args:
            bus_time: The time of day then, in s since the epoch, by the kernel of this host.
            seen: When this process saw it, in monotonic ns.
        """
        on_bus = int(bus_time * 1e9) - self.offset
        if not 0 <= seen - on_bus < PROMPT:
            self.follow()
            on_bus = int(bus_time * 1e9) - self.offset
        return on_bus if 0 <= seen - on_bus < WAITED_MOST else seen


class Stamps:
    """The line that samples are stamped along; what lies behind a sample never changes.

    Attributes:
        base: What its times, in ns, are counted from, so that they keep their precision.
        knot: The last sample in front of the line's present piece.
        time: Time of that sample.
        period: Time between two samples.
    """

    def __init__(self, base: int, knot: int, time: float, period: float) -> None:
        """Begin behind a sample with its time and the time between two samples."""
        self.base, self.knot, self.time, self.period = base, knot, time, period
        self._past: deque[tuple[int, float, float]] = deque(maxlen=PIECES)

    def at(self, number: int) -> float:
        """Return the time of a sample."""
        knot, there, period = self.piece(number)
        return there + (number - knot) * period

    def piece(self, number: int) -> tuple[int, float, float]:
        """Return the piece on which a sample lies: what is in front of it, when, and the period."""
        if number > self.knot or not self._past:
            return self.knot, self.time, self.period
        return next((piece for piece in reversed(self._past) if number > piece[0]), self._past[0])

    def lay(self, knot: int, there: float, period: float) -> None:
        """Go on from a time behind a sample."""
        if knot > self.knot:
            self._past.append((self.knot, self.time, self.period))
        self.knot, self.time, self.period = knot, there, period

    def approach(self, knot: int, target: float, pace: float, samples: int) -> None:
        """Turn behind a sample, to meet another line.

        Args:
            knot: The sample.
            target: Where the other line is there.
            pace: Time between two samples on the other line.
            samples: For how many samples it goes on like that at least.
        """
        here = self.at(knot)
        slew = (target - here) / max(CATCH_UP, samples * pace)
        self.lay(knot, here, pace * (1 + min(max(slew, -SLEW), SLEW)))

    def keep_before(self, arrival: float, number: int, estimate: float) -> bool:
        """Stamp a sample before its arrival; return whether 1 % of the pace did not suffice.

        More samples may follow at the same time, so some room is left for them.
        """
        samples, before = number - self.knot, self.period
        if samples <= 0 or self.time + samples * before <= arrival:
            return False
        room = max(arrival - self.time, 2.0 * samples)  # 2 ns for each: rising is what counts most
        self.period = min(max(estimate - self.time, room / 2), room) / samples
        return self.period < before * (1 - SLEW)


class SampleClock:
    """Maps sample numbers to monotonic times in ns.

    Attributes:
        nominal_period: Time between two samples in ns, as it should be.
        settled: Whether enough has arrived for stamps that stay good.
        breaks: How often stamps left the sensor's pace, beside the start.
    """

    def __init__(self, rate: float, tolerance: float = TOLERANCE, jitter: float = JITTER, *,
                 waits: bool = False) -> None:
        """Begin a stream.

        Args:
            rate: Nominal rate in Hz.
            tolerance: Standard deviation of its error, in relation to it.
            jitter: What the least delays of blocks (of frames, at a slow rate) vary by, in ns.
            waits: Whether nobody asks for a time before the clock has settled, at the start and
                after a break: then it need not guess.
        """
        self.nominal_period = 1e9 / rate
        self.settled = False
        self.breaks = 0
        self._mean_delay = self._mean_square = 0.0
        self._waits = waits
        self._prior = Prior(0.0, tolerance, jitter)
        self._numbers: list[int] = []
        self._arrivals: list[int] = []
        self._newest = 0
        self._largest_delays: deque[float] = deque(maxlen=MEMORY)
        self._line = Line(0.0, 0.0, 0.0, math.inf, tolerance)
        self._envelope = Envelope(self._prior)
        self._stamps = Stamps(0, 0, 0.0, self.nominal_period)
        self._away = BACK_OFF  # of the stamps from the estimate
        self._started = self._queues = False
        self._next_look = self._last_number = -math.inf

    def update(self, number: int, arrival: int) -> None:
        """Take the arrival of a frame.

        Args:
            number: Number of the frame's last sample.
            arrival: Monotonic time in ns when the frame was there.
        """
        stamps = self._stamps
        self._numbers.append(number)
        self._arrivals.append(arrival)
        if not (stamps.time + (number - stamps.knot) * stamps.period <= arrival - stamps.base
                < self._next_look and stamps.knot < number <= self._last_number):
            self._look(number, arrival - stamps.base)  # one of some hundred frames

    def time_of(self, number: int) -> int:
        """Return the monotonic time in ns at which a sample was taken."""
        stamps = self._stamps
        if number > stamps.knot:
            return stamps.base + int(stamps.time + (number - stamps.knot) * stamps.period)
        return stamps.base + int(stamps.at(number))

    @property
    def period(self) -> float:
        """Time between two samples in ns as the newest are stamped."""
        return self._stamps.period

    def period_at(self, number: int) -> float:
        """Return the time in ns from the sample in front of a sample to it, as they are stamped."""
        return self._stamps.piece(number)[2]

    @property
    def drift(self) -> float:
        """How much slower the sensor's clock runs than its nominal rate, as a fraction."""
        return self._line.drift

    @property
    def uncertainty(self) -> float:
        """Standard deviation of the stamps in ns, beside a constant delay."""
        return math.hypot(self._line.uncertainty, SYSTEMATIC, self._away)

    @property
    def jitter(self) -> float:
        """Standard deviation of the frames' delays in ns."""
        return math.sqrt(max(self._mean_square - self._mean_delay ** 2, 0.0))

    @property
    def delay_spread(self) -> float:
        """Difference between the largest and the least delay of late in ns."""
        return max(self._largest_delays, default=0.0)

    def settle(self) -> None:
        """Take the estimate as it is, because no more will come."""
        if not self.settled:
            self._settle()

    def _look(self, number: int, arrival: int) -> None:
        """Learn from a block that ended, or from a frame that comes before its stamp."""
        if self._started and number < self._newest - RESTART / self.nominal_period:
            self._started = False
            self.breaks += 1
            arrival += self._stamps.base
        if not self._started:
            self._start(number, arrival)
            return
        self._newest = max([self._newest, *self._numbers[:-1]])
        if self._estimate(number) - arrival > self._early_limit:
            self._follow_another_stream(number, arrival)
        elif arrival >= self._block_end or number > self._last_number:
            self._learn(arrival)
        self._turn(number, arrival)
        self._newest = max(self._newest, number)

    def _start(self, number: int, arrival: int) -> None:
        base = arrival - round(number * self.nominal_period)
        arrival -= base
        self._started, self._newest = True, number
        del self._numbers[:-1], self._arrivals[:-1]
        self._stamps = Stamps(base, number, arrival - BACK_OFF, self.nominal_period)
        self._line = replace(self._line, due=float(arrival), late=0.0)
        self._begin_anew(arrival)

    # --- the estimate ---

    def _estimate(self, number: int) -> float:
        due = number * self.nominal_period
        return due + self._line.at(due)

    @property
    def _early_limit(self) -> float:
        """How much too early in ns a frame of the stream can be."""
        begins = len(self._envelope) < START_POINTS
        return max(START_EARLY if begins else EARLY, JITTERS * self._prior.jitter,
                   EXCESSES * self._envelope.excess)

    @property
    def _late_limit(self) -> float:
        """How late in ns all frames of a block can be without having waited."""
        return max(LATE, JITTERS * self._prior.jitter, JITTERS * self.jitter,
                   EXCESSES * self._envelope.excess)

    @property
    def _growth_limit(self) -> float:
        """By how much in ns the least lateness of blocks can grow where the host keeps pace."""
        return max(LATE, JITTERS * self._prior.jitter, GROWTH * self._envelope.excess)

    def _begin_anew(self, arrival: float) -> None:
        """Forget all but the drift, where that is known by now."""
        if len(self._envelope) >= KNOWN_BLOCKS:
            self._prior = self._envelope.learnt()
        self._envelope = Envelope(self._prior)
        self._queue: Queue | None = None
        self._late: list[tuple[float, float, float]] = []
        self._late_since = arrival
        self._begun, self.settled = arrival, False
        self._block_end = self._next_look = arrival + FIRST_BLOCK
        self._last_number = self._newest + CATCH_UP / self.nominal_period

    def _follow_another_stream(self, number: int, arrival: int) -> None:
        """Begin anew with a frame that comes too early to be of the stream so far."""
        self.breaks += self.settled
        due = number * self.nominal_period
        self._line = replace(self._line, due=due, late=arrival - due)
        del self._numbers[:-1], self._arrivals[:-1]
        self._begin_anew(arrival)
        stamps, here = self._stamps, self._stamps.at(self._newest)
        if arrival < here - SET_BACK:
            here = arrival - BACK_OFF - (number - self._newest) * self.nominal_period
            self._stamps = Stamps(stamps.base, self._newest, here, self.nominal_period)
        else:
            stamps.lay(self._newest, here, self.nominal_period)

    def _learn(self, arrival: int) -> None:
        """Learn from the frames of a block."""
        due = np.array(self._numbers, np.float64) * self.nominal_period
        late = np.array(self._arrivals, np.int64) - self._stamps.base - due
        self._numbers.clear()
        self._arrivals.clear()
        delays = late - (self._line.late + self._line.drift * (due - self._line.due))
        least = int(delays.argmin())
        point = float(due[least]), float(late[least])
        self._block_end = arrival + min(FIRST_BLOCK * 2 ** min(len(self._envelope), 9), BLOCK)
        self._last_number = self._newest + CATCH_UP / self.nominal_period
        if delays[least] > self._late_limit and len(self._envelope):
            self._follow_a_pause(arrival, point)
            return
        self._late.clear()
        self._fit(point, due, late)
        self._note_delays(delays)
        jitters_less = len(self._envelope) >= START_BLOCKS and self._envelope.excess < QUEUE_EXCESS
        if not self.settled and (jitters_less or arrival - self._begun >= START):
            self._settle()

    def _note_delays(self, delays: Floats) -> None:
        self._largest_delays.append(float(delays.max()))
        usual = np.minimum(delays, WAITED)
        share = 1 / min(len(self._envelope), MEMORY)
        self._mean_delay += share * (float(usual.mean()) - self._mean_delay)
        self._mean_square += share * (float(usual @ usual) / len(usual) - self._mean_square)

    def _follow_a_pause(self, arrival: int, point: tuple[float, float]) -> None:
        """Begin anew where all has been late for long and remains so."""
        late = self._late
        if not late:
            self._late_since = arrival
        late.append((arrival, *point))
        grown = point[1] - late[0][2]
        falls_behind = grown > self._growth_limit and arrival - self._late_since < FALLING_BEHIND
        if falls_behind or grown < -self._late_limit:
            del late[:-1]  # a backlog, which grows or shrinks
        if arrival - late[0][0] < STEADY or len(late) < STEADY_BLOCKS:
            return
        self.breaks += 1
        self._begin_anew(arrival)
        for _, *there in late:
            self._line = self._envelope.add(*there)
        self._stamps.lay(self._newest, self._stamps.at(self._newest), self.nominal_period)

    def _fit(self, point: tuple[float, float], due: Floats, late: Floats) -> None:
        """Make the estimate anew from the least delay of a block, or from all its frames."""
        line = self._envelope.add(*point)
        excess = self._envelope.excess
        if excess < QUEUE_EXCESS / 2:
            self._queue = None
        elif (self._queue is None and excess > QUEUE_EXCESS and len(due) >= QUEUE_FRAMES
              and len(self._envelope) >= START_BLOCKS):
            self._queue = Queue(self._prior)
        self._queues = False
        if self._queue is not None:
            line = replace(line, uncertainty=max(line.uncertainty, excess / 3))
            queue_line = self._queue.add(due, late)
            if queue_line is not None:
                depth = line.late - queue_line.at(line.due)
                self._queues = self._queue.explains(depth)
                line = self._envelope.lowered(queue_line) if self._queues else line
        self._line = line

    # --- the stamps ---

    def _settle(self) -> None:
        self.settled = True
        stamps = self._stamps
        if self._waits:
            start = self._estimate(stamps.knot) - self._margin(0.0)
            stamps.lay(stamps.knot, max(start, stamps.at(stamps.knot)),
                       self.nominal_period * (1 + self._line.drift))

    def _margin(self, gap: float) -> float:
        """Return how far before the estimate to stamp in ns, after a gap without frames in ns."""
        if not len(self._envelope):
            return BACK_OFF
        line = self._line
        by_drift = UNCERTAINTIES * line.drift_uncertainty * gap
        if self._queues:
            return QUEUE_MARGIN + by_drift
        return min(MARGIN + UNCERTAINTIES * line.uncertainty, MARGIN_MAX) + by_drift

    def _turn(self, number: int, arrival: int) -> None:
        """Turn the stamps towards the estimate, from this frame on."""
        early = self._estimate(number) - arrival
        if early > 0:
            self._line = replace(self._line, late=self._line.late - early)
        self._next_look = self._block_end
        if self._waits and not self.settled:
            return
        stamps, knot = self._stamps, self._newest
        pace = self.nominal_period * (1 + self._line.drift)
        margin = self._margin((number - knot) * pace)
        estimate = self._estimate(knot)
        target = estimate - margin
        if not self.settled and target > stamps.at(knot):
            stamps.lay(knot, target, pace)
        else:
            stamps.approach(knot, target, pace, number - knot)
        self._away = estimate - stamps.at(knot)
        if stamps.keep_before(arrival, number, self._estimate(number) - margin):
            self.breaks += arrival - self._begun >= START
            self._next_look = -math.inf
