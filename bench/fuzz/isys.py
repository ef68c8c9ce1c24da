# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What is fuzzed of the radars: frames, target lists, replies and settings."""

from __future__ import annotations

import contextlib
import math
from random import Random

from bench.examples.isys import EXAMPLES, HAND_TYPED
from bench.fuzz.settings import check_raws
from bench.fuzz.target import Target, check_text, from_hex, pieces
from driver_common.errors import FrameError
from driver_common.settings import Setting
from isys_radar_driver import commands
from isys_radar_driver.commands import Command, IsysRecord, Location
from isys_radar_driver.frames import (
    CLIPPING,
    LAST_ADDRESS,
    MASTER,
    READ_TARGET_LIST,
    Delimiter,
    Frame,
    FrameParser,
)
from isys_radar_driver.models import MODELS
from isys_radar_driver.settings import record_of, settings_of
from isys_radar_driver.targets import (
    TARGET_SIZES,
    Resolution,
    TargetList,
    decode_target_list,
    encode_target_list,
)

COMMANDS = [one for one in vars(commands).values() if isinstance(one, Command)]
RECORDS: dict[tuple[str, IsysRecord], list[Setting]] = {}  # settings by model and record
for _model in MODELS.values():
    for _setting in settings_of(_model).values():
        RECORDS.setdefault((_model.name, record_of(_setting)), []).append(_setting)
KEYS, LOCATIONS = tuple(RECORDS), tuple(Location)
FRAMES = from_hex(example.frame for example in EXAMPLES + HAND_TYPED)
RAW_SIGNALS = from_hex((  # section 3.3.10: one signal, one block of 16 samples of 2 bytes
    "A2 01 80 E0 01 01 02 00 00 00 0A" + " 00" * 32 + " 6F 16",))


def _pdus(function_codes: range) -> list[bytes]:
    """Return the data of the manual's replies, each without what is around it."""
    pdus = [frame[7:-2] for frame in FRAMES if frame[0] == 0x68 and frame[6] in function_codes]
    return [*dict.fromkeys(pdus)]


def _framed(data: bytes, random: Random) -> bytes:
    """Return an input as the body of a frame whose checksum is good, with the rest around it."""
    start = random.randrange(len(data))
    body = data[start:start + random.randint(3, 252)]
    head = random.choice((b"\x10", b"\xa2", bytes((0x68, len(body), len(body), 0x68))))
    return data[:start] + head + body + bytes((sum(body) % 256, 0x16)) + data[start + len(body):]


def _check_frames(data: bytes, random: Random) -> None:
    if data and random.random() < 0.3:
        data = _framed(data, random)
    fixed_targets = random.choice((None, 0, 3))
    whole, parts = FrameParser(fixed_targets), FrameParser(fixed_targets)
    whole.raw_signals = parts.raw_signals = random.random() < 0.5
    frames = list(whole.feed(data))
    assert frames == [frame for piece in pieces(data, random) for frame in parts.feed(piece)]
    assert whole.pending == parts.pending
    frames += whole.flush()
    assert not whole.pending
    assert sum(len(frame.encode()) for frame in frames) + whole.dropped_bytes == len(data)
    for frame in frames:
        assert frame.encode() in data
        assert str(frame)
        with contextlib.suppress(FrameError):
            if frame.function_code == READ_TARGET_LIST:
                _check_encoded_again(frame, decode_target_list(frame), 0.01)


def _check_target_lists(data: bytes, random: Random) -> None:
    """Take an input as the data of a target list, in each form that a model may send it."""
    delimiter = random.choice((Delimiter.SD2, Delimiter.SD3))
    step, bits = random.choice((0.01, 0.001)), random.choice((0, 16, 32))
    frame = Frame(MASTER, random.randint(1, LAST_ADDRESS), READ_TARGET_LIST, data, delimiter)
    with contextlib.suppress(FrameError):
        targets = decode_target_list(frame, step, bits)
        assert (targets.output, len(targets.targets)) == (
            data[0], 0 if data[1] == CLIPPING else data[1])
        _check_encoded_again(frame, targets, step)


def _check_encoded_again(frame: Frame, targets: TargetList, step: float) -> None:
    resolution = Resolution.BITS_32 if frame.delimiter is Delimiter.SD3 else Resolution.BITS_16
    assert targets.clipping == (frame.pdu[1] == CLIPPING)
    assert frame.pdu.startswith(encode_target_list(targets, resolution, step))
    assert all(math.isfinite(value) for target in targets.targets for value in target)
    size = TARGET_SIZES[resolution.bits]
    padded = encode_target_list(targets, resolution, step, (len(frame.pdu) - 2) // size)
    assert targets.clipping or len(padded) == len(frame.pdu)


def _check_replies(data: bytes, random: Random) -> None:
    for command in COMMANDS:
        with contextlib.suppress(FrameError):
            check_text(command.decode(data))


def _check_settings(data: bytes, random: Random) -> None:
    key, location = random.choice(KEYS), random.choice(LOCATIONS)
    record = key[1]
    for pdu in (data, data[:record.size].ljust(record.size, b"\0")):
        with contextlib.suppress(FrameError):
            raws = record.decode_reply(pdu, location)
            assert record.pack(raws) == pdu[-record.size:]
            assert record.write_request(2, raws, location).pdu.endswith(pdu[-record.size:])
            for setting in RECORDS[key]:
                check_raws(setting, raws[setting.field])


TARGETS = (
    Target("isys frames", _check_frames, FRAMES + RAW_SIGNALS),
    Target("isys target lists", _check_target_lists, [
        *_pdus(range(READ_TARGET_LIST, READ_TARGET_LIST + 1)),
        *(frame[4:-2] for frame in FRAMES if frame[0] == Delimiter.SD3)]),
    Target("isys replies", _check_replies, _pdus(range(0xD0, 0xE2))),
    Target("isys settings", _check_settings, _pdus(range(0xD2, 0xD6))),
)
