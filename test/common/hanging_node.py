# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A node whose bus hangs until it is told to go on."""

import math
import sys
from types import SimpleNamespace

from driver_common import diagnostics
from driver_common.device import Device, DeviceOptions
from driver_common.device_bus import DeviceBus, Listener
from driver_common.device_node import DeviceNode, run
from driver_common.flight_recorder import FlightRecorder
from driver_common.settings import Record, Setting

GAIN = Setting("gain", Record(layout=("B",)), kind=int)


class FakeDevice(Device):
    """A device that is always there and has a setting."""

    product = "fake"
    is_connected = True

    def __init__(self, options):
        super().__init__(options)
        self.settings, self.values = {"gain": GAIN}, {"gain": 1}


class HangingBus(DeviceBus):
    """A bus whose first step and writes end when a line comes from the standard input."""

    told = ""

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.line = SimpleNamespace(recorder=FlightRecorder())

    def _open_link(self):
        pass

    def close(self):
        pass

    def poll(self):
        if not self.told:
            print("hangs", flush=True)
            self.told = sys.stdin.readline()
            for device in self.devices:
                self._note_found(device)
        return math.inf

    def write(self, device, changes):
        print("writes", *changes.values(), flush=True)
        sys.stdin.readline()
        device.values |= changes
        return changes

    def set_active(self, active):
        pass


class HangingNode(DeviceNode, Listener):
    ALL_SETTINGS = {"gain": GAIN}  # noqa: RUF012

    def describe(self, device):
        return device.product

    def make_bus(self):
        return HangingBus([FakeDevice(DeviceOptions(name)) for name in self.sensors], self)

    def status_of(self, device):
        return diagnostics.to_status(self.status_name(device.options.name), "", diagnostics.OK,
                                     "well", {})


def main():
    run(lambda: HangingNode("hanging"))
