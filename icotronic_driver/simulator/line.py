# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A simulated ICOtronic system: a stationary unit (STU) and sensors (STH) behind it, real bytes.

`SimulatedNetwork` is sans-I/O; see `driver_common.simulator.bus` for the wire. The truth of what
the sensors measure is the function `vibration`.
"""

from __future__ import annotations

import heapq
import itertools
import math
import threading
import time
from collections import deque
from collections.abc import Iterator, Sequence

from driver_common.errors import DriverError, FrameError, WrongDeviceError
from driver_common.simulator.bus import CanFrame, SimulatedBus
from icotronic_driver.commands import STREAMING
from icotronic_driver.identifier import (
    BROADCAST,
    BROADCAST_SILENT,
    MAX_PAYLOAD,
    STH_1,
    STU_1,
    Identifier,
)
from icotronic_driver.simulator.sth import FIRST_MAC, SimulatedSth
from icotronic_driver.simulator.stu import Faults, SimulatedStu
from icotronic_driver.simulator.unit import SimulatedNode
from icotronic_driver.values import decode_mac, encode_mac

STU_DELAY, STH_DELAY = 0.001, 0.004  # s until the answer; the sensor's goes over the radio

_FOREIGN = (  # what else can be on a bus: standard frames, other versions, hosts and nodes
    CanFrame(0x04F, bytes.fromhex("A2 00 01 02 03 04 05 06"), extended=False),
    CanFrame(0x1100004F, bytes.fromhex("A2 00 01 02 03 04 05 06")),
    CanFrame(0x0100086F, bytes.fromhex("A2 00 01 02 03 04 05 06")),
    CanFrame(0x01000150, bytes.fromhex("A2 00 01 02 03 04 05 06")),
    CanFrame(0x18FEF100, bytes.fromhex("FF FF FF")),
    CanFrame(0x123, b"", extended=False),
)
_ERROR = CanFrame(0x004, bytes(8), error=True)  # the controller complains


class SimulatedNetwork:
    """Everything on the CAN bus, without I/O: a stationary unit and sensors around it.

    Attributes:
        sensors: The sensors.
        stu: The stationary unit.
        faults: How the system misbehaves.
        streamed: Data frames that were sent, duplicates among them.
        lost: Data frames that were lost on the radio.
        damaged: Data frames whose counter was damaged.
        lock: To be held while several things are changed together.
    """

    def __init__(self, sensors: Sequence[SimulatedSth]) -> None:
        """Connect a stationary unit to the bus, with sensors around it."""
        self.sensors = list(sensors)
        self.faults = Faults()
        self.stu = SimulatedStu(self.sensors, self.faults)
        self.streamed = 0
        self.lost = 0
        self.damaged = 0
        self.lock = threading.RLock()
        self._answers: list[tuple[float, int, CanFrame]] = []
        self._order = itertools.count()
        self._on_air: deque[tuple[float, CanFrame]] = deque()
        self._last_arrival = 0.0
        self._losing = 0
        self._overtaken: CanFrame | None = None
        self._foreign, self._errors = itertools.cycle(_FOREIGN), itertools.cycle((_ERROR,))
        self._next_of_others = {self._foreign: 0.0, self._errors: 0.0}

    # --- for tests and people ---

    def sensor(self, name: str) -> SimulatedSth:
        """Return the sensor with this name.

        Raises:
            WrongDeviceError: There is none.
        """
        for sensor in self.sensors:
            if sensor.name == name:
                return sensor
        raise WrongDeviceError(f'there is no simulated sensor "{name}", only '
                               f"{', '.join(one.name for one in self.sensors)}")

    def power_loss(self, node: SimulatedNode, now: float | None = None) -> None:
        """Take the power from a node and give it back."""
        with self.lock:
            for counter in ("Power Off Cycles", "Under Voltage Counter"):
                node.eeprom[counter] = node.eeprom.number(counter) + 1
            node.boot(time.monotonic() if now is None else now)

    def stay_silent(self, on: str) -> None:
        """Have all units stay silent on some commands; see `SimulatedNode.stay_silent`."""
        for node in (self.stu, *self.sensors):
            node.stay_silent(on)

    def send(self, frame: CanFrame, due: float | None = None) -> None:
        """Put any frame on the bus."""
        with self.lock:
            heapq.heappush(self._answers, (time.monotonic() if due is None else due,
                                           next(self._order), frame))

    # --- the device side of the bus ---

    def receive(self, frame: CanFrame, now: float) -> None:
        """Take a frame; what is not a request to a node here is ignored."""
        with self.lock:
            self._advance(now)
            if self.faults.silent or not frame.extended or frame.error:
                return
            try:
                request = Identifier.decode(frame.can_id)
            except FrameError:
                return
            if request.request:
                for node, delay in list(self._receivers(request.receiver, now)):
                    self._ask(node, request, frame.data, now, delay)

    def _receivers(self, receiver: int, now: float) -> Iterator[tuple[SimulatedNode, float]]:
        """Yield the nodes which hear a request, each with the time that its answer takes."""
        broadcast = receiver in (BROADCAST, BROADCAST_SILENT)
        if not self.stu.is_up(now):
            return
        sensor = self.stu.connected
        if (receiver == STH_1 or broadcast) and sensor is not None:
            self.stu.radio_sent += 1
            if sensor.connected and sensor.in_range and sensor.is_up(now):
                yield sensor, STH_DELAY
        if receiver == STU_1 or broadcast:
            yield self.stu, STU_DELAY

    def _ask(self, node: SimulatedNode, request: Identifier, payload: bytes, now: float,
             delay: float) -> None:
        answer = node.answer(request, payload, now)
        if answer is None or request.receiver == BROADCAST_SILENT:
            return
        if node is not self.stu:
            self.stu.radio_received += 1
            if self.faults.random.random() < self.faults.answer_loss:
                return
            delay += self.faults.answer_delay
        error, data = answer
        if self.faults.padding and request.block == STREAMING:
            data = data.ljust(MAX_PAYLOAD, b"\0")
        identifier = Identifier(request.block, request.block_command, node.number,
                                request.sender, request=False, error=error)
        self.send(CanFrame(identifier.encode(), data), now + delay)

    def poll(self, now: float) -> list[tuple[float, CanFrame]]:
        """Return the frames that are due, in order."""
        with self.lock:
            self._advance(now)
            due: list[tuple[float, CanFrame]] = []
            while self._on_air and self._on_air[0][0] <= now:
                due.append(self._on_air.popleft())
            streamed = len(due)
            while self._answers and self._answers[0][0] <= now:
                when, _, frame = heapq.heappop(self._answers)
                due.append((when, frame))
            for rate, frames in self._others():
                if now >= (next_one := self._next_of_others[frames]):
                    due.append((now, next(frames)))
                    self._next_of_others[frames] = max(now, next_one + 1 / rate)
            if self.faults.silent:
                return []
            self.streamed += streamed
            if len(due) > streamed > 0:
                due.sort(key=lambda item: item[0])
            return due

    def next_due(self, now: float) -> float | None:
        """Return when something is to be sent."""
        with self.lock:
            times = [self._answers[0][0]] if self._answers else []
            if self._on_air:
                times.append(self._on_air[0][0])
            times += [self._next_of_others[frames] for _, frames in self._others()]
            if self.stu.connected is not None:
                times.append(self.stu.connected.next_frame())
            first = min(times, default=math.inf)
            return None if first == math.inf else first

    def _others(self) -> list[tuple[float, itertools.cycle[CanFrame]]]:
        """Return what comes on the bus beside the network's frames, with how many per s."""
        every = (self.faults.foreign, self._foreign), (self.faults.errors, self._errors)
        return [(rate, frames) for rate, frames in every if rate]

    def _advance(self, now: float) -> None:
        """Bring everything to the present: frames that were measured, and connections."""
        sensor = self.stu.connected
        if sensor is not None and sensor.streams:
            frames = sensor.poll(now)
            if frames:
                self._transmit(sensor, frames)
        self.stu.update(now)

    def _transmit(self, sensor: SimulatedSth, frames: list[tuple[float, int, bytes]]) -> None:
        """Send data frames over the radio, where some are lost or come late."""
        if not sensor.in_range:
            self.lost += len(frames)
            return
        self.stu.radio_received += len(frames)
        if (self.faults.spare_stream and not self._losing and not self._on_air
                and self._overtaken is None):
            self._on_air.extend((due, CanFrame(can_id, data)) for due, can_id, data in frames)
            return
        for due, can_id, data in frames:
            self._transmit_badly(due, CanFrame(can_id, data))

    def _transmit_badly(self, due: float, frame: CanFrame) -> None:
        faults = self.faults
        if self._losing == 0 and faults.random.random() < faults.loss:
            self._losing = faults.loss_run
        if self._losing > 0:
            self._losing -= 1
            self.lost += 1
            return
        due += faults.random.uniform(0, faults.jitter)
        if faults.burst:
            due = math.ceil(due / faults.burst) * faults.burst
        self._last_arrival = max(due, self._last_arrival)  # the radio keeps the order
        if faults.random.random() < faults.damage:
            frame = _with_damaged_counter(frame, faults.random.randrange(1, 256))
            self.damaged += 1
        if self._overtaken is None and faults.random.random() < faults.swap:
            self._overtaken = frame
            return
        for _ in range(1 + (faults.random.random() < faults.duplicate)):
            self._on_air.append((self._last_arrival, frame))
        if self._overtaken is not None:
            self._on_air.append((self._last_arrival, self._overtaken))
            self._overtaken = None


def _with_damaged_counter(frame: CanFrame, by: int) -> CanFrame:
    data = bytearray(frame.data)
    data[1] ^= by
    return CanFrame(frame.can_id, bytes(data))


class SimulatedIcotronic(SimulatedBus):
    """The network on a socketcand server.

    Attributes:
        network: What is connected to the bus.
    """

    def __init__(self, network: SimulatedNetwork, listen: str, channel: str) -> None:
        """Open the server; `start` serves it."""
        super().__init__(network, listen, channel)
        self.network = network

    def start(self) -> SimulatedIcotronic:
        """Serve the bus in a thread."""
        super().start()
        return self


def simulated_network(names: Sequence[str] = ("Test-STH",), *, listen: str = "127.0.0.1:0",
                      channel: str = "", calibrated: bool = True,
                      can_fd: bool = False) -> SimulatedIcotronic:
    """Return a server with a stationary unit and one sensor per name around it, not yet started.

    Args:
        names: Names of the sensors; their MAC addresses count up from `FIRST_MAC`.
        listen: "host:port" of the server; port 0 takes a free one.
        channel: The only channel of the bus; "" = any.
        calibrated: Whether the sensors' EEPROM holds calibration factors.
        can_fd: Whether the bus carries frames of up to 64 bytes.

    Raises:
        DriverError: A name is too long, or the TCP port cannot be made.
    """
    if not names:
        raise DriverError("at least one sensor needs a name")
    first = int.from_bytes(encode_mac(FIRST_MAC), "big")
    sensors = [SimulatedSth(name, decode_mac((first + index).to_bytes(6, "big")),
                            calibrated=calibrated, can_fd=can_fd)
               for index, name in enumerate(names)]
    return SimulatedIcotronic(SimulatedNetwork(sensors), listen, channel)
