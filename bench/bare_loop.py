# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The least that can be done in Python: receive a frame, publish three ready-made messages."""

from __future__ import annotations

import contextlib
import logging

import can
import rclpy
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Imu


def main() -> None:
    """Run the loop."""
    rclpy.init()
    node = rclpy.create_node("bare", automatically_declare_parameters_from_overrides=True)
    publish = node.create_publisher(Imu, "~/imu/data_raw", 2000).publish
    imu = Imu()
    imu.header.frame_id = "imu_link"
    message = serialize_message(imu)
    logging.getLogger("can").setLevel(logging.CRITICAL)
    receive = can.Bus(interface="socketcand", channel="can0", host="127.0.0.1",
                      port=node.get_parameter("port").value).recv
    while True:
        receive()
        publish(message)
        publish(message)
        publish(message)


if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt):
        main()
