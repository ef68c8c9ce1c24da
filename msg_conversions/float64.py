"""Numbers as std_msgs/Float64, serialised at thousands of messages a second."""

from __future__ import annotations

import struct

from msg_conversions.cdr import ENCAPSULATION

_pack = struct.Struct("<4sd").pack


def serialised_float64(value: float) -> bytes:
    """Return a serialised Float64."""
    return _pack(ENCAPSULATION, value)
