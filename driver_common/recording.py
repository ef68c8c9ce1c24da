# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A recording of raw traffic as text: `candump -L` for CAN, lines of hexadecimal bytes for serial.

The format is described in docs/recordings.md. What is no frame is a comment, which can-utils skip.
Times are the host's monotonic ones plus a constant, so that they read like times of day and never
jump; with the lines `offset` the true time of day follows from them, to the nanosecond.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from driver_common.errors import SettingError
from driver_common.flight_recorder import (
    EXTENDED,
    REMOTE,
    Entry,
    Frame,
    Kind,
    frame_of,
    pack_frame,
    pack_offset,
)
from driver_common.text import printable_text

FORMAT = "# industrial_sensor_drivers recording, format 1"
SERIAL, CAN = "serial", "can"
LONGEST_COMMENT = 350  # characters; canplayer takes no longer ones
MAX_FILE = 2 * 1024 ** 3  # bytes that are read
SECOND = 10 ** 9

_COMMENTS = {kind: kind.name.lower() for kind in (Kind.NOTHING, Kind.OPENED, Kind.LOST, Kind.OFFSET,
                                                  Kind.NOTE, Kind.CLOCK, Kind.GAP)}
_KINDS = {word: kind for kind, word in _COMMENTS.items()}
_DIRECTIONS = {"<": Kind.RECEIVED, ">": Kind.SENT, "R": Kind.RECEIVED, "T": Kind.SENT}
_ARROWS = {Kind.RECEIVED: "<", Kind.SENT: ">"}
_LETTERS = {Kind.RECEIVED: "R", Kind.SENT: "T"}

_HEADER_LINE = re.compile(r"# ([a-z]+(?: [^:]+)?): (.*)")
_COMMENT_LINE = re.compile(r"# \((\d+)\.(\d{9})\) ([a-z]+) ?(.*)")
_SERIAL_LINE = re.compile(r"\((\d+)\.(\d{9})\) ([<>]) ([0-9A-F ]+)")
_CAN_LINE = re.compile(r"\((\d+)\.(\d{6})\) \S+ ([0-9A-F]{3}|[0-9A-F]{8})#(R|(?:[0-9A-F]{2})*) "
                       r"([RT])")
_DELAYS, _END = "# delays ", "# end"


@dataclass
class Recording:
    """What was recorded.

    Attributes:
        link: SERIAL or CAN.
        facts: Who recorded what and why, for people: title to text.
        parameters: Parameters of the node that were not the defaults.
        entries: What happened, oldest first.
    """

    link: str
    facts: Mapping[str, str] = field(default_factory=dict)
    parameters: Mapping[str, object] = field(default_factory=dict)
    entries: list[Entry] = field(default_factory=list)


class RecordingText:
    """Makes the lines of a recording, each with its end.

    Args:
        link: SERIAL or CAN.
        channel: Name of the CAN channel.
        offset: The time of day minus the monotonic time in ns, as it is about now.
    """

    def __init__(self, link: str, channel: str, offset: int) -> None:
        """Begin a recording."""
        self._link = link
        self._channel = re.sub("[^A-Za-z0-9_.-]", "_", channel)[:15] or "can"
        self._offset = offset
        self._delays: list[str] = []
        self._length = 0
        self._count = 0

    def head(self, facts: Mapping[str, str], parameters: Mapping[str, object]) -> Iterator[str]:
        """Return the first lines."""
        yield f"{FORMAT}, {self._link}\n"
        yield f"# base: {self._offset}\n"
        for title, text in facts.items():
            yield f"# {title}: {_one_line(text)}\n"
        for name, value in parameters.items():
            line = f"# parameter {name}: {json.dumps(value)}\n"
            if len(line) <= LONGEST_COMMENT:
                yield line

    def body(self, entries: Iterable[Entry]) -> Iterator[str]:
        """Return the lines of some entries."""
        frame_line = self._can_line if self._link == CAN else self._serial_line
        for entry in entries:
            self._count += 1
            if entry.kind <= Kind.RECEIVED:
                yield frame_line(entry)
                if self._length > LONGEST_COMMENT - 25:
                    yield self._delay_line()
            else:
                yield (f"# {_clock(entry.time + self._offset)} {_COMMENTS[entry.kind]} "
                       f"{self._content(entry)}").rstrip() + "\n"

    def end(self) -> Iterator[str]:
        """Return the last lines, without which a recording is not whole."""
        if self._delays:
            yield self._delay_line()
        yield f"{_END} {self._count}\n"

    def _content(self, entry: Entry) -> str:
        return str(entry.offset) if entry.kind is Kind.OFFSET else _one_line(entry.text)

    def _serial_line(self, entry: Entry) -> str:
        return (f"{_clock(entry.time + self._offset)} {_ARROWS[entry.kind]} "
                f"{entry.content.hex(' ').upper()}\n")

    def _can_line(self, entry: Entry) -> str:
        bus_time, identifier, data = frame_of(entry.content)
        now = entry.time + self._offset
        shown = round(bus_time * 1e6) if entry.kind is Kind.RECEIVED else now // 1000
        delay = str(now - shown * 1000)
        if entry.kind is Kind.RECEIVED and shown / 1e6 != bus_time:
            ticks, per_second = bus_time.as_integer_ratio()  # a product of floats would round
            delay += f"/{(2 * ticks * SECOND // per_second + 1) // 2 - shown * 1000}"
        self._delays.append(delay)
        self._length += len(delay) + 1
        digits = f"{identifier & ~EXTENDED & ~REMOTE:0{8 if identifier & EXTENDED else 3}X}"
        content = "R" if identifier & REMOTE else data.hex().upper()
        return (f"({shown // 1000000}.{shown % 1000000:06d}) {self._channel} {digits}#{content} "
                f"{_LETTERS[entry.kind]}\n")

    def _delay_line(self) -> str:
        line = _DELAYS + " ".join(self._delays) + "\n"
        self._delays.clear()
        self._length = 0
        return line


def read_recording(path: Path, *, head: bool = False) -> Recording:
    """Return what is in a file.

    Bounds: a file of more than `MAX_FILE` is refused, each line is looked at once, and all entries
    are held; the reader stops at the first line that is damaged.

    Args:
        path: The file.
        head: Whether to read no entries, which takes time.

    Raises:
        SettingError: It cannot be read, is something else, or is damaged.
    """
    try:
        if path.stat().st_size > MAX_FILE:
            raise SettingError(f"cannot replay {path}: it is too large")
        with path.open(encoding="utf-8", errors="replace") as file:
            return _Reader(path).read(_head_of(file) if head else file)
    except OSError as error:
        raise SettingError(f"cannot replay {path}: {error.strerror}") from error


def _head_of(lines: Iterable[str]) -> Iterator[str]:
    for line in lines:
        if not line.startswith("# ") or line.startswith("# ("):
            break
        yield line
    yield _END


class _Reader:
    """Reads a recording.

    Raises:
        SettingError: From `read`: what is wrong, in which line.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._base = 0
        self._facts: dict[str, str] = {}
        self._parameters: dict[str, object] = {}
        self._entries: list[Entry] = []
        self._undelayed: list[int] = []  # places of the frames whose delay comes later

    def read(self, lines: Iterable[str]) -> Recording:
        numbered = enumerate(lines, 1)
        _, first = next(numbered, (0, ""))
        title, _, link = first.rstrip("\n").rpartition(", ")
        if title != FORMAT or link not in (SERIAL, CAN):
            raise SettingError(f"cannot replay {self._path}: it is no recording of this package "
                               f'(which begins with "{FORMAT}")')
        take_frame = self._take_can if link == CAN else self._take_serial
        for number, line in numbered:
            try:
                if line.startswith(_END):
                    self._check_end(line)
                    return Recording(link, self._facts, self._parameters, self._entries)
                (self._take_comment if line.startswith("#") else take_frame)(line.rstrip("\n"))
            except ValueError as error:
                raise SettingError(f"cannot replay {self._path}: line {number} is damaged"
                                   f"{f' ({error})' if str(error) else ''}") from None
        raise SettingError(f'cannot replay {self._path}: it is cut off, its last line "{_END} …" '
                           "is missing; copy it again, or add that line to replay what is there")

    def _take_comment(self, line: str) -> None:
        if line.startswith(_DELAYS):
            self._take_delays(line.removeprefix(_DELAYS).split())
        elif match := _COMMENT_LINE.fullmatch(line):
            seconds, fraction, word, text = match.groups()
            kind = _KINDS.get(word)
            if kind is None:
                raise ValueError(f'"{word}" is not known')
            content = _offset_content(text) if kind is Kind.OFFSET else text.encode()
            self._add(int(seconds) * SECOND + int(fraction), kind, content)
        elif match := _HEADER_LINE.fullmatch(line):
            title, text = match.groups()
            if title == "base":
                self._base = int(text)
            elif title.startswith("parameter "):
                self._parameters[title.removeprefix("parameter ")] = json.loads(text)
            else:
                self._facts[title] = text
        else:
            raise ValueError

    def _take_serial(self, line: str) -> None:
        match = _SERIAL_LINE.fullmatch(line)
        if match is None:
            raise ValueError
        seconds, fraction, arrow, data = match.groups()
        self._add(int(seconds) * SECOND + int(fraction), _DIRECTIONS[arrow], bytes.fromhex(data))

    def _take_can(self, line: str) -> None:
        match = _CAN_LINE.fullmatch(line)
        if match is None:
            raise ValueError
        seconds, fraction, digits, data, letter = match.groups()
        number = int(digits, 16)
        if number & (EXTENDED | REMOTE):
            raise ValueError(f"{digits} is no identifier of 29 bits")
        identifier = number | (EXTENDED if len(digits) > 3 else 0) | (
            REMOTE if data == "R" else 0)
        shown = int(seconds) * 1000000 + int(fraction)
        received = letter == "R"
        frame = Frame(shown / 1e6 if received else 0.0, identifier,
                      b"" if data == "R" else bytes.fromhex(data))
        self._undelayed.append(len(self._entries))
        self._add(shown * 1000, _DIRECTIONS[letter], pack_frame(frame))

    def _take_delays(self, texts: list[str]) -> None:
        if len(texts) != len(self._undelayed):
            raise ValueError(f"{len(texts)} delays of {len(self._undelayed)} frames")
        for place, text in zip(self._undelayed, texts, strict=True):
            delay, _, rest = text.partition("/")
            entry = self._entries[place]
            if rest:
                frame = frame_of(entry.content)
                bus_time = (round(frame.bus_time * 1e6) * 1000 + int(rest)) / SECOND
                entry = entry._replace(content=pack_frame(frame._replace(bus_time=bus_time)))
            self._entries[place] = entry._replace(time=entry.time + int(delay))
        self._undelayed.clear()

    def _add(self, time: int, kind: Kind, content: bytes) -> None:
        self._entries.append(Entry(time - self._base, kind, content))

    def _check_end(self, line: str) -> None:
        count = line.removeprefix(_END).strip()
        if count and count != "…" and int(count) != len(self._entries):
            raise ValueError(f"{count} entries should be there, there are {len(self._entries)}")


def _offset_content(text: str) -> bytes:
    offset = int(text)
    if abs(offset) >= 1 << 63:
        raise ValueError("no clock is so far away")
    return pack_offset(offset)


def _clock(nanoseconds: int) -> str:
    return f"({nanoseconds // SECOND}.{nanoseconds % SECOND:09d})"


def _one_line(text: str) -> str:
    """Return a text that fits a comment: short, and without what steers a terminal."""
    return printable_text(text.encode()[:LONGEST_COMMENT - 60], "utf-8")
