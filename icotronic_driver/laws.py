# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the sensors on the channels measure: laws from the voltage at the ADC to a value.

Nothing about such a sensor is written down anywhere else.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from driver_common.errors import SettingError

ADC_MAX = 0xFFFF  # raw value of the ADC's reference voltage
USUAL_REFERENCE = 3.3  # V, the sensor's supply; calibration factors are made with it
STANDARD_GRAVITY = 9.80665  # m/s²
CELSIUS = "°C"
ACCELERATION_UNITS = {"g": STANDARD_GRAVITY, "m/s²": 1.0}  # each in m/s²

AUTO, DEVICE, LINEAR = "auto", "device", "linear"  # how a channel may get its law, but by a name


@dataclass(frozen=True)
class Law:
    """A linear law.

    Attributes:
        volts: Two voltages at the ADC in V.
        values: What the sensor measures at them.
        unit: Unit of the values.
    """

    volts: tuple[float, float]
    values: tuple[float, float]
    unit: str

    def __post_init__(self) -> None:
        """Check it; raises SettingError."""
        numbers = (*self.volts, *self.values)
        if len(numbers) != 4 or not all(map(math.isfinite, numbers)):
            raise SettingError(f"a law needs two volts and two values, not {numbers}")
        if self.volts[0] == self.volts[1] or self.values[0] == self.values[1]:
            raise SettingError(f"a law needs two different volts and values, not {self}")

    def __str__(self) -> str:
        """Return for example "0.1 … 1.7 V = -40 … 40 g"."""
        (low, high), (first, last) = self.volts, self.values
        return f"{low:g} … {high:g} V = {first:g} … {last:g} {self.unit}".rstrip()

    @property
    def is_acceleration(self) -> bool:
        """Whether it gives an acceleration."""
        return self.unit in ACCELERATION_UNITS

    def factors(self, reference: float) -> tuple[float, float]:
        """Return slope and offset: value = slope · raw + offset, an acceleration in m/s².

        Args:
            reference: Reference voltage of the ADC in V.
        """
        per_volt = (self.values[1] - self.values[0]) / (self.volts[1] - self.volts[0])
        size = ACCELERATION_UNITS.get(self.unit, 1.0)
        return (size * per_volt * reference / ADC_MAX,
                size * (self.values[0] - per_volt * self.volts[0]))


class Part(NamedTuple):
    """A sensor that a channel can measure.

    Attributes:
        name: Its name among the parameters.
        number: Its number in the standard STH, None where it is in another one.
        text: What it is, for people.
        law: What its voltage means.
    """

    name: str
    number: int | None
    text: str
    law: Law


_FULL = (0.0, 3.3)
PARTS = (  # field note N7
    Part("adxl1001_x", 1, "ADXL1001, x", Law((0.33, 2.97), (-100, 100), "g")),
    Part("adxl358c_y", 2, "ADXL358C, y", Law((0.1, 1.7), (-40, 40), "g")),
    Part("adxl358c_z", 3, "ADXL358C, z", Law((0.1, 1.7), (-40, 40), "g")),
    Part("adxl358c_x", 4, "ADXL358C, x", Law((0.1, 1.7), (-40, 40), "g")),
    Part("adxl358c_temperature", 5, "temperature of the ADXL358C",
         Law((0.772, 1.267), (-40, 125), CELSIUS)),
    Part("photodiode", 6, "photodiode", Law(_FULL, (0, 1), "")),
    Part("backpack_1", 7, "backpack 1", Law(_FULL, (0, 1), "")),
    Part("backpack_2", 8, "backpack 2", Law(_FULL, (0, 1), "")),
    Part("backpack_3", 9, "backpack 3", Law(_FULL, (0, 1), "")),
    Part("battery", 10, "battery", Law((0.509, 0.737), (2.9, 4.2), "V")),
    Part("rotation_78480", None, "rotational acceleration from two ADXL1001",
         Law((0.33, 2.97), (-78480, 78480), "rad/s²")),
    Part("rotation_61698", None, "rotational acceleration from two ADXL1001",
         Law((0.33, 2.97), (-61698.113, 61698.113), "rad/s²")),
)
PARTS_BY_NAME: Mapping[str, Part] = {part.name: part for part in PARTS}
PARTS_BY_NUMBER: Mapping[int, Part] = {
    part.number: part for part in PARTS if part.number is not None}
VOLTAGE = Law(_FULL, _FULL, "V")  # the voltage itself


@dataclass(frozen=True)
class ChannelOptions:
    """How a channel gets its law.

    Attributes:
        sensor: A name of `PARTS`, `AUTO` = by the number of the used sensor, `DEVICE` = by the
            device's calibration factors, `LINEAR` = by `law`.
        law: The user's own law.
    """

    sensor: str = AUTO
    law: Law = VOLTAGE


@dataclass(frozen=True)
class Calibration:
    """Calibration factors: raw 16-bit values to g, slope · raw + offset (section 8.2.1.4.1)."""

    slope: float
    offset: float

    @property
    def law(self) -> Law:
        """The same for any reference voltage."""
        return Law((0.0, USUAL_REFERENCE), (self.offset, self.offset + self.slope * ADC_MAX), "g")

    @property
    def fault(self) -> str:
        """What makes it unusable, "" where it is plausible (errata C9)."""
        if not (math.isfinite(self.slope) and math.isfinite(self.offset)):
            return f"slope {self.slope:g} and offset {self.offset:g} are not numbers"
        if self.slope == 0:
            return "the slope is zero"
        span = abs(self.slope) * ADC_MAX
        if not 0.5 <= span <= 20000:
            return f"a span of {span:.3g} g is absurd"
        if not 0 <= -self.offset / self.slope <= ADC_MAX:
            return f"zero g is not within the span (offset {self.offset:g} g, span {span:.3g} g)"
        return ""
