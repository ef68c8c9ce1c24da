# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Start diagnostic_aggregator: what is wrong, by family of sensors, on /diagnostics_agg."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from industrial_sensor_drivers.launch_file import shared


def generate_launch_description():
    """Describe the aggregator and its argument."""
    return LaunchDescription([
        DeclareLaunchArgument("params_file", default_value=shared("config", "diagnostics.yaml"),
                              description="Analyzers."),
        Node(package="diagnostic_aggregator", executable="aggregator_node", output="screen",
             parameters=[LaunchConfiguration("params_file")]),
    ])
