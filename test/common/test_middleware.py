# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The middleware's event thread waits for the one that publishes, and no other thread does."""

import os
from pathlib import Path

import pytest
from nodes import NodeProcess

from driver_common.middleware import EVENT_THREAD


def test_only_the_event_thread_waits():
    with NodeProcess("uc4000_driver.program", {"serial_port": "sim://UC4000"}) as process:
        process.wait_for_line("connected to")
        policies = {(task / "comm").read_text().strip(): os.sched_getscheduler(int(task.name))
                    for task in Path(f"/proc/{process.number}/task").iterdir()}
    events = {name for name in policies if name.startswith(EVENT_THREAD)}
    if not events:
        pytest.skip("another middleware")
    assert {name for name, policy in policies.items() if policy == os.SCHED_BATCH} == events
