# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The UC4000 codec against literal bytes: requests, replies, refusals and every code of table A1.

The bytes were typed from the manual; where it leaves CHECK open, CHECK was worked out by its rule
apart from the code under test.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from typing import Any

import pytest
from operations import Counting

from bench.examples.uc4000 import (
    REFUSALS,
    REPLIES,
    REQUESTS,
    SERIAL_NUMBER,
    TABLE_A1,
    VERSION,
)
from driver_common.errors import FrameError, SettingError
from driver_common.settings import Setting
from uc4000_driver import commands
from uc4000_driver.commands import PROFILES, Command, Distance, Outcome, Uc4000Record
from uc4000_driver.settings import ALL_SETTINGS
from uc4000_driver.telegram import (
    CAST,
    ErrorCode,
    Reply,
    ReplyParser,
    Request,
    check_byte,
    error_text,
)


def _record(setting: Setting) -> Uc4000Record:
    assert isinstance(setting.record, Uc4000Record)
    return setting.record


# --- CHECK -------------------------------------------------------------------------------------

def test_the_manuals_examples_of_check() -> None:
    assert Request(CAST, 0x00, 0x00).encode() == bytes.fromhex("A8 00 00 43")  # 5.1.6.3
    assert Reply(b"\x23").encode() == bytes.fromhex("23 D1")  # 4.5.3
    assert check_byte(bytes.fromhex("A8 00 00")) == 0x43
    assert check_byte(b"\x23", acknowledged=True) == 0xD1


@pytest.mark.parametrize("data", range(256))
def test_check_tells_data_from_refusal_and_never_looks_like_sync(data: int) -> None:
    good, bad = Reply(bytes((data,))).encode(), Reply(bytes((data,)), acknowledged=False).encode()
    assert good[1] & 0xC0 == 0xC0
    assert bad[1] & 0xC0 == 0x40
    assert Reply.decode(good).acknowledged
    assert not Reply.decode(bad).acknowledged


@pytest.mark.parametrize("bit", range(16))
def test_a_flipped_bit_is_noticed(bit: int) -> None:
    damaged = int.from_bytes(bytes.fromhex("23 D1"), "big") ^ 1 << bit
    with pytest.raises(FrameError, match="damaged reply"):
        Reply.decode(damaged.to_bytes(2, "big"))


@pytest.mark.parametrize("telegram", ["", "D1", "23", "23 D1 00"])
def test_a_reply_of_another_length_is_damaged(telegram: str) -> None:
    with pytest.raises(FrameError, match="damaged reply"):
        Reply.decode(bytes.fromhex(telegram))


@pytest.mark.parametrize("telegram", ["A8 00 00 42", "98 00 00 43", "A8 00 00", "A8 00 00 43 00"])
def test_a_damaged_request_is_noticed(telegram: str) -> None:
    with pytest.raises(FrameError, match="damaged request"):
        Request.decode(bytes.fromhex(telegram))


# --- requests and replies of every op-code -----------------------------------------------------

def _command(name: str) -> Command[Any]:
    word, *arguments = name.split()
    if word == "measure":
        return commands.measure(PROFILES[arguments[0]], int(arguments[1]))
    if word == "write_address":
        return commands.write_address(int(arguments[0]))
    if word in ("read", "write"):
        record = _record(ALL_SETTINGS[arguments[0]])
        return record.read() if word == "read" else record.write([int(arguments[1])])
    command = getattr(commands, word)
    assert isinstance(command, Command)
    return command


@pytest.mark.parametrize(("command", "address", "telegram"), REQUESTS)
def test_a_request(command: str, address: int, telegram: str) -> None:
    request = _command(command).request(address)
    assert request.encode() == bytes.fromhex(telegram)
    assert Request.decode(bytes.fromhex(telegram)) == request
    assert request.is_write == (not int(telegram[:2], 16) & 0x08)


MEASURE = commands.measure(PROFILES["b"])


@pytest.mark.parametrize(("command", "telegram", "result"), REPLIES)
def test_a_reply(command: str, telegram: str, result: object) -> None:
    data, asked = bytes.fromhex(telegram), _command(command)
    if isinstance(result, tuple):
        result = Distance(result[0], Outcome[result[1]])
    assert len(data) == asked.reply_length
    reply = Reply.decode(data)
    assert reply.acknowledged
    assert asked.decode(reply.data) == result
    assert Reply(reply.data).encode() == data


def test_the_lengths_of_replies() -> None:
    lengths = {_command(request.command).reply_length for request in REQUESTS}
    assert lengths == {2, 15, 19}
    assert commands.READ_SERIAL_NUMBER.reply_length == 15
    assert commands.READ_VERSION.reply_length == 19


@pytest.mark.parametrize(("telegram", "code", "text"), REFUSALS)
def test_a_refusal(telegram: str, code: int, text: str) -> None:
    reply = Reply.decode(bytes.fromhex(telegram))
    assert reply == Reply(bytes((code,)), acknowledged=False)
    assert reply.encode() == bytes.fromhex(telegram)
    assert error_text(reply.data[0]) == text


def test_every_named_error_code_is_in_the_manual() -> None:
    assert {int(code) for code in ErrorCode} == {*range(0x01, 0x0C), 0xFF}


@pytest.mark.parametrize("cycles", [0, -1, 256])
def test_a_number_of_cycles_that_does_not_fit(cycles: int) -> None:
    with pytest.raises(SettingError, match=r"out of range, allowed is 1 … 255"):
        commands.measure(PROFILES["a"], cycles)


@pytest.mark.parametrize("cycles", [1, 2, 17, 255])
def test_the_data_byte_is_0xff_minus_the_cycles(cycles: int) -> None:
    command = commands.measure(PROFILES["c"], cycles)
    assert command.data == 255 - cycles
    assert command.duration == pytest.approx(0.05 * cycles)


@pytest.mark.parametrize("address", [0, 8, -1])
def test_an_address_that_no_sensor_can_have(address: int) -> None:
    with pytest.raises(SettingError, match=r"out of range, allowed is 1 … 7"):
        commands.write_address(address)


@pytest.mark.parametrize("telegram", ["00 C5", "08 E7"])
def test_a_reply_that_is_no_address(telegram: str) -> None:
    reply = Reply.decode(bytes.fromhex(telegram))
    with pytest.raises(FrameError, match="no address"):
        commands.READ_ADDRESS.decode(reply.data)


def test_the_ranges_of_the_profiles() -> None:
    assert {name: profile.limits for name, profile in PROFILES.items()} == {
        "a": (0.25, 3.5), "b": (0.25, 4.0), "c": (0.25, 4.0), "user": (0.25, 4.0)}


# --- settings ----------------------------------------------------------------------------------

def test_table_a1_is_whole() -> None:
    assert Counter(row.setting for row in TABLE_A1) == {
        "burst_periods": 16, "gain_db": 64, "current_ma": 64}


@pytest.mark.parametrize(("name", "value", "request_", "reply"), TABLE_A1)
def test_a_code_of_table_a1(name: str, value: float, request_: bytes, reply: bytes) -> None:
    setting = ALL_SETTINGS[name]
    record = _record(setting)
    raw = setting.encode(value)
    assert raw == request_[2]
    command = record.write([raw])
    assert command.request(7).encode() == request_
    assert setting.decode(command.decode(Reply.decode(reply).data)) == value
    assert record.read().reply_length == len(reply) == 2
    assert setting.check(value) == value


@pytest.mark.parametrize(("name", "value", "text"), [
    ("burst_periods", 6, "burst_periods = 6 lies between two steps, the nearest are 4 and 8"),
    ("burst_periods", 63, "burst_periods = 63 lies between two steps, the nearest are 60 and 64"),
    ("burst_periods", 3, "burst_periods = 3 is out of range, allowed is 4 … 64"),
    ("burst_periods", 65, "burst_periods = 65 is out of range, allowed is 4 … 64"),
    ("burst_periods", 4.5, "burst_periods must be a whole number, not 4.5"),
    ("gain_db", 57.25,
     "gain_db = 57.25 dB lies between two steps, the nearest are 57 dB and 57.5 dB"),
    ("gain_db", 87.9,
     "gain_db = 87.9 dB lies between two steps, the nearest are 87.5 dB and 88 dB"),
    ("gain_db", 56.0, "gain_db = 56 dB is out of range, allowed is 56.5 … 88 dB"),
    ("gain_db", math.nan, "gain_db must be a finite number, not nan"),
    ("current_ma", 170,
     "current_ma = 170 mA lies between two steps, the nearest are 165 mA and 171 mA"),
    ("current_ma", 497, "current_ma = 497 mA is out of range, allowed is 160 … 496 mA"),
    ("temperature_compensation", "maybe",
     "temperature_compensation must be one of on, off, not 'maybe'"),
    ("temperature_compensation", 1, "temperature_compensation must be one of on, off, not 1"),
])
def test_a_value_that_the_sensor_does_not_have(name: str, value: object, text: str) -> None:
    with pytest.raises(SettingError) as caught:
        ALL_SETTINGS[name].check(value)
    assert str(caught.value) == text


@pytest.mark.parametrize(("name", "raw"), [("burst_periods", 16), ("gain_db", 64),
                                           ("current_ma", 255)])
def test_a_code_beyond_the_table_is_no_value(name: str, raw: int) -> None:
    assert ALL_SETTINGS[name].decode(raw) == -1


@pytest.mark.parametrize(("value", "raw", "shown"), [
    ("on", 0xFF, "on"), ("off", 0x00, "off"),
    (True, 0xFF, "on"), (False, 0x00, "off"),  # what YAML makes of them
])
def test_temperature_compensation(value: object, raw: int, shown: str) -> None:
    setting = ALL_SETTINGS["temperature_compensation"]
    assert setting.encode(value) == raw
    assert setting.decode(raw) == shown


# --- what arrives ------------------------------------------------------------------------------

CAST_REQUEST = bytes.fromhex("A8 00 00 43")


def _parse(length: int, pieces: Sequence[bytes], requests: int = 1,
           request: bytes = CAST_REQUEST) -> ReplyParser:
    """Return a parser after it was fed; an empty piece is a gap."""
    parser = ReplyParser(length)
    for _ in range(requests):
        parser.sent(request)
    for piece in pieces:
        if piece:
            parser.feed(piece)
        else:
            parser.gap()
    return parser


def _split(data: bytes) -> list[bytes]:
    return [bytes((byte,)) for byte in data]


@pytest.mark.parametrize("echo", [b"", CAST_REQUEST])
@pytest.mark.parametrize(("length", "reply"), [
    (2, bytes.fromhex("23 D1")), (15, SERIAL_NUMBER), (19, VERSION)])
def test_a_reply_arrives_at_once_or_byte_by_byte(echo: bytes, length: int, reply: bytes) -> None:
    for pieces in ([echo + reply], _split(echo + reply), [echo, reply] if echo else [reply]):
        parser = _parse(length, pieces)
        assert parser.complete
        assert [found.encode() for found in parser.replies] == [reply]
        assert parser.echo == bool(echo)
        assert parser.pending == parser.damaged == b""
        assert parser.skipped == 0


def test_a_reply_may_begin_like_the_echo() -> None:
    # 168 × 16 mm: the data byte is the first byte of the request
    parser = _parse(2, [b"\xA8", b"\xEB"])
    assert [reply.data for reply in parser.replies] == [b"\xA8"]
    assert parser.echo is False


def test_the_echo_alone_is_no_reply() -> None:
    parser = _parse(2, _split(CAST_REQUEST))
    assert parser.echo is True
    assert parser.replies == []
    assert not parser.complete


@pytest.mark.parametrize("length", [2, 15, 19])
@pytest.mark.parametrize("code", [*range(0x01, 0x0E), 0xFF])
def test_a_refusal_is_short_whatever_was_asked(length: int, code: int) -> None:
    checks = dict(zip([*range(0x01, 0x0E), 0xFF], bytes.fromhex(
        "7C 4C 5D 7F 6E 5E 4F 4F 5E 6E 7F 5D 4C 6D"), strict=True))
    parser = _parse(length, [bytes((code, checks[code])), b""])
    assert parser.replies == [Reply(bytes((code,)), acknowledged=False)]


def test_the_beginning_of_a_version_looks_like_a_refusal_but_is_none() -> None:
    assert not Reply.decode(VERSION[:2]).acknowledged  # "HW" is a valid refusal, code 0x48
    assert _parse(19, [VERSION[:2], VERSION[2:]]).replies == [Reply(VERSION[:-1])]
    broken = _parse(19, [VERSION[:2], b""])
    assert broken.replies == []
    assert broken.damaged == VERSION[:2]


@pytest.mark.parametrize("pieces", [
    ["23 D0"], ["23"], ["D1"], ["00 23 D1"], ["23 D0 23 D1"], ["FF FF FF FF FF"]])
def test_a_short_reply_must_begin_right_behind_a_gap(pieces: list[str]) -> None:
    parser = _parse(2, [*(bytes.fromhex(piece) for piece in pieces), b""])
    assert parser.replies == []
    assert parser.damaged == bytes.fromhex(pieces[-1])


def test_a_reply_after_noise_and_a_gap_is_good() -> None:
    parser = _parse(2, [b"\x00\x55", b"", bytes.fromhex("23 D1")])
    assert [reply.data for reply in parser.replies] == [b"\x23"]
    assert parser.damaged == b"\x00\x55"
    assert parser.echo is None  # the noise may have been the echo


def test_bytes_behind_a_reply_are_seen() -> None:
    assert _parse(2, [bytes.fromhex("23 D1 23 D1")]).pending == bytes.fromhex("23 D1")


def test_a_refusal_behind_the_only_reply_is_no_reply() -> None:
    parser = _parse(19, [VERSION + bytes.fromhex("04 7F"), b""])
    assert [reply.encode() for reply in parser.replies] == [VERSION]
    assert parser.damaged == bytes.fromhex("04 7F")


@pytest.mark.parametrize("front", ["23 D1", "23 D1 01 7C", "00 FF 55", "48 57"])
def test_a_long_reply_is_found_behind_older_bytes(front: str) -> None:
    old = bytes.fromhex(front)
    for pieces in ([old + VERSION], _split(old + VERSION), [old, VERSION]):
        parser = _parse(19, pieces)
        assert parser.replies == [Reply(VERSION[:-1])]
        assert parser.skipped == len(old)


def test_several_replies_come_one_after_the_other() -> None:
    replies = bytes.fromhex("23 D1 10 D1 FA C6")
    for pieces in ([replies], _split(replies), [CAST_REQUEST * 3 + replies]):
        parser = _parse(2, pieces, requests=3)
        assert parser.complete
        assert [reply.data[0] for reply in parser.replies] == [0x23, 0x10, 0xFA]


def test_an_echo_may_come_before_the_next_request_is_sent() -> None:
    parser = ReplyParser()
    parser.sent(CAST_REQUEST)
    parser.feed(CAST_REQUEST)
    parser.sent(CAST_REQUEST)
    parser.feed(CAST_REQUEST[:2])
    parser.feed(CAST_REQUEST[2:] + bytes.fromhex("23 D1 10 D1"))
    assert parser.echo is True
    assert [reply.data[0] for reply in parser.replies] == [0x23, 0x10]


@pytest.mark.parametrize("length", [2, 19])
def test_noise_without_end_is_not_kept(length: int) -> None:
    parser = _parse(length, [b"\x55" * 1000] * 10)
    assert len(parser.pending) <= 64
    parser.gap()
    parser.feed(VERSION if length == 19 else bytes.fromhex("23 D1"))
    assert parser.complete


@pytest.mark.parametrize("length", [2, 3, 12, 34])
@pytest.mark.parametrize("noise", ["00", "A0", "FF", "55 AA", "80 3F"])
def test_noise_without_an_end_costs_the_same_per_byte_and_fills_no_memory(
        length: int, noise: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Counting, "looks", 0)
    parser = ReplyParser(length)
    parser._buffer = Counting()
    parser.sent(CAST_REQUEST)
    count = 250
    for byte in bytes.fromhex(noise) * count:
        parser.feed(bytes((byte,)))
        assert len(parser.pending) <= 64
    assert Counting.looks <= 64 * 34 * count * len(bytes.fromhex(noise))
    assert len(parser.replies) <= 1
