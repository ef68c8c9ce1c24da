# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Bags of rosbag2: serialised messages in and out, with rosbag2_py or, where no ROS is, rosbags."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from driver_common.errors import DriverError

STORAGE = "mcap"
NEEDED = ("a bag needs rosbag2_py, which comes with ROS, or rosbags: "
          "'pip install rosbags', in a virtual environment")


class Record(NamedTuple):
    """A message of a bag.

    Attributes:
        topic: Name of its topic.
        kind: Its type, such as "sensor_msgs/msg/Imu".
        data: The serialised message.
        time: When it was recorded, in ns since the epoch.
    """

    topic: str
    kind: str
    data: bytes
    time: int


Write = Callable[[Record], None]


def read_bag(path: Path) -> Iterator[Record]:
    """Yield the messages of a bag in the order of their times; raises DriverError."""
    if not path.exists():
        raise DriverError(f"there is no bag {path}")
    _check_library()
    try:
        yield from _read_with_ros(path) if has_rosbag2() else _read_without_ros(path)
    except DriverError:
        raise
    except Exception as error:  # both libraries have many
        raise DriverError(f"cannot read the bag {path}: {error}") from error


@contextmanager
def write_bag(path: Path) -> Iterator[Write]:
    """Make a bag, and yield what writes a message into it; raises DriverError."""
    if path.exists():
        raise DriverError(f"{path} exists already; name another directory")
    _check_library()
    with (_write_with_ros(path) if has_rosbag2() else _write_without_ros(path)) as write:
        yield write


def has_rosbag2() -> bool:
    """Whether ROS's own library is there."""
    return importlib.util.find_spec("rosbag2_py") is not None


def has_library() -> bool:
    """Whether any library for bags is there."""
    return has_rosbag2() or importlib.util.find_spec("rosbags") is not None


def _check_library() -> None:
    if not has_library():
        raise DriverError(NEEDED)


def _read_with_ros(path: Path) -> Iterator[Record]:
    import rosbag2_py

    reader = rosbag2_py.SequentialReader()
    reader.open(rosbag2_py.StorageOptions(uri=str(path), storage_id=""),
                rosbag2_py.ConverterOptions("", ""))
    kinds = {topic.name: topic.type for topic in reader.get_all_topics_and_types()}
    while reader.has_next():
        topic, data, time = reader.read_next()
        yield Record(topic, kinds[topic], data, time)


@contextmanager
def _write_with_ros(path: Path) -> Iterator[Write]:
    import rosbag2_py

    writer = rosbag2_py.SequentialWriter()
    writer.open(rosbag2_py.StorageOptions(uri=str(path), storage_id=STORAGE),
                rosbag2_py.ConverterOptions("", ""))
    topics: set[str] = set()

    def write(record: Record) -> None:
        if record.topic not in topics:
            topics.add(record.topic)
            writer.create_topic(rosbag2_py.TopicMetadata(
                id=0, name=record.topic, type=record.kind, serialization_format="cdr"))
        writer.write(record.topic, record.data, record.time)

    yield write
    writer.close()


def _read_without_ros(path: Path) -> Iterator[Record]:
    from rosbags.rosbag2 import Reader

    with Reader(path) as reader:
        for connection, time, data in reader.messages():
            yield Record(connection.topic, connection.msgtype, data, time)


@contextmanager
def _write_without_ros(path: Path) -> Iterator[Write]:
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    definitions = get_typestore(Stores.ROS2_JAZZY)
    topics: dict[str, Any] = {}
    with Writer(path, version=9, storage_plugin=StoragePlugin[STORAGE.upper()]) as writer:
        def write(record: Record) -> None:
            if record.topic not in topics:
                topics[record.topic] = writer.add_connection(record.topic, record.kind,
                                                             typestore=definitions)
            writer.write(topics[record.topic], record.time, record.data)

        yield write
