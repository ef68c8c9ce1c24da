# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The last minute of raw traffic in memory: what passed over a link, both ways, and when.

It is written by the thread of the bus and read by any thread. Each entry is packed into bytes when
it comes, because 60 s of the fastest stream are 200,000 frames; it becomes text only where a
recording is written (`driver_common.recording`).
"""

from __future__ import annotations

import struct
import time
from collections import deque
from collections.abc import Iterable, Iterator
from enum import IntEnum
from typing import NamedTuple

from driver_common import clocks

DURATION = 60.0  # s of traffic that are kept
MEMORY = 14 * 1024 * 1024  # bytes that they may take
SEARCH_MEMORY = 1024 * 1024  # bytes for how the devices were found, however long ago that is
SEARCH_TIME = 10.0  # s before a device was found that are kept …
START_TIME = 2.0  # … and s after it, in which it is started
READING = 1000  # ns by which two readings of the clocks may differ
CHUNK_TIME = 1.0  # s of traffic that are forgotten together, at most
CHUNK_SIZE = 64 * 1024  # bytes, the same

_HEAD = struct.Struct("<qBH")  # monotonic time in ns, kind, length of the content
_FRAME = struct.Struct("<qBHdI")  # the same, and the beginning of the content of a frame
_FRAME_HEAD = struct.Struct("<dI")  # time in s of the interface's clock, identifier and flags
_OFFSET = struct.Struct("<q")
_MAX_CONTENT = 0xFFFF

EXTENDED, REMOTE, ERROR = 0x80000000, 0x40000000, 0x20000000  # flags beside an identifier


class Kind(IntEnum):
    """What an entry tells."""

    SENT = 0  # bytes, or a frame
    RECEIVED = 1
    NOTHING = 2  # somebody waited, or looked, in vain
    OPENED = 3  # the link
    LOST = 4  # the link; a text says why
    OFFSET = 5  # the time of day minus the monotonic time in ns
    NOTE = 6  # a text for people
    CLOCK = 7  # somebody read the monotonic clock
    GAP = 8  # what follows came later; what was between is forgotten


class Frame(NamedTuple):
    """A CAN frame.

    Attributes:
        bus_time: When it was on the bus, in s of the interface's clock; 0 where that is not known.
        identifier: Its identifier, with the flags EXTENDED, REMOTE and ERROR.
        data: Its data.
    """

    bus_time: float
    identifier: int
    data: bytes


class Entry(NamedTuple):
    """Something that happened.

    Attributes:
        time: Monotonic time in ns.
        kind: What happened.
        content: Bytes, a frame as `frame_of` takes it apart, a text, or an offset.
    """

    time: int
    kind: Kind
    content: bytes = b""

    @property
    def text(self) -> str:
        """The content of LOST and NOTE."""
        return self.content.decode(errors="replace")

    @property
    def offset(self) -> int:
        """The content of OFFSET in ns."""
        return int(_OFFSET.unpack(self.content)[0])


def pack_frame(frame: Frame) -> bytes:
    """Return a frame as the content of an entry."""
    return _FRAME_HEAD.pack(frame.bus_time, frame.identifier) + frame.data


def frame_of(content: bytes) -> Frame:
    """Return the frame in the content of an entry."""
    bus_time, identifier = _FRAME_HEAD.unpack_from(content)
    return Frame(bus_time, identifier, content[_FRAME_HEAD.size:])


def pack_offset(offset: int) -> bytes:
    """Return an offset in ns as the content of an entry."""
    return _OFFSET.pack(offset)


class _Chunk(NamedTuple):
    begin: int  # monotonic ns
    data: bytes | bytearray


class FlightRecorder:
    """Keeps the last traffic of a link, and how its devices were found.

    Attributes:
        offset: The time of day minus the monotonic time in ns, as it was taken last.
    """

    def __init__(self) -> None:
        """Begin with nothing."""
        self._chunks: deque[_Chunk] = deque()
        self._search: deque[_Chunk] = deque()
        self._size = self._search_size = 0
        self._search_end = 0
        self._has_offset = False
        self.offset = clocks.host_offset()
        self._begin(time.monotonic_ns())

    def add(self, now: int, kind: Kind, content: bytes = b"") -> None:
        """Take what happened at a monotonic time in ns."""
        content = content[:_MAX_CONTENT]
        self._data += _HEAD.pack(now, kind, len(content)) + content
        if now > self._end or len(self._data) > CHUNK_SIZE:
            self._begin(now)

    def add_frame(self, now: int, kind: Kind, bus_time: float, identifier: int,
                  data: bytes | bytearray) -> None:
        """Take a CAN frame, as `add`: the hot path."""
        self._data += _FRAME.pack(now, kind, 12 + len(data), bus_time, identifier) + data
        if now > self._end or len(self._data) > CHUNK_SIZE:
            self._begin(now)

    def add_offset(self, offset: int) -> None:
        """Take the time of day minus the monotonic time in ns, where it is another one."""
        if offset != self.offset or not self._has_offset:
            self.offset, self._has_offset = offset, True
            self.add(time.monotonic_ns(), Kind.OFFSET, pack_offset(offset))

    def follow_offset(self) -> None:
        """Read the clocks, and take their offset where it changed by more than reading them can."""
        offset = clocks.host_offset()
        if abs(offset - self.offset) > READING or not self._has_offset:
            self.add_offset(offset)

    def read_offset(self) -> int:
        """Return the time of day minus the monotonic time in ns; a replay returns the same."""
        offset = clocks.host_offset()
        self.add_offset(offset)
        return offset

    def now(self) -> int:
        """Return the monotonic time in ns; a replay returns the same."""
        now = time.monotonic_ns()
        self.add(now, Kind.CLOCK)
        return now

    def note(self, text: str) -> None:
        """Take a text for people."""
        self.add(time.monotonic_ns(), Kind.NOTE, text.encode())

    def keep_search(self) -> None:
        """Keep how a device was found just now, beyond the last minute: a replay begins there."""
        now = time.monotonic_ns()
        self._search_end = now + int(START_TIME * 1e9)
        known = {chunk.begin for chunk in self._search}
        for chunk in list(self._chunks)[:-1]:
            if chunk.begin > now - SEARCH_TIME * 1e9 and chunk.begin not in known:
                self._keep(chunk)

    def snapshot(self, since: int = 0, *, growing: bool = True) -> tuple[list[bytes], int]:
        """Return what is kept, packed; from any thread.

        Args:
            since: What the last call gave, for what came after that; 0 = all.
            growing: Whether to include the last second, which is still growing.

        Returns:
            Parts for `unpack`, between which something is missing, and what to give next time.
        """
        search, kept = list(self._search), list(self._chunks)
        first = kept[0].begin
        earlier = [chunk for chunk in search if chunk.begin < first and not since]
        last = [chunk for chunk in kept[:None if growing else -1] if chunk.begin > since]
        parts = [_joined(last)]
        if earlier or 0 < since < first:
            parts.insert(0, _joined(earlier))
        return parts, last[-1].begin if last else since

    def _begin(self, now: int) -> None:
        """Begin the next chunk, and forget what is too old or too much."""
        if self._chunks:
            self._finish(now)
        self._end = now + int(CHUNK_TIME * 1e9)
        self._data = bytearray()
        begin = max(now, self._chunks[-1].begin + 1) if self._chunks else now  # each its own
        self._chunks.append(_Chunk(begin, self._data))

    def _finish(self, now: int) -> None:
        chunk = self._chunks[-1]._replace(data=bytes(self._data))
        self._chunks[-1] = chunk
        self._size += len(chunk.data)
        if chunk.begin < self._search_end:
            self._keep(chunk)
        oldest = now - int((DURATION + CHUNK_TIME) * 1e9)
        while len(self._chunks) > 1 and (self._size > MEMORY or self._chunks[0].begin < oldest):
            self._size -= len(self._chunks.popleft().data)

    def _keep(self, chunk: _Chunk) -> None:
        self._search.append(chunk)
        self._search_size += len(chunk.data)
        while self._search_size > SEARCH_MEMORY:
            self._search_size -= len(self._search.popleft().data)


def _joined(chunks: Iterable[_Chunk]) -> bytes:
    """Return the data of chunks: copies, because one that is looked at could not grow."""
    return b"".join(bytes(chunk.data) for chunk in chunks)


def unpack(parts: Iterable[bytes]) -> Iterator[Entry]:
    """Return the entries of a snapshot; where something is missing there is a GAP."""
    for number, part in enumerate(parts):
        if number:
            yield Entry(_HEAD.unpack_from(part)[0], Kind.GAP)
        position = 0
        while position < len(part):
            time_ns, kind, length = _HEAD.unpack_from(part, position)
            position += _HEAD.size + length
            yield Entry(time_ns, Kind(kind), part[position - length:position])
