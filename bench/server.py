# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The CAN bus that feeds the measured programs: a simulated ICOtronic system, in its own process.

It prints its TCP port and reads its standard input. At "find" the sensor comes into range, to be
found, connected and started as always. At "stream" it streams by itself, for programs which only
receive. When it has sent all of its frames it prints the monotonic time, and falls silent.
"""

from __future__ import annotations

import argparse
import contextlib
import math
import sys
import time
from collections.abc import Callable

from driver_common.simulator.bus import CanFrame
from icotronic_driver.commands import ACCELERATION_DATA, START_ACCELERATION
from icotronic_driver.identifier import STH_1
from icotronic_driver.settings import nearest_adc_configuration
from icotronic_driver.simulator.line import SimulatedIcotronic, SimulatedNetwork
from icotronic_driver.simulator.sth import SimulatedSth
from icotronic_driver.streaming import StreamFormat, stream_format

ONE_CHANNEL = stream_format((True, False, False))
FLOOD = "".join(
    CanFrame(ACCELERATION_DATA.encode(), bytes((ONE_CHANNEL.encode(), counter, *b"123456"))
             ).encode(time.time()) for counter in range(256)) * 8  # 2 ms for the fastest client
ROOM = 1 << 16  # bytes that may wait for the client when the next ones are added

Frames = list[tuple[float, int, bytes]]


class LimitedSensor(SimulatedSth):
    """A sensor that sends a certain number of frames, at its own pace."""

    def __init__(self, frames: int) -> None:
        """Send so many frames in all."""
        super().__init__("Bench")
        self._left = frames

    def poll(self, now: float) -> Frames:
        """Return the frames that are due."""
        frames = super().poll(now)[:self._left]
        self._left -= len(frames)
        if frames and not self._left:
            print(time.monotonic(), flush=True)
        return frames


class Flood(CanFrame):
    """Many frames that are sent as one, encoded beforehand."""

    def encode(self, timestamp: float) -> str:
        """Return the messages that tell a client of these frames."""
        return FLOOD


class FloodingNetwork(SimulatedNetwork):
    """A network in which the stream comes as fast as the clients take it, for ever."""

    has_room: Callable[[], bool]

    def next_due(self, now: float) -> float | None:
        """Return now where frames may be sent."""
        return now if self._floods() else super().next_due(now)

    def poll(self, now: float) -> list[tuple[float, CanFrame]]:
        """Return the frames that are due."""
        return super().poll(now) + ([(now, Flood(0, b""))] if self._floods() else [])

    def _floods(self) -> bool:
        return bool(self.sensors[0].streams) and self.has_room()


class SilentSensor(LimitedSensor):
    """A sensor whose frames somebody else sends."""

    def poll(self, now: float) -> Frames:
        """Return no frames."""
        return []

    def next_frame(self) -> float:
        """Return that none is due."""
        return math.inf


class Bus(SimulatedIcotronic):
    """The socketcand server."""

    def has_room(self) -> bool:
        """Whether the clients took nearly all that was sent."""
        return all(len(client.waiting) < ROOM for client in self._clients)


def start_stream(network: SimulatedNetwork, format: StreamFormat) -> None:
    """Have the sensor stream without being asked."""
    sensor = network.sensors[0]
    with network.lock:
        network.stu.connected, sensor.connected = sensor, True
        request = START_ACCELERATION.request(STH_1, format).frame
        network.receive(CanFrame(request.identifier.encode(), request.data), time.monotonic())


def main() -> None:
    """Serve until standard input ends."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--frames", type=int, default=0, help="0 = a flood without end")
    parser.add_argument("--rate", type=float, help="values/s in a stream that nobody asked for")
    options = parser.parse_args()
    sensor = LimitedSensor(options.frames) if options.frames else SilentSensor(0)
    sensor.in_range = False
    if options.rate:
        sensor.adc = nearest_adc_configuration(options.rate)
    network = SimulatedNetwork([sensor]) if options.frames else FloodingNetwork([sensor])
    bus = Bus(network, "127.0.0.1:0", "")
    if isinstance(network, FloodingNetwork):
        network.has_room = bus.has_room
    bus.start()
    print(bus.port, flush=True)
    for command in sys.stdin:
        sensor.in_range = True
        if command.strip() == "stream":
            start_stream(network, ONE_CHANNEL)
    bus.close()


if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt):
        main()
