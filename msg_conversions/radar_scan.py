# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Point clouds of a radar as radar_msgs/RadarScan, where that package is installed."""

from __future__ import annotations

import numpy as np
from sensor_msgs.msg import PointCloud2

from msg_conversions.point_cloud import FIELD_NAMES

try:
    from radar_msgs.msg import RadarReturn, RadarScan
except ImportError as error:
    raise ImportError("the ROS package radar_msgs is missing; install it with "
                      "'sudo apt install ros-jazzy-radar-msgs'") from error

RETURN = {"range": "range", "azimuth": "azimuth", "elevation": "elevation",
          "radial_velocity": "doppler_velocity", "intensity": "amplitude"}
"""Field of a point, and of a return: in m, rad, rad, m/s (positive = moving away) and dB."""


def to_radar_scan(cloud: PointCloud2) -> RadarScan:
    """Return a scan with a return per point, with the header of the cloud.

    What the radar does not measure is NaN, as in the cloud.
    """
    points = np.frombuffer(cloud.data, "<f4").reshape(-1, len(FIELD_NAMES)).tolist()
    columns = [(FIELD_NAMES.index(field), name) for field, name in RETURN.items()]
    return RadarScan(header=cloud.header, returns=[
        RadarReturn(**{name: point[column] for column, name in columns}) for point in points])
