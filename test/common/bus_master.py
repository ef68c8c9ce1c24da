# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the tests of all sessions share: they poll the bus themselves, and hear what it tells.

So nothing happens behind their backs.
"""

from __future__ import annotations

import inspect
import time

import pytest
from can.interfaces.socketcand import socketcand

from driver_common.device_bus import Listener

needs_errors_of_socketcand = pytest.mark.skipif(
    "< error" not in inspect.getsource(socketcand),
    reason="this python-can does not hear what a socketcand server complains about")
DEADLINE = 60.0  # s; far more than anything takes, also on a busy machine


def wait_until(condition):
    """Wait for something that happens in another thread."""
    deadline = time.monotonic() + DEADLINE
    while not condition():
        assert time.monotonic() < deadline, "it does not happen"
        time.sleep(0.005)


class BusRecorder(Listener):
    """Remembers what a bus tells.

    Attributes:
        found: Names of the devices that were found.
        lost: Names of those that were lost, and why.
        values: Values that were read again.
        notes: All notes.
        warnings: Those that are warnings.
    """

    def __init__(self):
        self.found = []
        self.lost = []
        self.values = []
        self.notes = []
        self.warnings = []

    def on_found(self, device):
        self.found.append(device.options.name)

    def on_values(self, device):
        self.values.append(dict(device.values))

    def on_lost(self, device, error):
        self.lost.append((device.options.name, error))

    def on_note(self, device, text, *, warning=False):
        self.notes.append(text)
        if warning:
            self.warnings.append(text)


class BusMaster:
    """A bus that the test polls.

    Attributes:
        bus: The bus.
        heard: What it told.
        device: The first device.
    """

    def __init__(self, bus, heard):
        self.bus = bus
        self.heard = heard
        self.device = bus.devices[0]

    def until(self, condition, seconds=DEADLINE):
        """Poll until the condition holds."""
        deadline = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < deadline, (
                f"not within {seconds} s; lost: {self.heard.lost}, notes: {self.heard.notes}")
            time.sleep(min(self.bus.poll(), 0.02))

    def find(self):
        """Poll until every device is found; that one was not at once is forgotten."""
        self.until(lambda: all(device.is_connected for device in self.bus.devices))
        self.heard.lost.clear()
        return self

    def lose(self):
        """Poll until a device is said to be lost, and return the reason."""
        start = len(self.heard.lost)
        self.until(lambda: len(self.heard.lost) > start)
        return self.heard.lost[start][1]
