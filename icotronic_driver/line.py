# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""One request at a time on a CAN bus, while the frames of a stream keep coming."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import can

from driver_common import advice
from driver_common import clocks as time
from driver_common.can_link import RECEIVE_BUFFER, CanLink, parse_options
from driver_common.errors import (
    STEP_INTERRUPTED,
    FrameError,
    LinkError,
    NoAnswerError,
    StepInterruptedError,
)
from driver_common.host_pauses import HostPauses
from driver_common.replayed_can import can_interface, can_recorder, open_can
from icotronic_driver.commands import ACCELERATION_DATA
from icotronic_driver.identifier import SPU_1, Identifier, node_name, receiver_filter
from icotronic_driver.request import Request

T = TypeVar("T")

REPLY_TIMEOUT = 0.6  # s; behind the stationary unit there is a radio
ATTEMPTS = 10  # a radio loses frames; as many as the vendor's client makes (field note N1)
BACKLOG_TIME = 1.0  # s for what waited while this host was busy
NETWORK = ("socketcand",)  # interfaces to a server, which may be elsewhere
SILENCE = 10.0  # s without a frame from there, although something was asked
ENOUGH_BUFFER = 1024 * 1024  # bytes, in which about 0.4 s of the fastest stream fit
ERROR_BUS_OFF = 0x40  # in the identifier of an error frame of the kernel
FILTERS = (receiver_filter(SPU_1), (SPU_1 << 6, 0x1F << 6))  # for us; and as if from us
STREAM_ID = ACCELERATION_DATA.encode()

StreamHandler = Callable[[bytearray, float, int], None]


@dataclass
class LineCounts:
    """What was counted on the bus beside the stream.

    Attributes:
        stale: Frames for this host that answered nothing.
        foreign: Frames of other protocols or for other nodes.
        other_host: Frames of another host with our node number.
        errors: Error frames of the controller.
    """

    stale: int = 0
    foreign: int = 0
    other_host: int = 0
    errors: int = 0


class Line:
    """A CAN bus with a stationary unit, seen from the host.

    Attributes:
        recorder: Has what passed of late.
        counts: What was counted.
        pauses: Those of this host, while a stream comes.
        on_stream: Takes the data of each frame of the acceleration stream, when it was on the bus
            in s of the interface's clock, and its arrival in monotonic ns.
    """

    def __init__(self, interface: str, channel: str, bitrate: int, options: Sequence[str]) -> None:
        """Prepare the line; nothing is opened. For the arguments see `CanLink`.

        Raises:
            SettingError: An option has no "=".
        """
        parse_options(options)  # a wrong one is told now, and not at every attempt to open
        self.recorder = can_recorder(interface, channel)
        self.counts = LineCounts()
        self.pauses = HostPauses()
        self.on_stream: StreamHandler | None = None
        self._make_link = partial(open_can, interface, channel, bitrate, options, FILTERS,
                                  self.recorder)
        self._link: CanLink | None = None
        self._interrupted = threading.Event()
        self._hurried = False
        self.interface = can_interface(interface, self.recorder)
        self.name = f"{interface} {channel}"

    def open(self) -> None:
        """Open the bus; raises LinkError."""
        self._link = self._make_link()
        self._hurried = False

    def close(self) -> None:
        """Close the bus."""
        if self._link is not None:
            self._link.close()
            self._link = None

    def interrupt(self) -> None:
        """Have requests end with a StepInterruptedError; called from another thread."""
        self._interrupted.set()

    def resume(self, *, hurried: bool = False) -> None:
        """Make requests again, each once only where that is hurried."""
        self._hurried = hurried
        self._interrupted.clear()

    @property
    def is_open(self) -> bool:
        """Whether the bus is open."""
        return self._link is not None

    @property
    def link(self) -> CanLink:
        """The open bus; raises LinkError where it is closed."""
        if self._link is None:
            raise LinkError(f"{self.name} is not open")
        return self._link

    @property
    def buffer_warning(self) -> str:
        """What is to be said about the kernel's receive buffer, "" where it is large enough."""
        size = self.link.receive_buffer
        if self.interface != "socketcan" or not 0 < size < ENOUGH_BUFFER:
            return ""
        return advice.SMALL_BUFFER.text(size=size // 1024, wanted=RECEIVE_BUFFER)

    @property
    def arrival_time(self) -> int:
        """The host's time in ns when something arrived last."""
        return self.link.arrived + self.recorder.offset

    def listen(self, duration: float, may_wait: float = 0.0) -> None:
        """Receive for some s and hand over what arrives; raises LinkError.

        Args:
            duration: Time in s.
            may_wait: Time in s for which frames may wait for others: waking up for each of them
                costs more than to receive it.
        """
        link, handle, now = self.link, self.on_stream, self.recorder.now()
        self.pauses.wait(duration)
        receive, end = link.receive, now + int(duration * 1e9)
        try:
            while now < end:
                message = receive(0.0 if may_wait else (end - now) * 1e-9)
                now = link.arrived
                if message is None:
                    time.sleep(may_wait)
                    continue
                if message.arbitration_id == STREAM_ID and handle and message.is_extended_id:
                    handle(message.data, message.timestamp, now)
                else:
                    self._count(message)
        except (can.CanError, OSError) as error:
            raise link.lost(error) from error

    def request(self, request: Request[T], timeout: float = REPLY_TIMEOUT,
                attempts: int = ATTEMPTS) -> T:
        """Send a request, again where its answer is lost, and return what the answer says.

        Raises:
            RefusedError: The node answered with an error.
            FrameError: The answer has a wrong length or content.
            NoAnswerError: Nothing came in time.
            LinkError: The bus failed, or the driver is to stop.
        """
        for _ in range(0 if self._hurried else attempts - 1):
            with contextlib.suppress(NoAnswerError):
                return self._attempt(request, timeout)
        return self._attempt(request, timeout)

    def _attempt(self, request: Request[T], timeout: float) -> T:
        if self._interrupted.is_set():
            raise StepInterruptedError(STEP_INTERRUPTED)
        self._open_again_if_silent()
        link = self.link
        self.pauses.wait(timeout)
        link.send(request.frame.identifier.encode(), request.frame.data)
        end = time.monotonic() + timeout
        try:
            # What came while this host was busy is looked at, if a bus ever falls silent.
            while (time.monotonic() < end + BACKLOG_TIME and (
                    message := link.receive(max(0.0, end - time.monotonic()))) is not None):
                streamed = message.arbitration_id == STREAM_ID and message.is_extended_id
                # At the end nobody waits for what this host, being busy, has not read yet.
                if streamed and self.on_stream and not self._hurried:
                    self.on_stream(message.data, message.timestamp, link.arrived)
                if (message.is_extended_id and not message.is_error_frame
                        and request.is_answered_by(message.arbitration_id, message.data)):
                    return request.result(message.arbitration_id, message.data)
                if not streamed:
                    self._count(message)
        except (can.CanError, OSError) as error:
            raise link.lost(error) from error
        raise NoAnswerError(f"{node_name(request.frame.identifier.receiver)} does not answer "
                            f"on {self.name} ({request.name})")

    def _open_again_if_silent(self) -> None:
        """Open a bus elsewhere again that has been silent: its server may be gone unnoticed."""
        silence = time.monotonic() - self.link.heard * 1e-9
        if self.interface in NETWORK and silence > SILENCE:
            self.close()
            self.open()

    def _count(self, message: can.Message) -> None:
        """Count a frame that nobody waits for; raises LinkError where the controller gave up."""
        if message.is_error_frame:
            self.counts.errors += 1
            if message.arbitration_id & ERROR_BUS_OFF:
                raise LinkError(f"{self.name}: {advice.BUS_OFF.text()}")
            return
        try:
            if not message.is_extended_id:
                raise FrameError("a frame with a standard identifier")
            identifier = Identifier.decode(message.arbitration_id)
        except FrameError:
            self.counts.foreign += 1
            return
        if identifier.sender == SPU_1:
            self.counts.other_host += 1
        elif identifier.receiver != SPU_1:
            self.counts.foreign += 1
        else:
            self.counts.stale += 1
