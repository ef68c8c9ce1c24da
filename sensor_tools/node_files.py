# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What nodes need for sensors that a scan found: parameter files, launch commands, a udev rule."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path

from serial.tools import list_ports

from driver_common.errors import DriverError
from driver_common.settings import Value
from sensor_tools.families import FAMILIES
from sensor_tools.search.place import Place, SerialPlace
from sensor_tools.search.result import Found

PACKAGE = "industrial_sensor_drivers"
RULES = "99-industrial-sensors.rules"


def write_files(directory: Path, found: Sequence[Found]) -> Iterator[str]:
    """Write a parameter file per line or sensor and the udev rules; yield what to do with each.

    Raises:
        DriverError: A file cannot be written.
    """
    groups = _groups([one for one in found if one.is_sensor])
    try:
        directory.mkdir(parents=True, exist_ok=True)
        for name, sensors in groups.items():
            file = directory / f"{name}.yaml"
            file.write_text(parameter_file(sensors), encoding="utf-8")
            yield launch_command(name, file, sensors[0])
        rules = [rule for name, sensors in groups.items()
                 if (rule := udev_rule(sensors[0].place, name))]
        if rules:
            (directory / RULES).write_text("\n".join(rules) + "\n", encoding="utf-8")
            yield (f"sudo cp {directory / RULES} /etc/udev/rules.d/ && sudo udevadm control "
                   "--reload && sudo udevadm trigger")
    except OSError as error:
        raise DriverError(f"cannot write {error.filename}: {error.strerror}") from None


def _groups(found: Sequence[Found]) -> dict[str, list[Found]]:
    """Return the sensors that one node serves, by a name for it: a line, or one on the radio."""
    groups: dict[str, list[Found]] = {}
    for (family, _, _), members in groupby(found, key=lambda one: (
            one.family, str(one.place), one.address if one.rssi is not None else "")):
        base = FAMILIES[family].node
        name, number = base, 1
        while name in groups:
            number += 1
            name = f"{base}_{number}"
        groups[name] = list(members)
    return groups


def parameter_file(sensors: Sequence[Found]) -> str:
    """Return a parameter file for the sensors of one node."""
    values: dict[str, Value] = dict(sensors[0].place.parameters)
    if len(sensors) == 1:
        values |= sensors[0].parameters
    else:
        names = [f"sensor_{one.address}" for one in sensors]
        values["sensors"] = names
        for name, one in zip(names, sensors, strict=True):
            values |= {key if key == "serial_baud" else f"{name}.{key}": value
                       for key, value in one.parameters.items()}
    lines = [f"# {one.model}, serial number {one.serial_number or 'unknown'}, address "
             f"{one.address}" for one in sensors]
    lines += ["/**:", "  ros__parameters:",
              *(f"    {name}: {json.dumps(value)}" for name, value in values.items())]
    return "\n".join(lines) + "\n"


def launch_command(name: str, file: Path, found: Found) -> str:
    """Return the command that starts the node."""
    return (f"ros2 launch {PACKAGE} {FAMILIES[found.family].node}.launch.py name:={name} "
            f"params_file:={file.resolve()}")


def udev_rule(place: Place, name: str) -> str:
    """Return the rule that calls an adapter /dev/NAME wherever it is plugged in, "" for others."""
    if not isinstance(place, SerialPlace):
        return ""
    device = str(Path(place.port).resolve())
    info = next((info for info in list_ports.comports() if info.device == device), None)
    if info is None or info.vid is None or info.pid is None:
        return ""
    socket, _, interface = (info.location or "").partition(":")  # the latter only of several
    which = (f'ATTRS{{serial}}=="{info.serial_number}"' if info.serial_number
             else f'KERNELS=="{socket}"')  # without a number: this socket
    if interface:  # udev compares ATTRS and KERNELS with one and the same device: the adapter
        which += f', ENV{{ID_USB_INTERFACE_NUM}}=="{int(interface.rpartition(".")[2]):02x}"'
    return (f'SUBSYSTEM=="tty", ATTRS{{idVendor}}=="{info.vid:04x}", '
            f'ATTRS{{idProduct}}=="{info.pid:04x}", {which}, SYMLINK+="{name}"')
