"""Distances as sensor_msgs/Range."""

from __future__ import annotations

import math

from sensor_msgs.msg import Range

from msg_conversions.header import to_header

NO_ECHO_VALUES = ("inf", "max_range", "nan", "skip")


def distance_or_no_echo(distance: float, max_range: float, no_echo_value: str) -> float | None:
    """Return what to publish for a distance where consumers disagree on "nothing seen".

    REP-117 wants +inf. The range layer of nav2 clears its map only on `max_range`.

    Args:
        distance: In m; +inf nothing seen.
        max_range: Largest distance that the sensor measures, in m.
        no_echo_value: What stands for nothing seen: "inf", "max_range", "nan" or "skip".

    Returns:
        The distance; None = publish nothing.
    """
    if distance != math.inf:
        return distance
    return {"inf": math.inf, "max_range": max_range, "nan": math.nan, "skip": None}[no_echo_value]


def to_range(distance: float, limits: tuple[float, float], field_of_view: float, frame_id: str,
             stamp: int) -> Range:
    """Return a Range.

    The message knows ultrasound and infrared only; ultrasound (0) stands for radar as well.

    Args:
        distance: In m; -inf too close, +inf nothing seen (REP-117).
        limits: Smallest and largest distance that the sensor measures, in m.
        field_of_view: Opening angle in rad, 0 = along the x axis.
        frame_id: Frame of the sensor.
        stamp: Time of measurement in ns since the epoch.
    """
    return Range(header=to_header(frame_id, stamp), radiation_type=Range.ULTRASOUND,
                 field_of_view=field_of_view, min_range=limits[0], max_range=limits[1],
                 range=distance)
