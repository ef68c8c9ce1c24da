# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a session makes of sensors that are well: find, measure, configure, move."""

from __future__ import annotations

import errno
import itertools
import math
import statistics
import time

import pytest
import serial
from bus_master import wait_until
from uc4000_master import Recorder, Requests, named, still

from driver_common.device_thread import DeviceThread
from driver_common.errors import (
    LinkError,
    NoAnswerError,
    RefusedError,
    SettingError,
)
from uc4000_driver import session
from uc4000_driver.commands import OpCode, Outcome
from uc4000_driver.listener import Listener
from uc4000_driver.sensor import Options
from uc4000_driver.session import Uc4000Bus
from uc4000_driver.simulator.scene import EMPTY, FULL, filling
from uc4000_driver.telegram import ErrorCode

STEP = 0.016  # m

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
    assert min(map(abs, errors)) < 0.010  # others came late


def test_distances_are_those_at_the_stamps(one):
    _, simulated, master = one
    simulated.scene = lambda now: 1.0 + now % 1.0  # 1 m/s, with a jump every second
    errors = [measurement.distance.value - (1.0 + measurement.stamp * 1e-9 % 1.0)
              for measurement in master.measure(16)]
    assert min(map(abs, errors)) < 0.010  # others were delayed, or at the jump


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
    assert statistics.mean(gaps) > 0.15  # it would be 0.06 without
    assert 0.0 < master.sensor.rate < 7.0


@pytest.mark.parametrize(("rates", "cycles", "groups", "reachable"), [
    ([20.0], 1, [], 16.9),
    ([20.0], 10, [], 2.0),
    ([0.0, 0.0, 0.0], 1, [], 5.63),
    ([20.0, 5.0], 1, [], 11.9),  # 5 Hz take 30 % of the line
    ([20.0, 20.0], 1, [], 8.45),
    ([20.0, 20.0, 20.0], 1, ["s1 s2 s3"], 10.07),
])
def test_the_rate_that_can_be_reached(rates, cycles, groups, reachable):
    options = [Options(f"s{number}", address=number, rate=rate, cycles=cycles)
               for number, rate in enumerate(rates, 1)]
    bus = Uc4000Bus("", options, Listener(), groups=groups)
    assert bus.acquisition.reachable_rate(bus.devices[0]) == pytest.approx(reachable, abs=0.06)


def test_a_rate_that_cannot_be_reached_is_warned_of_once(one):
    _, _, master = one
    master.sensor.options.rate = 10.0
    master.measure(2)
    assert master.heard.warnings == []
    master.sensor.options.cycles = 4
    master.measure(3)
    assert master.heard.warnings == [
        "rate = 10 Hz cannot be reached: with cycles = 4, and what the others on the line are to "
        "do, it will be about 4.8 Hz"]


def test_without_a_rate_a_sensor_measures_as_fast_as_it_can(one):
    _, simulated, master = one
    master.measure(12)
    begins = [begin for begin, _ in simulated.measurements]
    gaps = [after - before for before, after in itertools.pairwise(begins)]
    # 50 ms, 5 ms of evaluation, 4 + 2 bytes and the gaps
    assert 0.055 < min(gaps) < 0.075


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
    thread.stop()
    assert time.monotonic() < simulated.measurements[0][1]  # the measurement takes 12.75 s
    assert heard.measurements == []
