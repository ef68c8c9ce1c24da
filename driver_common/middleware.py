# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""How the threads of the middleware share a processor with the one that publishes."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

EVENT_THREAD = "dds.ev"  # begin of its name in Fast DDS


def let_events_wait() -> None:
    """Have timed events of the middleware, such as heartbeats, wait for a pause in publishing.

    Each message sets such a timer, so the kernel would change to its thread and back twice a
    message. As batch work the thread begins when the publishing one pauses, or at its turn.
    """
    for task in Path("/proc/self/task").iterdir():
        with contextlib.suppress(OSError):  # it ended, or this is not allowed here
            if (task / "comm").read_text().startswith(EVENT_THREAD):
                os.sched_setscheduler(int(task.name), os.SCHED_BATCH, os.sched_param(0))
