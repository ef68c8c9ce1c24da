# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A subscriber as rclpy makes them easy; tells how many samples have come, once some have."""

from __future__ import annotations

import contextlib
import sys
import threading
from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Imu, PointCloud2, Range

DEPTH = 2000  # messages
KINDS = {"batch": PointCloud2, "points": PointCloud2, "range": Range}  # by topic, or an Imu


def main() -> None:
    """Receive until the signal."""
    topic = sys.argv[1]
    count, some = 0, threading.Event()

    def on_sample(_: Any) -> None:
        nonlocal count
        count += 1
        some.set()

    def on_batch(batch: PointCloud2) -> None:
        nonlocal count
        count += batch.width
        some.set()

    def answer() -> None:
        for _ in sys.stdin:
            some.wait()
            print(count, flush=True)

    rclpy.init()
    node = rclpy.create_node("listener")
    name = topic.rpartition("/")[2]
    node.create_subscription(KINDS.get(name, Imu), topic,
                             on_batch if name == "batch" else on_sample, QoSProfile(depth=DEPTH))
    threading.Thread(target=answer, daemon=True).start()
    print("ready", flush=True)
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(node)


if __name__ == "__main__":
    main()
