# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Values that commands carry: states, versions, the ADC configuration, texts and addresses."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

from driver_common.errors import FrameError, SettingError
from driver_common.text import printable_text

CLOCK = 38.4e6  # Hz, of the ADC


class NetworkState(IntEnum):
    """State of a node in the network (sections 10.2.3.1 and 10.2.4)."""

    FAILURE = 0
    ERROR = 1
    STANDBY = 2
    GRACEFUL_DEGRADATION_2 = 3
    GRACEFUL_DEGRADATION_1 = 4
    OPERATING = 5
    STARTUP = 6
    NO_CHANGE = 7


class CodeLocation(IntEnum):
    """Which program of a node runs (section 10.2.3.1)."""

    NO_CHANGE = 0
    BOOTLOADER = 1
    APPLICATION = 2
    RESERVED = 3


class State(NamedTuple):
    """What a node runs, and in which state."""

    location: CodeLocation
    state: NetworkState


@dataclass(frozen=True)
class NodeStatus:
    """Node status word (section 10.2.4); what only a stationary unit has is None for a sensor."""

    error: bool
    state: NetworkState
    radio_enabled: bool | None = None
    can_enabled: bool | None = None
    radio_connected: bool | None = None


@dataclass(frozen=True)
class ErrorStatus:
    """Error status word (section 10.2.5); transmission is Bluetooth for a sensor, else CAN."""

    transmission_failed: bool
    adc_overrun: bool | None = None


class EnergyTimes(NamedTuple):
    """Times of an energy mode in s: until it begins, and between two advertisements in it."""

    sleep: float
    advertisement: float


class PowerCycles(NamedTuple):
    """How often the power was switched on (resets count as well) and lost."""

    on: int
    off: int


class OperatingTime(NamedTuple):
    """Operating time in s."""

    since_reset: int
    since_first_power_on: int


class Version(NamedTuple):
    """Version of hardware or firmware."""

    major: int
    minor: int
    patch: int

    def __str__(self) -> str:
        """Return for example "2.1.10"."""
        return f"{self.major}.{self.minor}.{self.patch}"


class UsedSensors(NamedTuple):
    """Numbers of the sensors on the three channels; 0 in a write leaves the channel as it is."""

    x: int
    y: int
    z: int


class CalibrationElement(IntEnum):
    """What a calibration factor or measurement belongs to (sections 10.5.3.1 and 10.5.5.1)."""

    ACCELERATION = 0
    TEMPERATURE = 1
    VOLTAGE = 32
    GROUND = 96
    SUPPLY = 97
    REGULATED_POWER = 98
    AMPLIFIER_OUTPUT = 99


class CalibrationMethod(IntEnum):
    """What a calibration measurement does (section 10.5.5.1)."""

    RESERVED = 0
    ACTIVATE = 1
    DEACTIVATE = 2
    MEASURE = 3


class Signal(NamedTuple):
    """A test signal: shape 1 is a line, 2 a ramp (section 10.8.1)."""

    shape: int
    module: int
    content: bytes


ACQUISITION_TIMES = (1, 2, 3, 4, 8, 16, 32, 64, 128, 256)  # cycles, by code
OVERSAMPLING_RATES = tuple(1 << code for code in range(13))  # by code
REFERENCE_STEP = 0.05  # V
REFERENCE_VOLTAGES = (1.25, 1.65, 1.8, 2.1, 2.2, 2.5, 2.7, 3.3, 5.0, 6.6)
PRESCALERS = range(1, 128)


@dataclass(frozen=True)
class AdcConfiguration:
    """How the ADC samples (section 10.5.1); the default is what it has after a reset.

    Attributes:
        prescaler: Divider of the clock, 1 … 127.
        acquisition_time: Clock cycles in which the signal is taken, one of `ACQUISITION_TIMES`.
        oversampling_rate: Conversions that make a value, one of `OVERSAMPLING_RATES`.
        reference_voltage: In V, one of `REFERENCE_VOLTAGES`.
    """

    prescaler: int = 2
    acquisition_time: int = 8
    oversampling_rate: int = 64
    reference_voltage: float = 3.3

    @property
    def sample_rate(self) -> float:
        """Values per s, shared by the active channels (section 10.5.1.1.1)."""
        return CLOCK / ((self.prescaler + 1) * (self.acquisition_time + 13)
                        * self.oversampling_rate)

    def encode(self) -> bytes:
        """Return the four codes.

        Raises:
            SettingError: The ADC has no such value.
        """
        _require("prescaler", self.prescaler, PRESCALERS)
        _require("acquisition time", self.acquisition_time, ACQUISITION_TIMES)
        _require("oversampling rate", self.oversampling_rate, OVERSAMPLING_RATES)
        return bytes((self.prescaler, ACQUISITION_TIMES.index(self.acquisition_time),
                      OVERSAMPLING_RATES.index(self.oversampling_rate),
                      reference_code(self.reference_voltage)))

    @classmethod
    def decode(cls, data: bytes) -> AdcConfiguration:
        """Return what four codes say.

        Raises:
            FrameError: A code means nothing.
        """
        prescaler, acquisition, oversampling, reference = unpack_exactly(data, "BBBB")
        try:
            return cls(prescaler, ACQUISITION_TIMES[acquisition], OVERSAMPLING_RATES[oversampling],
                       reference / 20)
        except IndexError:
            raise FrameError(f"ADC configuration {data.hex(' ').upper()} makes no sense") from None


def reference_code(voltage: float) -> int:
    """Return the code of a reference voltage in V; raises SettingError where there is none."""
    _require("reference voltage", voltage, REFERENCE_VOLTAGES)
    return round(voltage / REFERENCE_STEP)


def _require(what: str, value: float, allowed: Sequence[float]) -> None:
    if value not in allowed:
        shown = (f"{allowed[0]} … {allowed[-1]}" if isinstance(allowed, range)
                 else ", ".join(f"{one:g}" for one in allowed))
        raise SettingError(f"the ADC has no {what} {value:g}, allowed is {shown}")


# --- bytes in and out ---

def unpack_exactly(data: bytes, form: str) -> tuple[int, ...]:
    """Return the numbers in bytes of exactly that format; raises FrameError."""
    size = struct.calcsize(form)
    if len(data) != size:
        raise FrameError(f"answer carries {len(data)} bytes instead of {size}: "
                         f"{data.hex(' ').upper()}")
    return struct.unpack(form, data)


def decode_text(data: bytes) -> str:
    """Return the text in bytes that are padded with zeros (errata C13)."""
    return printable_text(data, "utf-8")


def encode_text(text: str, length: int) -> bytes:
    """Return a text as UTF-8, padded with zeros (errata C13).

    Raises:
        SettingError: The text is too long, holds a zero, or what is no UTF-8.
    """
    data = text.encode(errors="replace")
    if len(data) > length or b"\0" in data or data.decode() != text:
        raise SettingError(f'"{data.decode()}" does not fit, it may have at most {length} bytes in '
                           "UTF-8 and no zero")
    return data.ljust(length, b"\0")


def encode_mac(address: str) -> bytes:
    """Return the six bytes of a MAC address like "08:6B:D7:01:DE:81".

    Raises:
        SettingError: Not a MAC address.
    """
    parts = address.replace("-", ":").split(":")
    try:
        if len(parts) == 6 and all(len(part) == 2 for part in parts):
            return bytes(int(part, 16) for part in parts)
    except ValueError:
        pass
    raise SettingError(f'"{address}" is not a MAC address such as 08:6B:D7:01:DE:81')


def decode_mac(data: bytes) -> str:
    """Return the text of six bytes, like "08:6B:D7:01:DE:81"."""
    return data.hex(":").upper()
