# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Samples in bulk: raw values to accelerations, and what a stream brought in a period as arrays.

Frames are kept as they come and turned into times and accelerations all at once: so a sample costs
a few nanoseconds in NumPy instead of some microseconds in Python.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from icotronic_driver.laws import ADC_MAX

LATE = 500_000_000  # ns after the end of a period in which its samples can still be on the way

Table = npt.NDArray[np.float32]
Take = Callable[[int, int, tuple[int, ...]], None]


class Samples(NamedTuple):
    """Samples, oldest first.

    Attributes:
        stamps: Times of measurement in ns since the epoch.
        accelerations: In m/s², shape (samples, 3) for x, y and z; 0 where an axis is not
            measured.
    """

    stamps: npt.NDArray[np.int64]
    accelerations: npt.NDArray[np.float32]

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.stamps)


NOTHING = Samples(np.empty(0, np.int64), np.empty((0, 3), np.float32))


class Conversion:
    """Raw values of the streamed channels to accelerations along x, y and z, by tables.

    A table has the acceleration of each of the 65536 raw values, as FLOAT32: 24 bits for the 16 of
    the ADC. So it is the same number wherever it is published.

    Attributes:
        channels: Number of streamed channels.
        tables: Per axis: which channel it is, and the table of that; axes not measured are missing.
    """

    def __init__(self, laws: Sequence[Callable[[npt.NDArray[np.float64]], npt.NDArray[np.float64]]],
                 axes: Sequence[int | None]) -> None:
        """Make the tables.

        Args:
            laws: Per channel: raw values to m/s².
            axes: Per channel: its axis, 0 … 2 for x, y, z, 3 … 5 for −x, −y, −z; None where it is
                no acceleration.
        """
        raw = np.arange(ADC_MAX + 1, dtype=np.float64)
        self.channels = len(laws)
        self.tables: dict[int, tuple[int, Table]] = {}
        for channel, (law, axis) in enumerate(zip(laws, axes, strict=True)):
            if axis is None:
                continue
            sign = -1.0 if axis >= 3 else 1.0
            self.tables[axis % 3] = channel, (sign * law(raw)).astype(np.float32)

    def accelerations(self, raw: npt.NDArray[np.integer]) -> npt.NDArray[np.float32]:
        """Return accelerations, shape (samples, 3), of raw values, shape (samples, channels)."""
        result = np.zeros((len(raw), 3), np.float32)
        for axis, (channel, table) in self.tables.items():
            result[:, axis] = table[raw[:, channel]]
        return result

    def columns(self) -> tuple[tuple[int, list[float]], ...]:
        """Return channel and table for each of x, y and z, for one sample at a time."""
        nothing = 0, [0.0] * (ADC_MAX + 1)
        return tuple((self.tables[axis][0], self.tables[axis][1].tolist())
                     if axis in self.tables else nothing for axis in range(3))


class Gatherer:
    """Gathers the samples of each period, and hands them over when it is complete.

    The periods are those of the clock of the stamps: period k begins at k times its length since
    the epoch. So what belongs together follows from the stamps alone, whoever gathers them.
    """

    def __init__(self, period: float, conversion: Conversion,
                 use: Callable[[Samples], None]) -> None:
        """Gather for `period` s at a time; `use` gets the samples of each period."""
        self._period = round(period * 1e9)
        self._conversion = conversion
        self._use = use
        self._begin = self._end = 0
        self._seen = 0, 0  # begin of the period and its frames at the last look
        self._firsts: list[int] = []
        self._steps: list[int] = []
        self._values: list[int] = []
        self._rest = NOTHING

    def take(self, stamp: int, step: int, values: tuple[int, ...]) -> None:
        """Take a frame: time of its first sample and from one to the next in ns, raw values."""
        self._firsts.append(stamp)
        self._steps.append(step)
        self._values += values
        if not self._begin <= stamp < self._end:
            self._begin = stamp - stamp % self._period
            self._end = self._begin + self._period
            if len(self._firsts) > 1 or len(self._rest):
                self._hand_over()

    def finish(self) -> None:
        """Hand over what is there, because nothing more will come for this period."""
        self._hand_over()
        if len(self._rest):
            self._use(self._rest)
        self._rest = NOTHING
        self._begin = self._end = 0

    def is_late(self, now: int) -> bool:
        """Whether a period that has something is over since at least `LATE` at `now` in ns.

        While frames come it is not: they may have waited for a busy host.
        """
        state = self._begin, len(self._firsts)
        nothing_came, self._seen = state == self._seen, state
        return (nothing_came and bool(self._firsts or len(self._rest))
                and now > self._end + LATE)

    def _hand_over(self) -> None:
        """Hand over all periods but the last, which may not be complete."""
        *complete, self._rest = split_periods(self._decode(), self._period)
        for samples in complete:
            self._use(samples)

    def _decode(self) -> Samples:
        """Return what was gathered, and forget the frames."""
        if not self._firsts:
            return self._rest
        raw = np.array(self._values, np.uint16).reshape(-1, self._conversion.channels)
        first, step = np.array(self._firsts), np.array(self._steps)
        places = np.arange(len(raw) // len(first))
        stamps = (first[:, None] + step[:, None] * places).reshape(-1)
        for taken in (self._firsts, self._steps, self._values):
            taken.clear()
        accelerations = self._conversion.accelerations(raw)
        if not len(self._rest):
            return Samples(stamps, accelerations)
        return Samples(np.concatenate((self._rest.stamps, stamps)),
                       np.concatenate((self._rest.accelerations, accelerations)))


def split_periods(samples: Samples, period: int) -> list[Samples]:
    """Return the samples of each period of so many ns since the epoch."""
    numbers = samples.stamps // period
    edges = [0, *(np.flatnonzero(np.diff(numbers)) + 1).tolist(), len(samples)]
    return [Samples(samples.stamps[first:last], samples.accelerations[first:last])
            for first, last in itertools.pairwise(edges)]


class Consumer(NamedTuple):
    """Somebody for whom samples are made, as long as anybody listens.

    Attributes:
        listeners: Returns how many listen.
        take: Takes a frame: time of its first sample and from one to the next in ns, raw values.
        gatherer: What gathers frames for it; None = it gets each at once.
    """

    listeners: Callable[[], int]
    take: Take
    gatherer: Gatherer | None = None


class Stream:
    """Hands the frames of a stream to those who listen: the hot path."""

    def __init__(self, consumers: Iterable[Consumer], offset: int) -> None:
        """Begin a stream, to which all listen until the first look.

        Args:
            consumers: Who may listen.
            offset: Added to all stamps, in ns.
        """
        self._consumers = tuple(consumers)
        self._offset = offset
        self._listening = self._consumers
        self._takes = tuple(consumer.take for consumer in self._listening)

    def take(self, stamp: int, period: float, values: tuple[int, ...]) -> None:
        """Take a frame: time of its first sample and from one to the next in ns, raw values."""
        stamp += self._offset
        step = int(period)
        for take in self._takes:
            take(stamp, step, values)

    def look(self, now: int) -> bool:
        """Look who listens, at `now` in ns, and return whether anybody wants each frame at once."""
        before, self._listening = self._listening, tuple(
            consumer for consumer in self._consumers if consumer.listeners())
        self._takes = tuple(consumer.take for consumer in self._listening)
        for consumer in before:
            gatherer = consumer.gatherer
            if gatherer and (consumer not in self._listening or gatherer.is_late(now)):
                gatherer.finish()
        return any(consumer.gatherer is None for consumer in self._listening)

    def finish(self) -> None:
        """Hand over what waits, because the stream ended."""
        for consumer in self._listening:
            if consumer.gatherer:
                consumer.gatherer.finish()
