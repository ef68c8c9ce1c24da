# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The simulated sensors themselves, without I/O."""

from __future__ import annotations

import math

import pytest
import serial
from bus_master import DEADLINE

from driver_common.errors import (
    SettingError,
    WrongDeviceError,
)
from driver_common.simulator.line import DAMAGES, Faults
from uc4000_driver.commands import OpCode
from uc4000_driver.simulator.line import SimulatedSensors, simulated_line
from uc4000_driver.simulator.sensor import SimulatedSensor
from uc4000_driver.telegram import GAP, Request

STEP = 0.016  # m


@pytest.mark.parametrize(("telegram", "reply"), [
    ("A8 00 00 43", "07 E7"),  # cast
    ("AF 35 FF", "07 E7"),
    ("AF 35 FF 71", "01 7C"),  # wrong CHECK
    ("AF FE FF 70", "05 6E"),  # no cycle
    ("A7 23 10", "05 6E"),  # no such burst
    ("AF 99 FF", "09 5E"),  # no such op-code
    ("A7 34 FF", "0A 6E"),  # read only
    ("A9 35 FF 61", None),  # another address
    ("9F 35 FF 70", None),  # no SYNC
])
def test_what_the_simulated_sensor_answers(telegram, reply):
    data = bytes.fromhex(telegram)
    if len(data) == 3:
        data = Request(data[0] & 7, data[1], data[2], not data[0] & 8).encode()
    line = SimulatedSensors([SimulatedSensor()])
    answers = [answer for _, answer in line.receive(data, 1.0)]
    assert answers == ([bytes.fromhex(reply)] if reply else [])


@pytest.mark.parametrize(("telegram", "reply"), [
    ("AF", "02 4C"),  # time-out: nothing but the SYNC byte
    ("AF 35", "03 5D"),  # underflow
    ("AF 35 FF", "03 5D"),
    ("AF AF 35 FF 71", "04 7F"),  # overflow
    ("AE 35 FF", None),  # another address
    ("35 FF 70", None),  # no SYNC
])
def test_what_the_simulated_sensor_says_to_telegrams_of_another_length(telegram, reply):
    line = SimulatedSensors([SimulatedSensor()])
    answers = line.receive(bytes.fromhex(telegram), 1.0) + line.receive(b"", 1.0 + GAP)
    assert [answer for _, answer in answers] == ([bytes.fromhex(reply)] if reply else [])
    request = Request(7, OpCode.ADDRESS).encode()
    assert len(line.receive(request, 2.0)) == 1  # what was before is forgotten


def test_the_simulated_sensor_waits_for_the_rest_of_a_request_until_a_gap():
    line = SimulatedSensors([SimulatedSensor()])
    request = Request(7, OpCode.ADDRESS).encode()
    assert line.receive(request[:2], 1.000) == []
    assert line.receive(request[2:], 1.010) == []
    assert line.receive(request[:2], 2.000) == []
    assert len(line.receive(request[2:], 2.001)) == 1


def test_the_simulated_line_tells_the_sensor_of_a_gap():
    line, _ = simulated_line()
    line.start()
    port = serial.Serial(line.port, 19200, timeout=DEADLINE)
    port.write(bytes.fromhex("AF 35"))
    assert port.read(2) == bytes.fromhex("03 5D")
    port.write(Request(7, OpCode.ADDRESS).encode())
    assert port.read(2) == bytes.fromhex("07 E7")
    port.close()
    line.close()


def test_damage_hurts_bytes_in_every_way():
    faults = Faults(damage=1.0)
    pieces = [faults.hurt(b"\x00") for _ in range(200)]
    seen = {("drop" if not piece else "double" if piece[0][1] == b"\0\0" else
             "flip" if piece[0][1] != b"\0" else "split" if piece[0][0] <= 0.01 else "delay")
            for piece in pieces}
    assert seen == set(DAMAGES)
    assert Faults().hurt(b"\x12\x34") == [(0.0, b"\x12\x34")]


def test_simulated_sensors_share_one_wire():
    line = SimulatedSensors([SimulatedSensor(1), SimulatedSensor(2)])
    (due, _), = line.receive(Request(1, OpCode.PROFILE_B, 0xFE).encode(), 1.0)
    assert due == pytest.approx(1.055)
    during = line.receive(Request(2, OpCode.VERSION).encode(), due + 0.001)
    assert during == []  # lost, because the other one was talking
    assert len(line.receive(Request(2, OpCode.VERSION).encode(), due + 0.01)) == 1


def test_a_simulated_sensor_that_hears_another_is_disturbed():
    near, far = SimulatedSensor(1), SimulatedSensor(2)
    near.scene = far.scene = lambda now: 3.2
    far.hears = [near]
    line = SimulatedSensors([near, far])
    line.receive(Request(1, OpCode.PROFILE_B, 0xFE).encode(), 1.0)
    (_, disturbed), = line.receive(Request(2, OpCode.PROFILE_B, 0xFE).encode(), 1.02)
    assert disturbed[0] == round(0.25 / STEP)
    (_, alone), = line.receive(Request(2, OpCode.PROFILE_B, 0xFE).encode(), 3.0)
    assert alone[0] == 3.2 / STEP


@pytest.mark.parametrize(("celsius", "reply"), [
    (-25.0, "E7 F3"), (math.nan, "0B 7F"), (200.0, "0B 7F")])
def test_a_simulated_sensor_with_a_broken_thermometer_says_so(celsius, reply):
    sensor = SimulatedSensor()
    sensor.temperature = celsius
    (_, answer), = SimulatedSensors([sensor]).receive(
        Request(7, OpCode.TEMPERATURE).encode(), 1.0)
    assert answer == bytes.fromhex(reply)


def test_a_simulated_sensor_may_answer_at_once():
    sensor = SimulatedSensor()
    sensor.at_once = True
    (due, answer), = SimulatedSensors([sensor]).receive(
        Request(7, OpCode.PROFILE_B, 0x00).encode(), 1.0)
    assert due == 1.0
    assert len(answer) == 2


def test_an_unknown_product_and_address():
    with pytest.raises(WrongDeviceError, match="use sim://UC4000"):
        simulated_line(product="UC500")
    with pytest.raises(SettingError, match="allowed is 1 … 7"):
        simulated_line([8])
