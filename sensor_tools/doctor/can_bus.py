# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What can be wrong with a CAN bus and with the stationary unit and the sensors on it."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator, Mapping
from typing import Any

from driver_common import advice
from driver_common.errors import LinkError
from sensor_tools.cli.places import Wanted
from sensor_tools.families import FAMILIES
from sensor_tools.search.place import CanPlace
from sensor_tools.search.result import Finding, Found, Progress

IP_TIMEOUT = 5.0  # s


def examine(place: CanPlace, wanted: Wanted, progress: Progress) -> Iterator[Finding]:
    """Yield what is to be said about a bus; what is wrong comes with what to do."""
    controller = list(_examine_controller(place))
    yield from controller
    found: list[Found] = []
    try:
        for result in FAMILIES["icotronic"].search(place, progress):
            if isinstance(result, Finding):
                yield result
            elif result.is_sensor:
                found.append(result)
            else:
                yield Finding(str(place), "stationary unit", f"{result}", is_wrong=False)
    except LinkError as error:
        yield Finding.of_error(place, error)
        return
    yield from _compare(place, wanted, found)


def _compare(place: CanPlace, wanted: Wanted, found: list[Found]) -> Iterator[Finding]:
    """Yield the sensors in range, and whether the wanted one is among them."""
    for one in found:
        yield Finding(str(place), "in range", f"{one}, {one.rssi} dBm", is_wrong=False)
    if found and not any(wanted.name in ("", one.name) and wanted.mac in ("", one.address.upper())
                         for one in found):
        yield Finding.of(place, "in range", advice.NOT_IN_RANGE,
                         which=f" {wanted.name or wanted.mac}",
                         in_range="; ".join(map(str, found)))


def _examine_controller(place: CanPlace) -> Iterator[Finding]:
    """Yield what `ip` tells of bit rate and state of a channel of the kernel."""
    if place.interface != "socketcan":
        return
    data = _channel_data(place.channel)
    bitrate = data.get("bittiming", {}).get("bitrate")
    if data.get("state") == "BUS-OFF":
        yield Finding.of(place, "controller", advice.BUS_OFF)
    elif bitrate and bitrate != place.bitrate:
        yield Finding.of(place, "bit rate", advice.WRONG_BIT_RATE, present=bitrate,
                         channel=place.channel, bitrate=place.bitrate)
    elif bitrate:
        yield Finding(str(place), "bit rate", f"{bitrate} bit/s", is_wrong=False)


def _channel_data(channel: str) -> Mapping[str, Any]:
    """Return what the kernel says of a CAN channel, nothing where it cannot be asked."""
    try:
        done = subprocess.run(["ip", "-json", "-details", "link", "show", "dev", channel],
                              capture_output=True, timeout=IP_TIMEOUT, check=True)
        (link,) = json.loads(done.stdout)
        data: Mapping[str, Any] = link["linkinfo"]["info_data"]
    except (OSError, subprocess.SubprocessError, ValueError, KeyError, TypeError):
        return {}
    return data
