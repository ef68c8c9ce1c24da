# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Pretended time, and links in it: it passes only where somebody waits, so a load changes nothing.

Behind the links are the drivers' simulated devices, whose answers a `Script` changes.
"""

from __future__ import annotations

import contextlib
import heapq
import itertools
import math
from collections import deque
from collections.abc import Callable, Iterator, Sequence

import can

from driver_common import clocks
from driver_common.clocks import SECOND, ReplayClock
from driver_common.errors import LinkError
from driver_common.flight_recorder import (
    EXTENDED,
    Entry,
    FlightRecorder,
    Frame,
    Kind,
    pack_frame,
    pack_offset,
)
from driver_common.serial_link import BITS_PER_BYTE
from driver_common.simulator.bus import CanFrame
from driver_common.simulator.line import SimulatedDevice
from icotronic_driver.simulator.line import SimulatedNetwork

BEGIN = 1_000 * SECOND  # ns, monotonic
EPOCH = 1_700_000_000 * SECOND  # ns since the epoch, at zero of the monotonic clock


class PretendedClock(ReplayClock):
    """A time that passes as fast as can be."""

    def __init__(self) -> None:
        """Stop at the beginning."""
        super().__init__(BEGIN, EPOCH)
        self.rate = 0.0

    def pass_until(self, to: int) -> None:
        """Be at a time; that waits for nothing, and yields the processor to nobody."""
        self.now = max(self.now, to)


@contextlib.contextmanager
def pretended_time() -> Iterator[PretendedClock]:
    """Have this thread live in a time of its own."""
    clock = PretendedClock()
    clocks.use(clock)
    try:
        yield clock
    finally:
        clocks.use(None)


class PretendedRecorder(FlightRecorder):
    """Records what passes in a pretended time.

    Attributes:
        clock: The time.
        entries: What passed.
    """

    def __init__(self, clock: PretendedClock) -> None:
        """Begin with a link that is opened."""
        super().__init__()
        self.clock = clock
        self.offset = clock.offset
        self.entries = [Entry(clock.now, Kind.OFFSET, pack_offset(clock.offset)),
                        Entry(clock.now, Kind.OPENED)]

    def add(self, now: int, kind: Kind, content: bytes = b"") -> None:
        """Take what happened."""
        self.entries.append(Entry(now, kind, content))

    def read_offset(self) -> int:
        """Return the offset, which never changes."""
        self.add(self.clock.now, Kind.OFFSET, pack_offset(self.offset))
        return self.offset

    def now(self) -> int:
        """Return the time."""
        self.add(self.clock.now, Kind.CLOCK)
        return self.clock.now


class PretendedPort:
    """Takes the place of a `SerialLink`.

    Attributes:
        port: Its name.
        baud_rate: Baud rate in Bd; at another one than the devices' nothing is understood.
    """

    port = "pretended"

    def __init__(self, recorder: PretendedRecorder, devices: SimulatedDevice,
                 arrivals: Callable[[bytes], Sequence[tuple[float, bytes]]]) -> None:
        """Connect devices to a line; `arrivals` says what arrives in the place of an answer."""
        self.baud_rate = devices.baud_rate
        self._recorder, self._clock = recorder, recorder.clock
        self._devices, self._arrivals = devices, arrivals
        self._coming: deque[tuple[int, bytes]] = deque()  # when in ns, and what
        self._last = 0

    @property
    def time(self) -> int:
        """The time of day in ns."""
        return self._clock.now + self._clock.offset

    def seconds(self, length: int) -> float:
        """Return the time that `length` bytes take on the line."""
        return length * BITS_PER_BYTE / self.baud_rate

    def write(self, data: bytes) -> None:
        """Have the devices answer."""
        self._recorder.add(self._clock.now, Kind.SENT, data)
        if self.baud_rate != self._devices.baud_rate:
            return
        arrived = self._clock.now / SECOND + self.seconds(len(data))
        for due, reply in self._devices.receive(data, arrived):
            for later, piece in self._arrivals(reply):
                when = int((due + later + self.seconds(len(piece))) * SECOND)
                self._coming.append((max(when, self._last), piece))
                self._last = self._coming[-1][0]  # nothing overtakes what is on its way

    def read(self, timeout: float) -> bytes:
        """Return what arrives, after a wait of so many s at most for the first of it."""
        clock, data = self._clock, b""
        end = clock.now + int(max(timeout, 0.0) * SECOND)
        clock.pass_until(min(end, self._coming[0][0]) if self._coming else end)
        while self._coming and self._coming[0][0] <= clock.now:
            data += self._coming.popleft()[1]
        self._recorder.add(clock.now, Kind.RECEIVED if data else Kind.NOTHING, data)
        return data

    def close(self) -> None:
        """Forget what is on the way."""
        self._coming.clear()

    def resume(self) -> None:
        """Do nothing: nobody interrupts."""


class PretendedCan:
    """Takes the place of a `CanLink` through the kernel.

    Attributes:
        arrived: Monotonic time in ns when `receive` returned last.
        heard: Monotonic time in ns of the last frame.
        receive_buffer: Not known.
    """

    def __init__(self, recorder: PretendedRecorder, network: SimulatedNetwork,
                 arrivals: Callable[[CanFrame], Sequence[tuple[float, CanFrame]]]) -> None:
        """Connect a network to a bus; `arrivals` says what arrives in the place of a frame."""
        self.arrived = self.heard = recorder.clock.now
        self.receive_buffer = 0
        self._recorder, self._clock = recorder, recorder.clock
        self._network, self._arrivals = network, arrivals
        self._coming: list[tuple[int, int, CanFrame]] = []  # when in ns, and what
        self._order = itertools.count()

    def send(self, identifier: int, data: bytes) -> None:
        """Have the network answer."""
        self._recorder.add(self._clock.now, Kind.SENT,
                           pack_frame(Frame(0.0, identifier | EXTENDED, data)))
        self._network.receive(CanFrame(identifier, data), self._clock.now / SECOND)

    def receive(self, timeout: float) -> can.Message | None:
        """Return the next frame, None after so many s."""
        end = self._clock.now + int(max(timeout, 0.0) * SECOND)
        while True:
            self._take()
            if self._coming and self._coming[0][0] <= self._clock.now:
                return self._message(*heapq.heappop(self._coming))
            if self._clock.now >= end:
                self.arrived = self._clock.now
                self._recorder.add(self.arrived, Kind.NOTHING)
                return None
            due = self._network.next_due(self._clock.now / SECOND)
            times = [end, *([] if due is None else [math.ceil(due * SECOND)]),
                     *(when for when, _, _ in self._coming[:1])]
            self._clock.pass_until(max(min(times), self._clock.now + 1000))

    def _take(self) -> None:
        for due, frame in self._network.poll(self._clock.now / SECOND):
            for later, what in self._arrivals(frame):
                heapq.heappush(self._coming, (
                    int((due + later) * SECOND), next(self._order), what))

    def _message(self, when: int, number: int, frame: CanFrame) -> can.Message:
        self.arrived = self.heard = self._clock.now
        bus_time = (when + self._clock.offset) / SECOND
        if frame.extended and not frame.error:
            self._recorder.add(self.arrived, Kind.RECEIVED, pack_frame(
                Frame(bus_time, frame.can_id | EXTENDED, frame.data)))
        return can.Message(
            timestamp=bus_time, arbitration_id=frame.can_id,
            is_extended_id=frame.extended, is_error_frame=frame.error, data=frame.data)

    def close(self) -> None:
        """Forget what is on the way."""
        self._coming.clear()

    def lost(self, error: Exception) -> LinkError:
        """Return an error in words."""
        return LinkError(str(error))
