# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Sessions with an ICOtronic system that misbehaves."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import asdict, replace
from random import Random

from bench.fuzz.play import SCRIPTS, Act, Play, linked
from bench.fuzz.pretended import PretendedCan, PretendedClock, PretendedRecorder, pretended_time
from bench.fuzz.script import Arrival, Kind, Script
from bench.fuzz.target import Target
from driver_common.clocks import SECOND
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
        with linked(icotronic_line, "can", link, recorder):
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


TARGETS = (Target("icotronic session", _check_network, SCRIPTS),)
