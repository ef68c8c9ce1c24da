# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Synthetic arrivals of a stream, whose truth is known, and what a clock makes of them.

Nothing here takes real time. The stream is that of the ICOtronic sensor: 9523.8 values a second,
3 in a frame, with a constant delay on the path; then comes what a trial is about.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from driver_common.sample_clock import SampleClock

Floats = npt.NDArray[np.float64]
Delays = Callable[[Floats, np.random.Generator], Floats]

RATE = 9523.8
PERIOD = 1e9 / RATE  # ns
PATH = 1e6  # ns of constant delay
START = 5 * 10**14  # ns on the monotonic clock, which may run for days
SAMPLES = 3  # in a frame


@dataclass
class Trial:
    """What came of a stream.

    Attributes:
        seconds: When each frame's last sample was measured, from the first on.
        errors: Stamp of each frame's last sample against truth and constant delay, in ms.
        steps: Deviation of the pace between neighbouring samples, in relation to it.
        step_seconds: When these were measured.
        back: How many stamps are not later than the one before.
        future: How many stamps are later than their frame arrived.
        uncertainty: What the clock said of itself at each frame, in ms.
        clock: The clock afterwards.
    """

    seconds: Floats
    errors: Floats
    steps: Floats
    step_seconds: Floats
    back: int
    future: int
    uncertainty: Floats
    clock: SampleClock

    def error(self, begin: float, end: float = np.inf, share: float = 0.99) -> float:
        """Return the error in ms that a share of the frames of a time in s keeps."""
        chosen = self.errors[(self.seconds >= begin) & (self.seconds < end)]
        return float(np.quantile(np.abs(chosen), share))

    def largest_step(self, begin: float) -> float:
        """Return the largest deviation of the pace after a time in s."""
        return float(np.abs(self.steps[self.step_seconds > begin]).max())


def numbers_of(seconds: float, first: int = 0) -> Floats:
    """Return the number of the last sample of each frame."""
    return np.arange(first + SAMPLES - 1, first + int(seconds * RATE), SAMPLES, dtype=np.float64)


def run(delays: Delays, drift: float = 0.0, seconds: float = 12.0, seed: int = 0) -> Trial:
    """Return what a clock makes of a stream whose frames are delayed."""
    numbers = numbers_of(seconds)
    measured = numbers * PERIOD * (1 + drift)
    return feed(SampleClock(RATE), numbers, measured,
                delays(measured + PATH, np.random.default_rng(seed)), drift)


def feed(clock: SampleClock, numbers: Floats, measured: Floats, arrivals: Floats,
         drift: float = 0.0) -> Trial:
    """Return what a clock makes of frames with the time they were measured, and arrived, in ns."""
    stamps = np.empty((len(numbers), SAMPLES))
    uncertainty = np.empty(len(numbers))
    frames = zip(numbers.astype(int).tolist(), np.ceil(arrivals).astype(int).tolist(), strict=True)
    for frame, (number, arrival) in enumerate(frames):
        clock.update(number, START + arrival)
        stamps[frame] = [clock.time_of(number + one - SAMPLES + 1) - START
                         for one in range(SAMPLES)]
        uncertainty[frame] = clock.uncertainty
    each = (numbers[:, None] + np.arange(1 - SAMPLES, 1)).ravel()
    differences = np.diff(stamps.ravel())
    return Trial(
        measured * 1e-9, (stamps[:, -1] - measured - PATH) * 1e-6,
        differences / (np.diff(each) * PERIOD * (1 + drift)) - 1,
        np.repeat(measured, SAMPLES)[1:] * 1e-9, int((differences <= 0).sum()),
        int((stamps[:, -1] > np.ceil(arrivals)).sum()), uncertainty * 1e-6, clock)


# --- what delays frames --------------------------------------------------------------------------

def nothing(sent: Floats, noise: np.random.Generator) -> Floats:
    """Let each frame arrive at once."""
    return sent


def independent(mean: float) -> Delays:
    """Delay each frame by itself, exponentially, by a mean in ms; they may overtake each other."""
    return lambda sent, noise: sent + noise.exponential(mean * 1e6, len(sent))


def in_order(mean: float) -> Delays:
    """Delay each frame like that, but let none overtake another."""
    return lambda sent, noise: np.maximum.accumulate(independent(mean)(sent, noise))


def poll(interval: float) -> Delays:
    """Hand frames over when an adapter is polled, every so many ms."""
    return lambda sent, noise: np.ceil(sent / (interval * 1e6)) * interval * 1e6


def pauses(sent: Floats, noise: np.random.Generator) -> Floats:
    """Let the host pause for 10 ms at random, ten times a second in the mean."""
    begins = np.cumsum(10e6 + noise.exponential(90e6, int(sent[-1] / 50e6)))
    last = np.searchsorted(begins, sent, side="right") - 1
    ends = np.where(last >= 0, begins[last] + 10e6, 0.0)
    return np.maximum(sent, ends)


def host_falls_behind(begin: float, length: float, pace: float) -> Delays:
    """From a time on, let the host take frames at so much of their pace for s, then the rest."""
    def delays(sent: Floats, noise: np.random.Generator) -> Floats:
        behind = (sent >= begin * 1e9) & (sent < (begin + length) * 1e9)
        costs = np.where(behind, SAMPLES * PERIOD / pace, 20e3)
        arrivals, free = independent(0.05)(sent, noise), 0.0
        for place, cost in enumerate(costs.tolist()):
            free = arrivals[place] = max(arrivals[place], free + cost)
        return arrivals
    return delays


def host_pause(begin: float, length: float, frame_cost: float) -> Delays:
    """Let the host pause at a time, for some s, and then take a frame every `frame_cost` s."""
    def delays(sent: Floats, noise: np.random.Generator) -> Floats:
        arrivals = independent(0.2)(sent, noise)
        late = (sent >= begin * 1e9) & (sent < (begin + length) * 1e9)
        backlog = (begin + length + np.arange(late.sum()) * frame_cost) * 1e9
        arrivals[late] = np.maximum(backlog, sent[late])
        return np.maximum.accumulate(arrivals)
    return delays
