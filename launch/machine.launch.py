# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Start the sensors of a whole machine: two radars, five ultrasonic sensors, an accelerometer."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration

from industrial_sensor_drivers.launch_file import include_description, include_driver, shared


def generate_launch_description():
    """Describe the three nodes, each of which serves all sensors on its wire, and the frames."""
    return LaunchDescription([
        DeclareLaunchArgument("radar_port", default_value="/dev/isys_radar",
                              description="RS-485 adapter of the radars, named by a udev rule."),
        DeclareLaunchArgument("ultrasonic_port", default_value="/dev/uc4000",
                              description="LIN adapter of the ultrasonic sensors, as well."),
        DeclareLaunchArgument("can_interface", default_value="socketcan",
                              description="Interface of python-can, or sim."),
        DeclareLaunchArgument("machine_model", default_value=shared("urdf", "machine.urdf.xacro"),
                              description="URDF or xacro file with the frames of the sensors."),
        include_driver("isys_radar", "isys_radars_on_one_line.yaml",
                       {"serial_port": "radar_port"}),
        include_driver("uc4000", "uc4000_sensors_on_one_line.yaml",
                       {"serial_port": "ultrasonic_port"}),
        include_driver("icotronic", "icotronic.yaml", {"can_interface": "can_interface"}),
        include_description(LaunchConfiguration("machine_model")),
    ])
