# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Simulated sensors for the command line: `simulate isys --model iSYS-4001`."""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Callable, Mapping, Sequence
from types import ModuleType

from driver_common.errors import DriverError
from sensor_tools import simulate_icotronic, simulate_isys, simulate_uc4000
from sensor_tools.simulation import Simulation

# Each module has DESCRIPTION, add_arguments(parser) and open_simulation(options).
FAMILIES: Mapping[str, ModuleType] = {
    "isys": simulate_isys, "icotronic": simulate_icotronic, "uc4000": simulate_uc4000}


def obey(simulation: Simulation) -> None:
    """Carry out the commands on standard input, then wait for a signal."""
    for line in sys.stdin:
        name, _, argument = line.strip().partition(" ")
        if name == "quit":
            return
        try:
            action: Callable[[str], None] = simulation.commands[name]
            action(argument)
        except KeyError:
            print(f"cannot do {line.strip()!r}: known are {simulation.help}", flush=True)
        except (DriverError, ValueError) as error:
            print(f"cannot do {line.strip()!r}: {error}", flush=True)
        else:
            print(f"done: {line.strip()}", flush=True)
    signal.pause()


def main(args: Sequence[str] | None = None) -> None:
    """Run a simulator until it is told to stop."""
    parser = argparse.ArgumentParser(prog="simulate", description="Simulated sensors.")
    families = parser.add_subparsers(dest="family", required=True)
    for name, family in FAMILIES.items():
        family.add_arguments(families.add_parser(name, help=family.DESCRIPTION,
                                                 description=family.DESCRIPTION))
    options = parser.parse_args(args)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    try:
        simulation: Simulation = FAMILIES[options.family].open_simulation(options)
        try:
            print(f"{simulation.title}; commands: {simulation.help}", flush=True)
            obey(simulation)
        finally:
            simulation.close()
    except DriverError as error:
        parser.exit(1, f"error: {error}\n")
    except KeyboardInterrupt:
        pass


if __name__ == "__main__":
    main()
