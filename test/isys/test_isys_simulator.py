# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The simulated radars: they answer what a device would answer, and nothing else.

The first tests have no line and no clock: bytes in at a time, bytes out at a time.
"""

from __future__ import annotations

import math
import os
import signal
import socket
import time

import pytest
from nodes import Process

from driver_common.errors import LinkError, WrongDeviceError
from driver_common.serial_link import SerialLink
from driver_common.simulator.line import Faults
from isys_radar_driver import commands
from isys_radar_driver.commands import Location
from isys_radar_driver.frames import FAILURE, MASTER, Frame, FrameParser
from isys_radar_driver.models import MODELS, find_model
from isys_radar_driver.simulator.line import SimulatedRadars, simulated_line
from isys_radar_driver.simulator.radar import FIXED_TARGETS, SimulatedRadar
from isys_radar_driver.simulator.scene import scene_of
from isys_radar_driver.targets import Resolution, Target, decode_target_list

DEADLINE = 60.0  # s; far more than anything takes, also on a busy machine
START = "68 05 05 68 80 01 D1 00 00 52 16"
STOP = "68 05 05 68 80 01 D1 00 01 53 16"
ACKNOWLEDGED = "68 03 03 68 01 80 D1 52 16"
REFUSED = "68 03 03 68 01 80 FD 7E 16"
NOW = 1000.0  # s


def line_of(*models, addresses=()):
    """Return the device side of a line, and its radars."""
    count = max(len(models), len(addresses))
    radars = [SimulatedRadar(find_model(models[min(index, len(models) - 1)]),
                             addresses[index] if addresses else 0) for index in range(count)]
    return SimulatedRadars(radars), *radars


def answer(line, request, now=NOW):
    """Send bytes in hexadecimal and return the bytes that come back."""
    data = request.encode() if isinstance(request, Frame) else bytes.fromhex(request)
    return " ".join(reply.hex(" ").upper() for _, reply in line.receive(data, now))


def ask(line, request, now=NOW, fixed_targets=None):
    """Send a frame and return the frame that comes back."""
    ((_, reply),) = line.receive(request.encode(), now)
    (frame,) = FrameParser(fixed_targets).feed(reply)
    return frame


# --- what it answers ---------------------------------------------------------------------------

@pytest.mark.parametrize(("request_", "reply"), [
    ("68 05 05 68 80 01 D2 00 01 54 16", "68 05 05 68 01 80 D2 00 80 D3 16"),  # its address
    ("68 05 05 68 00 01 D2 00 01 D4 16", "68 05 05 68 01 80 D2 00 80 D3 16"),  # by broadcast
    ("68 03 03 68 80 01 D0 51 16", "68 14 14 68 01 80 D0 69 53 59 53 2D 34 30 30 31 20 30 30 30 "
                                   "30 30 31 00 EC 16"),  # "iSYS-4001 000001"
    ("68 05 05 68 80 01 D6 01 04 5C 16", "68 05 05 68 01 80 D6 0F A1 07 16"),  # 4001
    (START, ACKNOWLEDGED),
    (STOP, ACKNOWLEDGED),
])
def test_literal_requests(request_, reply):
    assert answer(line_of("4001")[0], request_) == reply


@pytest.mark.parametrize("request_", [
    "68 05 05 68 81 01 D2 00 01 55 16",  # to another address
    "68 05 05 68 80 02 D2 00 01 55 16",  # not from the master
    "68 05 05 68 80 01 D2 00 01 55 16",  # checksum
    "68 05 05 68 80 01 D2 00 01 54 17",  # end
    "68 05 06 68 80 01 D2 00 01 54 16",  # lengths
    "68 05 05 68 80 01 D2 00",  # not all of it
    "00 FF 55"])
def test_what_is_not_for_it_is_not_answered(request_):
    assert answer(line_of("4001")[0], request_) == ""


@pytest.mark.parametrize("request_", [
    Frame(128, MASTER, 0xC7),  # no such function
    Frame(128, MASTER, 0xD1, b"\0\7"),  # no such sub-function
    Frame(128, MASTER, 0xD1, b"\x01\x09"),  # a temperature that the 4001 lacks
    Frame(128, MASTER, 0xD2, b"\0"),  # half a sub-function
    Frame(128, MASTER, 0xD2, b"\0\x04\0"),  # too long
    Frame(128, MASTER, 0xD4, b"\x01\x06"),  # a setting that the 4001 lacks
    Frame(128, MASTER, 0xD5, b"\x01\x09\0"),  # half a value
    Frame(128, MASTER, 0xD6, b"\x01\x07"),
    Frame(128, MASTER, 0xDA, b"\4"),  # no such output
    Frame(128, MASTER, 0xDA, b"\1\x11"),  # no such resolution
    Frame(128, MASTER, 0xDA, b""),
    Frame(128, MASTER, 0xDF, b"\7"),
    Frame(128, MASTER, 0xE0),  # raw signals, which the 4001 lacks
    Frame(128, MASTER, 0xE1)], ids=str)
def test_what_it_cannot_do_is_refused(request_):
    line, radar = line_of("4001")
    before = dict(radar.ram)
    radar.measuring = True
    assert answer(line, request_) == REFUSED
    assert radar.ram == before


@pytest.mark.parametrize(("model", "name", "raw"), [
    ("4001", "output1.range_max", 1501), ("4001", "output1.range_max", -1),
    ("4001", "output1.direction", 4), ("4001", "line_filter1.enable", 2),
    ("4001", "frequency_channel", 0), ("4001", "frequency_channel", 9),
    ("4001", "output1.range_min", 1500 + 1), ("6005", "measurement_mode", 0)])
def test_a_value_that_it_does_not_allow_is_refused(model, name, raw):
    line, radar = line_of(model)
    record = radar.settings[name].record
    values = list(radar.ram[record])
    values[radar.settings[name].field] = raw
    before = dict(radar.ram)
    assert ask(line, record.write_request(radar.address, values)).function_code == FAILURE
    assert radar.ram == before


def test_a_minimum_above_the_maximum_is_refused():
    line, radar = line_of("4001")
    radar.set_value("output1.range_max", 10.0)
    record = radar.settings["output1.range_min"].record
    assert answer(line, record.write_request(128, (101,))) == REFUSED
    assert answer(line, record.write_request(128, (100,))) != REFUSED


def test_what_needs_the_acquisition_stopped_is_refused_while_it_runs():
    line, radar = line_of("4001")
    request = radar.settings["frequency_channel"].record.write_request(128, (3,))
    answer(line, START)
    assert answer(line, request) == REFUSED
    answer(line, STOP)
    assert answer(line, request) == "68 03 03 68 01 80 D3 54 16"
    assert radar.value("frequency_channel") == 3


def test_a_strict_one_refuses_to_start_or_stop_again():
    line, radar = line_of("4001")
    radar.strict = True
    assert [answer(line, request) for request in (STOP, START, START, STOP, STOP)] == [
        REFUSED, ACKNOWLEDGED, REFUSED, ACKNOWLEDGED, REFUSED]


def test_one_that_starts_by_itself_measures_after_a_power_cycle():
    line, radar = line_of("4001")
    radar.self_starting = True
    radar.power_cycle(NOW)
    ((end, _),) = line.receive(
        commands.read_target_list(128, 1, Resolution.BITS_32).encode(), NOW + 0.51)
    assert end == pytest.approx(NOW + 0.5 + 0.075)


def test_target_lists_are_refused_while_it_does_not_measure():
    line, _ = line_of("4001")
    request = commands.read_target_list(128, 1, Resolution.BITS_32)
    assert answer(line, request) == REFUSED
    answer(line, START)
    assert ask(line, request).function_code == 0xDA


@pytest.mark.parametrize("name", MODELS)
def test_each_model_sends_the_target_lists_that_it_has(name):
    model = find_model(name)
    line, _ = line_of(name)
    ask(line, commands.START.request(model.address))
    for resolution in Resolution:
        reply = ask(line, commands.read_target_list(model.address, 1, resolution),
                    fixed_targets=FIXED_TARGETS if resolution.fixed_length else None)
        possible = resolution in model.resolutions or (
            resolution is Resolution.NONE and Resolution.BITS_16 in model.resolutions)
        assert (reply.function_code == 0xDA) == possible
        if possible:
            measured = decode_target_list(reply, model.range_step_16)
            assert len(measured.targets) == len(scene_of(model)(0.0))


@pytest.mark.parametrize("name", MODELS)
def test_each_model_has_the_commands_of_the_manual(name):
    model = find_model(name)
    line, radar = line_of(name)
    for command in (value for value in vars(commands).values()
                    if isinstance(value, commands.Command)):
        radar.measuring = True
        reply = ask(line, command.request(model.address))
        assert (reply.function_code != FAILURE) == model.supports(command), command.name
        if model.supports(command):
            command.decode(reply.pdu)


@pytest.mark.parametrize("location", Location)
def test_settings_with_a_location_can_be_read_from_there(location):
    line, radar = line_of("6203")
    name = "output2.range_warning"
    record = radar.settings[name].record
    radar.set_value(name, 1.5)
    reply = ask(line, record.read_request(100, location))
    assert record.decode_reply(reply.pdu, location) == ((15000,) if location is Location.RAM
                                                        else (0,))


def test_settings_can_be_written_to_the_eeprom_and_then_hold_in_the_ram_too():
    line, radar = line_of("6203")
    record = radar.settings["output2.range_warning"].record
    ask(line, record.write_request(100, (15000,), Location.EEPROM))
    assert radar.value("output2.range_warning") == 1.5
    assert radar.value("output2.range_warning", Location.EEPROM) == 1.5


def test_a_location_that_does_not_exist_is_refused():
    line, _ = line_of("6203")
    assert ask(line, Frame(100, MASTER, 0xD4, b"\x07\x0b\x02\x01")).function_code == FAILURE


def test_the_led_is_stored_at_once():
    line, radar = line_of("4001")
    ask(line, radar.settings["led"].record.write_request(128, (0,)))
    assert radar.value("led", Location.EEPROM) == "disabled"


@pytest.mark.parametrize(("function", "stored"), [
    (2, {"frequency_channel"}), (3, {"output1.range_max", "threshold_minimum_db"}),
    (4, {"frequency_channel", "output1.range_max", "threshold_minimum_db"}), (1, set())])
def test_the_functions_of_the_eeprom(function, stored):
    line, radar = line_of("4001")
    factory = dict(radar.ram)
    changes = {"frequency_channel": 3, "output1.range_max": 9.0, "threshold_minimum_db": 1.0}
    for name, value in changes.items():
        radar.set_value(name, value)
    assert answer(line, Frame(128, MASTER, 0xDF, bytes((function,)))) != REFUSED
    assert {name for name in changes
            if radar.value(name, Location.EEPROM) == changes[name]} == stored
    assert (radar.ram == factory) == (function == 1)


def test_a_new_address_holds_at_once_and_acknowledges():
    line, radar = line_of("4001")
    reply = ask(line, commands.change_address(128, 42))
    assert (reply.source, reply.function_code, reply.pdu) == (42, 0xD3, b"")
    assert radar.address == 42
    assert answer(line, START) == ""
    radar.power_cycle(NOW)
    assert ask(line, commands.START.request(42), NOW + 1).source == 42


@pytest.mark.parametrize("address", [0, 1, 256])
def test_an_address_that_is_not_allowed_is_refused(address):
    line, radar = line_of("4001")
    request = Frame(128, MASTER, 0xD3, b"\0\1" + address.to_bytes(2, "big"))
    assert answer(line, request) == REFUSED
    assert radar.address == 128


def test_a_power_cycle_loses_the_ram_and_the_acquisition_and_takes_its_time():
    line, radar = line_of("4001")
    radar.set_value("output1.range_max", 9.0)
    answer(line, START)
    radar.power_cycle(NOW)
    assert answer(line, STOP, NOW + 0.4) == ""
    assert answer(line, STOP, NOW + 0.6) == ACKNOWLEDGED
    assert radar.value("output1.range_max") == 150.0
    assert not radar.measuring


# --- when it answers ---------------------------------------------------------------------------

def test_a_frame_that_pauses_too_long_is_forgotten():
    line, _ = line_of("4001")
    data = bytes.fromhex(START)
    assert line.receive(data[:5], NOW) == []
    assert len(line.receive(data[5:], NOW + 0.008)) == 1
    assert line.receive(data[:5], NOW + 1.0) == []
    assert line.receive(data[5:], NOW + 1.03) == []
    assert len(line.receive(data, NOW + 2.0)) == 1


def test_a_request_may_arrive_byte_by_byte_behind_noise():
    line, _ = line_of("4001")
    replies = []
    for index, byte in enumerate(bytes.fromhex("FF 68 05 00" + START)):
        replies += line.receive(bytes((byte,)), NOW + 0.0001 * index)
    assert [reply.hex(" ").upper() for _, reply in replies] == [ACKNOWLEDGED]


@pytest.mark.parametrize("name", [name for name, model in MODELS.items()
                                  if model.has_target_lists])
def test_target_lists_come_at_the_end_of_a_cycle(name):
    model = find_model(name)
    line, radar = line_of(name)
    ((started, _),) = line.receive(commands.START.request(model.address).encode(), NOW)
    request = commands.read_target_list(model.address, 1, model.resolutions[0]).encode()
    cycle_time = model.cycle_time(radar._mode)
    now, ends = NOW + 0.3 * cycle_time, []
    for _ in range(4):
        ((end, _),) = line.receive(request, now)
        ends.append(end)
        now = end + 0.003
    assert [end - started for end in ends] == pytest.approx(
        [cycle_time * count for count in (1, 2, 3, 4)], abs=0.005)


@pytest.mark.parametrize(("mode", "cycle_time", "count"), [(0, 0.05, 1), (1, 0.2, 3)])
def test_the_measurement_mode_sets_cycle_time_and_number_of_targets(mode, cycle_time, count):
    line, radar = line_of("6003")
    ask(line, radar.settings["measurement_mode"].record.write_request(100, (mode,)))
    ask(line, commands.START.request(100))
    request = commands.read_target_list(100, 1, Resolution.BITS_32)
    ((first, _),) = line.receive(request.encode(), NOW + 0.01)
    ((second, reply),) = line.receive(request.encode(), first + 0.001)
    assert second - first == pytest.approx(cycle_time)
    (frame,) = FrameParser().feed(reply)
    assert len(decode_target_list(frame).targets) == count


# --- what it measures --------------------------------------------------------------------------

@pytest.mark.parametrize("name", MODELS)
def test_factory_settings_are_allowed_values(name):
    radar = SimulatedRadar(find_model(name))
    for setting in radar.settings.values():
        assert setting.check(radar.value(setting.name)) == radar.value(setting.name)


@pytest.mark.parametrize("name", MODELS)
def test_the_truth_moves_smoothly_within_what_the_model_reports(name):
    model = find_model(name)
    scene = scene_of(model)
    for now in (0.0, 3.3, 1e9):
        for early, target, late in zip(scene(now - 0.001), scene(now), scene(now + 0.001),
                                       strict=True):
            speed = (late.range - early.range) / 0.002
            if model.velocity_max and model.range_max:
                assert target.velocity == pytest.approx(-speed, abs=0.01)  # positive = approaching
            assert 0.0 <= target.range <= (model.range_max or math.inf)
            assert abs(target.velocity) <= (model.velocity_max or 0.0)
            assert 0.0 <= target.signal <= model.signal_max
            assert abs(target.angle) <= math.radians(90.0)


def passed(radar, **values):
    for name, value in values.items():
        radar.set_value(f"output1.{name}", value)
    return [target.range for target in radar.targets(1, 0.0)]


@pytest.fixture
def filtered():
    radar = SimulatedRadar(find_model("4001"))
    radar.scene = lambda now: [Target(30.0, 1.0, 10.0, 0.0), Target(50.0, -2.0, 20.0, 0.0),
                               Target(40.0, 4.0, 60.0, 0.0)]
    return radar


@pytest.mark.parametrize(("values", "ranges"), [
    ({}, [10, 20, 60]),
    ({"range_min": 15.0}, [20, 60]), ({"range_max": 25.0}, [10, 20]),
    ({"signal_min_db": 35.0}, [20, 60]), ({"signal_max_db": 45.0}, [10, 60]),
    ({"velocity_min": 1.5}, [20, 60]), ({"velocity_max": 3.0}, [10, 20]),
    ({"direction": "approaching"}, [10, 60]), ({"direction": "receding"}, [20]),
    ({"filter_signal": "range", "filter_type": "min"}, [10]),
    ({"filter_signal": "range", "filter_type": "max"}, [60]),
    ({"filter_signal": "range", "filter_type": "mean"}, [30]),
    ({"filter_signal": "range", "filter_type": "median"}, [20]),
    ({"filter_signal": "range", "filter_type": "highest_amplitude"}, [20]),
    ({"filter_signal": "velocity", "filter_type": "max"}, [60]),
    ({"range_max": 5.0, "filter_signal": "range"}, [])])
def test_the_filters_of_an_output(filtered, values, ranges):
    assert passed(filtered, **values) == pytest.approx(ranges)


def test_a_fine_limit_and_the_mounting_offset_of_the_6203():
    radar = SimulatedRadar(find_model("6203"))
    radar.scene = lambda now: [Target(30.0, 0.0, 5.55, 0.0), Target(30.0, 0.0, 5.65, 0.0)]
    assert passed(radar, range_max_extended=5.61) == pytest.approx([5.55])
    radar.set_value("mounting_offset", 0.5)
    assert passed(radar) == pytest.approx([5.05, 5.15])


def test_rising_and_falling_delay():  # section 3.3.5.3
    cycle_time, seen = 0.075, {2, 3, 4, 5, 8, 12}
    radar = SimulatedRadar(find_model("4001"))
    radar.scene = lambda now: [Target(
        30.0, 1.0, 10.0 if round(now / cycle_time) in seen else 149.0, 0.0)]

    def cycles_with_targets(**values):
        passed(radar, range_max=20.0, **values)
        return [cycle for cycle in range(16) if radar.targets(1, cycle * cycle_time)]

    assert cycles_with_targets() == [2, 3, 4, 5, 8, 12]
    assert cycles_with_targets(rising_delay_cycles=3) == [4, 5]
    assert cycles_with_targets(falling_delay_cycles=3) == [4, 5, 6, 7, 8, 9, 10]
    assert cycles_with_targets(rising_delay_cycles=0) == [*range(2, 11), 12, 13, 14]


def test_a_pwm_output_shows_what_the_filter_looks_at(filtered):  # section 3.3.8.2
    passed(filtered, mode="pwm", filter_signal="velocity", filter_type="min")
    assert filtered._digital_output(1, 0.0) == -200
    passed(filtered, filter_signal="range", filter_type="max")
    assert filtered._digital_output(1, 0.0) == 6000


@pytest.mark.parametrize(("values", "state"), [
    ({"mode": "digital"}, 1), ({"mode": "digital", "range_max": 5.0}, 0),
    ({"mode": "digital", "contact": "normally_closed"}, 0),
    ({"mode": "digital", "contact": "normally_closed", "range_max": 5.0}, 1),
    ({"mode": "disabled"}, 0), ({"mode": "pwm"}, 1000), ({"mode": "pwm", "range_max": 5.0}, 0)])
def test_the_digital_outputs(filtered, values, state):
    passed(filtered, **values)
    reply = ask(SimulatedRadars([filtered]), commands.READ_DIGITAL_OUTPUTS.request(128))
    assert commands.READ_DIGITAL_OUTPUTS.decode(reply.pdu)[0] == state


def test_clipping_is_a_list_without_targets():
    line, radar = line_of("4001")
    radar.clipping = True
    ask(line, commands.START.request(128))
    measured = decode_target_list(ask(line, commands.read_target_list(128, 1, Resolution.BITS_32)))
    assert measured.clipping
    assert measured.targets == ()


def test_a_list_of_fixed_length_is_filled_up():
    line, _ = line_of("6005")
    ask(line, commands.START.request(100))
    ((_, reply),) = line.receive(
        commands.read_target_list(100, 1, Resolution.BITS_32_FIXED).encode(), NOW)
    assert len(reply) == 1 + 3 + 2 + 10 * 14 + 2


# --- several on one line -----------------------------------------------------------------------

def test_each_radar_answers_for_itself():
    line, _, second = line_of("4001", addresses=(10, 11))
    assert ask(line, commands.START.request(11)).source == 11
    assert second.measuring
    assert answer(line, commands.START.request(12)) == ""


def test_two_answers_at_once_are_no_frame():
    line, *_ = line_of("4001", addresses=(0x81, 0x82))
    ((_, data),) = line.receive(commands.READ_ADDRESS.request(0).encode(), NOW)
    assert list(FrameParser().feed(data)) == []


def test_an_unknown_model_is_named():
    with pytest.raises(WrongDeviceError, match='"4711" is not a known iSYS model'):
        simulated_line(["4711"])


def test_a_link_that_cannot_be_made_is_named(tmp_path):
    taken = tmp_path / "taken"
    taken.write_text("precious")
    with pytest.raises(LinkError, match="cannot make the link"):
        simulated_line(["4001"], link=str(taken))
    assert taken.read_text() == "precious"


def test_a_tcp_port_that_is_taken_is_named():
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"127.0.0.1:{server.getsockname()[1]}"
        with pytest.raises(LinkError, match=f"cannot listen on {address}"):
            simulated_line(["4001"], listen=address)


# --- the line misbehaves -----------------------------------------------------------------------

def test_faults_of_the_line():
    reply = bytes(range(100))
    assert Faults().apply(NOW, reply) == [(NOW, reply)]
    assert Faults(drop=1.0).apply(NOW, reply) == []
    assert Faults(silent=True).apply(NOW, reply) == []
    assert Faults(delay=0.5).apply(NOW, reply) == [(NOW + 0.5, reply)]
    assert Faults(split=0.5).apply(NOW, reply) == [(NOW, reply[:50]), (NOW + 0.5, reply[50:])]
    ((_, noisy),) = Faults(noise=1.0).apply(NOW, reply)
    assert noisy.endswith(reply)
    assert 1 <= len(noisy) - len(reply) <= 20
    ((_, corrupt),) = Faults(corrupt=1.0).apply(NOW, reply)
    assert sum(one != other for one, other in zip(corrupt, reply, strict=True)) == 1


def test_probabilities_are_kept():
    faults = Faults(drop=0.3)
    lost = sum(not faults.apply(NOW, b"x") for _ in range(1000))
    assert 200 < lost < 400


# --- the command line --------------------------------------------------------------------------

def exchange(port, request, baud_rate=115200):
    """Send bytes to a port and return the frame that comes back."""
    link = SerialLink(port, baud_rate)
    parser = FrameParser()
    link.write(bytes.fromhex(request))
    frames = []
    while not frames:
        data = link.read(DEADLINE)
        assert data, "no answer"
        frames = list(parser.feed(data))
    link.close()
    return str(frames[0])


@pytest.fixture
def simulate():
    """Start `simulate isys`; what still runs is killed."""
    processes = []

    def start(*arguments):
        processes.append(Process("sensor_tools.simulate", "isys", *arguments))
        return processes[-1]

    yield start
    for process in processes:
        process.__exit__()


def test_a_simulator_makes_a_link_and_says_where_it_is(simulate, tmp_path):
    path = str(tmp_path / "radar")
    process = simulate("--model", "iSYS-4001", "--link", path)
    assert process.wait_for_line("iSYS-4001").startswith(f"{path}: iSYS-4001 at address 128")
    assert exchange(path, START) == str(Frame(MASTER, 128, 0xD1))
    process.stop(signal.SIGTERM)
    assert not os.path.lexists(path)


def test_a_simulator_of_several_models_at_addresses(simulate, tmp_path):
    path = str(tmp_path / "radars")
    process = simulate("--model", "4001,6203", "--address", "10,11", "--baud", "57600",
                       "--link", path)
    line = process.wait_for_line("at address")
    assert "iSYS-4001 at address 10, iSYS-6203 at address 11" in line
    request = commands.READ_PRODUCT_INFORMATION.request(11).encode().hex()
    assert exchange(path, request, 57600) == str(Frame(MASTER, 11, 0xD6, b"\x18\x3b"))
    process.stop(signal.SIGINT)
    assert not os.path.lexists(path)


def test_a_line_on_tcp_keeps_its_baud_rate():
    line, _ = simulated_line(["4003"], listen="127.0.0.1:0")
    line.start()
    link = SerialLink(line.port, 9600)
    link.write(commands.READ_DEVICE_NAME.request(128).encode())
    start, data = time.monotonic(), b""
    while len(data) < 26:
        data += link.read(DEADLINE)
    assert time.monotonic() - start > link.seconds(len(data))
    link.close()
    line.close()


def test_a_simulator_on_tcp(simulate):
    process = simulate("--listen", "127.0.0.1:0")
    port = process.wait_for_line("socket://").split(": ")[0]
    assert exchange(port, START) == str(Frame(MASTER, 128, 0xD1))
    process.stop()


def test_a_simulator_obeys(simulate, tmp_path):
    path = str(tmp_path / "radar")
    process = simulate("--link", path)
    process.wait_for_line("commands: ")
    for command in ("silent on", "silent off", "clipping on", "strict on", "self-starting on",
                    "drop 0.5", "drop 0", "delay 0.001", "power-cycle", "refuse 0xDA,0xD1",
                    "refuse", "baud 57600", "baud 115200", "babble 0.5", "babble_byte 0x55",
                    "babble 0", "echo on", "echo off", "unplug", "plug", "hang"):
        process.tell(command)
        process.wait_for_line(f"done: {command}")
    for command in ("dance", "silent", "silent maybe", "drop much"):
        process.tell(command)
        process.wait_for_line(f"cannot do {command!r}: ")
    process.tell("quit")
    assert process.wait() == 0
    assert not os.path.lexists(path)


@pytest.mark.parametrize(("arguments", "words"), [
    (["--model", "4711"], '"4711" is not a known iSYS model'),
    (["--address", "ten"], "--address takes numbers such as 1,2, not 'ten'"),
    (["--address", "1"], "1"), (["--address", "300"], "300"),
    (["--link", "/does/not/exist"], "cannot make the link /does/not/exist"),
    (["--listen", "nowhere"], "cannot listen on nowhere"),
    (["--baud", "-5"], "-5"),
    (["--drop", "often"], "often")],
    ids=lambda value: value[0] if isinstance(value, list) else "")
def test_a_simulator_that_cannot_start_says_why(simulate, arguments, words):
    process = simulate(*arguments)
    assert process.wait() != 0
    assert "Traceback" not in process.log
    assert words in process.lines[-1]
