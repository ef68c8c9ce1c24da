"""Start the sensors of a whole machine: two radars, five ultrasonic sensors, an accelerometer."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument

from driver_common.launch_file import include_driver


def generate_launch_description():
    """Describe the three nodes; each serves all sensors on its wire."""
    return LaunchDescription([
        DeclareLaunchArgument("radar_port", default_value="/dev/ttyUSB0",
                              description="RS-485 adapter of the radars."),
        DeclareLaunchArgument("ultrasonic_port", default_value="/dev/ttyUSB1",
                              description="LIN adapter of the ultrasonic sensors."),
        DeclareLaunchArgument("can_interface", default_value="socketcan",
                              description="Interface of python-can, or sim."),
        include_driver("isys_radar", "isys_radars_on_one_line.yaml",
                       {"serial_port": "radar_port"}),
        include_driver("uc4000", "uc4000_sensors_on_one_line.yaml",
                       {"serial_port": "ultrasonic_port"}),
        include_driver("icotronic", "icotronic.yaml", {"can_interface": "can_interface"}),
    ])
