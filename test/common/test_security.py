# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a running node opens to others: nothing listens but DDS."""

from __future__ import annotations

from pathlib import Path

import pytest
from nodes import NodeProcess, Ros

LISTEN = "0A"  # state of a TCP socket in /proc/net/tcp
NODES = {
    "isys_radar": ("isys_radar_driver.node", {"serial_port": "loop://"}),
    "icotronic": ("icotronic_driver.node", {"can_interface": "virtual"}),
    "uc4000": ("uc4000_driver.node", {"serial_port": "loop://"}),
}


def sockets(process, protocol):
    """Return the lines of /proc/net for the sockets of a process, as words."""
    held = {link.readlink().name for link in Path(f"/proc/{process}/fd").iterdir()}
    rows = [line.split() for family in ("", "6")
            for line in Path(f"/proc/{process}/net/{protocol}{family}").read_text()
            .splitlines()[1:]]
    return [row for row in rows if f"socket:[{row[9]}]" in held]


@pytest.mark.parametrize("name", NODES)
def test_nothing_listens_but_dds(name):
    module, parameters = NODES[name]
    with Ros() as ros, NodeProcess(module, parameters) as process:
        ros.remote(f"/{name}").names()
        assert not [row for row in sockets(process.number, "tcp") if row[3] == LISTEN]
        assert sockets(process.number, "udp")  # so those of the process are found
