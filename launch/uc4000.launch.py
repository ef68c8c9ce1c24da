"""Start the driver of one or several UC4000 sensors; it connects and measures by itself."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

PACKAGE = "industrial_sensor_drivers"


def make_node(context):
    """Return the node; a serial port that is given here counts more than the one in the file."""
    port = LaunchConfiguration("serial_port").perform(context)
    return [
        Node(
            package=PACKAGE,
            executable="uc4000_node",
            name=LaunchConfiguration("name"),
            namespace=LaunchConfiguration("namespace"),
            parameters=[
                LaunchConfiguration("params_file"),
                *([{"serial_port": port}] if port else []),
            ],
            output="screen",
        )
    ]


def generate_launch_description():
    """Declare the arguments and start the node."""
    params_file = PathJoinSubstitution([FindPackageShare(PACKAGE), "config", "uc4000.yaml"])
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "params_file", default_value=params_file, description="Parameter file."
            ),
            DeclareLaunchArgument(
                "serial_port",
                default_value="",
                description="Device path, pyserial URL or sim://UC4000; empty = from the file.",
            ),
            DeclareLaunchArgument("namespace", default_value="", description="Of the node."),
            DeclareLaunchArgument("name", default_value="uc4000", description="Of the node."),
            OpaqueFunction(function=make_node),
        ]
    )
