# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Publish the frames of the sensors as static transforms, and what they look like."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import Command, LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from industrial_sensor_drivers.launch_file import shared


def generate_launch_description():
    """Describe the publisher and its argument."""
    description = ParameterValue(Command(["xacro ", LaunchConfiguration("model")]), value_type=str)
    return LaunchDescription([
        DeclareLaunchArgument("model", default_value=shared("urdf", "sensors.urdf.xacro"),
                              description="URDF or xacro file of the robot."),
        Node(package="robot_state_publisher", executable="robot_state_publisher", output="screen",
             parameters=[{"robot_description": description}]),
    ])
