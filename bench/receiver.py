# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The ROS side of the benchmark: starts programs, and receives what they publish.

It takes the serialised messages straight from the middleware, because the executor of rclpy could
not follow the faster streams.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import rclpy
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import Imu, PointCloud2, Range

from bench.measure import Process

QUEUE = 100_000  # messages; the subscriber must not be what loses some
MATCH_TIME = 20.0  # s until publisher and subscriber must have found each other
SETTLE_TIME = 0.5  # s more, for the other direction, and for the bus
PAUSE = 0.001  # s between two looks at the queue


@dataclass(frozen=True)
class Program:
    """A node that publishes what it receives on a bus.

    Attributes:
        module: What Python runs.
        node: Name of the node.
        topics: What is received of it, with the type.
        parameters: Its parameters; {port} is the one of the bus.
        start: What the server of the CAN bus is told to begin.
    """

    module: str
    node: str
    topics: tuple[tuple[str, Any], ...]
    parameters: tuple[str, ...] = ("port:={port}",)
    start: str = "find"


_ICOTRONIC = ("can_interface:=socketcand", "can_options:=[host=127.0.0.1, port={port}]",
              "sensor_name:=Bench", "sample_rate:={rate}")
_SAMPLES, _BATCHES = (("imu/data_raw", Imu),), (("imu/batch", PointCloud2),)

SAMPLES = Program("icotronic_driver.node:main", "icotronic", _SAMPLES, _ICOTRONIC)
BATCHES = Program("icotronic_driver.node:main", "icotronic", _BATCHES, _ICOTRONIC)
IDIOMATIC = Program("bench.idiomatic_node", "idiomatic", _SAMPLES, start="stream")
BARE_LOOP = Program("bench.bare_loop", "bare", _SAMPLES, start="stream")
RADAR = Program("isys_radar_driver.node:main", "isys_radar", (("points", PointCloud2),),
                ("serial_port:={port}",))
BARE_RADAR = Program("bench.bare_radar", "bare", (("points", PointCloud2),))
ULTRASONIC = Program("uc4000_driver.node:main", "uc4000", (("range", Range),),
                     ("serial_port:={port}",))
BARE_NODE = Program("bench.bare_node", "bare", (("points", PointCloud2),), ("rate:=100.0",))
IDLE_NODE = Program("bench.bare_node", "bare", (("points", PointCloud2),), ("rate:=0.0",))


class Running:
    """A program that runs, and what it publishes."""

    def __init__(self, process: Process, subscriptions: list[tuple[Any, Any]]) -> None:
        """Take the process, and subscriptions with the types of their messages."""
        self.process = process
        self._subscriptions = subscriptions

    def take(self) -> bytes | None:
        """Return the next serialised message, None where there is none."""
        for subscription, kind in self._subscriptions:
            with subscription.handle:
                taken = subscription.handle.take_message(kind, True)
            if taken is not None:
                return bytes(taken[0])
        return None

    def count(self, seconds: float) -> int:
        """Return how many messages come in a time."""
        count, end = 0, time.monotonic() + seconds
        while time.monotonic() < end:
            while self.take() is not None:
                count += 1
            time.sleep(PAUSE)
        return count

    def first(self, timeout: float = MATCH_TIME) -> float:
        """Return the monotonic time in s at which the next message comes; raises Failure."""
        end = time.monotonic() + timeout
        while self.take() is None:
            if time.monotonic() > end or not self.process.is_running():
                raise self.process.failure("published nothing")
            time.sleep(PAUSE)
        return time.monotonic()

    def await_publishers(self) -> None:
        """Wait until all of its publishers are there; raises Failure."""
        end = time.monotonic() + MATCH_TIME
        while not all(subscription.get_publisher_count()
                      for subscription, _ in self._subscriptions):
            if time.monotonic() > end or not self.process.is_running():
                raise self.process.failure("did not come up")
            time.sleep(0.05)
        time.sleep(SETTLE_TIME)


class Receiver:
    """Runs programs, one after the other, and receives what they publish.

    Attributes:
        core: The processor core for what is measured, None where there is no other one.
    """

    _numbers = itertools.count()

    def __init__(self, node: Node, core: int | None) -> None:
        """Take a node of this process, and the core for the measured programs."""
        self._node = node
        self.core = core

    @contextmanager
    def running(self, program: Program, values: Mapping[str, object],
                sensors: Sequence[str] = ("",)) -> Iterator[Running]:
        """Run a program, subscribed to what it publishes of each sensor.

        Args:
            program: The program.
            values: What its parameters are filled with; "parameters" are some more of them.
            sensors: Names of the sensors.
        """
        namespace = f"/bench_{next(self._numbers)}"
        arguments = ["--ros-args", "-r", f"__ns:={namespace}"]
        more = values.get("parameters", ())
        assert isinstance(more, tuple)
        for parameter in (*(each.format_map(values) for each in program.parameters), *more):
            arguments += ["-p", parameter]
        subscriptions = [
            (self._node.create_subscription(kind, "/".join(filter(None, (
                namespace, program.node, sensor, topic))), lambda _: None, QoSProfile(depth=QUEUE),
                raw=True), kind) for topic, kind in program.topics for sensor in sensors]
        try:
            with Process(program.module, *arguments, core=self.core) as process:
                yield Running(process, subscriptions)
        finally:
            for subscription, _ in subscriptions:
                self._node.destroy_subscription(subscription)


@contextmanager
def make_receiver(core: int | None) -> Iterator[Receiver]:
    """Yield the receiver of this process; `core` is for the programs."""
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    try:
        yield Receiver(rclpy.create_node("bench"), core)
    finally:
        rclpy.try_shutdown()
