# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Polar measurements of a radar as sensor_msgs/PointCloud2."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from sensor_msgs.msg import PointCloud2, PointField

from msg_conversions.header import to_header

FIELD_NAMES = ("x", "y", "z", "intensity", "range", "azimuth", "elevation", "radial_velocity")
POINT_STEP = 4 * len(FIELD_NAMES)
FIELDS = [PointField(name=name, offset=4 * index, datatype=PointField.FLOAT32, count=1)
          for index, name in enumerate(FIELD_NAMES)]

Polar = tuple[float, float, float, float]


def to_point_cloud(targets: Sequence[Polar], frame_id: str, stamp: int) -> PointCloud2:
    """Return one cloud with a point per target, x forward and y left (REP-103).

    Args:
        targets: Per target: range in m, azimuth in rad (positive to the left), radial velocity in
            m/s (positive = moving away) and intensity in dB. The elevation is 0. What is not
            measured is NaN; without a range there is no position either.
        frame_id: Frame of the sensor.
        stamp: Time of measurement in ns since the epoch.
    """
    polar = np.array(targets, dtype=np.float64).reshape(-1, 4)
    distance, azimuth, radial_velocity, intensity = polar.T
    points = np.zeros((len(polar), len(FIELD_NAMES)), dtype="<f4")
    points[:, 0] = distance * np.cos(azimuth)
    points[:, 1] = distance * np.sin(azimuth)
    points[:, 2] = 0.0 * distance
    points[:, 3] = intensity
    points[:, 4] = distance
    points[:, 5] = azimuth
    points[:, 7] = radial_velocity
    return PointCloud2(
        header=to_header(frame_id, stamp), height=1, width=len(points), fields=FIELDS,
        is_bigendian=False, point_step=POINT_STEP, row_step=POINT_STEP * len(points),
        data=points.tobytes(), is_dense=not np.isnan(distance).any())
