# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A program that notes what the machine does to other programs.

It wants to run every few milliseconds, and does hardly anything. By how much it is late shows
that others take the processors, or that the whole machine stood still. And it reads how long the
programs that it is told wait for a processor, which Linux counts (schedstat in proc(5)).
"""

from __future__ import annotations

import contextlib
import sys
import time
from pathlib import Path

BEAT, REPORT = 0.005, 0.25  # s
ALWAYS = 0.00015  # s by which a sleeping program is late on any machine


def main() -> None:
    """Print now and then the time, the lateness integrated over time, and how long each waited.

    The arguments are the numbers of the processes.
    """
    total, before, reported = 0.0, time.monotonic(), 0.0
    while True:
        time.sleep(BEAT)
        now = time.monotonic()
        total += (now - before) * max(0.0, now - before - BEAT - ALWAYS)
        before = now
        if now - reported >= REPORT:
            waits = [f"{waited(int(number)):.4f}" for number in sys.argv[1:]]
            print(f"{time.time():.3f} {total:.9f}", *waits, flush=True)
            reported = now


def waited(process: int) -> float:
    """Return how long in s the threads of a process have waited for a processor; 0 if unknown."""
    nanoseconds = 0
    with contextlib.suppress(OSError):  # not Linux, or it has ended
        for thread in Path(f"/proc/{process}/task").iterdir():
            with contextlib.suppress(OSError, IndexError):  # that thread has ended
                nanoseconds += int((thread / "schedstat").read_text().split()[1])
    return 1e-9 * nanoseconds
