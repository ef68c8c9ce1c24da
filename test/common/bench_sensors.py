# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Simulated sensors for the tests of the command `sensors`, and the command.

`Bench` has them on real transports. `VirtualLink` has them on a serial port in a time of its own,
for what is about time-outs: so a busy machine makes no difference, and no test waits.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
from dataclasses import dataclass
from types import SimpleNamespace

from icotronic_driver.simulator.line import simulated_network
from isys_radar_driver.models import find_model
from isys_radar_driver.simulator.line import SimulatedRadars
from isys_radar_driver.simulator.line import simulated_line as simulated_radars
from isys_radar_driver.simulator.radar import SimulatedRadar
from sensor_tools.cli import program
from uc4000_driver.simulator.line import SimulatedSensors
from uc4000_driver.simulator.line import simulated_line as simulated_ultrasonic_sensors
from uc4000_driver.simulator.sensor import SimulatedSensor

FIRST_BYTES = {0x68, *range(0xA0, 0xB0)}  # of requests of both families
PATIENCE = 1.0  # s; answers come at once, but on a busy machine


class Bench:
    """Starts simulators; all of them end with it.

    What is not there is given up at once, and what is there is waited for, on a busy machine too.
    """

    def __init__(self, monkeypatch):
        self._stack = contextlib.ExitStack()
        self._set = monkeypatch.setattr

    def expect(self, *, rate=115200, radar_time=0.01, addresses=(7,), ultrasonic_time=0.01):
        """Say what searches meet: rate and addresses that answer, and the patience with each in s.

        More than that counts where no answer comes, and nowhere else.
        """
        for where, value in {
                "sensor_tools.search.isys.BAUD_RATES": (rate,),
                "sensor_tools.search.isys.LAST_ANSWER_TIME": radar_time,
                "isys_radar_driver.access.REPLY_TIMEOUT": max(radar_time, 0.1),
                "sensor_tools.search.uc4000.ADDRESSES": addresses,
                "sensor_tools.search.uc4000.SILENCES": 1,
                "uc4000_driver.line.LATENCY": ultrasonic_time}.items():
            self._set(where, value)

    def radars(self, *models, addresses=(), baud_rate=0):
        line, radars = simulated_radars(models, addresses, baud_rate=baud_rate)
        self.expect(rate=line._device.baud_rate, radar_time=PATIENCE)
        self._stack.callback(line.close)
        return line.start(), radars

    def ultrasonic_sensors(self, *addresses):
        self.expect(addresses=tuple(dict.fromkeys(addresses)), ultrasonic_time=PATIENCE)
        line, sensors = simulated_ultrasonic_sensors(addresses)
        self._stack.callback(line.close)
        return line.start(), sensors

    def network(self, *names):
        """Return the network, and the options with which the command reaches it."""
        server = simulated_network(names or ["Test-STH"]).start()
        self._stack.callback(server.close)
        return server.network, ["--can", "can0", "--can-interface", "socketcand", "--can-option",
                                f"host={server.host}", "--can-option", f"port={server.port}"]

    def empty_port(self):
        """Return a port with nobody on it, and what the other end of the cable writes with."""
        self.expect()
        master, slave = os.openpty()
        for descriptor in (master, slave):
            self._stack.callback(os.close, descriptor)
        return os.ttyname(slave), master

    def close(self):
        self._stack.close()


class VirtualLink:
    """In place of `SerialLink`: a port with simulated devices, where every wait is over at once."""

    MODULES = ("driver_common.replayed_serial", "sensor_tools.doctor.serial_port")
    PORT = "/dev/ttyVirtual"
    has_low_latency = False

    def __init__(self, monkeypatch, make_device):
        """Put it in place of the ports; `make_device` is called in the time of this link."""
        self.begin = self.now = 1000.0
        self.time = 0
        self.baud_rate = 0
        self.echo = False
        self.heard = bytearray()
        self._due = []
        monkeypatch.setattr("time.monotonic", lambda: self.now)
        for module in self.MODULES:
            monkeypatch.setattr(f"{module}.SerialLink", self.opened)
        self._device = make_device()

    @classmethod
    def radars(cls, monkeypatch, *wanted):
        """Return a port with radars, model and address of each; and the radars."""
        radars = []

        def make():
            radars.extend(SimulatedRadar(find_model(model), address, serial_number=number)
                          for number, (model, address) in enumerate(wanted, 1))
            return SimulatedRadars(radars)

        return cls(monkeypatch, make), radars

    @classmethod
    def ultrasonic_sensors(cls, monkeypatch, *addresses):
        """Return a port with ultrasonic sensors that have these addresses."""
        return cls(monkeypatch, lambda: SimulatedSensors(
            SimulatedSensor(address, serial_number=number)
            for number, address in enumerate(addresses, 1)))

    @classmethod
    def answering(cls, monkeypatch, answer, baud_rate=0):
        """Return a port with a device that answers everything at its rate with the same bytes."""
        return cls(monkeypatch, lambda: SimpleNamespace(
            baud_rate=baud_rate, receive=lambda data, now: (
                [(now, answer)] if data[0] in FIRST_BYTES else [])))

    def opened(self, port, baud_rate, recorder=None):
        self.baud_rate = baud_rate
        return self

    def close(self):
        pass

    def seconds(self, length):
        return length * 10 / self.baud_rate

    def write(self, data):
        self.heard += data
        arrived = self.now + self.seconds(len(data))
        if self.echo:
            self._due.append((arrived, data))
        if self.baud_rate != self._device.baud_rate:
            data = bytes(byte ^ 0x5A for byte in data)
        for begin, reply in self._device.receive(data, arrived):
            self._due.append((begin + self.seconds(len(reply)), reply))
        self._due.sort()

    def read(self, timeout):
        end = self.now + max(timeout, 0.0001)
        if not self._due or self._due[0][0] > end:
            self.now = end
            return b""
        due, data = self._due.pop(0)
        self.now = max(self.now, due)
        return data


@dataclass
class Outcome:
    """What a command printed, and its exit code."""

    code: int
    out: str
    err: str

    @property
    def json(self):
        return json.loads(self.out)


def run(capfd, *words):
    """Run the command in this process."""
    handler = signal.getsignal(signal.SIGTERM)
    capfd.readouterr()
    try:
        program.main([str(word) for word in words])
    except SystemExit as end:
        code = end.code or 0
    finally:
        signal.signal(signal.SIGTERM, handler)
    return Outcome(code, *capfd.readouterr())
