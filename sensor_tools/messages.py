# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What sensors measure, as the messages of their nodes with default parameters, in a bag.

It needs the message classes of ROS, so it is imported only where messages are wanted.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from math import nan
from typing import Any, TypeAlias

from icotronic_driver.laws import CELSIUS
from icotronic_driver.sensor import Sensor as Sth
from icotronic_driver.streaming import AXES
from isys_radar_driver.radar import Radar
from msg_conversions.cdr import serialise
from msg_conversions.float64 import serialised_float64
from msg_conversions.imu import ImuTemplate, variances_of
from msg_conversions.point_cloud import to_point_cloud
from msg_conversions.range import published_distance, to_range
from msg_conversions.temperature import TemperatureTemplate
from sensor_tools.bags import Record
from sensor_tools.measurements import Row
from uc4000_driver.sensor import FIELD_OF_VIEW
from uc4000_driver.sensor import Sensor as Ultrasonic

# Returns the messages of a measurement: its time in ns since the epoch, and its rows.
Convert: TypeAlias = Callable[[int, Sequence[Row]], Iterator[Record]]


def of_radar(radar: Radar) -> Convert:
    """Return what makes a cloud of a target list."""
    model = radar.known_model

    def convert(stamp: int, rows: Sequence[Row]) -> Iterator[Record]:
        targets: list[Any] = [
            (distance if model.measures_range else nan, angle if model.measures_angle else 0.0,
             velocity if model.measures_velocity else nan, signal)
            for number, distance, angle, velocity, signal in rows if number]
        yield Record("/isys_radar/points", "sensor_msgs/msg/PointCloud2",
                     serialise(to_point_cloud(targets, "isys_radar_link", stamp)), stamp)

    return convert


def of_ultrasonic(sensor: Ultrasonic) -> Convert:
    """Return what makes a Range of a distance."""
    limits = sensor.profile.limits

    def convert(stamp: int, rows: Sequence[Row]) -> Iterator[Record]:
        for measured, *_ in rows:
            assert isinstance(measured, float)
            distance = published_distance(measured, limits, "inf", "-inf")
            assert distance is not None
            message = to_range(distance, limits, FIELD_OF_VIEW, "uc4000_link", stamp)
            yield Record("/uc4000/range", "sensor_msgs/msg/Range", serialise(message), stamp)

    return convert


def of_sth(sensor: Sth) -> Convert:
    """Return what makes an Imu of accelerations, and other messages of other values."""
    places = {AXES.index(channel.name): place for place, channel in enumerate(sensor.channels)
              if channel.law.is_acceleration}
    others = [(place, *_topic(channel.name, channel.unit))
              for place, channel in enumerate(sensor.channels) if not channel.law.is_acceleration]
    imu = ImuTemplate(variances_of(places, 0.0), "imu_link").serialised

    def convert(stamp: int, rows: Sequence[Row]) -> Iterator[Record]:
        for row in rows:
            values: Sequence[Any] = row
            if places:
                xyz = [values[places[axis]] if axis in places else 0.0 for axis in range(3)]
                yield Record("/icotronic/imu/data_raw", "sensor_msgs/msg/Imu", imu(stamp, *xyz),
                             stamp)
            for place, topic, kind, serialised in others:
                yield Record(topic, kind, serialised(stamp, values[place]), stamp)

    return convert


def _topic(name: str, unit: str) -> tuple[str, str, Callable[[int, float], bytes]]:
    """Return topic, type and serialisation of a channel that measures no acceleration."""
    if unit == CELSIUS:
        return (f"/icotronic/channel_{name}/temperature", "sensor_msgs/msg/Temperature",
                TemperatureTemplate("imu_link").serialised)
    return (f"/icotronic/channel_{name}/value", "std_msgs/msg/Float64",
            lambda stamp, value: serialised_float64(value))


CONVERSIONS: Mapping[str, Callable[[Any], Convert]] = {
    "isys": of_radar, "uc4000": of_ultrasonic, "icotronic": of_sth}
