# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""One sensor on the wire: how it is to be used, what is known of it, and what was counted."""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import dataclass, field

from driver_common import clocks as time
from driver_common.device import RATE_WINDOW, Device, DeviceOptions, rate_of
from driver_common.settings import Raw
from uc4000_driver.commands import PROFILES, Distance, Outcome, Profile
from uc4000_driver.telegram import CAST

PRODUCT = "UC4000"
FIELD_OF_VIEW = 0.26  # rad, 15°: assumed, the manual only draws the cones (errata U12)


@dataclass(frozen=True)
class Identity:
    """Who a sensor says it is (sections 5.1.7 and 5.3.2)."""

    version: str
    serial_number: str

    def __str__(self) -> str:
        """Return product, serial number and version."""
        return f"{PRODUCT} {self.serial_number}, {self.version}"


@dataclass(frozen=True)
class Measurement:
    """A measured distance.

    Attributes:
        distance: What was found.
        profile: With which profile.
        stamp: The host's time in ns in the middle of the measurement.
    """

    distance: Distance
    profile: Profile
    stamp: int


@dataclass
class Statistics:
    """What was counted for one sensor since the start."""

    outcomes: Counter[Outcome] = field(default_factory=Counter)
    refusals: Counter[int] = field(default_factory=Counter)  # by error code
    timeouts: int = 0
    damaged: int = 0
    damaged_requests: int = 0


@dataclass
class Options(DeviceOptions):
    """How one sensor is to be used.

    Attributes:
        address: Its address; 0 = ask by cast.
        profile: Name of the measurement profile.
        cycles: Measurement cycles whose average is one measurement.
        rate: Measurements per second; 0 = as many as possible.
        temperature_period: Time in s between two readings of the temperature; 0 = none.
    """

    address: int = CAST
    profile: str = "b"
    cycles: int = 1
    rate: float = 0.0
    temperature_period: float = 10.0


class Sensor(Device):
    """One sensor on the wire: what is known of it, and what was counted.

    Attributes:
        options: How it is to be used.
        address: Its address, 0 while unknown.
        identity: Who it is; None while it is not connected.
        temperature: In °C; None while it was not read.
        acknowledged: What was written where nothing can be read, by the record's name.
        damages: Number of damaged telegrams in a row.
        is_punctual: Whether it answered in time when it last measured alone.
        temperature_due: Monotonic time in s at which to read the temperature.
    """

    options: Options

    def __init__(self, options: Options) -> None:
        """Begin as an unknown sensor."""
        super().__init__(options)
        self.address = options.address
        self.identity: Identity | None = None
        self.temperature: float | None = None
        self.acknowledged: dict[str, Raw] = {}
        self.damages = 0
        self.is_punctual = False
        self.statistics = Statistics()
        self.arrivals: deque[float] = deque()
        self.temperature_due = 0.0

    def __str__(self) -> str:
        """Return name and address for messages."""
        where = f"address {self.address}" if self.address else "sensor"
        return f"{self.options.name} ({where})" if self.options.name else where

    @property
    def is_connected(self) -> bool:
        """Whether it was found, identified and configured."""
        return self.identity is not None

    @property
    def product(self) -> str:
        """Name of what is connected."""
        return PRODUCT

    @property
    def profile(self) -> Profile:
        """The measurement profile."""
        return PROFILES[self.options.profile]

    @property
    def rate(self) -> float:
        """Measurements per second."""
        return rate_of(self.arrivals)

    @property
    def wants_temperature(self) -> bool:
        """Whether it is time to read the temperature."""
        return bool(self.options.temperature_period) and time.monotonic() >= self.temperature_due

    def count(self, outcome: Outcome) -> None:
        """Count a measurement."""
        now = time.monotonic()
        self.statistics.outcomes[outcome] += 1
        self.arrivals.append(now)
        while now - self.arrivals[0] > RATE_WINDOW:
            self.arrivals.popleft()

    def plan_next(self) -> None:
        """Keep the rate; do not catch up on what was missed."""
        now = time.monotonic()
        period = 1 / self.options.rate if self.options.rate else 0.0
        self.due = max(self.due + period, now) if self.due > now - period else now + period

    def forget(self) -> None:
        """Take note that the sensor is not connected any more."""
        super().forget()
        self.identity = None
        self.temperature = None
        self.acknowledged.clear()
        self.damages = 0
        self.is_punctual = False
        self.arrivals.clear()
        self.address = self.options.address
