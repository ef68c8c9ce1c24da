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
from xml.etree import ElementTree

import pytest
from nodes import NodeProcess, Ros

LISTEN = "0A"  # state of a TCP socket in /proc/net/tcp
NODES = {
    "isys_radar": ("isys_radar_driver.program", {"serial_port": "loop://"}),
    "icotronic": ("icotronic_driver.program", {"can_interface": "virtual"}),
    "uc4000": ("uc4000_driver.program", {"serial_port": "loop://"}),
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
        own = len(sockets(process.number, "udp"))
    with Ros() as ros, NodeProcess("bench.bare_node", {"rate": 0.0}) as process:
        ros.remote("/bare").names()
        assert own == len(sockets(process.number, "udp")) > 0  # those of the middleware


POLICIES = Path(__file__).resolve().parents[2] / "config" / "security"
SIMULATED = {
    "isys_radar": ("serial_port", ("sim://iSYS-4001", "sim://iSYS-6003")),
    "icotronic": ("can_interface", ("sim",)),
    "uc4000": ("serial_port", ("sim://UC4000",)),
}


def graph(ros, name):
    """Return what a node publishes, subscribes to, answers and asks, its own names with ~."""
    def names(found):
        return {topic.replace(f"/{name}/", "~/").removeprefix("/") for topic, _ in found(name, "/")}

    node = ros.node
    return (names(node.get_publisher_names_and_types_by_node),
            names(node.get_subscriber_names_and_types_by_node),
            names(node.get_service_names_and_types_by_node),
            names(node.get_client_names_and_types_by_node))


def allowed(name):
    """Return what the policy of a node allows, in the order of `graph`."""
    profile = ElementTree.parse(POLICIES / f"{name}.xml").find(f".//profile[@node='{name}']")
    return tuple({one.text for one in profile.findall(f"{group}[@{verb}='ALLOW']/{group[:-1]}")}
                 for group, verb in (("topics", "publish"), ("topics", "subscribe"),
                                     ("services", "reply"), ("services", "request")))


@pytest.mark.parametrize("name", SIMULATED)
def test_a_policy_allows_what_its_node_does_and_no_more(name):
    parameter, devices = SIMULATED[name]
    policy, seen = allowed(name), [set(), set(), set(), set()]
    for device in devices:
        with Ros() as ros, NodeProcess(NODES[name][0], {parameter: device}):
            remote = ros.remote(f"/{name}")
            ros.wait_until(lambda remote=remote: remote.state() == "active")
            ros.wait_until(lambda ros=ros: name in ros.node.get_node_names())
            ros.wait(lambda seen=seen, ros=ros: _add(seen, graph(ros, name)) == list(policy), 20.0
                     if device == devices[-1] else 5.0)
    assert seen == list(policy)


def _add(seen, more):
    for names, new in zip(seen, more, strict=True):
        names |= new
    return seen
