# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Commands and settings of the ICOtronic system against hand-made messages."""

from __future__ import annotations

import dataclasses
import math
import re
from typing import Any

import pytest

from bench.examples.icotronic import ERRORS, EXAMPLES, SETTINGS, STH, STU, Example, SettingExample
from driver_common.errors import FrameError, RefusedError, SettingError
from driver_common.settings import read_settings, write_settings
from icotronic_driver import commands
from icotronic_driver import settings as rows
from icotronic_driver.commands import COMMANDS, IcotronicRecord
from icotronic_driver.request import Command, Request
from icotronic_driver.settings import nearest_adc_configuration
from icotronic_driver.streaming import StreamFormat
from icotronic_driver.values import AdcConfiguration, UsedSensors


def request_of(example: Example) -> Request[Any]:
    """Return the request that the driver sends to say this."""
    name, _, index = example.command.partition("[")
    command = getattr(commands, name)
    if index:
        command = command[int(index.rstrip("]"))]
    arguments = example.arguments
    if name == "WRITE_ADC":
        arguments = (AdcConfiguration(*arguments),)
    elif name == "WRITE_USED_SENSORS":
        arguments = (UsedSensors(*arguments),)
    elif name.startswith("START_"):
        arguments = (StreamFormat(*arguments),)
    if isinstance(command, Command):
        assert command.section == example.section
        return command.request(example.node, *arguments)
    return command(example.node, *arguments)


def _plain(result: Any) -> Any:
    return dataclasses.astuple(result) if dataclasses.is_dataclass(result) else result


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda each: f"{each.section} {each.command}")
def test_messages(example: Example) -> None:
    request = request_of(example)
    assert request.frame.identifier.encode() == example.request_id
    assert request.frame.data == bytes.fromhex(example.request)
    answer = bytearray.fromhex(example.answer)  # what python-can gives
    assert request.is_answered_by(example.answer_id, answer)
    assert _plain(request.result(example.answer_id, answer)) == example.result


def test_every_command_has_an_example() -> None:
    shown = {(each.request_id >> 12, request_of(each).name) for each in EXAMPLES}
    for command in COMMANDS.values():
        assert (command.block << 10 | command.block_command << 2 | 2, command.name) in shown
    assert {each.request_id >> 22 for each in EXAMPLES} == {0x00, 0x04, 0x08, 0x28, 0x3D, 0x3E,
                                                            0x3F}
    subcommands = {int(each.request[:2], 16) for each in EXAMPLES if each.section == "10.2.6"}
    assert subcommands == set(range(1, 19))


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda each: f"{each.section} {each.command}")
def test_answers_of_others_do_not_match(example: Example) -> None:
    request = request_of(example)
    answer = bytes.fromhex(example.answer)
    for other in (example.request_id, example.answer_id ^ 0x4000, example.answer_id ^ 0x0C0):
        assert not request.is_answered_by(other, answer)


def _answers(command: str, argument: Any, answer: str) -> bool:
    request = getattr(commands, command).request(STH, *argument)
    return bool(request.is_answered_by(request.acknowledgement_id, bytes.fromhex(answer)))


def test_answers_match_by_what_they_repeat() -> None:  # errata C5
    assert not _answers("READ_RSSI", (1,), "0C 02 C6 00 00 00 00 00")
    assert not _answers("READ_RSSI", (1,), "05 01 C6 00 00 00 00 00")
    assert _answers("READ_MAC", (1,), "11 07 81 DE 01 D7 6B 08")
    assert not _answers("READ_MAC", (1,), "12 01 81 DE 01 D7 6B 08")
    assert _answers("WRITE_NAME_2", (1, b""), "04 00 00 00 00 00 00 00")
    assert _answers("WRITE_REDUCED_ENERGY", (1, 1), "63 63 E8 03 00 00 40 06")
    assert _answers("WRITE_LOWEST_ENERGY", (1, 1), "00 00 E8 03 00 00 40 06")
    assert not _answers("READ_EEPROM", (4, 0, 4), "04 04 04 00 00 00 00 00")
    assert not _answers("READ_EEPROM", (4, 0, 4), "05 00 04 00 00 00 00 00")
    assert not _answers("READ_CALIBRATION_K", (0, 1), "00 02 00 00 00 00 00 00")
    # A data frame that is still on its way does not answer the stop, nor a single request.
    assert not _answers("STOP_ACCELERATION", (), "A2 00 01 80 02 80 03 80")
    assert _answers("STOP_ACCELERATION", (), "80")
    assert _answers("STOP_ACCELERATION", (), "20")
    single = commands.read_acceleration(STH, (True, False, False))
    assert not single.is_answered_by(0x1000_04F, bytes.fromhex("A2 00 01 80 02 80 03 80"))


@pytest.mark.parametrize(("number", "words"), ERRORS.items())
def test_errors_in_words(number: str, words: str) -> None:  # section 10.9, errata C12
    request = commands.WRITE_EEPROM.request(STU, 4, 0, b"\x01")
    answer = bytes.fromhex(number + " 00" * 7)
    assert request.error_id == 0xF405_44F
    assert request.is_answered_by(0xF405_44F, answer)
    with pytest.raises(RefusedError, match=f"STU 1 cannot write the EEPROM: {words}"):
        request.result(0xF405_44F, answer)


def test_error_of_the_state_command() -> None:  # section 10.2.3.4
    request = commands.WRITE_STATE.request(STH, commands.NetworkState.STARTUP)
    for number, words in (("01", "set state not available"), ("02", "wrong subscriber")):
        with pytest.raises(RefusedError, match=words):
            request.result(0x0009_04F, bytes.fromhex("00" + number + "00" * 6))
    with pytest.raises(RefusedError, match="without a number"):
        request.result(0x0009_04F, b"")


_WRONG = [  # command, arguments, answer
    ("READ_STATE", (), ""), ("READ_STH_STATUS", (), "0A 00 00 00"),
    ("READ_STU_ERRORS", (), "00" * 9), ("COUNT_DEVICES", (), "02 00 78 00 00 00 00 00"),
    ("COUNT_DEVICES", (), "02 00 31"), ("READ_RSSI", (0,), "0C 00"),
    ("READ_NAME_1", (0,), "05 00 41"), ("READ_MAC", (0,), "11 00 81 DE 01 D7 6B"),
    ("READ_REDUCED_ENERGY", (), "0D FF 00"), ("ACTIVATE_BLUETOOTH", (), "01"),
    ("READ_POWER_CYCLES", (), "00 00 00 01"), ("READ_UNDER_VOLTAGES", (), "00 00"),
    ("READ_PRODUCTION_DATE", (), "32 30"), ("READ_ADC", (), "00 02 04 06"),
    ("READ_ADC", (), "00 02 0A 06 42 00 00 00"), ("READ_ADC", (), "00 02 04 0D 42 00 00 00"),
    ("READ_USED_SENSORS", (), "00 01 02 03"), ("READ_CALIBRATION_K", (0, 1), "00 01 00 00"),
    ("READ_LED", (), "01 00 03 00 00 00 00 00"), ("READ_TEMPERATURE", (), "E0 01 01 19"),
    ("READ_EEPROM", (0, 0, 4), "00 00 04 00 01"), ("READ_EEPROM", (0, 0, 4), "00" * 8),
    ("READ_EEPROM_WRITES", (), ""), ("READ_GTIN", (), "00" * 7),
    ("READ_HARDWARE_VERSION", (), "01 04 00"), ("TEST_SIGNAL", (1,), "01 00"),
]


@pytest.mark.parametrize(("command", "arguments", "answer"), _WRONG)
def test_wrong_answers(command: str, arguments: Any, answer: str) -> None:
    request = getattr(commands, command).request(STH, *arguments)
    with pytest.raises(FrameError, match=f"^{re.escape(request.name)}: "):
        request.result(request.acknowledgement_id, bytes.fromhex(answer))


def test_wrong_answer_to_a_single_request() -> None:
    request = commands.read_acceleration(STH, (True, False, False))
    with pytest.raises(FrameError, match="read single values: answer to a single request of x"):
        request.result(request.acknowledgement_id, bytes.fromhex("21 00 34"))


@pytest.mark.parametrize(("command", "arguments", "words"), [
    ("WRITE_ADC", (AdcConfiguration(prescaler=0),), "1 … 127"),
    ("WRITE_ADC", (AdcConfiguration(prescaler=128),), "no prescaler 128"),
    ("WRITE_ADC", (AdcConfiguration(acquisition_time=5),), "1, 2, 3, 4, 8, 16"),
    ("WRITE_ADC", (AdcConfiguration(oversampling_rate=3),), "no oversampling rate 3"),
    ("WRITE_ADC", (AdcConfiguration(reference_voltage=3.0),), "no reference voltage 3"),
    ("WRITE_USED_SENSORS", (UsedSensors(1, 2, 256),), "0 … 255"),
    ("WRITE_CALIBRATION_K", (0, 1, math.nan), "finite"),
    ("WRITE_REDUCED_ENERGY", (0, 1), "more than 0"),
    ("WRITE_LOWEST_ENERGY", (1, 41), "40.959375"),
    ("CONNECT_MAC", ("08:6B:D7",), "not a MAC address"),
    ("CONNECT_MAC", ("08:6B:D7:01:DE:XY",), "not a MAC address"),
    ("READ_EEPROM", (0, 0, 5), "1 … 4"), ("READ_EEPROM", (0, 254, 4), "256"),
    ("READ_EEPROM", (256, 0, 1), "page 256"), ("WRITE_EEPROM", (0, 0, b""), "0 bytes"),
    ("TEST_SIGNAL", (3,), "test signal 3"), ("MEASURE", (0, 1, 3.2), "reference voltage 3.2"),
])
def test_what_cannot_be_asked(command: str, arguments: Any, words: str) -> None:
    with pytest.raises(SettingError, match=words):
        getattr(commands, command).request(STH, *arguments)


def test_names() -> None:  # errata C13
    assert commands.encode_name("Test-STH") == (b"Test-S", b"TH")
    assert commands.encode_name("") == (bytes(6), bytes(2))
    assert commands.decode_name(b"Halle\xc3", b"\x9f1") == "Halleß1"
    assert commands.decode_name(b"AB\0\0\0\0", bytes(2)) == "AB"
    for name in ("Test-STH1", "Tür-Nord", "A\0B", "\udcf0"):
        with pytest.raises(SettingError, match="at most 8 bytes"):
            commands.encode_name(name)


@pytest.mark.parametrize(("configuration", "rate"), [
    (AdcConfiguration(), 9523.8), (AdcConfiguration(1, 8, 64), 14285.7),
    (AdcConfiguration(8, 8, 64), 3174.6), (AdcConfiguration(16, 8, 128), 840.3),
    (AdcConfiguration(1, 1, 1), 1371428.6)])
def test_sample_rate(configuration: AdcConfiguration, rate: float) -> None:  # 10.5.1.1.1
    assert configuration.sample_rate == pytest.approx(rate, abs=0.05)


@pytest.mark.parametrize("recommended", [  # field note N8
    (9524, 2, 8, 64), (9375, 3, 3, 64), (8889, 2, 32, 32), (6897, 2, 16, 64), (4762, 2, 8, 128),
    (3448, 2, 16, 128), (2381, 2, 8, 256), (1724, 2, 16, 256), (1190, 2, 8, 512),
    (862, 2, 16, 512), (595, 2, 8, 1024), (431, 2, 16, 1024), (298, 2, 8, 2048),
    (216, 2, 16, 2048), (149, 2, 8, 4096), (108, 2, 16, 4096)])
def test_recommended_rates_give_the_recommended_settings(recommended: tuple[int, ...]) -> None:
    rate, *settings = recommended
    assert nearest_adc_configuration(rate) == AdcConfiguration(*settings)


@pytest.mark.parametrize("rate", [100.0, 500.0, 1000.0, 2500.0, 5000.0, 12345.0])
def test_of_the_settings_near_a_rate_the_one_with_the_least_noise_is_taken(rate: float) -> None:
    found = nearest_adc_configuration(rate)
    assert found.prescaler > 1
    assert found.sample_rate == pytest.approx(rate, rel=0.005)
    more = 2 * found.oversampling_rate
    assert more > 4096 or not any(
        AdcConfiguration(prescaler, acquisition, more).sample_rate
        == pytest.approx(rate, rel=0.005)
        for prescaler in range(2, 128) for acquisition in (1, 2, 3, 4, 8, 16, 32, 64, 128, 256))


def test_nearest_adc_configuration() -> None:
    assert nearest_adc_configuration(1000).sample_rate == pytest.approx(1000, rel=0.005)
    assert nearest_adc_configuration(1000, 1.8).reference_voltage == 1.8
    assert nearest_adc_configuration(0) == AdcConfiguration(127, 256, 4096)
    assert nearest_adc_configuration(1e9) == AdcConfiguration(2, 1, 1)
    for rate in (50.0, 440.0, 5000.0, 12345.0, 40000.0):
        assert nearest_adc_configuration(rate).sample_rate == pytest.approx(rate, rel=0.01)


# --- settings ---

class Device:
    """A device which answers what the example says, and writes down what it is asked."""

    def __init__(self, examples: list[SettingExample]) -> None:
        self.answers = {(each.command_id, bytes.fromhex(asked)): bytes.fromhex(answer)
                        for each in examples for asked, answer, _ in each.exchanges}
        self.written: list[tuple[int, str]] = []

    def read_record(self, record: Any) -> tuple[Any, ...]:
        answers = []
        for request in record.read_requests(STH):
            command_id = request.frame.identifier.encode() >> 12
            answer = self.answers[command_id, request.frame.data]
            assert request.is_answered_by(request.acknowledgement_id, answer)
            answers.append(request.result(request.acknowledgement_id, answer))
        return record.decode_answers(answers)

    def write_record(self, record: Any, values: Any) -> None:
        for request in record.write_requests(STH, values):
            self.written.append((request.frame.identifier.encode() >> 12,
                                 request.frame.data.hex(" ").upper()))


@pytest.mark.parametrize("example", SETTINGS, ids=lambda each: next(iter(each.values)))
def test_settings(example: SettingExample) -> None:
    settings = [rows.SETTINGS[name] for name in example.values]
    device = Device(SETTINGS)
    assert read_settings(device, settings) == example.values
    record = settings[0].record
    device.write_record(record, [setting.encode(example.values[setting.name])
                                 for setting in settings])
    assert device.written == [(example.command_id, asked) for _, _, asked in example.exchanges]
    assert isinstance(record, IcotronicRecord)
    assert settings == [row for row in rows.ROWS if row.record == record]


def test_every_setting_has_an_example() -> None:
    assert [name for each in SETTINGS for name in each.values] == list(rows.SETTINGS)
    assert all(setting.description and setting.section for setting in rows.ROWS)


def test_what_the_device_has_already_is_not_written() -> None:
    device = Device(SETTINGS)
    assert write_settings(device, rows.SETTINGS, {"adc.prescaler": 2, "led": "disabled"}) == {
        "adc.prescaler": 2, "led": "disabled"}
    assert device.written == []


@pytest.mark.parametrize(("name", "value", "words"), [
    ("name", "Test-STH1", "at most 8 bytes"), ("name", True, "a text"),
    ("adc.prescaler", 0, "1 … 127"), ("adc.prescaler", 128, "1 … 127"),
    ("adc.acquisition_time", 5, "4 cycles and 8 cycles"), ("adc.oversampling_rate", 8192, "4096"),
    ("adc.reference_voltage", 3.0, "one of 1.25 V, 1.65 V"),
    ("adc.reference_voltage", 7.0, "out of range"), ("used_sensor.x", 0, "1 … 255"),
    ("reduced_energy.sleep_time", 0.0, "0.001"), ("lowest_energy.advertisement_time", 41, "40.95"),
    ("calibration.acceleration_x.slope", math.nan, "finite"), ("led", "on", "enabled, disabled"),
])
def test_values_that_no_sensor_takes(name: str, value: Any, words: str) -> None:
    with pytest.raises(SettingError, match=words):
        rows.SETTINGS[name].encode(value)


def test_values_are_rounded_to_the_resolution() -> None:
    assert rows.SETTINGS["reduced_energy.advertisement_time"].check(1) == 1.0
    assert rows.SETTINGS["reduced_energy.advertisement_time"].check(0.9999) == 1.0
    assert rows.SETTINGS["lowest_energy.sleep_time"].check(0.0014) == 0.001
    assert rows.SETTINGS["calibration.acceleration_x.slope"].check(0.1) == 0.1
