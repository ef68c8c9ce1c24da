"""Simulated sensors for the command line, such as `simulate isys --model iSYS-4001`."""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Callable, Sequence
from dataclasses import fields

from driver_common.errors import DriverError
from driver_common.simulated_line import Faults, SimulatedLine
from icotronic_driver.simulator import SimulatedIcotronic, simulated_network
from isys_radar_driver.models import MODELS
from isys_radar_driver.simulator import SimulatedRadar, simulated_line

FAULTS = {"drop": "probability that a reply is lost",
          "corrupt": "probability that a byte of a reply is damaged",
          "noise": "probability of random bytes in front of a reply",
          "split": "pause in s in the middle of each reply",
          "delay": "time in s added before each reply"}
COMMANDS = ("silent on|off, clipping on|off, power-cycle, quit, or one of "
            f"{', '.join(FAULTS)} with a number")

ICOTRONIC_FAULTS = {
    "loss": "probability that a radio frame with measured values is lost",
    "loss_run": "how many are lost in a row",
    "duplicate": "probability that such a frame comes twice",
    "jitter": "time in s by which such a frame comes late, at most",
    "burst": "time in s for which such frames are held back, to come all at once",
    "answer_loss": "probability that an answer of a sensor is lost",
    "refused_connects": "how many attempts to connect fail",
    "foreign": "frames per s on the bus that belong to something else"}
ICOTRONIC_COMMANDS = ("silent on|off, away NAME, back NAME, power-cycle NAME, quit, or one of "
                      f"{', '.join(ICOTRONIC_FAULTS)} with a number")


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


def _add_icotronic(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--name", action="append", metavar="NAME",
                        help="name of a sensor (default: Test-STH); once for each sensor")
    parser.add_argument("--listen", default="127.0.0.1:29536", metavar="HOST:PORT",
                        help="where the socketcand server listens; port 0 takes a free one")
    parser.add_argument("--channel", default="", help="the only channel (default: any)")
    parser.add_argument("--uncalibrated", action="store_true",
                        help="the sensors hold no calibration factors")
    parser.add_argument("--can-fd", action="store_true", help="frames can have 64 bytes")
    for name, text in ICOTRONIC_FAULTS.items():
        parser.add_argument(f"--{name.replace('_', '-')}", type=float, default=None, help=text)


def _icotronic(options: argparse.Namespace) -> None:
    server = simulated_network(options.name or ["Test-STH"], listen=options.listen,
                               channel=options.channel, calibrated=not options.uncalibrated,
                               can_fd=options.can_fd)
    for name in ICOTRONIC_FAULTS:
        if getattr(options, name) is not None:
            _set_icotronic_fault(server, name, getattr(options, name))
    server.start()
    names = ", ".join(f"{sensor.name} ({sensor.mac})" for sensor in server.network.sensors)
    print(f"{server.host}:{server.port}: {names}; commands: {ICOTRONIC_COMMANDS}", flush=True)
    try:
        for text in sys.stdin:
            command, _, argument = text.strip().partition(" ")
            if command == "quit":
                return
            try:
                _obey_icotronic(server, command, argument)
            except (DriverError, ValueError) as error:
                print(f"cannot do {text.strip()!r}: {error}", flush=True)
            else:
                print(f"done: {text.strip()}", flush=True)
        signal.pause()
    finally:
        server.close()


def _obey_icotronic(server: SimulatedIcotronic, command: str, argument: str) -> None:
    network = server.network
    if command == "silent":
        network.faults.silent = argument == "on"
    elif command in ("away", "back"):
        network.sensor(argument).in_range = command == "back"
    elif command == "power-cycle":
        network.power_loss(network.sensor(argument))
    elif command in ICOTRONIC_FAULTS:
        _set_icotronic_fault(server, command, float(argument))
    else:
        raise DriverError(f"known commands are {ICOTRONIC_COMMANDS}")


def _set_icotronic_fault(server: SimulatedIcotronic, name: str, value: float) -> None:
    faults = server.network.faults
    setattr(faults, name, type(getattr(faults, name))(value))


FAMILIES: dict[str, tuple[str, Callable[[argparse.ArgumentParser], None],
                          Callable[[argparse.Namespace], None]]] = {
    "isys": ("InnoSenT iSYS radars on a serial line", _add_isys, _isys),
    "icotronic": ("ICOtronic accelerometers on a CAN bus, served by socketcand", _add_icotronic,
                  _icotronic),
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
