# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What sensors measure, as rows of numbers: the same for live values and for files.

Units, signs and names are those of the messages of the nodes with their default parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TypeAlias

import numpy as np

from icotronic_driver.listener import Listener as StreamListener
from icotronic_driver.sensor import Channel, Sensor
from isys_radar_driver.listener import Listener as TargetListener
from isys_radar_driver.radar import Radar
from isys_radar_driver.targets import TargetList
from uc4000_driver.listener import Listener as DistanceListener
from uc4000_driver.sensor import Measurement
from uc4000_driver.sensor import Sensor as Ultrasonic

Row: TypeAlias = Sequence[float | int | str | None]
Take: TypeAlias = Callable[[int, Sequence[Row]], None]  # time in ns since the epoch, and rows

RAW_VALUES = 0x10000  # of 16 bits
RADAR_COLUMNS: Mapping[str, str] = {
    "target": "", "range": "m", "azimuth": "rad", "radial_velocity": "m/s", "intensity": "dB"}
ULTRASONIC_COLUMNS: Mapping[str, str] = {"range": "m", "outcome": "", "temperature": "°C"}


def sth_columns(sensor: Sensor) -> Mapping[str, str]:
    """Return name and unit of each streamed channel of a connected sensor."""
    return {channel.name: channel.unit for channel in sensor.channels}


def ignore(stamp: int, rows: Sequence[Row]) -> None:
    """Take measurements that nobody wants."""


class RadarListener(TargetListener):
    """Hands over target lists; an empty one is a row without values."""

    def __init__(self, take: Take) -> None:
        """Hand rows to `take`."""
        self._take = take

    def on_target_list(self, radar: Radar, targets: TargetList, stamp: int) -> None:
        """Take a target list; a positive radial velocity means moving away (errata I20)."""
        self._take(stamp, [
            (number, target.range, target.angle, -target.velocity, target.signal)
            for number, target in enumerate(targets.targets, 1)] or [(0, None, None, None, None)])


class UltrasonicListener(DistanceListener):
    """Hands over distances, each with the last temperature."""

    def __init__(self, take: Take) -> None:
        """Hand rows to `take`."""
        self._take = take

    def on_measurement(self, sensor: Ultrasonic, measurement: Measurement) -> None:
        """Take a distance."""
        distance = measurement.distance
        self._take(measurement.stamp,
                   [(distance.value, distance.outcome.value, sensor.temperature)])


class SthListener(StreamListener):
    """Hands over samples of the streamed channels, each with its own time."""

    def __init__(self, take: Take) -> None:
        """Hand rows to `take`."""
        self._take = take

    def on_stream(self, sensor: Sensor) -> Callable[[int, float, tuple[int, ...]], None]:
        """Return what takes the frames of a stream."""
        tables = list(map(_table, sensor.channels))
        count, take = len(tables), self._take

        def on_frame(stamp: int, period: float, values: tuple[int, ...]) -> None:
            for first in range(0, len(values), count):
                take(stamp + first // count * int(period),  # as the node does
                     [[table[raw] for table, raw in zip(tables, values[first:first + count],
                                                        strict=True)]])

        return on_frame


def _table(channel: Channel) -> list[float]:
    """Return what each raw value means, as the node publishes it: a 32-bit number."""
    raw = np.arange(RAW_VALUES)
    values: list[float] = (channel.slope * raw + channel.offset).astype(np.float32).tolist()
    return values
