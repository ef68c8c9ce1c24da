# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What is fuzzed of whole sessions: devices that answer as a script says, in pretended time.

Whatever they do, only the drivers' own errors leave `poll`, each step ends in bounded time,
nothing is published that no device measured, and once they behave again they are found again.
"""

from __future__ import annotations

import contextlib
import itertools
import struct
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, replace
from random import Random
from typing import Any, NamedTuple, Protocol
from unittest.mock import patch

from bench.fuzz.pretended import (
    PretendedCan,
    PretendedClock,
    PretendedPort,
    PretendedRecorder,
    pretended_time,
)
from bench.fuzz.script import KINDS, Arrival, Kind, Script
from bench.fuzz.target import Target
from driver_common import clocks
from driver_common.clocks import SECOND
from driver_common.errors import DriverError
from driver_common.settings import Value
from driver_common.simulator.bus import EXTENDED_ID, CanFrame
from icotronic_driver import line as icotronic_line
from icotronic_driver import sensor as icotronic_sensor
from icotronic_driver.identifier import Identifier
from icotronic_driver.line import STREAM_ID
from icotronic_driver.listener import Listener as IcotronicListener
from icotronic_driver.session import IcotronicBus
from icotronic_driver.simulator.line import SimulatedNetwork
from icotronic_driver.simulator.sth import FIRST_MAC, SimulatedSth
from isys_radar_driver import line as isys_line
from isys_radar_driver.frames import (
    FAILURE,
    LAST_ADDRESS,
    MASTER,
    READ_TARGET_LIST,
    Delimiter,
    Frame,
    FrameParser,
)
from isys_radar_driver.listener import Listener as RadarListener
from isys_radar_driver.models import MODELS, Model
from isys_radar_driver.radar import Options as RadarOptions
from isys_radar_driver.radar import Radar
from isys_radar_driver.session import RadarBus
from isys_radar_driver.settings import settings_of
from isys_radar_driver.simulator.line import SimulatedRadars
from isys_radar_driver.simulator.radar import SimulatedRadar
from isys_radar_driver.targets import Target as RadarTarget
from isys_radar_driver.targets import TargetList, decode_target_list
from uc4000_driver import line as uc4000_line
from uc4000_driver.commands import Outcome
from uc4000_driver.listener import Listener as Uc4000Listener
from uc4000_driver.sensor import Measurement, Sensor
from uc4000_driver.sensor import Options as Uc4000Options
from uc4000_driver.session import Uc4000Bus
from uc4000_driver.simulator.line import SimulatedSensors
from uc4000_driver.simulator.sensor import SimulatedSensor
from uc4000_driver.telegram import ErrorCode, Reply

PLAY_TIME = 20.0  # s for a script, at most
RECOVERY_TIME = 120.0  # s until all is well again behind it
LONGEST_STEP = 60.0  # s
OFTEN = 0.05  # of the steps after which a user writes something
ENOUGH = 3  # measurements that tell that all is well


class _Bus(Protocol):
    """What is played with: a `DeviceBus` that ends."""

    devices: list[Any]

    def open(self) -> None: ...
    def poll(self) -> float: ...
    def write(self, device: Any, changes: Mapping[str, Value]) -> object: ...
    def close(self) -> None: ...


class Act(NamedTuple):
    """What is played.

    Attributes:
        late: Whether the script begins when measurements come, and not at the first answer.
        changes: Settings that a user writes meanwhile.
        value: Returns the value of a setting that the simulated device behind a device has.
        uncertain: Kinds after which the driver may hold other values than the device.
    """

    late: bool
    changes: Mapping[str, Value]
    value: Callable[[Any, str], Value]
    uncertain: Collection[Kind]


class Play:
    """A bus that is polled as its thread would do it."""

    def __init__(self, bus: _Bus, clock: PretendedClock) -> None:
        """Open a bus."""
        self._bus, self._clock = bus, clock
        bus.open()

    def act(self, act: Act, script: Script, heard: list[Any], random: Random) -> None:
        """Have the devices do what the script says, and assert that all is well again then."""
        devices = self._bus.devices
        if act.late:
            self.until(lambda: len(heard) >= ENOUGH, PLAY_TIME)
        end = self._clock.now + PLAY_TIME * SECOND
        while not script.is_over and self._clock.now < end:
            self._step()
            if random.random() < OFTEN:  # a user changes something
                with contextlib.suppress(DriverError):
                    self._bus.write(random.choice(devices), act.changes)
        script.end()
        begin = len(heard)
        well = self.until(lambda: len(heard) >= begin + ENOUGH * len(devices) and all(
            device.is_connected and device.error is None for device in devices), RECOVERY_TIME)
        assert well, [(str(device), device.error) for device in devices]
        if not any(script.done[kind] for kind in act.uncertain):
            for device in devices:
                for name, value in device.values.items():
                    assert value in ("unknown", act.value(device, name)), name
        self._bus.close()

    def until(self, condition: Callable[[], bool], seconds: float) -> bool:
        """Poll until a condition holds; return False where it does not within some s."""
        end = self._clock.now + int(seconds * SECOND)
        while not condition():
            if self._clock.now > end:
                return False
            self._step()
        return True

    def _step(self) -> None:
        before, pause = self._clock.now, 0.1
        try:
            pause = self._bus.poll()
        except DriverError:
            self._bus.close()
            self._bus.open()
        assert self._clock.now - before < LONGEST_STEP * SECOND
        clocks.sleep(min(pause, 1.0))


def _in_order(some: Iterable[object], all_: Iterable[object]) -> bool:
    """Whether some things are among all, in their order, and none of them twice."""
    rest = iter(all_)
    return all(one in rest for one in some)


# --- radars ---

CHANGES: Mapping[str, Sequence[Value]] = {
    "frequency_channel": (1, 2), "threshold_minimum_db": (11.0, 12.5),
    "output1.velocity_max": (11.0, 9.0), "output1.range_max": (8.0, 9.0),
    "output1.direction": ("both", "approaching"), "output1.filter_type": ("mean", "min")}

class _HeardRadars(RadarListener):
    def __init__(self, clock: PretendedClock) -> None:
        self.lists: list[tuple[int, TargetList]] = []
        self._clock = clock

    def on_target_list(self, radar: Radar, targets: TargetList, stamp: int) -> None:
        assert 0 < stamp <= self._clock.now + self._clock.offset
        self.lists.append((radar.address, targets))


def _lists_of(radar: SimulatedRadar) -> list[TargetList]:
    """Let a radar note the target lists that it sends, and return the list of them."""
    lists, reply = [], radar.reply

    def noting(request: Frame, now: float) -> tuple[float, Frame] | None:
        answer = reply(request, now)
        if answer is not None and answer[1].function_code == READ_TARGET_LIST:
            lists.append(decode_target_list(answer[1], radar.model.range_step_16))
        return answer

    radar.reply = noting  # type: ignore[method-assign]
    return lists


def _moving() -> Callable[[float], list[RadarTarget]]:
    """Return a scene whose target is elsewhere whenever it is looked at."""
    steps = itertools.cycle([*range(100), *range(100, 0, -1)])
    return lambda now: [RadarTarget(30.0, 1.0, 4.0 + 0.01 * next(steps), 0.1)]


def _other_radar(reply: bytes) -> bytes:
    frame = next(FrameParser().feed(reply), None) or next(FrameParser(0).feed(reply))
    other = LAST_ADDRESS - 1 if frame.source == LAST_ADDRESS else LAST_ADDRESS
    return Frame(frame.destination, other, frame.function_code, frame.pdu,
                 frame.delimiter).encode()


def _radar_refusal(reply: bytes) -> bytes:
    source = reply[2] if reply[0] == Delimiter.SD3 else reply[5]
    return Frame(MASTER, source, FAILURE).encode()


def _changes(model: Model, random: Random) -> dict[str, Value]:
    """Return a change of one of the settings of a model."""
    settings = settings_of(model)
    name = random.choice(sorted(settings.keys() & CHANGES.keys()))
    return {name: random.choice(CHANGES[name])}


def _check_radars(data: bytes, random: Random) -> None:
    model = random.choice([model for model in MODELS.values() if model.has_target_lists])
    addresses = random.choice(((0,), (10,), (10, 11)))
    radars = [SimulatedRadar(model, address) for address in addresses]
    for radar in radars:
        radar.scene = _moving()
        radar.strict, radar.self_starting, radar.bare = (random.random() < 0.3 for _ in "123")
    measured = {radar.address: _lists_of(radar) for radar in radars}
    script = Script(data[1:], random)
    with pretended_time() as clock:
        def reset() -> None:
            random.choice(radars).power_cycle(clock.now / SECOND)

        recorder = PretendedRecorder(clock)
        link = PretendedPort(recorder, SimulatedRadars(radars), lambda reply: script.answer(
            reply, _other_radar, _radar_refusal, reset))
        heard = _HeardRadars(clock)
        with patch.object(isys_line, "open_serial", lambda *_: link), patch.object(
                isys_line, "serial_recorder", lambda _: recorder):
            bus = RadarBus("pretended", model.baud_rate, [
                RadarOptions(f"r{address}", address=address,
                             read_range_list=random.random() < 0.3,
                             read_digital_outputs=random.random() < 0.3)
                for address in addresses], heard)
            bus.active = True
            by_address = {radar.address: radar for radar in radars}
            Play(bus, clock).act(
                Act(data[:1] > b"\x7f", _changes(model, random),
                    lambda radar, name: by_address[radar.address].value(name),
                    (Kind.TWICE, Kind.RESET)), script, heard.lists, random)
    for radar in radars:
        told = [targets for address, targets in heard.lists if address == radar.address]
        if script.done[Kind.TWICE]:
            assert all(targets in measured[radar.address] for targets in told)
        else:
            assert _in_order(told, measured[radar.address])


# --- ultrasonic sensors ---

# CHECK has six bits only, and no reply says what it answers.
UNCERTAIN = (Kind.GARBAGE, Kind.NOISE, Kind.CUT, Kind.FOREIGN, Kind.TWICE)


class _HeardSensors(Uc4000Listener):
    def __init__(self, clock: PretendedClock) -> None:
        self.measurements: list[tuple[int, Measurement]] = []
        self._clock = clock

    def on_measurement(self, sensor: Sensor, measurement: Measurement) -> None:
        assert 0 < measurement.stamp <= self._clock.now + self._clock.offset
        self.measurements.append((sensor.address, measurement))


def _refused_by_sensor(reply: bytes) -> bytes:
    return Reply(bytes((ErrorCode.EEPROM_ERROR,)), acknowledged=False).encode()


def _check_sensors(data: bytes, random: Random) -> None:
    addresses = random.choice(((7,), (1,), (1, 2)))
    sensors = [SimulatedSensor(address) for address in addresses]
    truth = {sensor.address: round(0.8 + 0.32 * sensor.address, 3) for sensor in sensors}
    for sensor in sensors:
        sensor.scene = {sensor.address: lambda now, there=truth[sensor.address]: there}[
            sensor.address]
    script = Script(data[1:], random)
    with pretended_time() as clock:
        def reset() -> None:
            random.choice(sensors).power_cycle(clock.now / SECOND)

        recorder = PretendedRecorder(clock)
        link = PretendedPort(recorder, SimulatedSensors(sensors), lambda reply: script.answer(
            reply, lambda _: bytes.fromhex("A8 00 00 43"), _refused_by_sensor, reset))
        heard = _HeardSensors(clock)
        with patch.object(uc4000_line, "open_serial", lambda *_: link), patch.object(
                uc4000_line, "serial_recorder", lambda _: recorder):
            bus = Uc4000Bus("pretended", [
                Uc4000Options(f"s{address}", address=address) for address in addresses], heard)
            bus.active = True
            by_address = {sensor.address: sensor for sensor in sensors}
            Play(bus, clock).act(
                Act(data[:1] > b"\x7f", {"gain_db": random.choice((70.0, 72.0))},
                    lambda sensor, name: by_address[sensor.address].value(name), UNCERTAIN),
                script, heard.measurements, random)
    if not any(script.done[kind] for kind in UNCERTAIN):
        for address, measurement in heard.measurements:
            assert measurement.distance.outcome is Outcome.ECHO
            assert measurement.distance.value == truth[address], truth


# --- ICOtronic ---

CHANNELS = ("x", "xyz", "yz")


class _HeardStream(IcotronicListener):
    def __init__(self, clock: PretendedClock) -> None:
        self.values: list[tuple[int, ...]] = []
        self._clock = clock

    def on_stream(self, sensor: icotronic_sensor.Sensor) -> Callable[
            [int, float, tuple[int, ...]], None]:
        def take(stamp: int, period: float, values: tuple[int, ...]) -> None:
            assert 0 < stamp <= self._clock.now + self._clock.offset
            assert period > 0
            self.values.append(values)

        return take


class _Frames:
    """What becomes of the frames of a network.

    Attributes:
        streamed: What was behind the counter of the frames of the stream that were sent.
    """

    def __init__(self, script: Script, reset: Callable[[], None]) -> None:
        self.streamed: set[bytes] = set()
        self._script, self._reset = script, reset

    def arrivals(self, frame: CanFrame) -> list[Arrival[CanFrame]]:
        """Return what arrives in the place of a frame; the script is of all but the stream."""
        if frame.can_id == STREAM_ID:
            self.streamed.add(frame.data[2:])
            return [Arrival(0.0, frame)]
        if frame.error or not frame.extended:
            return [Arrival(0.0, frame)]
        return [Arrival(later, CanFrame(int.from_bytes(what[:4], "big") & EXTENDED_ID, what[4:12]))
                for later, what in self._script.answer(
                    frame.can_id.to_bytes(4, "big") + frame.data, _other_node, _refused_by_node,
                    self._reset)]


def _other_node(answer: bytes) -> bytes:
    number = int.from_bytes(answer[:4], "big") ^ 2 << 6  # of the sender
    return number.to_bytes(4, "big") + answer[4:]


def _refused_by_node(answer: bytes) -> bytes:
    identifier = replace(Identifier.decode(int.from_bytes(answer[:4], "big")), error=True)
    return identifier.encode().to_bytes(4, "big") + bytes.fromhex("02 00 00 00 00 00 00 00")


def _held(sensor: SimulatedSth) -> dict[str, Value]:
    """Return what a simulated sensor has in its RAM."""
    return {"led": "enabled" if sensor.led else "disabled",
            **{f"adc.{name}": value for name, value in asdict(sensor.adc).items()}}


def _check_network(data: bytes, random: Random) -> None:
    sensor = SimulatedSth("Test-STH", FIRST_MAC)
    network, script = SimulatedNetwork([sensor]), Script(data[1:], random)
    network.faults.random = random
    network.faults.loss, network.faults.duplicate, network.faults.swap = (
        random.choice((0.0, 0.0, 0.02)) for _ in "123")
    network.stay_silent(random.choice(("nothing", "unused")))
    with pretended_time() as clock:
        for node in (network.stu, sensor):
            node.boot(clock.now / SECOND - 10.0)
        frames = _Frames(script, lambda: network.power_loss(
            random.choice((network.stu, sensor)), clock.now / SECOND))
        recorder, heard = PretendedRecorder(clock), _HeardStream(clock)
        link = PretendedCan(recorder, network, frames.arrivals)
        with patch.object(icotronic_line, "open_can", lambda *_: link), patch.object(
                icotronic_line, "can_recorder", lambda *_: recorder):
            bus = IcotronicBus(icotronic_line.Line("socketcan", "can0", 1_000_000, ()),
                               icotronic_sensor.Options(channels=random.choice(CHANNELS),
                                                        sample_rate=150.0), heard)
            bus.active = True
            Play(bus, clock).act(
                Act(data[:1] > b"\x7f", {"led": random.choice(("enabled", "disabled"))},
                    lambda device, name: _held(sensor).get(name, device.values[name]),
                    (Kind.RESET, Kind.TWICE)), script, heard.values, random)
    for values in heard.values:
        assert struct.pack(f"<{len(values)}H", *values) in frames.streamed


def _scripts() -> list[bytes]:
    """Return a script for each kind of misbehaviour: from the beginning, and while it measures."""
    scripts = []
    for number, _ in enumerate(KINDS):
        for argument in (0, 20, 255):
            once = bytes((number, argument))
            scripts += [b"\0" + once, b"\0" + 6 * once, b"\0\0\x0a" + once,
                        b"\xff" + once, b"\xff" + 4 * (once + b"\0\5")]
    return scripts


TARGETS = (
    Target("isys session", _check_radars, _scripts()),
    Target("icotronic session", _check_network, _scripts()),
    Target("uc4000 session", _check_sensors, _scripts()),
)
