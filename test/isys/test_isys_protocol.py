# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The iSYS codec against the manual's frames: meaning to bytes, and bytes to meaning."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest

from bench.examples.isys import (
    EEPROM,
    EXAMPLES,
    HAND_TYPED,
    RAM,
    SD1,
    Acknowledge,
    ChangeAddress,
    Example,
    Failure,
    Meaning,
    Misprinted,
    Read,
    Request,
    Result,
    TargetListRequest,
    Targets,
    Values,
    Write,
)
from driver_common.errors import FrameError, SettingError
from driver_common.settings import Raw, Setting
from isys_radar_driver import commands
from isys_radar_driver.commands import Command, IsysRecord, Location, RawSignals, Version
from isys_radar_driver.frames import FAILURE, MASTER, Delimiter, Frame, FrameParser
from isys_radar_driver.settings import ALL_SETTINGS, ROWS, Row, is_application_setting
from isys_radar_driver.targets import (
    Resolution,
    Target,
    TargetList,
    decode_target_list,
    encode_target_list,
)

ALL_EXAMPLES = EXAMPLES + HAND_TYPED
REQUESTS = (Request, Read, Write, ChangeAddress, TargetListRequest, Misprinted)
REPLIES = (Result, Values, Acknowledge, Failure, Targets)


def _near(value: Any) -> Any:
    """Return what equals the value but for the last bits: far less than the smallest step."""
    return pytest.approx(value, rel=1e-9, abs=1e-12)


def _examples(*kinds: type) -> list[Any]:
    return [pytest.param(bytes.fromhex(example.frame), example.meaning, id=example.where)
            for example in ALL_EXAMPLES if isinstance(example.meaning, kinds)]


def _parse(data: bytes, meaning: Meaning) -> Frame:
    fixed = isinstance(meaning, Targets) and bool(meaning.resolution & 0x80)
    parser = FrameParser(fixed_targets=0 if fixed else None)
    frames = list(parser.feed(data))
    assert len(frames) == 1
    assert parser.pending == parser.dropped_bytes == parser.damaged_frames == 0
    return frames[0]


def _record(names: tuple[str, ...], location: int | None) -> IsysRecord:
    """Return the record that holds exactly these settings."""
    record = ALL_SETTINGS[names[0]].record
    assert isinstance(record, IsysRecord)
    section = ALL_SETTINGS[names[0]].section
    assert names == tuple(setting.name for setting in ALL_SETTINGS.values()
                          if setting.record == record and setting.section == section)
    assert record.has_location == (location is not None)
    return record


def _fields(record: IsysRecord, values: dict[str, Any]) -> list[Raw]:
    fields: list[Raw] = [0] * len(record.layout)
    for name, value in values.items():
        fields[ALL_SETTINGS[name].field] = ALL_SETTINGS[name].encode(value)
    return fields


def _request(meaning: Meaning) -> Frame:
    """Return the request that the driver sends to say this."""
    match meaning:
        case Request(address, command):
            return getattr(commands, command).request(address)
        case TargetListRequest(address, output, resolution):
            return commands.read_target_list(address, output, Resolution(resolution))
        case ChangeAddress(address, new_address):
            return commands.change_address(address, new_address)
        case Read(address, names, location):
            return _record(names, location).read_request(address, Location(location or RAM))
        case Write(address, values, location):
            record = _record(tuple(values), location)
            return record.write_request(address, _fields(record, values), Location(location or RAM))
        case Misprinted(address, function_code, pdu):
            return Frame(address, MASTER, function_code, bytes.fromhex(pdu))
    raise AssertionError(meaning)


def _values(names: Iterable[str], fields: tuple[Raw, ...]) -> dict[str, Any]:
    return {name: ALL_SETTINGS[name].decode(fields[ALL_SETTINGS[name].field]) for name in names}


def test_all_frames_of_the_manual_are_here() -> None:
    assert len(EXAMPLES) == 177
    figures = [int(example.where.split()[1]) for example in EXAMPLES
               if example.where.startswith("figure")]
    assert figures == sorted(set(figures))
    assert len(figures) == 173
    assert figures[0] == 1
    assert figures[-1] == 200


@pytest.mark.parametrize("example", ALL_EXAMPLES, ids=lambda example: example.where)
def test_a_parsed_frame_encodes_to_the_same_bytes(example: Example) -> None:
    data = bytes.fromhex(example.frame)
    frame = _parse(data, example.meaning)
    assert frame.encode() == data


@pytest.mark.parametrize(("data", "meaning"), _examples(*REQUESTS))
def test_a_request_is_what_the_manual_prints(data: bytes, meaning: Meaning) -> None:
    request = _request(meaning)
    assert request.encode().hex(" ") == data.hex(" ")
    assert _parse(data, meaning) == request
    assert (request.destination, request.source) == (meaning[0], MASTER)


@pytest.mark.parametrize(("data", "meaning"), _examples(Write))
def test_a_write_request_holds_the_values(data: bytes, meaning: Write) -> None:
    record = _record(tuple(meaning.values), meaning.location)
    pdu = _parse(data, meaning).pdu
    assert _values(meaning.values, record.unpack(pdu[len(pdu) - record.size:])) == meaning.values


@pytest.mark.parametrize(("data", "meaning"), _examples(*REPLIES))
def test_a_reply_goes_from_its_sensor_to_the_master(data: bytes, meaning: Meaning) -> None:
    frame = _parse(data, meaning)
    assert (frame.destination, frame.source) == (MASTER, meaning[0])
    assert (frame.function_code == FAILURE) == isinstance(meaning, Failure)


@pytest.mark.parametrize(("data", "meaning"), _examples(Acknowledge))
def test_an_acknowledge_is_the_function_code_alone(data: bytes, meaning: Acknowledge) -> None:
    frame = _parse(data, meaning)
    assert frame == Frame(MASTER, meaning.address, meaning.function_code)
    assert commands.START.decode(frame.pdu) is None


@pytest.mark.parametrize(("data", "meaning"), _examples(SD1))
def test_a_frame_without_data(data: bytes, meaning: SD1) -> None:
    frame = Frame(*meaning, delimiter=Delimiter.SD1)
    assert _parse(data, meaning) == frame
    assert frame.encode() == data


@pytest.mark.parametrize(("data", "meaning"), _examples(Values))
def test_a_reply_to_a_read_gives_the_values(data: bytes, meaning: Values) -> None:
    record = _record(tuple(meaning.values), meaning.location)
    frame = _parse(data, meaning)
    fields = record.decode_reply(frame.pdu, Location(meaning.location or RAM))
    assert _values(meaning.values, fields) == meaning.values
    assert frame.function_code == record.function_code
    assert frame.pdu.endswith(record.pack(_fields(record, meaning.values)))


@pytest.mark.parametrize(("data", "meaning"), _examples(Result))
def test_a_reply_to_a_command_gives_the_result(data: bytes, meaning: Result) -> None:
    command: Command[Any] = getattr(commands, meaning.command)
    frame = _parse(data, meaning)
    result = command.decode(frame.pdu)
    assert frame.function_code == command.function_code
    if isinstance(result, Version):
        assert str(result) == meaning.result
    elif isinstance(result, RawSignals):
        assert result.sample_time == _near(meaning.result["sample_time"])
        assert result.samples.tolist() == [list(row) for row in meaning.result["samples"]]
        assert result.samples.dtype == (np.int16 if frame.pdu[2] == 2 else np.float32)
    elif isinstance(meaning.result, dict):
        assert vars(result) == _near(meaning.result)
    elif isinstance(meaning.result, str):
        assert result == meaning.result
    else:
        assert result == _near(meaning.result)


@pytest.mark.parametrize(("data", "meaning"), _examples(Targets))
def test_a_target_list_gives_the_targets(data: bytes, meaning: Targets) -> None:
    frame = _parse(data, meaning)
    assert frame.function_code == 0xDA
    assert frame.delimiter == (0x68 if meaning.resolution == 16 else 0xA2)
    decoded = decode_target_list(frame)
    assert decoded.output == meaning.output
    assert decoded.clipping == (meaning.targets is None)
    assert len(decoded.targets) == len(meaning.targets or ())
    for target, (signal, velocity, distance, degrees) in zip(
            decoded.targets, meaning.targets or (), strict=True):
        assert target == _near((signal, velocity, distance, math.radians(degrees)))


@pytest.mark.parametrize(("data", "meaning"), _examples(Targets))
def test_targets_give_the_target_list(data: bytes, meaning: Targets) -> None:
    target_list = TargetList(
        meaning.output,
        tuple(Target(*values, math.radians(degrees))
              for *values, degrees in meaning.targets or ()),
        clipping=meaning.targets is None)
    resolution = Resolution(meaning.resolution)
    pdu = encode_target_list(target_list, resolution,
                             fixed_targets=5 if resolution.fixed_length else 0)
    delimiter = Delimiter.SD2 if resolution.bits == 16 else Delimiter.SD3
    assert Frame(MASTER, meaning.address, 0xDA, pdu, delimiter).encode() == data


# --- the table of settings ---------------------------------------------------------------------


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
def test_every_row_has_a_read_request_a_reply_and_a_write_request(row: Row) -> None:
    name = row.name.format(n=row.instances[0])
    kinds = {type(meaning) for _, _, meaning in ALL_EXAMPLES
             if (isinstance(meaning, Read) and name in meaning.settings)
             or (isinstance(meaning, Values | Write) and name in meaning.values)}
    assert kinds == {Read, Values, Write}


# Table 13: low byte of the sub-function; the high byte is the number of the output.
OUTPUT_SUB_FUNCTIONS = {
    "mode": "00", "rising_delay_cycles": "01", "falling_delay_cycles": "02", "drive": "04",
    "contact": "05", "angle_min_deg": "06", "angle_max_deg": "07", "range_min": "08",
    "range_max": "09", "signal_min_db": "0A", "signal_max_db": "0B", "velocity_min": "0C",
    "velocity_max": "0D", "direction": "0E", "filter_type": "15", "filter_signal": "16",
    "alpha_filter_velocity_percent": "17", "alpha_filter_range_percent": "18",
    "range_min_extended": "19", "range_max_extended": "1A",
}


def test_all_settings_of_all_three_outputs_are_here() -> None:
    with_three = {row.name for row in ROWS if len(row.instances) == 3}
    assert with_three == {"output{n}." + name for name in OUTPUT_SUB_FUNCTIONS}


@pytest.mark.parametrize("output", [1, 2, 3])
@pytest.mark.parametrize(("name", "code"), OUTPUT_SUB_FUNCTIONS.items())
def test_each_output_has_its_sub_function(name: str, code: str, output: int) -> None:
    record = ALL_SETTINGS[f"output{output}.{name}"].record
    assert isinstance(record, IsysRecord)
    body = bytes.fromhex(f"80 01 D4 0{output} {code}")
    assert record.read_request(0x80).encode() == (
        bytes.fromhex("68 05 05 68") + body + bytes((sum(body) % 256, 0x16)))
    assert record.size == 2


# What the manual says on values that may be written, in the unit of the parameter.
LIMITS = {
    "frequency_channel": (1, 65535, ""),  # the model knows the largest one
    "threshold_minimum_db": (-30, 30, "dB"),
    "threshold_sensitivity.left_db": (-30, 30, "dB"),
    "threshold_sensitivity.right_db": (-30, 30, "dB"),
    "ip_destination.target_list_port": (0, 65535, ""),
    "ip_destination.record_port": (0, 65535, ""),
    "line_filter1.frequency": (0, 50000, "Hz"),
    "line_filter2.offset_db": (0, 1000, "dB"),
    "output1.rising_delay_cycles": (0, 65535, ""),
    "output2.falling_delay_cycles": (0, 65535, ""),
    "output1.angle_min_deg": (-3276.8, 3276.7, "deg"),
    "output3.angle_max_deg": (-3276.8, 3276.7, "deg"),
    "output1.range_min": (0, 3276.7, "m"),
    "output1.range_max": (0, 3276.7, "m"),
    "output1.signal_min_db": (0, 3276.7, "dB"),
    "output1.signal_max_db": (0, 3276.7, "dB"),
    "output1.velocity_min": (0, 3276.7, "m/s"),
    "output1.velocity_max": (0, 3276.7, "m/s"),
    "output1.alpha_filter_velocity_percent": (0, 100, "%"),
    "output1.alpha_filter_range_percent": (1, 100, "%"),
    "output1.range_min_extended": (0, 327.67, "m"),
    "output1.range_max_extended": (0, 327.67, "m"),
    "mounting_offset": (0, 4294967.295, "m"),
    "amplifier_potentiometer": (0, 255, ""),
    "output1.temperature_threshold_celsius": (-20, 100, "°C"),
    "output2.temperature_threshold_celsius": (-20, 100, "°C"),
    "output1.temperature_warning_celsius": (-327.68, 327.67, "°C"),
    "output1.range_warning": (0, 429496.7295, "m"),
    "moving_target_sensitivity.near_db": (-3276.8, 3276.7, "dB"),
    "moving_target_sensitivity.main_db": (-3276.8, 3276.7, "dB"),
    "moving_target_sensitivity.long_db": (-3276.8, 3276.7, "dB"),
    "stop_bar_zone1.range_min": (-32768, 32767, "m"),
    "stop_bar_zone2.range_max": (-32768, 32767, "m"),
    "stop_bar_zone1.angle_min_deg": (-3276.8, 3276.7, "deg"),
    "stop_bar_zone2.angle_max_deg": (-3276.8, 3276.7, "deg"),
}

# The words of all other settings, in the order of their codes; the directions begin at 1.
CHOICES = {
    "measurement_mode": {"fast": 0, "multi_target": 1},
    "range_bound": {"50_m": 0, "150_m": 1},  # N13, I34
    "target_list_interface": {"disabled": 0, "spi": 1, "ethernet": 2},
    "led": {"disabled": 0, "enabled": 1, "no_blinking": 2},
    "output1.mode": {"disabled": 0, "digital": 1, "pwm": 2},
    "output1.drive": {"active_low": 0, "active_high": 1, "totem_pole": 2},
    "output1.contact": {"normally_open": 0, "normally_closed": 1},
    "output1.direction": {"approaching": 1, "receding": 2, "both": 3},
    "output1.filter_type": {"highest_amplitude": 0, "mean": 1, "median": 2, "min": 3, "max": 4},
    "output1.filter_signal": {"disabled": 0, "velocity": 1, "range": 2},
    "output1.warning_mode": {"temperature": 1, "range": 2},
}

FLAGS = {"line_filter1.enable", "rcs_output", "target_clustering", "stop_bar_zone1.enable"}
ADDRESSES = {"ip.address", "ip.subnet_mask", "ip.gateway", "ip_destination.address"}


def _instance_1(name: str) -> str:
    return next(row.name.format(n=row.instances[0]) for row in ROWS
                if name in {row.name.format(n=n) for n in row.instances})


def test_every_row_has_its_allowed_values_here() -> None:
    typed = {_instance_1(name) for name in (*LIMITS, *CHOICES, *FLAGS, *ADDRESSES)}
    assert typed == {row.name.format(n=row.instances[0]) for row in ROWS}


@pytest.mark.parametrize(("name", "limits"), LIMITS.items(), ids=LIMITS)
def test_limits_are_those_of_the_manual(name: str, limits: tuple[float, float, str]) -> None:
    setting = ALL_SETTINGS[name]
    assert setting.limits == limits[:2]
    assert setting.unit == limits[2]
    for value in setting.limits:
        assert setting.check(value) == value


@pytest.mark.parametrize(("name", "words"), CHOICES.items(), ids=CHOICES)
def test_choices_are_those_of_the_manual(name: str, words: dict[str, int]) -> None:
    setting = ALL_SETTINGS[name]
    assert setting.choices == words
    for word, code in words.items():
        assert setting.encode(word) == code
        assert setting.decode(code) == word


@pytest.mark.parametrize("name", sorted(FLAGS))
def test_flags_are_true_and_false(name: str) -> None:
    setting = ALL_SETTINGS[name]
    assert (setting.encode(False), setting.encode(True)) == (0, 1)
    assert (setting.decode(0), setting.decode(1)) == (False, True)


def _numeric() -> list[Setting]:
    return [setting for setting in ALL_SETTINGS.values() if setting.kind in (int, float)]


@pytest.mark.parametrize("setting", _numeric(), ids=lambda setting: setting.name)
def test_a_value_out_of_range_says_what_is_allowed(setting: Setting) -> None:
    low, high = setting.limits
    assert low is not None
    assert high is not None
    for value in (low - setting.factor, high + setting.factor):
        with pytest.raises(SettingError) as caught:
            setting.encode(value)
        unit = f" {setting.unit}" if setting.unit else ""
        assert str(caught.value) == (
            f"{setting.name} = {value:.10g}{unit} is out of range, "
            f"allowed is {low:.10g} … {high:.10g}{unit}")


@pytest.mark.parametrize("setting", ALL_SETTINGS.values(), ids=lambda setting: setting.name)
def test_a_value_of_a_wrong_type_says_what_is_expected(setting: Setting) -> None:
    wrong, expected = {
        bool: (1, "true or false"),
        int: (1.5, "a whole number"),
        float: (True, "a number"),
        str: (True, "one of " + ", ".join(setting.choices) if setting.choices else "a text"),
    }[setting.kind]
    with pytest.raises(SettingError) as caught:
        setting.encode(wrong)
    assert str(caught.value) == f"{setting.name} must be {expected}, not {wrong!r}"


@pytest.mark.parametrize("name", sorted(CHOICES))
def test_an_unknown_choice_says_which_there_are(name: str) -> None:
    with pytest.raises(SettingError) as caught:
        ALL_SETTINGS[name].encode("nonsense")
    assert str(caught.value).startswith(
        f"{name} must be one of {', '.join(CHOICES[name])}, not 'nonsense'")


@pytest.mark.parametrize("name", sorted(ADDRESSES))
@pytest.mark.parametrize("value", ["192.168.60", "192.168.60.256", "", "sensor"])
def test_an_address_that_is_none(name: str, value: str) -> None:
    with pytest.raises(SettingError, match=rf"{name} must be an IPv4 address .*not '{value}'"):
        ALL_SETTINGS[name].encode(value)


@pytest.mark.parametrize(("name", "value", "raw"), [
    ("output1.range_max", 5.06, 51),
    ("output1.range_max", 5.04, 50),
    ("output1.range_max", 0.29, 3),
    ("output1.angle_min_deg", -9.96, -100),
    ("output1.angle_min_deg", -9.94, -99),
    ("output1.range_min_extended", 1.019, 102),
    ("output1.range_min_extended", 0.29, 29),  # 0.29 / 0.01 = 28.999...
    ("mounting_offset", 1.2346, 1235),
    ("output1.range_warning", 1.23456, 12346),
    ("output1.temperature_warning_celsius", -0.016, -2),
    ("output1.temperature_threshold_celsius", 54.999, 5500),
    ("stop_bar_zone1.range_max", 49.6, 50),
    ("threshold_minimum_db", -29.96, -300),
    ("output1.range_max", 5, 50),
    ("frequency_channel", 2.0, 2),
])
def test_encoding_rounds_to_the_nearest_step(name: str, value: float, raw: int) -> None:
    assert ALL_SETTINGS[name].encode(value) == raw


def test_tenths_and_hundredths_are_exact() -> None:
    tenths = ALL_SETTINGS["output1.range_max"]
    hundredths = ALL_SETTINGS["output1.range_max_extended"]
    for raw in range(0, 32768, 7):
        assert tenths.encode(raw / 10) == hundredths.encode(raw / 100) == raw
        assert tenths.decode(raw) == raw / 10
        assert hundredths.decode(raw) == raw / 100


@pytest.mark.parametrize("bits", [16, 32])
def test_a_list_of_another_resolution_than_asked_for_is_refused(bits: int) -> None:
    frame = _list_32("0E D3", "00 00 00 00", "00 2B CB 75", "00 00 03 E8")
    if bits == 32:
        assert len(decode_target_list(frame, bits=32).targets) == 1
    else:
        with pytest.raises(FrameError, match="target list of 32 bit instead of 16"):
            decode_target_list(frame, bits=16)


def test_a_code_without_a_name_is_shown() -> None:
    assert ALL_SETTINGS["led"].decode(7) == "code_7"


def test_settings_that_need_the_acquisition_stopped() -> None:
    assert {name for name, setting in ALL_SETTINGS.items() if setting.needs_stop} == {
        "frequency_channel", "measurement_mode", "range_bound", *ADDRESSES,
        "ip_destination.target_list_port", "ip_destination.record_port"}


def test_thresholds_are_saved_with_the_application_settings() -> None:  # errata I16
    saved_with_sensor = {name for name, setting in ALL_SETTINGS.items()
                         if not is_application_setting(setting)}
    assert saved_with_sensor == {
        "frequency_channel", "measurement_mode", "range_bound", "target_list_interface", "led",
        *ADDRESSES,
        "ip_destination.target_list_port", "ip_destination.record_port"}


# --- errata ------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "pdu", "values"), [
    # I14: repeated by 0x0707 to 0x070B in the manual; a device that leaves it out is understood.
    ("output1.temperature_threshold_celsius", "13 88 11 94 00 00",
     {"output1.temperature_threshold_celsius": 50.0,
      "output2.temperature_threshold_celsius": 45.0}),
    ("output1.temperature_warning_celsius", "13 88",
     {"output1.temperature_warning_celsius": 50.0}),
    # I14: not repeated by 0x0828 and others in the manual; a device that does is understood.
    ("moving_target_sensitivity.near_db", "01 00 19", {"moving_target_sensitivity.near_db": 2.5}),
    ("rcs_output", "01 00", {"rcs_output": False}),
    ("target_list_interface", "01 02", {"target_list_interface": "ethernet"}),
    # I25: 13 bytes here, 12 in HAND_TYPED.
    ("ip.address", "01 C0 A8 3C 14 FF FF FF 00 C0 A8 3C 01",
     {"ip.address": "192.168.60.20", "ip.subnet_mask": "255.255.255.0",
      "ip.gateway": "192.168.60.1"}),
])
def test_both_forms_of_a_reply_are_understood(name: str, pdu: str, values: dict[str, Any]) -> None:
    record = _record(tuple(values), EEPROM)
    assert ALL_SETTINGS[name].record == record
    assert _values(values, record.decode_reply(bytes.fromhex(pdu), Location.EEPROM)) == values


@pytest.mark.parametrize(("name", "pdu", "location", "text"), [
    ("rcs_output", "01 01", Location.RAM, "starts with 01 instead of 00: 01 01"),
    ("output2.warning_mode", "00 01 01", Location.RAM, "starts with 00 01 instead of 00 02"),
    ("stop_bar_zone1.enable", "00 00 01", Location.EEPROM, "starts with 00 00 instead of 01 00"),
])
def test_a_reply_for_another_location_or_output_is_refused(
        name: str, pdu: str, location: Location, text: str) -> None:
    record = ALL_SETTINGS[name].record
    assert isinstance(record, IsysRecord)
    with pytest.raises(FrameError, match=rf"0x{record.sub_function:04X} is for another.*{text}"):
        record.decode_reply(bytes.fromhex(pdu), location)


def test_rfe_temperature_takes_the_first_two_bytes() -> None:  # errata I12
    assert commands.READ_RFE_TEMPERATURE.sub_function == b"\x01\x0A"
    for pdu in ("13 06", "13 06 07", "13 06 07 49", "13 06 07 49 00 00"):
        assert commands.READ_RFE_TEMPERATURE.decode(bytes.fromhex(pdu)) == _near(48.70)


def _list_32(signal: str, velocity: str, distance: str, angle: str) -> Frame:
    pdu = bytes.fromhex(f"01 01 {signal} {velocity} {distance} {angle}")
    return Frame(MASTER, 128, 0xDA, pdu, Delimiter.SD3)


def test_angles_are_thousandths_and_hundredths_of_a_degree() -> None:  # errata I5
    fine = decode_target_list(_list_32("00 00", "00 00 00 00", "00 00 00 00", "00 00 03 E8"))
    assert fine.targets[0].angle == _near(math.pi / 180)
    pdu = bytes.fromhex("01 01 00 00 00 00 00 FF 9C")
    coarse = decode_target_list(Frame(MASTER, 128, 0xDA, pdu))
    assert coarse.targets[0].angle == _near(-math.pi / 180)


def test_range_step_of_a_16_bit_list_depends_on_the_model() -> None:  # errata I6
    frame = Frame(MASTER, 128, 0xDA, bytes.fromhex("01 01 26 00 00 01 1F 00 64"))
    assert decode_target_list(frame).targets[0].range == _near(2.87)
    fine = decode_target_list(frame, range_step_16=0.001)
    assert fine.targets[0].range == _near(0.287)
    assert encode_target_list(fine, Resolution.BITS_16, range_step_16=0.001) == frame.pdu
    # 32 bit is in micrometres for all models.
    frame = _list_32("00 00", "00 00 00 00", "00 2B CB 75", "00 00 00 00")
    assert decode_target_list(frame, range_step_16=0.001).targets[0].range == _near(2.870133)


def test_signals_are_unsigned() -> None:  # errata I7
    fine = decode_target_list(_list_32("80 01", "FF FF FF FF", "00 00 00 00", "00 00 00 00"))
    assert fine.targets[0].signal == _near(327.69)
    assert fine.targets[0].velocity == _near(-0.001)
    coarse = decode_target_list(
        Frame(MASTER, 128, 0xDA, bytes.fromhex("01 01 FE FF FF 00 00 00 00")))
    assert coarse.targets[0].signal == 254
    assert coarse.targets[0].velocity == _near(-0.01)


def test_a_new_address_is_one_of_a_sensor() -> None:  # errata I17: it cannot be taken back
    for address in (-1, 0, 1, 256, 65535):
        with pytest.raises(SettingError, match=rf"{address} is out of range, allowed is 2 … 255"):
            commands.change_address(128, address)
    for address in (2, 255):
        assert commands.change_address(128, address).pdu == bytes((0, 1, 0, address))


# --- lengths and limits ------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "length"), [
    ("START", 0),
    ("STOP", 0),
    ("SAVE_ALL_SETTINGS", 0),
    ("RESTORE_FACTORY_SETTINGS", 0),
    ("SET_DEFAULT_TEMPERATURE_THRESHOLDS", 6),
    ("READ_ADDRESS", 2),
    ("READ_FIRMWARE_VERSION", 6),
    ("READ_DSP_HARDWARE_VERSION", 6),
    ("READ_RFE_HARDWARE_VERSION", 6),
    ("READ_BOOTLOADER_VERSION", 6),
    ("READ_PRODUCT_INFORMATION", 2),
    ("READ_DIGITAL_OUTPUTS", 6),
    ("READ_RANGE_LIST", 24),
])
def test_a_result_of_a_wrong_length_is_refused(name: str, length: int) -> None:
    command = getattr(commands, name)
    command.decode(bytes(length))
    for wrong in {max(length - 2, 0), max(length - 1, 0), length + 1, length + 2} - {length}:
        with pytest.raises(FrameError, match=rf"carries {wrong} bytes instead of {length}"):
            command.decode(bytes(wrong))


@pytest.mark.parametrize("name", ["READ_DSP_TEMPERATURE", "READ_RFE_TEMPERATURE"])
@pytest.mark.parametrize("length", [0, 1])
def test_a_short_temperature_is_refused(name: str, length: int) -> None:
    with pytest.raises(FrameError, match=f"temperature of {length} bytes is too short"):
        getattr(commands, name).decode(bytes(length))


@pytest.mark.parametrize("setting", ALL_SETTINGS.values(), ids=lambda setting: setting.name)
def test_a_reply_to_a_read_of_a_wrong_length_is_refused(setting: Setting) -> None:
    record = setting.record
    assert isinstance(record, IsysRecord)
    # Location; location and output for the warnings; location and zone for the stop bar.
    prefix = 0 if not record.has_location else 1 + (
        record.sub_function in (0x0709, 0x070A, 0x070B, 0x08A0, 0x08A1, 0x08A2))
    right = {record.size, record.size + prefix}
    lengths = " or ".join(str(length) for length in sorted(right))
    for wrong in set(range(record.size + prefix + 3)) - right:
        with pytest.raises(FrameError, match=(
                rf"0x{record.sub_function:04X} carries {wrong} bytes instead of {lengths}:")):
            record.decode_reply(bytes(wrong))


@pytest.mark.parametrize(("delimiter", "pdu"), [
    (Delimiter.SD2, ""),
    (Delimiter.SD2, "01"),
    (Delimiter.SD2, "01 01"),  # no target
    (Delimiter.SD2, "01 01" + " 00" * 6),  # one byte less
    (Delimiter.SD2, "01 01" + " 00" * 8),  # one byte more
    (Delimiter.SD2, "01 02" + " 00" * 7),  # one target less
    (Delimiter.SD2, "01 24" + " 00" * 7 * 35),  # 36 targets are too many
    (Delimiter.SD3, "01 01" + " 00" * 7),  # a 16-bit target
    (Delimiter.SD3, "01 01" + " 00" * 13),
    (Delimiter.SD3, "01 02" + " 00" * 14),
    (Delimiter.SD3, "01 24" + " 00" * 14 * 36),
])
def test_a_target_list_of_a_wrong_length_is_refused(delimiter: Delimiter, pdu: str) -> None:
    data = bytes.fromhex(pdu)
    with pytest.raises(FrameError, match=f"target list of {len(data)} bytes"):
        decode_target_list(Frame(MASTER, 128, 0xDA, data, delimiter))


def test_a_fixed_length_list_holds_as_many_targets_as_it_says() -> None:
    pdu = bytes.fromhex("01 01 26 00 00 01 1F 00 64" + " 00" * 14)
    decoded = decode_target_list(Frame(MASTER, 128, 0xDA, pdu))
    assert decoded.targets == (_near((38, 0, 2.87, math.radians(1))),)
    assert encode_target_list(decoded, Resolution.BITS_16_FIXED, fixed_targets=3) == pdu


def test_targets_beyond_the_wire_are_limited() -> None:
    far = TargetList(1, (Target(300.0, -400.0, 400.0, 7.0), Target(-1.0, 0.0, 0.0, 0.0)))
    assert encode_target_list(far, Resolution.BITS_16) == bytes.fromhex(
        "01 02 FF 80 00 7F FF 7F FF 00 00 00 00 00 00 00")


@pytest.mark.parametrize("pdu", [
    "",
    "01 01 02 00 00 00",
    "01 01 02 00 00 00 0A" + " 00" * 31,
    "01 01 02 00 00 00 0A" + " 00" * 33,
    "00 01 02 00 00 00 0A",  # no signal
    "01 00 02 00 00 00 0A",  # no sample
    "01 01 03 00 00 00 0A" + " 00" * 48,  # three bytes a sample
    "01 01 04 00 00 00 0A" + " 00" * 32,
])
def test_raw_signals_of_a_wrong_length_are_refused(pdu: str) -> None:
    data = bytes.fromhex(pdu)
    with pytest.raises(FrameError, match=f"raw signals of {len(data)} bytes"):
        commands.READ_RAW.decode(data)


def test_length_of_raw_signals_counts_blocks_of_16_samples() -> None:  # errata I18
    samples = commands.READ_RAW.decode(
        bytes.fromhex("01 80 02 00 00 00 01") + bytes(2 * 2048)).samples
    assert samples.shape == (1, 2048)


def test_a_frame_is_shown_in_hexadecimal() -> None:
    assert "01 80 D2 00 80" in str(Frame(1, 0x80, 0xD2, b"\x00\x80"))
    assert "00 00 00" in str(Frame(1, 0x80, 0xD2, bytes(300)))  # one that cannot be sent too


def test_a_frame_that_is_too_long_is_refused() -> None:
    assert len(Frame(MASTER, 128, 0xD0, bytes(252)).encode()) == 261
    with pytest.raises(ValueError, match=r"253 bytes does not fit .* at most 252"):
        Frame(MASTER, 128, 0xD0, bytes(253)).encode()
    with pytest.raises(ValueError, match="cannot carry a PDU"):
        Frame(MASTER, 128, 0xD0, b"\0", Delimiter.SD1).encode()


@pytest.mark.parametrize(("version", "text", "number"), [
    (Version(1, 3, 309), "1.309", 1.309),
    (Version(1, 3, 31), "1.031", 1.031),
    (Version(0, 2, 36), "0.36", 0.36),
    (Version(1, 4, 0), "1.0000", 1.0),
    (Version(2, 0, 5), "2.5", 2.5),
    (Version(65535, 5, 65535), "none", 0.0),
])
def test_versions(version: Version, text: str, number: float) -> None:
    assert str(version) == text
    assert version.number == number


@pytest.mark.parametrize(("pdu", "name"), [
    (b"iSYS-4001\0", "iSYS-4001"),
    (b"iSYS-6003 123", "iSYS-6003 123"),
    (b"iSYS-4001 \0junk\xff", "iSYS-4001"),
    (b"\xffSYS\0", "�SYS"),
    (b"", ""),
])
def test_device_names_end_at_the_first_zero(pdu: bytes, name: str) -> None:
    assert commands.READ_DEVICE_NAME.decode(pdu) == name
