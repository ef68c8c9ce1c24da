# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The conversation with simulated radars over a real pseudo-terminal or TCP."""

from __future__ import annotations

import dataclasses
import math
import re

import numpy as np
import pytest
from isys_master import (
    FAST_LINE,
    Lab,
    Master,
    Script,
    Truth,
    are_same,
    counted_requests,
    function_code,
    half_a_step,
)
from virtual_line import VirtualLink, VirtualMaster, VirtualTime

from driver_common.errors import NoAnswerError, RefusedError, SettingError, WrongDeviceError
from driver_common.simulator.line import Faults
from isys_radar_driver import access, commands, connection, maintenance
from isys_radar_driver.commands import Location
from isys_radar_driver.frames import FAILURE, MASTER, Frame
from isys_radar_driver.models import MODELS, find_model
from isys_radar_driver.radar import Identity, Options, Radar
from isys_radar_driver.simulator import radar as simulated_radar
from isys_radar_driver.targets import Target

WITH_LISTS = [name for name, model in MODELS.items() if model.has_target_lists]


@pytest.fixture
def lab():
    with Lab() as lab:
        yield lab


@pytest.fixture
def start(lab):
    return lab.start


@pytest.fixture
def connect(lab):
    return lab.connect


# --- finding a radar ---------------------------------------------------------------------------

@pytest.mark.parametrize("name", MODELS)
def test_every_model_is_found_and_identified(connect, name):
    master, _, simulated = connect(name, baud_rate=0)
    identity = master.radar.identity
    assert identity.model.name == name
    assert identity.device_name == f"{name} 000001"
    assert identity.serial_number == "000001"
    assert [str(version) for version in (identity.firmware, identity.dsp_hardware,
                                         identity.rfe_hardware, identity.bootloader)
            ] == ["1.310", "1.1", "1.2", "1.0000"]
    assert master.radar.address == simulated.model.address
    assert master.bus.line.baud_rate == simulated.model.baud_rate
    assert master.radar.settings.keys() == simulated.settings.keys()
    assert master.radar.values == {name: simulated.value(name) for name in simulated.settings}


def test_a_radar_is_found_over_tcp(start):
    line, simulated = start("iSYS-4001", listen="127.0.0.1:0")
    assert line.port.startswith("socket://127.0.0.1:")
    master = Master(line.port).find()
    master.measure(3)
    master.bus.close()
    assert not simulated.measuring


def test_a_radar_is_found_at_the_address_given(start):
    line, simulated = start("iSYS-4001", addresses=[17])
    master = Master(line.port, Options(address=17)).find()
    assert master.radar.address == simulated.address == 17


def test_a_radar_whose_address_is_not_known_is_asked_for_it(start):
    line, _ = start("iSYS-4001", addresses=[200])
    assert Master(line.port).find().radar.address == 200


def test_a_radar_with_another_baud_rate_than_its_default_is_found(start):
    line, _ = start("iSYS-4001", baud_rate=57600)
    assert Master(line.port).find().bus.line.baud_rate == 57600


def test_of_several_radars_each_is_found_by_its_address(start):
    line, *_ = start("iSYS-4001", "iSYS-4004", addresses=[10, 11])
    master = Master(line.port, Options("rear", address=11), Options("front", address=10)).find()
    assert [radar.product for radar in master.bus.devices] == ["iSYS-4004", "iSYS-4001"]


def test_a_wrong_address_is_named_with_the_right_one(start):
    line, _ = start("iSYS-4001", addresses=[17])
    error = Master(line.port, Options(address=5)).lose()
    assert isinstance(error, NoAnswerError)
    assert "no answer at address 5" in str(error)
    assert "a sensor answers at address 17 and 115200 Bd" in str(error)
    assert "address" in str(error).partition("correct")[2]


def test_a_wrong_baud_rate_is_named_with_the_right_one(start):
    line, _ = start("iSYS-4001")
    error = Master(line.port, baud_rate=57600).lose()
    assert "at 57600 Bd, but a sensor answers at address 128 and 115200 Bd" in str(error)
    assert "serial_baud" in str(error)


def test_a_radar_that_answers_only_some_requests_is_named(start):
    line, _ = start("iSYS-4001")
    line.faults = Script(lambda due, reply: [] if function_code(reply) == 0xD0 else [(due, reply)])
    error = Master(line.port, baud_rate=115200).lose()
    assert f"no answer on {line.port} at 115200 Bd; it answers only some requests" in str(error)
    assert "check the wiring" in str(error)


def test_without_an_answer_the_user_is_told_what_to_check(start):
    line, simulated = start("iSYS-4001")
    simulated.silent = True
    error = Master(line.port, Options(address=128, model=find_model("4001"))).lose()
    assert f"no answer at address 128 on {line.port} at 115200 Bd" in str(error)
    assert "check power, wiring" in str(error)


def test_bytes_that_are_no_frames_are_named(start):
    line, _ = start("iSYS-4001")
    line.faults = Script(lambda due, reply: [(due, b"\r\nlogin: \r\n")])
    error = Master(line.port, baud_rate=115200).lose()
    assert "bytes arrive that are no iSYS frames" in str(error)


def test_several_answers_to_the_question_for_the_address_are_named(start):
    line, _ = start("iSYS-4001")

    def two_answers(due, reply):
        other = Frame(MASTER, 30, commands.READ_SENSOR, b"\0\x1e").encode()
        return [(due, reply), (due + 0.02, other)]

    line.faults = Script(two_answers)
    error = Master(line.port).lose()
    assert isinstance(error, WrongDeviceError)
    assert "several sensors answer (30, 128)" in str(error)
    assert "address" in str(error)


def test_radars_that_answer_at_the_same_time_are_not_taken_for_one(start):
    line, *_ = start("iSYS-4001", "iSYS-4001", addresses=[0x81, 0x82])
    error = Master(line.port, Options(model=find_model("4001"))).lose()
    assert "no answer" in str(error)
    assert "bytes arrive that are no iSYS frames" in str(error)


def test_a_product_that_is_not_known_is_named(start):
    line, simulated = start("iSYS-4001")
    simulated.model = dataclasses.replace(simulated.model, name="iSYS-9999")
    error = Master(line.port).lose()
    assert isinstance(error, WrongDeviceError)
    assert "9999" in str(error)
    assert "iSYS-6203" in str(error)


def test_another_model_than_expected_is_refused(start):
    line, _ = start("iSYS-4004")
    error = Master(line.port, Options(model=find_model("iSYS-4001"))).lose()
    assert isinstance(error, WrongDeviceError)
    assert "expected an iSYS-4001, but an iSYS-4004 answers at address 128" in str(error)


def test_an_error_that_stays_the_same_is_told_once(start):
    line, simulated = start("iSYS-4004")
    master = Master(line.port, Options(model=find_model("iSYS-4001")))
    requests = counted_requests(simulated)
    master.lose()
    before = len(requests)
    master.until(lambda: len(requests) > before + 6)  # it was asked again
    assert len(master.heard.lost) == 1


def test_old_firmware_may_lack_a_version_and_a_setting(start):
    line, simulated = start("iSYS-4001")
    reply = simulated.reply

    def old(request, now):
        if request.pdu in (commands.READ_BOOTLOADER_VERSION.sub_function, b"\x00\x2d"):
            return now, Frame(MASTER, simulated.address, FAILURE)
        return reply(request, now)

    simulated.reply = old
    master = Master(line.port).find()
    assert master.radar.identity.bootloader is None
    assert "led" not in master.radar.settings
    assert "led" not in master.radar.values
    assert any("led" in note for note in master.heard.notes)


def test_what_a_radar_told_once_is_not_missing_because_it_refuses_for_a_while(start):
    line, simulated = start("iSYS-4001")
    master = Master(line.port).find()
    told = dict(master.radar.values)
    assert "led" in told
    simulated.refuse = {0xD2, 0xD5}
    with pytest.raises(RefusedError):
        master.bus.connection.read_all(master.radar)
    assert master.radar.values == told
    assert master.radar.settings.keys() == told.keys()
    assert master.heard.warnings == []


def test_firmware_before_1_310_has_four_frequency_channels(start):
    line, simulated = start("iSYS-4001")
    reply = simulated.reply

    def old(request, now):
        if request == commands.READ_FIRMWARE_VERSION.request(simulated.address):
            return now, Frame(MASTER, simulated.address, 0xD6, bytes.fromhex("0001 0003 0135"))
        return reply(request, now)

    simulated.reply = old
    master = Master(line.port).find()
    assert str(master.radar.identity.firmware) == "1.309"
    assert master.radar.settings["frequency_channel"].maximum == 4


# --- settings ----------------------------------------------------------------------------------

def both_ends(settings):
    """Return the lowest and the highest value of each setting, or the first and last choice."""
    low, high = {}, {}
    for name, setting in settings.items():
        if setting.read_only:
            continue
        if setting.choices is not None:
            low[name], *_, high[name] = setting.choices
        elif setting.kind is str:
            low[name], high[name] = "0.0.0.0", "255.255.255.255"
        elif setting.kind is bool:
            low[name], high[name] = False, True
        else:
            low[name], high[name] = setting.limits
    return low, high


@pytest.mark.parametrize("name", MODELS)
def test_every_setting_takes_both_ends_of_its_range(connect, name):
    master, _, simulated = connect(name)
    low, high = both_ends(master.radar.settings)
    for values in (high, low):
        assert master.maintenance.write(master.radar, values) == values
        assert {name: simulated.value(name) for name in values} == values
        assert {name: master.radar.values[name] for name in values} == values


@pytest.mark.parametrize("name", ["iSYS-4001", "iSYS-5110", "iSYS-6203"])
def test_every_setting_can_be_written_alone(connect, name):
    master, _, simulated = connect(name)
    low, high = both_ends(master.radar.settings)
    for name in low:  # a smallest value goes down first and its largest up first
        for values in (low, high) if "_max" in name else (high, low):
            change = {name: values[name]}
            assert master.maintenance.write(master.radar, change)[name] == values[name]
            assert simulated.value(name) == values[name]


def test_a_value_is_rounded_to_what_the_device_can_hold(connect):
    master, _, simulated = connect()
    reported = master.maintenance.write(master.radar, {"output1.range_max": 12.34,
                                               "threshold_minimum_db": -1.26})
    assert reported == {"output1.range_max": 12.3, "threshold_minimum_db": -1.3}
    assert simulated.value("output1.range_max") == 12.3


def test_a_minimum_above_the_old_maximum_is_written_together_with_the_new_one(connect):
    master, _, simulated = connect()
    master.maintenance.write(master.radar, {"output1.range_min": 1.0, "output1.range_max": 5.0})
    master.maintenance.write(master.radar, {"output1.range_min": 20.0, "output1.range_max": 30.0})
    assert simulated.value("output1.range_min") == 20.0
    master.maintenance.write(master.radar, {"output1.range_max": 5.0, "output1.range_min": 1.0})
    assert simulated.value("output1.range_max") == 5.0


def test_a_refusal_is_told_with_the_value_and_nothing_changes(connect):
    master, _, simulated = connect()
    before = dict(simulated.ram)
    with pytest.raises(RefusedError) as caught:
        master.maintenance.write(master.radar, {"output1.rising_delay_cycles": 7,
                                        "output1.range_max": 10.0, "output1.range_min": 20.0})
    assert "output1.range_min = 20 m" in str(caught.value)
    assert "0xFD" in str(caught.value)
    assert simulated.ram == before
    assert master.radar.values["output1.rising_delay_cycles"] == 0


def test_after_a_write_without_an_answer_the_radar_is_read_again(connect, monkeypatch):
    monkeypatch.setattr(access, "EEPROM_TIMEOUT", 0.1)
    master, line, simulated = connect()

    def deaf(due, reply):  # it takes the value, and its acknowledge and all else gets lost
        line.faults.silent = simulated.value("output1.range_max") == 10.0
        return [] if line.faults.silent else [(due, reply)]

    line.faults = Script(deaf)
    with pytest.raises(NoAnswerError):
        master.maintenance.write(master.radar, {"output1.range_max": 10.0})
    assert isinstance(master.heard.lost[0][1], NoAnswerError)
    line.faults = Faults()
    master.find()
    assert master.radar.values["output1.range_max"] == simulated.value("output1.range_max")


@pytest.mark.parametrize(("name", "value", "words"), [
    ("output1.range_max", 150.1, "allowed is 0 … 150 m"),
    ("output1.range_max", "far", "must be a number"),
    ("output1.direction", "approching", 'did you mean "approaching"?'),
    ("output1.range_maximum", 3.0, 'did you mean "output1.range_max"?'),
    ("frequency_channel", 9, "allowed is 1 … 8"),
])
def test_what_is_wrong_is_not_sent(connect, name, value, words):
    master, _, simulated = connect()
    requests = counted_requests(simulated)
    with pytest.raises(SettingError) as caught:
        master.maintenance.write(master.radar, {name: value})
    assert words in str(caught.value)
    assert not requests


def test_a_setting_that_can_be_read_only_is_not_written(connect):
    master, _, _ = connect("iSYS-6005")
    with pytest.raises(SettingError, match="measurement_mode can be read only"):
        master.maintenance.write(master.radar, {"measurement_mode": "fast"})


def test_a_setting_that_already_is_as_wanted_is_not_written(connect):
    master, _, simulated = connect()
    simulated.refuse.add(commands.READ_APPLICATION + 1)
    assert master.maintenance.write(master.radar, {"output1.range_max": 150.0}) == {
        "output1.range_max": 150.0}


def test_a_value_that_the_device_took_but_does_not_hold_is_an_error(connect):
    master, _, simulated = connect()
    written = simulated._write_record
    simulated._write_record = lambda *arguments: b""  # acknowledges, and forgets
    with pytest.raises(RefusedError, match="reports 150 m"):
        master.maintenance.write(master.radar, {"output1.range_max": 10.0})
    simulated._write_record = written


@pytest.mark.parametrize(("model", "name", "value"), [
    ("iSYS-4001", "frequency_channel", 3), ("iSYS-6003", "measurement_mode", "fast")])
def test_a_setting_that_needs_it_stops_the_acquisition_and_starts_it_again(
        connect, model, name, value):
    master, _, simulated = connect(model)
    master.measure()
    assert master.maintenance.write(master.radar, {name: value}) == {name: value}
    assert simulated.value(name) == value
    assert simulated.measuring
    assert master.radar.measuring
    master.measure(2)
    assert master.heard.lost == []


def test_another_setting_leaves_the_acquisition_running(connect):
    master, _, simulated = connect()
    master.measure()
    simulated.refuse.add(0xD1)  # start and stop
    master.maintenance.write(master.radar, {"output1.range_max": 10.0})
    simulated.refuse.clear()
    assert simulated.measuring


def test_after_a_refusal_the_acquisition_runs_again(connect):
    master, _, simulated = connect("iSYS-6003")
    master.measure()
    simulated.refuse.add(commands.READ_SENSOR + 1)
    with pytest.raises(RefusedError):
        master.maintenance.write(master.radar, {"measurement_mode": "fast"})
    assert simulated.measuring
    master.measure(2)


def test_the_measurement_mode_changes_cycle_time_and_targets(connect):
    master, _, _ = connect("iSYS-6003")
    assert len(master.measure()[0].targets) == 3
    assert (master.radar.cycle_time, master.radar.max_targets) == (0.2, 30)
    master.maintenance.write(master.radar, {"measurement_mode": "fast"})
    assert len(master.measure()[0].targets) == 1
    assert (master.radar.cycle_time, master.radar.max_targets) == (0.05, 1)


def test_what_the_device_stores_at_once_is_not_unsaved(connect):
    master, _, simulated = connect()
    master.maintenance.write(master.radar, {"led": "disabled", "output1.range_max": 10.0})
    assert simulated.value("led", Location.EEPROM) == "disabled"
    assert master.radar.unsaved == {"output1.range_max"}


# --- start and stop ----------------------------------------------------------------------------

@pytest.mark.parametrize("running", [True, False])
def test_a_radar_may_refuse_to_start_or_stop_again(start, running):
    line, simulated = start("iSYS-4001", baud_rate=FAST_LINE)
    simulated.strict, simulated.measuring = True, running
    master = Master(line.port, Options(wanted={"frequency_channel": 3}), baud_rate=FAST_LINE)
    master.find()
    assert simulated.value("frequency_channel") == 3
    assert not simulated.measuring
    master.measure(2)
    assert master.heard.warnings == []
    assert master.heard.lost == []


def test_a_radar_that_measures_unknown_to_the_driver_is_started_all_the_same(connect):
    master, _, simulated = connect()
    simulated.strict = simulated.measuring = True
    master.measure(2)
    assert master.heard.warnings == []


def test_a_radar_that_stopped_by_itself_can_be_stopped(connect):
    master, _, simulated = connect()
    master.bus.set_active(True)
    simulated.strict, simulated.measuring = True, False
    master.bus.set_active(False)
    master.until(lambda: master.radar.measuring is False)
    assert master.heard.lost == []


def test_a_radar_that_does_not_start_is_not_taken_for_one_that_does(connect):
    master, _, simulated = connect()
    simulated.refuse.add(commands.START.function_code)
    master.bus.set_active(True)
    assert "cannot start the acquisition: address 128 answers with failure" in str(master.lose())
    simulated.refuse.clear()
    master.lists()


def test_a_setting_that_was_written_counts_although_the_start_is_refused(connect):
    master, _, simulated = connect()
    master.measure()
    reply = simulated.reply

    def no_start(request, now):
        refused = request == commands.START.request(128)
        return (now, Frame(MASTER, 128, FAILURE)) if refused else reply(request, now)

    simulated.reply = no_start
    change = {"frequency_channel": 5}
    assert master.maintenance.write(master.radar, change) == change
    simulated.reply = reply
    master.lists()


# --- settings that the user wants --------------------------------------------------------------

WANTED = {"output1.range_max": 42.0, "frequency_channel": 5, "output2.direction": "receding"}


def test_wanted_settings_are_written_and_told(connect):
    master, _, simulated = connect(wanted=dict(WANTED))
    assert {name: simulated.value(name) for name in WANTED} == WANTED
    assert master.radar.differing == {}
    (note,) = master.heard.notes
    assert note.startswith("wrote ")
    assert "output1.range_max: 150 m → 42 m" in note
    assert "frequency_channel: 1 → 5" in note


def test_wanted_settings_that_the_radar_has_already_are_not_written(start):
    line, simulated = start("iSYS-4001")
    for name, value in WANTED.items():
        simulated.set_value(name, value)
    simulated.refuse |= {commands.READ_SENSOR + 1, commands.READ_APPLICATION + 1}
    master = Master(line.port, Options(wanted=dict(WANTED))).find()
    assert master.heard.notes == []
    assert master.radar.differing == {}


@pytest.mark.parametrize(("mode", "differing"), [
    ("check", {"output1.range_max": (42.0, 150.0), "frequency_channel": (5, 1),
               "output2.direction": ("receding", "both")}),
    ("leave", {})])
def test_settings_are_left_as_they_are_where_that_is_wanted(connect, mode, differing):
    master, _, simulated = connect(wanted=dict(WANTED), config_mode=mode)
    assert simulated.ram == simulated.eeprom
    assert master.radar.differing == differing


def test_of_wanted_settings_the_possible_ones_are_written(connect):
    master, _, simulated = connect(wanted={"output1.range_max": 42.0, "output1.range_min": 50.0,
                                           "frequency_channel": 99})
    assert simulated.value("output1.range_max") == 42.0
    assert simulated.value("output1.range_min") == 0.0
    assert master.radar.differing == {"output1.range_min": (50.0, 0.0),
                                      "frequency_channel": (99, 1)}
    assert any("frequency_channel = 99 is out of range" in note for note in master.heard.notes)
    assert any("output1.range_min = 50 m" in note for note in master.heard.notes)


def test_a_wanted_setting_that_needs_it_is_written_while_the_radar_measures(start):
    line, simulated = start("iSYS-4001")
    simulated.measuring = True  # left running by another program
    master = Master(line.port, Options(wanted={"frequency_channel": 5})).find()
    assert simulated.value("frequency_channel") == 5
    assert not simulated.measuring
    assert master.radar.differing == {}


# --- measuring ---------------------------------------------------------------------------------

@pytest.mark.parametrize(("model", "bits"), [
    (name, bits) for name in WITH_LISTS
    for bits in dict.fromkeys(resolution.bits for resolution in MODELS[name].resolutions)])
def test_target_lists_are_what_was_in_front_of_the_radar(connect, model, bits):
    master, _, simulated = connect(model, resolution=bits)
    truth = Truth(simulated)
    master.measure(3 if master.radar.cycle_time < 0.1 else 1)
    tolerance = half_a_step(model, bits)
    truth.confirm(master.heard.lists, tolerance)
    for _, measured, stamp in master.heard.lists:  # the truth moves 20 m/s at most
        assert measured.targets
        assert are_same(measured.targets, truth.at(stamp * 1e-9),
                        [largest + 20.0 * 0.5 for largest in tolerance])


def test_stamps_of_regular_cycles_do_not_carry_the_jitter_of_polls(monkeypatch):
    monkeypatch.setattr(Radar, "cycle_time", 0.075)
    radar = Radar(Options())
    measured = np.arange(1600) * 0.0754e9  # simulated time
    arrivals = np.ceil(measured / 16e6) * 16e6
    begin = 1_800_000_000 * 10**9
    stamps = np.array([radar.time_in_cycle(begin + round(arrival), 0) - begin
                       for arrival in arrivals])
    assert (stamps <= arrivals + 1e6).all()
    late = (stamps - measured)[600:] * 1e-6
    assert np.quantile(np.abs(late - np.median(late)), 0.99) < 1.0
    radar.forget_lists()
    assert radar.time_in_cycle(begin, 0) == pytest.approx(begin, abs=1e6)


def test_stamps_follow_the_device_cycle(connect):
    master, _, _ = connect()
    master.measure(8)
    stamps = np.array([stamp for _, _, stamp in master.heard.lists]) * 1e-9
    cycles = np.round(np.diff(stamps) / 0.075)
    assert (cycles >= 0).all()
    assert np.abs(np.diff(stamps) / 0.075 - cycles).min() < 0.2  # others: on a busy machine


def radar_of(model, **options):
    """Return a radar that is known to be of this model, without a line."""
    radar = Radar(Options(**options))
    radar.identity = Identity(find_model(model), "", None, None, None, None)
    return radar


@pytest.mark.parametrize(("model", "baud_rate", "bits"), [
    ("iSYS-4001", 115200, 32), ("iSYS-4001", 9600, 16), ("iSYS-4003", 9600, 16),
    ("iSYS-4003", 115200, 32), ("iSYS-6005", 230400, 32)])
def test_auto_takes_the_finest_resolution_that_fits_the_cycle(model, baud_rate, bits):
    assert radar_of(model).resolution(baud_rate).bits == bits


def test_a_resolution_that_the_model_lacks_is_refused_with_a_way_out(start):
    line, _ = start("iSYS-6005")
    master = Master(line.port, Options(resolution=16), baud_rate=230400)
    assert str(master.lose()) == ("iSYS-6005 has no target lists of 16 bit; set "
                                  "target_list_resolution to auto")
    master.radar.options.resolution = 0
    master.measure()


@pytest.mark.parametrize(("sharing", "bits"), [(1, 32), (2, 16)])
def test_auto_leaves_room_for_the_other_radars_of_the_line(sharing, bits):
    assert radar_of("iSYS-4001").resolution(115200, sharing).bits == bits


@pytest.mark.parametrize(("baud_rate", "bits"), [(0, 16), (115200, 32)])
def test_behind_a_socket_the_line_has_the_baud_rate_of_the_model(start, baud_rate, bits):
    line, _ = start("iSYS-4003", listen="127.0.0.1:0")
    master = Master(line.port, baud_rate=baud_rate).find()
    assert master.bus.line.baud_rate == (baud_rate or 9600)
    assert master.radar.resolution(master.bus.line.baud_rate).bits == bits


def test_the_length_of_a_fixed_length_list_is_learned(connect):
    master, _, _ = connect("iSYS-6005")
    assert master.radar.fixed_targets == 0
    assert len(master.measure()[0].targets) == 3
    assert master.radar.fixed_targets == 10
    assert all(len(measured.targets) == 3 for measured in master.measure(5))
    assert (master.bus.line.parser.damaged_frames, master.bus.line.parser.dropped_bytes) == (0, 0)


def test_the_length_is_learned_again_after_a_reconnection(connect, monkeypatch):
    master, _, _ = connect("iSYS-6005")
    master.measure()
    master.bus.close()
    assert master.radar.fixed_targets == 0
    monkeypatch.setattr(simulated_radar, "FIXED_TARGETS", 12)  # another firmware
    master.bus.open()
    master.lists()
    assert master.radar.fixed_targets == 12


def test_the_length_is_learned_from_an_empty_list_as_well(connect):
    master, _, simulated = connect("iSYS-6005")
    simulated.scene = lambda now: []
    assert master.measure()[0].targets == ()
    assert master.radar.fixed_targets == 10


@pytest.mark.parametrize(("model", "bits"), [
    ("iSYS-4001", 16), ("iSYS-4001", 32), ("iSYS-6005", 32)])
def test_clipping_is_an_empty_list_and_counted(connect, model, bits):
    master, _, simulated = connect(model, resolution=bits)
    simulated.clipping = True
    for measured in master.measure(3):
        assert measured.clipping
        assert measured.targets == ()
    assert master.radar.statistics.clippings == 3
    assert master.radar.is_overloaded
    simulated.clipping = False
    master.until(lambda: master.heard.lists[-1][1].targets)


def test_a_receiver_is_overloaded_while_most_lists_say_so():
    radar = radar_of("iSYS-4001")
    assert not radar.is_overloaded
    states = []
    for cycle in range(60):
        radar.count_list(100 + 0.075 * cycle, clipping=cycle < 20)
        states.append(radar.is_overloaded)
    assert states == [cycle < 39 for cycle in range(60)]
    for cycle in range(200):
        radar.count_list(200 + 0.075 * cycle, clipping=cycle == 0)
    assert not radar.clippings  # that was too long ago


@pytest.mark.parametrize("output", [1, 2, 3])
def test_the_list_has_passed_the_filter_of_the_output_asked_for(connect, output):
    master, _, simulated = connect()
    simulated.scene = lambda now: [Target(40.0, 1.0, distance, 0.0) for distance in (5, 15, 25)]
    for number in (1, 2, 3):
        simulated.set_value(f"output{number}.range_max", 10.0 * number)
    master.radar.options.output = output
    (measured,) = master.measure()
    assert measured.output == output
    assert [target.range for target in measured.targets] == pytest.approx([5, 15, 25][:output])


def test_digital_outputs_are_read_after_each_list(connect):
    master, _, simulated = connect(read_digital_outputs=True)
    simulated.scene = lambda now: [Target(40.0, 1.0, 7.5, 0.0)]
    master.maintenance.write(master.radar, {"output2.mode": "pwm", "output3.mode": "digital",
                                    "output3.range_max": 5.0})
    master.measure(2)
    assert master.heard.digital_outputs[0] == (1, 750, 0)


def test_a_range_list_is_read_after_each_list(connect):
    master, _, simulated = connect("iSYS-6203", read_range_list=True)
    simulated.scene = lambda now: [Target(40.0, 0.0, 7.123456, 0.0)]
    simulated.temperature = -12.34
    master.measure(2)
    values, stamp = master.heard.range_lists[0]
    assert values.range == pytest.approx(7.123456)
    assert values.amplitude == pytest.approx(40.0)
    assert values.temperature == pytest.approx(-12.34)
    assert stamp >= master.heard.lists[0][2]


def test_a_model_without_them_is_not_asked_for_more_than_lists(connect):
    master, _, _ = connect("iSYS-6005", read_range_list=True, read_digital_outputs=True)
    master.measure(3)
    assert master.heard.range_lists == []
    assert master.heard.digital_outputs == []
    assert master.radar.statistics.refusals == 0


@pytest.mark.parametrize(("model", "kind"), [("iSYS-6003", np.int16), ("iSYS-6004", np.float32)])
def test_raw_signals(connect, model, kind):
    master, _, _ = connect(model)
    master.bus.set_active(True)
    raw = master.maintenance.read_raw_signals(master.radar)
    assert raw.sample_time == pytest.approx(25e-6)
    assert raw.samples.dtype == kind
    assert raw.samples.shape == (4, 512)
    times = np.arange(512) * 25e-6
    for number, signal in enumerate(raw.samples, 1):
        truth = 8000.0 * np.sin(2 * np.pi * 500.0 * number * times)
        assert np.abs(signal - truth).max() <= (1.0 if kind is np.int16 else 0.001)


def test_cycles_without_a_list_because_of_raw_signals_are_not_lost(connect):
    master, _, _ = connect("iSYS-6003", baud_rate=0)
    master.maintenance.write(master.radar, {"measurement_mode": "fast"})
    master.measure()
    lost = master.radar.statistics.lost_cycles
    master.maintenance.read_raw_signals(master.radar)  # takes 8 cycles
    master.lists()
    assert master.radar.statistics.lost_cycles == lost


def test_raw_signals_need_the_acquisition(connect):
    master, _, _ = connect("iSYS-6003")
    with pytest.raises(SettingError, match="start it first"):
        master.maintenance.read_raw_signals(master.radar)


def test_a_model_without_raw_signals_says_so(connect):
    master, _, _ = connect()
    master.measure()
    with pytest.raises(SettingError, match="iSYS-4001 cannot read the raw signals"):
        master.maintenance.read_raw_signals(master.radar)


def test_acquisition_of_one_radar_can_be_stopped_and_started(connect):
    master, _, simulated = connect()
    master.measure()
    master.bus.set_enabled(master.radar, False)
    assert not simulated.measuring
    master.bus.set_active(True)  # the node is activated again: the user's word holds
    assert not simulated.measuring
    master.bus.set_enabled(master.radar, True)
    assert simulated.measuring
    master.measure(2)


@pytest.mark.parametrize("active", [True, False])
def test_a_radar_that_misses_start_or_stop_is_told_again(connect, active):
    master, line, simulated = connect()
    master.bus.set_active(not active)
    line.faults.silent = True
    master.bus.set_active(active)
    line.faults.silent = False
    master.until(lambda: simulated.measuring is master.radar.measuring is active)
    assert master.heard.lost == []


@pytest.mark.parametrize("model", ["iSYS-5010", "iSYS-5011", "iSYS-5020", "iSYS-5021", "iSYS-5110"])
def test_a_model_without_target_lists_is_not_asked_for_them(connect, monkeypatch, model):
    monkeypatch.setattr(connection, "KEEP_ALIVE", 0.02)
    master, _, simulated = connect(model)
    requests = counted_requests(simulated)
    master.bus.set_active(True)
    assert simulated.measuring
    master.until(lambda: len(requests) >= 4)
    assert master.heard.lists == []
    assert master.heard.lost == []
    assert master.radar.statistics.refusals == 0


@pytest.mark.parametrize("model", ["iSYS-5020", "iSYS-5021"])
def test_board_temperatures_are_read(connect, model):
    master, _, simulated = connect(model)
    simulated.temperature = -3.25
    master.bus.set_active(True)
    master.until(lambda: master.heard.temperatures
                 and master.heard.temperatures[-1]["rfe"] == pytest.approx(-3.25))
    assert master.heard.temperatures[-1] == pytest.approx({"dsp": -0.25, "rfe": -3.25})


# --- two views of one setting (N15) ------------------------------------------------------------

FINE, COARSE = "output1.range_max_extended", "output1.range_max"


def test_both_views_of_a_limit_are_shown_and_the_last_one_set_is_wanted(connect):
    master, _, simulated = connect("iSYS-6203", wanted={COARSE: 15.0})
    assert master.maintenance.write(master.radar, {FINE: 12.34}) == {FINE: 12.34, COARSE: 12.3}
    assert master.radar.values[COARSE] == 12.3
    assert master.radar.options.wanted == {FINE: 12.34}
    simulated.power_cycle(now=-math.inf)
    master.measure(2)
    assert simulated.value(FINE) == 12.34
    assert master.maintenance.write(master.radar, {COARSE: 9.0}) == {COARSE: 9.0, FINE: 9.0}
    assert master.radar.options.wanted == {COARSE: 9.0}


@pytest.mark.parametrize("order", [(COARSE, FINE), (FINE, COARSE)])
def test_of_both_views_given_together_the_finer_one_counts(connect, order):
    wanted = {COARSE: 15.0, FINE: 12.34}
    master, _, simulated = connect("iSYS-6003", wanted={name: wanted[name] for name in order})
    assert simulated.value(FINE) == 12.34
    assert master.radar.values[COARSE] == simulated.value(COARSE) == 12.3
    master.maintenance.write(master.radar, {FINE: 11.11})  # what it is now is not written again
    master.measure(3)
    assert not any("configuring it again" in note for note in master.heard.notes)


def test_thresholds_of_the_6203_are_views_of_each_other(connect):
    name = "output1.temperature_warning_celsius"
    master, _, _ = connect("iSYS-6203", wanted={name: 33.0})
    other = "output1.temperature_threshold_celsius"
    assert master.maintenance.write(master.radar, {other: 40.25}) == {other: 40.25, name: 40.25}
    assert master.maintenance.set_default_thresholds(master.radar)[0] == 55.0
    assert master.radar.values[name] == 55.0


def test_settings_that_turn_out_to_be_independent_stay_wanted(connect, monkeypatch):
    monkeypatch.setattr(simulated_radar.SimulatedRadar, "_show_in_other_view", lambda *_: None)
    master, _, _ = connect("iSYS-6203", wanted={COARSE: 15.0})
    assert master.maintenance.write(master.radar, {FINE: 12.34}) == {FINE: 12.34, COARSE: 15.0}
    assert master.radar.options.wanted == {FINE: 12.34, COARSE: 15.0}


# --- what a radar may lack ---------------------------------------------------------------------

def test_a_radar_that_is_silent_on_what_is_optional_is_used(start, monkeypatch):
    monkeypatch.setattr(connection, "KEEP_ALIVE", 0.02)
    line, simulated = start("iSYS-5020")
    simulated.bare = True
    master = Master(line.port).find()
    identity = master.radar.identity
    assert (identity.dsp_hardware, identity.rfe_hardware, identity.bootloader) == (None,) * 3
    assert master.heard.warnings == ["this firmware has no frequency_channel"]
    assert "frequency_channel" not in master.radar.settings
    requests = counted_requests(simulated)
    master.bus.set_active(True)
    master.until(lambda: master.radar.absent == {"dsp", "rfe"})
    before = len(requests)
    master.until(lambda: len(requests) >= before + 6)
    assert master.heard.temperatures == master.heard.lost == []
    assert master.radar.statistics.timeouts == 0
    master.bus.close()


@pytest.mark.parametrize("there", [True, False])
def test_the_range_bound_is_offered_where_the_firmware_has_it(monkeypatch, there):  # N13
    link = VirtualLink(VirtualTime(), "iSYS-4001", range_bound=there)
    link.radars[0].scene = lambda now: [Target(40.0, 1.0, distance, 0.0) for distance in (30, 90)]
    master = VirtualMaster(monkeypatch, link, Options())
    assert ("range_bound" in master.radar.settings) == there
    assert master.heard.warnings == []
    assert len(master.measure()[0].targets) == 2
    if there:
        assert master.radar.values["range_bound"] == "150_m"
        master.maintenance.write(master.radar, {"range_bound": "50_m"})  # it is stopped for that
        assert len(master.lists()[0].targets) == 1


# --- nonsense ----------------------------------------------------------------------------------

@pytest.mark.parametrize("model", ["iSYS-4001", "iSYS-6003"])
def test_nonsense_is_dropped_and_counted(connect, model):
    master, _, simulated = connect(model, read_range_list=True)
    simulated.nonsense = True
    master.bus.set_active(True)
    master.until(lambda: master.radar.statistics.implausible_lists >= 8)
    assert master.heard.lists == master.heard.range_lists == master.heard.lost == []
    simulated.nonsense = False
    master.lists(2)


# --- lost cycles -------------------------------------------------------------------------------

def counts_of(times):
    """Return how many lists and lost cycles are counted for lists at these times."""
    radar = radar_of("iSYS-4001")
    for now in times:
        radar.count_list(now, clipping=False)
    return radar.statistics.target_lists, radar.statistics.lost_cycles


def test_cycles_without_a_list_are_counted():
    cycles = [0, 1, 2, 5, 6, 8, 9]
    assert counts_of([100 + 0.075 * cycle for cycle in cycles]) == (7, 3)


def test_a_list_that_is_only_late_is_not_counted_as_lost():
    late = [0.0, 0.05, 0.0, 0.05, 0.045, 0.0, 0.04]
    assert counts_of([100 + 0.075 * cycle + delay for cycle, delay in enumerate(late)]) == (7, 0)


@pytest.mark.parametrize("error", [-0.08, -0.001, 0.001, 0.08])
def test_a_device_whose_clock_is_off_loses_nothing(error):
    assert counts_of([100 + 0.075 * (1 + error) * cycle for cycle in range(1000)]) == (1000, 0)


def test_a_list_that_is_lost_on_the_line_is_a_lost_cycle(connect):
    master, line, simulated = connect()
    truth = Truth(simulated)
    master.measure(3)
    lists = iter([True, False, True, False])
    line.faults = Script(lambda due, reply: [] if function_code(reply) == 0xDA
                         and next(lists, False) else [(due, reply)])
    master.lists(6)
    statistics = master.radar.statistics
    first, last = truth.recorded[0][0], truth.recorded[len(truth.recorded) - 1][0]
    cycles = round((last - first) / 0.075) + 1
    assert statistics.timeouts == 2
    assert statistics.lost_cycles >= 2
    assert statistics.target_lists + statistics.lost_cycles == pytest.approx(cycles, abs=1)


# --- services ----------------------------------------------------------------------------------

def test_default_temperature_thresholds(connect):
    master, _, simulated = connect("iSYS-6203")
    master.maintenance.write(master.radar, {"output1.temperature_threshold_celsius": 30.0})
    command = commands.SET_DEFAULT_TEMPERATURE_THRESHOLDS
    assert master.maintenance.execute(master.radar, command) == pytest.approx((55.0, 60.0, 0.0))
    assert simulated.value("output1.temperature_threshold_celsius") == 55.0


def test_default_temperature_thresholds_stay_until_others_are_set(connect):
    name = "output1.temperature_threshold_celsius"
    master, _, simulated = connect("iSYS-6203", wanted={name: 30.0})
    master.maintenance.save(master.radar, commands.SAVE_ALL_SETTINGS)
    thresholds = master.maintenance.set_default_thresholds(master.radar)
    assert thresholds == pytest.approx((55.0, 60.0, 0.0))
    assert master.radar.values[name] == master.heard.values[-1][name] == 55.0
    assert master.radar.unsaved == {name}
    simulated.power_cycle()
    assert simulated.value(name) == 30.0
    master.until(lambda: simulated.value(name) == 55.0)


def test_a_command_that_the_model_lacks_is_not_sent(connect):
    master, _, simulated = connect()
    requests = counted_requests(simulated)
    with pytest.raises(SettingError, match="iSYS-4001 cannot set the default temperature"):
        master.maintenance.execute(master.radar, commands.SET_DEFAULT_TEMPERATURE_THRESHOLDS)
    assert not requests


@pytest.mark.parametrize(("command", "saved"), [
    (commands.SAVE_SENSOR_SETTINGS, ["frequency_channel"]),
    (commands.SAVE_APPLICATION_SETTINGS, ["output1.range_max", "threshold_minimum_db"]),
    (commands.SAVE_ALL_SETTINGS,
     ["frequency_channel", "output1.range_max", "threshold_minimum_db"])])
def test_saving_keeps_the_settings_over_a_power_cycle(connect, command, saved):
    master, _, simulated = connect()
    changes = {"frequency_channel": 4, "output1.range_max": 33.0, "threshold_minimum_db": 5.5}
    master.maintenance.write(master.radar, changes)
    assert simulated.eeprom != simulated.ram
    assert master.maintenance.save(master.radar, command) == saved
    assert master.radar.unsaved == changes.keys() - set(saved)
    for name, value in changes.items():
        assert (simulated.value(name, Location.EEPROM) == value) == (name in saved)


LOCATED = {  # settings with a location, of the sensor and of the application
    "iSYS-5010": ({}, {"moving_target_sensitivity.main_db": 4.5, "rcs_output": True}),
    "iSYS-5020": ({"target_list_interface": "spi"}, {"target_clustering": False}),
    "iSYS-5110": ({"ip.address": "10.0.0.7", "ip_destination.record_port": 7},
                  {"stop_bar_zone2.range_max": 12.0, "stop_bar_zone1.enable": True})}


@pytest.mark.parametrize("model", LOCATED)
@pytest.mark.parametrize("command", [commands.SAVE_SENSOR_SETTINGS,
                                     commands.SAVE_APPLICATION_SETTINGS,
                                     commands.SAVE_ALL_SETTINGS], ids=lambda command: command.name)
def test_without_a_command_to_save_each_record_is_written_to_the_eeprom(connect, model, command):
    master, _, simulated = connect(model)
    sensor, application = LOCATED[model]
    changes = {"frequency_channel": 2, **sensor, **application}
    master.maintenance.write(master.radar, changes)
    kept = {**(sensor if command is not commands.SAVE_APPLICATION_SETTINGS else {}),
            **(application if command is not commands.SAVE_SENSOR_SETTINGS else {})}
    master.bus.set_active(True)
    assert master.maintenance.unsaved(master.radar, command) == sorted(kept)
    if kept:
        assert master.maintenance.save(master.radar, command) == sorted(kept)
    else:
        with pytest.raises(SettingError, match=f"{model} cannot save the sensor settings"):
            master.maintenance.save(master.radar, command)
    assert simulated.measuring
    assert master.radar.unsaved == changes.keys() - kept.keys()
    for name in changes:
        assert (simulated.value(name, Location.EEPROM) == simulated.value(name)) == (name in kept)


def test_what_no_command_can_save_is_named(connect):
    master, _, _ = connect("iSYS-5010")
    master.maintenance.write(master.radar, {"frequency_channel": 2, "rcs_output": True})
    named = {possible: master.maintenance.unsaved(master.radar, commands.SAVE_ALL_SETTINGS,
                                          possible=possible) for possible in (True, False)}
    assert named == {True: ["rcs_output"], False: ["frequency_channel"]}


def test_only_what_the_eeprom_does_not_hold_yet_is_written_to_it(connect):
    master, _, simulated = connect("iSYS-5110")
    simulated.set_value("ip.gateway", "10.0.0.1")  # by another program
    written = []
    write = simulated._write_record
    simulated._write_record = lambda *request: written.append(request) or write(*request)
    assert master.maintenance.save(master.radar, commands.SAVE_ALL_SETTINGS) == ["ip.gateway"]
    assert master.maintenance.save(master.radar, commands.SAVE_ALL_SETTINGS) == []
    assert len(written) == 1


@pytest.mark.parametrize(("spoil", "words"), [
    (lambda radar: radar.refuse.add(commands.READ_APPLICATION + 1),
     "cannot save rcs_output: address 100 answers with failure"),
    (lambda radar: setattr(radar, "_write_record", lambda *_: b""),
     "took rcs_output but did not store it")])
def test_a_record_that_is_not_stored_is_named(connect, spoil, words):
    master, _, simulated = connect("iSYS-5010")
    master.maintenance.write(master.radar, {"rcs_output": True})
    spoil(simulated)
    with pytest.raises(RefusedError, match=re.escape(words)):
        master.maintenance.save(master.radar, commands.SAVE_ALL_SETTINGS)
    assert master.radar.unsaved == {"rcs_output"}


def test_writing_a_setting_leaves_the_eeprom_alone(connect):
    master, _, simulated = connect("iSYS-6203")
    eeprom = dict(simulated.eeprom)
    master.maintenance.write(master.radar, both_ends(master.radar.settings)[0])
    assert simulated.ram != eeprom
    assert simulated.eeprom == eeprom


def test_what_the_eeprom_holds_can_be_read_where_the_manual_has_a_location(connect):
    master, _, _ = connect("iSYS-6203")
    master.maintenance.write(master.radar, {"output1.temperature_threshold_celsius": 30.0,
                                    "output2.range_warning": 1.5})
    stored = master.maintenance.stored_values(master.radar)
    assert stored["output1.temperature_threshold_celsius"] == 55.0
    assert stored["output2.range_warning"] == 0.0
    assert "output1.range_max" not in stored
    master.maintenance.save(master.radar, commands.SAVE_ALL_SETTINGS)
    assert master.maintenance.stored_values(master.radar)["output2.range_warning"] == 1.5


@pytest.mark.parametrize("name", ["iSYS-5010", "iSYS-5020", "iSYS-5110", "iSYS-6203"])
def test_every_setting_with_a_location_is_read_from_there(connect, name):
    master, _, simulated = connect(name)
    master.maintenance.write(master.radar, both_ends(master.radar.settings)[1])
    stored = master.maintenance.stored_values(master.radar)
    assert stored == {name: simulated.value(name, Location.EEPROM) for name in stored}
    assert stored


def test_factory_settings_are_restored_and_read_again(connect):
    master, _, simulated = connect(wanted={"output1.range_max": 42.0})
    master.measure()
    master.maintenance.save(master.radar, commands.SAVE_ALL_SETTINGS)
    master.maintenance.restore_factory_settings(master.radar)
    assert simulated.value("output1.range_max", Location.EEPROM) == 150.0
    assert master.heard.values[-1]["output1.range_max"] == 150.0
    assert master.radar.values["output1.range_max"] == 150.0
    assert master.radar.unsaved == set()
    assert simulated.measuring
    master.measure(2)


def test_factory_settings_stay_after_a_reconnection(connect):
    master, _, simulated = connect(wanted={"output1.range_max": 42.0})
    master.maintenance.restore_factory_settings(master.radar)
    master.bus.close()
    master.bus.open()
    master.find()
    assert simulated.value("output1.range_max") == 150.0


@pytest.mark.parametrize("acknowledged_from", [17, 128])
def test_an_address_that_factory_settings_bring_back_is_followed(start, acknowledged_from):
    line, simulated = start("iSYS-4001", addresses=[17])
    master = Master(line.port, Options(address=17)).find()
    reply = simulated.reply

    def with_address(request, now):
        due, frame = reply(request, now)
        if request.pdu == commands.RESTORE_FACTORY_SETTINGS.sub_function:
            simulated.address = 128
            frame = dataclasses.replace(frame, source=acknowledged_from)
        return due, frame

    simulated.reply = with_address
    master.maintenance.restore_factory_settings(master.radar)
    assert master.radar.address == 128
    master.measure(2)
    master.bus.close()
    master.bus.open()
    master.lists(2)


def test_a_new_address_is_followed(connect):
    master, _, simulated = connect()
    master.measure()
    master.maintenance.change_address(master.radar, 42)
    assert simulated.address == 42
    assert master.radar.address == 42
    master.measure(2)
    master.bus.close()
    master.bus.open()
    master.measure(2)
    assert master.heard.lost == []


def test_a_new_address_is_followed_when_its_acknowledgement_is_lost(connect, monkeypatch):
    monkeypatch.setattr(maintenance, "EEPROM_TIMEOUT", 0.1)
    master, line, simulated = connect()
    lost = []

    def lose_first(due, reply):
        if simulated.address == 42 and not lost:
            lost.append(reply)
            return []
        return [(due, reply)]

    line.faults = Script(lose_first)
    master.maintenance.change_address(master.radar, 42)
    assert lost
    assert master.radar.address == 42
    master.measure(2)


@pytest.mark.parametrize("address", [0, 1, 256])
def test_an_address_that_no_device_may_have_is_not_sent(connect, address):
    master, _, simulated = connect()
    with pytest.raises(SettingError, match=f"address {address} is out of range.*2 … 255"):
        master.maintenance.change_address(master.radar, address)
    assert simulated.address == 128


def test_an_address_of_another_radar_of_this_driver_is_not_given_away(start):
    line, first, _ = start("iSYS-4001", addresses=[10, 11])
    master = Master(line.port, Options("front", address=10), Options("rear", address=11)).find()
    with pytest.raises(SettingError, match="address 11 belongs to another radar"):
        master.maintenance.change_address(master.bus.devices[0], 11)
    assert first.address == 10


def test_an_address_that_another_device_has_is_not_given_away(start):
    line, first, _ = start("iSYS-4001", addresses=[10, 11])
    master = Master(line.port, Options(address=10)).find()
    with pytest.raises(SettingError, match="address 11 belongs to another device on the line"):
        master.maintenance.change_address(master.radar, 11)
    assert first.address == 10
    master.measure(2)


def test_a_refused_address_changes_nothing(connect):
    master, _, simulated = connect()
    simulated.refuse.add(commands.READ_SENSOR + 1)
    with pytest.raises(RefusedError):
        master.maintenance.change_address(master.radar, 42)
    assert (simulated.address, master.radar.address) == (128, 128)
    master.measure(2)


def test_without_a_radar_every_action_says_why(start):
    line, simulated = start("iSYS-4001")
    simulated.silent = True
    master = Master(line.port, Options(address=128, model=find_model("4001")))
    master.lose()
    bus, radar = master.bus, master.radar
    for action in (
            lambda: bus.maintenance.write(radar, {"output1.range_max": 1.0}),
            lambda: bus.maintenance.execute(radar, commands.READ_RFE_TEMPERATURE),
            lambda: bus.maintenance.save(radar, commands.SAVE_ALL_SETTINGS),
            lambda: bus.maintenance.stored_values(radar),
            lambda: bus.maintenance.restore_factory_settings(radar),
            lambda: bus.maintenance.read_raw_signals(radar),
            lambda: bus.maintenance.change_address(radar, 42),
            lambda: bus.set_enabled(radar, False)):
        with pytest.raises(NoAnswerError, match="128 is not connected: no answer at address"):
            action()
