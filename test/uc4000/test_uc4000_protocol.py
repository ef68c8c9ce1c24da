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
from collections.abc import Sequence

import pytest

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

VERSION = bytes.fromhex("48 57 3A 56 30 2E 31 20 53 57 3A 56 31 2E 30 30 30 00 E7")
SERIAL_NUMBER = bytes.fromhex("34 30 30 30 30 30 31 36 39 30 30 30 30 31 D7")

# Table A1: value, request to sensor 7 to store it, reply. The third byte is the code.
BURST_PERIODS = """
    4  A7 23 00 57  00 C5
    8  A7 23 01 46  01 D4
   12  A7 23 02 76  02 E4
   16  A7 23 03 67  03 F5
   20  A7 23 04 45  04 D7
   24  A7 23 05 54  05 C6
   28  A7 23 06 64  06 F6
   32  A7 23 07 75  07 E7
   36  A7 23 08 75  08 E7
   40  A7 23 09 64  09 F6
   44  A7 23 0A 54  0A C6
   48  A7 23 0B 45  0B D7
   52  A7 23 0C 67  0C F5
   56  A7 23 0D 76  0D E4
   60  A7 23 0E 46  0E D4
   64  A7 23 0F 57  0F C5
"""
GAIN_DB = """
 56.5  A7 22 00 46  00 C5
   57  A7 22 01 57  01 D4
 57.5  A7 22 02 67  02 E4
   58  A7 22 03 76  03 F5
 58.5  A7 22 04 54  04 D7
   59  A7 22 05 45  05 C6
 59.5  A7 22 06 75  06 F6
   60  A7 22 07 64  07 E7
 60.5  A7 22 08 64  08 E7
   61  A7 22 09 75  09 F6
 61.5  A7 22 0A 45  0A C6
   62  A7 22 0B 54  0B D7
 62.5  A7 22 0C 76  0C F5
   63  A7 22 0D 67  0D E4
 63.5  A7 22 0E 57  0E D4
   64  A7 22 0F 46  0F C5
 64.5  A7 22 10 52  10 D1
   65  A7 22 11 43  11 C0
 65.5  A7 22 12 73  12 F0
   66  A7 22 13 62  13 E1
 66.5  A7 22 14 40  14 C3
   67  A7 22 15 51  15 D2
 67.5  A7 22 16 61  16 E2
   68  A7 22 17 70  17 F3
 68.5  A7 22 18 70  18 F3
   69  A7 22 19 61  19 E2
 69.5  A7 22 1A 51  1A D2
   70  A7 22 1B 40  1B C3
 70.5  A7 22 1C 62  1C E1
   71  A7 22 1D 73  1D F0
 71.5  A7 22 1E 43  1E C0
   72  A7 22 1F 52  1F D1
 72.5  A7 22 20 62  20 E1
   73  A7 22 21 73  21 F0
 73.5  A7 22 22 43  22 C0
   74  A7 22 23 52  23 D1
 74.5  A7 22 24 70  24 F3
   75  A7 22 25 61  25 E2
 75.5  A7 22 26 51  26 D2
   76  A7 22 27 40  27 C3
 76.5  A7 22 28 40  28 C3
   77  A7 22 29 51  29 D2
 77.5  A7 22 2A 61  2A E2
   78  A7 22 2B 70  2B F3
 78.5  A7 22 2C 52  2C D1
   79  A7 22 2D 43  2D C0
 79.5  A7 22 2E 73  2E F0
   80  A7 22 2F 62  2F E1
 80.5  A7 22 30 76  30 F5
   81  A7 22 31 67  31 E4
 81.5  A7 22 32 57  32 D4
   82  A7 22 33 46  33 C5
 82.5  A7 22 34 64  34 E7
   83  A7 22 35 75  35 F6
 83.5  A7 22 36 45  36 C6
   84  A7 22 37 54  37 D7
 84.5  A7 22 38 54  38 D7
   85  A7 22 39 45  39 C6
 85.5  A7 22 3A 75  3A F6
   86  A7 22 3B 64  3B E7
 86.5  A7 22 3C 46  3C C5
   87  A7 22 3D 57  3D D4
 87.5  A7 22 3E 67  3E E4
   88  A7 22 3F 76  3F F5
"""
CURRENT_MA = """
  160  A7 21 00 76  00 C5
  165  A7 21 01 67  01 D4
  171  A7 21 02 57  02 E4
  176  A7 21 03 46  03 F5
  181  A7 21 04 64  04 D7
  186  A7 21 05 75  05 C6
  192  A7 21 06 45  06 F6
  197  A7 21 07 54  07 E7
  203  A7 21 08 54  08 E7
  208  A7 21 09 45  09 F6
  213  A7 21 0A 75  0A C6
  219  A7 21 0B 64  0B D7
  224  A7 21 0C 46  0C F5
  229  A7 21 0D 57  0D E4
  235  A7 21 0E 67  0E D4
  240  A7 21 0F 76  0F C5
  245  A7 21 10 62  10 D1
  251  A7 21 11 73  11 C0
  256  A7 21 12 43  12 F0
  261  A7 21 13 52  13 E1
  267  A7 21 14 70  14 C3
  272  A7 21 15 61  15 D2
  277  A7 21 16 51  16 E2
  283  A7 21 17 40  17 F3
  288  A7 21 18 40  18 F3
  293  A7 21 19 51  19 E2
  299  A7 21 1A 61  1A D2
  304  A7 21 1B 70  1B C3
  309  A7 21 1C 52  1C E1
  315  A7 21 1D 43  1D F0
  320  A7 21 1E 73  1E C0
  325  A7 21 1F 62  1F D1
  331  A7 21 20 52  20 E1
  336  A7 21 21 43  21 F0
  341  A7 21 22 73  22 C0
  347  A7 21 23 62  23 D1
  352  A7 21 24 40  24 F3
  357  A7 21 25 51  25 E2
  363  A7 21 26 61  26 D2
  368  A7 21 27 70  27 C3
  373  A7 21 28 70  28 C3
  379  A7 21 29 61  29 D2
  384  A7 21 2A 51  2A E2
  389  A7 21 2B 40  2B F3
  395  A7 21 2C 62  2C D1
  400  A7 21 2D 73  2D C0
  405  A7 21 2E 43  2E F0
  411  A7 21 2F 52  2F E1
  416  A7 21 30 46  30 F5
  421  A7 21 31 57  31 E4
  427  A7 21 32 67  32 D4
  432  A7 21 33 76  33 C5
  437  A7 21 34 54  34 E7
  443  A7 21 35 45  35 F6
  448  A7 21 36 75  36 C6
  453  A7 21 37 64  37 D7
  459  A7 21 38 64  38 D7
  464  A7 21 39 75  39 C6
  469  A7 21 3A 45  3A F6
  475  A7 21 3B 54  3B E7
  480  A7 21 3C 76  3C C5
  485  A7 21 3D 67  3D D4
  491  A7 21 3E 57  3E E4
  496  A7 21 3F 46  3F F5
"""


def _rows(name: str, table: str) -> list[tuple[str, float, bytes, bytes]]:
    rows = []
    for line in table.strip().splitlines():
        value, *telegrams = line.split()
        numbers = bytes.fromhex("".join(telegrams))
        rows.append((name, float(value), numbers[:4], numbers[4:]))
    return rows


TABLE_A1 = [*_rows("burst_periods", BURST_PERIODS), *_rows("gain_db", GAIN_DB),
            *_rows("current_ma", CURRENT_MA)]


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

REQUESTS: list[tuple[Command[object], int, str]] = [
    (commands.ASK_ADDRESS, 0, "A8 00 00 43"),
    (commands.READ_TEMPERATURE, 7, "AF FF FF 61"),
    (commands.measure(PROFILES["a"], 1), 7, "AF FE FE 61"),
    (commands.measure(PROFILES["b"], 2), 7, "AF FD FD 61"),
    (commands.measure(PROFILES["c"], 3), 7, "AF FC FC 61"),
    (commands.measure(PROFILES["user"], 10), 7, "AF 37 F5 70"),
    (commands.measure(PROFILES["a"], 255), 7, "AF FE 00 70"),
    (commands.READ_ADDRESS, 1, "A9 35 FF 61"),
    (commands.write_address(1), 7, "A7 35 01 61"),
    (commands.write_address(7), 0, "A0 35 07 70"),
    (commands.READ_VERSION, 2, "AA 34 FF 40"),
    (commands.READ_SERIAL_NUMBER, 3, "AB 33 FF 73"),
    (_record(ALL_SETTINGS["burst_periods"]).read(), 7, "AF 23 FF 75"),
    (_record(ALL_SETTINGS["gain_db"]).read(), 7, "AF 22 FF 64"),
    (_record(ALL_SETTINGS["current_ma"]).read(), 7, "AF 21 FF 54"),
    (_record(ALL_SETTINGS["temperature_compensation"]).write([0xFF]), 7, "A7 0A FF 40"),
    (_record(ALL_SETTINGS["temperature_compensation"]).write([0x00]), 7, "A7 0A 00 40"),
]


@pytest.mark.parametrize(("command", "address", "telegram"), REQUESTS)
def test_a_request(command: Command[object], address: int, telegram: str) -> None:
    request = command.request(address)
    assert request.encode() == bytes.fromhex(telegram)
    assert Request.decode(bytes.fromhex(telegram)) == request
    assert request.is_write == (not int(telegram[:2], 16) & 0x08)


MEASURE = commands.measure(PROFILES["b"])
MEASURE_A = commands.measure(PROFILES["a"])
REPLIES: list[tuple[Command[object], str, object]] = [
    (MEASURE, "23 D1", Distance(0.56)),
    (MEASURE, "10 D1", Distance(0.256)),
    (MEASURE, "FA C6", Distance(4.0)),
    (MEASURE, "00 C5", Distance(math.inf, Outcome.NO_ECHO)),
    (MEASURE, "01 D4", Distance(-math.inf, Outcome.TOO_CLOSE)),
    (MEASURE, "FF C5", Distance(math.inf, Outcome.TOO_FAR)),
    (MEASURE, "02 E4", Distance(-math.inf, Outcome.TOO_CLOSE)),  # 0.032 m
    (MEASURE, "0F C5", Distance(-math.inf, Outcome.TOO_CLOSE)),  # 0.240 m
    (MEASURE, "FB D7", Distance(math.inf, Outcome.TOO_FAR)),  # 4.016 m
    (MEASURE, "FE D4", Distance(math.inf, Outcome.TOO_FAR)),
    (MEASURE_A, "DA E2", Distance(3.488)),
    (MEASURE_A, "DB F3", Distance(math.inf, Outcome.TOO_FAR)),  # 3.504 m, profile a ends at 3.5 m
    (MEASURE_A, "F0 C5", Distance(math.inf, Outcome.TOO_FAR)),
    (commands.READ_TEMPERATURE, "15 D2", 21),
    (commands.READ_TEMPERATURE, "E7 F3", -25),
    (commands.READ_TEMPERATURE, "7F ED", 127),
    (commands.READ_TEMPERATURE, "80 ED", -128),
    (commands.READ_ADDRESS, "07 E7", 7),
    (commands.ASK_ADDRESS, "03 F5", 3),
    (commands.write_address(3), "03 F5", 3),
    (commands.READ_VERSION, VERSION.hex(), "HW:V0.1 SW:V1.000"),
    (commands.READ_VERSION, "48 57 3A 56 31 2E 30 20 53 57 3A 54 56 31 2E 30 00 00 F9",
     "HW:V1.0 SW:TV1.0"),  # a test version
    (commands.READ_SERIAL_NUMBER, SERIAL_NUMBER.hex(), "40000016900001"),
]


@pytest.mark.parametrize(("command", "telegram", "result"), REPLIES)
def test_a_reply(command: Command[object], telegram: str, result: object) -> None:
    data = bytes.fromhex(telegram)
    assert len(data) == command.reply_length
    reply = Reply.decode(data)
    assert reply.acknowledged
    assert command.decode(reply.data) == result
    assert Reply(reply.data).encode() == data


def test_the_lengths_of_replies() -> None:
    lengths = {command.reply_length for command, _, _ in REQUESTS}
    assert lengths == {2, 15, 19}
    assert commands.READ_SERIAL_NUMBER.reply_length == 15
    assert commands.READ_VERSION.reply_length == 19


@pytest.mark.parametrize(("telegram", "code", "text"), [
    ("01 7C", ErrorCode.CHECKSUM_ERROR, "checksum error (0x01)"),
    ("02 4C", ErrorCode.TELEGRAM_TIMEOUT, "telegram timeout (0x02)"),
    ("03 5D", ErrorCode.TELEGRAM_UNDERFLOW, "telegram underflow (0x03)"),
    ("04 7F", ErrorCode.TELEGRAM_OVERFLOW, "telegram overflow (0x04)"),
    ("05 6E", ErrorCode.PARAMETER_ERROR, "parameter error (0x05)"),
    ("06 5E", ErrorCode.SESSION_ERROR, "session error (0x06)"),
    ("07 4F", ErrorCode.TRANSMISSION_ERROR, "transmission error (0x07)"),
    ("08 4F", ErrorCode.EEPROM_ERROR, "eeprom error (0x08)"),
    ("09 5E", ErrorCode.OP_CODE_ERROR, "op code error (0x09)"),
    ("0A 6E", ErrorCode.OBJECT_IS_READ_ONLY, "object is read only (0x0A)"),
    ("0B 7F", ErrorCode.TEMPERATURE_ERROR, "temperature error (0x0B)"),
    ("0C 5D", 0x0C, "error that the manual does not explain (0x0C)"),
    ("0D 4C", 0x0D, "error that the manual does not explain (0x0D)"),
    ("FF 6D", ErrorCode.NO_ERROR, "no error (0xFF)"),
    ("42 54", 0x42, "error that the manual does not explain (0x42)"),
])
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
    assert [len(_rows("", table)) for table in (BURST_PERIODS, GAIN_DB, CURRENT_MA)] == [16, 64, 64]


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
