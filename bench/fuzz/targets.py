# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What is fuzzed: a row per target, and what must be true of each input.

A check raises whatever is wrong. The project's own errors are answers, as the codecs promise them.
"""

from __future__ import annotations

import contextlib
import math
import struct
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from random import Random
from typing import Any

from driver_common.errors import FrameError, SettingError
from icotronic_driver import commands as icotronic
from icotronic_driver.eeprom import STH_EEPROM, STU_EEPROM, decode_page
from icotronic_driver.identifier import Frame as CanFrame
from icotronic_driver.identifier import Identifier
from icotronic_driver.streaming import StreamDecoder, StreamFormat, decode_single
from isys_radar_driver import commands as isys
from isys_radar_driver.frames import READ_TARGET_LIST, Delimiter, Frame, FrameParser
from isys_radar_driver.targets import Resolution, decode_target_list, encode_target_list
from uc4000_driver import commands as uc4000
from uc4000_driver.telegram import REQUEST_LENGTH, SHORT_REPLY, Reply, ReplyParser, Request


@dataclass(frozen=True)
class Target:
    """Something that takes what others say.

    Attributes:
        name: What it is.
        check: Feeds it an input, and raises where a promise is broken; what it chooses at random
            it takes from the second argument.
        examples: Inputs to begin with in hexadecimal; some of them are good, some nearly so.
    """

    name: str
    check: Callable[[bytes, Random], None]
    examples: tuple[str, ...]

    @property
    def seeds(self) -> Sequence[bytes]:
        """The examples as bytes."""
        return [bytes.fromhex(example) for example in self.examples]


def _pieces(data: bytes, random: Random) -> Iterable[bytes]:
    start = 0
    while start < len(data):
        end = start + random.randint(1, 12)
        yield data[start:end]
        start = end


# --- iSYS ---

def _check_isys_frames(data: bytes, random: Random) -> None:
    fixed_targets = random.choice((None, 0, 3))
    whole, parts = FrameParser(fixed_targets), FrameParser(fixed_targets)
    frames = list(whole.feed(data))
    assert frames == [frame for piece in _pieces(data, random) for frame in parts.feed(piece)]
    assert whole.pending == parts.pending
    frames += whole.flush()
    assert not whole.pending
    assert sum(len(frame.encode()) for frame in frames) + whole.dropped_bytes == len(data)
    for frame in frames:
        assert frame.encode() in data
        _check_target_list(frame)


def _check_target_list(frame: Frame) -> None:
    if frame.function_code != READ_TARGET_LIST:
        return
    with contextlib.suppress(FrameError):
        targets = decode_target_list(frame)
        wide = frame.delimiter is Delimiter.SD3
        again = encode_target_list(targets, Resolution.BITS_32 if wide else Resolution.BITS_16)
        assert frame.pdu.startswith(again)
        assert all(math.isfinite(value) for target in targets.targets for value in target)


@cache
def _isys_commands() -> list[isys.Command[Any]]:
    return [one for one in vars(isys).values() if isinstance(one, isys.Command)]


def _check_isys_replies(data: bytes, random: Random) -> None:
    for command in _isys_commands():
        with contextlib.suppress(FrameError):
            _check_text(command.decode(data))


def _check_text(value: object) -> None:
    if isinstance(value, str):
        assert value.isprintable(), value


# --- ICOtronic ---

def _check_identifiers(data: bytes, random: Random) -> None:
    with contextlib.suppress(FrameError):
        number = int.from_bytes(data[:4], "big")
        identifier = Identifier.decode(number)
        assert identifier.encode() == number
        assert str(identifier)
    with contextlib.suppress(FrameError):
        frames = CanFrame.decode_abstracted(data)
        assert b"".join(frame.encode_abstracted() for frame in frames) == data


def _check_stream(data: bytes, random: Random) -> None:
    form = StreamFormat.decode(data[0] if data else 0x81)
    if not 0 < form.values_per_frame * form.value_size <= 62:  # no frame can carry it
        return
    at_once, one_by_one = StreamDecoder(form, 3000.0), StreamDecoder(form, 3000.0)
    size, time = form.frame_length, 0.0
    frames = []
    for start in range(0, len(data), size):
        time += random.choice((0.0, 0.0003, 0.0003, 0.1, 1.0))
        frames.append((time, data[start:start + size]))
    half = len(frames) // 2
    for some in (frames[:half], frames[half:]):
        batch = at_once.decode(some)
        singles = [values for arrival, frame in some
                   if (values := one_by_one.decode_frame(arrival, frame)) is not None]
        assert [tuple(row.ravel().tolist()) for row in batch.values] == singles
        assert all(0 <= value <= form.full_scale for values in singles for value in values)
        assert (batch.numbers[1:] > batch.numbers[:-1]).all()
    assert at_once.statistics == one_by_one.statistics
    assert min(at_once.statistics.lost, at_once.statistics.duplicates) >= 0
    with contextlib.suppress(FrameError):
        decode_single(form, data[:8])


def _check_icotronic_answers(data: bytes, random: Random) -> None:
    for command in icotronic.COMMANDS.values():
        with contextlib.suppress(FrameError):
            _check_text(command.decode(data[:8]))


def _check_eeprom(data: bytes, random: Random) -> None:
    image = data.ljust(256, b"\xff")[:256]
    page = random.choice((0, 4, 5, 8))
    for fields in (STH_EEPROM, STU_EEPROM):
        for name, value in decode_page(fields, page, image).items():
            _check_text(value)
            with contextlib.suppress(SettingError):
                fields[name].encode(value)


# --- UC4000 ---

def _check_uc4000_replies(data: bytes, random: Random) -> None:
    length = random.choice((SHORT_REPLY, 15, 19))
    request = Request(random.randrange(8), random.randrange(256)).encode()
    whole, parts = ReplyParser(length), ReplyParser(length)
    for parser, pieces in ((whole, [data[:60]]), (parts, _pieces(data[:60], random))):
        parser.sent(request)
        for piece in pieces:
            parser.feed(piece)
            assert len(parser.pending) <= 64
        parser.gap()
        assert not parser.pending
    assert whole.replies == parts.replies
    assert (whole.damaged, whole.echo) == (parts.damaged, parts.echo)
    assert len(whole.replies) <= 1
    assert all(reply.encode() in data for reply in whole.replies)
    whole.feed(data * 3)
    assert len(whole.pending) <= 64


def _check_uc4000_telegrams(data: bytes, random: Random) -> None:
    with contextlib.suppress(FrameError):
        assert Reply.decode(data).encode() == data
    with contextlib.suppress(FrameError):
        assert Request.decode(data[:REQUEST_LENGTH]).encode() == data[:REQUEST_LENGTH]
    profile = random.choice(tuple(uc4000.PROFILES.values()))
    for command in (uc4000.READ_TEMPERATURE, uc4000.READ_ADDRESS, uc4000.READ_VERSION,
                    uc4000.READ_SERIAL_NUMBER, uc4000.measure(profile)):
        if len(data) >= command.data_length:
            with contextlib.suppress(FrameError):
                _check_text(command.decode(data[:command.data_length]))


# --- Parameters ---

@cache
def _parameters() -> list[Any]:
    from sensor_tools.document import DRIVERS  # it brings ROS, which no other target needs

    return [row for driver in DRIVERS
            for row in (*driver.options, *(variant for name in driver.node.ALL_SETTINGS
                                           for variant in driver.variants(name).values()))]


def _values(data: bytes) -> list[object]:
    number = int.from_bytes(data[:9], "little", signed=True)
    real = struct.unpack("<d", data[:8].ljust(8, b"\0"))[0]
    text = data.decode("utf-8", "surrogateescape")
    return [number, number % 1000, real, float(number % 512) / 8, text, bool(number % 2), [real],
            [real, 0.5], [text, "front"], []]


def _check_parameters(data: bytes, random: Random) -> None:
    parameter = random.choice(_parameters())
    for value in _values(data):
        with contextlib.suppress(SettingError):
            checked = parameter.check(value)
            assert parameter.check(checked) == checked, (parameter.name, value)
            assert isinstance(parameter.text(checked), str)


TARGETS = (
    Target("isys frames", _check_isys_frames, (
        # figures 1, 7, 14, 15, 19, 23, 27, 6 and 8 of the manual
        "68 03 03 68 80 01 D0 51 16", "68 05 05 68 64 01 DA 01 20 60 16",
        "68 05 05 68 80 01 D1 00 00 52 16", "68 03 03 68 01 80 D1 52 16",
        "68 09 09 68 01 64 D1 15 7C 17 70 00 00 4E 16", "68 07 07 68 01 64 D1 13 06 07 49 9F 16",
        "68 05 05 68 01 80 D2 00 80 D3 16",
        "A2 01 80 DA 01 01 0E D3 00 00 00 00 00 2B CB 75 00 00 03 E8 94 16",
        "A2 01 64 DA 01 01 22 02 00 00 00 00 00 2A FC BB 00 00 03 E8 31 16")),
    Target("isys replies", _check_isys_replies, (
        "695359532D3430303100", "0000", "0001", "01020304", "0104000210", "01F4", "02 02 04 10")),
    Target("icotronic identifiers", _check_identifiers, (
        "0002E3C1", "00000102", "0040008F", "C1 05 03 00 01 02 03")),
    Target("icotronic stream", _check_stream, (
        "A3 00 01 80 02 80 03 80", "A3 01 01 80 02 80 03 80 A3 02 01 80 02 80 03 80",
        "B9 00 01 80 02 80 03 80 B9 02 01 80 02 80 03 80", "E2 10 01 02 03 04 05 06 07 08 09")),
    Target("icotronic answers", _check_icotronic_answers, (
        "0001 000000000000", "4F00 010002030405", "0102 06 40 3F800000",
        "0B 01 30 32 00 00 00 00")),
    Target("icotronic eeprom", _check_eeprom, ("AC 41 42 43 00", "FF" * 64, "00" * 64)),
    Target("uc4000 replies", _check_uc4000_replies, (
        "A9 16 FF 40", "55 C1", "09 41", "A9 16 FF 40 55 C1",
        "34 31 30 30 30 30 30 30 31 32 33 34 35 36 C5")),
    Target("uc4000 telegrams", _check_uc4000_telegrams, (
        "A9 16 FF 40", "A1 16 07 40", "FF FF", "FE C0", "00", "55 C1",
        "48 57 30 31 2E 30 30 00 53 57 30 31 2E 30 30 00 00 00")),
    Target("parameters", _check_parameters, (
        "000000000000F03F", "000000000000F07F", "2F6465762F74747953", "66726F6E74",
        "31302E302E302E31")),
)
