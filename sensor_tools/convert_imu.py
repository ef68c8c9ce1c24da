# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Turns recorded batches of accelerations into a bag of Imu messages, and the other way round.

    convert_imu BAG NEW_BAG               # …/imu/batch to …/imu/data_raw
    convert_imu --to batch BAG NEW_BAG    # …/imu/data_raw to …/imu/batch

The messages are, byte for byte, those that icotronic_node publishes, recorded at their own stamps.
A batch holds no covariances: --stddev is the node's parameter linear_acceleration_stddev, and an
axis that is 0 throughout a batch is one that is not measured. Other topics are left out.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from pathlib import Path

import numpy as np
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Imu, PointCloud2

from driver_common.errors import DriverError
from msg_conversions.imu import ImuTemplate, variances_of
from msg_conversions.imu_batch import ImuBatchTemplate, from_imu_batch
from sensor_tools.bags import Record, read_bag, write_bag

SAMPLES, BATCHES = "/imu/data_raw", "/imu/batch"
IMU, CLOUD = "sensor_msgs/msg/Imu", "sensor_msgs/msg/PointCloud2"


def to_samples(records: Iterable[Record], stddev: float) -> Iterator[Record]:
    """Yield the samples of batches; raises ValueError where a cloud is no batch.

    Args:
        records: Messages of a bag.
        stddev: Standard deviation of the accelerations in m/s²; 0 = unknown.
    """
    @cache
    def template(frame_id: str, axes: tuple[int, ...]) -> ImuTemplate:
        return ImuTemplate(variances_of(axes, stddev), frame_id)

    for record in records:
        if record.kind != CLOUD or not record.topic.endswith(BATCHES):
            continue
        batch = deserialize_message(record.data, PointCloud2)
        stamps, accelerations = from_imu_batch(batch)
        axes = tuple(np.flatnonzero(accelerations.any(axis=0)).tolist())
        serialised = template(batch.header.frame_id, axes).serialised
        topic = record.topic.removesuffix(BATCHES) + SAMPLES
        for stamp, acceleration in zip(stamps.tolist(), accelerations.tolist(), strict=True):
            yield Record(topic, IMU, serialised(stamp, *acceleration), stamp)


def to_batches(records: Iterable[Record], period: int) -> Iterator[Record]:
    """Yield batches of samples; each holds the samples of a period of so many ns."""
    gathered: dict[str, Batch] = {}
    for record in records:
        if record.kind != IMU or not record.topic.endswith(SAMPLES):
            continue
        imu = deserialize_message(record.data, Imu)
        stamp = imu.header.stamp.sec * 1_000_000_000 + imu.header.stamp.nanosec
        batch = gathered.get(record.topic)
        if batch is not None and stamp // period != batch.stamps[0] // period:
            yield batch.record()
            batch = None
        if batch is None:
            topic = record.topic.removesuffix(SAMPLES) + BATCHES
            batch = gathered[record.topic] = Batch(topic, imu.header.frame_id)
        acceleration = imu.linear_acceleration
        batch.stamps.append(stamp)
        batch.accelerations.append((acceleration.x, acceleration.y, acceleration.z))
    for batch in gathered.values():
        yield batch.record()


class Batch:
    """Samples of a period."""

    def __init__(self, topic: str, frame_id: str) -> None:
        """Begin an empty batch of a topic."""
        self._topic = topic
        self._template = template_of_batch(frame_id)
        self.stamps: list[int] = []
        self.accelerations: list[tuple[float, float, float]] = []

    def record(self) -> Record:
        """Return the batch as a message that was recorded at the time of its last sample."""
        data = self._template.serialised(np.array(self.stamps),
                                         np.array(self.accelerations, np.float32))
        return Record(self._topic, CLOUD, data, self.stamps[-1])


template_of_batch = cache(ImuBatchTemplate)


def main(args: Sequence[str] | None = None) -> None:
    """Convert a bag."""
    introduction, _, rest = (__doc__ or "").partition("\n")
    parser = argparse.ArgumentParser(
        prog="convert_imu", description=introduction, epilog=rest,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bag", type=Path, help="the bag to read")
    parser.add_argument("new_bag", type=Path, help="the bag to make")
    parser.add_argument("--to", choices=("samples", "batch"), default="samples")
    parser.add_argument("--stddev", type=float, default=0.0, metavar="M/S²",
                        help="standard deviation of the accelerations; 0 = unknown (default)")
    parser.add_argument("--batch-period", type=float, default=0.02, metavar="S",
                        help="time whose samples are one batch (default: 0.02)")
    options = parser.parse_args(args)
    if options.batch_period <= 0:
        parser.error("--batch-period must be more than 0")
    try:
        count = convert(options)
    except (DriverError, ValueError) as error:
        parser.exit(1, f"error: {error}\n")
    print(f"{count} messages written to {options.new_bag}")


def convert(options: argparse.Namespace) -> int:
    """Convert a bag and return the number of messages; raises DriverError and ValueError."""
    records = read_bag(options.bag)
    converted = (to_samples(records, options.stddev) if options.to == "samples" else
                 to_batches(records, round(options.batch_period * 1e9)))
    first = next(converted, None)
    if first is None:
        wanted = BATCHES if options.to == "samples" else SAMPLES
        raise DriverError(f"{options.bag} has no messages of a topic …{wanted}")
    with write_bag(options.new_bag) as write:
        write(first)
        count = 1
        for record in converted:
            write(record)
            count += 1
    return count


if __name__ == "__main__":
    main()
