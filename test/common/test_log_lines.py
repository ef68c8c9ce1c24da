# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.
"""A minute of any trouble is a few lines in the log; for radars see test_isys_bad_line.py."""

import itertools
from random import Random

import pytest

from bench.fuzz.play import linked
from bench.fuzz.pretended import PretendedCan, PretendedPort, PretendedRecorder, pretended_time
from driver_common.clocks import SECOND, sleep
from driver_common.errors import DriverError
from icotronic_driver import line as icotronic_line
from icotronic_driver.listener import Listener as IcotronicListener
from icotronic_driver.sensor import Options as IcotronicOptions
from icotronic_driver.session import IcotronicBus
from icotronic_driver.simulator.line import SimulatedNetwork
from icotronic_driver.simulator.sth import FIRST_MAC, SimulatedSth
from uc4000_driver import line as uc4000_line
from uc4000_driver.listener import Listener as Uc4000Listener
from uc4000_driver.sensor import Options as Uc4000Options
from uc4000_driver.session import Uc4000Bus
from uc4000_driver.simulator.line import SimulatedSensors
from uc4000_driver.simulator.sensor import SimulatedSensor
from uc4000_driver.telegram import ErrorCode

MINUTE = 60.0  # s
MOST_LINES = 12


class Log:
    """A listener that keeps what a node would log."""

    def __init__(self):
        self.lines = []

    def on_found(self, device):
        self.lines.append("found")

    def on_lost(self, device, error):
        self.lines.append(str(error))

    def on_note(self, device, text, *, warning=False):
        self.lines.append(text)


class Uc4000Log(Log, Uc4000Listener):
    pass


class IcotronicLog(Log, IcotronicListener):
    def on_stream(self, sensor):
        return lambda *_: None


def a_minute_of(bus, clock, trouble):
    """Poll a bus, as its thread would, until it measures and then for a minute of trouble."""
    bus.set_active(True)
    error, begin = None, clock.now
    bus.open()
    while (second := (clock.now - begin) / SECOND - 10.0) < MINUTE:
        if second > 0.0:
            trouble(second)
        try:
            pause = bus.poll()
        except DriverError as now:
            if str(now) != str(error):
                yield str(now)
            error, pause = now, 0.1
            bus.close()
            bus.open()
        sleep(min(pause, 1.0))
    bus.close()


def hurt(random, data, share):
    """Return data of which bytes are changed or missing."""
    return bytes(byte ^ random.randrange(256) if random.random() < share else byte
                 for byte in data if random.random() > share / 2)


UC4000_TROUBLES = {
    "nothing answers": lambda one, second: setattr(one, "silent", True),
    "it goes and comes": lambda one, second: setattr(one, "silent", second % 20 > 9),
    "it refuses everything": lambda one, second: one.refuse.update(
        dict.fromkeys(range(256), ErrorCode.EEPROM_ERROR)),
    "it refuses now and then": lambda one, second: setattr(
        one, "refuse", dict.fromkeys(range(256), ErrorCode.EEPROM_ERROR) if second % 2 > 1 else {}),
    "a bad line": lambda one, second: setattr(one, "hurt", 0.01),
    "a line that hardly works": lambda one, second: setattr(one, "hurt", 0.1),
    "much noise": lambda one, second: setattr(one, "hurt", 0.5),
}


@pytest.mark.parametrize("several", [False, True], ids=["alone", "two"])
@pytest.mark.parametrize("trouble", UC4000_TROUBLES)
def test_of_an_ultrasonic_sensor(trouble, several):
    sensors = [SimulatedSensor(address) for address in (1, 2)[:1 + several]]
    sensors[0].hurt = 0.0
    random = Random(7)
    with pretended_time() as clock:
        recorder = PretendedRecorder(clock)
        link = PretendedPort(recorder, SimulatedSensors(sensors),
                             lambda reply: [(0.0, hurt(random, reply, sensors[0].hurt))])
        with linked(uc4000_line, "serial", link, recorder):
            log = Uc4000Log()
            bus = Uc4000Bus("pretended", [Uc4000Options(f"s{one.address}", address=one.address)
                                          for one in sensors], log)
            errors = list(a_minute_of(
                bus, clock, lambda second: UC4000_TROUBLES[trouble](sensors[0], second)))
    lines = [*log.lines[len(sensors):], *errors]
    assert log.lines[:len(sensors)] == ["found"] * len(sensors)
    assert len(lines) <= MOST_LINES, lines


EVERY_COMMAND = set(itertools.product(range(64), range(256)))
ICOTRONIC_TROUBLES = {
    "nothing answers": lambda network, second: setattr(network.faults, "silent", True),
    "it goes and comes": lambda network, second: setattr(
        network.faults, "silent", second % 20 > 9),
    "it refuses everything": lambda network, second: setattr(
        network.sensors[0], "refuse", EVERY_COMMAND),
    "it stays silent on everything": lambda network, second: setattr(
        network.sensors[0], "ignore", EVERY_COMMAND),
    "a sensor out of reach": lambda network, second: [
        setattr(network.faults, "loss", 1.0), setattr(network.faults, "answer_loss", 1.0)],
    "a sensor nearly out of reach": lambda network, second: [
        setattr(network.faults, "loss", 0.5), setattr(network.faults, "answer_loss", 0.5)],
    "error frames": lambda network, second: setattr(network.faults, "errors", 100.0),
    "damaged counters": lambda network, second: setattr(network.faults, "damage", 0.3),
    "it restarts again and again": lambda network, second: (
        second % 20 < 0.1 and network.power_loss(network.sensors[0], network.now)),
    "the stationary unit restarts again and again": lambda network, second: (
        second % 10 < 0.1 and network.power_loss(network.stu, network.now)),
}


@pytest.mark.parametrize("trouble", ICOTRONIC_TROUBLES)
def test_of_an_accelerometer(trouble):
    sensor = SimulatedSth("Test-STH", FIRST_MAC)
    network, log = SimulatedNetwork([sensor]), IcotronicLog()
    network.faults.random = Random(7)
    with pretended_time() as clock:
        for node in (network.stu, sensor):
            node.boot(clock.now / SECOND - 10.0)
        recorder = PretendedRecorder(clock)
        link = PretendedCan(recorder, network, lambda frame: [(0.0, frame)])

        def make_trouble(second):
            network.now = clock.now / SECOND
            ICOTRONIC_TROUBLES[trouble](network, second)

        with linked(icotronic_line, "can", link, recorder):
            bus = IcotronicBus(icotronic_line.Line("socketcan", "can0", 1_000_000, ()),
                               IcotronicOptions(sample_rate=150.0), log)
            errors = list(a_minute_of(bus, clock, make_trouble))
    assert "found" in log.lines
    lines = [*log.lines[log.lines.index("found") + 1:], *errors]
    assert len(lines) <= MOST_LINES, lines
