# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A line with simulated radars whose time is simulated as well: hours of measuring in seconds.

The link takes the place of the serial port, and the clock that of the module `time` in all modules
of the driver. Time passes only while the driver waits, so the machine's load changes nothing.
"""

from __future__ import annotations

import heapq
import itertools

from isys_master import Master

from driver_common import device, device_bus
from driver_common.serial_link import BITS_PER_BYTE
from driver_common.simulator.line import Faults
from isys_radar_driver import access, acquisition, connection, line, session
from isys_radar_driver.models import find_model
from isys_radar_driver.simulator import radar as simulated_radar
from isys_radar_driver.simulator.line import SimulatedRadars
from isys_radar_driver.simulator.radar import SimulatedRadar

MODULES = (access, acquisition, connection, device_bus, line, device, session, simulated_radar)
EPOCH = 1_700_000_000.0  # s


class VirtualTime:
    """What the driver uses of the module `time`."""

    def __init__(self):
        self.now = 100.0

    def monotonic(self):
        return self.now

    def time(self):
        return EPOCH + self.now

    def time_ns(self):
        return round((EPOCH + self.now) * 1e9)

    def sleep(self, seconds):
        self.now += max(seconds, 0.0)


class VirtualLink:
    """A `SerialLink` to simulated radars.

    Attributes:
        replies: What the radars sent.
        noise: Bytes that come again and again, at the line's full speed.
        faults: What happens to the bytes, in both directions.
        suspension: Time in s for which this host stands still when it has read something next.
    """

    def __init__(self, clock, *models, addresses=(0, 0), **options):
        self.port = "virtual"
        self.clock = clock
        self.radars = [SimulatedRadar(find_model(model), address, **options)
                       for model, address in zip(models, addresses, strict=False)]
        self.devices = SimulatedRadars(self.radars)
        self.baud_rate = self.devices.baud_rate
        self.faults = Faults()
        self.replies = set()
        self.noise = b""
        self.suspension = 0.0
        self._events = []
        self._order = itertools.count()
        self._arrived = bytearray()
        self._free = 0.0

    @property
    def time(self):
        return self.clock.time_ns()

    def seconds(self, length):
        return length * BITS_PER_BYTE / self.baud_rate

    def close(self):
        """Nothing is left open."""

    def write(self, data):
        self._transmit(self.clock.now, data, self._receive)

    def read(self, timeout):
        end = self.clock.now + max(timeout, 0.0)
        if self.noise:
            self.clock.sleep(self.seconds(len(self.noise)))
            return self.noise
        while True:
            while self._events and self._events[0][0] <= self.clock.now:
                due, _, take, data = heapq.heappop(self._events)
                take(due, data)
            if self._arrived or self.clock.now >= end:
                data, self._arrived = bytes(self._arrived), bytearray()
                if data:
                    self.clock.sleep(self.suspension)
                    self.suspension = 0.0
                return data
            self.clock.now = min(end, *(event[0] for event in self._events[:1]), end)

    def _transmit(self, now, data, take):
        for late, piece in self.faults.hurt(data):
            now += self.seconds(len(piece))
            heapq.heappush(self._events, (now + late, next(self._order), take, piece))

    def _receive(self, now, data):
        for due, reply in self.devices.receive(data, now):
            due = max(due, self._free)
            self._free = due + self.seconds(len(reply))
            self._transmit(due, reply, lambda _, piece: self._arrived.extend(piece))
            self.replies.add(reply)


class VirtualMaster(Master):
    """A bus that the test polls, on a virtual line whose bus alone lets time pass.

    Attributes:
        link: The line.
    """

    def __init__(self, monkeypatch, link, *options):
        """Put link and clock into the driver's modules and find the radars."""
        self.link = link
        for module in MODULES:
            monkeypatch.setattr(module, "time", link.clock)
        monkeypatch.setattr(line, "open_serial", lambda *_: link)
        super().__init__("virtual", *options, baud_rate=link.baud_rate)
        self.find()

    def until(self, condition):
        """Poll until the condition holds, for an hour at most."""
        end = self.link.clock.now + 3600.0
        while not condition():
            assert self.link.clock.now < end, f"lost: {self.heard.lost}, notes: {self.heard.notes}"
            self.link.clock.sleep(self.bus.poll())

    def run(self, seconds):
        """Poll for some time."""
        end = self.link.clock.now + seconds
        self.until(lambda: self.link.clock.now >= end)
