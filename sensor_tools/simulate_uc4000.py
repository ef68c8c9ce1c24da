"""Simulated UC4000 sensors on one wire."""

from __future__ import annotations

import argparse

from sensor_tools.simulation import (
    LINE_FAULTS,
    Simulation,
    add_line_arguments,
    fault_commands,
    numbers,
    set_faults,
    switch,
)
from uc4000_driver.commands import OpCode
from uc4000_driver.simulator.line import simulated_line

DESCRIPTION = "Pepperl+Fuchs UC4000 ultrasonic sensors on one wire"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments."""
    parser.add_argument("--addresses", default="", metavar="N[,N]",
                        help="address of each sensor, the same twice is possible (default: one "
                             "with the factory's)")
    add_line_arguments(parser)


def open_simulation(options: argparse.Namespace) -> Simulation:
    """Start the sensors; raises DriverError."""
    line, sensors = simulated_line(numbers(options.addresses, "--addresses"), link=options.link,
                                   listen=options.listen)
    line.faults.echo = options.echo
    set_faults(line.faults, LINE_FAULTS, options)
    line.start()

    def power_cycle(_: str) -> None:
        for sensor in sensors:
            sensor.power_cycle()

    def refuse(code: str) -> None:
        for sensor in sensors:
            sensor.refuse = {op_code: int(code, 0) for op_code in OpCode} if code else {}

    def temperature(celsius: str) -> None:
        for sensor in sensors:
            sensor.temperature = float(celsius)

    addresses = ", ".join(str(sensor.address) for sensor in sensors)
    return Simulation(
        f"{options.link or line.port}: UC4000 at address {addresses}",
        {"silent": switch(sensors, "silent"), "power-cycle": power_cycle, "refuse": refuse,
         "temperature": temperature, **fault_commands(line.faults, LINE_FAULTS)}, line.close)
