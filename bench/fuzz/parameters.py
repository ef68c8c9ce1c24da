# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What is fuzzed of the interface of the nodes: the parameter services of all three, at work.

Whatever is set, the services answer; a refusal has a reason in words, and changes nothing.
"""

from __future__ import annotations

import os
import struct
import tempfile
import time
from collections.abc import Callable, Sequence
from functools import cache
from random import Random
from typing import Any

from bench.fuzz.target import Target
from sensor_tools.ros_domain import claim_domain

PATIENCE = 60.0  # s for an answer; far more than anything takes
NODES = {"isys_radar": ("serial_port", "sim://iSYS-4001", "output1.range_max"),
         "icotronic": ("can_interface", "sim", "adc.prescaler"),
         "uc4000": ("serial_port", "sim://UC4000", "gain_db")}
OTHERS = ("use_sim_time", "nonsense", "", "front.address", "output1", "qos_overrides./x.depth")
KEPT = ("recording_directory",)  # not set: it is a place on this machine
TYPES = 10  # kinds of values that ROS has, with "not set"


class Nodes:
    """The nodes of all drivers with their simulators, and a client of their parameters."""

    def __init__(self) -> None:
        """Start them and wait for their devices."""
        os.environ |= {"ROS_DOMAIN_ID": str(claim_domain()),
                       "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        self._home = tempfile.TemporaryDirectory(prefix="fuzz-ros-")
        os.environ["ROS_HOME"] = os.environ["ROS_LOG_DIR"] = self._home.name

        import rclpy
        from rcl_interfaces.srv import SetParameters, SetParametersAtomically
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.node import Node
        from rclpy.signals import SignalHandlerOptions

        from icotronic_driver.node import IcotronicNode
        from isys_radar_driver.node import IsysRadarNode
        from uc4000_driver.node import Uc4000Node

        given = [word for name, (parameter, value, _) in NODES.items()
                 for word in ("-p", f"{name}:{parameter}:={value}")]
        rclpy.init(args=["--ros-args", "--log-level", "fatal", *given],
                   signal_handler_options=SignalHandlerOptions.NO)
        self.executor = SingleThreadedExecutor()
        self.nodes = [IsysRadarNode(), IcotronicNode(), Uc4000Node()]
        client = Node("fuzz")
        for node in (*self.nodes, client):
            self.executor.add_node(node)
        self._clients = {
            (node.get_name(), atomic): client.create_client(
                kind, f"{node.get_name()}/{name}")
            for node in self.nodes
            for kind, name, atomic in ((SetParameters, "set_parameters", False),
                                       (SetParametersAtomically, "set_parameters_atomically",
                                        True))}
        for node in self.nodes:
            node.trigger_configure()
            node.trigger_activate()
        self.until(lambda: all(node.has_parameter(NODES[node.get_name()][2])
                               for node in self.nodes))
        self.until(lambda: all(one.service_is_ready() for one in self._clients.values()))

    def until(self, condition: Callable[[], bool]) -> None:
        """Serve the nodes until something has happened."""
        end = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < end, "no answer"
            self.executor.spin_once(timeout_sec=0.1)

    def set(self, node: Any, parameters: Sequence[Any], *, atomic: bool) -> list[Any]:
        """Set parameters through a service of a node, and return the results."""
        client = self._clients[node.get_name(), atomic]
        future = client.call_async(client.srv_type.Request(parameters=parameters))
        self.until(future.done)
        answer = future.result()
        return [answer.result] if atomic else list(answer.results)


nodes = cache(Nodes)


def _message(name: str, data: bytes, random: Random) -> Any:
    """Return a parameter whose value, or at least its type, is what an input says."""
    from rcl_interfaces.msg import Parameter, ParameterValue

    number = int.from_bytes(data[:8], "little", signed=True)
    (real,) = struct.unpack("<d", data[:8].ljust(8, b"\0"))
    text = data.decode("utf-8", "replace").replace("\0", "")
    value = ParameterValue(
        type=random.choice((random.randrange(TYPES), random.randrange(256))),
        bool_value=bool(data), double_value=random.choice((real, number % 512 / 8)),
        integer_value=random.choice((number, len(data), -1)),
        string_value=text, byte_array_value=[data[:1] or b"\0"], bool_array_value=[True],
        integer_array_value=[1, 2], double_array_value=[real, 0.5][:len(data) % 3],
        string_array_value=[text, "front"])
    return Parameter(name=name, value=value)


def _check_services(data: bytes, random: Random) -> None:
    all_ = nodes()
    node = random.choice(all_.nodes)
    known = sorted(set(node.store.rows).difference(KEPT))
    names = [random.choice((random.choice(known), random.choice(known), random.choice(OTHERS)))
             for _ in range(random.choice((1, 1, 1, 2, 3)))]
    atomic = random.random() < 0.5
    before = _values(node, names)
    results = all_.set(node, [_message(name, data, random) for name in names], atomic=atomic)
    assert len(results) == (1 if atomic else len(names))
    for result in results:
        assert result.successful or result.reason, names
        assert "internal error" not in result.reason, (names, result.reason)
    if not any(result.successful for result in results):
        assert _values(node, names) == before, names


def _values(node: Any, names: Sequence[str]) -> list[str]:
    return [repr(node.get_parameter(name).value) if node.has_parameter(name) else "none"
            for name in names]


TARGETS = (
    Target("parameter services", _check_services, [
        b"", b"\x01", (50.0).hex().encode(), b"\0\0\0\0\0\0\x49\x40", b"front", b"push",
        "Spindle ß".encode(), b"/dev/ttyUSB0", b"on", b"\xff" * 9, b"\0\0\0\0\0\0\xf8\x7f"]),
)
