# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The families of sensors in one table: how each is looked for, reached, and told what to do."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from driver_common.errors import SettingError
from driver_common.settings import Parameter, Value
from icotronic_driver.line import Line as CanLine
from icotronic_driver.sensor import Options as SthOptions
from icotronic_driver.sensor import Sensor as Sth
from icotronic_driver.session import IcotronicBus
from isys_radar_driver import commands as isys_commands
from isys_radar_driver.radar import Options as RadarOptions
from isys_radar_driver.radar import Radar
from isys_radar_driver.session import RadarBus
from sensor_tools import measurements
from sensor_tools.measurements import Take
from sensor_tools.search import icotronic, isys, uc4000
from sensor_tools.search.place import CanPlace, SerialPlace
from sensor_tools.search.result import Found, Progress, Result
from uc4000_driver.commands import MAX_CYCLES, PROFILES
from uc4000_driver.sensor import Options as UltrasonicOptions
from uc4000_driver.sensor import Sensor as Ultrasonic
from uc4000_driver.session import Uc4000Bus

Bus: TypeAlias = Any  # a session; what they have in common is in DeviceBus
Device: TypeAlias = Any
Options: TypeAlias = Mapping[str, Value]


@dataclass(frozen=True)
class Family:
    """A family of sensors.

    Attributes:
        name: Its name on the command line.
        node: The name of its node, and of its launch file.
        title: What it is.
        search: Yields the sensors of a place, and what is wrong there.
        make_bus: Returns a session with a sensor that was found, which leaves its settings as they
            are. What is measured goes to the second argument; the third has values of `options`.
        look: Reads who a sensor is and its settings, without anything else, on an open bus; None
            where `connect` does no more than that.
        identity: Returns what a connected sensor says of itself, by name.
        options: How it can measure, named as the parameters of its node.
        columns: Returns what a measurement of a connected sensor consists of: name and unit.
        save: Has the sensor keep its settings; returns what was done.
        change_address: Gives the sensor another address, for good.
        factory_reset: Restores the factory settings.
    """

    name: str
    node: str
    title: str
    search: Callable[[Any, Progress], Iterator[Result]]
    make_bus: Callable[[Found, Take, Options], Bus]
    look: Callable[[Bus, Device], None] | None
    identity: Callable[[Device], Mapping[str, object]]
    options: Mapping[str, Parameter]
    columns: Callable[[Device], Mapping[str, str]]
    save: Callable[[Bus, Device], str]
    change_address: Callable[[Bus, Device, int], None]
    factory_reset: Callable[[Bus, Device], None]


def _by_name(*options: Parameter) -> Mapping[str, Parameter]:
    return {option.name: option for option in options}


# --- iSYS ---

_RADAR_OPTIONS = _by_name(Parameter("output", kind=int, minimum=1, maximum=3))


def _radar_bus(found: Found, take: Take, values: Options) -> RadarBus:
    assert isinstance(found.place, SerialPlace)
    options = RadarOptions(address=int(found.address), config_mode="leave",
                           **values)  # type: ignore[arg-type]
    return RadarBus(found.place.port, found.rate, [options], measurements.RadarListener(take))


def _look_at_radar(bus: RadarBus, radar: Radar) -> None:
    """Read without the stop that a connection begins with: it may measure by itself."""
    radar.identity = isys.identify(bus.line, radar.address)
    bus.connection.read_all(radar)


def _radar_identity(radar: Radar) -> Mapping[str, object]:
    identity = radar.identity
    assert identity is not None
    return {"model": identity.model.name, "serial number": identity.serial_number,
            "device name": identity.device_name, "firmware": identity.firmware,
            "cycle time [s]": radar.cycle_time}


def _save_radar(bus: RadarBus, radar: Radar) -> str:
    names = bus.maintenance.save(radar, isys_commands.SAVE_ALL_SETTINGS)
    lost = bus.maintenance.unsaved(radar, isys_commands.SAVE_ALL_SETTINGS, possible=False)
    saved = "saved in its EEPROM" + (f": {', '.join(names)}" if names else "")
    return saved + (f"; it cannot store {', '.join(lost)}" if lost else "")


# --- UC4000 ---

_ULTRASONIC_OPTIONS = _by_name(
    Parameter("profile", kind=str, choices=dict.fromkeys(PROFILES, 0)),
    Parameter("cycles", kind=int, minimum=1, maximum=MAX_CYCLES),
    Parameter("rate", kind=float, unit="Hz", minimum=0.0, maximum=20.0))


def _ultrasonic_bus(found: Found, take: Take, values: Options) -> Uc4000Bus:
    assert isinstance(found.place, SerialPlace)
    options = UltrasonicOptions(address=int(found.address), config_mode="leave",
                                **values)  # type: ignore[arg-type]
    return Uc4000Bus(found.place.port, [options], measurements.UltrasonicListener(take))


def _ultrasonic_identity(sensor: Ultrasonic) -> Mapping[str, object]:
    assert sensor.identity is not None
    return {"model": sensor.product, "serial number": sensor.identity.serial_number,
            "version": sensor.identity.version}


# --- ICOtronic ---

_STH_OPTIONS = _by_name(
    Parameter("channels", kind=str,
              choices=dict.fromkeys(("x", "y", "z", "xy", "xz", "yz", "xyz"), 0)))


def _sth_bus(found: Found, take: Take, values: Options) -> IcotronicBus:
    place = found.place
    assert isinstance(place, CanPlace)
    options = SthOptions(sensor_mac=found.address, config_mode="leave",
                         **values)  # type: ignore[arg-type]
    return IcotronicBus(CanLine(place.interface, place.channel, place.bitrate, place.options),
                        options, measurements.SthListener(take))


def _sth_identity(sensor: Sth) -> Mapping[str, object]:
    units = {"sensor": sensor.identity, "stationary unit": sensor.stu_identity}
    return {f"{unit}: {name.replace('_', ' ')}": value for unit, identity in units.items()
            if identity is not None for name, value in vars(identity).items()
            if value not in (None, "")} | {"samples per second": sensor.sample_rate}


def _save_sth(bus: IcotronicBus, sensor: Sth) -> str:
    if not sensor.unsaved:
        raise SettingError("nothing was changed since the sensor was connected; its EEPROM can "
                           "take changes only in the same run, so use 'sensors set --save'")
    fields = bus.maintenance.save()
    names = ", ".join(field.name for field in fields)
    return f"saved in its EEPROM: {names}" if names else "its EEPROM holds all of it already"


def _has_not(what: str) -> Callable[..., Any]:
    def refuse(*_: object) -> None:
        raise SettingError(f"this sensor has no {what}")

    return refuse


FAMILIES: Mapping[str, Family] = {family.name: family for family in (
    Family("uc4000", "uc4000", "Pepperl+Fuchs UC4000 ultrasonic sensor", uc4000.search,
           _ultrasonic_bus, None, _ultrasonic_identity, _ULTRASONIC_OPTIONS,
           lambda sensor: measurements.ULTRASONIC_COLUMNS,
           lambda bus, sensor: "a UC4000 keeps every setting at once; there is nothing to save",
           lambda bus, sensor, address: bus.maintenance.change_address(sensor, address),
           _has_not("command that restores its factory settings")),
    Family("isys", "isys_radar", "InnoSenT iSYS radar", isys.search, _radar_bus, _look_at_radar,
           _radar_identity, _RADAR_OPTIONS, lambda radar: measurements.RADAR_COLUMNS, _save_radar,
           lambda bus, radar, address: bus.maintenance.change_address(radar, address),
           lambda bus, radar: bus.maintenance.restore_factory_settings(radar)),
    Family("icotronic", "icotronic", "ICOtronic wireless accelerometer", icotronic.search,
           _sth_bus, None, _sth_identity, _STH_OPTIONS, measurements.sth_columns, _save_sth,
           _has_not("address; 'sensors set name=…' gives it another name"),
           _has_not("command that restores its factory settings")),
)}
SERIAL = ("uc4000", "isys")  # in this order: a radar keeps quiet at the rate of the others


def search(place: SerialPlace | CanPlace, families: Iterable[Family],
           progress: Progress) -> list[Result]:
    """Return what is at a place: what the search for the first family that is there brings.

    Where nobody answers it is what all of them bring.

    Raises:
        LinkError: The port or the bus failed.
    """
    everything: list[Result] = []
    for family in families:
        results = list(family.search(place, progress))
        if any(isinstance(one, Found) for one in results):
            return results
        everything += [one for one in results if one not in everything]
    return everything


def families_of(place: SerialPlace | CanPlace, only: str = "") -> list[Family]:
    """Return the families that can be at a place; raises SettingError where `only` cannot."""
    names = SERIAL if isinstance(place, SerialPlace) else ("icotronic",)
    if only and only not in names:
        raise SettingError(f"an {only} sensor is not on {place}: give "
                           f"{'--can' if only == 'icotronic' else '--port'}")
    return [FAMILIES[name] for name in names if only in ("", name)]
