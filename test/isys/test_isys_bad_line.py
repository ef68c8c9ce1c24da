# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a session makes of a bad line: interruptions, damage, late replies, several radars."""

from __future__ import annotations

import dataclasses
import math
import random
import time

import pytest
from bus_master import DEADLINE, wait_until
from isys_master import (
    Lab,
    Master,
    Recorder,
    Script,
    Truth,
    counted_requests,
    function_code,
    half_a_step,
)
from virtual_line import VirtualLink, VirtualMaster, VirtualTime

from driver_common.device_thread import DeviceThread
from driver_common.errors import FrameError, LinkError, NoAnswerError, RefusedError
from isys_radar_driver import commands, connection
from isys_radar_driver import line as isys_line
from isys_radar_driver.commands import Location
from isys_radar_driver.frames import FAILURE, MASTER, READ_TARGET_LIST, Frame, FrameParser
from isys_radar_driver.radar import Options
from isys_radar_driver.session import RadarBus
from isys_radar_driver.targets import Target


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


# --- interruptions -----------------------------------------------------------------------------

def test_after_a_power_cycle_the_settings_are_applied_again(connect):
    master, _, simulated = connect(wanted={"output1.range_max": 42.0})
    master.maintenance.write(master.radar, {"frequency_channel": 3})
    master.measure()
    simulated.power_cycle()
    assert simulated.value("output1.range_max") == 150.0
    master.lists(2)
    assert simulated.value("output1.range_max") == 42.0
    assert simulated.value("frequency_channel") == 3


def test_a_reset_without_notice_is_noticed_by_the_refusal(connect):
    master, _, simulated = connect(wanted={"output1.range_max": 42.0})
    master.measure()
    simulated.power_cycle(now=-math.inf)  # it answers again at once
    master.lists(2)
    assert master.heard.lost == []
    assert simulated.value("output1.range_max") == 42.0
    assert any("configuring it again" in note for note in master.heard.notes)


@pytest.fixture
def self_starting(connect):
    """A radar that measures with a setting in its RAM, and will measure after a reset as well."""
    master, line, simulated = connect(wanted={"output1.range_max": 42.0})
    simulated.self_starting = True
    master.measure()
    return master, line, simulated


def test_a_radar_that_measures_on_after_a_reset_is_noticed_by_its_settings(
        self_starting, monkeypatch):
    master, _, simulated = self_starting
    monkeypatch.setattr(connection, "CHECK_PERIOD", 0.3)
    master.until(lambda: master.radar.checks > 1)
    simulated.power_cycle(now=-math.inf)  # it answers again at once
    master.until(lambda: simulated.value("output1.range_max") == 42.0)
    master.lists()
    assert simulated.measuring
    assert master.heard.lost == []
    assert any("output1.range_max is 150 m, it was 42 m" in note for note in master.heard.notes)


def test_after_a_silence_the_settings_are_looked_at_before_a_list_is_taken(self_starting):
    master, line, simulated = self_starting
    master.radar.check_due = math.inf
    simulated.power_cycle(now=-math.inf)
    simulated.scene = lambda now: [Target(40.0, 1.0, 100.0, 0.0)]  # beyond what is wanted
    misses = iter([True])
    line.faults = Script(lambda due, reply: [] if next(misses, False) else [(due, reply)])
    before = len(master.heard.lists)
    master.until(lambda: master.radar.statistics.timeouts)
    master.lists(2)
    assert [measured.targets for _, measured, _ in master.heard.lists[before:]] == [(), ()]
    assert simulated.value("output1.range_max") == 42.0


@pytest.mark.parametrize(("model", "fits"), [("iSYS-4001", True), ("iSYS-4003", False),
                                             ("iSYS-6003", True), ("iSYS-6006", False)])
def test_a_radar_is_checked_while_it_measures_where_that_costs_no_cycle(connect, model, fits):
    master, *_ = connect(model, baud_rate=0)
    assert master.bus.connection.is_check_due(master.radar) == fits


# --- refusals ----------------------------------------------------------------------------------

def test_a_radar_that_refuses_target_lists_stays_connected_and_is_told_once(connect):
    master, _, simulated = connect(output=3)
    requests = counted_requests(simulated)
    reply = simulated.reply

    def refuse(request, now):
        refused = request.function_code == 0xDA and request.pdu[0] == 3
        return (now, Frame(MASTER, 128, FAILURE)) if refused else reply(request, now)

    simulated.reply = refuse
    master.bus.set_active(True)
    master.until(lambda: master.radar.refused > 4)
    (again, refusal) = master.heard.warnings
    assert again == "it refuses to measure, as after a reset; configuring it again"
    assert refusal.startswith("no target list of output 3 in 32 bit, change output or "
                              "target_list_resolution: address 128 answers with failure (0xFD)")
    assert str(master.radar.error) in refusal
    assert (master.heard.lost, master.heard.found) == ([], [""])
    assert requests[-1] - requests[-4] > 0.2  # ever more rarely
    master.radar.options.output = 1
    master.lists(2)
    assert master.radar.error is None
    assert master.heard.notes[-1] == "is well again"


def test_a_radar_that_cannot_be_configured_again_is_found_anew(self_starting):
    master, line, simulated = self_starting
    master.radar.check_due = 0.0
    simulated.power_cycle(now=-math.inf)
    get_through = iter([True, *[False] * 4])  # the check that shows the reset, then every attempt
    line.faults = Script(lambda due, reply: (
        [(due, reply)] if function_code(reply) != commands.READ_APPLICATION
        or next(get_through, True) else []))
    master.lose()
    assert master.radar.identity is None
    assert any("configuring it again" in note for note in master.heard.notes)
    master.lists()
    assert simulated.value("output1.range_max") == 42.0
    assert master.radar.values == {name: simulated.value(name) for name in simulated.settings}


@pytest.mark.parametrize("name", ["iSYS-4001", "iSYS-5010", "iSYS-5020", "iSYS-5110"])
def test_a_reset_without_notice_is_noticed_while_the_radar_is_idle(connect, monkeypatch, name):
    monkeypatch.setattr(connection, "KEEP_ALIVE", 0.02)
    master, _, simulated = connect(name)
    setting = {"iSYS-4001": "output1.range_max", "iSYS-5010": "moving_target_sensitivity.near_db",
               "iSYS-5020": "moving_target_sensitivity.near_db",
               "iSYS-5110": "stop_bar_zone1.range_max"}[name]
    master.maintenance.write(master.radar, {setting: 9.0})
    simulated.power_cycle(now=-math.inf)
    master.until(lambda: simulated.value(setting) == 9.0)


def test_a_radar_that_goes_silent_is_lost_and_returns(connect):
    master, _, simulated = connect()
    master.measure()
    simulated.silent = True
    error = master.lose()
    assert "no answer" in str(error) or "does not answer" in str(error)
    assert master.radar.identity is None
    simulated.silent = False
    master.lists(3)
    assert master.radar.connections == 2
    assert master.radar.error is None


def test_a_radar_that_returns_measures_before_all_its_settings_are_looked_at(connect):
    master, _, simulated = connect(wanted={"output1.range_max": 42.0})
    master.measure()
    simulated.silent = True
    master.lose()
    requests, reply = [], simulated.reply

    def noting(request, now):
        requests.append(request.function_code)
        return reply(request, now)

    simulated.reply = noting
    simulated.silent = False
    master.lists()
    assert requests.index(READ_TARGET_LIST) < 8
    master.until(lambda: not master.radar.unchecked)
    assert requests.count(commands.READ_APPLICATION) > 40
    assert not set(requests) & {commands.READ_SENSOR + 1, commands.READ_APPLICATION + 1}
    assert master.radar.connections == 2
    assert master.heard.warnings == []


def test_a_setting_that_changed_during_an_outage_is_found(connect):
    master, _, simulated = connect()
    master.measure()
    simulated.silent = True
    master.lose()
    simulated.set_value("output3.signal_min_db", 12.0)
    simulated.silent = False
    master.until(lambda: master.radar.values["output3.signal_min_db"] == 12.0)
    assert "output3.signal_min_db is 12 dB, it was 0 dB" in master.heard.warnings[-1]
    assert master.heard.values[-1]["output3.signal_min_db"] == 12.0


def test_a_radar_that_returns_after_the_end_of_measuring_is_stopped(connect):
    master, _, simulated = connect()
    master.measure()
    simulated.silent = True
    master.lose()
    master.bus.set_active(False)
    simulated.silent = False
    master.find()
    assert not simulated.measuring
    assert master.radar.measuring is False


def test_in_doubt_the_radars_own_limits_count_as_well(connect):
    master, _, simulated = connect(wanted={"output1.range_max": 40.0})
    simulated.targets = lambda output, now: [Target(40.0, 1.0, 100.0, 0.0)]
    assert master.measure()[0].targets  # a firmware that does not filter its lists
    master.bus.line.damaged = time.monotonic()
    master.until(lambda: master.radar.statistics.implausible_lists)


def test_doubt_ends_where_only_the_radars_own_limits_object(monkeypatch):
    link = VirtualLink(VirtualTime(), "iSYS-4001")
    link.radars[0].targets = lambda output, now: [Target(40.0, 1.0, 100.0, 0.0)]
    master = VirtualMaster(monkeypatch, link, Options(wanted={"output1.range_max": 40.0}))
    master.measure()
    master.bus.line.damaged = link.clock.now
    master.run(isys_line.DOUBT_TIME)
    assert master.radar.statistics.implausible_lists > 0
    master.run(1.0)
    master.heard.lists.clear()
    master.run(1.0)
    assert len(master.heard.lists) > 10


def test_a_line_that_is_unplugged_is_an_error_that_says_so(connect):
    master, line, _ = connect()
    master.measure()
    line.close()
    with pytest.raises(LinkError, match=f"lost {line.port}: "):
        master.measure()
    master.bus.close()
    assert master.radar.identity is None


def test_a_line_that_is_plugged_in_again_is_opened_and_measures(start, tmp_path):
    link = str(tmp_path / "radar")
    line, _ = start("iSYS-4001", link=link)
    heard, states = Recorder(), []
    bus = RadarBus(link, 0, [Options(wanted={"output1.range_max": 42.0})], heard)
    thread = DeviceThread("bus", bus, states.append)
    thread.start()
    try:
        thread.call(lambda: bus.set_active(True))
        wait_until(lambda: len(heard.lists) > 2)
        line.close()
        wait_until(lambda: len(states) > 2)
        assert "lost" in str(states[1]) or "open" in str(states[1])
        assert bus.devices[0].identity is None
        before = len(heard.lists)
        _, again = start("iSYS-4001", link=link)
        wait_until(lambda: len(heard.lists) > before + 2)
        assert states[-1] is None
        assert again.value("output1.range_max") == 42.0
    finally:
        thread.stop()
    assert not again.measuring


def test_a_stop_ends_the_search_for_a_radar_and_leaves_the_others_stopped(start):
    line, radar, silent = start("iSYS-4001", addresses=[128, 129])
    silent.silent = True
    bus = RadarBus(line.port, 0, [Options("front", address=128), Options("rear", address=129)],
                   Recorder())
    thread = DeviceThread("bus", bus, lambda error: None)
    thread.start()
    try:
        thread.call(lambda: bus.set_active(True))
        wait_until(lambda: radar.measuring)

        def interrupted():
            bus.interrupt()
            while True:
                bus.poll()

        with pytest.raises(LinkError, match="the driver is to stop"):
            thread.call(interrupted)
    finally:
        thread.stop()
    assert not radar.measuring


def test_a_deactivation_ends_the_search_for_a_radar_which_goes_on_afterwards(start):
    line, radar, silent = start("iSYS-4001", addresses=[128, 129])
    silent.silent = True
    heard, states = Recorder(), []
    bus = RadarBus(line.port, 0, [Options("front", address=128), Options("rear", address=129)],
                   heard)
    thread = DeviceThread("bus", bus, states.append)
    thread.start()
    try:
        thread.call(lambda: bus.set_active(True))
        wait_until(lambda: radar.measuring)
        for _ in range(20):  # at any moment of the search
            thread.call(lambda: bus.set_active(False), DEADLINE, interrupt=True)
            assert not radar.measuring
            thread.call(lambda: bus.set_active(True), DEADLINE, interrupt=True)
            assert radar.measuring
        silent.silent = False
        wait_until(lambda: silent.measuring)
    finally:
        thread.stop()
    assert states == [None]
    assert heard.found == ["front", "rear"]


def test_closing_leaves_every_radar_stopped(start):
    line, first, second = start("iSYS-4001", addresses=[10, 11])
    master = Master(line.port, Options("front", address=10), Options("rear", address=11)).find()
    master.measure(4)
    assert first.measuring
    assert second.measuring
    master.bus.close()
    assert not first.measuring
    assert not second.measuring


# --- what is told -------------------------------------------------------------------------------

EVERYTHING = {*range(0x100)}  # function codes
TROUBLES = {
    "nothing answers": lambda link, second: setattr(link.radars[0], "silent", True),
    "it goes and comes": lambda link, second: setattr(link.radars[0], "silent", second % 20 > 9),
    "it refuses everything": lambda link, second: setattr(link.radars[0], "refuse", EVERYTHING),
    "it refuses now and then": lambda link, second: setattr(
        link.radars[0], "refuse", EVERYTHING if second % 2 > 1 else set()),
    "a stuck transmitter": lambda link, second: setattr(link, "noise", b"\x55" * 64),
    "a bad line": lambda link, second: setattr(link.faults, "damage", 0.01),
    "a line that hardly works": lambda link, second: setattr(link.faults, "damage", 0.1),
}


@pytest.mark.parametrize("trouble", TROUBLES)
def test_a_minute_of_trouble_is_a_few_lines(monkeypatch, trouble):
    link = VirtualLink(VirtualTime(), "iSYS-4001")
    master = VirtualMaster(monkeypatch, link, Options())
    master.bus.set_active(True)
    heard = master.heard
    before, end = len(heard.found), link.clock.now + 60.0
    while link.clock.now < end:
        TROUBLES[trouble](link, link.clock.now)
        link.clock.sleep(master.bus.poll())
    told = [*heard.notes, *heard.lost, *heard.found[before:]]
    assert len(told) <= 12, told


# --- a bad line --------------------------------------------------------------------------------

EVERYTHING = {"drop": 0.05, "corrupt": 0.1, "noise": 0.5, "split": 0.005, "echo": True}


@pytest.mark.parametrize(("model", "faults"), [
    ("iSYS-6006", {"split": 0.02}), ("iSYS-6006", {"delay": 0.02}), ("iSYS-6006", {"noise": 1.0}),
    ("iSYS-6006", {"drop": 0.1}), ("iSYS-6006", {"corrupt": 0.1}), ("iSYS-6006", {"echo": True}),
    ("iSYS-6006", EVERYTHING), ("iSYS-6005", EVERYTHING), ("iSYS-6005", {"corrupt": 0.1})],
    ids=lambda value: value if isinstance(value, str) else " ".join(value))
def test_nothing_wrong_is_ever_accepted_from_a_bad_line(connect, model, faults):
    master, line, simulated = connect(model, wanted={"output2.range_max": 9.0})
    truth = Truth(simulated)
    for name, value in faults.items():
        setattr(line.faults, name, value)
    master.measure(8)
    truth.confirm(master.heard.lists, half_a_step(model, 32))
    assert master.radar.values == {name: simulated.value(name) for name in simulated.settings}


def test_damaged_frames_and_noise_are_counted(connect):
    master, line, _ = connect()
    parser = master.bus.line.parser
    assert (parser.damaged_frames, parser.dropped_bytes) == (0, 0)
    line.faults.corrupt = 0.5
    line.faults.noise = 1.0
    master.bus.set_active(True)
    master.until(lambda: parser.damaged_frames and parser.dropped_bytes > 20)


def test_settings_arrive_over_a_bad_line(connect):
    master, line, simulated = connect()
    line.faults.drop = line.faults.corrupt = 0.05
    generator = random.Random(3)
    for _ in range(12):
        value = round(generator.uniform(1, 150), 1)
        try:
            reported = master.maintenance.write(master.radar, {"output1.range_max": value})
        except (NoAnswerError, FrameError):
            master.find()  # it was lost with the answer
            continue
        assert reported == {"output1.range_max": value}
        assert simulated.value("output1.range_max") == value


def sensitivity(master, side):
    """Read one of two settings whose replies look alike, once."""
    record = master.radar.settings[f"threshold_sensitivity.{side}_db"].record
    return master.bus.access.read_record(master.radar, record, Location.RAM)


@pytest.fixture
def late(connect):
    """A radar whose next replies come as late as the list says; 0 when it is empty."""
    master, line, simulated = connect()
    simulated.set_value("threshold_sensitivity.left_db", 1.0)
    simulated.set_value("threshold_sensitivity.right_db", 2.0)
    delays, last = [], [0.0]

    def delayed(due, reply):
        last[0] = max(last[0], due + (delays.pop(0) if delays else 0.0))  # never overtaking
        return [(last[0], reply)]

    line.faults = Script(delayed)
    return master, simulated, delays


def test_a_late_reply_is_not_taken_for_the_answer_to_the_next_request(late):
    master, _, delays = late
    delays.append(isys_line.REPLY_TIMEOUT + 0.05)
    stale = master.bus.line.stale_frames
    record = master.radar.settings["threshold_sensitivity.left_db"].record
    with pytest.raises(NoAnswerError):
        master.bus.access.exchange(master.radar, record.read_request(128), lambda frame: frame,
                             isys_line.REPLY_TIMEOUT, attempts=1)
    assert sensitivity(master, "right") == (20,)  # the late one says 10, in the same form
    assert master.bus.line.stale_frames > stale


def test_a_late_refusal_is_not_taken_for_the_answer_to_the_next_request(late):
    master, simulated, delays = late
    delays.append(isys_line.REPLY_TIMEOUT + 0.05)
    simulated.refuse.add(commands.READ_SENSOR)
    record = master.radar.settings["threshold_sensitivity.left_db"].record
    with pytest.raises(NoAnswerError):
        master.bus.access.exchange(master.radar, record.read_request(128), lambda frame: frame,
                             isys_line.REPLY_TIMEOUT, attempts=1)
    simulated.refuse.clear()
    assert sensitivity(master, "right") == (20,)


def test_a_late_target_list_is_not_taken_for_that_of_another_output(connect):
    master, line, _ = connect()
    master.measure()
    late_lists = [0.4]
    line.faults = Script(lambda due, reply: [(due + (
        late_lists.pop() if function_code(reply) == 0xDA and late_lists else 0.0), reply)])
    master.until(lambda: master.radar.statistics.timeouts)
    master.radar.options.output = 2
    assert [measured.output for measured in master.lists(3)] == [2, 2, 2]


def test_whatever_comes_late_every_answer_is_the_right_one(late):
    master, simulated, delays = late
    generator = random.Random(5)
    right = {"left": (10,), "right": (20,)}
    answered = 0
    for _ in range(24):
        delays[:] = [generator.choice((0.0, 0.0, 0.0, 0.09, 0.11, 0.25)) for _ in range(3)]
        if generator.random() < 0.2:
            simulated.refuse.add(commands.READ_SENSOR)
        side = generator.choice(("left", "right"))
        try:
            assert sensitivity(master, side) == right[side]
            answered += 1
        except NoAnswerError:
            pass
        except RefusedError:
            assert simulated.refuse
        simulated.refuse.clear()
    assert answered > 5


def test_a_reply_from_another_address_is_not_accepted(connect):
    master, line, _ = connect()

    def foreign(due, reply):
        (frame,) = FrameParser().feed(reply)
        other = dataclasses.replace(frame, source=99, pdu=bytes(len(frame.pdu)))
        return [(due, other.encode()), (due, reply)]

    before = sensitivity(master, "left")
    line.faults = Script(foreign)
    stale = master.bus.line.stale_frames
    assert sensitivity(master, "left") == before
    assert master.bus.line.stale_frames > stale


def test_the_echo_of_our_own_bytes_is_no_reply(connect):
    master, line, simulated = connect()
    line.faults.echo = True
    master.maintenance.write(master.radar, {"output1.range_max": 12.0})
    assert simulated.value("output1.range_max") == 12.0
    master.measure(8)
    assert master.bus.line.stale_frames < 8


def test_a_radar_is_found_on_a_line_with_echo(start):
    line, _ = start("iSYS-4001")
    line.faults.echo = True
    assert Master(line.port).find().radar.address == 128


# --- a host that sleeps ------------------------------------------------------------------------

def test_a_list_that_was_read_after_a_sleep_of_the_host_is_not_published(monkeypatch):
    """Nobody knows when it came. Here the range of the target tells when it was measured."""
    link = VirtualLink(VirtualTime(), "iSYS-4001")
    master = VirtualMaster(monkeypatch, link, Options())
    link.radars[0].scene = lambda now: [Target(40.0, -1.0, 1.0 + now % 100.0, 0.0)]
    master.measure(10)
    for _ in range(20):
        link.suspension = 3.0
        master.run(4.0)
    assert not link.suspension
    assert master.radar.statistics.lost_cycles > 300
    assert len(master.heard.lists) > 100
    for _, measured, stamp in master.heard.lists:
        late = (1e-9 * stamp - (measured.targets[0].range - 1.0)) % 100.0
        assert -0.1 < (late + 50.0) % 100.0 - 50.0 < 0.2


# --- several radars on one line ----------------------------------------------------------------

def test_several_radars_take_turns(start):
    line, first, second = start("iSYS-4001", addresses=[10, 11])
    first.scene = lambda now: [Target(40.0, 1.0, 10.0, 0.1)]
    second.scene = lambda now: [Target(50.0, 2.0, 20.0, -0.1)]
    master = Master(line.port, Options("front", address=10), Options("rear", address=11)).find()
    master.measure(10)
    distances = {"front": 10.0, "rear": 20.0}
    for name, measured, _ in master.heard.lists:
        assert [target.range for target in measured.targets] == pytest.approx([distances[name]])
    counts = {name: sum(1 for heard, *_ in master.heard.lists if heard == name)
              for name in distances}
    assert abs(counts["front"] - counts["rear"]) <= 1


@pytest.fixture
def pair(monkeypatch):
    """Two radars on a virtual line, where the machine's load does not shift cycles."""
    link = VirtualLink(VirtualTime(), "iSYS-4001", "iSYS-4001", addresses=(10, 11))
    master = VirtualMaster(monkeypatch, link, Options("front", address=10),
                           Options("rear", address=11))
    return master, *link.radars


def out_of_phase(first, second):
    """Return how far the ends of two cycles lie apart, in cycles: 0 together, 0.5 in turn."""
    return abs(math.remainder(first.started - second.started, 0.075)) / 0.075


def missed(master):
    return sum(radar.statistics.shared_cycles + radar.statistics.lost_cycles
               for radar in master.bus.devices)


def test_radars_on_one_line_measure_in_turn_and_each_gets_its_own_cycle(pair):
    master, first, second = pair
    master.measure(2)
    assert out_of_phase(first, second) > 0.3
    before = missed(master)
    master.lists(40)
    assert missed(master) - before <= 2


def test_a_radar_that_starts_again_finds_its_turn(pair):
    master, first, second = pair
    master.measure(4)
    for radar, simulated in zip(master.bus.devices, (first, second), strict=True):
        master.bus.set_enabled(radar, False)
        master.lists()
        master.bus.set_enabled(radar, True)
        assert simulated.measuring
        assert out_of_phase(first, second) > 0.3


def test_radars_whose_clocks_drifted_together_are_parted_again(pair):
    master, first, second = pair
    master.measure(4)
    second.started = first.started
    master.until(lambda: out_of_phase(first, second) > 0.3)
    assert master.heard.lost == []


def test_cycles_that_the_line_leaves_to_another_radar_are_not_lost(pair):
    master, first, second = pair
    master.measure(2)
    second.started = first.started
    master.lists(20)
    assert sum(radar.statistics.shared_cycles for radar in master.bus.devices) > 10
    assert master.bus.acquisition.least_rate(master.radar) == pytest.approx(1 / 0.15)
    for radar in master.bus.devices:
        assert radar.statistics.target_lists > radar.statistics.lost_cycles


def test_a_silent_radar_is_asked_more_and_more_rarely_and_returns_by_itself(start):
    line, first, second = start("iSYS-4001", addresses=[10, 11])
    master = Master(line.port, Options("front", address=10), Options("rear", address=11)).find()
    master.measure(4)
    second.silent = True
    assert master.lose() is not None
    requests = counted_requests(second)
    master.lists()
    truth = Truth(first)
    front = master.bus.devices[0].statistics
    lists, left = front.target_lists, front.shared_cycles
    master.until(lambda: len(requests) >= 3)
    cycles = round((truth.recorded[-1][0] - truth.recorded[0][0]) / 0.075) + 1
    assert front.target_lists > lists
    assert front.target_lists - lists + front.shared_cycles - left <= cycles + 3
    second.silent = False
    start_of_return = len(master.heard.lists)
    master.until(lambda: "rear" in [name for name, *_ in master.heard.lists[start_of_return:]])
    assert [name for name, _ in master.heard.lost] == ["rear"]


def test_settings_go_to_the_radar_that_is_meant(start):
    line, first, second = start("iSYS-4001", addresses=[10, 11])
    master = Master(line.port, Options("front", address=10), Options("rear", address=11)).find()
    master.maintenance.write(master.bus.devices[1], {"output1.range_max": 12.0})
    assert first.value("output1.range_max") == 150.0
    assert second.value("output1.range_max") == 12.0
