"""Accelerations of a period as one sensor_msgs/PointCloud2, which any tool can read."""

from __future__ import annotations

import array

import numpy as np
import numpy.typing as npt
from sensor_msgs.msg import PointCloud2, PointField

from msg_conversions.header import to_header

SAMPLE = np.dtype([("t", "<f8"), ("x", "<f4"), ("y", "<f4"), ("z", "<f4")])
FIELDS = [PointField(name=name, offset=offset, datatype=datatype, count=1)
          for name, offset, datatype in (
              ("t", 0, PointField.FLOAT64), ("x", 8, PointField.FLOAT32),
              ("y", 12, PointField.FLOAT32), ("z", 16, PointField.FLOAT32))]


def to_imu_batch(stamps: npt.NDArray[np.int64], accelerations: npt.NDArray[np.float32],
                 frame_id: str) -> PointCloud2:
    """Return one cloud with a point per sample: t in s after the header's stamp, x, y, z.

    Args:
        stamps: Times of measurement in ns since the epoch, at least one.
        accelerations: In m/s², shape (samples, 3).
        frame_id: Frame of the sensor.
    """
    points = np.empty(len(stamps), SAMPLE)
    points["t"] = (stamps - stamps[0]) * 1e-9
    for axis, name in enumerate("xyz"):
        points[name] = accelerations[:, axis]
    return PointCloud2(
        header=to_header(frame_id, int(stamps[0])), height=1, width=len(points), fields=FIELDS,
        is_bigendian=False, point_step=SAMPLE.itemsize, row_step=SAMPLE.itemsize * len(points),
        data=array.array("B", points.tobytes()), is_dense=True)


def from_imu_batch(batch: PointCloud2) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float32]]:
    """Return stamps in ns since the epoch and accelerations in m/s², as `to_imu_batch` got them.

    Raises:
        ValueError: The cloud is no such batch.
    """
    if list(batch.fields) != FIELDS or batch.is_bigendian or batch.point_step != SAMPLE.itemsize:
        raise ValueError(f"a cloud with the fields {[field.name for field in batch.fields]} is no "
                         "batch of accelerations")
    points = np.frombuffer(batch.data, SAMPLE)
    first = batch.header.stamp.sec * 1_000_000_000 + batch.header.stamp.nanosec
    stamps = first + np.rint(points["t"] * 1e9).astype(np.int64)
    return stamps, np.stack([points[name] for name in "xyz"], axis=1)
