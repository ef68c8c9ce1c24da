# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The least that can be done for a radar: pyserial asks and reads, ready bytes are published."""

from __future__ import annotations

import contextlib

import rclpy
import serial
from rclpy.serialization import serialize_message
from sensor_msgs.msg import PointCloud2

from isys_radar_driver.commands import START, read_target_list
from isys_radar_driver.models import find_model
from isys_radar_driver.targets import Resolution

MODEL = find_model("iSYS-4001")
ADDRESS = 0x64
HEAD, TAIL = 4, 2  # bytes of a frame around the length that it states
BYTES = 24 * 16  # of the points of a cloud


def main() -> None:
    """Run the loop."""
    rclpy.init()
    node = rclpy.create_node("bare", automatically_declare_parameters_from_overrides=True)
    publish = node.create_publisher(PointCloud2, "~/points", 10).publish
    message = serialize_message(PointCloud2(data=bytes(BYTES)))
    port = serial.Serial(node.get_parameter("port").value, MODEL.baud_rate, timeout=2.0)
    start = START.request(ADDRESS).encode()
    ask = read_target_list(ADDRESS, 1, Resolution.BITS_16).encode()

    def exchange(request: bytes) -> None:
        port.write(request)
        port.read(port.read(HEAD)[1] + TAIL)

    exchange(start)
    while True:
        exchange(ask)
        publish(message)


if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt):
        main()
