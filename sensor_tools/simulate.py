"""Simulated sensors for the command line: `simulate isys --model iSYS-4001`."""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Callable, Sequence
from dataclasses import fields

from driver_common.errors import DriverError
from driver_common.simulated_line import Faults, SimulatedLine
from isys_radar_driver.models import MODELS
from isys_radar_driver.simulator import SimulatedRadar, simulated_line

FAULTS = {"drop": "probability that a reply is lost",
          "corrupt": "probability that a byte of a reply is damaged",
          "noise": "probability of random bytes in front of a reply",
          "split": "pause in s in the middle of each reply",
          "delay": "time in s added before each reply"}
COMMANDS = ("silent on|off, clipping on|off, power-cycle, quit, or one of "
            f"{', '.join(FAULTS)} with a number")


def _add_isys(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--model", default="iSYS-4001", metavar="NAME[,NAME]",
                        help=f"one of {', '.join(MODELS)}; several are on one line")
    parser.add_argument("--address", default="", metavar="N[,N]",
                        help="address of each radar (default: the model's)")
    parser.add_argument("--baud", type=int, default=0, help="baud rate (default: the model's)")
    parser.add_argument("--link", default="", metavar="PATH",
                        help="make PATH a symbolic link to the pseudo-terminal")
    parser.add_argument("--listen", default="", metavar="HOST:PORT",
                        help="serve TCP instead of a pseudo-terminal")
    parser.add_argument("--echo", action="store_true", help="the master hears its own bytes")
    for name, text in FAULTS.items():
        parser.add_argument(f"--{name}", type=float, default=0.0, help=text)


def _isys(options: argparse.Namespace) -> None:
    try:
        addresses = [int(part) for part in options.address.split(",") if part]
    except ValueError:
        raise DriverError(f"--address takes numbers, not {options.address!r}") from None
    line, radars = simulated_line(options.model.split(","), addresses, baud_rate=options.baud,
                                  link=options.link, listen=options.listen)
    for field in fields(Faults):
        if hasattr(options, field.name):
            setattr(line.faults, field.name, getattr(options, field.name))
    line.start()
    names = ", ".join(f"{radar.model.name} at address {radar.address}" for radar in radars)
    print(f"{options.link or line.port}: {names}; commands: {COMMANDS}", flush=True)
    try:
        _obey(line, radars)
    finally:
        line.close()


def _obey(line: SimulatedLine, radars: Sequence[SimulatedRadar]) -> None:
    """Carry out the commands on standard input, then wait for a signal."""
    for text in sys.stdin:
        command, _, argument = text.strip().partition(" ")
        if command == "quit":
            return
        if command in ("silent", "clipping"):
            for radar in radars:
                setattr(radar, command, argument == "on")
        elif command == "power-cycle":
            for radar in radars:
                radar.power_cycle()
        elif command in FAULTS and argument.replace(".", "", 1).isdigit():
            setattr(line.faults, command, float(argument))
        elif command:
            print(f"unknown command {text.strip()!r}; known are {COMMANDS}", flush=True)
            continue
        print(f"done: {text.strip()}", flush=True)
    signal.pause()


FAMILIES: dict[str, tuple[str, Callable[[argparse.ArgumentParser], None],
                          Callable[[argparse.Namespace], None]]] = {
    "isys": ("InnoSenT iSYS radars on a serial line", _add_isys, _isys),
}


def main(args: Sequence[str] | None = None) -> None:
    """Run a simulator until it is told to stop."""
    parser = argparse.ArgumentParser(prog="simulate", description="Simulated sensors.")
    families = parser.add_subparsers(dest="family", required=True)
    for name, (text, add_arguments, _) in FAMILIES.items():
        add_arguments(families.add_parser(name, help=text, description=text))
    options = parser.parse_args(args)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    try:
        FAMILIES[options.family][2](options)
    except DriverError as error:
        parser.exit(1, f"error: {error}\n")
    except KeyboardInterrupt:
        pass
