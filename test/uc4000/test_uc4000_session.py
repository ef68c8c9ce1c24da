"""The conversation with simulated sensors over a real pseudo-terminal or TCP, step by step.

The test calls `poll` itself, so that nothing happens behind its back. The sensors are in the same
process: what they did and what the session made of it can be compared.
"""

from __future__ import annotations

import errno
import itertools
import math
import random
import statistics
import time

import pytest
import serial
from bus_master import BusMaster, BusRecorder, wait_until

from driver_common.device_thread import DeviceThread
from driver_common.errors import (
    LinkError,
    NoAnswerError,
    RefusedError,
    SettingError,
    WrongDeviceError,
)
from driver_common.simulator.line import SimulatedLine
from uc4000_driver import session
from uc4000_driver.commands import OpCode, Outcome
from uc4000_driver.line import most_together
from uc4000_driver.sensor import Options
from uc4000_driver.session import Listener, Uc4000Bus
from uc4000_driver.simulator.line import SimulatedSensors, simulated_line
from uc4000_driver.simulator.scene import EMPTY, FULL, filling
from uc4000_driver.simulator.sensor import SimulatedSensor
from uc4000_driver.telegram import ErrorCode, Request

STEP = 0.016  # m
TRANSMISSION = (ErrorCode.CHECKSUM_ERROR, ErrorCode.TELEGRAM_TIMEOUT, ErrorCode.TELEGRAM_UNDERFLOW,
                ErrorCode.TELEGRAM_OVERFLOW, ErrorCode.TRANSMISSION_ERROR)


class Recorder(BusRecorder, Listener):
    """Remembers what the bus tells."""

    def __init__(self):
        super().__init__()
        self.measurements = []
        self.temperatures = []

    def on_measurement(self, sensor, measurement):
        self.measurements.append((sensor.options.name, measurement))

    def on_temperature(self, sensor, celsius, stamp):
        self.temperatures.append((sensor.options.name, celsius, stamp))


class Master(BusMaster):
    """A bus that the test polls."""

    def __init__(self, port, *options, active=True, **more):
        heard = Recorder()
        super().__init__(Uc4000Bus(port, options or [Options(address=7)], heard, **more), heard)
        self.sensor = self.device
        self.bus.set_active(active)
        self.bus.open()

    def measure(self, count=1, name=None):
        """Poll until that many new measurements have come, of one sensor or of any."""
        def new():
            return [measurement for sensor, measurement in self.heard.measurements[start:]
                    if name in (None, sensor)]
        start = len(self.heard.measurements)
        self.until(lambda: len(new()) >= count)
        return new()

    def distances(self, count=1, name=None):
        return [measurement.distance.value for measurement in self.measure(count, name)]

    def write(self, changes):
        return self.bus.maintenance.write(self.sensor, changes)

    def note(self, text):
        """Poll until a note contains the text."""
        self.until(lambda: any(text in note for note in self.heard.notes))


@pytest.fixture
def connect():
    """Make lines with sensors and masters; all are closed with the test."""
    opened = []

    def make(*addresses, **more):
        line, sensors = simulated_line(addresses, **more)
        for index, sensor in enumerate(sensors):
            sensor.scene = lambda now, index=index: still(index)
        opened.append(line.close)
        return line.start(), sensors

    def connect_master(line, *options, **more):
        master = Master(line.port, *options, **more)
        opened.append(master.bus.close)
        return master

    make.master = connect_master
    yield make
    for close in reversed(opened):
        close()


@pytest.fixture
def one(connect):
    """One sensor and its master."""
    line, (sensor,) = connect()
    return line, sensor, connect.master(line)


def still(index):
    """Return a distance that never changes, another one for each sensor; a multiple of 16 mm."""
    return round(0.8 + 0.32 * index, 3)


def named(*addresses, **more):
    """Return options of sensors with names s1, s2, …"""
    return [Options(name=f"s{address}", address=address, **more) for address in addresses]


def counts(master):
    return {sensor.options.name: sensor.statistics.outcomes.total()
            for sensor in master.bus.devices}


class Requests:
    """Records the requests that a simulated sensor answers or ignores, and may change a reply."""

    def __init__(self, sensor, change=lambda request, answer: answer):
        self.all = []
        reply = sensor.reply

        def record(request, now):
            if request.address in (0, sensor.address):
                self.all.append(request)
            return change(request, reply(request, now))

        sensor.reply = record

    def writes(self):
        return [(request.op_code, request.data) for request in self.all if request.is_write]


# --- finding and measuring ---------------------------------------------------------------------

def test_a_sensor_is_found_by_asking_for_its_address(connect):
    line, (simulated,) = connect()
    master = connect.master(line, Options()).find()
    assert master.sensor.address == 7
    assert str(master.sensor.identity) == f"UC4000 {simulated.serial_number}, HW:V0.1 SW:V1.200"
    assert master.sensor.values == {"burst_periods": 32, "gain_db": 72.0, "current_ma": 325,
                                    "temperature_compensation": "unknown"}
    assert master.heard.found == [""]


def test_a_sensor_is_found_at_its_address(connect):
    line, _ = connect(3)
    assert connect.master(line, Options(address=3)).find().sensor.identity


def test_it_works_over_tcp(connect):
    line, _ = connect(listen="127.0.0.1:0")
    assert line.port.startswith("socket://")
    assert connect.master(line).distances(3)[-1] == still(0)


@pytest.mark.parametrize("cycles", [1, 3])
def test_stamps_are_the_middle_of_the_measurement(one, cycles):
    _, simulated, master = one
    master.sensor.options.cycles = cycles
    to_wall_clock = time.time() - time.monotonic()
    measurements = master.measure(5)
    middles = [sum(times) / 2 + to_wall_clock for times in simulated.measurements]
    lengths = [end - begin for begin, end in simulated.measurements]
    assert lengths == pytest.approx([0.05 * cycles] * len(lengths))
    errors = [measurement.stamp * 1e-9 - middle
              for measurement, middle in zip(measurements, middles, strict=False)]
    assert abs(statistics.median(errors)) < 0.010


def test_distances_are_those_at_the_stamps(one):
    _, simulated, master = one
    simulated.scene = lambda now: 1.0 + now % 1.0  # 1 m/s, with a jump every second
    errors = [measurement.distance.value - (1.0 + measurement.stamp * 1e-9 % 1.0)
              for measurement in master.measure(16)]
    near = [error for error in errors if abs(error) < 0.03]
    assert len(near) > 10  # the others were delayed, or at the jump
    assert abs(statistics.median(near)) < 0.010


def test_the_container_is_filled_and_emptied_through_the_blind_zone():
    distances = [filling(second / 10) for second in range(600)]
    assert max(distances) == EMPTY == 3.8
    assert min(distances) == pytest.approx(FULL)
    assert FULL < 0.25
    assert distances.index(min(distances)) == 540
    assert filling(60.0) == EMPTY
    assert filling(0.0, phase=54.0) == pytest.approx(FULL)


@pytest.mark.parametrize(("truth", "outcome", "value"), [
    (1.6, Outcome.ECHO, 1.6),
    (None, Outcome.NO_ECHO, math.inf),
    (0.2, Outcome.TOO_CLOSE, -math.inf),
    (4.1, Outcome.TOO_FAR, math.inf),
    (9.0, Outcome.NO_ECHO, math.inf),
])
def test_what_a_measurement_can_find(one, truth, outcome, value):
    _, simulated, master = one
    simulated.scene = lambda now: truth
    (measurement,) = master.measure()
    assert measurement.distance.outcome is outcome
    assert measurement.distance.value == value
    assert master.sensor.statistics.outcomes[outcome] == 1


@pytest.mark.parametrize(("profile", "reach"), [("a", 3.5), ("b", 4.0), ("c", 4.0), ("user", 4.0)])
def test_the_profile_decides_what_is_seen(one, profile, reach):
    _, simulated, master = one
    master.sensor.options.profile = profile
    for truth, seen in ((reach - 0.1, True), (3.7, reach > 3.5)):
        simulated.scene = lambda now, truth=truth: truth
        (measurement,) = master.measure()[-1:]
        assert (measurement.distance.outcome is Outcome.ECHO) == seen
        assert measurement.profile.limits == (0.25, reach)


def test_another_profile_counts_from_the_next_measurement_on(one):
    _, _, master = one
    master.measure()
    master.sensor.options.profile = "a"
    (measurement,) = master.measure()
    assert measurement.profile.limits == (0.25, 3.5)


@pytest.mark.parametrize(("changes", "seen"), [
    ({"gain_db": 56.5}, False), ({"gain_db": 88.0}, True), ({"burst_periods": 4}, False),
    ({"current_ma": 160}, False), ({"current_ma": 496}, True)])
def test_the_settings_of_the_user_profile_change_what_is_seen(one, changes, seen):
    _, simulated, master = one
    simulated.scene = lambda now: 3.9
    master.sensor.options.profile = "user"
    master.find()
    master.write(changes)
    (measurement,) = master.measure()
    assert (measurement.distance.outcome is Outcome.ECHO) == seen


def test_several_cycles_are_averaged(one):
    _, simulated, master = one
    values = iter([1.0, 2.0] * 50)
    simulated.scene = lambda now: next(values)
    master.sensor.options.cycles = 2
    assert master.distances()[0] == pytest.approx(1.5, abs=STEP / 2 + 1e-9)


def test_without_compensation_the_temperature_matters(one):
    _, simulated, master = one
    simulated.temperature = 50.0
    warm = master.distances()[0]
    master.write({"temperature_compensation": "off"})
    assert master.distances()[0] == pytest.approx(0.952 * warm, abs=STEP)


def test_the_rate_is_kept(one):
    _, simulated, master = one
    master.sensor.options.rate = 5.0
    master.measure(4)
    begins = [begin for begin, _ in simulated.measurements]
    gaps = [after - before for before, after in itertools.pairwise(begins)]
    assert statistics.median(gaps) == pytest.approx(0.2, abs=0.03)
    assert 3.0 < master.sensor.rate < 7.0


def test_without_a_rate_a_sensor_measures_as_fast_as_it_can(one):
    _, simulated, master = one
    master.measure(12)
    begins = [begin for begin, _ in simulated.measurements]
    gaps = [after - before for before, after in itertools.pairwise(begins)]
    # 50 ms, 5 ms of evaluation, 4 + 2 bytes and the gaps
    assert 0.055 < statistics.median(gaps) < 0.075


def test_an_inactive_bus_only_looks_whether_the_sensors_are_there(connect, monkeypatch):
    monkeypatch.setattr(session, "KEEP_ALIVE", 0.1)
    line, (simulated,) = connect()
    master = connect.master(line, active=False).find()
    asked = Requests(simulated)
    master.until(lambda: len(asked.all) >= 2)
    assert {request.op_code for request in asked.all} == {OpCode.ADDRESS}
    assert simulated.measurements == []
    master.bus.set_active(True)
    assert master.distances() == [still(0)]
    master.bus.set_active(False)
    measured = len(simulated.measurements)
    simulated.silent = True
    assert isinstance(master.lose(), NoAnswerError)
    assert len(simulated.measurements) == measured


@pytest.mark.parametrize("groups", [[], ["left right"]])
def test_one_sensor_can_be_stopped_and_started(connect, groups):
    line, simulated = connect(1, 2)
    master = connect.master(line, Options("left", address=1), Options("right", address=2),
                            groups=groups).find()
    right = master.bus.devices[1]
    master.measure(2, "right")
    master.bus.set_enabled(right, False)
    before = len(simulated[1].measurements)
    master.measure(5, "left")
    assert len(simulated[1].measurements) == before
    master.bus.set_enabled(right, True)
    master.measure(2, "right")


# --- temperature -------------------------------------------------------------------------------

def test_the_temperature_is_read_now_and_then(one):
    _, simulated, master = one
    master.sensor.options.temperature_period = 0.2
    simulated.temperature = -12.0
    begin = time.time()
    master.until(lambda: len(master.heard.temperatures) >= 3)
    assert {celsius for _, celsius, _ in master.heard.temperatures} == {-12.0}
    assert all(begin < stamp * 1e-9 < time.time() for _, _, stamp in master.heard.temperatures)
    assert len(master.heard.measurements) >= 3
    assert master.sensor.temperature == -12.0


def test_a_period_of_zero_reads_no_temperature(one):
    _, simulated, master = one
    master.sensor.options.temperature_period = 0.0
    asked = Requests(simulated)
    master.measure(5)
    assert OpCode.TEMPERATURE not in {request.op_code for request in asked.all}


def test_a_refused_temperature_does_not_stop_the_measuring(one):
    _, simulated, master = one
    simulated.refuse[OpCode.TEMPERATURE] = ErrorCode.TEMPERATURE_ERROR
    master.sensor.options.temperature_period = 0.1
    assert master.distances(5) == [still(0)] * 5
    assert "address 7 cannot read the temperature: temperature error (0x0B)" in master.heard.notes
    assert master.sensor.statistics.refusals[ErrorCode.TEMPERATURE_ERROR] >= 1
    assert master.sensor.error is None


def test_a_temperature_out_of_range_is_said_once(one):
    _, simulated, master = one
    simulated.temperature = 90.0
    master.sensor.options.temperature_period = 0.1
    master.until(lambda: len(master.heard.temperatures) >= 3)
    notes = [note for note in master.heard.notes if "°C" in note]
    assert notes == ["reports 90 °C, but is made for -25 … 70 °C: too hot, too cold or defective"]


# --- settings ----------------------------------------------------------------------------------

def test_wanted_settings_are_written_once(connect):
    line, (simulated,) = connect()
    asked = Requests(simulated)
    wanted = {"gain_db": 72, "current_ma": 171, "temperature_compensation": True}
    master = connect.master(line, Options(address=7, wanted=wanted)).find()
    assert asked.writes() == [(0x21, 0x02), (0x0A, 0xFF)]  # the gain is 72 dB already
    assert master.sensor.values == {"burst_periods": 32, "gain_db": 72.0, "current_ma": 171,
                                    "temperature_compensation": "on"}
    (note,) = master.heard.notes
    assert note == "wrote current_ma: 325 mA → 171 mA, temperature_compensation: unknown → on"


@pytest.mark.parametrize("mode", ["check", "leave"])
def test_other_modes_write_nothing(connect, mode):
    line, (simulated,) = connect()
    asked = Requests(simulated)
    wanted = {"gain_db": 60.0, "temperature_compensation": "off"}
    master = connect.master(line, Options(address=7, wanted=wanted, config_mode=mode)).find()
    assert asked.writes() == []
    assert master.sensor.differing == ({
        "gain_db": (60.0, 72.0), "temperature_compensation": ("off", "unknown")}
        if mode == "check" else {})


def test_a_write_is_read_back_and_nothing_is_written_twice(one):
    _, simulated, master = one
    master.find()
    asked = Requests(simulated)
    for _ in range(2):
        assert master.write({"gain_db": 57, "burst_periods": 64}) == {
            "gain_db": 57.0, "burst_periods": 64}
    assert asked.writes() == [(0x22, 0x01), (0x23, 0x0F)]
    assert simulated.value("gain_db") == 57.0


@pytest.mark.parametrize(("changes", "text"), [
    ({"gain_db": 57.25}, "the nearest are 57 dB and 57.5 dB"),
    ({"current_ma": 500}, "allowed is 160 … 496 mA"),
    ({"gian_db": 57.0}, 'did you mean "gain_db"'),
    ({"temperature_compensation": "warm"}, "one of on, off"),
])
def test_a_bad_value_is_refused_before_anything_is_sent(one, changes, text):
    _, simulated, master = one
    master.find()
    asked = Requests(simulated)
    with pytest.raises(SettingError, match=text):
        master.write({"burst_periods": 8, **changes})
    assert asked.all == []


def test_several_are_written_all_or_none(one):
    _, simulated, master = one
    master.find()
    simulated.refuse[OpCode.TEMPERATURE_COMPENSATION] = ErrorCode.EEPROM_ERROR
    with pytest.raises(RefusedError, match=r"eeprom error \(0x08\)"):
        master.write({"gain_db": 60.0, "temperature_compensation": "off"})
    assert simulated.value("gain_db") == 72.0
    assert master.sensor.values["gain_db"] == 72.0
    assert master.sensor.values["temperature_compensation"] == "unknown"


def test_a_sensor_that_stores_another_value_is_caught(one):
    _, simulated, master = one
    master.find()

    def stubborn(request, answer):
        if request.is_write:
            simulated.set_value("gain_db", 72.0)
        return answer

    Requests(simulated, stubborn)
    with pytest.raises(RefusedError, match="took gain_db = 60 dB but reports 72 dB"):
        master.write({"gain_db": 60.0})


def test_a_refused_setting_does_not_keep_the_others_from_being_written(connect):
    line, (simulated,) = connect()
    simulated.refuse[OpCode.TEMPERATURE_COMPENSATION] = ErrorCode.PARAMETER_ERROR
    master = connect.master(line, Options(address=7, wanted={
        "gain_db": 60.0, "temperature_compensation": "off"})).find()
    assert master.sensor.values["gain_db"] == 60.0
    assert master.sensor.differing == {"temperature_compensation": ("off", "unknown")}
    assert any("parameter error (0x05)" in note for note in master.heard.notes)


def test_a_code_beyond_the_table_is_shown_and_can_be_mended(connect):
    line, (simulated,) = connect()
    simulated.codes[OpCode.BURST] = 16
    master = connect.master(line).find()
    assert master.sensor.values["burst_periods"] == -1
    master.note("the code that it reports for burst_periods is not in table A1")
    assert master.write({"burst_periods": 16}) == {"burst_periods": 16}


def test_a_setting_that_the_firmware_does_not_have_is_left_out(connect):
    line, (simulated,) = connect()
    simulated.refuse[OpCode.CURRENT] = ErrorCode.OP_CODE_ERROR
    master = connect.master(line, Options(address=7, wanted={"current_ma": 160})).find()
    assert "current_ma" not in master.sensor.settings
    assert "this firmware has no current_ma" in master.heard.notes


# --- the line's echo ---------------------------------------------------------------------------

@pytest.mark.parametrize(("setting", "echo"), [
    ("auto", True), ("auto", False), ("on", True), ("off", False)])
def test_the_echo_is_stripped(connect, setting, echo):
    line, _ = connect()
    line.faults.echo = echo
    master = connect.master(line, local_echo=setting)
    assert master.distances(3)[-1] == still(0)
    assert master.bus.line.echo == echo


@pytest.mark.parametrize(("setting", "echo", "text"), [
    ("on", False, "local_echo is on, but the line does not return what is sent; "
                  "set local_echo to off or auto"),
    ("off", True, "local_echo is off, but the line returns what is sent; "
                  "set local_echo to on or auto")])
def test_a_wrong_echo_setting_is_named(connect, setting, echo, text):
    line, _ = connect(1)
    line.faults.echo = echo
    master = connect.master(line, Options(address=1), local_echo=setting)
    assert str(master.lose()) == text
    master.bus.line.local_echo = "auto"
    assert master.distances()[0] == still(0)


def test_the_echo_may_change_while_it_is_measuring(one):
    line, _, master = one
    master.measure()
    for echo in (True, False):
        line.faults.echo = echo
        assert set(master.distances(3)) == {still(0)}
        assert master.bus.line.echo == echo


# --- nobody, or somebody else ------------------------------------------------------------------

@pytest.mark.parametrize(("echo", "text"), [
    (False, "no answer from any sensor on {port}; check power, wiring and the address"),
    (True, "no answer from any sensor on {port}; the line returns what is sent, so it is right up "
           "to there: check the sensor's power and wiring, and the address")])
def test_no_sensor(connect, echo, text):
    line, (simulated,) = connect()
    line.faults.echo = echo
    simulated.silent = True
    master = connect.master(line, Options())
    assert str(master.lose()) == text.format(port=line.port)
    simulated.silent = False
    assert master.distances() == [still(0)]


def test_no_line_while_its_echo_is_expected(connect):
    line, (simulated,) = connect()
    simulated.silent = True
    master = connect.master(line, local_echo="on")
    assert "not even the echo of what was sent" in str(master.lose())


def test_a_sensor_at_another_address(connect):
    line, _ = connect(5)
    master = connect.master(line, Options(address=2))
    assert str(master.lose()) == (
        f"no answer from address 2 on {line.port}, but a sensor answers at address 5; "
        "correct the parameter address")


@pytest.mark.parametrize("addresses", [(3, 5), (1, 3), (2, 7), (5, 7), (2, 3, 6)], ids=str)
def test_several_sensors_where_one_is_expected(connect, addresses):
    line, _ = connect(*addresses)  # the answers of some pairs together look like that of one
    error = connect.master(line, Options()).lose()
    assert isinstance(error, WrongDeviceError)
    assert str(error) == (
        f"several sensors answer ({', '.join(map(str, addresses))}); say which one with the "
        "parameter address, or name all of them with the parameter sensors")


def test_what_looks_like_a_reply_before_anything_was_measured_shifts_nothing(connect):
    line, _ = connect(1, 2)
    master = connect.master(line, *named(1, 2)).find()
    receive = line._device.receive

    def receive_with_noise(data, now):
        line._device.receive = receive
        return [(now + 0.010, bytes.fromhex("23 D1")), *receive(data, now)]  # a distance

    master.measure(4)
    line._device.receive = receive_with_noise
    start = len(master.heard.measurements)
    master.measure(6)
    for name, measurement in master.heard.measurements[start:]:
        assert measurement.distance.value == still(int(name[1:]) - 1)
    assert sum(sensor.statistics.damaged for sensor in master.bus.devices) == 1


def test_another_device(connect):
    line, (simulated,) = connect()
    simulated.version = b"iSYS-4001 000001\0\0"
    error = connect.master(line).lose()
    assert isinstance(error, WrongDeviceError)
    assert "its version is 'iSYS-4001 000001', which is not that of a UC4000" in str(error)


class Chatterbox:
    """A device that says the same to everything."""

    baud_rate = 19200

    def receive(self, data, now):
        return [(now, b"\x02OK\r\n")]


def test_a_device_with_another_protocol():
    line = SimulatedLine(Chatterbox()).start()
    master = Master(line.port, Options(address=7))
    try:
        error = master.lose()
        assert "damaged reply from address 7: 02 4F 4B 0D 0A" in str(error)
    finally:
        master.bus.close()
        line.close()


def test_two_sensors_with_one_address(connect):
    line, _ = connect(4, 4, 5)
    master = connect.master(line, *named(4, 5))
    error = master.lose()
    assert "damaged reply from s4 (address 4)" in str(error)
    assert "two sensors have address 4" in str(error)
    assert set(master.distances(3, "s5")) == {still(2)}


def test_two_replies_to_one_request(connect):
    line, (simulated, _) = connect(4, 4)
    simulated.silent = True
    master = connect.master(line, Options(address=4)).find()
    simulated.silent = False
    error = master.lose()
    assert "two sensors have address 4" in str(error)


# --- damage, refusals, silence -----------------------------------------------------------------

def test_damaged_replies_are_counted_and_never_believed(one):
    line, _, master = one
    line.faults.echo = True
    master.find()
    line.faults.corrupt = 0.2
    master.until(lambda: master.sensor.statistics.damaged >= 2
                 and len(master.heard.measurements) >= 4)
    assert {measurement.distance.value for _, measurement in master.heard.measurements} == {
        still(0)}


def test_noise_and_pauses_cost_time_but_no_truth(one):
    line, _, master = one
    master.find()
    line.faults.noise = 0.2
    line.faults.split = 0.01
    assert set(master.distances(10)) == {still(0)}


def test_refused_measurements_are_counted_by_their_codes(one):
    _, simulated, master = one
    for code in (*range(0x01, 0x0E), 0x42, 0xFF):
        simulated.refuse[OpCode.PROFILE_B] = code
        master.until(lambda code=code: master.sensor.statistics.refusals[code])
        assert f"(0x{code:02X})" in str(master.sensor.error)
        assert master.heard.notes[-1] == f"{master.sensor.error}; it is asked again"
        assert master.sensor.identity is not None
        simulated.refuse.clear()
        master.sensor.due = 0.0  # not to wait
        assert master.distances() == [still(0)]
        assert master.sensor.error is None
        assert master.heard.notes[-1] == "is well again"
    assert master.sensor.statistics.refusals.total() == 15


def test_one_that_goes_on_refusing_is_mentioned_once(one):
    _, simulated, master = one
    simulated.refuse[OpCode.PROFILE_B] = ErrorCode.SESSION_ERROR
    master.until(lambda: master.sensor.statistics.refusals[ErrorCode.SESSION_ERROR] >= 3)
    assert master.heard.notes == [
        "address 7 cannot measure: session error (0x06); it is asked again"]


@pytest.mark.parametrize("code", TRANSMISSION)
def test_a_request_that_arrived_damaged_is_sent_again(one, code):
    _, simulated, master = one
    master.find()
    simulated.refuse[OpCode.GAIN] = code

    def only_once(request, answer):
        simulated.refuse.clear()
        return answer

    Requests(simulated, only_once)
    assert master.write({"gain_db": 60.0}) == {"gain_db": 60.0}
    assert master.sensor.statistics.refusals[code] == 1


def test_other_refusals_are_not_asked_again(one):
    _, simulated, master = one
    master.find()
    asked = Requests(simulated)
    simulated.refuse[OpCode.GAIN] = ErrorCode.SESSION_ERROR
    with pytest.raises(RefusedError, match="address 7 cannot read the amplifier gain: session"):
        master.write({"gain_db": 60.0})
    assert len(asked.all) == 1


@pytest.mark.parametrize("refuses", [False, True])
def test_one_that_is_silent_or_refuses_does_not_slow_the_others(connect, refuses):
    line, sensors = connect(1, 2, 3)
    master = connect.master(line, *named(1, 2, 3)).find()
    if refuses:
        sensors[0].refuse[OpCode.PROFILE_B] = ErrorCode.SESSION_ERROR
    else:
        sensors[0].silent = True
    master.until(lambda: master.bus.devices[0].error is not None)
    asked, before = Requests(sensors[0]), counts(master)
    begin = time.monotonic()
    master.measure(10)
    took = time.monotonic() - begin
    after = counts(master)
    assert after["s1"] == before["s1"]
    assert abs(after["s2"] - before["s2"] - 5) <= 1
    assert len(asked.all) <= 2 + 2 * math.log2(1 + took / 0.1)  # the pauses double
    sensors[0].silent = False
    sensors[0].refuse.clear()
    assert set(master.distances(2, "s1")) == {still(0)}
    assert set(master.distances(2, "s2")) == {still(1)}


def test_a_lost_sensor_returns_configured_as_before(connect):
    line, (simulated,) = connect()
    wanted = {"temperature_compensation": "off"}
    master = connect.master(line, Options(address=7, wanted=wanted)).find()
    master.write({"gain_db": 60.0})
    simulated.silent = True
    assert "no answer from address 7" in str(master.lose())
    with pytest.raises(NoAnswerError, match="is not connected: no answer from"):
        master.write({"gain_db": 61.0})
    simulated.power_cycle()
    simulated.restore_factory_settings()
    simulated.silent = False
    master.find()
    assert simulated.value("gain_db") == 60.0
    assert simulated.value("temperature_compensation") == "off"
    assert master.sensor.connections == 2


def test_a_short_loss_of_power_is_noticed_by_one_missing_reply(connect):
    line, (simulated,) = connect()
    wanted = {"gain_db": 60.0, "temperature_compensation": "off"}
    master = connect.master(line, Options(address=7, wanted=wanted))
    master.measure()
    simulated.restore_factory_settings()
    simulated.power_cycle()
    master.until(lambda: simulated.value("gain_db") == 60.0
                 and simulated.value("temperature_compensation") == "off")
    master.measure()
    assert master.sensor.values["gain_db"] == 60.0


def test_a_missing_reply_alone_writes_nothing(connect):
    line, (simulated,) = connect()
    wanted = {"gain_db": 60.0, "temperature_compensation": "off"}
    master = connect.master(line, Options(address=7, wanted=wanted))
    master.measure()
    asked = Requests(simulated)
    simulated.power_cycle()
    master.until(lambda: master.sensor.statistics.timeouts >= 1)
    master.measure()
    assert asked.writes() == []


# --- replies that come too late ----------------------------------------------------------------

def test_a_late_reply_never_passes_for_that_of_another_request(connect):
    line, _ = connect(1, 2, 3)
    master = connect.master(line, *named(1, 2, 3, temperature_period=0.3)).find()
    chance = random.Random(4)
    for _ in range(3):
        line.faults.echo = not line.faults.echo
        line.faults.delay = chance.uniform(0.05, 0.4)
        late = sum(sensor.statistics.timeouts for sensor in master.bus.devices)
        master.until(lambda late=late: sum(
            sensor.statistics.timeouts for sensor in master.bus.devices) > late
            or line.faults.delay < 0.1)
        line.faults.delay = 0.0
        for number in (1, 2, 3):
            master.measure(1, f"s{number}")
    assert len(master.heard.measurements) >= 9
    for name, measurement in master.heard.measurements:
        assert measurement.distance.value == still(int(name[1]) - 1)
    assert {celsius for _, celsius, _ in master.heard.temperatures} == {21.0}
    assert all(sensor.address == int(sensor.options.name[1]) for sensor in master.bus.devices)


def test_a_line_that_is_always_too_slow_gives_nothing_rather_than_something_wrong(one):
    line, _, master = one
    master.find()
    line.faults.delay = 0.25
    assert isinstance(master.lose(), NoAnswerError)
    assert master.heard.measurements == []
    line.faults.delay = 0.0
    assert set(master.distances(3)) == {still(0)}


def test_a_sensor_that_takes_too_long_is_not_heard_as_another_one(connect):
    line, sensors = connect(1, 2)
    master = connect.master(line, *named(1, 2)).find()
    chance = random.Random(6)

    def dawdle(request, answer):
        sensors[0].evaluation = chance.choice((0.005, chance.uniform(0.050, 0.150)))
        return answer

    Requests(sensors[0], dawdle)
    master.until(lambda: master.bus.devices[0].statistics.timeouts >= 2)
    assert len(master.heard.measurements) > 2
    for name, measurement in master.heard.measurements:
        assert measurement.distance.value == still(int(name[1]) - 1)


def test_a_reply_to_another_program_is_not_taken_for_ours(connect):
    line, _ = connect()
    port = serial.Serial(line.port, 19200)
    port.write(Request(7, OpCode.PROFILE_B, 0xFE).encode())
    port.close()
    master = connect.master(line, Options(address=7))
    assert master.distances()[0] == still(0)
    assert master.sensor.address == 7


# --- groups ------------------------------------------------------------------------------------

def overlap(first, second):
    """Whether two sensors ever measured at the same time."""
    return any(begin < other_end and other_begin < end
               for begin, end in first.measurements
               for other_begin, other_end in second.measurements)


def test_sensors_that_hear_each_other_measure_in_turn(connect):
    line, sensors = connect(1, 2, 3)
    master = connect.master(line, *named(1, 2, 3))
    master.measure(9)
    assert not any(overlap(first, second) for first in sensors for second in sensors
                   if first is not second)
    numbers = counts(master).values()
    assert max(numbers) - min(numbers) <= 1


@pytest.mark.parametrize("echo", [False, True])
def test_those_of_a_group_measure_together(connect, echo):
    line, sensors = connect(1, 2, 3)
    line.faults.echo = echo
    sensors[0].hears = [sensors[2]]
    master = connect.master(line, *named(1, 2, 3), groups=["s1 s2"])
    master.measure(12)
    master.until(lambda: overlap(sensors[0], sensors[1]))
    for name, measurement in master.heard.measurements:
        assert measurement.distance.value == still(int(name[1]) - 1)
    times = {stamp for sensor in sensors for stamp in (
        measurement.stamp for name, measurement in master.heard.measurements
        if name == f"s{sensor.address}")}
    assert len(times) == len(master.heard.measurements)


def test_a_group_of_seven_is_as_fair_as_it_is_fast(connect):
    line, _ = connect(*range(1, 8))
    master = connect.master(line, *named(*range(1, 8)),
                            groups=["s1, s2, s3, s4, s5, s6, s7"]).find()
    master.measure(7)
    before, begin = counts(master), time.monotonic()
    master.measure(21)
    took = time.monotonic() - begin
    gained = [count - before[name] for name, count in counts(master).items()]
    assert max(gained) - min(gained) <= 2
    for name, measurement in master.heard.measurements:
        assert measurement.distance.value == still(int(name[1]) - 1)
    if not master.bus.acquisition.groups[0].failures:
        assert took < 21 * 0.05  # in turn it would be 0.06 s each, and more


def test_replies_anywhere_in_their_spread_do_not_meet(connect):
    line, sensors = connect(1, 2, 3)
    chance = random.Random(5)
    for sensor in sensors:
        def another(request, answer, sensor=sensor):
            sensor.evaluation = chance.uniform(0.0, 0.010)
            return answer
        Requests(sensor, another)
    master = connect.master(line, *named(1, 2, 3), groups=["s1 s2 s3"])
    master.measure(18)
    for name, measurement in master.heard.measurements:
        assert measurement.distance.value == still(int(name[1]) - 1)
    master.until(lambda: overlap(sensors[0], sensors[1]))


def test_replies_out_of_order_are_not_mixed_up(connect):
    line, sensors = connect(1, 2)
    master = connect.master(line, *named(1, 2), groups=["s1 s2"]).find()
    sensors[0].evaluation = 0.040  # four times what the manual allows: it answers after the other
    master.until(lambda: master.bus.acquisition.groups[0].failures)
    master.measure(2)
    for name, measurement in master.heard.measurements:
        assert measurement.distance.value == still(int(name[1]) - 1)


def test_how_many_can_measure_together():
    # 20.1 ms apart, and the last one is asked before the first one can reply
    assert [most_together(cycles) for cycles in (1, 2, 3)] == [3, 5, 8]


@pytest.mark.parametrize("trouble", ["slow", "refuses", "silent"])
def test_a_group_that_does_not_work_together_is_measured_one_by_one(connect, trouble):
    line, sensors = connect(1, 2, 3)
    master = connect.master(line, *named(1, 2, 3), groups=["s1 s2 s3"])
    master.until(lambda: overlap(sensors[0], sensors[1]))
    if trouble == "slow":
        sensors[1].evaluation = 0.025  # more than the manual allows: its reply meets the next
    elif trouble == "refuses":
        sensors[1].refuse[OpCode.PROFILE_B] = ErrorCode.SESSION_ERROR
    else:
        sensors[1].silent = True
    master.until(lambda: master.bus.acquisition.groups[0].failures >= 1)
    assert any("cannot measure together with its group" in note for note in master.heard.notes)
    assert master.distances(1, "s1")[0] == still(0)
    assert master.distances(1, "s3")[0] == still(2)
    sensors[1].evaluation, sensors[1].silent = 0.005, False
    sensors[1].refuse.clear()
    master.measure(1, "s2")
    for name, measurement in master.heard.measurements:
        assert measurement.distance.value == still(int(name[1]) - 1)


def test_on_a_bad_line_those_of_a_group_are_not_mixed_up(connect):
    line, sensors = connect(1, 2, 3)
    master = connect.master(line, *named(1, 2, 3), groups=["s1 s2 s3"]).find()
    group = master.bus.acquisition.groups[0]
    group.backoff.first = group.backoff.last = 0.01
    group.backoff.reset()
    line.faults.corrupt = line.faults.drop = line.faults.noise = 0.05
    master.until(lambda: group.failures >= 3)
    line.faults.corrupt = line.faults.drop = line.faults.noise = 0.0
    master.until(lambda: overlap(sensors[0], sensors[1]))
    for name, measurement in master.heard.measurements:
        assert measurement.distance.value == still(int(name[1]) - 1)


@pytest.mark.parametrize(("groups", "text"), [
    (["left rear", "front left"], "groups: left is in two groups"),
    (["left raer"], 'groups: there is no sensor "raer"; did you mean "rear"?'),
])
def test_bad_groups(groups, text):
    options = [Options(name=name, address=number)
               for number, name in enumerate(("left", "rear", "front"), 1)]
    with pytest.raises(SettingError) as caught:
        Uc4000Bus("", options, Listener(), groups=groups)
    assert str(caught.value) == text


@pytest.mark.parametrize(("addresses", "text"), [
    ((1, 0), r"s1\.address must be given, 1 … 7: only a single sensor can be asked for it"),
    ((3, 3), r"s0\.address = 3 belongs to two sensors"),
])
def test_bad_addresses(addresses, text):
    with pytest.raises(SettingError, match=text):
        Uc4000Bus("", [Options(name=f"s{number}", address=address)
                       for number, address in enumerate(addresses)], Listener())


# --- addresses ---------------------------------------------------------------------------------

def test_an_address_is_assigned_and_followed(one):
    _, simulated, master = one
    master.find()
    master.bus.maintenance.change_address(master.sensor, 2)
    assert simulated.address == 2
    assert master.sensor.address == master.sensor.options.address == 2
    assert master.distances() == [still(0)]
    master.bus.close()
    master.bus.open()
    assert master.find().sensor.address == 2


def test_a_lost_acknowledge_of_a_new_address_is_no_failure(one):
    _, simulated, master = one
    master.find()
    Requests(simulated, lambda request, answer: None if request.is_write else answer)
    master.bus.maintenance.change_address(master.sensor, 2)
    assert simulated.address == master.sensor.address == 2


@pytest.mark.parametrize(("address", "error", "text"), [
    (0, SettingError, "out of range, allowed is 1 … 7"),
    (8, SettingError, "out of range, allowed is 1 … 7"),
    (1, SettingError, "the sensor has address 1 already"),
    (2, SettingError, "address 2 belongs to another sensor"),
    (3, SettingError, "address 3 belongs to another sensor"),  # not one of this driver
])
def test_an_address_that_cannot_be_assigned(connect, address, error, text):
    line, sensors = connect(1, 2, 3)
    master = connect.master(line, *named(1, 2)).find()
    asked = Requests(sensors[0])
    with pytest.raises(error, match=text):
        master.bus.maintenance.change_address(master.sensor, address)
    assert asked.writes() == []


def test_a_refused_address_leaves_everything_as_it_was(one):
    _, simulated, master = one
    master.find()
    simulated.refuse[OpCode.ADDRESS] = ErrorCode.EEPROM_ERROR
    with pytest.raises(RefusedError, match="cannot change the address: eeprom error"):
        master.bus.maintenance.change_address(master.sensor, 2)
    assert master.sensor.address == 7
    assert master.distances() == [still(0)]


def test_identify_asks_again(one):
    _, simulated, master = one
    master.find()
    simulated.serial_number = "40000016900099"
    assert master.bus.maintenance.identify(master.sensor).serial_number == "40000016900099"


# --- the port ----------------------------------------------------------------------------------

def test_no_port():
    with pytest.raises(LinkError, match="there is no such port"):
        Uc4000Bus("/dev/ttyUSB77", [Options()], Listener()).open()


def test_a_port_without_permission(monkeypatch):
    def refuse(*_, **__):
        raise serial.SerialException(errno.EACCES, "permission denied")

    monkeypatch.setattr(serial, "serial_for_url", refuse)
    with pytest.raises(LinkError, match="add yourself to the group dialout"):
        Uc4000Bus("/dev/ttyUSB0", [Options()], Listener()).open()


def test_a_port_that_is_in_use(one):
    line, _, _ = one
    with pytest.raises(LinkError, match="in use by another program"):
        Uc4000Bus(line.port, [Options()], Listener()).open()


def test_unplugged_and_plugged_in_again(connect, tmp_path):
    link = str(tmp_path / "uc4000")
    line, _ = connect(link=link)
    master = Recorder()
    bus = Uc4000Bus(link, [Options()], master)
    states = []
    thread = DeviceThread("bus", bus, states.append)
    thread.start()
    thread.call(lambda: bus.set_active(True))
    wait_until(lambda: master.measurements)
    line.close()
    wait_until(lambda: isinstance(states[-1], LinkError))
    with pytest.raises(NoAnswerError, match="is not connected: "):
        thread.call(lambda: bus.maintenance.write(bus.devices[0], {"gain_db": 60.0}))
    connect(link=link)
    before = len(master.measurements)
    wait_until(lambda: len(master.measurements) > before)
    assert states[-1] is None
    thread.stop()


def test_a_long_measurement_does_not_delay_the_end(connect):
    line, (simulated,) = connect()
    heard = Recorder()
    bus = Uc4000Bus(line.port, [Options(cycles=255)], heard)
    thread = DeviceThread("bus", bus, lambda error: None)
    thread.start()
    thread.call(lambda: bus.set_active(True))
    wait_until(lambda: simulated.measurements)
    begin = time.monotonic()
    thread.stop()
    assert time.monotonic() - begin < 5.0  # the measurement takes 12.75 s
    assert heard.measurements == []


# --- the simulated sensor itself ---------------------------------------------------------------

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
