# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The options that say where a sensor is and which one is meant, the same for all commands."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, TypeVar

import click

from driver_common.can_link import parse_options
from driver_common.errors import SettingError
from icotronic_driver.simulator.line import simulated_network
from isys_radar_driver.simulator.line import simulated_line as simulated_radars
from sensor_tools.families import FAMILIES
from sensor_tools.search.place import CanPlace, Place, SerialPlace
from uc4000_driver.simulator.line import simulated_line as simulated_ultrasonic_sensors

F = TypeVar("F", bound=Callable[..., Any])

SIMULATED, SIMULATED_CAN = "sim://", "sim"


@dataclasses.dataclass(frozen=True)
class Wanted:
    """Which sensor is meant, as far as the user says.

    Attributes:
        place: Where it is; None = anywhere.
        family: Its family, "" = any.
        address: Its address on the line, 0 = any.
        name: Its name on the radio, "" = any.
        mac: Its MAC address, "" = any.
        how: How it is to measure: options of its family and their values, as texts.
    """

    place: Place | None
    family: str = ""
    address: int = 0
    name: str = ""
    mac: str = ""
    how: Mapping[str, str] = dataclasses.field(default_factory=dict)


_OPTIONS: Sequence[Callable[[F], F]] = (
    click.option("--port", metavar="PORT", help="Serial port: a device path, a URL such as "
                                                "socket://host:port, or sim://MODEL."),
    click.option("--baud", type=click.IntRange(1), metavar="BD",
                 help="The only baud rate to try."),
    click.option("--can", metavar="CHANNEL",
                 help="CAN channel such as can0, or sim."),
    click.option("--can-interface", default="socketcan", show_default=True, metavar="NAME",
                 help="Interface of python-can."),
    click.option("--can-bitrate", type=click.IntRange(1), default=1_000_000, show_default=True,
                 metavar="BIT/S", help="Bit rate of the bus."),
    click.option("--can-option", multiple=True, metavar="NAME=VALUE",
                 help="Further option of the interface, such as host=127.0.0.1."),
    click.option("--family", type=click.Choice([*FAMILIES]), default=None,
                 help="Only sensors of this family."),
)
_MEASURING: Sequence[Callable[[F], F]] = (
    click.option("--with", "how", multiple=True, metavar="OPTION=VALUE",
                 help="How to measure, such as channels=xyz, profile=a or output=2: parameters of "
                      "the node."),
)
_ONE_SENSOR: Sequence[Callable[[F], F]] = (
    click.option("--address", type=click.IntRange(1, 255), metavar="N",
                 help="Address on the line, where there are several."),
    click.option("--name", metavar="NAME", help="Name of a sensor on the radio."),
    click.option("--mac", metavar="MAC", help="MAC address of a sensor on the radio."),
)


def place_options(*, one_sensor: bool = True, measuring: bool = False) -> Callable[[F], F]:
    """Return the decorator that adds the options to a command; it gets a `Wanted` as `wanted`."""
    options = (*_OPTIONS, *(_ONE_SENSOR if one_sensor else ()),
               *(_MEASURING if measuring else ()))

    def decorate(command: F) -> F:
        @functools.wraps(command)
        def run(**given: Any) -> Any:
            with _wanted(given) as wanted:
                return command(wanted=wanted, **given)

        for option in reversed(options):
            run = option(run)
        return run  # type: ignore[return-value]

    return decorate


@contextlib.contextmanager
def _wanted(given: dict[str, Any]) -> Iterator[Wanted]:
    """Take the options out of what is given, and start the simulator that they may ask for."""
    port, baud, channel = given.pop("port"), given.pop("baud"), given.pop("can")
    interface, bitrate = given.pop("can_interface"), given.pop("can_bitrate")
    options = given.pop("can_option")
    parse_options(options)
    if port and channel:
        raise click.UsageError("give --port or --can, not both")
    with contextlib.ExitStack() as stack:
        place: Place | None = None
        if port:
            place = SerialPlace(_simulated_port(port, stack), baud or 0)
        elif channel == SIMULATED_CAN:
            place = _simulated_bus(stack)
        elif channel:
            place = CanPlace(channel, interface, bitrate, options)
        yield Wanted(place, given.pop("family") or "", given.pop("address", None) or 0,
                     given.pop("name", None) or "", (given.pop("mac", None) or "").upper(),
                     dict(map(split_assignment, given.pop("how", ()))))


def _simulated_port(port: str, stack: contextlib.ExitStack) -> str:
    """Return the port of a simulator where that was asked for, else the port."""
    if not port.startswith(SIMULATED):
        return port
    model = port.removeprefix(SIMULATED)
    line = (simulated_ultrasonic_sensors(product=model) if model.lower().startswith("uc")
            else simulated_radars([model]))[0]
    stack.callback(line.close)
    return line.start().port


def _simulated_bus(stack: contextlib.ExitStack) -> CanPlace:
    server = simulated_network().start()
    stack.callback(server.close)
    return CanPlace("can0", "socketcand", options=(f"host={server.host}", f"port={server.port}"))


def split_assignment(text: str) -> tuple[str, str]:
    """Return name and value of "NAME=VALUE"; raises UsageError."""
    name, separator, value = text.partition("=")
    if not separator or not name or not value:
        raise click.UsageError(f"{text!r} is not like output1.range_max=25")
    return name, value


def require_place(wanted: Wanted) -> Place:
    """Return the place; raises SettingError where none is given."""
    if wanted.place is None:
        raise SettingError("which sensor? give --port or --can; 'sensors scan' shows all of them")
    return wanted.place
