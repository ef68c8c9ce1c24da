"""Headers: frame and time of measurement."""

from __future__ import annotations

from builtin_interfaces.msg import Time
from std_msgs.msg import Header


def to_header(frame_id: str, stamp: int) -> Header:
    """Return a header.

    Args:
        frame_id: Frame of the data.
        stamp: Time of measurement in ns since the epoch.
    """
    seconds, nanoseconds = divmod(stamp, 1_000_000_000)
    return Header(stamp=Time(sec=seconds, nanosec=nanoseconds), frame_id=frame_id)
