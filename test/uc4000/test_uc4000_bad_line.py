# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a session makes of a bad line: echo, strangers, damage, refusals, late replies."""

from __future__ import annotations

import contextlib
import functools
import itertools
import math
import os
import random
import threading
import time
import tty

import pytest
import serial
from bus_master import DEADLINE, wait_until
from uc4000_master import Master, Recorder, Requests, counts, named, still

from driver_common.device_thread import DeviceThread
from driver_common.errors import NoAnswerError, RefusedError, WrongDeviceError
from driver_common.simulator.line import SimulatedLine
from uc4000_driver import commands
from uc4000_driver.commands import OpCode
from uc4000_driver.line import TRANSMISSION_ERRORS, BusyError
from uc4000_driver.sensor import Options
from uc4000_driver.session import Uc4000Bus
from uc4000_driver.simulator import sensor as simulated_sensor
from uc4000_driver.simulator.line import SimulatedSensors
from uc4000_driver.simulator.sensor import SimulatedSensor
from uc4000_driver.telegram import CAST, ErrorCode, Reply, Request

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
           "to there; check the sensor's power and wiring, and the address")])
def test_no_sensor(connect, echo, text):
    line, (simulated,) = connect()
    line.faults.echo = echo
    simulated.silent = True
    master = connect.master(line, Options())
    assert str(master.lose()) == text.format(port=line.port)
    simulated.silent = False
    assert master.distances() == [still(0)]


def test_a_sensor_that_answers_only_some_requests(connect, monkeypatch):
    line, (simulated,) = connect(2)
    master = connect.master(line, Options(address=2))
    reply = simulated.reply

    def answer_casts(request, now):
        return reply(request, now) if request.address == CAST else None

    monkeypatch.setattr(simulated, "reply", answer_casts)
    assert str(master.lose()) == (
        f"no answer from address 2 on {line.port}; it answers only some requests; check the wiring "
        "(termination, length, ground)")


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
    assert "several devices have address 4" in str(error)
    assert set(master.distances(3, "s5")) == {still(2)}


def test_two_replies_to_one_request(connect):
    line, (simulated, _) = connect(4, 4)
    simulated.silent = True
    master = connect.master(line, Options(address=4)).find()
    simulated.silent = False
    error = master.lose()
    assert "several devices have address 4" in str(error)

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
    codes = [code for code in (*range(0x01, 0x0E), 0x42, 0xFF) if code not in TRANSMISSION_ERRORS]
    for code in codes:
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
    assert master.sensor.statistics.refusals.total() == len(codes) == 10


def test_one_that_goes_on_refusing_is_mentioned_once(one):
    _, simulated, master = one
    simulated.refuse[OpCode.PROFILE_B] = ErrorCode.SESSION_ERROR
    master.until(lambda: master.sensor.statistics.refusals[ErrorCode.SESSION_ERROR] >= 3)
    assert master.heard.notes == [
        "address 7 cannot measure: session error (0x06); it is asked again"]


@pytest.mark.parametrize("code", TRANSMISSION_ERRORS)
def test_a_request_that_arrived_damaged_is_sent_again(one, code):
    _, simulated, master = one
    master.find()
    simulated.refuse[OpCode.GAIN] = code

    def only_once(request, answer):
        simulated.refuse.clear()
        return answer

    Requests(simulated, only_once)
    assert master.write({"gain_db": 60.0}) == {"gain_db": 60.0}
    assert master.sensor.statistics.damaged_requests == 1
    assert master.sensor.statistics.refusals.total() == 0


@pytest.mark.parametrize("code", TRANSMISSION_ERRORS)
def test_a_measurement_whose_request_arrived_damaged_is_no_refusal(one, code):
    _, simulated, master = one
    master.measure()
    times = iter([True] * 4)

    def damage(request, answer):
        damaged = answer[0], Reply(bytes([code]), acknowledged=False)
        return damaged if next(times, False) else answer

    Requests(simulated, damage)
    assert master.distances(2) == [still(0)] * 2
    assert master.sensor.statistics.damaged_requests == 4
    assert master.sensor.statistics.refusals.total() == 0
    assert (master.heard.notes, master.heard.lost) == ([], [])


def test_damage_without_end_is_named(one):
    _, simulated, master = one
    master.find()
    simulated.refuse = dict.fromkeys(OpCode, ErrorCode.CHECKSUM_ERROR)
    assert str(master.lose()) == "address 7 received a damaged request: checksum error (0x01)"


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


# --- hosts and sensors that are quicker or slower than ours --------------------------------------

@pytest.fixture
def at_once():
    """The path of a pseudo-terminal with sensors that answer everything as soon as they read it."""
    master, slave = os.openpty()
    tty.setraw(slave)
    sensors = SimulatedSensors([SimulatedSensor(1), SimulatedSensor(7)])
    for sensor in sensors.sensors:
        sensor.scene = lambda now, address=sensor.address: still(address)

    def serve():
        with contextlib.suppress(OSError):
            while data := os.read(master, 100):
                for _, reply in sensors.receive(data, time.monotonic() + 60 * next(minutes)):
                    os.write(master, reply)

    minutes = itertools.count()  # so that no reply meets another one
    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    yield os.ttyname(slave)
    os.close(slave)
    os.close(master)


@pytest.mark.parametrize("groups", [[], ["s1 s7"]])
def test_a_sensor_that_answers_at_once_is_used(at_once, groups):
    master = Master(at_once, *named(1, 7), groups=groups)
    try:
        master.measure(10)
        for name, measurement in master.heard.measurements:
            assert measurement.distance.value == still(int(name[1]))
        for sensor in master.bus.devices:
            assert sensor.temperature is not None
            assert sensor.statistics.outcomes.total() >= 4
            assert (sensor.statistics.damaged, sensor.statistics.timeouts) == (0, 0)
        assert (master.heard.lost, master.heard.notes) == ([], [])
    finally:
        master.bus.close()


class BusyHost:
    """A host that holds up this process for half a second at every so many-th step of a link."""

    def __init__(self, link, every, *, behind):
        self._every = every
        self._behind = behind
        self._steps = 0
        for name in ("read", "write"):
            setattr(link, name, functools.partial(self._do, getattr(link, name)))

    def _do(self, step, argument):
        self._steps += 1
        stalls = not self._steps % self._every
        if stalls and not self._behind:
            time.sleep(0.5)
        result = step(argument)
        if stalls and self._behind:
            time.sleep(0.5)
        return result


@pytest.mark.parametrize(("every", "behind", "echo"), [
    (5, False, False), (6, True, True), (7, True, False), (7, False, True)])
def test_a_busy_host_finds_nothing_wrong_with_the_line(connect, every, behind, echo):
    line, _ = connect()
    line.faults.echo = echo
    master = connect.master(line, Options(temperature_period=0.0))
    BusyHost(master.bus.line.link, every, behind=behind)
    assert master.distances(2) == [still(0)] * 2
    assert master.sensor.statistics.damaged == 0
    assert (master.heard.lost, master.heard.notes) == ([], [])


@pytest.mark.parametrize("behind", [False, True])
def test_a_group_on_a_busy_host_is_not_mixed_up(connect, behind):
    line, _ = connect(1, 2, 3)
    master = connect.master(line, *named(1, 2, 3), groups=["s1 s2 s3"]).find()
    master.measure(6)
    BusyHost(master.bus.line.link, 11, behind=behind)
    master.measure(9)
    for name, measurement in master.heard.measurements:
        assert measurement.distance.value == still(int(name[1]) - 1)


def test_a_sensor_that_dawdles_is_one_sensor(connect):
    line, (simulated,) = connect()
    chance = random.Random(8)
    busy_until = 0.0

    def dawdle(request, answer):  # one thing after the other, some of them late
        nonlocal busy_until
        if answer is None:
            return None
        due = max(busy_until, answer[0]) + 0.3 * (chance.random() < 0.1)
        busy_until = due + 0.015  # more than the longest reply takes
        return due, answer[1]

    Requests(simulated, dawdle)
    master = connect.master(line, Options())
    master.measure(5)
    assert {measurement.distance.value for _, measurement in master.heard.measurements} == {
        still(0)}
    assert not any("several" in str(error) or "damaged" in str(error)
                   for _, error in master.heard.lost)


# --- users who do not want to wait ---------------------------------------------------------------

@pytest.fixture
def serve(connect):
    """Start threads that serve a bus, and stop them."""
    threads = []

    def start(line, *options):
        heard = Recorder()
        bus = Uc4000Bus(line.port, options, heard)
        threads.append(DeviceThread("bus", bus, lambda error: None))
        threads[-1].start()
        threads[-1].call(lambda: bus.set_active(True))
        return threads[-1], bus, heard

    yield start
    for thread in threads:
        thread.stop()


def test_within_a_long_measurement_users_are_answered(connect, serve):
    line, (simulated,) = connect()
    thread, bus, heard = serve(line, Options(address=7, cycles=255))
    wait_until(lambda: simulated.measurements)
    with pytest.raises(BusyError, match=r"the line is in use for up to 1\d\.\d s more "
                                        r"\(address 7: measure\); try again then, or set cycles"):
        thread.call(lambda: bus.maintenance.write(bus.devices[0], {"gain_db": 60.0}))
    bus.devices[0].options.cycles = 1
    assert thread.call(lambda: dict(bus.devices[0].values))["gain_db"] == 72.0
    thread.call(lambda: bus.set_active(False))
    (_, end), = simulated.measurements
    assert time.monotonic() < end  # all that took less time than the measurement, 12.75 s
    assert heard.measurements == []


def test_a_distance_that_comes_after_a_stop_is_not_told(connect, serve):
    line, (simulated,) = connect()
    thread, bus, heard = serve(line, Options(address=7, cycles=20, temperature_period=0.0))
    wait_until(lambda: simulated.measurements)
    thread.call(lambda: bus.set_active(False))
    asked = Requests(simulated)
    wait_until(lambda: asked.all)  # it looks whether the sensor is there, so the wait is over
    assert heard.measurements == []


def test_short_measurements_are_waited_for(connect, serve):
    line, (simulated,) = connect()
    thread, bus, _ = serve(line, Options(address=7, cycles=7, temperature_period=0.0))
    wait_until(lambda: simulated.measurements)
    for gain in (60.0, 61.0, 62.0):
        assert thread.call(lambda gain=gain: bus.maintenance.write(
            bus.devices[0], {"gain_db": gain})) == {"gain_db": gain}


class Babbler:
    """A device that does not stop talking."""

    baud_rate = 19200

    def __init__(self):
        self.was_asked = threading.Event()

    def receive(self, data, now):
        self.was_asked.set()
        return [(now, bytes(60 * 1920))]  # for a minute


def test_on_a_line_full_of_noise_users_are_answered():
    babbler = Babbler()
    line = SimulatedLine(babbler).start()
    bus = Uc4000Bus(line.port, [Options()], Recorder())
    thread = DeviceThread("bus", bus, lambda error: None)
    thread.start()
    try:
        assert babbler.was_asked.wait(DEADLINE)
        thread.call(lambda: bus.set_active(False), DEADLINE, interrupt=True)
        with pytest.raises(NoAnswerError, match="is not connected"):
            thread.call(lambda: bus.maintenance.write(bus.devices[0], {"gain_db": 60.0}))
    finally:
        thread.stop()
        line.close()


# --- figures -------------------------------------------------------------------------------------

def figures(master, line, simulated, damage, count):
    """Measure on a line that hurts bytes until so many distances arrived whole.

    Returns:
        Share of the distances that were sent and arrived whole which were told, the most that were
        missing in a row, the longest time in s between two, and how many requests the sensor
        heard for each.
    """
    sent = itertools.count()
    simulated.scene = lambda now: 0.016 * (16 + next(sent) % 200)  # each one is another one
    answers, whole = [], []

    def note(request, answer):
        if request.op_code == OpCode.PROFILE_B and answer and answer[1].acknowledged:
            answers.append(answer[1].encode())
        return answer

    apply = line.faults.apply

    def note_whole(due, reply):
        pieces = apply(due, reply)
        if answers and reply == answers[-1]:
            whole.append((answers.pop(), pieces == [(due, reply)]))
        return pieces

    requests = Requests(simulated, note).all
    line.faults.apply = note_whole
    line.faults.damage = damage
    start = len(master.heard.measurements)
    master.until(lambda: sum(intact for _, intact in whole) >= count, seconds=300.0)
    told = [measurement for _, measurement in master.heard.measurements[start:]]
    left = iter(told)
    after = next(left, None)
    missing, rows = 0, [0]
    for reply, intact in whole:
        if after is not None and round(after.distance.value / 0.016) == reply[0]:
            after = next(left, None)
            rows.append(0)
        elif intact:
            missing += 1
            rows[-1] += 1
    assert after is None  # all that was told had been sent, in this order
    gaps = [(b.stamp - a.stamp) * 1e-9 for a, b in itertools.pairwise(told)]
    return 1 - missing / count, max(rows), max(gaps), len(requests) / len(told)


@pytest.mark.parametrize(("damage", "share"), [(1e-3, 0.99), (1e-2, 0.95)])
def test_a_line_that_hurts_bytes_costs_little_and_no_truth(
        one, damage, share, monkeypatch):
    line, simulated, master = one
    for module in (commands, simulated_sensor):
        monkeypatch.setattr(module, "CYCLE_TIME", 0.005)  # to see more of them
    simulated.evaluation = 0.001
    master.find()
    told, missing, gap, requests = figures(master, line, simulated, damage, 300)
    statistics = master.sensor.statistics
    print(f"{damage:g} a byte: {told:.1%} of what arrived whole was told, at most {missing} not "
          f"in a row; longest gap {gap:.2f} s; {requests:.2f} requests for each; "
          f"{statistics.timeouts} time-outs, {statistics.damaged} damaged replies, "
          f"{statistics.damaged_requests} damaged requests")
    assert told >= share
    assert missing <= 3
    assert (master.heard.lost, master.heard.notes) == ([], [])
