"""A subscriber as rclpy makes them easy; tells how many samples have come, once some have."""

from __future__ import annotations

import contextlib
import sys
import threading

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Imu, PointCloud2

DEPTH = 2000  # messages


def main() -> None:
    """Receive until the signal."""
    topic = sys.argv[1]
    count, some = 0, threading.Event()

    def on_sample(_: Imu) -> None:
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
    node.create_subscription(*((PointCloud2, topic, on_batch) if topic.endswith("batch") else
                               (Imu, topic, on_sample)), QoSProfile(depth=DEPTH))
    threading.Thread(target=answer, daemon=True).start()
    print("ready", flush=True)
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(node)


if __name__ == "__main__":
    main()
