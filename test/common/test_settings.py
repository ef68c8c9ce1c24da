# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a value may be, how it goes to the device, and that several are written all or none."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass, field
from typing import Any

import pytest

from driver_common.device import Device, DeviceOptions
from driver_common.errors import NoAnswerError, RefusedError, SettingError
from driver_common.settings import (
    Option,
    Parameter,
    Raw,
    Record,
    Setting,
    read_settings,
    suggestion,
    write_settings,
)

# --- Parameter ---------------------------------------------------------------------------------

LEVEL = Parameter("level", unit="dB", minimum=-30.0, maximum=30.0)
COUNT = Parameter("count", kind=int, minimum=1)
MODE = Parameter("mode", kind=str, choices={"fast": 0, "slow": 1})
FLAG = Parameter("flag", kind=bool)
NAME = Parameter("name", kind=str)
NAMES = Parameter("names", kind=list)
PAIR = Parameter("pair", kind=list, is_pair=True)


def test_on_and_off_are_words_even_where_yaml_made_them_booleans():
    echo = Parameter("echo", kind=str, choices={"auto": 0, "on": 1, "off": 2})
    assert (echo.check(True), echo.check(False)) == ("on", "off")
    with pytest.raises(SettingError, match="one of fast, slow"):
        Parameter("mode", kind=str, choices={"fast": 0, "slow": 1}).check(False)


@pytest.mark.parametrize(("parameter", "value", "checked"), [
    (LEVEL, 12.5, 12.5),
    (LEVEL, -30.0, -30.0),
    (LEVEL, 30, 30.0),  # a whole number does for a number
    (COUNT, 7, 7),
    (COUNT, 7.0, 7),
    (COUNT, 10**12, 10**12),
    (MODE, "slow", "slow"),
    (FLAG, True, True),
    (NAME, "", ""),
    (NAMES, ["front", "rear"], ["front", "rear"]),
    (NAMES, ("front",), ["front"]),
    (NAMES, [], []),
])
def test_a_good_value_comes_back_in_the_parameters_type(
        parameter: Parameter, value: object, checked: object) -> None:
    assert parameter.check(value) == checked
    assert type(parameter.check(value)) is type(checked)


@pytest.mark.parametrize(("parameter", "value", "text"), [
    (LEVEL, 30.5, "level = 30.5 dB is out of range, allowed is -30 … 30 dB"),
    (LEVEL, -31, "level = -31 dB is out of range, allowed is -30 … 30 dB"),
    (LEVEL, 30.000001, "level = 30.000001 dB is out of range, allowed is -30 … 30 dB"),
    (LEVEL, math.nan, "level must be a finite number, not nan"),
    (LEVEL, math.inf, "level must be a finite number, not inf"),
    (LEVEL, "10", "level must be a number, not '10'"),
    (LEVEL, True, "level must be a number, not True"),
    (LEVEL, None, "level must be a number, not None"),
    (COUNT, 0, "count = 0 is out of range, allowed is at least 1"),
    (COUNT, 2.5, "count must be a whole number, not 2.5"),
    (COUNT, math.inf, "count must be a whole number, not inf"),
    (COUNT, False, "count must be a whole number, not False"),
    (MODE, "slwo", "mode must be one of fast, slow, not 'slwo'; did you mean \"slow\"?"),
    (MODE, "x", "mode must be one of fast, slow, not 'x'"),
    (MODE, 1, "mode must be one of fast, slow, not 1"),
    (FLAG, 1, "flag must be true or false, not 1"),
    (NAME, True, "name must be a text, not True"),
    (NAMES, "front", "names must be a list of words, not 'front'"),
    (NAMES, ["front", 1], "names must be a list of words, not ['front', 1]"),
    (PAIR, [1.0], "pair must be two numbers, not [1.0]"),
    (PAIR, [1.0, "2"], "pair must be two numbers, not [1.0, '2']"),
    (PAIR, [1.0, float("nan")], "pair must be two numbers, not [1.0, nan]"),
    (PAIR, 5, "pair must be two numbers, not 5"),
    (NAMES, 5, "names must be a list of words, not 5"),
])
def test_a_bad_value_says_what_is_allowed(parameter: Parameter, value: object, text: str) -> None:
    with pytest.raises(SettingError) as caught:
        parameter.check(value)
    assert str(caught.value) == text


def test_a_setting_error_is_a_value_error() -> None:
    with pytest.raises(ValueError, match="out of range"):
        LEVEL.check(99.0)


@pytest.mark.parametrize(("parameter", "text"), [
    (LEVEL, "-30 … 30 dB"),
    (Parameter("x", minimum=0.0, unit="m"), "at least 0 m"),
    (Parameter("x", maximum=4294967.295, unit="m"), "at most 4294967.295 m"),
    (Parameter("x"), ""),
    (MODE, "fast, slow"),
])
def test_the_range_in_words(parameter: Parameter, text: str) -> None:
    assert parameter.range_text() == text


def test_a_value_in_words() -> None:
    assert LEVEL.text(2.0) == "2 dB"
    assert LEVEL.text(12.3456789) == "12.3456789 dB"
    assert COUNT.text(3) == "3"
    assert FLAG.text(True) == "True"


def test_an_option_has_a_default_and_the_checks_of_a_parameter() -> None:
    rate = Option("rate", unit="Hz", minimum=0.1, maximum=100.0, default=10.0)
    assert rate.default == 10.0
    assert not rate.live
    with pytest.raises(SettingError, match=r"rate = 0 Hz is out of range, allowed is 0\.1 … 100"):
        rate.check(0)


def test_suggestions() -> None:
    assert suggestion("rang_max", ["range_max", "led"]) == '; did you mean "range_max"?'
    assert suggestion("zzz", ["range_max", "led"]) == ""
    assert suggestion("led", []) == ""


# --- Record and Setting ------------------------------------------------------------------------


@dataclass(frozen=True)
class Numbered(Record):
    """A record with a number for its address."""

    number: int


def test_a_record_packs_its_fields() -> None:
    record = Record(layout=("B", "h", "4s"))
    assert record.size == 7
    assert record.pack((1, -2, b"\x0a\x00\x00\x01")) == bytes.fromhex("01 FF FE 0A 00 00 01")
    assert record.unpack(bytes.fromhex("01 FF FE 0A 00 00 01")) == (1, -2, b"\x0a\x00\x00\x01")
    assert Record(layout=("H",), byte_order="<").pack((1,)) == b"\x01\x00"


def _setting(wire: str, **more: Any) -> Setting:
    return Setting("x", Record(layout=(wire,)), **more)


@pytest.mark.parametrize(("setting", "kind", "limits"), [
    (_setting("B"), int, (0, 255)),
    (_setting("b"), int, (-128, 127)),
    (_setting("H"), int, (0, 65535)),
    (_setting("h", factor=0.1), float, (-3276.8, 3276.7)),
    (_setting("I", factor=0.001), float, (0.0, 4294967.295)),
    (_setting("B", factor=4, offset=4), int, (4, 1024)),
    (_setting("B", factor=0.5, offset=56.5, maximum=88.0), float, (56.5, 88.0)),
    (_setting("H", minimum=1, maximum=4), int, (1, 4)),
    (_setting("H", minimum=1), int, (1, 65535)),
    (_setting("f"), float, (None, None)),
    (_setting("d", minimum=0.0), float, (0.0, None)),
    (_setting("B", kind=bool), bool, (None, None)),
    (_setting("B", choices={"on": 1}), str, (None, None)),
    (_setting("4s"), str, (None, None)),
])
def test_kind_and_limits_follow_from_the_wire(
        setting: Setting, kind: type, limits: tuple[float | None, float | None]) -> None:
    assert setting.kind is kind
    assert setting.limits == limits


@pytest.mark.parametrize(("setting", "value", "raw", "back"), [
    (_setting("h", factor=0.1), 5.06, 51, 5.1),
    (_setting("h", factor=0.1), -5.06, -51, -5.1),
    (_setting("h", factor=0.1), 5, 50, 5.0),
    (_setting("H", factor=0.01), 0.29, 29, 0.29),
    (_setting("B", factor=4, offset=4), 12, 2, 12),
    (_setting("B", factor=4, offset=4), 13, 2, 12),
    (_setting("B", factor=0.5, offset=56.5), 60.2, 7, 60.0),
    (_setting("B", kind=bool), True, 1, True),
    (_setting("B", choices={"off": 3, "on": 5}), "on", 5, "on"),
    (_setting("4s"), "192.168.60.20", b"\xc0\xa8\x3c\x14", "192.168.60.20"),
    (_setting("d"), 0.1, 0.1, 0.1),
    (_setting("f"), 0.1, struct.unpack("f", struct.pack("f", 0.1))[0], 0.1),
    (_setting("f"), 0.0030517578125, 0.0030517578125, 0.0030517578),
    (_setting("f"), -2, -2.0, -2.0),
])
def test_encode_and_decode(setting: Setting, value: object, raw: Raw, back: object) -> None:
    assert setting.encode(value) == raw
    assert setting.decode(raw) == back
    assert type(setting.decode(raw)) is setting.kind
    assert setting.check(value) == back
    assert setting.encode(back) == raw


@pytest.mark.parametrize(("setting", "value", "text"), [
    (_setting("H"), 65536, "x = 65536 is out of range, allowed is 0 … 65535"),
    (_setting("h", factor=0.1, unit="m"), 3276.8,
     "x = 3276.8 m is out of range, allowed is -3276.8 … 3276.7 m"),
    (_setting("4s"), "1.2.3", "x must be an IPv4 address such as 192.168.60.20, not '1.2.3'"),
    (_setting("f"), 1e39,
     "x = 1e+39 is out of range, it must fit a 32-bit floating-point number"),
    (_setting("f"), math.inf, "x must be a finite number, not inf"),
])
def test_what_does_not_fit_the_wire_is_refused(setting: Setting, value: object, text: str) -> None:
    with pytest.raises(SettingError) as caught:
        setting.encode(value)
    assert str(caught.value) == text


def test_a_code_without_a_word_is_shown() -> None:
    assert _setting("B", choices={"off": 0}).decode(9) == "code_9"


def test_a_32_bit_number_that_is_none_is_shown() -> None:
    assert math.isnan(float(str(_setting("f").decode(math.nan))))
    largest = struct.unpack("<f", bytes.fromhex("FFFF7F7F"))[0]
    assert _setting("f", factor=9.80665).decode(largest) == largest * 9.80665


# --- reading and writing -----------------------------------------------------------------------

LIMITS = Numbered(1, layout=("h", "h"))
LOW, HIGH = Numbered(2, layout=("H",)), Numbered(3, layout=("H",))
SCALE = Numbered(4, layout=("f",))

SETTINGS = {setting.name: setting for setting in (
    Setting("left", LIMITS, factor=0.1, unit="dB"),
    Setting("right", LIMITS, field=1, factor=0.1, unit="dB"),
    Setting("low", LOW, factor=0.1, unit="m"),
    Setting("high", HIGH, factor=0.1, unit="m"),
    Setting("scale", SCALE),
    Setting("serial_number", Numbered(5, layout=("I",)), read_only=True),
)}


@dataclass
class FakeDevice:
    """A device in memory, with a lower limit that must not be above the upper one."""

    raw: dict[int, tuple[Raw, ...]] = field(default_factory=lambda: {
        1: (100, 200), 2: (10,), 3: (50,), 4: (0.5,), 5: (4711,)})
    log: list[tuple[str, int]] = field(default_factory=list)
    refused: set[int] = field(default_factory=set)  # numbers that it never takes
    secret: set[int] = field(default_factory=set)  # numbers that it does not tell
    silent: set[int] = field(default_factory=set)  # numbers that it does not answer
    gone: bool = False
    lost: set[int] = field(default_factory=set)  # numbers whose acknowledge is lost once
    forgets: set[int] = field(default_factory=set)  # numbers that it takes and does not keep

    def read_record(self, record: Record) -> tuple[Raw, ...]:
        assert isinstance(record, Numbered)
        self.log.append(("read", record.number))
        if self.gone or record.number in self.silent:
            raise NoAnswerError("no answer")
        if record.number in self.secret:
            raise RefusedError("the device refused")
        return record.unpack(record.pack(self.raw[record.number]))

    def write_record(self, record: Record, values: tuple[Raw, ...]) -> None:
        assert isinstance(record, Numbered)
        number = record.number
        self.log.append(("write", number))
        after = self.raw | {number: record.unpack(record.pack(values))}
        if number in self.refused or after[2] > after[3]:
            raise RefusedError("the device refused")
        if number not in self.forgets:
            self.raw = after
        if number in self.lost:
            self.lost.remove(number)
            raise NoAnswerError("no answer")

    def require_answer(self) -> None:
        if self.gone:
            raise NoAnswerError("no answer")

    @property
    def written(self) -> list[int]:
        return [number for what, number in self.log if what == "write"]


def test_reading_asks_for_each_record_once() -> None:
    device = FakeDevice()
    assert read_settings(device, SETTINGS.values()) == {
        "left": 10.0, "right": 20.0, "low": 1.0, "high": 5.0, "scale": 0.5, "serial_number": 4711}
    assert device.log == [("read", number) for number in (1, 2, 3, 4, 5)]


def test_reading_asks_for_nothing_else() -> None:
    device = FakeDevice()
    assert read_settings(device, [SETTINGS["high"]]) == {"high": 5.0}
    assert device.log == [("read", 3)]


@pytest.fixture
def notes() -> list[str]:
    return []


@pytest.fixture
def read_all(notes: list[str]) -> Any:
    """Read all settings of a device; return what is known of it."""
    known = Device(DeviceOptions())

    def read(device: FakeDevice) -> Device:
        known.read_all(device, SETTINGS, lambda text, warning=False: notes.append(text))
        return known

    return read


@pytest.mark.parametrize("device", [FakeDevice(secret={2, 4}), FakeDevice(silent={2, 4})])
def test_what_a_device_does_not_tell_is_left_out_and_told_once(
        read_all: Any, notes: list[str], device: FakeDevice) -> None:
    known = read_all(device)
    assert known.values == {"left": 10.0, "right": 20.0, "high": 5.0, "serial_number": 4711}
    assert known.settings.keys() == known.values.keys()
    assert notes == ["this firmware has no low, scale"]


def test_a_device_that_is_gone_lacks_nothing(read_all: Any, notes: list[str]) -> None:
    with pytest.raises(NoAnswerError):
        read_all(FakeDevice(gone=True))
    assert notes == []


@pytest.mark.parametrize("device", [FakeDevice(secret={2}), FakeDevice(silent={2}),
                                    FakeDevice(gone=True)])
def test_what_was_told_once_is_not_missing(
        read_all: Any, notes: list[str], device: FakeDevice) -> None:
    before = dict(read_all(FakeDevice()).values)
    with pytest.raises((RefusedError, NoAnswerError)):
        read_all(device)
    known = read_all(FakeDevice())
    assert (known.values, notes) == (before, [])


def test_writing_returns_what_the_device_reports() -> None:
    device = FakeDevice()
    assert write_settings(device, SETTINGS, {"low": 1.26, "scale": 0.1}) == {
        "low": 1.3, "scale": 0.1}
    assert device.raw[2] == (13,)
    assert device.raw[4] == (struct.unpack("f", struct.pack("f", 0.1))[0],)


def test_writing_nothing() -> None:
    device = FakeDevice()
    assert write_settings(device, SETTINGS, {}) == {}
    assert device.log == []


def test_what_does_not_change_is_not_written() -> None:
    device = FakeDevice(raw=FakeDevice().raw | {4: (struct.unpack("f", struct.pack("f", 0.1))[0],)})
    unchanged = read_settings(device, (SETTINGS[name] for name in ("left", "low", "scale")))
    # 1.04 m is nearest to the 1.0 m that it has.
    assert write_settings(device, SETTINGS, unchanged | {"low": 1.04}) == unchanged
    assert device.written == []
    write_settings(device, SETTINGS, unchanged | {"high": 6.0})
    assert device.written == [3]


def test_the_other_fields_of_a_record_stay() -> None:
    device = FakeDevice()
    write_settings(device, SETTINGS, {"right": -1.5})
    assert device.raw[1] == (100, -15)


def test_two_fields_of_a_record_are_written_at_once() -> None:
    device = FakeDevice()
    write_settings(device, SETTINGS, {"left": 1.0, "right": 2.0})
    assert device.raw[1] == (10, 20)
    assert device.written == [1]


@pytest.mark.parametrize("names", [("low", "high"), ("high", "low")])
def test_limits_that_depend_on_each_other_are_written_in_the_order_that_works(
        names: tuple[str, str]) -> None:
    device = FakeDevice()
    wanted = {"low": 8.0, "high": 9.0}  # the new low is above the old high
    assert write_settings(device, SETTINGS, {name: wanted[name] for name in names}) == wanted
    wanted = {"low": 0.1, "high": 0.5}  # and the new high below the old low
    assert write_settings(device, SETTINGS, {name: wanted[name] for name in names}) == wanted


def test_a_refused_value_is_tried_again_after_others_only() -> None:
    device = FakeDevice(refused={1})
    with pytest.raises(RefusedError):
        write_settings(device, SETTINGS, {"left": 1.0})
    assert device.written == [1]


@pytest.mark.parametrize("names", [
    ("left", "low", "high"), ("low", "left", "high"), ("low", "high", "left")])
def test_one_that_is_refused_takes_the_others_back(names: tuple[str, ...]) -> None:
    device = FakeDevice(refused={1})
    before = dict(device.raw)
    wanted = {"left": 1.0, "low": 2.0, "high": 9.0}
    with pytest.raises(RefusedError, match=r"left = 1 dB: the device refused"):
        write_settings(device, SETTINGS, {name: wanted[name] for name in names})
    assert device.raw == before


def test_limits_are_taken_back_in_the_order_that_works() -> None:
    device = FakeDevice(refused={1})
    before = dict(device.raw)
    with pytest.raises(RefusedError, match="left = 1 dB"):
        write_settings(device, SETTINGS, {"low": 8.0, "left": 1.0, "high": 9.0})
    assert device.raw == before


def test_a_lower_limit_above_the_upper_one_is_refused_and_nothing_changes() -> None:
    device = FakeDevice()
    before = dict(device.raw)
    with pytest.raises(RefusedError, match=r"low = 7 m: the device refused"):
        write_settings(device, SETTINGS, {"left": 0.0, "low": 7.0, "high": 6.0})
    assert device.raw == before


def test_one_without_an_answer_takes_all_back_itself_too() -> None:
    device = FakeDevice(lost={3})
    before = dict(device.raw)
    with pytest.raises(NoAnswerError, match="no answer"):
        write_settings(device, SETTINGS, {"left": 1.0, "high": 9.0})
    assert device.raw == before


def test_a_value_that_cannot_be_taken_back_does_not_keep_the_others() -> None:
    class Stubborn(FakeDevice):
        def write_record(self, record: Record, values: tuple[Raw, ...]) -> None:
            super().write_record(record, values)
            assert isinstance(record, Numbered)
            if record.number == 2:
                self.refused.add(2)  # takes a change, but not a second one

    device = Stubborn(refused={4})
    with pytest.raises(RefusedError, match=r"scale = 1: the device refused"):
        write_settings(device, SETTINGS, {"left": 1.0, "low": 2.0, "scale": 1.0})
    assert device.raw[1] == (100, 200)


def test_a_value_that_the_device_does_not_keep_is_an_error() -> None:
    device = FakeDevice(forgets={3})
    before = dict(device.raw)
    with pytest.raises(RefusedError, match=r"took high = 9\.04 m but reports 5 m"):
        write_settings(device, SETTINGS, {"left": 1.0, "high": 9.04})
    assert device.raw == before


@pytest.mark.parametrize(("changes", "text"), [
    ({"left": 1.0, "serial_number": 1}, "serial_number can be read only"),
    ({"left": 1.0, "low": -1.0}, "low = -1 m is out of range, allowed is 0 … 6553.5 m"),
    ({"left": 1.0, "low": "far"}, "low must be a number, not 'far'"),
    ({"left": 1.0, "hihg": 1.0}, 'there is no setting "hihg"; did you mean "high"?'),
])
def test_a_bad_name_or_value_sends_nothing(changes: dict[str, Any], text: str) -> None:
    device = FakeDevice()
    with pytest.raises(SettingError) as caught:
        write_settings(device, SETTINGS, changes)
    assert str(caught.value) == text
    assert device.log == []


# --- parameter files -----------------------------------------------------------------------------

@pytest.mark.parametrize(("parameter", "given", "value"), [
    (NAME, 1234, "1234"), (NAME, 12.5, "12.5"),
    (Parameter("axis", kind=str, choices={"x": 0, "y": 1}), True, "y"),
    (Parameter("axis", kind=str, choices={"x": 0, "n": 1}), False, "n"),
    (Parameter("echo", kind=str, choices={"off": 0, "on": 1}), True, "on"),
    (Parameter("size", kind=str, choices={"16": 0, "32": 1}), 16, "16")])
def test_a_text_that_yaml_takes_for_another_type(parameter, given, value):
    assert parameter.check(given) == value


def test_a_text_that_does_not_match_is_refused_with_what_is_allowed():
    frame = Parameter("frame_id", kind=str, pattern=r"[^/]+", description="a name without slashes")
    assert frame.check("link") == "link"
    with pytest.raises(SettingError, match="frame_id cannot be '/link': a name without slashes"):
        frame.check("/link")
