# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Telegrams of the UC4000 (manual section 4.5): bytes in, values out, and back.

Nothing here does I/O. A reply names neither its sender nor what was asked: who sent the request
has to know what comes back. `ReplyParser` takes what arrives, split anywhere.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum

from driver_common.errors import FrameError
from driver_common.serial_link import BITS_PER_BYTE

BAUD_RATE = 19200  # section 4
CAST = 0  # every sensor feels addressed
FIRST_ADDRESS, LAST_ADDRESS, FACTORY_ADDRESS = 1, 7, 7

REQUEST_LENGTH = 4  # also of a write request (errata U2)
SHORT_REPLY = 2  # one data byte and CHECK; every refusal is that short
BYTE_TIME = BITS_PER_BYTE / BAUD_RATE  # s
GAP = 2 * BYTE_TIME  # s of silence that end a telegram (errata U8)

_SYNC, _READ = 0xA0, 0x08
_ACK, _MANDATORY = 0x80, 0x40
_START = 0x52
_MAX_PENDING = 64  # bytes, more than the longest reply with what may be in front of it
# Bits of the 8-bit sum whose parity is a bit of the 6-bit one, from D5 to D0 (section 4.5.3).
_FOLDS = (0b10101010, 0b01010101, 0b11000000, 0b00110000, 0b00001100, 0b00000011)


class ErrorCode(IntEnum):
    """What a sensor says when it refuses (section 4.6.2)."""

    CHECKSUM_ERROR = 0x01
    TELEGRAM_TIMEOUT = 0x02
    TELEGRAM_UNDERFLOW = 0x03
    TELEGRAM_OVERFLOW = 0x04
    PARAMETER_ERROR = 0x05
    SESSION_ERROR = 0x06
    TRANSMISSION_ERROR = 0x07
    EEPROM_ERROR = 0x08
    OP_CODE_ERROR = 0x09
    OBJECT_IS_READ_ONLY = 0x0A
    TEMPERATURE_ERROR = 0x0B  # 0x0C and 0x0D are in the table as well, but without a text
    NO_ERROR = 0xFF


def error_text(code: int) -> str:
    """Return an error code in words, with its number."""
    try:
        words = ErrorCode(code).name.replace("_", " ").lower()
    except ValueError:
        words = "error that the manual does not explain"
    return f"{words} (0x{code:02X})"


def check_byte(body: bytes, *, acknowledged: bool = False) -> int:
    """Return CHECK of a telegram (errata U1): the ACK bit takes part in the sum."""
    flag = _ACK if acknowledged else 0
    total = functools.reduce(operator.xor, body, _START ^ flag)
    folded = 0
    for bits in _FOLDS:
        folded = folded << 1 | (total & bits).bit_count() & 1
    return flag | _MANDATORY | folded


@dataclass(frozen=True)
class Request:
    """A request of the master (section 4.5.1).

    Attributes:
        address: Of the sensor, 1 to 7; 0 is the cast.
        op_code: What to do.
        data: The data byte.
        is_write: Whether it writes.
    """

    address: int
    op_code: int
    data: int = 0xFF
    is_write: bool = False

    def encode(self) -> bytes:
        """Return the bytes on the wire."""
        sync = _SYNC | (0 if self.is_write else _READ) | self.address
        body = bytes((sync, self.op_code, self.data))
        return body + bytes((check_byte(body),))

    @classmethod
    def decode(cls, telegram: bytes) -> Request:
        """Return the request that the bytes mean; raises FrameError."""
        if (len(telegram) != REQUEST_LENGTH or telegram[0] & 0xF0 != _SYNC
                or telegram[3] != check_byte(telegram[:3])):
            raise FrameError(f"damaged request {telegram.hex(' ').upper()}")
        return cls(telegram[0] & 0x07, telegram[1], telegram[2], not telegram[0] & _READ)


@dataclass(frozen=True)
class Reply:
    """A reply of a sensor.

    Attributes:
        data: Its data bytes; a single one, the error code, where it refuses.
        acknowledged: Whether the sensor did what was asked.
    """

    data: bytes
    acknowledged: bool = True

    def encode(self) -> bytes:
        """Return the bytes on the wire."""
        return self.data + bytes((check_byte(self.data, acknowledged=self.acknowledged),))

    @classmethod
    def decode(cls, telegram: bytes) -> Reply:
        """Return the reply that the bytes mean; raises FrameError."""
        reply = cls(bytes(telegram[:-1]), telegram[-1:] >= bytes((_ACK,)))
        if len(telegram) < SHORT_REPLY or reply.encode() != telegram:
            raise FrameError(f"damaged reply {telegram.hex(' ').upper()}")
        return reply


class ReplyParser:
    """Finds the replies to requests that were just sent, behind the line's echo of them.

    The checksum of six bits lets one damaged reply of two bytes in 128 pass. So a short reply has
    to begin right behind a gap; nothing is searched for in noise. A long one may have bytes in
    front of it that are older.

    Bounds: at most 64 bytes wait, what comes beyond them is dropped, and a feed looks at each
    possible beginning of a reply once, so it costs the same however much came before.

    Attributes:
        replies: The replies found so far.
        times: When each was complete, as `feed` was told.
        echo: Whether the line returns the master's own bytes; None while that cannot be told.
        damaged: The last bytes that were no reply.
        skipped: Number of bytes in front of a long reply.
    """

    def __init__(self, length: int = SHORT_REPLY) -> None:
        """Expect replies of `length` bytes, or shorter refusals, to what `sent` tells."""
        self._length = length
        self._count = 0
        self._buffer = bytearray()
        self._own = b""  # own bytes that may still come back
        self._now = 0.0
        self.replies: list[Reply] = []
        self.times: list[float] = []
        self.echo: bool | None = None
        self.damaged = b""
        self.skipped = 0

    @property
    def complete(self) -> bool:
        """Whether there is a reply to every request."""
        return len(self.replies) == self._count

    @property
    def pending(self) -> bytes:
        """Bytes that are no reply yet."""
        return bytes(self._buffer)

    def sent(self, request: bytes) -> None:
        """Expect one more reply, and perhaps the echo of its request."""
        self._count += 1
        if self.echo is not False:
            self._own += request

    def feed(self, data: bytes, now: float = 0.0) -> None:
        """Take bytes that arrived now."""
        self._now = now
        self._buffer += data[:_MAX_PENDING - len(self._buffer)]  # noise has no end
        if self._own:
            if self._own.startswith(bytes(self._buffer[:len(self._own)])):
                if len(self._buffer) < len(self._own):
                    return
                del self._buffer[:len(self._own)]
                self.echo = True
            self._own = b""
        self._take_replies()

    def gap(self) -> None:
        """Take note of a silence: what is not complete now never will be."""
        self._own = b""
        self._take_replies()
        if not self.complete and SHORT_REPLY == len(self._buffer) < self._length:
            # The beginning of a text can look like a refusal ("HW" does); no code is a letter.
            reply = decoded(self._buffer)
            if reply and not reply.acknowledged and not 0x20 <= reply.data[0] < 0x7F:
                self._take(reply, 0, SHORT_REPLY)
        if self._buffer:
            self.damaged = bytes(self._buffer)
            self._buffer.clear()

    def _take_replies(self) -> None:
        """Move complete replies out of the buffer."""
        while not self.complete and len(self._buffer) >= self._length:
            starts: Iterable[int] = (0,)
            if self._length > SHORT_REPLY:
                starts = range(len(self._buffer) - self._length + 1)
            for start in starts:
                reply = decoded(self._buffer[start:start + self._length])
                if reply and (self._length == SHORT_REPLY or reply.acknowledged):
                    self._take(reply, start, self._length)
                    break
            else:
                return

    def _take(self, reply: Reply, start: int, length: int) -> None:
        if self.echo is None and not start and not self.damaged:
            self.echo = False
        self.replies.append(reply)
        self.times.append(self._now)
        self.skipped += start
        del self._buffer[:start + length]


def decoded(telegram: bytes | bytearray) -> Reply | None:
    """Return the reply that the bytes mean, None where they mean none."""
    try:
        return Reply.decode(bytes(telegram))
    except FrameError:
        return None
