# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the launch files of all drivers share."""

from __future__ import annotations

from collections.abc import Mapping

from launch import LaunchContext, LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    GroupAction,
    IncludeLaunchDescription,
    OpaqueFunction,
    PopLaunchConfigurations,
    PushLaunchConfigurations,
)
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

PACKAGE = "industrial_sensor_drivers"


def describe_driver(executable: str, name: str, link: Mapping[str, str]) -> LaunchDescription:
    """Return the description that starts one driver; it connects and measures by itself.

    Its arguments are `params_file`, `name`, `namespace` and those of `link`. Their defaults end
    with it: launch would keep them for the next file that is included.

    Args:
        executable: The program.
        name: Name of the node, and of its parameter file in config/.
        link: Parameters that may be given as arguments and then count more than the file: name
            and description.
    """
    def make_node(context: LaunchContext) -> list[Node]:
        values = {key: LaunchConfiguration(key).perform(context) for key in link}
        given = {key: ParameterValue(value, value_type=str)  # also where it looks like a number
                 for key, value in values.items() if value}
        return [Node(
            package=PACKAGE, executable=executable, output="screen",
            name=LaunchConfiguration("name"), namespace=LaunchConfiguration("namespace"),
            parameters=[LaunchConfiguration("params_file"), *([given] if given else [])])]

    return LaunchDescription([
        PushLaunchConfigurations(),
        DeclareLaunchArgument("params_file", default_value=_shared("config", f"{name}.yaml"),
                              description="Parameter file."),
        *(DeclareLaunchArgument(key, default_value="",
                                description=f"{description}; empty = from the file.")
          for key, description in link.items()),
        DeclareLaunchArgument("namespace", default_value="", description="Of the node."),
        DeclareLaunchArgument("name", default_value=name, description="Of the node."),
        OpaqueFunction(function=make_node),
        PopLaunchConfigurations(),
    ])


def include_driver(name: str, params_file: str, link: Mapping[str, str]) -> GroupAction:
    """Return what includes the launch file of a driver, with arguments that end with it.

    Args:
        name: Name of the driver.
        params_file: Name of its parameter file in config/.
        link: Arguments of the driver, each with the argument of the whole that it follows.
    """
    arguments = {"params_file": _shared("config", params_file),
                 **{own: LaunchConfiguration(outer) for own, outer in link.items()}}
    return GroupAction([IncludeLaunchDescription(
        PythonLaunchDescriptionSource(_shared("launch", f"{name}.launch.py")),
        launch_arguments=arguments.items())])


def _shared(*path: str) -> PathJoinSubstitution:
    return PathJoinSubstitution([FindPackageShare(PACKAGE), *path])
