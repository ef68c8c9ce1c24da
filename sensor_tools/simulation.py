# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the simulators of all families have in common on the command line."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from driver_common.errors import DriverError
from driver_common.simulator.line import SimulatedLine

LINE_FAULTS = {"drop": "probability that a reply is lost",
               "corrupt": "probability that a byte of a reply is damaged",
               "noise": "probability of random bytes in front of a reply",
               "split": "pause in s in the middle of each reply",
               "delay": "time in s added before each reply",
               "damage": "probability that a byte, in either direction, is lost, flipped, "
                         "doubled or late",
               "babble": "share of the time in which something else sends without end",
               "babble_byte": "value of its bytes, or any at -1"}


@dataclass(frozen=True)
class Simulation:
    """A running simulator.

    Attributes:
        title: Where it is found, and what it simulates.
        commands: What it can be told, by name; each gets the rest of the line.
        close: Ends it.
    """

    title: str
    commands: Mapping[str, Callable[[str], None]]
    close: Callable[[], None]

    @property
    def help(self) -> str:
        """The commands, for people."""
        return ", ".join([*self.commands, "quit"])


def add_line_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what every simulator on a serial line takes."""
    parser.add_argument("--link", default="", metavar="PATH",
                        help="make PATH a symbolic link to the pseudo-terminal")
    parser.add_argument("--listen", default="", metavar="HOST:PORT",
                        help="serve TCP instead of a pseudo-terminal")
    parser.add_argument("--echo", action="store_true", help="the master hears its own bytes")
    add_faults(parser, LINE_FAULTS)


def add_faults(parser: argparse.ArgumentParser, names: Mapping[str, str]) -> None:
    """Add an argument for each fault: name and what it means."""
    for name, text in names.items():
        parser.add_argument(f"--{name.replace('_', '-')}", type=float, help=text)


def set_faults(faults: Any, names: Iterable[str], options: argparse.Namespace) -> None:
    """Set the faults that were given as arguments."""
    for name in names:
        if getattr(options, name) is not None:
            set_fault(faults, name, getattr(options, name))


def set_fault(faults: Any, name: str, value: float) -> None:
    """Set one fault, in the type that it has."""
    setattr(faults, name, type(getattr(faults, name))(value))


def fault_commands(faults: Any, names: Iterable[str]) -> dict[str, Callable[[str], None]]:
    """Return a command per fault, which takes a number."""
    def command(name: str) -> Callable[[str], None]:
        return lambda argument: set_fault(faults, name, number(argument))

    return {name: command(name) for name in names}


def line_commands(line: SimulatedLine) -> dict[str, Callable[[str], None]]:
    """Return what every serial line can be told, by name."""
    return {"unplug": lambda _: line.unplug(), "plug": lambda _: line.plug(),
            "hang": lambda _: line.hang(), "baud": lambda rate: line.set_baud_rate(int(rate)),
            "echo": switch([line.faults], "echo"), **fault_commands(line.faults, LINE_FAULTS)}


def switch(targets: Iterable[Any], attribute: str) -> Callable[[str], None]:
    """Return a command that takes on or off for an attribute of all targets."""
    targets = list(targets)

    def command(argument: str) -> None:
        if argument not in ("on", "off"):
            raise ValueError("say on or off")
        for target in targets:
            setattr(target, attribute, argument == "on")

    return command


def number(text: str) -> float:
    """Return a number such as 0.5 or 0x55; raises ValueError."""
    return int(text, 16) if text.startswith("0x") else float(text)


def numbers(text: str, option: str) -> list[int]:
    """Return the numbers in "1,2,7".

    Raises:
        DriverError: Something else is in it.
    """
    try:
        return [int(part) for part in text.split(",") if part]
    except ValueError:
        raise DriverError(f"{option} takes numbers such as 1,2, not {text!r}") from None
