"""When a sample was taken, on the host's clocks, from its place in the stream.

A sensor samples at a steady pace; its frames arrive late, by a changing amount, but never early.
So the earliest arrivals show the sensor's clock: the line with their slope that none of them lies
before gives each sample its time, and no sample a time in the future. The line is fitted again
once per window, which follows the drift between both clocks.

That is done on the monotonic clock, which nobody sets; `HostClock` turns it into the time of day.
"""

from __future__ import annotations

import time
from collections import deque

WINDOW = 1.0  # s of samples that give one earliest arrival
WINDOWS = 30  # earliest arrivals that the line goes through
MAX_DEVIATION = 0.02  # of the nominal rate; beyond it an estimate is no clock
RESTART = 0.5e9  # ns that a frame is too early: another stream
BACKLOG = 10e9  # ns that frames can wait for a host that was busy; beyond it, the same
LATE = 50e6  # ns of delay in a whole window: they waited, or the sensor paused unnoticed
LATE_WINDOWS = 3  # after so many of them it was the sensor


class HostClock:
    """The host's time of day against its monotonic clock.

    Attributes:
        offset: What to add to monotonic ns, for ns since the epoch.
    """

    def __init__(self) -> None:
        """Read both clocks."""
        self.follow()

    def follow(self) -> None:
        """Read both clocks, because somebody may have set or corrected the time of day."""
        # The largest of some differences: whatever comes between two readings makes them smaller.
        self.offset = max(time.time_ns() - time.monotonic_ns() for _ in range(3))


class SampleClock:
    """Maps sample numbers to monotonic times in ns: `base + origin + number * period`.

    Attributes:
        base: Time in ns near the beginning, so that `origin` keeps its precision.
        origin: Time of sample 0 in ns after `base`.
        period: Time between two samples in ns.
    """

    def __init__(self, rate: float) -> None:
        """Start with the nominal rate in Hz; the first update sets the time."""
        self.nominal_period = 1e9 / rate
        self.reset()

    def reset(self) -> None:
        """Forget everything but the nominal rate."""
        self.period = self.nominal_period
        self.base = 0
        self.origin = 0.0
        self._earliest: deque[tuple[int, int]] = deque(maxlen=WINDOWS)
        self._window_size = max(1, round(WINDOW * 1e9 / self.nominal_period))
        self._window_end = -1
        self._late_windows = 0
        self._least_delay = 0.0
        self._least_point = (0, 0)

    def update(self, number: int, arrival: int) -> None:
        """Take the arrival of a frame.

        Args:
            number: Number of the frame's last sample.
            arrival: Monotonic time in ns when the frame was there.
        """
        arrival -= self.base
        delay = arrival - (self.origin + number * self.period)
        if self._least_delay <= delay < BACKLOG and number < self._window_end:
            return  # like most frames: not the earliest of the window
        if (self._window_end < 0 or self._late_windows == LATE_WINDOWS
                or not -RESTART < delay < BACKLOG):
            self._start(number, arrival + self.base)
            return
        if number >= self._window_end:
            self._end_window(number)
            delay = arrival - (self.origin + number * self.period)
            self._least_delay, self._least_point = delay, (number, arrival)
        elif delay < self._least_delay:
            self._least_delay, self._least_point = delay, (number, arrival)
        if delay < 0:  # nothing arrives before it was measured: the line lay too late
            self.origin += delay
            self._least_delay = 0.0

    def time_of(self, number: int) -> int:
        """Return the monotonic time in ns at which a sample was taken."""
        return self.base + int(self.origin + number * self.period)

    @property
    def deviation(self) -> float:
        """How much slower the sensor's clock runs than its nominal rate, as a fraction."""
        return self.period / self.nominal_period - 1.0

    def _start(self, number: int, arrival: int) -> None:
        self.reset()
        self.base = arrival
        self.origin = -number * self.period
        self._window_end = number + self._window_size
        self._least_point = (number, 0)

    def _end_window(self, number: int) -> None:
        """Fit the line to the earliest arrivals, and begin the next window."""
        self._window_end = number + self._window_size
        if self._least_delay > LATE:
            self._late_windows += 1
            return
        self._late_windows = 0
        self._earliest.append(self._least_point)
        points = self._earliest
        if len(points) < 2:
            return
        mean_number = sum(number for number, _ in points) / len(points)
        mean_arrival = sum(arrival for _, arrival in points) / len(points)
        spread = sum((number - mean_number) ** 2 for number, _ in points)
        slope = sum((number - mean_number) * (arrival - mean_arrival)
                    for number, arrival in points) / spread
        limit = MAX_DEVIATION * self.nominal_period
        self.period = min(max(slope, self.nominal_period - limit), self.nominal_period + limit)
        self.origin = min(arrival - number * self.period for number, arrival in points)
