# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Replays: the same bytes give the same, for each driver; and what else they may meet."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import NamedTuple

import pytest
from operations import calls

from driver_common import clocks, device_bus, flight_recorder
from driver_common.device_thread import DeviceThread
from driver_common.errors import LinkError, SettingError
from driver_common.flight_recorder import (
    EXTENDED,
    Entry,
    Frame,
    Kind,
    pack_frame,
    pack_offset,
    unpack,
)
from driver_common.recording import CAN, SERIAL, RecordingText
from driver_common.replayed_can import can_recorder, open_can
from driver_common.replayed_serial import open_serial, serial_recorder
from icotronic_driver import listener as icotronic_listener
from icotronic_driver import session as icotronic
from icotronic_driver.line import Line as IcotronicLine
from icotronic_driver.sensor import Options as IcotronicOptions
from icotronic_driver.simulator.line import simulated_network
from isys_radar_driver import listener as isys_listener
from isys_radar_driver import session as isys
from isys_radar_driver.radar import Options as RadarOptions
from isys_radar_driver.simulator.line import simulated_line as simulated_radars
from uc4000_driver import listener as uc4000_listener
from uc4000_driver import session as uc4000
from uc4000_driver.sensor import Options as Uc4000Options
from uc4000_driver.simulator.line import simulated_line as simulated_sensors

DEADLINE = 30.0  # s; far more than anything takes, also on a busy machine


class Heard(device_bus.Listener):
    """Remembers what a bus tells, until there is enough or an error."""

    def __init__(self, enough):
        self.told = []
        self.error = None
        self.recorder = None
        self.differs = ""  # what a replay did else, until there was enough
        self.done = threading.Event()
        self._enough = enough

    def tell(self, *what):
        self.told.append(what)
        if len(self.told) == self._enough:
            self.differs = getattr(self.recorder, "differs", "")
            self.done.set()

    def on_found(self, device):
        self.tell("found", str(device), dict(device.values))

    def on_lost(self, device, error):
        self.tell("lost", str(device), str(error))

    def on_state(self, error):
        if error is not None:
            self.error = str(error)
            self.done.set()


class HeardRadars(Heard, isys_listener.Listener):
    def on_target_list(self, radar, targets, stamp):
        self.tell("targets", targets, stamp)

    def on_range_list(self, radar, values, targets, stamp):
        self.tell("range", values, stamp)


class HeardUltrasonic(Heard, uc4000_listener.Listener):
    def on_measurement(self, sensor, measurement):
        self.tell("measurement", str(sensor), measurement)

    def on_temperature(self, sensor, celsius, stamp):
        self.tell("temperature", celsius, stamp)


class HeardIcotronic(Heard, icotronic_listener.Listener):
    bus = None

    def on_stream(self, sensor):
        def take(stamp, period, values):
            self.tell("samples", stamp, period, values)

        return take

    def on_readings(self, sensor, name):
        self.tell("reading", name, getattr(sensor.readings, name), self.bus.line.arrival_time)


class Driver(NamedTuple):
    """How to make a driver's bus on a simulator or a recording, and how much it shall tell."""

    link: str
    simulate: Callable
    make_bus: Callable
    heard: type[Heard]
    enough: int


def make_icotronic(port, heard):
    line = (IcotronicLine("replay", port.removeprefix("replay://"), 1_000_000, [])
            if port.startswith("replay://") else
            IcotronicLine("socketcand", "can0", 1_000_000, port.split()))
    heard.bus = icotronic.IcotronicBus(line, IcotronicOptions(status_period=2.0), heard)
    return heard.bus


class Network:
    """A simulated network, started as the serial ones are."""

    def __init__(self):
        self._bus = simulated_network().start()
        self.port = f"host={self._bus.host} port={self._bus.port}"
        self.close = self._bus.close


def radar(model, baud_rate=115200):
    return Driver(
        SERIAL, lambda: simulated_radars([model])[0].start(),
        lambda port, heard: isys.RadarBus(port, baud_rate, [RadarOptions()], heard),
        HeardRadars, 40)


def ultrasonic(*names, **more):
    return Driver(
        SERIAL, lambda: simulated_sensors(range(1, 1 + len(names)))[0].start(),
        lambda port, heard: uc4000.Uc4000Bus(port, [
            Uc4000Options(name=name, address=number, temperature_period=1.0)
            for number, name in enumerate(names, 1)], heard, **more), HeardUltrasonic, 60)


DRIVERS = {
    "radar": radar("iSYS-4001"),
    "radar, searched at several baud rates": radar("iSYS-6203", 0),
    "ultrasonic": ultrasonic("one"),
    "ultrasonic, in a group": ultrasonic("left", "right", groups=["left right"]),
    "icotronic": Driver(CAN, Network, make_icotronic, HeardIcotronic, 6000),
}


def play(driver, port, rate=1.0):
    """Run a driver until there is enough; return what it told, and its bus."""
    heard = driver.heard(driver.enough)
    bus = driver.make_bus(port, heard)
    heard.recorder = bus.line.recorder
    if port.startswith("replay://"):
        bus.line.recorder.clock.rate = rate
    thread = DeviceThread("bus", bus, heard.on_state)
    thread.post(lambda: bus.set_active(True))
    thread.start()
    try:
        assert heard.done.wait(DEADLINE), heard.told[-3:]
    finally:
        thread.stop()
    return heard, bus


def write(path, link, recorder):
    text = RecordingText(link, "can0", recorder.offset)
    parts, _ = recorder.snapshot()
    path.write_text("".join([
        *text.head({"interface": "socketcand"}, {}), *text.body(unpack(parts)), *text.end()]))
    return f"replay://{path}"


@pytest.mark.parametrize("name", DRIVERS)
def test_the_same_bytes_give_the_same(tmp_path, name):
    driver = DRIVERS[name]
    simulator = driver.simulate()
    heard, bus = play(driver, simulator.port)
    simulator.close()
    assert not heard.error
    url = write(tmp_path / "recording.log", driver.link, bus.line.recorder)
    again, _ = play(driver, url, rate=0.0)
    assert again.told[:driver.enough] == heard.told[:driver.enough]
    assert not again.differs


# --- a replay that is asked for something else -------------------------------------------------

SECOND = 10 ** 9
ONE, TWO, OTHER = b"\x01", b"\x02", b"\x03"
A, B = b"\xA0", b"\xB0"


def at(seconds, kind, content=b""):
    return Entry(round(seconds * SECOND), kind, content)


def exchange(seconds, request, reply):
    return [at(seconds, Kind.SENT, request), at(seconds + 0.01, Kind.RECEIVED, reply)]


@pytest.fixture
def serial(tmp_path):
    """Open a recording of a serial port, as fast as can be."""
    opened = []

    def open_entries(*entries):
        text = RecordingText(SERIAL, "", 0)
        path = tmp_path / "recording.log"
        path.write_text("".join([*text.head({}, {}), *text.body(entries), *text.end()]))
        recorder = serial_recorder(f"replay://{path}")
        recorder.clock.rate = 0.0
        opened.append(open_serial("replay", 115200, recorder))
        return opened[-1], recorder

    yield open_entries
    for link in opened:
        link.close()


def ask(link, request):
    link.write(request)
    return link.read(0.1)


def test_what_is_read_is_what_was_read_at_that_time(serial):
    link, _ = serial(at(1, Kind.OFFSET, pack_offset(7)), at(1, Kind.OPENED),
                     at(2, Kind.NOTHING), *exchange(3, ONE, A),
                     at(3.5, Kind.OFFSET, pack_offset(8)), *exchange(4, TWO, B))
    assert link.read(0) == b""
    assert link.time == 2 * SECOND + 7
    link.write(ONE)
    assert link.time == 3 * SECOND + 7
    assert link.read(0.1) == A
    assert link.time == 3.01 * SECOND + 7
    assert ask(link, TWO) == B
    assert link.time == 4.01 * SECOND + 8
    assert clocks.time_ns() >= link.time


def test_the_end_is_told_again_and_again(serial):
    link, recorder = serial(at(1, Kind.OPENED), *exchange(2, ONE, A))
    ask(link, ONE)
    for again in (lambda: link.read(1), lambda: open_serial("replay", 9600, recorder)):
        with pytest.raises(LinkError, match=r"^the recording .*recording.log has ended$"):
            again()


def test_a_link_that_was_lost_is_lost_again_and_comes_back(serial):
    link, recorder = serial(at(1, Kind.OPENED), at(2, Kind.SENT, ONE), at(2, Kind.LOST, b"lost it"),
                            at(9, Kind.OPENED), *exchange(10, ONE, A))
    with pytest.raises(LinkError, match=r"^lost it$"):
        ask(link, ONE)
    link.close()
    assert ask(open_serial("replay", 9600, recorder), ONE) == A


def test_a_request_that_was_not_made_then_gets_the_answer_of_another_time(serial):
    link, recorder = serial(at(1, Kind.OPENED), *exchange(2, ONE, A), *exchange(30, TWO, B),
                            *exchange(31, ONE, A))
    assert ask(link, ONE) == A
    assert not recorder.differs
    assert ask(link, TWO) == B
    assert recorder.differs == "02"


def test_what_was_measured_at_another_time_is_no_answer(serial):
    link, recorder = serial(at(1, Kind.OPENED), *exchange(2, ONE, A), *exchange(30, TWO, A),
                            *exchange(31, TWO, B))
    assert ask(link, ONE) == A
    assert ask(link, TWO) == b""
    assert recorder.differs == "02"


def test_a_request_that_was_never_made_gets_no_answer(serial):
    link, recorder = serial(at(1, Kind.OPENED), *exchange(2, ONE, A), *exchange(3, TWO, B))
    assert ask(link, OTHER) == b""
    assert recorder.differs == "03"
    assert ask(link, ONE) == A  # and all goes on
    assert ask(link, TWO) == B


def test_requests_of_another_time_cost_the_same_in_a_long_recording(serial):
    def cost(count):
        link, _ = serial(at(1, Kind.OPENED), *[
            entry for second in range(count) for entry in exchange(1000 + second, ONE, A)])
        return calls(lambda: [ask(link, ONE) for _ in range(count)])

    assert cost(400) < 2.5 * cost(200)


def test_nothing_comes_for_a_request_that_is_not_made(serial):
    link, _ = serial(at(1, Kind.OPENED), *exchange(2, ONE, A), *exchange(7, TWO, B))
    assert [link.read(0.5) for _ in range(10)] == 10 * [b""]
    assert ask(link, TWO) == B


def test_what_was_forgotten_takes_no_time(serial):
    link, _ = serial(at(1, Kind.OPENED), *exchange(2, ONE, A), at(9000, Kind.GAP),
                     *exchange(9000, TWO, B))
    assert ask(link, ONE) == A
    assert ask(link, TWO) == B
    assert link.time == 9000.01 * SECOND


def test_time_passes_at_the_rate_that_is_asked_for(serial, monkeypatch):
    link, recorder = serial(at(1, Kind.OPENED), at(11, Kind.NOTHING), *exchange(11, ONE, A))

    class Host:
        now = 5.0

        @classmethod
        def monotonic(cls):
            return cls.now

        @classmethod
        def sleep(cls, seconds):
            cls.now += seconds

    monkeypatch.setattr(clocks, "time", Host)
    recorder.clock.rate = 4.0
    recorder.clock.jump(0)
    assert link.read(10.0) == b""
    assert Host.now == pytest.approx(5.0 + 10.0 / 4.0)
    assert ask(link, ONE) == A
    assert Host.now == pytest.approx(5.0 + 10.01 / 4.0)


def frame(seconds, kind, identifier, data=b""):
    return at(seconds, kind, pack_frame(Frame(0.0, identifier | EXTENDED, data)))


@pytest.fixture
def bus(tmp_path):
    """Open a recording of a CAN bus, as fast as can be."""
    opened = []

    def open_entries(*entries):
        text = RecordingText(CAN, "can0", 0)
        path = tmp_path / "recording.log"
        path.write_text("".join([*text.head({}, {}), *text.body(entries), *text.end()]))
        recorder = can_recorder("replay", str(path))
        recorder.clock.rate = 0.0
        opened.append(open_can("replay", str(path), 1, [], [], recorder))
        return opened[-1]

    yield open_entries
    for link in opened:
        link.close()


def identifiers(link, count, timeout=1.0):
    received = (link.receive(timeout) for _ in range(count))
    return [message and message.arbitration_id for message in received]


def test_frames_keep_coming_while_requests_are_early_late_or_never(bus):
    stream = [frame(2 + 0.1 * number, Kind.RECEIVED, number) for number in range(40)]
    link = bus(at(1, Kind.OPENED), *stream[:10], frame(2.95, Kind.SENT, 99),
               frame(2.96, Kind.RECEIVED, 100), *stream[10:])
    link.send(99, b"")  # early
    link.send(77, b"")  # never
    assert identifiers(link, 12) == [*range(10), 100, 10]
    assert link.arrived == 3 * SECOND
    assert identifiers(link, 3) == [11, 12, 13]


def test_frames_wait_a_little_for_a_request_that_is_late(bus):
    link = bus(at(1, Kind.OPENED), frame(2, Kind.SENT, 99), frame(2.01, Kind.RECEIVED, 100),
               frame(2.02, Kind.RECEIVED, 1))
    assert identifiers(link, 1, timeout=1.05) == [None]
    link.send(99, b"")
    assert identifiers(link, 2) == [100, 1]


def test_frames_do_not_wait_for_a_request_that_is_not_made(bus):
    link = bus(at(1, Kind.OPENED), frame(2, Kind.SENT, 99), frame(2.01, Kind.RECEIVED, 100),
               frame(2.02, Kind.RECEIVED, 1))
    received = []
    while 1 not in received:
        received += identifiers(link, 1, timeout=0.1)
    assert received[-2:] == [100, 1]


@pytest.mark.parametrize(("link", "recorder"), [
    (CAN, lambda path: serial_recorder(f"replay://{path}")),
    (SERIAL, lambda path: can_recorder("replay", str(path)))])
def test_a_recording_of_another_link_is_refused(tmp_path, link, recorder):
    path = tmp_path / "recording.log"
    path.write_text(f"# industrial_sensor_drivers recording, format 1, {link}\n# end 0\n")
    with pytest.raises(SettingError, match=f"^cannot replay {path}: it is of a {link} link, not"):
        recorder(path)


def test_what_came_after_a_gap_is_the_same(tmp_path, monkeypatch):
    monkeypatch.setattr(flight_recorder, "DURATION", 0.5)
    monkeypatch.setattr(flight_recorder, "START_TIME", 0.1)
    monkeypatch.setattr(flight_recorder, "CHUNK_TIME", 0.1)

    class Found(HeardUltrasonic):
        def on_found(self, device):
            super().on_found(device)
            self.recorder.keep_search()

    driver = DRIVERS["ultrasonic"]._replace(heard=Found, enough=60)
    simulator = driver.simulate()
    heard, bus = play(driver, simulator.port)
    simulator.close()
    recorder = bus.line.recorder
    parts, _ = recorder.snapshot()
    assert any(entry.kind is Kind.GAP for entry in unpack(parts))
    url = write(tmp_path / "recording.log", driver.link, recorder)
    again, _ = play(driver._replace(enough=10**9), url, rate=0.0)
    assert again.error.endswith("has ended")
    assert len(again.told) > 5
    # The last one may have been on its way when the recorded one had heard enough. A temperature
    # that was read in the gap is missing then, and read behind it.
    others = [told[0] for told in again.told[:-1] if told not in heard.told]
    assert others in ([], ["temperature"])
