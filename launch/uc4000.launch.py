"""Start the driver of one or several UC4000 sensors."""

from driver_common.launch_file import describe_driver


def generate_launch_description():
    """Describe the node and its arguments."""
    return describe_driver("uc4000_node", "uc4000", {
        "serial_port": "Device path, pyserial URL or sim://UC4000"})
