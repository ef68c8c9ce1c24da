# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A master on simulated UC4000 lines that the test drives step by step.

The test calls `poll` itself, so that nothing happens behind its back. The sensors are in the same
process: what they did and what the session made of it can be compared.
"""

from __future__ import annotations

from bus_master import BusMaster, BusRecorder

from uc4000_driver.listener import Listener
from uc4000_driver.sensor import Options
from uc4000_driver.session import Uc4000Bus


class Recorder(BusRecorder, Listener):
    """Remembers what the bus tells."""

    def __init__(self):
        super().__init__()
        self.measurements = []
        self.temperatures = []

    def on_measurement(self, sensor, measurement):
        self.measurements.append((sensor.options.name, measurement))

    def on_temperature(self, sensor, celsius, stamp):
        self.temperatures.append((sensor.options.name, celsius, stamp))


class Master(BusMaster):
    """A bus that the test polls."""

    def __init__(self, port, *options, active=True, **more):
        heard = Recorder()
        super().__init__(Uc4000Bus(port, options or [Options(address=7)], heard, **more), heard)
        self.sensor = self.device
        self.bus.set_active(active)
        self.bus.open()

    def measure(self, count=1, name=None):
        """Poll until that many new measurements have come, of one sensor or of any."""
        def new():
            return [measurement for sensor, measurement in self.heard.measurements[start:]
                    if name in (None, sensor)]
        start = len(self.heard.measurements)
        self.until(lambda: len(new()) >= count)
        return new()

    def distances(self, count=1, name=None):
        return [measurement.distance.value for measurement in self.measure(count, name)]

    def write(self, changes):
        return self.bus.maintenance.write(self.sensor, changes)

    def note(self, text):
        """Poll until a note contains the text."""
        self.until(lambda: any(text in note for note in self.heard.notes))


def still(index):
    """Return a distance that never changes, another one for each sensor; a multiple of 16 mm."""
    return round(0.8 + 0.32 * index, 3)


def named(*addresses, **more):
    """Return options of sensors with names s1, s2, …"""
    return [Options(name=f"s{address}", address=address, **more) for address in addresses]


def counts(master):
    return {sensor.options.name: sensor.statistics.outcomes.total()
            for sensor in master.bus.devices}


class Requests:
    """Records the requests that a simulated sensor answers or ignores, and may change a reply."""

    def __init__(self, sensor, change=lambda request, answer: answer):
        self.all = []
        reply = sensor.reply

        def record(request, now):
            if request.address in (0, sensor.address):
                self.all.append(request)
            return change(request, reply(request, now))

        sensor.reply = record

    def writes(self):
        return [(request.op_code, request.data) for request in self.all if request.is_write]
