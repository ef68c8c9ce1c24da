# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Simulated UC4000 sensors on one wire."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence

from driver_common.errors import DriverError
from sensor_tools.simulation import (
    LINE_FAULTS,
    Simulation,
    add_faults,
    add_line_arguments,
    line_commands,
    numbers,
    set_fault,
    set_faults,
    switch,
)
from uc4000_driver.commands import OpCode
from uc4000_driver.simulator.line import simulated_line
from uc4000_driver.simulator.sensor import SimulatedSensor

DESCRIPTION = "Pepperl+Fuchs UC4000 ultrasonic sensors on one wire"
SENSOR_FAULTS = {
    "evaluation": "time in s from the end of a measurement to its reply (default: 0.005; the "
                  "manual allows 0.010)",
    "overreach": "in dB, by which the sensors hear more than their profiles promise"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments."""
    parser.add_argument("--addresses", default="", metavar="N[,N]",
                        help="address of each sensor, the same twice is possible (default: one "
                             "with the factory's)")
    parser.add_argument("--limits", default="", metavar="M,M",
                        help="distances that are reported as such (default: 0.25,4.0); 0.03,4.07 "
                             "are all that the wire can carry")
    parser.add_argument("--at-once", action="store_true",
                        help="the sensors answer without measuring first")
    add_faults(parser, SENSOR_FAULTS)
    add_line_arguments(parser)


def open_simulation(options: argparse.Namespace) -> Simulation:
    """Start the sensors; raises DriverError."""
    line, sensors = simulated_line(numbers(options.addresses, "--addresses"), link=options.link,
                                   listen=options.listen)
    line.faults.echo = options.echo
    set_faults(line.faults, LINE_FAULTS, options)
    commands = _commands(sensors)
    for sensor in sensors:
        sensor.at_once = options.at_once
        set_faults(sensor, SENSOR_FAULTS, options)
    if options.limits:
        try:
            commands["limits"](options.limits)
        except ValueError:
            raise DriverError("--limits takes two distances such as 0.25,4.0, not "
                              f"{options.limits!r}") from None
    line.start()
    addresses = ", ".join(str(sensor.address) for sensor in sensors)
    return Simulation(
        f"{line.port}: UC4000 at address {addresses}",
        commands | line_commands(line), line.close)


def _commands(sensors: Sequence[SimulatedSensor]) -> dict[str, Callable[[str], None]]:
    """Return what the sensors can be told, by name; all of them do it."""
    def each(do: Callable[[SimulatedSensor, str], None]) -> Callable[[str], None]:
        def command(argument: str) -> None:
            for sensor in sensors:
                do(sensor, argument)

        return command

    def refuse(sensor: SimulatedSensor, code: str) -> None:
        sensor.refuse = {op_code: int(code, 0) for op_code in OpCode} if code else {}

    def limits(sensor: SimulatedSensor, text: str) -> None:
        smallest, largest = map(float, text.split(","))
        sensor.limits = (smallest, largest)

    def number(name: str) -> Callable[[SimulatedSensor, str], None]:
        return lambda sensor, text: set_fault(sensor, name, float(text))

    return {"silent": switch(sensors, "silent"), "at-once": switch(sensors, "at_once"),
            "power-cycle": each(lambda sensor, _: sensor.power_cycle()), "refuse": each(refuse),
            "limits": each(limits),
            **{name: each(number(name)) for name in ("temperature", *SENSOR_FAULTS)}}
