# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A node with one publisher: idle, or publishing an empty cloud at a rate in Hz."""

from __future__ import annotations

import contextlib

import rclpy
from rclpy.executors import ExternalShutdownException
from sensor_msgs.msg import PointCloud2


def main() -> None:
    """Run the node."""
    rclpy.init()
    node = rclpy.create_node("bare", automatically_declare_parameters_from_overrides=True)
    publisher = node.create_publisher(PointCloud2, "~/points", 10)
    rate = node.get_parameter("rate").value
    if rate:
        node.create_timer(1 / rate, lambda: publisher.publish(PointCloud2()))
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(node)


if __name__ == "__main__":
    main()
