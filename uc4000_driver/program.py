"""The program uc4000_node; light, so that a signal finds it ready from the first moment."""

from driver_common.program import start


def main() -> None:
    """Run the node."""
    start("uc4000_driver.node")
