# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The recorder of the demonstration: takes serialised messages as they come, into a bag."""

from __future__ import annotations

import importlib
import shutil
import struct
import time
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message
from rclpy.signals import SignalHandlerOptions

from driver_common.errors import DriverError
from sensor_tools.demo.families import Topic
from sensor_tools.demo.machine import Array

DEPTH = 20_000  # messages that may wait for the recorder: 2 s of the fastest sensor
KEPT = 200_000  # messages of a topic that are kept for the picture
STAMP = struct.Struct("<4x i I")  # where a serialised message has the stamp of its header


class Bag:
    """A new rosbag2 bag in the form of ROS 2 Jazzy; a context manager.

    It vanishes again where nothing was written.
    """

    def __init__(self, path: Path, topics: Iterable[Topic]) -> None:
        """Create the directory.

        Raises:
            DriverError: It exists already or cannot be made.
            ImportError: The library is missing.
        """
        from rosbags.rosbag2 import StoragePlugin, Writer
        from rosbags.typesys import Stores, get_typestore

        definitions = get_typestore(Stores.ROS2_JAZZY)
        self._path = path
        try:
            if path.exists():
                raise DriverError(f"{path} exists already; name another directory with --bag")
            self._writer = Writer(path, version=9, storage_plugin=StoragePlugin.MCAP)
            self._writer.open()
        except OSError as error:
            raise DriverError(f"cannot make the bag {path}: {error.strerror}") from error
        self._connections = {
            topic.name: self._writer.add_connection(topic.name, topic.kind, typestore=definitions)
            for topic in topics}
        self._empty = True

    def write(self, topic: Topic, stamp: int, data: bytes) -> None:
        """Write a serialised message that arrived at `stamp`, in ns since the epoch."""
        self._writer.write(self._connections[topic.name], stamp, data)
        self._empty = False

    def __enter__(self) -> Bag:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Complete the bag, or take it away."""
        try:
            self._writer.close()
        except OSError as error:
            raise DriverError(f"cannot complete the bag: {error.strerror}") from error
        finally:
            if self._empty:
                shutil.rmtree(self._path)


@dataclass
class Channel:
    """A recorded topic.

    Attributes:
        topic: What is recorded.
        kind: Class of its messages.
        subscription: Where they come from.
        count: How many came.
        is_complete: Whether one came that was measured after the end; it is not recorded.
        kept: The last ones, serialised.
    """

    topic: Topic
    kind: Any
    subscription: Any
    count: int = 0
    is_complete: bool = False
    kept: deque[bytes] = field(default_factory=lambda: deque(maxlen=KEPT))

    def stamps(self) -> Array:
        """Return the times of the last messages in s since the epoch."""
        return np.array([self.stamp_of(data) for data in self.kept])

    @staticmethod
    def stamp_of(data: bytes) -> float:
        """Return the time of a serialised message in s since the epoch: its header is first."""
        seconds, nanoseconds = STAMP.unpack_from(data)
        return float(seconds + 1e-9 * nanoseconds)

    def messages(self) -> list[Any]:
        """Return the last messages."""
        return [deserialize_message(data, self.kind) for data in self.kept]


class Recorder:
    """Subscribes to topics; a context manager, during which this process is a ROS node.

    There is no executor: `poll` takes what has arrived, and the middleware knows when it did. So
    even 10,000 messages a second cost little, and a pause of a second loses none.

    Attributes:
        channels: The topics with what has come of them.
        began: When `start` was called, in s since the epoch.
    """

    def __init__(self, topics: Iterable[Topic], bag: Bag | None) -> None:
        """Subscribe to topics; nothing is recorded before `start`.

        Raises:
            DriverError: ROS does not start.
        """
        try:
            rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
            self._node = rclpy.create_node("demo_recorder", start_parameter_services=False,
                                           enable_rosout=False)
        except RuntimeError as error:
            rclpy.try_shutdown()
            raise DriverError(f"ROS does not start: {str(error).splitlines()[0]}") from error
        self._bag = bag
        self.began = self._started = self._elapsed = 0.0
        self.channels = [self._subscribe(topic) for topic in topics]

    def _subscribe(self, topic: Topic) -> Channel:
        package, _, name = topic.kind.split("/")
        kind = getattr(importlib.import_module(f"{package}.msg"), name)
        return Channel(topic, kind, self._node.create_subscription(
            kind, topic.name, lambda _: None, QoSProfile(depth=DEPTH), raw=True))

    @property
    def elapsed(self) -> float:
        """Time in s from `start` to `stop`, or until now."""
        return self._elapsed or (time.monotonic() - self._started if self._started else 0.0)

    def start(self) -> None:
        """Forget what has come and record from now on."""
        self.poll()
        for channel in self.channels:
            channel.count = 0
        self.began, self._started = time.time(), time.monotonic()

    def stop(self) -> None:
        """Note that the time is over; what was measured until now may come yet."""
        self.poll()
        self._elapsed = self.elapsed

    def poll(self) -> None:
        """Take all messages that have arrived.

        Raises:
            DriverError: They cannot be written.
        """
        for channel in self.channels:
            handle = channel.subscription.handle
            with handle:
                while (taken := handle.take_message(channel.kind, True)) is not None:
                    if self._elapsed and channel.stamp_of(taken[0]) > self.began + self._elapsed:
                        channel.is_complete = True
                        continue
                    channel.count += 1
                    if self._started:
                        self._record(channel, *taken)

    def _record(self, channel: Channel, data: bytes, info: dict[str, int]) -> None:
        channel.kept.append(data)
        if self._bag is not None:
            try:
                self._bag.write(channel.topic, info["received_timestamp"], data)
            except OSError as error:
                raise DriverError(f"cannot write the bag: {error.strerror}") from error

    def __enter__(self) -> Recorder:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Leave ROS."""
        self._node.destroy_node()
        rclpy.try_shutdown()
