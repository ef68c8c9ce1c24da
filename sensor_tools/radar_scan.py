# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Publishes the clouds of a radar as radar_msgs/RadarScan beside it, for trackers that want that.

    radar_scan --ros-args -r points:=/isys_radar/points -r scan:=/isys_radar/scan

It subscribes to `points` and publishes on `scan`. It needs the ROS package radar_msgs.
"""

from __future__ import annotations

import sys

import rclpy
from rclpy.executors import ExternalShutdownException
from sensor_msgs.msg import PointCloud2

DEPTH = 10  # messages, as the driver keeps


def main() -> int:
    """Convert until a signal comes; return 0, or 1 where radar_msgs is missing."""
    if {"-h", "--help"} & set(sys.argv[1:]):
        print(f"usage: {__doc__}")
        return 0
    try:
        from msg_conversions.radar_scan import to_radar_scan
    except ImportError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    from radar_msgs.msg import RadarScan

    rclpy.init()
    try:
        node = rclpy.create_node("radar_scan")
        publisher = node.create_publisher(RadarScan, "scan", DEPTH)
        node.create_subscription(
            PointCloud2, "points", lambda cloud: publisher.publish(to_radar_scan(cloud)), DEPTH)
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
