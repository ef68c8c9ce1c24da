# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a search brings: sensors, and what is wrong or worth to be known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

from driver_common.advice import Advice
from driver_common.errors import DriverError
from driver_common.settings import Value
from sensor_tools.search.place import Place


@dataclass(frozen=True)
class Found:
    """A sensor, or a stationary unit.

    Attributes:
        family: "isys", "uc4000" or "icotronic".
        place: Where it is.
        model: What it is.
        address: Its address on the line, or its MAC address.
        rate: Baud rate in Bd or bit rate in bit/s.
        name: What it is called, "" where it has no name.
        serial_number: Its serial number, "" where it does not tell.
        firmware: Its firmware or version, "" where it does not tell.
        rssi: Strength of its radio signal in dBm; None where it is wired.
        parameters: The parameters of a node that name it, beside those of the place.
        is_sensor: Whether a node can be started for it.
    """

    family: str
    place: Place
    model: str
    address: str
    rate: int
    name: str = ""
    serial_number: str = ""
    firmware: str = ""
    rssi: int | None = None
    parameters: Mapping[str, Value] = field(default_factory=dict)
    is_sensor: bool = True

    def __str__(self) -> str:
        """Return model, address and rate for people."""
        name = f' "{self.name}"' if self.name else ""
        return f"{self.model}{name} at address {self.address}"


@dataclass(frozen=True)
class Finding:
    """Something that a search or the doctor has to say.

    Attributes:
        subject: The port, bus or node that it is about.
        check: What was looked at, in a word or two.
        cause: What is so.
        remedy: What to do about it.
        is_wrong: Whether something has to be done.
    """

    subject: str
    check: str
    cause: str
    remedy: str = ""
    is_wrong: bool = True

    @classmethod
    def of(cls, subject: object, check: str, advice: Advice, *, is_wrong: bool = True,
           **facts: object) -> Finding:
        """Return a finding in the words of the table."""
        return cls(str(subject), check, *advice.filled(**facts), is_wrong)

    @classmethod
    def of_error(cls, subject: object, error: DriverError) -> Finding:
        """Return a finding for an error of the link."""
        cause, _, remedy = str(error).partition("; ")
        return cls(str(subject), "link", cause, remedy)


Result: TypeAlias = Found | Finding


class Progress:
    """Is told how far a search is; does nothing by itself."""

    def expect(self, steps: int) -> None:
        """Take note that so many more steps will come."""

    def step(self, what: str) -> None:
        """Take note that a step begins."""
