"""Start the driver of one or several iSYS radars."""

from driver_common.launch_file import describe_driver


def generate_launch_description():
    """Describe the node and its arguments."""
    return describe_driver("isys_radar_node", "isys_radar", {
        "serial_port": "Device path, pyserial URL or sim://MODEL"})
