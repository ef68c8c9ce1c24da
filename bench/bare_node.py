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
