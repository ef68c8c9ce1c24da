# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A master on simulated radar lines that the test drives step by step.

The test calls `poll` itself, so that nothing happens behind its back. The radars are in the same
process: what they did and what the session made of it can be compared.
"""

from __future__ import annotations

import math
import tempfile
import time

from bus_master import BusMaster, BusRecorder

from driver_common.simulator.line import Faults
from isys_radar_driver.frames import FrameParser
from isys_radar_driver.listener import Listener
from isys_radar_driver.models import find_model
from isys_radar_driver.radar import Options
from isys_radar_driver.session import RadarBus
from isys_radar_driver.simulator import radar as simulated_radar
from isys_radar_driver.simulator.line import simulated_line

FAST_LINE = 921600  # Bd, where the line's speed does not matter


class Recorder(BusRecorder, Listener):
    """Remembers what the bus tells."""

    def __init__(self):
        super().__init__()
        self.lists = []
        self.range_lists = []
        self.digital_outputs = []
        self.temperatures = []

    def on_target_list(self, radar, targets, stamp):
        self.lists.append((radar.options.name, targets, stamp))

    def on_digital_outputs(self, radar, values, stamp):
        self.digital_outputs.append(values)

    def on_range_list(self, radar, values, targets, stamp):
        self.range_lists.append((values, stamp))

    def on_temperatures(self, radar, stamp):
        self.temperatures.append(dict(radar.temperatures))


class Master(BusMaster):
    """A bus that the test polls."""

    def __init__(self, port, *options, baud_rate=0):
        heard = Recorder()
        super().__init__(RadarBus(port, baud_rate, options or [Options()], heard), heard)
        self.radar = self.device
        self.maintenance = self.bus.maintenance
        self.bus.open()

    def measure(self, count=1):
        """Start measuring and return that many new target lists."""
        self.bus.set_active(True)
        return self.lists(count)

    def lists(self, count=1):
        """Poll until that many new target lists have come, and return them."""
        start = len(self.heard.lists)
        self.until(lambda: len(self.heard.lists) >= start + count)
        return [targets for _, targets, _ in self.heard.lists[start:start + count]]


class Truth:
    """Records what was in front of a radar at every measurement."""

    def __init__(self, radar):
        self._scene = radar.scene
        self.recorded = []
        radar.scene = self

    def __call__(self, now):
        targets = self._scene(now)
        self.recorded.append((now, targets))
        return targets

    def at(self, now):
        return self._scene(now)

    def confirm(self, lists, tolerance):
        """Assert that each list that was heard is one of the measurements, in their order."""
        recorded = iter(self.recorded)
        for _, measured, stamp in lists:
            when = next((when for when, targets in recorded
                         if are_same(measured.targets, targets, tolerance)), None)
            assert when is not None, f"{measured} was never measured"
            assert -0.005 < stamp * 1e-9 - when < 0.5  # later where the machine is busy


class Script(Faults):
    """Faults that a function decides: it takes a reply and returns what arrives in its place."""

    def __init__(self, function):
        super().__init__()
        self._function = function

    def apply(self, due, reply):
        return self._function(due, reply)


def function_code(reply):
    (frame,) = FrameParser().feed(reply)
    return frame.function_code


def counted_requests(radar):
    """Let a simulated radar note the time of every request to it, and return the list."""
    times, reply = [], radar.reply

    def noting(request, now):
        if request.destination == radar.address:
            times.append(time.monotonic())
        return reply(request, now)

    radar.reply = noting
    return times


def half_a_step(model, bits):
    """Return the largest rounding error of each value of a target, with a little to spare."""
    steps = (0.01, 0.001, 1e-6, math.radians(0.001)) if bits == 32 else (
        1.0, 0.01, find_model(model).range_step_16, math.radians(0.01))
    return [0.501 * step for step in steps]


def are_same(measured, truth, tolerance):
    """Return whether targets are the true ones, each value within its tolerance."""
    return len(measured) == len(truth) and all(
        abs(value - true_value) <= largest
        for one, other in zip(measured, truth, strict=True)
        for value, true_value, largest in zip(one, other, tolerance, strict=True))


class Lab:
    """Lines with simulated radars, and masters on them; all end with the lab.

    The radars answer faster than real ones, because hundreds of tests read all their settings.
    """

    def __init__(self):
        self._lines = []
        self._masters = []
        self._directory = tempfile.TemporaryDirectory(prefix="lab-")
        self._turnaround = simulated_radar.TURNAROUND

    def __enter__(self):
        simulated_radar.TURNAROUND = 0.0001
        return self

    def __exit__(self, *_):
        simulated_radar.TURNAROUND = self._turnaround
        for master in self._masters:
            master.bus.close()
        for line in self._lines:
            line.close()
        self._directory.cleanup()

    def start(self, *models, **options):
        """Start a line with radars of these models; return the line and the radars."""
        # By a name that nobody takes again: a node may look for its port when this is gone.
        if not {"link", "listen"} & options.keys():
            options["link"] = f"{self._directory.name}/port{len(self._lines)}"
        line, radars = simulated_line(models, **options)
        self._lines.append(line.start())
        return line, *radars

    def connect(self, model="iSYS-4001", *, baud_rate=FAST_LINE, **options):
        """Start a radar and find it; return master, line and simulated radar."""
        line, radar = self.start(model, baud_rate=baud_rate)
        master = Master(line.port, Options(**options), baud_rate=baud_rate)
        self._masters.append(master)
        return master.find(), line, radar
