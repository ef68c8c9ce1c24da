"""The simulated sensors themselves, without I/O."""

from __future__ import annotations

import pytest

from driver_common.errors import (
    SettingError,
    WrongDeviceError,
)
from uc4000_driver.commands import OpCode
from uc4000_driver.simulator.line import SimulatedSensors, simulated_line
from uc4000_driver.simulator.sensor import SimulatedSensor
from uc4000_driver.telegram import Request

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


def test_the_simulated_sensor_forgets_half_a_request_after_a_gap():
    line = SimulatedSensors([SimulatedSensor()])
    request = Request(7, OpCode.ADDRESS).encode()
    assert line.receive(request[:2], 1.000) == []
    assert line.receive(request[2:], 1.010) == []
    assert line.receive(request[:2], 2.000) == []
    assert len(line.receive(request[2:], 2.001)) == 1


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


def test_an_unknown_product_and_address():
    with pytest.raises(WrongDeviceError, match="use sim://UC4000"):
        simulated_line(product="UC500")
    with pytest.raises(SettingError, match="allowed is 1 … 7"):
        simulated_line([8])
