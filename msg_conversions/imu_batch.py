# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Accelerations of a period as one sensor_msgs/PointCloud2, which any tool can read."""

from __future__ import annotations

import struct

import numpy as np
import numpy.typing as npt
from sensor_msgs.msg import PointCloud2, PointField

from msg_conversions.cdr import serialise
from msg_conversions.header import to_header

SAMPLE = np.dtype([("t", "<f8"), ("xyz", "<f4", 3)])
FIELDS = [PointField(name=name, offset=offset, datatype=datatype, count=1)
          for name, offset, datatype in (
              ("t", 0, PointField.FLOAT64), ("x", 8, PointField.FLOAT32),
              ("y", 12, PointField.FLOAT32), ("z", 16, PointField.FLOAT32))]
NANOSECONDS = 1_000_000_000

_U32 = struct.Struct("<I")
_TIME = struct.Struct("<iI")
_STAMP = slice(4, 12)  # behind the header of the encapsulation
_TAIL_SIZE = 3 * _U32.size  # bytes in a row, bytes of data, is_dense


class ImuBatchTemplate:
    """A serialised cloud of which stamp and samples can be replaced.

    Some batches a second find the caches of the processor cold, so what counts is how much code
    runs at all: through a message object it would be twice as much.
    """

    def __init__(self, frame_id: str) -> None:
        """Serialise an empty cloud once; `frame_id` is the frame of the sensor."""
        empty = serialise(PointCloud2(
            header=to_header(frame_id, 0), height=1, fields=FIELDS, point_step=SAMPLE.itemsize,
            is_dense=True))
        frame_end = _STAMP.stop + _U32.size + len(frame_id.encode()) + 1
        width = frame_end + -frame_end % _U32.size + _U32.size  # behind the height
        self._parts = (empty[:_STAMP.start], empty[_STAMP.stop:width],
                       empty[width + _U32.size:-_TAIL_SIZE], empty[-_U32.size:])

    def serialised(self, stamps: npt.NDArray[np.int64],
                   accelerations: npt.NDArray[np.float32]) -> bytes:
        """Return a serialised cloud with a point per sample: t in s after its stamp, x, y, z.

        Args:
            stamps: Times of measurement in ns since the epoch, at least one.
            accelerations: In m/s², shape (samples, 3).
        """
        points = np.empty(len(stamps), SAMPLE)
        points["t"] = (stamps - stamps[0]) * 1e-9
        points["xyz"] = accelerations
        data = points.tobytes()
        head, frame, fields, is_dense = self._parts
        size = _U32.pack(len(data))
        return b"".join((head, _TIME.pack(*divmod(int(stamps[0]), NANOSECONDS)), frame,
                         _U32.pack(len(stamps)), fields, size, size, data, is_dense))


def from_imu_batch(batch: PointCloud2) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float32]]:
    """Return stamps in ns since the epoch and accelerations in m/s², as the template got them.

    Raises:
        ValueError: The cloud is no such batch.
    """
    if list(batch.fields) != FIELDS or batch.is_bigendian or batch.point_step != SAMPLE.itemsize:
        raise ValueError(f"a cloud with the fields {[field.name for field in batch.fields]} is no "
                         "batch of accelerations")
    points = np.frombuffer(batch.data, SAMPLE)
    first = batch.header.stamp.sec * NANOSECONDS + batch.header.stamp.nanosec
    stamps = first + np.rint(points["t"] * 1e9).astype(np.int64)
    return stamps, points["xyz"]
