# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Distances as sensor_msgs/Range."""

from __future__ import annotations

import math

from sensor_msgs.msg import Range

from msg_conversions.header import to_header

NO_ECHO_VALUES = ("inf", "max_range", "nan", "skip")
TOO_CLOSE_VALUES = ("-inf", "min_range", "skip")


def published_distance(distance: float, limits: tuple[float, float], no_echo_value: str,
                       too_close_value: str) -> float | None:
    """Return what to publish for a distance, where consumers disagree on what lies beyond limits.

    REP-117 wants infinities. The range layer of nav2 drops all that is not within the limits: it
    clears its map only on `max_range`, and marks nothing nearer than `min_range`.

    Args:
        distance: In m; +inf nothing seen, -inf too close, NaN unknown.
        limits: Smallest and largest distance that the sensor measures, in m.
        no_echo_value: What stands for more than the largest: "inf", "max_range", "nan", "skip".
        too_close_value: What stands for less than the smallest: "-inf", "min_range", "skip".

    Returns:
        The distance; None = publish nothing.
    """
    smallest, largest = limits
    if distance > largest:
        return {"inf": math.inf, "max_range": largest, "nan": math.nan, "skip": None}[no_echo_value]
    if distance < smallest:
        return {"-inf": -math.inf, "min_range": smallest, "skip": None}[too_close_value]
    return distance


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
