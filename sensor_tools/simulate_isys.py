# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Simulated iSYS radars on a serial line."""

from __future__ import annotations

import argparse

from isys_radar_driver.models import MODELS
from isys_radar_driver.simulator.line import simulated_line
from sensor_tools.simulation import (
    LINE_FAULTS,
    Simulation,
    add_line_arguments,
    line_commands,
    numbers,
    set_faults,
    switch,
)

DESCRIPTION = "InnoSenT iSYS radars on a serial line"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments."""
    parser.add_argument("--model", default="iSYS-4001", metavar="NAME[,NAME]",
                        help=f"one of {', '.join(MODELS)}; several are on one line")
    parser.add_argument("--address", default="", metavar="N[,N]",
                        help="address of each radar (default: the model's)")
    parser.add_argument("--baud", type=int, default=0, help="baud rate (default: the model's)")
    parser.add_argument("--range-bound", action="store_true",
                        help="its firmware has the setting range_bound (iSYS-4001)")
    add_line_arguments(parser)


def open_simulation(options: argparse.Namespace) -> Simulation:
    """Start the radars; raises DriverError."""
    line, radars = simulated_line(
        options.model.split(","), numbers(options.address, "--address"), baud_rate=options.baud,
        link=options.link, listen=options.listen, range_bound=options.range_bound)
    line.faults.echo = options.echo
    set_faults(line.faults, LINE_FAULTS, options)
    line.start()

    def power_cycle(_: str) -> None:
        for radar in radars:
            radar.power_cycle()

    def refuse(codes: str) -> None:
        for radar in radars:
            radar.refuse = {int(code, 0) for code in codes.split(",") if code}

    names = ", ".join(f"{radar.model.name} at address {radar.address}" for radar in radars)
    return Simulation(
        f"{line.port}: {names}",
        {**{name.replace("_", "-"): switch(radars, name)
            for name in ("silent", "clipping", "strict", "self_starting", "bare", "nonsense")},
         "power-cycle": power_cycle, "refuse": refuse, **line_commands(line)}, line.close)
