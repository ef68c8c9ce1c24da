"""Looking for sensors on real transports: who is found, what is wrong, and that nothing changes."""

from __future__ import annotations

import time

import pytest
from bench_sensors import Bench

from driver_common.simulator.bus import CanFrame
from icotronic_driver.identifier import SPU_1, STU_1, Identifier
from isys_radar_driver.frames import MASTER, FrameParser
from isys_radar_driver.models import MODELS
from sensor_tools.search import icotronic, isys, place, uc4000
from sensor_tools.search.place import CanPlace, SerialPlace
from sensor_tools.search.result import Finding, Found, Progress
from uc4000_driver.telegram import REQUEST_LENGTH, Request

SCAN_LIMIT = 20.0  # s, of a full scan of a port


@pytest.fixture
def bench():
    bench = Bench()
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

@pytest.mark.parametrize("model", ["iSYS-4001", "iSYS-4003", "iSYS-6005", "iSYS-5010"])
def test_a_radar_is_found_at_its_rate(bench, model):
    line, _ = bench.radars(model, addresses=[31])
    (found,), findings = search(isys, SerialPlace(line.port))
    assert (found.model, found.address, found.rate) == (model, "31", MODELS[model].baud_rate)
    assert (found.serial_number, found.firmware) == ("000001", "1.310")
    assert found.parameters == {"address": 31, "serial_baud": MODELS[model].baud_rate}
    assert not findings


def test_several_radars_are_found_one_by_one(bench):
    line, _ = bench.radars("iSYS-4001", "iSYS-4002", addresses=[30, 33])
    found, findings = search(isys, SerialPlace(line.port), range(28, 36))
    assert [(one.model, one.address) for one in found] == [("iSYS-4001", "30"),
                                                           ("iSYS-4002", "33")]
    assert not findings


@pytest.mark.parametrize(("models", "cause"), [
    (("iSYS-4001", "iSYS-6003"), "only damaged answers come from address 30"),
    (("iSYS-4001", "iSYS-4002"), "a device with product information 4000 answered")])
def test_radars_with_the_same_address_are_noticed(bench, models, cause):
    line, _ = bench.radars(*models, addresses=[30, 30])
    found, (finding,) = search(isys, SerialPlace(line.port, 115200), range(28, 36))
    assert not found
    assert finding.cause.startswith(cause)
    assert finding.remedy.startswith("several devices have address 30")


def test_a_radar_that_measures_by_itself_measures_on(bench):
    line, (radar,) = bench.radars("iSYS-4001")
    radar.self_starting = True
    radar.power_cycle()
    assert radar.measuring
    deadline = time.monotonic() + 20
    while not search(isys, SerialPlace(line.port, 115200))[0] and time.monotonic() < deadline:
        pass  # it starts up
    assert radar.measuring
    codes = {frame.function_code for frame in FrameParser().feed(bytes(bench.heard))
             if frame.source == MASTER}
    assert codes <= {0xD0, 0xD2, 0xD6}  # device name, sensor settings, versions: all of them reads


class DeafLine:
    """A serial port with a clock of its own: every wait is over at once."""

    time = 0

    def __init__(self, clock, garbage_at):
        self.clock = clock
        self.garbage_at = garbage_at
        self.baud_rate = 0
        self.waiting = b""

    def __call__(self, port, baud_rate, recorder=None):
        self.baud_rate = baud_rate
        return self

    def seconds(self, length):
        return length * 10 / self.baud_rate

    def write(self, data):
        if self.baud_rate == self.garbage_at:
            self.waiting = b"\x55" * 8

    def read(self, timeout):
        data, self.waiting = self.waiting, b""
        self.clock.now += 0.001 if data else max(timeout, 0.0001)
        return data

    def close(self):
        pass


class Clock:
    now = 1000.0

    def monotonic(self):
        return self.now


@pytest.mark.parametrize("garbage_at", [0, 9600, 115200])
def test_a_full_scan_of_a_port_ends_in_time(monkeypatch, garbage_at):
    clock = Clock()
    monkeypatch.setattr(time, "monotonic", clock.monotonic)
    for module in ("isys_radar_driver.line", "uc4000_driver.line"):
        monkeypatch.setattr(f"{module}.SerialLink", DeafLine(clock, garbage_at))
    for module in (uc4000, isys):
        assert not search(module, SerialPlace("/dev/ttyDeaf"))[0]
    assert 1.0 < clock.now - Clock.now < SCAN_LIMIT


# --- UC4000 ------------------------------------------------------------------------------------

def test_all_ultrasonic_sensors_on_a_wire_are_found(bench):
    line, _ = bench.ultrasonic_sensors(1, 3, 7)
    found, findings = search(uc4000, SerialPlace(line.port))
    assert [(one.address, one.rate) for one in found] == [("1", 19200), ("3", 19200), ("7", 19200)]
    assert len({one.serial_number for one in found}) == 3
    assert {one.firmware for one in found} == {"HW:V0.1 SW:V1.200"}
    assert not findings


def test_a_wire_that_returns_what_is_sent_is_told(bench):
    line, _ = bench.ultrasonic_sensors(2)
    line.faults.echo = True
    found, (finding,) = search(uc4000, SerialPlace(line.port))
    assert [one.address for one in found] == ["2"]
    assert (finding.cause, finding.is_wrong) == ("the line returns what is sent", False)


def test_ultrasonic_sensors_with_the_same_address_are_noticed(bench):
    line, _ = bench.ultrasonic_sensors(2, 2)
    _, findings = search(uc4000, SerialPlace(line.port))
    assert [finding.cause for finding in findings] == ["only damaged answers come from address 2"]


def test_what_is_damaged_everywhere_is_no_sensor(bench):
    line, _ = bench.ultrasonic_sensors(1)
    line.faults.corrupt = 1.0
    line._device.receive = lambda data, now: [(now, b"\x55\x12")]
    found, findings = search(uc4000, SerialPlace(line.port))
    assert not found
    assert [one.cause for one in findings] == ["bytes arrive that are no UC4000 frames"]


def test_ultrasonic_sensors_are_only_read(bench):
    line, _ = bench.ultrasonic_sensors(1, 5)
    search(uc4000, SerialPlace(line.port))
    telegrams = [Request.decode(bytes(bench.heard[start:start + REQUEST_LENGTH]))
                 for start in range(0, len(bench.heard), REQUEST_LENGTH)]
    assert len(telegrams) > 7
    assert not any(telegram.is_write for telegram in telegrams)


def test_ultrasonic_sensors_have_one_rate_only(bench):
    line, _ = bench.ultrasonic_sensors(1)
    assert search(uc4000, SerialPlace(line.port, 115200)) == ([], [])


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
