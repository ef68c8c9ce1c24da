# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The time of measurements that come once in a regular cycle, through an adapter that is polled.

The same model as for the samples of a stream (`driver_common.sample_clock`), at some cycles per
second. The cycle is known to some percent only, one can pass without a measurement, and not every
device keeps it: where the cycles do not prove to be regular, the arrival is the time.
"""

from __future__ import annotations

import math
from collections import deque

from driver_common.sample_clock import SampleClock

TOLERANCE = 0.01  # standard deviation of the cycle time, in relation to it
POLLS = 8e6  # ns; half of what adapters hold back
REGULAR = 20  # measurements by which it is judged
SPREAD = 0.4  # of a cycle, by which delays of regular cycles may differ
EARLY = 0.02  # of a cycle that a measurement may come before its time


class CycleClock:
    """Gives measurements their time.

    Attributes:
        clock: The clock of the cycles.
        is_regular: Whether the last measurements kept the cycle.
        breaks: How often the device began its cycles anew.
    """

    def __init__(self, cycle_time: float) -> None:
        """Begin with the nominal cycle time in s."""
        self._cycle_time = cycle_time
        self._last = 0
        self.breaks = 0
        self._begin()

    def _begin(self) -> None:
        self.clock = SampleClock(1 / self._cycle_time, TOLERANCE, POLLS)
        self.is_regular = False
        self._number = -1
        self._breaks = 0
        self._delays: deque[float] = deque(maxlen=REGULAR)

    def stamp(self, arrival: int) -> int:
        """Return the time of a measurement that arrived at `arrival`; both in monotonic ns."""
        clock = self.clock
        self._number += 1
        if self._number:
            period = clock.nominal_period * (1 + clock.drift)
            waited = arrival - clock.time_of(self._number - 1)
            self._number += max(math.floor(waited / period + EARLY), 1) - 1
        clock.update(self._number, arrival)
        stamp = clock.time_of(self._number)
        if clock.breaks != self._breaks:
            self._breaks = clock.breaks
            self._delays.clear()
        self._delays.append(arrival - stamp)
        self._judge()
        if not self.is_regular:
            stamp = arrival
        self._last = min(max(stamp, self._last + 1), arrival)
        return self._last

    def _judge(self) -> None:
        """Decide by the last delays, without the largest, whether the cycles are regular."""
        self.is_regular = False
        if len(self._delays) < REGULAR or not self.clock.settled:
            return
        least, *_, largest, _ = sorted(self._delays)
        spread = largest - least
        self.is_regular = spread < SPREAD * self.clock.nominal_period
        if self.is_regular and least > spread:  # all are late: the device began anew
            self.breaks += 1
            self._begin()
