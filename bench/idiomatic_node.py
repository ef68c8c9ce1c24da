# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The node that a good ROS programmer writes for this stream, without looking at CPU time.

It knows nothing of settings, losses or the time of a sample: it stamps on arrival.
"""

from __future__ import annotations

import contextlib
import logging
import struct

import can
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import Imu

DATA_ID = 0x0100004F
STANDARD_GRAVITY = 9.80665  # m/s²
RANGE = 100 * STANDARD_GRAVITY  # of the sensor, ±
SCALE = 2 * RANGE / 0xFFFF
UNKNOWN_VARIANCE = 1e6  # m²/s⁴, of the axes that are not measured
VALUES = struct.Struct("<3H")


class ImuNode(Node):
    """Publishes an Imu per measured value."""

    def __init__(self) -> None:
        """Open the bus."""
        super().__init__("idiomatic")
        self.declare_parameter("port", 0)
        self.declare_parameter("frame_id", "imu_link")
        self._frame_id = self.get_parameter("frame_id").value
        self._publisher = self.create_publisher(Imu, "~/imu/data_raw", 2000)
        logging.getLogger("can").setLevel(logging.CRITICAL)
        self._bus = can.Bus(interface="socketcand", channel="can0", host="127.0.0.1",
                            port=self.get_parameter("port").value)
        self._notifier = can.Notifier(self._bus, [self.on_frame])

    def on_frame(self, frame: can.Message) -> None:
        """Publish the values of a data frame."""
        if frame.arbitration_id != DATA_ID or len(frame.data) != 8:
            return
        for raw in VALUES.unpack_from(frame.data, 2):
            imu = Imu()
            imu.header.stamp = self.get_clock().now().to_msg()
            imu.header.frame_id = self._frame_id
            imu.orientation_covariance[0] = -1.0
            imu.angular_velocity_covariance[0] = -1.0
            imu.linear_acceleration.x = raw * SCALE - RANGE
            imu.linear_acceleration_covariance[4] = UNKNOWN_VARIANCE
            imu.linear_acceleration_covariance[8] = UNKNOWN_VARIANCE
            self._publisher.publish(imu)


def main() -> None:
    """Run the node."""
    rclpy.init()
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(ImuNode())


if __name__ == "__main__":
    main()
