# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Temperatures as sensor_msgs/Temperature."""

from __future__ import annotations

import struct
from functools import partial

from sensor_msgs.msg import Temperature

from msg_conversions.cdr import serialise
from msg_conversions.header import to_header


def to_temperature(celsius: float, frame_id: str, stamp: int) -> Temperature:
    """Return a Temperature in °C, its variance unknown.

    Args:
        celsius: Temperature in °C.
        frame_id: Frame of the sensor.
        stamp: Time of measurement in ns since the epoch.
    """
    return Temperature(header=to_header(frame_id, stamp), temperature=celsius)


class TemperatureTemplate:
    """A serialised Temperature of which stamp and temperature can be replaced."""

    def __init__(self, frame_id: str) -> None:
        """Serialise the message once."""
        message = serialise(to_temperature(0.0, frame_id, 0))
        head, middle, tail = message[:4], message[12:-16], message[-8:]
        self._pack = partial(struct.Struct(f"<4siI{len(middle)}sd8s").pack, head)
        self._middle, self._tail = middle, tail

    def serialised(self, stamp: int, celsius: float) -> bytes:
        """Return the serialised message with this stamp in ns and this temperature in °C."""
        seconds, nanoseconds = divmod(stamp, 1_000_000_000)
        return self._pack(seconds, nanoseconds, self._middle, celsius, self._tail)
