# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The command `sensors`: all subcommands in one place, errors in words, exit codes.

0 = well, 1 = something is wrong with a sensor, a port or a value, or nobody reads on (as in
"sensors get | head"), 2 = the command line is wrong.
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Sequence
from typing import Any

import click

from driver_common.errors import DriverError
from sensor_tools import simulate as simulators
from sensor_tools.cli.change_address import change_address
from sensor_tools.cli.doctor import doctor
from sensor_tools.cli.factory_reset import factory_reset
from sensor_tools.cli.get import get
from sensor_tools.cli.info import info
from sensor_tools.cli.record import record
from sensor_tools.cli.save import save
from sensor_tools.cli.scan import scan
from sensor_tools.cli.set import set_settings
from sensor_tools.cli.watch import watch
from sensor_tools.demo import program as demonstration

WIDTH = 100  # of help texts


class Commands(click.Group):
    """Commands in the order in which a new user needs them."""

    def list_commands(self, context: click.Context) -> list[str]:
        """Return the names in that order."""
        return list(self.commands)


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"],
                                             "max_content_width": WIDTH})
def sensors() -> None:
    """Find, check, set and read iSYS radars, ICOtronic accelerometers and UC4000 sensors.

    Nothing of it needs ROS. A sensor that a node uses is not free for this command.
    """


def _other_program(name: str, text: str, main: Callable[[Sequence[str]], Any]) -> click.Command:
    """Return a command that is a program of its own, with its own options."""
    @click.argument("arguments", nargs=-1, type=click.UNPROCESSED)
    def run(arguments: Sequence[str]) -> None:
        sys.exit(main(list(arguments)))

    return click.command(name, help=text, add_help_option=False, context_settings={
        "ignore_unknown_options": True})(run)


for command in (scan, doctor, info, get, set_settings, watch, record, save, change_address,
                factory_reset):
    sensors.add_command(command)
sensors.add_command(_other_program("simulate", "Simulated sensors.", simulators.main))
sensors.add_command(_other_program("demo", "Simulated sensors, nodes and a picture.",
                                   demonstration.main))


def main(args: Sequence[str] | None = None, command: click.Command = sensors,
         name: str = "sensors") -> None:
    """Run a command and end the process with its exit code."""
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    try:
        sys.exit(command.main(args, prog_name=name, standalone_mode=False))
    except click.ClickException as error:
        error.show()
        sys.exit(error.exit_code)
    except DriverError as error:
        click.echo(f"error: {error}", err=True)
        sys.exit(1)
    except (KeyboardInterrupt, click.Abort):
        sys.exit(128 + signal.SIGINT)


def doctor_main() -> None:
    """Run the doctor as a program of its own."""
    main(command=doctor, name="doctor")


if __name__ == "__main__":
    main()
