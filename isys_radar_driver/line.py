"""One request at a time on a serial line: time-outs, retries, and replies that come too late."""

from __future__ import annotations

import contextlib
import time
from collections import Counter
from collections.abc import Callable, Iterator
from typing import TypeVar

from driver_common.errors import FrameError, LinkError, NoAnswerError, RefusedError
from driver_common.serial_link import SerialLink
from isys_radar_driver.commands import READ_DEVICE_NAME
from isys_radar_driver.frames import FAILURE, MASTER, Frame, FrameParser

T = TypeVar("T")

REPLY_TIMEOUT = 0.100  # s until the first byte of a reply that needs no measurement
LATENCY = 0.050  # s, allowance for USB adapters and the host
BYTE_GAP = 0.100  # s that a reply which has begun may pause
BROADCAST_WINDOW = 0.060  # s in which further sensors may answer a broadcast
OVERHEAD = 9  # bytes of an SD2 frame beside its PDU


class Line:
    """A serial line with iSYS devices, seen from the master.

    Attributes:
        port: Device path or pyserial URL.
        parser: Finds the frames; counts what is damaged.
        stale_frames: Good frames that answered nothing.
    """

    def __init__(self, port: str) -> None:
        """Prepare the line; nothing is opened."""
        self.port = port
        self.parser = FrameParser()
        self.stale_frames = 0
        self._link: SerialLink | None = None
        self._unanswered: set[int] = set()  # addresses whose late replies may still come
        self._names_due: Counter[int] = Counter()  # how many of those are device names

    def open(self, baud_rate: int) -> None:
        """Open the port; raises LinkError."""
        self._link = SerialLink(self.port, baud_rate)

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
    def link(self) -> SerialLink:
        """The open port; raises LinkError where it is closed."""
        if self._link is None:
            raise LinkError(f"{self.port} is not open")
        return self._link

    def exchange(self, request: Frame, decode: Callable[[Frame], T], timeout: float, *,
                 sources: tuple[int, ...] = (), attempts: int = 2) -> tuple[T, int]:
        """Send a request, again where its reply is lost, and return the decoded reply.

        Args:
            request: The request.
            decode: Turns the reply into a value; raises FrameError where it does not fit.
            timeout: Time in s until the reply begins.
            sources: Addresses that may answer, if others than the one that was asked.
            attempts: How often to ask.

        Returns:
            What `decode` made of the reply, and the host's time in ns when the reply began.

        Raises:
            RefusedError: The device answered with a failure.
            FrameError: Only replies came that `decode` does not accept.
            NoAnswerError: Nothing came in time.
            LinkError: The port failed.
        """
        for _ in range(attempts - 1):
            with contextlib.suppress(NoAnswerError, FrameError):
                return self._attempt(request, decode, timeout, sources)
        return self._attempt(request, decode, timeout, sources)

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
        reply could pass for the answer to the next request. So that one is preceded by a request
        for the device name, whose reply cannot be mistaken, and all before it is discarded. Where
        several device names are due, only the last one is the proof.
        """
        address = request.destination
        asks_name = request.function_code == READ_DEVICE_NAME.function_code
        if address in self._unanswered and not asks_name:
            self._attempt(READ_DEVICE_NAME.request(address), lambda frame: None,
                          REPLY_TIMEOUT + timeout, ())
        self._discard_input()
        self._names_due[address] += asks_name
        self.link.write(request.encode())
        unacceptable: FrameError | None = None
        older_name: tuple[Frame, int] | None = None
        sent = self.link.seconds(len(request.pdu) + OVERHEAD)
        for frame, stamp in self._frames(timeout + sent):
            if frame == request:
                continue  # the line's echo of ourselves
            self._note_name(frame)
            if not _answers(frame, request, sources or (address,)):
                self.stale_frames += 1
                continue
            if asks_name and self._names_due[address]:
                older_name = frame, stamp
                continue
            self._unanswered.discard(address)
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
            self._unanswered.discard(address)
            return decode(older_name[0]), older_name[1]
        self._unanswered.add(address)
        raise unacceptable or NoAnswerError(f"address {address} does not answer on {self.port} "
                                            f"at {self.link.baud_rate} Bd")

    def _frames(self, timeout: float) -> Iterator[tuple[Frame, int]]:
        """Yield the frames that arrive in time, each with the host time in ns at its first byte.

        A reply that has begun may finish, as long as its bytes keep coming.
        """
        link = self.link
        deadline = time.monotonic() + timeout
        stamp = 0
        while data := link.read(deadline - time.monotonic()):
            if not self.parser.pending:
                stamp = time.time_ns() - round(link.seconds(len(data)) * 1e9)
            for frame in self.parser.feed(data):
                yield frame, stamp
            if self.parser.pending:
                deadline = max(deadline, time.monotonic() + BYTE_GAP)
            elif time.monotonic() >= deadline:
                break
        for frame in self.parser.flush():
            yield frame, stamp

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
