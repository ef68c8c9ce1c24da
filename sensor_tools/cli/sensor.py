# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Reaching one sensor: find it, open a session with it, and leave it as it was."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator, Mapping

from driver_common import advice
from driver_common.errors import DriverError, FrameError, NoAnswerError, WrongDeviceError
from sensor_tools.cli.output import progress_bar
from sensor_tools.cli.places import Wanted, require_place
from sensor_tools.cli.values import value_of
from sensor_tools.families import FAMILIES, Bus, Device, Family, families_of, search
from sensor_tools.measurements import Take, ignore
from sensor_tools.search.result import Finding, Found

ATTEMPTS = 3
REACH_TIME = 30.0  # s in which a sensor must be connected; by radio it can take 20


class Session:
    """An open session with one sensor.

    Attributes:
        family: Its family.
        found: How it was found.
        bus: The session.
        device: The sensor, the only one of the session.
    """

    def __init__(self, found: Found, take: Take, how: Mapping[str, str]) -> None:
        """Open the bus; raises DriverError."""
        self.found = found
        self.family: Family = FAMILIES[found.family]
        options = {name: value_of(self.family.options, name, text) for name, text in how.items()}
        self.bus: Bus = self.family.make_bus(found, take, options)
        self.device: Device = self.bus.devices[0]
        self.bus.open()

    def look(self) -> None:
        """Read who the sensor is and its settings, and nothing else; raises DriverError."""
        if self.family.look is None:
            self.connect()
        else:
            self.family.look(self.bus, self.device)

    def connect(self) -> None:
        """Connect the sensor as a node does, but with its settings as they are.

        Raises:
            DriverError: It does not answer any more.
        """
        end = time.monotonic() + REACH_TIME
        errors: list[DriverError] = []  # it was found just now, so one may be a mishap
        while not self.device.is_connected:
            pause = self.bus.poll()
            error = self.device.error
            if error is not None and error not in errors:
                errors.append(error)
                if len(errors) == ATTEMPTS or not isinstance(error, (NoAnswerError, FrameError)):
                    raise error
            if time.monotonic() > end:
                raise NoAnswerError(f"{self.found} does not connect")
            time.sleep(0.0 if self.device.is_connected else pause)


@contextlib.contextmanager
def session(wanted: Wanted, take: Take = ignore) -> Iterator[Session]:
    """Yield a session with the sensor that is meant; closed at last. Raises DriverError."""
    one = Session(find(wanted), take, wanted.how)
    try:
        yield one
    finally:
        one.bus.close()


def find(wanted: Wanted) -> Found:
    """Return the sensor that is meant.

    Raises:
        DriverError: There is none, or there are several.
    """
    place = require_place(wanted)
    with progress_bar() as progress:
        results = search(place, families_of(place, wanted.family), progress)
    found = [one for one in results if isinstance(one, Found) and one.is_sensor]
    fitting = [one for one in found if _fits(one, wanted)]
    if len(fitting) == 1:
        return fitting[0]
    if len(fitting) > 1:
        several = "; ".join(map(str, fitting))
        which = "--name or --mac" if fitting[0].rssi is not None else "--address"
        raise WrongDeviceError(f"several sensors answer on {place} ({several}); say which one "
                               f"with {which}")
    if found:
        there = "; ".join(map(str, found))
        raise WrongDeviceError(f"on {place} there is no such sensor, but {there}")
    wrong = [f"{one.cause}; {one.remedy}".rstrip("; ") for one in results
             if isinstance(one, Finding) and one.is_wrong]
    raise NoAnswerError(f"no sensor answers on {place}; "
                        + ("; ".join(wrong) or advice.SILENCE_RS485.text()))


def _fits(found: Found, wanted: Wanted) -> bool:
    return (wanted.address in (0, _number(found.address))
            and wanted.name in ("", found.name) and wanted.mac in ("", found.address.upper()))


def _number(address: str) -> int:
    return int(address) if address.isdecimal() else -1
