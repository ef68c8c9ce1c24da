# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Looking for sensors: who is found, what is wrong, and that nothing changes."""

from __future__ import annotations

import time

import pytest
from bench_sensors import Bench, VirtualLink

from driver_common.simulator.bus import CanFrame
from icotronic_driver.identifier import SPU_1, STU_1, Identifier
from isys_radar_driver.frames import MASTER, FrameParser
from isys_radar_driver.models import MODELS
from sensor_tools.search import icotronic, isys, place, uc4000
from sensor_tools.search.place import CanPlace, SerialPlace
from sensor_tools.search.result import Finding, Found, Progress
from uc4000_driver.telegram import REQUEST_LENGTH, Request

PORT = SerialPlace(VirtualLink.PORT)
SCAN_LIMIT = 20.0  # s, of a full scan of a port


@pytest.fixture
def bench(monkeypatch):
    bench = Bench(monkeypatch)
    yield bench
    bench.close()


class Steps(Progress):
    """Counts."""

    def __init__(self):
        self.expected = 0
        self.done = []

    def expect(self, steps):
        self.expected += steps

    def step(self, what):
        self.done.append(what)


def search(module, where, *more):
    """Return the sensors and the findings of a search; its progress must come out right."""
    steps = Steps()
    results = list(module.search(where, steps, *more))
    assert len(steps.done) <= steps.expected
    return ([one for one in results if isinstance(one, Found)],
            [one for one in results if isinstance(one, Finding)])


# --- iSYS --------------------------------------------------------------------------------------

@pytest.fixture
def radars(monkeypatch):
    """Put radars on a virtual port: (model, address) each."""
    return lambda *wanted: VirtualLink.radars(monkeypatch, *wanted)


@pytest.mark.parametrize("model", ["iSYS-4001", "iSYS-4003", "iSYS-6005", "iSYS-5010"])
def test_a_radar_is_found_at_its_rate(radars, model):
    radars((model, 31))
    (found,), findings = search(isys, PORT)
    assert (found.model, found.address, found.rate) == (model, "31", MODELS[model].baud_rate)
    assert (found.serial_number, found.firmware) == ("000001", "1.310")
    assert found.parameters == {"address": 31, "serial_baud": MODELS[model].baud_rate}
    assert not findings


def test_several_radars_are_found_one_by_one(radars):
    radars(("iSYS-4001", 30), ("iSYS-4002", 255), ("iSYS-6003", 2))
    found, findings = search(isys, PORT)
    assert [(one.model, one.address) for one in found] == [
        ("iSYS-6003", "2"), ("iSYS-4001", "30"), ("iSYS-4002", "255")]
    assert not findings


@pytest.mark.parametrize(("models", "cause"), [
    (("iSYS-4001", "iSYS-6003"), "only damaged answers come from address 30"),
    (("iSYS-4001", "iSYS-4002"), "a device with product information 4000 answered")])
def test_radars_with_the_same_address_are_noticed(radars, models, cause):
    radars(*((model, 30) for model in models))
    found, (finding,) = search(isys, PORT)
    assert not found
    assert finding.cause.startswith(cause)
    assert finding.remedy.startswith("several devices have address 30")


def test_a_radar_that_measures_measures_on(radars):
    link, (radar,) = radars(("iSYS-4001", 128))
    radar.measuring = True
    assert search(isys, PORT)[0]
    assert radar.measuring
    codes = {frame.function_code for frame in FrameParser().feed(bytes(link.heard))
             if frame.source == MASTER}
    assert codes == {0xD0, 0xD2, 0xD6}  # device name, sensor settings, versions: all of them reads


def test_an_echo_is_no_answer(radars):
    link, _ = radars(("iSYS-4003", 31))
    link.echo = True
    (found,), (finding,) = search(isys, PORT)
    assert (found.address, found.rate) == ("31", 9600)
    assert (finding.cause, finding.is_wrong) == ("the line returns what is sent", False)


@pytest.mark.parametrize("rate", [0, 9600, 115200])
def test_a_full_scan_of_a_port_ends_in_time(monkeypatch, rate):
    link = VirtualLink.answering(monkeypatch, b"\x55" * 8, rate)
    causes = []
    for module in (uc4000, isys):
        found, findings = search(module, PORT)
        assert not found
        causes += [one.cause for one in findings]
    assert causes == (["bytes arrive that are no iSYS frames"] if rate else [])
    assert 1.0 < link.now - link.begin < SCAN_LIMIT


# --- UC4000 ------------------------------------------------------------------------------------

@pytest.fixture
def ultrasonic_sensors(monkeypatch):
    """Put ultrasonic sensors with these addresses on a virtual port."""
    return lambda *addresses: VirtualLink.ultrasonic_sensors(monkeypatch, *addresses)


def test_all_ultrasonic_sensors_on_a_wire_are_found(ultrasonic_sensors):
    ultrasonic_sensors(1, 3, 7)
    found, findings = search(uc4000, PORT)
    assert [(one.address, one.rate) for one in found] == [("1", 19200), ("3", 19200), ("7", 19200)]
    assert len({one.serial_number for one in found}) == 3
    assert {one.firmware for one in found} == {"HW:V0.1 SW:V1.200"}
    assert not findings


def test_a_wire_that_returns_what_is_sent_is_told(ultrasonic_sensors):
    ultrasonic_sensors(2).echo = True
    found, (finding,) = search(uc4000, PORT)
    assert [one.address for one in found] == ["2"]
    assert (finding.cause, finding.is_wrong) == ("the line returns what is sent", False)


@pytest.mark.parametrize("addresses", [(2, 2), (1, 2, 2), (2, 2, 3)])
def test_ultrasonic_sensors_with_the_same_address_are_noticed(ultrasonic_sensors, addresses):
    ultrasonic_sensors(*addresses)
    _, findings = search(uc4000, PORT)
    assert [finding.cause for finding in findings] == ["only damaged answers come from address 2"]


def test_what_is_damaged_everywhere_is_no_sensor(monkeypatch):
    VirtualLink.answering(monkeypatch, b"\x55\x12", 19200)
    found, findings = search(uc4000, PORT)
    assert not found
    assert [one.cause for one in findings] == ["bytes arrive that are no UC4000 frames"]


def test_ultrasonic_sensors_are_only_read(ultrasonic_sensors):
    heard = ultrasonic_sensors(1, 5).heard
    search(uc4000, PORT)
    telegrams = [Request.decode(bytes(heard[start:start + REQUEST_LENGTH]))
                 for start in range(0, len(heard), REQUEST_LENGTH)]
    assert len(telegrams) > 7
    assert not any(telegram.is_write for telegram in telegrams)


def test_ultrasonic_sensors_have_one_rate_only(ultrasonic_sensors):
    ultrasonic_sensors(1)
    assert search(uc4000, SerialPlace(PORT.port, 115200)) == ([], [])


# --- ICOtronic ---------------------------------------------------------------------------------

@pytest.fixture
def quick(monkeypatch):
    """Let sensors that never show up be given up soon."""
    monkeypatch.setattr(icotronic, "RANGE_TIME", 0.6)


def can_place(words):
    return CanPlace(words[1], words[3], options=(words[5], words[7]))


def test_the_unit_and_the_sensors_in_its_range_are_found(bench, quick):
    network, words = bench.network("One", "Two")
    (unit, *sensors), findings = search(icotronic, can_place(words))
    assert (unit.model, unit.address, unit.is_sensor) == ("STU", network.stu.mac, False)
    assert [(one.name, one.address) for one in sensors] == [
        (one.name, one.mac) for one in network.sensors]
    assert all(one.rssi < 0 for one in sensors)
    assert not findings
    assert network.stu.connected is None  # none was connected for it


def test_a_unit_without_a_sensor_in_range_is_told(bench, quick):
    network, words = bench.network()
    network.sensors[0].in_range = False
    (unit,), (finding,) = search(icotronic, can_place(words))
    assert unit.model == "STU"
    assert finding.cause == "no sensor is in range of the stationary unit"


def test_a_bus_without_a_unit_is_told(bench, quick):
    network, words = bench.network()
    network.faults.silent = True
    found, (finding,) = search(icotronic, can_place(words))
    assert not found
    assert finding.cause == "no stationary unit answers"


def test_a_connection_of_another_program_is_told(bench, quick, monkeypatch):
    network, words = bench.network()
    monkeypatch.setattr(network.stu, "_check_connected", lambda payload, now: b"\1", raising=True)
    network.stu.connected = network.sensors[0]
    network.sensors[0].connected = True
    _, findings = search(icotronic, can_place(words))
    assert ["connection to a sensor already" in one.cause for one in findings] == [True]


def test_another_host_is_told(bench, quick):
    network, words = bench.network()
    frame = CanFrame(Identifier(0, 1, SPU_1, STU_1, request=True).encode(), b"")
    for _ in range(100):
        network.send(frame, time.monotonic() + 0.02 * _)
    _, findings = search(icotronic, can_place(words))
    assert "another host on the bus works with this stationary unit" in [
        one.cause for one in findings]


# --- places ------------------------------------------------------------------------------------

def test_ports_are_named_by_what_stays(tmp_path, monkeypatch):
    device, link = tmp_path / "ttyUSB0", tmp_path / "usb-FTDI_A1-if00-port0"
    device.touch()
    monkeypatch.setattr(place, "BY_ID", tmp_path)
    assert place.by_id(str(device)) == str(device)
    link.symlink_to(device)
    assert str(SerialPlace(str(device))) == place.by_id(str(device))
    monkeypatch.setattr(place, "BY_ID", tmp_path / "by-id")
    (tmp_path / "by-id").mkdir()
    (tmp_path / "by-id" / link.name).symlink_to(device)
    assert SerialPlace(str(device)).parameters == {
        "serial_port": str(tmp_path / "by-id" / link.name)}


def test_can_channels_are_known_by_their_type(tmp_path, monkeypatch):
    for name, kind in (("can1", 280), ("can0", 280), ("eth0", 1)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "type").write_text(f"{kind}\n")
    monkeypatch.setattr(place, "NETWORK", tmp_path)
    assert place.can_channels() == ["can0", "can1"]
