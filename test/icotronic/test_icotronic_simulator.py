# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The simulated ICOtronic system: without I/O by its own clock, and as a socketcand server."""

from __future__ import annotations

import argparse
import contextlib
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

import can
import numpy as np
import pytest
from test_icotronic_commands import request_of

from bench.examples.icotronic import EXAMPLES, SELF, STH, STU, Example
from driver_common.errors import (
    DriverError,
    LinkError,
    RefusedError,
    SettingError,
    WrongDeviceError,
)
from driver_common.simulator import bus as simulated_bus
from driver_common.simulator.bus import CanFrame
from icotronic_driver import commands
from icotronic_driver.eeprom import STH_EEPROM
from icotronic_driver.request import Request
from icotronic_driver.simulator.line import SimulatedIcotronic, SimulatedNetwork, simulated_network
from icotronic_driver.simulator.scene import vibration
from icotronic_driver.simulator.sth import SimulatedSth
from icotronic_driver.simulator.stu import SUPERVISION_TIME
from icotronic_driver.streaming import StreamDecoder, StreamFormat, stream_format
from icotronic_driver.values import (
    AdcConfiguration,
    CalibrationElement,
    CalibrationMethod,
    CodeLocation,
    NetworkState,
    UsedSensors,
)
from sensor_tools import simulate_icotronic

T = TypeVar("T")

X, XZ, XYZ = (True, False, False), (True, False, True), (True, True, True)
DATA = 0x0100_004F
DEADLINE = 60.0  # s; far more than anything takes, also on a busy machine


class Host:
    """A host on a bus without I/O; its clock runs only here."""

    def __init__(self, *names: str, **options: Any) -> None:
        self.sensors = [SimulatedSth(name, f"08:6B:D7:01:DE:{0x81 + index:02X}", **options)
                        for index, name in enumerate(names or ("Test-STH",))]
        self.network = SimulatedNetwork(self.sensors)
        self.now = time.monotonic()
        self.heard: list[tuple[float, CanFrame]] = []

    def wait(self, seconds: float) -> None:
        """Let time pass, in steps such as the server's."""
        end = self.now + seconds
        while self.now < end:
            self.now = min(self.now + 0.002, end)
            self.heard += self.network.poll(self.now)

    def data(self) -> list[tuple[float, bytes]]:
        """Return the data frames that were heard since the last call."""
        frames = [(due, frame.data) for due, frame in self.heard if frame.can_id == DATA]
        self.heard.clear()
        return frames

    def send(self, request: Request[Any]) -> None:
        self.network.receive(CanFrame(request.frame.identifier.encode(), request.frame.data),
                             self.now)

    def ask(self, request: Request[T], within: float = 0.05) -> T:
        start = len(self.heard)
        self.send(request)
        self.wait(within)
        for _, frame in self.heard[start:]:
            if request.is_answered_by(frame.can_id, frame.data):
                return request.result(frame.can_id, frame.data)
        raise TimeoutError(request.name)

    def connect(self, number: int = 0) -> Host:
        self.ask(commands.ACTIVATE_BLUETOOTH.request(STU))
        assert self.ask(commands.COUNT_DEVICES.request(STU)) == len(self.sensors)
        assert self.ask(commands.CONNECT_NUMBER.request(STU, number))
        assert self.ask(commands.CHECK_CONNECTED.request(STU))
        return self

    def stream(self, format: StreamFormat, seconds: float) -> StreamDecoder:
        """Stream for a while and return what the decoder counted."""
        self.send(commands.START_ACCELERATION.request(STH, format))
        self.wait(seconds)
        self.ask(commands.STOP_ACCELERATION.request(STH), 0.4)
        rate = self.sensors[0].adc.sample_rate
        decoder = StreamDecoder(format, format.frame_rate(rate))
        decoder.decode(self.data())
        return decoder


# --- connecting ---

def test_sensors_are_found_and_listed() -> None:
    host = Host("Test-STH", "Second")
    assert host.ask(commands.COUNT_DEVICES.request(STU)) == 0  # Bluetooth is off
    assert host.ask(commands.READ_MAC.request(STU, 0)) == "00:00:00:00:00:00"
    host.ask(commands.ACTIVATE_BLUETOOTH.request(STU))
    host.wait(0.1)
    assert host.ask(commands.COUNT_DEVICES.request(STU)) == 2
    listed = [(commands.decode_name(host.ask(commands.READ_NAME_1.request(STU, number)),
                                    host.ask(commands.READ_NAME_2.request(STU, number))),
               host.ask(commands.READ_MAC.request(STU, number)),
               host.ask(commands.READ_RSSI.request(STU, number))) for number in (0, 1)]
    assert listed == [("Test-STH", "08:6B:D7:01:DE:81", -52), ("Second", "08:6B:D7:01:DE:82", -52)]
    assert host.ask(commands.READ_NAME_1.request(STU, SELF)) == b"Valeri"
    assert host.ask(commands.READ_NAME_1.request(STU, 2)) == bytes(6)


def test_connecting_by_number() -> None:
    host = Host("Test-STH", "Second")
    with pytest.raises(TimeoutError):
        host.ask(commands.READ_ADC.request(STH))
    host.connect(1)
    assert host.network.stu.connected is host.sensors[1]
    assert host.ask(commands.READ_NAME_1.request(STH, 99)) == b"Second"
    assert host.ask(commands.READ_STU_STATUS.request(STU)).radio_connected
    host.ask(commands.DEACTIVATE_BLUETOOTH.request(STU))
    assert not host.ask(commands.CHECK_CONNECTED.request(STU))
    with pytest.raises(TimeoutError):
        host.ask(commands.READ_ADC.request(STH))


def test_connecting_by_mac_address_says_so_once() -> None:
    host = Host("Test-STH", "Second")
    request = commands.CONNECT_MAC.request(STU, "08:6B:D7:01:DE:82")
    host.ask(commands.ACTIVATE_BLUETOOTH.request(STU))
    host.ask(commands.COUNT_DEVICES.request(STU))
    assert [host.ask(request) for _ in range(3)] == ["00:00:00:00:00:00", "08:6B:D7:01:DE:82",
                                                     "00:00:00:00:00:00"]
    assert host.network.stu.connected is host.sensors[1]


def test_what_an_earlier_activation_showed_can_be_connected_at_once() -> None:  # field note N4
    host = Host()
    by_number = commands.CONNECT_NUMBER.request(STU, 0)
    host.ask(commands.ACTIVATE_BLUETOOTH.request(STU))
    assert not host.ask(commands.CONNECT_NUMBER.request(STU, 1))
    host.wait(0.1)
    host.ask(commands.DEACTIVATE_BLUETOOTH.request(STU))
    assert not host.ask(by_number)
    for request in (by_number, commands.CONNECT_MAC.request(STU, host.sensors[0].mac)):
        host.ask(commands.ACTIVATE_BLUETOOTH.request(STU))
        host.ask(request)
        host.wait(0.1)
        assert host.ask(commands.CHECK_CONNECTED.request(STU))
        host.ask(commands.DEACTIVATE_BLUETOOTH.request(STU))


def test_connecting_may_need_several_attempts() -> None:
    host = Host()
    host.network.faults.refused_connects = 2
    host.ask(commands.ACTIVATE_BLUETOOTH.request(STU))
    host.ask(commands.COUNT_DEVICES.request(STU))
    for connected in (False, False, True):
        assert host.ask(commands.CONNECT_NUMBER.request(STU, 0))
        assert host.ask(commands.CHECK_CONNECTED.request(STU)) is connected


def test_a_sleeping_sensor_is_found_later() -> None:
    host = Host()
    host.sensors[0].advertises_since = host.now - 400.0  # sleep time 1 is 300 s
    host.ask(commands.ACTIVATE_BLUETOOTH.request(STU))
    host.wait(1.1)
    assert host.ask(commands.COUNT_DEVICES.request(STU)) == 0
    host.wait(0.2)  # advertisement time 1 is 1.25 s
    assert host.ask(commands.COUNT_DEVICES.request(STU)) == 1
    assert host.sensors[0].advertisement_interval(host.now + 300000) == 2.5


def test_a_sensor_that_walks_away_and_returns() -> None:
    host = Host().connect()
    host.send(commands.START_ACCELERATION.request(STH, stream_format(X)))
    host.wait(0.3)
    host.sensors[0].in_range = False
    host.wait(0.1)
    host.sensors[0].in_range = True  # soon enough: only frames are lost
    host.wait(0.3)
    decoder = StreamDecoder(stream_format(X), 38.4e6 / 4032 / 3)
    decoder.decode(host.data())
    assert decoder.statistics.lost == host.network.lost == pytest.approx(317, abs=8)
    host.sensors[0].in_range = False
    host.wait(SUPERVISION_TIME + 0.1)
    assert not host.ask(commands.CHECK_CONNECTED.request(STU))
    assert host.ask(commands.COUNT_DEVICES.request(STU)) == 0
    host.sensors[0].in_range = True
    host.wait(0.1)
    host.connect()
    assert host.sensors[0].streams == {}


# --- commands ---

_NOT_HERE = ("READ_TOOL_RFID", "WRITE_LED")  # that of the last example is one that no sensor has


@pytest.mark.parametrize("example", [each for each in EXAMPLES if each.command not in _NOT_HERE],
                         ids=lambda each: f"{each.section} {each.command}")
def test_every_command_is_known(example: Example) -> None:
    host = Host("Test-STH", "Second", can_fd=True).connect()
    request = request_of(example)
    wanted = request.result(example.answer_id, bytes.fromhex(example.answer))
    assert type(host.ask(request)) is type(wanted)


@pytest.mark.parametrize("example", [each for each in EXAMPLES if each.command in _NOT_HERE],
                         ids=lambda each: f"{each.section} {each.command}")
def test_commands_of_other_sensors(example: Example) -> None:
    host = Host().connect()
    if example.arguments == (False,):
        assert host.ask(request_of(example)) is False
    else:
        with pytest.raises(RefusedError, match="not available"):
            host.ask(request_of(example))


def _answer(host: Host, request: Request[Any]) -> str:
    host.heard.clear()
    host.send(request)
    host.wait(0.02)
    ((_, frame),) = host.heard
    return f"{frame.can_id:07X} {frame.data.hex(' ').upper()}"


def test_answers_that_do_not_repeat_the_request() -> None:  # errata C5
    host = Host().connect()
    assert _answer(host, commands.WRITE_NAME_1.request(STH, SELF, b"ABCDEF")) == (
        "002C04F 03 FF 41 42 43 44 45 46")
    assert _answer(host, commands.WRITE_NAME_2.request(STH, SELF, b"GH")) == (
        "002C04F 04 00 47 48 00 00 00 00")
    assert host.sensors[0].name == "ABCDEFGH"
    assert _answer(host, commands.WRITE_REDUCED_ENERGY.request(STH, 1.0, 1.0)) == (
        "002C04F 0D 00 E8 03 00 00 40 06")
    assert _answer(host, commands.WRITE_LOWEST_ENERGY.request(STH, 2.0, 2.0)) == (
        "002C04F 0F 00 D0 07 00 00 80 0C")
    assert host.sensors[0].eeprom["Sleep Time 2"] == 2.0
    assert _answer(host, commands.READ_MAC.request(STH, SELF)) == "002C04F 11 00 81 DE 01 D7 6B 08"
    assert _answer(host, commands.RESET.request(STU)) == "000444F "


def test_errors() -> None:
    host = Host().connect()
    unknown = commands.RESET.with_payload(STH, b"", bytes)
    frame = CanFrame(0x0006_3C1 | 1 << 22, b"")  # a block that no node has
    host.network.receive(frame, host.now)
    host.wait(0.02)
    assert host.heard[-1][1] == CanFrame(0x0405_04F,
                                         b"\x01" + bytes(7))
    assert unknown.error_id == 0x0005_04F
    refusals = [
        (commands.WRITE_USED_SENSORS.request(STH, UsedSensors(11, 1, 1)), "not available"),
        (commands.READ_EEPROM.with_payload(STH, b"\0\0\5", bytes), "unsupported format"),
        (commands.READ_EEPROM.with_payload(STH, b"\0\xff\2", bytes), "unsupported format"),
        (commands.WRITE_ADC.with_payload(STH, b"\x80\0\4\6\x42", bytes), "unsupported format"),
        (commands.START_ACCELERATION.request(STH, StreamFormat(X, 6)), "unsupported format"),
        (commands.START_ACCELERATION.request(STH, StreamFormat(XYZ, 1, 3)), "unsupported format"),
        (commands.WRITE_STATE.request(STH, NetworkState.STARTUP), "not available"),
        (commands.WRITE_STATE.request(STU, NetworkState.OPERATING, CodeLocation.BOOTLOADER),
         "wrong subscriber"),
        (commands.READ_STH_STATUS.with_payload(STH, bytes(4) + b"\xff", bytes), "error 01"),
        (commands.READ_CALIBRATION_K.request(
            STH, 99, 1), "not available"),  # type: ignore[arg-type]
    ]
    for request, words in refusals:
        with pytest.raises(RefusedError, match=words):
            host.ask(request)
    host.sensors[0].refuse.add((0x28, 0x00))
    with pytest.raises(RefusedError, match="not available"):
        host.ask(commands.READ_ADC.request(STH))


def test_broadcasts() -> None:
    host = Host().connect()
    host.heard.clear()
    for receiver in (0, 31):
        host.network.receive(CanFrame(0x000A_3C0 | receiver, b"\0"), host.now)
        host.wait(0.02)
    assert sorted(frame.can_id for _, frame in host.heard) == [0x0008_04F, 0x0008_44F]


def test_another_host_gets_its_own_answers() -> None:
    host = Host().connect()
    host.heard.clear()
    host.network.receive(CanFrame(0x000A_401, b"\0"), host.now)  # SPU 2 asks
    host.wait(0.02)
    assert [frame.can_id for _, frame in host.heard] == [0x0008_050]


def test_what_is_no_request_is_ignored() -> None:
    host = Host().connect()
    host.heard.clear()
    for frame in (CanFrame(0x3C1, b"\0", extended=False), CanFrame(0x1000_63C1, b"\0"),
                  CanFrame(0x0008_3C1, b"\0"), CanFrame(0x000A_3C5, b"\0"),
                  CanFrame(0x000A_3C1, b"\0", error=True)):
        host.network.receive(frame, host.now)
    host.wait(0.05)
    assert host.heard == []


def test_eeprom_lock_and_counter() -> None:
    host = Host().connect()
    sensor = host.sensors[0]
    host.ask(commands.WRITE_EEPROM.request(STH, 4, 0, b"\x2a"))  # read-only, but not locked
    host.ask(commands.WRITE_EEPROM.request(STH, 10, 3, b"abcd"))  # a page without fields
    assert host.ask(commands.READ_EEPROM.request(STH, 10, 3, 4)) == b"abcd"
    assert host.ask(commands.READ_GTIN.request(STH)) == 42
    assert host.ask(commands.READ_EEPROM_WRITES.request(STH)) == 2
    host.ask(commands.WRITE_EEPROM.request(STH, 0, 0, b"\xca"))
    for offset in (0, 7, 32, 255):
        with pytest.raises(RefusedError, match="write not allowed"):
            host.ask(commands.WRITE_EEPROM.request(STH, 4, offset, b"\1"))
    host.ask(commands.WRITE_EEPROM.request(STH, 4, 24, b"Rele"))
    assert str(sensor.eeprom["Release Name"]).startswith("Rele")
    assert host.ask(commands.READ_EEPROM_WRITES.request(STH)) == 4


def test_an_eeprom_that_was_never_initialized_gets_the_defaults() -> None:  # section 8.3.1.1.1
    host = Host("Other").connect()
    sensor = host.sensors[0]
    sensor.eeprom["EEPROM Status"] = 0xFF
    sensor.eeprom["Sleep Time 1"] = 1.0
    host.ask(commands.RESET.request(STH))
    assert (sensor.name, sensor.eeprom["Sleep Time 1"], sensor.eeprom["EEPROM Status"]) == (
        "Tanja", 300.0, 0xAC)


def test_calibration_lies_in_the_eeprom() -> None:
    host = Host().connect()
    field = STH_EEPROM["Acceleration Z: Offset"]
    element = CalibrationElement.ACCELERATION
    assert host.ask(commands.READ_CALIBRATION_D.request(STH, element, 3)) == -45.0
    host.ask(commands.WRITE_CALIBRATION_D.request(STH, element, 3, -50.0))
    read = commands.READ_EEPROM.request(STH, field.page, field.offset, field.length)
    assert host.ask(read) == b"\x00\x00\x48\xc2"
    empty = Host(calibrated=False).connect()
    assert empty.ask(commands.READ_CALIBRATION_K.request(STH, element, 1)) == 0.0


def test_a_reset_loses_the_ram_and_the_connection() -> None:
    host = Host().connect()
    host.ask(commands.WRITE_ADC.request(STH, AdcConfiguration(prescaler=9)))
    host.ask(commands.WRITE_LED.request(STH, False))
    host.ask(commands.RESET.request(STH))
    with pytest.raises(TimeoutError):
        host.ask(commands.READ_ADC.request(STH))
    host.wait(SUPERVISION_TIME)
    assert not host.ask(commands.CHECK_CONNECTED.request(STU))
    host.connect()
    assert host.ask(commands.READ_ADC.request(STH)) == AdcConfiguration()
    assert host.ask(commands.READ_LED.request(STH))
    assert host.ask(commands.READ_POWER_CYCLES.request(STH)) == (2, 0)
    host.network.power_loss(host.sensors[0], host.now)
    host.wait(SUPERVISION_TIME + 0.1)
    host.connect()
    assert host.ask(commands.READ_POWER_CYCLES.request(STH)) == (3, 1)
    assert host.ask(commands.READ_UNDER_VOLTAGES.request(STH)) == 1
    host.ask(commands.RESET.request(STU))
    host.wait(0.2)
    assert host.ask(commands.READ_STATE.request(STU)).state is NetworkState.STARTUP
    host.wait(0.2)
    assert host.ask(commands.READ_STATE.request(STU)).state is NetworkState.OPERATING
    assert not host.ask(commands.CHECK_CONNECTED.request(STU))


def test_measurements() -> None:
    host = Host().connect()
    sensor = host.sensors[0]
    sensor.vibration = lambda times: np.zeros((len(times), 3))
    sensor.temperature, sensor.battery = -3.25, 2.9
    assert host.ask(commands.READ_TEMPERATURE.request(STH)) == -3.25
    assert host.ask(commands.read_acceleration(STH)) == (32768, 17873, 17873)  # 1.65 and 0.9 V
    (raw,) = host.ask(commands.read_voltage(STH))
    assert raw == round(2.9 / 5.7 / 3.3 * 65535)
    element = CalibrationElement
    assert host.ask(commands.MEASURE.request(STH, element.GROUND)) == 0
    assert host.ask(commands.MEASURE.request(STH, element.SUPPLY)) == 65535
    assert host.ask(commands.MEASURE.request(STH, element.SUPPLY, 1, 6.6)) == 32768
    host.ask(commands.MEASURE.request(STH, element.ACCELERATION, 1, 3.3,
                                      CalibrationMethod.ACTIVATE))
    assert host.ask(commands.MEASURE.request(STH, element.ACCELERATION)) == round(
        1.75 / 3.3 * 65535)
    host.ask(commands.MEASURE.request(STH, element.ACCELERATION, 1, 3.3,
                                      CalibrationMethod.DEACTIVATE))
    host.ask(commands.WRITE_ADC.request(STH, AdcConfiguration(reference_voltage=6.6)))
    assert host.ask(commands.read_acceleration(STH, X)) == (16384,)
    host.ask(commands.WRITE_USED_SENSORS.request(STH, UsedSensors(5, 0, 10)))
    volts = 0.772 + (-3.25 + 40) * 0.495 / 165, 0.9, 0.509  # 2.9 V of the battery
    assert host.ask(commands.read_acceleration(STH)) == tuple(
        round(one / 6.6 * 65535) for one in volts)


# --- streams ---

@pytest.mark.parametrize(("format", "adc", "rate"), [
    (StreamFormat(X, 3), AdcConfiguration(), 3174.6),
    (StreamFormat(X, 1), AdcConfiguration(), 9523.8),
    (StreamFormat(XZ, 1), AdcConfiguration(), 4761.9),
    (StreamFormat(XYZ, 1), AdcConfiguration(), 3174.6),
    (StreamFormat(X, 1, 3), AdcConfiguration(), 9523.8),
    (StreamFormat(X, 30), AdcConfiguration(), 317.46),
    (StreamFormat(XYZ, 10), AdcConfiguration(), 317.46),
    (StreamFormat(X, 3), AdcConfiguration(1, 8, 8), 38095.2),
    (StreamFormat(XYZ, 1), AdcConfiguration(16, 8, 128), 280.1),
])
def test_streams_carry_the_truth(format: StreamFormat, adc: AdcConfiguration, rate: float) -> None:
    host = Host(can_fd=format.frame_length > 8).connect()
    host.ask(commands.WRITE_ADC.request(STH, adc))
    sensor = host.sensors[0]
    host.heard.clear()
    host.send(commands.START_ACCELERATION.request(STH, format))
    host.wait(0.5)
    frames = host.data()
    assert len(frames) == pytest.approx(rate * 0.5, abs=2)
    decoder = StreamDecoder(format, rate)
    batch = decoder.decode(frames)
    assert decoder.statistics.frames == len(frames)
    assert frames[0][1][1] == 0  # the counter begins with 0
    count = len(frames) * format.data_sets
    times = sensor.sample_times(0, count)
    truth = sensor.voltages(times)[:, np.array(format.channels)] / 3.3 * format.full_scale
    assert np.abs(batch.values.reshape(count, -1) - truth).max() <= 0.51
    # A frame is sent when its last value is measured.
    last = times[format.data_sets - 1::format.data_sets] - sensor.sample_times(0, 1)[0]
    due = np.array([due for due, _ in frames]) - sensor.streams[0].start
    assert np.abs(due - last).max() < 1e-6


def test_the_truth_is_a_pure_function() -> None:
    times = np.arange(0, 20, 1e-4) + 1.7e9
    truth = vibration(times)
    assert truth.shape == (len(times), 3)
    assert (truth == vibration(times)).all()
    assert np.abs(truth[:, 0]).max() == pytest.approx(5.0, abs=1e-3)
    assert truth[:, 1].max() > 20  # impacts
    assert np.median(truth[:, 2]) == pytest.approx(1.0, abs=1e-3)  # gravity
    assert np.abs(np.diff(truth[:, 0])).max() < 5.0 * 2 * np.pi * 505 * 1e-4  # no jumps
    crossings = np.flatnonzero(np.diff(np.signbit(truth[:, 0]))) * 1e-4
    frequencies = 0.5 / np.diff(crossings)
    assert frequencies.min() == pytest.approx(20, abs=3)
    assert frequencies.max() == pytest.approx(500, abs=60)


def test_the_answer_to_a_start_is_data_and_the_stop_comes_last() -> None:  # errata C6
    host = Host().connect()
    host.heard.clear()
    host.send(commands.START_ACCELERATION.request(STH, stream_format(X)))
    host.wait(0.1)
    host.send(commands.START_ACCELERATION.request(STH, stream_format(X)))  # asked again
    host.wait(0.1)
    host.ask(commands.STOP_ACCELERATION.request(STH))
    frames = host.data()
    assert frames[-1][1] == b"\x80"
    decoder = StreamDecoder(stream_format(X))
    decoder.decode(frames)
    assert decoder.statistics.lost == 0
    assert decoder.statistics.others == 1
    host.wait(0.1)
    assert host.data() == []


def test_single_values_while_streaming() -> None:
    host = Host().connect()
    host.send(commands.START_ACCELERATION.request(STH, stream_format(X)))
    host.wait(0.1)
    assert len(host.ask(commands.read_acceleration(STH, XYZ))) == 3
    assert len(host.ask(commands.read_voltage(STH))) == 1
    decoder = StreamDecoder(stream_format(X))
    decoder.decode(host.data())
    assert decoder.statistics.lost == 0
    assert decoder.statistics.others == 1


def test_another_format_stops_the_last_stream() -> None:  # section 10.3.2
    host = Host().connect()
    host.send(commands.START_ACCELERATION.request(STH, stream_format(X)))
    host.wait(0.1)
    host.data()
    decoder = host.stream(stream_format(XYZ), 0.2)
    assert decoder.statistics.others == 1  # the stop
    assert decoder.statistics.frames == pytest.approx(635, abs=8)


def test_a_clock_that_runs_fast() -> None:
    host = Host().connect()
    host.sensors[0].clock_error = 0.01
    assert host.stream(stream_format(X), 1.0).statistics.frames == pytest.approx(3206, abs=3)


def test_a_changed_adc_changes_the_running_stream() -> None:
    host = Host().connect()
    host.send(commands.START_ACCELERATION.request(STH, stream_format(X)))
    host.wait(0.2)
    host.ask(commands.WRITE_ADC.request(STH, AdcConfiguration(prescaler=8)))
    host.data()
    host.wait(1.0)
    assert len(host.data()) == pytest.approx(1058, abs=2)


# --- misbehaviour ---

@pytest.mark.parametrize("run", [1, 3, 40])
def test_losses(run: int) -> None:
    host = Host().connect()
    host.network.faults.loss = 0.02 / run
    host.network.faults.loss_run = run
    decoder = host.stream(stream_format(X), 3.0)
    statistics = decoder.statistics
    assert statistics.frames + host.network.lost == pytest.approx(9524, abs=3)
    assert statistics.lost == pytest.approx(host.network.lost, abs=run)
    assert 20 < statistics.lost < 1000


def test_duplicates() -> None:
    host = Host().connect()
    host.network.faults.duplicate = 0.05
    statistics = host.stream(stream_format(X), 2.0).statistics
    assert statistics.lost == 0
    assert statistics.duplicates == pytest.approx(317, abs=100)
    assert statistics.frames == pytest.approx(6349, abs=3)


@pytest.mark.parametrize(("fault", "value"), [("jitter", 0.02), ("burst", 0.15)])
def test_late_frames(fault: str, value: float) -> None:
    host = Host().connect()
    setattr(host.network.faults, fault, value)
    host.send(commands.START_ACCELERATION.request(STH, stream_format(X)))
    host.wait(2.0)
    frames = host.data()
    arrivals = [due for due, _ in frames]
    assert arrivals == sorted(arrivals)
    decoder = StreamDecoder(stream_format(X), 3174.6)
    decoder.decode(frames)
    assert decoder.statistics.lost == decoder.statistics.duplicates == 0
    start = host.sensors[0].streams[0].start
    late = [due - start - (3 * number + 2) / (38.4e6 / 4032)
            for number, due in enumerate(arrivals)]
    assert min(late) > -1e-6
    assert value / 2 < max(late) <= value + 1e-6


def test_lost_answers_and_silence() -> None:
    host = Host().connect()
    host.network.faults.answer_loss = 1.0
    with pytest.raises(TimeoutError):
        host.ask(commands.READ_ADC.request(STH))
    host.ask(commands.READ_STATE.request(STU))
    host.network.faults.answer_loss = 0.0
    host.network.faults.silent = True
    with pytest.raises(TimeoutError):
        host.ask(commands.READ_STATE.request(STU))
    host.network.faults.silent = False
    host.ask(commands.READ_STATE.request(STU))


def test_foreign_frames() -> None:
    host = Host().connect()
    host.network.faults.foreign = 500.0
    statistics = host.stream(stream_format(X), 1.0).statistics
    assert statistics.lost == 0
    host.wait(0.5)
    assert len(host.heard) == pytest.approx(250, abs=10)
    assert {frame.extended for _, frame in host.heard} == {True, False}


def test_sensors_have_names() -> None:
    with pytest.raises(DriverError, match="at most 8 bytes"):
        simulated_network(["Test-STH1"])
    with pytest.raises(DriverError, match="at least one"):
        simulated_network([])
    with pytest.raises(WrongDeviceError, match="only Test-STH"):
        Host().network.sensor("Nobody")


# --- on the wire ---

@pytest.fixture
def server() -> Iterator[SimulatedIcotronic]:
    started = simulated_network(["Test-STH"]).start()
    yield started
    started.close()


def _open(server: SimulatedIcotronic, channel: str = "can0") -> can.BusABC:
    return can.Bus(interface="socketcand", host=server.host, port=server.port, channel=channel)


@pytest.fixture
def bus(server: SimulatedIcotronic) -> Iterator[can.BusABC]:
    with _open(server) as opened:
        yield opened


def _until(bus: can.BusABC, wanted: Callable[[can.Message], bool]) -> can.Message:
    end = time.monotonic() + DEADLINE
    while time.monotonic() < end:
        message = bus.recv(end - time.monotonic())
        if message is not None and wanted(message):
            return message
    pytest.fail("nothing came in time")


def _ask(bus: can.BusABC, request: Request[T]) -> T:
    bus.send(can.Message(arbitration_id=request.frame.identifier.encode(),
                         data=request.frame.data, is_extended_id=True))
    answer = _until(bus, lambda message: message.is_extended_id
                    and request.is_answered_by(message.arbitration_id, message.data))
    return request.result(answer.arbitration_id, answer.data)


def _connect(bus: can.BusABC) -> None:
    _ask(bus, commands.ACTIVATE_BLUETOOTH.request(STU))
    while not _ask(bus, commands.COUNT_DEVICES.request(STU)):
        pass
    _ask(bus, commands.CONNECT_NUMBER.request(STU, 0))
    while not _ask(bus, commands.CHECK_CONNECTED.request(STU)):
        pass


@pytest.mark.parametrize("format", [StreamFormat(X, 3), StreamFormat(X, 1), StreamFormat(XYZ, 1)])
def test_the_full_rate_comes_through_python_can(bus: can.BusABC, server: SimulatedIcotronic,
                                                format: StreamFormat) -> None:
    _connect(bus)
    _ask(bus, commands.START_ACCELERATION.request(STH, format))
    rate = format.frame_rate(AdcConfiguration().sample_rate)
    decoder = StreamDecoder(format, rate)
    arrivals = []
    while decoder.statistics.frames < rate:  # for a second
        message = _until(bus, lambda message: message.arbitration_id == DATA)
        if decoder.decode_frame(message.timestamp, message.data) is not None:
            arrivals.append(message.timestamp)
    _ask(bus, commands.STOP_ACCELERATION.request(STH))
    assert decoder.statistics.lost == server.dropped == 0
    # The time stamps are those of the sensor, however busy this machine is.
    assert arrivals[-1] - arrivals[0] == pytest.approx((decoder.number) / rate, abs=1e-3)
    assert abs(time.time() - arrivals[-1]) < DEADLINE


def test_standard_frames_and_empty_ones(bus: can.BusABC, server: SimulatedIcotronic) -> None:
    _ask(bus, commands.READ_STATE.request(STU))
    server.network.send(CanFrame(0x123, b"\x01\x02", extended=False))
    server.network.send(CanFrame(0x123, b""))
    first = _until(bus, lambda message: message.arbitration_id == 0x123)
    assert (first.is_extended_id, bytes(first.data)) == (False, b"\x01\x02")
    second = _until(bus, lambda message: message.arbitration_id == 0x123)
    assert (second.is_extended_id, bytes(second.data)) == (True, b"")


def test_several_clients_hear_the_bus(bus: can.BusABC, server: SimulatedIcotronic) -> None:
    with _open(server) as other:  # which itself says nothing
        _ask(bus, commands.READ_GTIN.request(STU))
        request = _until(other, lambda message: message.arbitration_id == 0xF802_3D1)
        assert bytes(request.data) == bytes(8)
        assert _until(other, lambda message: message.arbitration_id == 0xF800_44F)


def test_clients_come_and_go_while_it_streams(bus: can.BusABC, server: SimulatedIcotronic) -> None:
    _connect(bus)
    _ask(bus, commands.START_ACCELERATION.request(STH, StreamFormat(X, 1)))
    for _ in range(10):
        with _open(server) as other:  # data must not come between the words of the greeting
            _ask(other, commands.READ_STATE.request(STU))
    _ask(bus, commands.READ_STATE.request(STU))


def _talk(server: SimulatedIcotronic, words: bytes, wanted: bytes) -> bytes:
    """Send words to the server and return what it says until it has said `wanted`."""
    with socket.create_connection((server.host, server.port), DEADLINE) as client:
        heard = b""
        client.sendall(words)
        while wanted not in heard:
            received = client.recv(65536)
            assert received, f"gone after {heard!r}"
            heard += received
        return heard


@pytest.mark.parametrize(("words", "wanted"), [
    (b"", b"< hi >"), (b"< open can0 >", b"< ok >"), (b"< echo >", b"< echo >"),
    (b"< open can0 >< rawmode >", b"< ok >< ok >"), (b"< dance >", b"< error unknown command >"),
    (b"\xff\x00 garbage > < echo >", b"< echo >"), (b"< < open can0 >", b"< ok >"),
    # Named, because colcon stops to read, and the tests stop with it, at a line of 64 KiB.
    pytest.param(b"x" * 100000 + b"< echo >", b"< echo >", id="noise"),
    (b"<><  >< echo >", b"< echo >"),
    (b"< open can0 >< rawmode >< send 123 9 1 >", b"< error unknown command >"),
    (b"< open can0 >< rawmode >< send xyz 1 1 >", b"< error unknown command >"),
    (b"< open can0 >< rawmode >< send FFFFFFFF 0  >", b"< error unknown command >"),
    (b"< send 123 1 1 >", b"< error unknown command >"),
    (b"< open can0 >< rawmode >< send 000A3D1 1 0 >< send 0000A3D1 1 0 >", b"< frame 0000844F "),
])
def test_what_clients_say(server: SimulatedIcotronic, words: bytes, wanted: bytes) -> None:
    assert _talk(server, words, wanted).startswith(b"< hi >")


def test_a_message_may_come_in_pieces(server: SimulatedIcotronic) -> None:
    with socket.create_connection((server.host, server.port), DEADLINE) as client:
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        heard = b""
        for byte in b"< open can0 >< rawmode >< send 0000A3D1 1 0 >":
            client.sendall(bytes((byte,)))
        while b" 25 >" not in heard:
            heard += client.recv(4096)


def test_error_frames(server: SimulatedIcotronic) -> None:
    server.network.send(CanFrame(0x040, b"", error=True), time.monotonic() + 0.1)
    assert b"< frame 0000844F " in _talk(
        server, b"< open can0 >< rawmode >< send 0000A3D1 1 0 >", b"< error 040 ")


def test_another_channel_is_refused() -> None:
    server = simulated_network(["Test-STH"], channel="can0").start()
    try:
        assert b"< error could not open bus >" in _talk(server, b"< open can1 >", b"bus >")
        with pytest.raises(can.CanError):
            _open(server, "can1")
        _open(server, "can0").shutdown()
    finally:
        server.close()


def test_a_slow_client_holds_up_nobody(bus: can.BusABC, server: SimulatedIcotronic,
                                       monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(simulated_bus, "MAX_WAITING", 20000)
    server._server.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)  # of its next clients
    slow = socket.create_connection((server.host, server.port))
    with contextlib.closing(slow):
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        slow.sendall(b"< open can0 >< rawmode >< echo >")  # and reads nothing of what comes
        _connect(bus)
        _ask(bus, commands.START_ACCELERATION.request(STH, StreamFormat(X, 3)))
        _until(bus, lambda _: server.dropped > 0)
        # This client may be slow as well, but is to hear the answer.
        monkeypatch.setattr(simulated_bus, "MAX_WAITING", sys.maxsize)
        _ask(bus, commands.STOP_ACCELERATION.request(STH))
    _ask(bus, commands.READ_STATE.request(STU))


def test_the_port_may_be_taken(server: SimulatedIcotronic) -> None:
    with pytest.raises(LinkError, match="cannot listen"):
        simulated_network(listen=f"{server.host}:{server.port}")
    with pytest.raises(LinkError, match="cannot listen on nowhere"):
        simulated_network(listen="nowhere")


def test_a_closed_server_is_gone(server: SimulatedIcotronic) -> None:
    with socket.create_connection((server.host, server.port), DEADLINE) as client:
        assert client.recv(100) == b"< hi >"
        server.close()
        assert client.recv(100) == b""
    with pytest.raises(OSError, match=r"refused|reset"):
        socket.create_connection((server.host, server.port), 1.0)
    server.close()  # a second time does no harm


def test_a_server_can_be_unplugged(server: SimulatedIcotronic) -> None:
    with _open(server) as bus:
        _ask(bus, commands.READ_STATE.request(STU))
    server.unplug()
    with pytest.raises(OSError, match=r"refused|reset"):
        socket.create_connection((server.host, server.port), 1.0)
    server.plug()
    with _open(server) as bus:
        _ask(bus, commands.READ_STATE.request(STU))


def test_a_server_can_forget_its_clients(server: SimulatedIcotronic) -> None:
    with _open(server) as bus:
        _ask(bus, commands.READ_STATE.request(STU))
        server.hang()
        with _open(server) as second:
            _ask(second, commands.READ_STATE.request(STU))
        request = commands.READ_STATE.request(STU).frame
        bus.send(can.Message(arbitration_id=request.identifier.encode(), data=request.data))
        assert bus.recv(0.05) is None


def test_error_frames_and_late_answers() -> None:
    host = Host().connect()
    host.network.faults.errors = 100.0
    host.wait(0.5)
    assert sum(frame.error for _, frame in host.heard) == pytest.approx(50, abs=5)
    host.network.faults.errors = 0.0
    host.network.faults.answer_delay = 0.25
    with pytest.raises(TimeoutError):
        host.ask(commands.READ_STATE.request(STH), 0.2)
    host.ask(commands.READ_STATE.request(STH), 0.5)


def test_the_command_line() -> None:
    program = "from sensor_tools.simulate import main; main()"
    arguments = ["icotronic", "--listen", "127.0.0.1:0", "--name", "Test-STH", "--name", "Zwei",
                 "--loss", "0.5", "--loss-run", "2"]
    talk = "away Zwei\nback Zwei\nsilent on\nsilent off\njitter 0.1\npower-cycle Zwei\nfly\nquit\n"
    done = subprocess.run([sys.executable, "-c", program, *arguments], input=talk, text=True,
                          capture_output=True, timeout=DEADLINE, check=False)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0].startswith("127.0.0.1:")
    assert "Test-STH (08:6B:D7:01:DE:81), Zwei (08:6B:D7:01:DE:82)" in lines[0]
    assert [line.split(":")[0] for line in lines[1:]] == ["done"] * 6 + ["cannot do 'fly'"]


def test_what_the_sensors_are_can_be_said_on_the_command_line(
        monkeypatch: pytest.MonkeyPatch) -> None:
    servers: list[SimulatedIcotronic] = []
    monkeypatch.setattr(simulate_icotronic, "simulated_network", lambda *args, **options: (
        servers.append(simulated_network(*args, **options)) or servers[-1]))
    parser = argparse.ArgumentParser()
    simulate_icotronic.add_arguments(parser)
    simulation = simulate_icotronic.open_simulation(parser.parse_args([
        "--listen", "127.0.0.1:0", "--used-sensors", "10,6,3", "--at-rest", "--noise", "0.1",
        "--silent-on", "unused", "--connect-time", "15", "--newness", "2"]))
    try:
        network = servers[0].network
        sensor = network.sensors[0]
        assert (sensor.used_sensors, sensor.noise) == ((10, 6, 3), 0.1)
        assert sensor.vibration(np.zeros(1)).tolist() == [[0.0, 0.0, 1.0]]
        assert (network.faults.connect_time, network.faults.newness) == (15.0, 2.0)
        assert all((commands.STATISTICS, 0x00) in node.ignore for node in (network.stu, sensor))
        simulation.commands["silent-on"]("nothing")
        assert not sensor.ignore
        simulation.commands["padding"]("on")
        assert network.faults.padding
        with pytest.raises(SettingError, match="no silence on 'fly', only on nothing, unused"):
            simulation.commands["silent-on"]("fly")
    finally:
        simulation.close()


@pytest.mark.parametrize("numbers", ["1,2", "1,2,11", "0,1,2"])
def test_only_sensors_that_there_are_can_be_on_the_channels(numbers: str) -> None:
    parser = argparse.ArgumentParser()
    simulate_icotronic.add_arguments(parser)
    with pytest.raises(SettingError, match=r"takes three numbers 1 \.\.\. 10"):
        simulate_icotronic.open_simulation(parser.parse_args(["--used-sensors", numbers]))
