"""Temperatures as sensor_msgs/Temperature."""

from __future__ import annotations

from sensor_msgs.msg import Temperature

from msg_conversions.header import to_header


def to_temperature(celsius: float, frame_id: str, stamp: int) -> Temperature:
    """Return a Temperature in °C, its variance unknown.

    Args:
        celsius: Temperature in °C.
        frame_id: Frame of the sensor.
        stamp: Time of measurement in ns since the epoch.
    """
    return Temperature(header=to_header(frame_id, stamp), temperature=celsius)
