# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The time that a thread lives in: this host's, or that of a recording which it plays.

Drivers import it in the place of the module `time`. So everything that happens on a bus, with all
its time-outs and pauses, happens in a replay when it happened in the recording, while the rest of
the program lives in its own time.
"""

from __future__ import annotations

import threading
import time

SECOND = 1_000_000_000  # ns
READING = 100  # ns that pass while a clock is read


class _Thread(threading.local):
    clock: ReplayClock | None = None


_thread = _Thread()


class ReplayClock:
    """The time in a recording. It passes where somebody waits, and never goes back.

    Attributes:
        now: Monotonic time in ns.
        offset: The time of day minus the monotonic time in ns.
        rate: How much faster than the host's time it passes, 0 = as fast as can be.
    """

    def __init__(self, now: int, offset: int) -> None:
        """Stop at a time."""
        self.now = now
        self.offset = offset
        self.rate = 1.0
        self._anchor = now, time.monotonic()

    def jump(self, to: int) -> None:
        """Be at a time, without what is between."""
        self.now = max(self.now, to)
        self._anchor = self.now, time.monotonic()

    def hurry(self, to: int) -> None:
        """Be at a time that is near; the host's time follows where somebody waits next."""
        self.now = max(self.now, to)

    def pass_until(self, to: int) -> None:
        """Let time pass until then."""
        self.now = max(self.now, to)
        if behind := self.behind:
            time.sleep(behind)

    @property
    def behind(self) -> float:
        """How much of the host's time in s is still to pass."""
        if not self.rate:
            return 0.0
        begin, host_begin = self._anchor
        return max(0.0, host_begin + (self.now - begin) / SECOND / self.rate - time.monotonic())


def use(clock: ReplayClock | None) -> None:
    """Have this thread live in the time of a recording; None = in the host's."""
    _thread.clock = clock


def monotonic() -> float:
    """Return the monotonic time in s."""
    clock = _thread.clock
    if clock is None:
        return time.monotonic()
    clock.now += READING  # so what comes later is later here, too
    return clock.now / SECOND


def time_ns() -> int:
    """Return the time of day in ns since the epoch."""
    clock = _thread.clock
    return time.time_ns() if clock is None else clock.now + clock.offset


def sleep(seconds: float) -> None:
    """Let time pass."""
    clock = _thread.clock
    if clock is None:
        time.sleep(seconds)
    else:
        clock.pass_until(clock.now + int(seconds * SECOND))


def host_offset() -> int:
    """Return this host's time of day minus its monotonic time in ns."""
    # The largest of some differences: whatever comes between two readings makes them smaller.
    return max(time.time_ns() - time.monotonic_ns() for _ in range(3))


def waited(seconds: float) -> float:
    """Let time pass, and return how long in s of the host's time is to be waited for that."""
    clock = _thread.clock
    if clock is None:
        return seconds
    clock.now += int(seconds * SECOND)
    return clock.behind
