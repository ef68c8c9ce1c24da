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
from typing import Any

from launch import LaunchContext, LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    EmitEvent,
    GroupAction,
    IncludeLaunchDescription,
    OpaqueFunction,
    PopLaunchConfigurations,
    PushLaunchConfigurations,
    RegisterEventHandler,
)
from launch.events import matches_action
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import LifecycleNode, Node
from launch_ros.event_handlers import OnStateTransition
from launch_ros.events.lifecycle import ChangeState
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare
from lifecycle_msgs.msg import Transition

PACKAGE = "industrial_sensor_drivers"
PORTS = {"isys_radar": "serial_port", "icotronic": "can_channel", "uc4000": "serial_port"}


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
        return [Node(**_of_arguments(executable, _given(values)))]

    return LaunchDescription([
        PushLaunchConfigurations(),
        DeclareLaunchArgument("params_file", default_value=shared("config", f"{name}.yaml"),
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
    arguments = {"params_file": shared("config", params_file),
                 **{own: LaunchConfiguration(outer) for own, outer in link.items()}}
    return _include(name, arguments)


def include_description(model: Any) -> GroupAction:
    """Return what publishes the frames of a URDF or xacro file, with arguments that end with it."""
    return _include("description", {"model": model})


def _include(name: str, arguments: Mapping[str, Any]) -> GroupAction:
    return GroupAction([IncludeLaunchDescription(
        PythonLaunchDescriptionSource(shared("launch", f"{name}.launch.py")),
        launch_arguments=arguments.items())])


def describe_managed_driver() -> LaunchDescription:
    """Return the description that starts one driver, has it configured and then activated.

    The node waits for both transitions, as it does for any lifecycle manager. Its arguments are
    `driver`, `params_file`, `port`, `name` and `namespace`.
    """
    def make_node(context: LaunchContext) -> list[Any]:
        driver, port = (LaunchConfiguration(key).perform(context) for key in ("driver", "port"))
        node = LifecycleNode(**_of_arguments(
            f"{driver}_node", {"autostart": False, **_given({PORTS[driver]: port})}))
        return [RegisterEventHandler(OnStateTransition(
            target_lifecycle_node=node, start_state="configuring", goal_state="inactive",
            entities=[_request(node, Transition.TRANSITION_ACTIVATE)])),
            node, _request(node, Transition.TRANSITION_CONFIGURE)]

    driver = LaunchConfiguration("driver")
    return LaunchDescription([
        PushLaunchConfigurations(),
        DeclareLaunchArgument("driver", choices=list(PORTS), description="Which one to start."),
        DeclareLaunchArgument("params_file", default_value=[shared("config", driver), ".yaml"],
                              description="Parameter file."),
        DeclareLaunchArgument("port", default_value="", description=(
            "Serial port or CAN channel; empty = from the file.")),
        DeclareLaunchArgument("namespace", default_value="", description="Of the node."),
        DeclareLaunchArgument("name", default_value=driver, description="Of the node."),
        OpaqueFunction(function=make_node),
        PopLaunchConfigurations(),
    ])


def _of_arguments(executable: str, values: Mapping[str, object]) -> dict[str, Any]:
    """Return the options of a node as the arguments say; `values` count more than the file."""
    return {"package": PACKAGE, "executable": executable, "output": "screen",
            "name": LaunchConfiguration("name"), "namespace": LaunchConfiguration("namespace"),
            "parameters": [LaunchConfiguration("params_file"), *([values] if values else [])]}


def _given(values: Mapping[str, str]) -> dict[str, ParameterValue]:
    """Return those that are not empty as texts, also where they look like numbers."""
    return {key: ParameterValue(value, value_type=str) for key, value in values.items() if value}


def _request(node: LifecycleNode, transition: int) -> EmitEvent:
    return EmitEvent(event=ChangeState(
        lifecycle_node_matcher=matches_action(node), transition_id=transition))


def shared(*path: object) -> PathJoinSubstitution:
    """Return where a shared file of this package is installed."""
    return PathJoinSubstitution([FindPackageShare(PACKAGE), *path])
