# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Readers that are slow or suspended hold up nobody: not the writer, not the other readers."""

import signal
import subprocess
import sys

import pytest
from nodes import Ros
from rclpy.duration import Duration
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import Imu
from std_msgs.msg import Header

DEADLINE = 60.0  # s; far more than anything takes, also on a busy machine
DEPTH = 2000  # of the writer, as of ~/imu/data_raw
SAMPLES = 6000  # three times what the writer keeps
BURST = 500  # samples that are published at once

READER = """
import sys
import rclpy
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Imu

rclpy.init()
node = rclpy.create_node("slow_reader")
subscription = node.create_subscription(
    Imu, "/stream", lambda message: None, QoSProfile(depth=2000), raw=True)
print("ready", flush=True)
sys.stdin.readline()
"""


@pytest.fixture
def slow():
    """A reader in a process of its own, which is suspended during the test."""
    with subprocess.Popen([sys.executable, "-c", READER], text=True, stdin=subprocess.PIPE,
                          stdout=subprocess.PIPE) as process:
        assert process.stdout.readline() == "ready\n"
        yield process
        process.kill()


def test_a_suspended_reader_costs_the_others_no_sample(slow):
    with Ros() as ros:
        publisher = ros.node.create_publisher(Imu, "/stream", QoSProfile(depth=DEPTH))
        quick = ros.node.create_subscription(
            Imu, "/stream", lambda message: None, QoSProfile(depth=DEPTH), raw=True)
        ros.wait_until(lambda: publisher.get_subscription_count() == 2)
        slow.send_signal(signal.SIGSTOP)
        got = []

        def all_came():
            while (taken := quick.handle.take_message(Imu, True)) is not None:
                got.append(deserialize_message(taken[0], Imu).header.frame_id)
            return len(got) == sent

        with quick.handle:
            for sent in range(BURST, SAMPLES + 1, BURST):
                for number in range(sent - BURST, sent):
                    publisher.publish(serialize_message(Imu(header=Header(frame_id=str(number)))))
                ros.wait_until(all_came)
        assert got == [str(number) for number in range(SAMPLES)]
        slow.send_signal(signal.SIGCONT)
        assert publisher.wait_for_all_acked(Duration(seconds=DEADLINE))


def test_what_publishes_samples_takes_bytes():
    """The node calls what is behind `Publisher.publish`; rclpy may change that."""
    with Ros() as ros:
        publisher = ros.node.create_publisher(Imu, "/raw", 10)
        assert isinstance(Publisher.handle, property)
        messages = ros.subscribe(Imu, "/raw")
        ros.wait_until(publisher.get_subscription_count)
        publisher.handle.publish_raw(serialize_message(Imu(header=Header(frame_id="bytes"))))
        ros.wait_until(lambda: messages)
        assert messages[0].header.frame_id == "bytes"
