# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Pauses of this host: when a process was suspended or starved, or the whole machine slept.

What gets lost then was lost here, and not on the way.
"""

from __future__ import annotations

import math
import time

NOTEWORTHY = 0.25  # s beyond what a step should take
CATCH_UP = 1.0  # s after a pause, and as long as it again, in which its backlog is read
CLOCK = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)  # goes on while the machine sleeps


class HostPauses:
    """Notices pauses of a thread that says before each wait how long that takes at most.

    Attributes:
        count: How many there were.
        longest: The longest one in s.
        lost: Frames that were lost in them.
    """

    def __init__(self) -> None:
        """Begin with none, at rest."""
        self.count = 0
        self.longest = 0.0
        self.lost = 0
        self._due = math.inf
        self._caught_up = 0.0

    def watch(self) -> None:
        """Look for pauses from now on."""
        self._due = time.clock_gettime(CLOCK)

    def rest(self) -> None:
        """Look for none until `watch`: the thread may wait for as long as it likes."""
        self._due = math.inf

    def wait(self, seconds: float) -> None:
        """Tell that this thread waits now, for some s at most, before it comes here again."""
        if self._due == math.inf:
            return
        now = time.clock_gettime(CLOCK)
        pause = now - self._due
        if pause > NOTEWORTHY:
            self.count += 1
            self.longest = max(self.longest, pause)
            self._caught_up = now + CATCH_UP + pause
        self._due = now + seconds

    def count_lost(self, frames: int) -> None:
        """Count frames that were just found to be lost, if that was because of a pause."""
        if time.clock_gettime(CLOCK) < self._caught_up:
            self.lost += frames
