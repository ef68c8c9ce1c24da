# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The 16 iSYS models as data: what each one has, and how it is reached.

A model names the manual's sections that it supports (section 4.3); commands and settings carry
the section they are described in, and so a model has exactly those.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, field
from types import MappingProxyType
from typing import Protocol

from driver_common.errors import SettingError, WrongDeviceError
from driver_common.settings import suggestion
from isys_radar_driver.targets import Resolution

FAST, MULTI_TARGET = 0, 1  # measurement modes, table 12
RANGE_BOUND = "I34"  # in place of a section: no revision of the manual has it, some firmware does


class HasSection(Protocol):
    """A command or a setting."""

    @property
    def section(self) -> str:
        """Section of the manual."""


@dataclass(frozen=True)
class Model:
    """One model.

    Attributes:
        name: Name as printed, for example "iSYS-4001".
        sections: Sections of the manual which it supports (section 4.3).
        address: Default address (table 1).
        baud_rate: Default baud rate in Bd (table 2).
        cycle_times: Cycle time in s for each measurement mode (tables 6 and 12).
        timeout: Recommended smallest time-out of a target list in s (table 6).
        resolutions: Target lists that it can send (table 27); none for the 5xxx (errata I22).
        range_step_16: Range step of a 16-bit target list in m (errata I6).
        max_targets: Most targets in a list for each measurement mode (sections 3.3.4.4, 3.3.7).
        frequency_channels: Number of frequency channels (table 11).
        first_firmware_with_all_channels: Older firmware has four channels (table 11).
        range_max: Largest range limit in m (table 14); 0 = it measures no range.
        signal_max: Largest signal limit in dB (table 14).
        velocity_max: Largest velocity limit in m/s (table 14); 0 = it measures no velocity.
        measures_angle: Whether the angles of its targets are measured, not a placeholder.
        raw_as_float: Whether raw signals are float32 (section 4.3, iSYS-6004).
    """

    name: str
    sections: frozenset[str]
    _: KW_ONLY
    address: int = 128
    baud_rate: int = 115200
    cycle_times: Mapping[int, float]
    timeout: float
    resolutions: tuple[Resolution, ...] = (Resolution.BITS_32, Resolution.BITS_16)
    range_step_16: float = 0.01
    max_targets: Mapping[int, int] = field(default_factory=lambda: MappingProxyType({FAST: 35}))
    frequency_channels: int = 1
    first_firmware_with_all_channels: float = 0.0
    range_max: float = 0.0
    signal_max: float = 250.0
    velocity_max: float = 0.0
    measures_angle: bool = False
    raw_as_float: bool = False

    @property
    def product_code(self) -> int:
        """The number that identifies the model (errata I23)."""
        return int(self.name.rpartition("-")[2])

    @property
    def measures_range(self) -> bool:
        """Whether its targets have a range."""
        return self.range_max > 0

    @property
    def measures_velocity(self) -> bool:
        """Whether its targets have a velocity."""
        return self.velocity_max > 0

    @property
    def has_target_lists(self) -> bool:
        """Whether the model hands out target lists over serial (errata I22)."""
        return bool(self.resolutions)

    def supports(self, what: HasSection) -> bool:
        """Whether the model has this command or setting."""
        return what.section in self.sections

    def cycle_time(self, mode: int) -> float:
        """Return the cycle time in s in a measurement mode."""
        return self.cycle_times.get(mode, next(iter(self.cycle_times.values())))

    def resolutions_of(self, bits: int) -> tuple[Resolution, ...]:
        """Return the resolutions with 16 or 32 bit; with 0, all.

        Raises:
            SettingError: There is none.
        """
        possible = tuple(resolution for resolution in self.resolutions
                         if not bits or resolution.bits == bits)
        if self.has_target_lists and not possible:
            raise SettingError(f"{self.name} has no target lists of {bits} bit; set "
                               "target_list_resolution to auto")
        return possible

    def with_firmware(self, version: float) -> Model:
        """Return the model as it is with this firmware (table 11)."""
        if version < self.first_firmware_with_all_channels:
            return dataclasses.replace(self, frequency_channels=4)
        return self


_COMMON = "3.3.2 3.3.3.1 3.3.4.1 3.3.4.2 3.3.6.1 3.3.6.2 3.3.6.3 3.3.6.4 3.3.6.5 "
_OUTPUTS = "3.3.5.2 3.3.5.3 3.3.5.4 3.3.5.5 3.3.5.8 3.3.5.11 3.3.5.12 3.3.5.13 "
_MEASURES = "3.3.4.3 3.3.7 3.3.9.1 3.3.9.2 "
_BOARD_TEMPERATURES = "3.3.3.3 3.3.3.4 "
_SENSITIVITY, _LED = "3.3.4.5 ", "3.3.4.9 "
_MODE, _INTERFACE, _IP = "3.3.4.4 ", "3.3.4.8 ", "3.3.4.6 3.3.4.7 "
_LINE_FILTER, _POTENTIOMETER, _DIGITAL_OUTPUTS = "3.3.5.1 ", "3.3.5.16 ", "3.3.8 "
_RANGE, _RANGE_EXTENDED, _VELOCITY = "3.3.5.7 ", "3.3.5.14 ", "3.3.5.9 3.3.5.10 "
_WARNINGS = "3.3.3.2 3.3.5.15 3.3.5.17 3.3.5.18 3.3.5.19 3.3.5.20 "  # iSYS-6203 only
_TRAFFIC = "3.3.5.21 3.3.5.22 3.3.5.23 3.3.5.24 3.3.5.25 "
_STOP_BAR = "3.3.5.26 3.3.5.27 3.3.5.28 "
_RAW, _RANGE_LIST = "3.3.10 ", "3.3.11 "

_4XXX = _COMMON + _MEASURES + _OUTPUTS + _SENSITIVITY + _POTENTIOMETER + _DIGITAL_OUTPUTS
_400X = _4XXX + _LED + _LINE_FILTER + _RANGE + _VELOCITY
_6XXX = _COMMON + _MEASURES + _OUTPUTS + _MODE + _RANGE + _RAW
_600X = _6XXX + _RANGE_EXTENDED + _RANGE_LIST


def _model_4xxx(name: str, sections: str, cycle_time: float, timeout: float,
                **more: object) -> Model:
    more = {"frequency_channels": 8, "first_firmware_with_all_channels": 1.310} | more
    return Model(name, frozenset(sections.split()), cycle_times={FAST: cycle_time},
                 timeout=timeout, **more)  # type: ignore[arg-type]


def _model_5xxx(name: str, sections: str) -> Model:
    return Model(name, frozenset(sections.split()), address=100, cycle_times={FAST: 0.100},
                 timeout=0.110, resolutions=(), frequency_channels=2)


def _model_6xxx(name: str, sections: str = _600X, *, range_max: float = 20.0,
                cycle_times: Mapping[int, float] = MappingProxyType(
                    {FAST: 0.050, MULTI_TARGET: 0.200}),
                timeout: float = 0.220, **more: object) -> Model:
    more = {"resolutions": (Resolution.BITS_32,), "max_targets": {FAST: 1, MULTI_TARGET: 30}} | more
    return Model(name, frozenset(sections.split()), address=100, cycle_times=cycle_times,
                 timeout=timeout, range_max=range_max, signal_max=255.0,
                 **more)  # type: ignore[arg-type]


MODELS: Mapping[str, Model] = MappingProxyType({model.name: model for model in (
    _model_4xxx("iSYS-4001", _400X + RANGE_BOUND, 0.075, 0.100, range_max=150.0,
                velocity_max=70.0, measures_angle=True),
    _model_4xxx("iSYS-4002", _400X, 0.075, 0.100, range_max=150.0, velocity_max=70.0,
                measures_angle=True),
    _model_4xxx("iSYS-4003", _400X, 0.300, 0.330, range_max=50.0, velocity_max=12.5,
                measures_angle=True, baud_rate=9600),
    _model_4xxx("iSYS-4004", _4XXX + _LINE_FILTER + _RANGE, 0.075, 0.100, range_max=35.0,
                range_step_16=0.001, frequency_channels=3, first_firmware_with_all_channels=0.0),
    _model_4xxx("iSYS-4013", _4XXX + _LINE_FILTER + _VELOCITY, 0.750, 0.825, velocity_max=12.5,
                baud_rate=57600),
    _model_5xxx("iSYS-5010", _COMMON + _TRAFFIC),
    _model_5xxx("iSYS-5011", _COMMON),
    _model_5xxx("iSYS-5020", _COMMON + _TRAFFIC + _BOARD_TEMPERATURES + _INTERFACE),
    _model_5xxx("iSYS-5021", _COMMON + _BOARD_TEMPERATURES + _INTERFACE),
    _model_5xxx("iSYS-5110", _COMMON + _IP + _STOP_BAR),
    _model_6xxx("iSYS-6003", range_step_16=0.001),
    _model_6xxx("iSYS-6004", _6XXX + _SENSITIVITY + _RANGE_LIST, range_max=15.0,
                cycle_times={MULTI_TARGET: 1.200}, timeout=1.400, raw_as_float=True),
    _model_6xxx("iSYS-6005", _6XXX, cycle_times={FAST: 0.050}, timeout=0.070, baud_rate=230400,
                resolutions=(Resolution.BITS_32_FIXED,), max_targets={FAST: 30}),
    _model_6xxx("iSYS-6006", range_max=10.0, cycle_times={FAST: 0.015, MULTI_TARGET: 0.030},
                timeout=0.050, baud_rate=230400),
    _model_6xxx("iSYS-6007"),
    _model_6xxx("iSYS-6203", _600X + _WARNINGS),
)})

BAUD_RATES = tuple(dict.fromkeys(
    model.baud_rate for model in MODELS.values()))  # in the order in which they are tried


def find_model(name: str) -> Model:
    """Return the model with this name, with or without "iSYS-", in any case.

    Raises:
        WrongDeviceError: There is no such model.
    """
    for model in MODELS.values():
        if name.lower() in (model.name.lower(), str(model.product_code)):
            return model
    raise WrongDeviceError(f'"{name}" is not a known iSYS model{suggestion(name, MODELS)} '
                           f"(known are {', '.join(MODELS)})")


def model_of_product(product_code: int) -> Model:
    """Return the model with this product information (errata I23).

    Raises:
        WrongDeviceError: The product is not known.
    """
    model = MODELS.get(f"iSYS-{product_code}")
    if model is None:
        raise WrongDeviceError(f"a device with product information {product_code} answered, which "
                               f"is none of the known models ({', '.join(MODELS)})")
    return model
