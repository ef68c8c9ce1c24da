# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Frames of the iSYS serial protocol (sections 3.2.6 to 3.2.9): bytes in, frames out, and back.

Nothing here does I/O. `FrameParser` takes any bytes, split anywhere, and gives the good frames.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

BROADCAST = 0
MASTER = 1
FIRST_ADDRESS, LAST_ADDRESS = 2, 255

END = 0x16
MAX_PDU_LENGTH = 252  # LE is one byte and counts DA, SA and FC as well
MAX_TARGETS = 35  # section 3.3.7
CLIPPING = 0xFF  # in place of the number of targets: there are none
MAX_GAP = 0.010  # s between two bytes of a frame, section 3.2.8

READ_TARGET_LIST = 0xDA
READ_RAW_SIGNALS = 0xE0
FAILURE = 0xFD

TARGET_SIZE_32 = 14  # errata I3: signal u16, velocity, range and angle s32
_RAW_HEADER_SIZE = 7
_MAX_RAW_SIGNALS = 8  # bounds the buffer; the manual's example has 4


class Delimiter(IntEnum):
    """Start delimiters."""

    SD1 = 0x10  # no data
    SD2 = 0x68  # length in the frame
    SD3 = 0xA2  # length from the content


@dataclass(frozen=True)
class Frame:
    """One frame.

    Attributes:
        destination: DA, 0 is the broadcast.
        source: SA, 1 is the master.
        function_code: FC.
        pdu: Data bytes, without sub-function for replies.
        delimiter: Which of the three forms.
    """

    destination: int
    source: int
    function_code: int
    pdu: bytes = b""
    delimiter: Delimiter = Delimiter.SD2

    def __str__(self) -> str:
        """Return the form and the bytes from DA to the PDU in hexadecimal."""
        body = bytes((self.destination, self.source, self.function_code)) + self.pdu
        return f"{self.delimiter.name} {body.hex(' ').upper()}"

    def encode(self) -> bytes:
        """Return the bytes on the wire.

        Raises:
            ValueError: The PDU does not fit this form.
        """
        body = bytes((self.destination, self.source, self.function_code)) + self.pdu
        tail = bytes((checksum(body), END))
        if self.delimiter is Delimiter.SD2:
            if len(self.pdu) > MAX_PDU_LENGTH:
                raise ValueError(f"a PDU of {len(self.pdu)} bytes does not fit a frame with "
                                 f"variable length, at most {MAX_PDU_LENGTH} do")
            head = bytes((Delimiter.SD2, len(body), len(body), Delimiter.SD2))
            return head + body + tail
        if self.delimiter is Delimiter.SD1 and self.pdu:
            raise ValueError("a frame without data cannot carry a PDU")
        return bytes((self.delimiter,)) + body + tail


def checksum(body: bytes | bytearray) -> int:
    """Return FCS: the sum from DA to the last PDU byte, modulo 256 (errata I4)."""
    return sum(body) & 0xFF


class _NeedMoreError(Exception):
    """The buffer holds the beginning of what may become a frame."""


class FrameParser:
    """Finds frames in a stream of bytes.

    Where a frame is damaged, one byte is dropped and the search goes on at the next one, so that
    noise never costs a good frame behind it.

    Bounds: a byte costs at most one look at each possible length of a list, whatever comes, as
    checksums follow from running sums. Between two feeds less than the longest frame is held
    (131 kB with `raw_signals`, else 0.5 kB), once more as sums, and one damaged frame.

    Attributes:
        fixed_targets: Number of targets of a fixed-length target list; None: the length follows
            from the list's own count; 0: not known yet, learned from the next list (errata I8).
        raw_signals: Whether raw signals may come, whose frames are by far the longest.
        dropped_bytes: Bytes that belonged to no frame.
        damaged_frames: Frames whose checksum or end delimiter was wrong.
        damaged_frame: The longest one of them, as it came, since this was set to None.
    """

    def __init__(self, fixed_targets: int | None = None) -> None:
        """Start with an empty buffer."""
        self.fixed_targets = fixed_targets
        self.raw_signals = True
        self.dropped_bytes = 0
        self.damaged_frames = 0
        self.damaged_frame: Frame | None = None
        self._buffer = bytearray()
        self._sums = bytearray(1)  # of all bytes before each of the buffer and its end, modulo 256

    @property
    def pending(self) -> int:
        """Number of bytes that wait for the rest of their frame."""
        return len(self._buffer)

    def feed(self, data: bytes) -> Iterator[Frame]:
        """Take bytes and yield each frame that they complete."""
        self._buffer += data
        self._sums[-1:] = np.cumsum(np.frombuffer(self._sums[-1:] + data, np.uint8),
                                    dtype=np.uint8).tobytes()
        while self._buffer:
            try:
                frame, length = self._first_frame()
            except _NeedMoreError:
                return
            if frame is None:
                self._drop()
            else:
                del self._buffer[:length], self._sums[:length]
                yield frame

    def flush(self) -> Iterator[Frame]:
        """Give up what is incomplete and yield the good frames behind its first byte.

        To be called when a reply's time is over, or after a gap of more than `MAX_GAP`.
        """
        while self._buffer:
            self._drop()
            yield from self.feed(b"")

    def _drop(self) -> None:
        del self._buffer[0], self._sums[0]
        self.dropped_bytes += 1

    def _first_frame(self) -> tuple[Frame | None, int]:
        """Return the frame at the head of the buffer and its length, or None for a bad byte."""
        start = self._buffer[0]
        if start == Delimiter.SD1:
            return self._checked(Delimiter.SD1, 1, 4)
        if start == Delimiter.SD2:
            return self._variable_length()
        if start == Delimiter.SD3:
            return self._length_by_content()
        return None, 0

    def _variable_length(self) -> tuple[Frame | None, int]:
        head = self._buffer[:4]
        if len(head) > 1 and head[1] < 3:
            return None, 0
        if len(head) > 2 and head[2] != head[1]:
            return None, 0
        if len(head) < 4:
            raise _NeedMoreError
        if head[3] != Delimiter.SD2:
            return None, 0
        return self._checked(Delimiter.SD2, 4, 4 + head[1])

    def _length_by_content(self) -> tuple[Frame | None, int]:
        """Find the end of a frame with SD3, which carries no length (errata I8)."""
        function_code = self._byte(3)
        if function_code == READ_RAW_SIGNALS and self.raw_signals:
            signals, blocks, size = self._byte(4), self._byte(5), self._byte(6)
            if not 1 <= signals <= _MAX_RAW_SIGNALS or blocks == 0 or size not in (2, 4):
                return None, 0
            return self._checked(Delimiter.SD3, 1,
                                 4 + _RAW_HEADER_SIZE + signals * blocks * 16 * size)
        if function_code != READ_TARGET_LIST:
            return None, 0
        count = self._byte(5)
        if count == CLIPPING:  # a fixed-length list is read as well in the short form
            count = 0
            self._byte(7)
            if self._fits(1, 6):
                return self._target_list(0)
        if count > MAX_TARGETS:
            return None, 0
        if self.fixed_targets is None:
            return self._target_list(count)
        if self.fixed_targets > 0:
            return self._target_list(self.fixed_targets)
        return self._unknown_fixed_length(count)

    def _target_list(self, targets: int) -> tuple[Frame | None, int]:
        return self._checked(Delimiter.SD3, 1, 6 + TARGET_SIZE_32 * targets)

    def _unknown_fixed_length(self, count: int) -> tuple[Frame | None, int]:
        """Learn the number of targets as the first one for which checksum and end fit."""
        for targets in range(max(count, 1), MAX_TARGETS + 1):
            end = 6 + TARGET_SIZE_32 * targets
            if len(self._buffer) < end + 2:
                raise _NeedMoreError
            if self._fits(1, end):
                self.fixed_targets = targets
                return self._target_list(targets)
        self.damaged_frames += 1
        return None, 0

    def _byte(self, index: int) -> int:
        if len(self._buffer) <= index:
            raise _NeedMoreError
        return self._buffer[index]

    def _fits(self, start: int, end: int) -> bool:
        body_sum = (self._sums[end] - self._sums[start]) & 0xFF
        return self._buffer[end] == body_sum and self._buffer[end + 1] == END

    def _checked(self, delimiter: Delimiter, start: int, end: int) -> tuple[Frame | None, int]:
        """Return the frame whose body is `start` to `end`, if checksum and end delimiter fit."""
        if len(self._buffer) < end + 2:
            raise _NeedMoreError
        if self._fits(start, end):
            return self._frame(delimiter, start, end), end + 2
        self.damaged_frames += 1
        longest = self.damaged_frame
        if longest is None or end - start - 3 > len(longest.pdu):
            self.damaged_frame = self._frame(delimiter, start, end)
        return None, 0

    def _frame(self, delimiter: Delimiter, start: int, end: int) -> Frame:
        destination, source, function_code = self._buffer[start:start + 3]
        return Frame(destination, source, function_code, bytes(self._buffer[start + 3:end]),
                     delimiter)
