# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Sessions with radars that misbehave."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from random import Random

from bench.fuzz.play import SCRIPTS, Act, Play, in_order, linked
from bench.fuzz.pretended import PretendedClock, PretendedPort, PretendedRecorder, pretended_time
from bench.fuzz.script import Kind, Script
from bench.fuzz.target import Target
from driver_common.clocks import SECOND
from driver_common.settings import Value
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
        with linked(isys_line, "serial", link, recorder):
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
            assert in_order(told, measured[radar.address])


TARGETS = (Target("isys session", _check_radars, SCRIPTS),)
