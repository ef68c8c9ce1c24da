# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A program that hears distances on a topic and says so: the recorder's side of a network."""

import sys

import rclpy
from sensor_msgs.msg import Range


def main():
    """Print a line for each message on the topic that is named, until input ends."""
    rclpy.init()
    node = rclpy.create_node("listener")
    node.create_subscription(Range, sys.argv[1], lambda message: print("heard", message.range), 10)
    print("listening")
    rclpy.spin(node)
