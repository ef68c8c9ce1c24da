# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A simulated ICOtronic system on a CAN bus, served by socketcand."""

from __future__ import annotations

import argparse

from driver_common.errors import SettingError
from icotronic_driver.laws import PARTS_BY_NUMBER
from icotronic_driver.simulator.line import simulated_network
from icotronic_driver.simulator.scene import rest, vibration
from icotronic_driver.simulator.unit import SILENT_ON
from sensor_tools.simulation import (
    Simulation,
    add_faults,
    fault_commands,
    numbers,
    set_faults,
    switch,
)

DESCRIPTION = "ICOtronic accelerometers on a CAN bus, served by socketcand"
FAULTS = {
    "loss": "probability that a radio frame with measured values is lost",
    "loss_run": "how many are lost in a row",
    "duplicate": "probability that such a frame comes twice",
    "swap": "probability that such a frame comes after the one behind it",
    "damage": "probability that its counter is damaged",
    "jitter": "time in s by which such a frame comes late, at most",
    "burst": "time in s for which such frames are held back, to come all at once",
    "answer_loss": "probability that an answer of a sensor is lost",
    "answer_delay": "time in s that an answer of a sensor takes beyond the usual",
    "refused_connects": "how many attempts to connect fail",
    "connect_time": "time in s that a connection takes beyond the shortest",
    "newness": "time in s in which a new sensor tells no MAC address, no RSSI and half a name",
    "foreign": "frames per s on the bus that belong to something else",
    "errors": "error frames per s on the bus"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments."""
    parser.add_argument("--name", action="append", metavar="NAME",
                        help="name of a sensor (default: Test-STH); once for each sensor")
    parser.add_argument("--listen", default="127.0.0.1:29536", metavar="HOST:PORT",
                        help="where the socketcand server listens; port 0 takes a free one")
    parser.add_argument("--channel", default="", help="the only channel (default: any)")
    parser.add_argument("--uncalibrated", action="store_true",
                        help="the sensors hold no calibration factors")
    parser.add_argument("--can-fd", action="store_true", help="frames can have 64 bytes")
    parser.add_argument("--silent-on", choices=SILENT_ON, default="nothing",
                        help="commands to which all units stay silent: those that the vendor's "
                             "client leaves unused, or all that are optional for a stream")
    parser.add_argument("--used-sensors", default="1,2,3", metavar="X,Y,Z",
                        help="numbers of the sensors on the channels after a reset, 1 ... 10")
    parser.add_argument("--at-rest", action="store_true", help="the sensors lie still")
    parser.add_argument("--noise", type=float, default=0.0,
                        help="standard deviation in g of what they measure")
    add_faults(parser, FAULTS)


def open_simulation(options: argparse.Namespace) -> Simulation:
    """Start the system; raises DriverError."""
    used = _used_sensors(options.used_sensors)
    server = simulated_network(options.name or ["Test-STH"], listen=options.listen,
                               channel=options.channel, calibrated=not options.uncalibrated,
                               can_fd=options.can_fd)
    network = server.network
    set_faults(network.faults, FAULTS, options)
    network.stay_silent(options.silent_on)
    for sensor in network.sensors:
        sensor.first_sensors = sensor.used_sensors = used
        sensor.noise = options.noise
        sensor.vibration = rest if options.at_rest else vibration
    server.start()

    def away(name: str) -> None:
        network.sensor(name).in_range = False

    def back(name: str) -> None:
        network.sensor(name).in_range = True

    def power_cycle(name: str) -> None:
        network.power_loss(network.stu if name == "STU" else network.sensor(name))

    names = ", ".join(f"{sensor.name} ({sensor.mac})" for sensor in network.sensors)
    return Simulation(
        f"{server.host}:{server.port}: {names}",
        {"silent": switch([network.faults], "silent"),
         "padding": switch([network.faults], "padding"), "silent-on": network.stay_silent,
         "away": away, "back": back, "power-cycle": power_cycle,
         "unplug": lambda _: server.unplug(), "plug": lambda _: server.plug(),
         "hang": lambda _: server.hang(),
         **fault_commands(network.faults, FAULTS)}, server.close)


def _used_sensors(text: str) -> tuple[int, int, int]:
    used = numbers(text, "--used-sensors")
    if len(used) != 3 or not set(used) <= PARTS_BY_NUMBER.keys():
        raise SettingError(f"--used-sensors takes three numbers 1 ... 10, not {text}")
    x, y, z = used
    return x, y, z
