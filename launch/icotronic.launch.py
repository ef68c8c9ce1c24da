"""Start the driver of an ICOtronic sensor; it connects and streams by itself."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

PACKAGE = "industrial_sensor_drivers"
OVERRIDES = {
    "can_interface": "Interface of python-can, or sim; empty = from the file.",
    "can_channel": "Channel of the interface; empty = from the file.",
}


def make_node(context):
    """Return the node; what is given here counts more than what is in the file."""
    values = {name: LaunchConfiguration(name).perform(context) for name in OVERRIDES}
    given = {name: value for name, value in values.items() if value}
    return [
        Node(
            package=PACKAGE,
            executable="icotronic_node",
            name=LaunchConfiguration("name"),
            namespace=LaunchConfiguration("namespace"),
            parameters=[
                LaunchConfiguration("params_file"),
                *([given] if given else []),
            ],
            output="screen",
        )
    ]


def generate_launch_description():
    """Declare the arguments and start the node."""
    params_file = PathJoinSubstitution([FindPackageShare(PACKAGE), "config", "icotronic.yaml"])
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "params_file", default_value=params_file, description="Parameter file."
            ),
            *(
                DeclareLaunchArgument(name, default_value="", description=description)
                for name, description in OVERRIDES.items()
            ),
            DeclareLaunchArgument("namespace", default_value="", description="Of the node."),
            DeclareLaunchArgument("name", default_value="icotronic", description="Of the node."),
            OpaqueFunction(function=make_node),
        ]
    )
