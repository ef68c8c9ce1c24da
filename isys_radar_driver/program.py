"""The program isys_radar_node; light, so that a signal finds it ready from the first moment."""

from driver_common.program import start


def main() -> None:
    """Run the node."""
    start("isys_radar_driver.node")
