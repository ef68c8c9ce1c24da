"""Pauses of this host: when a process was suspended or starved, or the whole machine slept.

What gets lost then was lost here, and not on the way.
"""

from __future__ import annotations

import time

NOTEWORTHY = 0.25  # s beyond what a step should take
CATCH_UP = 1.0  # s after a pause, and as long as it again, in which its backlog is read
CLOCK = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)  # goes on while the machine sleeps


class HostPauses:
    """Notices pauses, by steps that take longer than they should.

    Attributes:
        count: How many there were.
        longest: The longest one in s.
        lost: Frames that were lost in them.
    """

    def __init__(self) -> None:
        """Begin with none."""
        self.count = 0
        self.longest = 0.0
        self.lost = 0
        self._begin = 0.0
        self._until = 0.0

    def begin(self) -> None:
        """Begin a step."""
        self._begin = time.clock_gettime(CLOCK)

    def end(self, expected: float, lost: int) -> None:
        """End a step.

        Args:
            expected: How long it should take at most, in s.
            lost: Frames that were found to be lost in it; in or soon after a pause they were lost
                because of it.
        """
        now = time.clock_gettime(CLOCK)
        pause = now - self._begin - expected
        if pause > NOTEWORTHY:
            self.count += 1
            self.longest = max(self.longest, pause)
            self._until = now + CATCH_UP + pause
        if now < self._until:
            self.lost += lost
