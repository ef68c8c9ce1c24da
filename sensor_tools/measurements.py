"""What sensors measure, as rows of numbers: the same for live values and for files.

Units, signs and names are those of the messages of the nodes with their default parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TypeAlias

import numpy as np

from icotronic_driver.gathering import Conversion
from icotronic_driver.sensor import Channel, Sensor
from icotronic_driver.session import Listener as StreamListener
from icotronic_driver.streaming import AXES
from isys_radar_driver.radar import Radar
from isys_radar_driver.session import Listener as TargetListener
from isys_radar_driver.targets import TargetList
from uc4000_driver.acquisition import Listener as DistanceListener
from uc4000_driver.sensor import Measurement
from uc4000_driver.sensor import Sensor as Ultrasonic

Row: TypeAlias = Sequence[float | int | str | None]
Take: TypeAlias = Callable[[int, Sequence[Row]], None]  # time in ns since the epoch, and rows

RADAR_COLUMNS: Mapping[str, str] = {
    "target": "", "range": "m", "azimuth": "rad", "radial_velocity": "m/s", "intensity": "dB"}
ULTRASONIC_COLUMNS: Mapping[str, str] = {"range": "m", "outcome": "", "temperature": "°C"}
STH_COLUMNS: Mapping[str, str] = dict.fromkeys(AXES, "m/s²")


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
    """Hands over samples, each with its own time; channels that are not streamed are empty."""

    def __init__(self, take: Take) -> None:
        """Hand rows to `take`."""
        self._take = take

    def on_stream(self, sensor: Sensor) -> Callable[[int, float, tuple[int, ...]], None]:
        """Return what takes the frames of a stream."""
        tables = [_table(channel) for channel in sensor.channels]
        places = [AXES.index(channel.name) for channel in sensor.channels]
        count, take = len(tables), self._take

        def on_frame(stamp: int, period: float, values: tuple[int, ...]) -> None:
            for first in range(0, len(values), count):
                row: list[float | None] = [None] * len(AXES)
                for place, table, raw in zip(places, tables, values[first:first + count],
                                             strict=True):
                    row[place] = table[raw]
                take(stamp + round(first // count * period), [row])

        return on_frame


def _table(channel: Channel) -> list[float]:
    """Return the acceleration in m/s² of each raw value, as the node publishes it."""
    conversion = Conversion([lambda raw: channel.slope * raw + channel.offset], [0])
    accelerations: list[float] = np.asarray(conversion.tables[0][1]).tolist()
    return accelerations


