# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Sessions with ultrasonic sensors that misbehave."""

from __future__ import annotations

from functools import partial
from random import Random

from bench.fuzz.play import SCRIPTS, Act, Play, linked
from bench.fuzz.pretended import PretendedClock, PretendedPort, PretendedRecorder, pretended_time
from bench.fuzz.script import Kind, Script
from bench.fuzz.target import Target
from driver_common.clocks import SECOND
from uc4000_driver import line as uc4000_line
from uc4000_driver.commands import Outcome
from uc4000_driver.listener import Listener as Uc4000Listener
from uc4000_driver.sensor import Measurement, Sensor
from uc4000_driver.sensor import Options as Uc4000Options
from uc4000_driver.session import Uc4000Bus
from uc4000_driver.simulator.line import SimulatedSensors
from uc4000_driver.simulator.sensor import SimulatedSensor
from uc4000_driver.telegram import ErrorCode, Reply

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


def _still(distance: float, now: float) -> float:
    return distance


def _check_sensors(data: bytes, random: Random) -> None:
    addresses = random.choice(((7,), (1,), (1, 2)))
    sensors = [SimulatedSensor(address) for address in addresses]
    truth = {sensor.address: round(0.8 + 0.32 * sensor.address, 3) for sensor in sensors}
    for sensor in sensors:
        sensor.scene = partial(_still, truth[sensor.address])
    script = Script(data[1:], random)
    with pretended_time() as clock:
        def reset() -> None:
            random.choice(sensors).power_cycle(clock.now / SECOND)

        recorder = PretendedRecorder(clock)
        link = PretendedPort(recorder, SimulatedSensors(sensors), lambda reply: script.answer(
            reply, lambda _: bytes.fromhex("A8 00 00 43"), _refused_by_sensor, reset))
        heard = _HeardSensors(clock)
        with linked(uc4000_line, "serial", link, recorder):
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


TARGETS = (Target("uc4000 session", _check_sensors, SCRIPTS),)
