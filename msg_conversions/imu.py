# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Accelerations as sensor_msgs/Imu, serialised at thousands of messages a second.

Building and serialising a message object costs several times what publishing its bytes does. In a
stream only stamp and acceleration change, so one message is serialised, and these are replaced.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence

from sensor_msgs.msg import Imu

from msg_conversions.cdr import serialise
from msg_conversions.header import to_header

NOT_MEASURED = -1.0  # first element of a covariance (sensor_msgs/Imu)
UNKNOWN_VARIANCE = 1e6  # m²/s⁴, of an axis that is not measured
NANOSECONDS = 1_000_000_000

_STAMP = slice(4, 12)  # behind the header of the encapsulation
_ACCELERATION = slice(-12 * 8, -9 * 8)  # in front of its covariance, which is the end


def to_imu(acceleration: Sequence[float], variances: Sequence[float], frame_id: str,
           stamp: int) -> Imu:
    """Return an Imu that holds an acceleration and nothing else (REP-145: data_raw).

    Args:
        acceleration: x, y, z in m/s².
        variances: Of x, y, z in m²/s⁴; zeros = unknown.
        frame_id: Frame of the sensor.
        stamp: Time of measurement in ns since the epoch.
    """
    imu = Imu(header=to_header(frame_id, stamp))
    imu.orientation_covariance[0] = NOT_MEASURED
    imu.angular_velocity_covariance[0] = NOT_MEASURED
    for axis, name in enumerate("xyz"):
        setattr(imu.linear_acceleration, name, float(acceleration[axis]))
        imu.linear_acceleration_covariance[4 * axis] = variances[axis]
    return imu


def variances_of(axes: Iterable[int], stddev: float) -> list[float]:
    """Return the variances of x, y and z in m²/s⁴.

    Args:
        axes: Those that are measured: 0 = x, 1 = y, 2 = z.
        stddev: Their standard deviation in m/s²; 0 = unknown.
    """
    if not stddev:
        return [0.0] * 3  # consumers take a single 0 for perfectly known, but zeros for unknown
    variances = [UNKNOWN_VARIANCE] * 3
    for axis in axes:
        variances[axis] = stddev ** 2
    return variances


class ImuTemplate:
    """A serialised Imu of which stamp and acceleration can be replaced."""

    def __init__(self, variances: Sequence[float], frame_id: str) -> None:
        """Serialise the message once; see `to_imu` for the arguments."""
        message = serialise(to_imu((0.0, 0.0, 0.0), variances, frame_id, 0))
        self._head = message[:_STAMP.start]
        self._middle = message[_STAMP.stop:_ACCELERATION.start]
        self._tail = message[_ACCELERATION.stop:]
        self._pack = struct.Struct(
            f"<{len(self._head)}siI{len(self._middle)}sddd{len(self._tail)}s").pack

    def serialised(self, stamp: int, x: float, y: float, z: float) -> bytes:
        """Return the serialised message with this stamp in ns and this acceleration in m/s²."""
        seconds = stamp // NANOSECONDS
        return self._pack(self._head, seconds, stamp - seconds * NANOSECONDS, self._middle,
                          x, y, z, self._tail)
