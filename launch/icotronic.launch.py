"""Start the driver of an ICOtronic sensor."""

from driver_common.launch_file import describe_driver


def generate_launch_description():
    """Describe the node and its arguments."""
    return describe_driver("icotronic_node", "icotronic", {
        "can_interface": "Interface of python-can, or sim",
        "can_channel": "Channel of the interface"})
