# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""One request at a time on a serial line: time-outs, retries, and replies that come too late."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator
from typing import TypeVar

from driver_common import clocks as time
from driver_common.errors import FrameError, LinkError, NoAnswerError, RefusedError
from driver_common.replayed_serial import open_serial, serial_recorder
from driver_common.serial_link import SerialLink
from isys_radar_driver.commands import READ_DEVICE_NAME
from isys_radar_driver.frames import (
    FAILURE,
    MASTER,
    MAX_GAP,
    READ_RAW_SIGNALS,
    Frame,
    FrameParser,
)

T = TypeVar("T")

REPLY_TIMEOUT = 0.100  # s until the first byte of a reply that needs no measurement
LATENCY = 0.050  # s, allowance for USB adapters and the host
BYTE_GAP = 0.050  # s that a reply which has begun may pause
BROADCAST_WINDOW = 0.060  # s in which further sensors may answer a broadcast
GRACE = 0.5  # s in which pauses may add up until a reply is over in any case
DAMAGED_ATTEMPTS = 5  # how often to ask a device that answers, but damaged
DOUBT_TIME = 30.0  # s for which damage raises doubts
OVERHEAD = 9  # bytes of an SD2 frame beside its PDU
SMALLEST_FRAME = 6  # bytes; what is damaged and shorter is no reply but a glitch
LONGEST_REPLY = 500  # bytes, of a target list
LONGEST_RAW_REPLY = 131_100  # bytes, of eight signals of 255 blocks


class Line:
    """A serial line with iSYS devices, seen from the master.

    Attributes:
        port: Device path or pyserial URL.
        parser: Finds the frames; counts what is damaged.
        recorder: Has what passed of late.
        stale_frames: Good frames that answered nothing.
        reply_began: Host's time in ns at which the last reply began, whole or damaged.
        overdue: By how much later in s than it could come the last reply was read, because this
            host was suspended or starved.
        damaged: Monotonic time in s at which something arrived damaged.
    """

    def __init__(self, port: str) -> None:
        """Prepare the line; nothing is opened."""
        self.port = port
        self.recorder = serial_recorder(port)
        self.parser = FrameParser()
        self.stale_frames = 0
        self.reply_began = 0
        self.overdue = 0.0
        self.damaged = -math.inf
        self._link: SerialLink | None = None
        self._unanswered: dict[int, Frame] = {}  # requests whose late replies may still come
        self._names_due: Counter[int] = Counter()  # how many of those are device names

    def open(self, baud_rate: int) -> None:
        """Open the port; raises LinkError."""
        self._link = open_serial(self.port, baud_rate, self.recorder)

    def close(self) -> None:
        """Close the port."""
        if self._link is not None:
            self._link.close()
            self._link = None

    @property
    def is_open(self) -> bool:
        """Whether the port is open."""
        return self._link is not None

    @property
    def baud_rate(self) -> int:
        """Baud rate in Bd, 0 while the port is closed."""
        return self._link.baud_rate if self._link else 0

    @property
    def in_doubt(self) -> bool:
        """Whether what comes may be wrong behind a good checksum, because much arrives damaged."""
        return time.monotonic() < self.damaged + DOUBT_TIME

    @property
    def link(self) -> SerialLink:
        """The open port; raises LinkError where it is closed."""
        if self._link is None:
            raise LinkError(f"{self.port} is not open")
        return self._link

    def exchange(self, request: Frame, decode: Callable[[Frame], T], timeout: float, *,
                 sources: tuple[int, ...] = (), attempts: int = 2,
                 damaged_attempts: int = DAMAGED_ATTEMPTS) -> tuple[T, int]:
        """Send a request, again where its reply is lost, and return the decoded reply.

        Args:
            request: The request.
            decode: Turns the reply into a value; raises FrameError where it does not fit.
            timeout: Time in s until the reply begins.
            sources: Addresses that may answer, if others than the one that was asked.
            attempts: How often to ask where nothing comes.
            damaged_attempts: How often to ask where what comes is damaged.

        Returns:
            What `decode` made of the reply, and the host's time in ns when the reply began.

        Raises:
            RefusedError: The device answered with a failure.
            FrameError: What came was damaged, or `decode` did not accept it.
            NoAnswerError: Nothing came in time.
            LinkError: The port failed.
        """
        believed = not self.in_doubt  # else it may have understood another request
        while True:
            try:
                return self._attempt(request, decode, timeout, sources)
            except RefusedError:
                if believed:
                    raise
                believed = True
            except NoAnswerError:
                attempts -= 1
                if attempts <= 0:
                    raise
            except FrameError:
                self.damaged = time.monotonic()
                damaged_attempts -= 1
                if damaged_attempts <= 0:
                    raise

    def broadcast(self, request: Frame) -> list[Frame]:
        """Send a request to all and return what they answer."""
        link = self.link
        self._discard_input()
        link.write(request.encode())
        replies: list[Frame] = []
        end = time.monotonic() + REPLY_TIMEOUT + LATENCY
        while (remaining := end - time.monotonic()) > 0:
            found = list(self.parser.feed(link.read(remaining)))
            if found:
                replies += [frame for frame in found if frame.destination == MASTER
                            and frame.function_code == request.function_code]
                end = min(end, time.monotonic() + BROADCAST_WINDOW)
        return replies

    def _attempt(self, request: Frame, decode: Callable[[Frame], T], timeout: float,
                 sources: tuple[int, ...]) -> tuple[T, int]:
        """Send a request once.

        Replies carry the function code alone, not what was asked for: after a time-out a late
        reply could pass for the answer to another request. So that one is preceded by a request
        for the device name, whose reply cannot be mistaken, and all before it is discarded. Where
        several device names are due, only the last one is the proof.
        """
        address = request.destination
        asks_name = request.function_code == READ_DEVICE_NAME.function_code
        if self._unanswered.get(address, request) != request and not asks_name:
            self._attempt(READ_DEVICE_NAME.request(address), lambda frame: None,
                          REPLY_TIMEOUT + timeout, ())
        self._discard_input()
        self._names_due[address] += asks_name
        dropped = self.parser.dropped_bytes
        self.parser.damaged_frame = None
        self.link.write(request.encode())
        unacceptable: FrameError | None = None
        older_name: tuple[Frame, int] | None = None
        for frame, stamp in self._frames(request, timeout):
            if frame == request:
                continue  # the line's echo of ourselves
            self._note_name(frame)
            if not _answers(frame, request, sources or (address,)):
                self.stale_frames += 1
                continue
            if asks_name and self._names_due[address]:
                older_name = frame, stamp
                continue
            if asks_name:  # else an earlier one of the same kind may have been answered
                self._unanswered.pop(address, None)
            if frame.function_code == FAILURE:
                raise RefusedError(f"address {frame.source} answers with failure (0xFD): not "
                                   "possible in its present state, or a value that it does "
                                   "not allow")
            try:
                return decode(frame), stamp
            except FrameError as error:
                unacceptable = error
        if older_name is not None:  # the others were lost
            self._names_due[address] = 0
            self._unanswered.pop(address, None)
            return decode(older_name[0]), older_name[1]
        if unacceptable is None and self.parser.dropped_bytes - dropped >= SMALLEST_FRAME:
            self._names_due[address] -= asks_name and self._names_due[address] > 0
            raise FrameError(f"the reply of address {address} arrived damaged")
        self._unanswered[address] = request
        raise unacceptable or NoAnswerError(f"address {address} does not answer on {self.port} "
                                            f"at {self.link.baud_rate} Bd")

    def _frames(self, request: Frame, timeout: float) -> Iterator[tuple[Frame, int]]:
        """Yield the frames that arrive in time, each with the host time in ns at its first byte.

        A reply that has begun may finish as long as its bytes keep coming; silence ends it, whole
        or damaged. No line is listened to for longer than the longest reply takes.
        """
        link, parser = self.link, self.parser
        parser.raw_signals = request.function_code == READ_RAW_SIGNALS
        longest = LONGEST_RAW_REPLY if parser.raw_signals else LONGEST_REPLY
        deadline = time.monotonic() + timeout + link.seconds(len(request.pdu) + OVERHEAD)
        end = deadline + link.seconds(longest) + GRACE
        dropped, self.reply_began = parser.dropped_bytes, 0
        while data := link.read(min(deadline, end) - time.monotonic()):
            if not parser.pending:
                self.reply_began = link.time - round(link.seconds(len(data)) * 1e9)
                self.overdue = time.monotonic() - min(deadline, end)
            for frame in parser.feed(data):
                yield frame, self.reply_began
            now = time.monotonic()
            if parser.pending + parser.dropped_bytes - dropped >= SMALLEST_FRAME:
                whole = not parser.pending and parser.damaged_frame is not None
                deadline = now + (MAX_GAP if whole else BYTE_GAP)
            elif parser.pending:
                deadline = max(deadline, now + BYTE_GAP)
            if now >= min(deadline, end):
                break
        for frame in parser.flush():
            yield frame, self.reply_began

    def _discard_input(self) -> None:
        """Drop what arrived unasked, so that it cannot pass for a reply."""
        for frame in (*self.parser.feed(self.link.read(0)), *self.parser.flush()):
            self._note_name(frame)
            self.stale_frames += 1

    def _note_name(self, frame: Frame) -> None:
        if frame.function_code == READ_DEVICE_NAME.function_code and frame.destination == MASTER:
            self._names_due[frame.source] = max(0, self._names_due[frame.source] - 1)


def _answers(frame: Frame, request: Frame, sources: tuple[int, ...]) -> bool:
    if frame.destination != MASTER or frame.source not in sources:
        return False
    if request.function_code == READ_DEVICE_NAME.function_code:  # which no device refuses
        return frame.function_code == request.function_code
    return frame.function_code in (request.function_code, FAILURE)
