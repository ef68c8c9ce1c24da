# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What is fuzzed of recordings: files that are damaged, and replays of what cannot have been."""

from __future__ import annotations

import contextlib
import itertools
import tempfile
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from random import Random
from types import ModuleType
from typing import Any, NamedTuple

from bench.fuzz.play import RECOVERY_TIME, Play, linked
from bench.fuzz.pretended import (
    EPOCH,
    PretendedCan,
    PretendedPort,
    PretendedRecorder,
    pretended_time,
)
from bench.fuzz.target import Target
from driver_common import clocks
from driver_common.errors import DriverError, LinkError, SettingError
from driver_common.flight_recorder import Entry, Kind
from driver_common.recording import CAN, SERIAL, Recording, RecordingText, read_recording
from icotronic_driver import line as icotronic_line
from icotronic_driver.listener import Listener as IcotronicListener
from icotronic_driver.sensor import Options as IcotronicOptions
from icotronic_driver.session import IcotronicBus
from icotronic_driver.simulator.line import SimulatedNetwork
from icotronic_driver.simulator.sth import SimulatedSth
from isys_radar_driver import line as isys_line
from isys_radar_driver.listener import Listener as RadarListener
from isys_radar_driver.models import find_model
from isys_radar_driver.radar import Options as RadarOptions
from isys_radar_driver.session import RadarBus
from isys_radar_driver.simulator.line import SimulatedRadars
from isys_radar_driver.simulator.radar import SimulatedRadar
from uc4000_driver import line as uc4000_line
from uc4000_driver.listener import Listener as Uc4000Listener
from uc4000_driver.sensor import Options as Uc4000Options
from uc4000_driver.session import Uc4000Bus
from uc4000_driver.simulator.line import SimulatedSensors
from uc4000_driver.simulator.sensor import SimulatedSensor

RECORDED = 1.0  # s of a session in which a device was found
MOST_STEPS = 3000  # of a replay; one that goes on has a gap of years in it

# The telegrams are those of the manual of the UC4000, sections 4.5.3 and 5.1.6.3; the frames those
# of section 10.2.3 of the ICOtronic one.
SERIAL_SEED = """\
# industrial_sensor_drivers recording, format 1, serial
# base: 1764097995817640273
# node: /uc4000
# parameter time_offset: -0.01
# (1764098078.123456790) offset 1764097995817640270
# (1764098078.123456791) opened
(1764098079.123456789) > A8 00 00 43
(1764098079.223456789) < 23 D1
# (1764098079.323456789) nothing
# (1764098080.223456789) note found sensor
# (1764098080.323456789) lost it was unplugged
# end 7
"""
CAN_SEED = """\
# industrial_sensor_drivers recording, format 1, can
# base: 1764097995817640273
# interface: socketcan
# (1764098078.123456791) opened
# (1764098078.123456792) clock
(1764098079.123456) can0 000A3D1#00 T
(1764098079.124456) can0 0008044F#25 R
(1764098079.125456) can0 123#R R
# delays 789 1000/512 -17
# (1764098080.123456789) gap
# end 6
"""


@cache
def _directory() -> Path:
    """Return a directory that ends with this process."""
    directory = tempfile.TemporaryDirectory(prefix="fuzz-")
    _held.append(directory)
    return Path(directory.name)


_held: list[object] = []


# --- files ---

def _text(recording: Recording) -> str:
    text = RecordingText(recording.link, "can0", EPOCH)
    return "".join((*text.head(recording.facts, recording.parameters),
                    *text.body(recording.entries), *text.end()))


def _check_files(data: bytes, random: Random) -> None:
    """Read an input as a recording; what is accepted is the same when it is written again."""
    path = _directory() / "input.log"
    path.write_bytes(data)
    with contextlib.suppress(SettingError):
        read_recording(path, head=True)
    with contextlib.suppress(SettingError):
        recording = read_recording(path)
        if all(entry.time + EPOCH >= 0 for entry in recording.entries):
            path.write_text(_text(recording), encoding="utf-8")
            again = read_recording(path)
            kinds = [entry.kind for entry in recording.entries]
            assert [entry.kind for entry in again.entries] == kinds
            assert [entry for entry in again.entries if entry.kind <= Kind.RECEIVED] == [
                entry for entry in recording.entries if entry.kind <= Kind.RECEIVED]


# --- replays ---

class _Driver(NamedTuple):
    """A driver whose session is recorded: its bus on a port, and simulated devices for that."""

    link: str
    lines: ModuleType
    make_link: Callable[[PretendedRecorder], object]
    make_bus: Callable[[Path | None], Any]


def _port(path: Path | None) -> str:
    return "pretended" if path is None else f"replay://{path}"


def _network(recorder: PretendedRecorder) -> PretendedCan:
    sensor = SimulatedSth("Test-STH")
    network = SimulatedNetwork([sensor])
    for node in (network.stu, sensor):
        node.boot(recorder.clock.now * 1e-9 - 10.0)
    return PretendedCan(recorder, network, lambda frame: [(0.0, frame)])


class _Deaf(IcotronicListener):
    def on_stream(self, sensor: object) -> Callable[[int, float, tuple[int, ...]], None]:
        return lambda stamp, period, values: None


def _icotronic_bus(path: Path | None) -> IcotronicBus:
    line = icotronic_line.Line("socketcan" if path is None else "replay", str(path), 1_000_000, ())
    return IcotronicBus(line, IcotronicOptions(sample_rate=150.0), _Deaf())


DRIVERS = (
    _Driver(SERIAL, isys_line,
            lambda recorder: PretendedPort(
                recorder, SimulatedRadars([SimulatedRadar(find_model("iSYS-6003"))]),
                lambda reply: [(0.0, reply)]),
            lambda path: RadarBus(_port(path), 115200, [RadarOptions()], RadarListener())),
    _Driver(SERIAL, uc4000_line,
            lambda recorder: PretendedPort(
                recorder, SimulatedSensors([SimulatedSensor(7)]), lambda reply: [(0.0, reply)]),
            lambda path: Uc4000Bus(_port(path), [Uc4000Options(address=7)], Uc4000Listener())),
    _Driver(CAN, icotronic_line, _network, _icotronic_bus),
)


@cache
def _recorded(number: int) -> Sequence[Entry]:
    """Return what passes in the first seconds of a session of a driver."""
    driver = DRIVERS[number]
    with pretended_time() as clock:
        recorder = PretendedRecorder(clock)
        link = driver.make_link(recorder)
        with linked(driver.lines, driver.link, link, recorder):
            bus = driver.make_bus(None)
            bus.active = True
            play = Play(bus, clock)
            play.until(lambda: bus.devices[0].is_connected, RECOVERY_TIME)
            play.until(lambda: False, RECORDED)
    return recorder.entries


def _drop(entries: list[Entry], place: int, argument: int) -> None:
    del entries[place:place + 1 + argument % 8]


def _double(entries: list[Entry], place: int, argument: int) -> None:
    entries[place:place] = entries[place:place + 1 + argument % 8]


def _swap(entries: list[Entry], place: int, argument: int) -> None:
    other = (place + argument) % len(entries)
    one, two = entries[place], entries[other]
    entries[place], entries[other] = one._replace(time=two.time), two._replace(time=one.time)


def _change(entries: list[Entry], place: int, argument: int) -> None:
    for entry in entries[place:]:
        if entry.kind <= Kind.RECEIVED:
            content = bytearray(entry.content)
            content[-1 - argument % 4 % len(content)] ^= 1 << argument % 8
            entries[entries.index(entry)] = entry._replace(content=bytes(content))
            return


def _delay(entries: list[Entry], place: int, argument: int) -> None:
    entries[place:] = [entry._replace(time=entry.time + argument ** 4 * 1000)
                       for entry in entries[place:]]


def _hasten(entries: list[Entry], place: int, argument: int) -> None:
    entries[place:] = [entry._replace(time=max(0, entry.time - argument * 10_000_000))
                       for entry in entries[place:]]


def _cut(entries: list[Entry], place: int, argument: int) -> None:
    del entries[place:]


def _insert(entries: list[Entry], place: int, argument: int) -> None:
    kinds = (Kind.NOTHING, Kind.OPENED, Kind.LOST, Kind.CLOCK, Kind.GAP, Kind.NOTE)
    entries.insert(place, Entry(entries[place].time, kinds[argument % len(kinds)]))


EDITS = (_drop, _double, _swap, _change, _delay, _hasten, _cut, _insert)


def _check_replays(data: bytes, random: Random) -> None:
    """Replay a session that an input has edited: four bytes for what, where (two) and how much."""
    number = (data[0] if data else 0) % len(DRIVERS)
    driver, entries = DRIVERS[number], [*_recorded(number)]
    for start in range(1, len(data) - 3, 4):
        if entries:
            place = int.from_bytes(data[start + 1:start + 3], "big") % len(entries)
            EDITS[data[start] % len(EDITS)](entries, place, data[start + 3])
    path = _directory() / "edited.log"
    path.write_text(_text(Recording(driver.link, {"interface": "socketcan"}, {}, entries)),
                    encoding="utf-8")
    assert read_recording(path).entries == entries
    if entries:
        _replay(driver.make_bus(path), edited=len(data) > 4)


def _replay(bus: Any, *, edited: bool) -> None:
    bus.line.recorder.clock.rate = 0.0
    bus.active = True
    try:
        for _ in range(MOST_STEPS):
            try:
                bus.open()
                while True:
                    clocks.sleep(min(bus.poll(), 1.0))
            except LinkError as error:
                if "has ended" in str(error):
                    break
            except DriverError:
                pass
            bus.close()
        assert edited or bus.devices[0].connections == 1
    finally:
        bus.close()
        clocks.use(None)


TARGETS = (
    Target("recordings", _check_files, [SERIAL_SEED.encode(), CAN_SEED.encode()], longest=2000),
    Target("replays", _check_replays, [
        bytes((number, *(edit, place, 0, argument) * times))
        for number, edit, (place, argument), times in itertools.product(
            range(len(DRIVERS)), range(len(EDITS)), ((0, 1), (1, 20), (2, 255)), (0, 1))]),
)
