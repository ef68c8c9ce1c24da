# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Commands of the iSYS protocol (sections 3.3.2 to 3.3.12): requests, and what replies mean."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, dataclass
from enum import IntEnum
from typing import Any, Generic, TypeVar

import numpy as np
import numpy.typing as npt

from driver_common.errors import FrameError, SettingError
from driver_common.settings import Raw, Record
from driver_common.text import printable_text
from isys_radar_driver.frames import (
    FIRST_ADDRESS,
    LAST_ADDRESS,
    MASTER,
    READ_RAW_SIGNALS,
    READ_TARGET_LIST,
    Frame,
)
from isys_radar_driver.targets import Resolution

T = TypeVar("T")

READ_SENSOR, READ_APPLICATION = 0xD2, 0xD4  # the code to write is one more
SENSOR_ADDRESS = 0x0001
NO_BOOTLOADER = 0xFFFF


class Location(IntEnum):
    """Where a setting is read from or written to."""

    RAM = 0
    EEPROM = 1  # a write goes to the RAM as well


@dataclass(frozen=True)
class Version:
    """A version: major number, number of decimal places, minor number (section 3.3.6.1)."""

    major: int
    places: int
    minor: int

    def __str__(self) -> str:
        """Return for example "1.309"."""
        if self.major == NO_BOOTLOADER:
            return "none"
        return f"{self.major}.{self.minor:0{min(self.places, 9)}d}"

    @property
    def number(self) -> float:
        """The version as a decimal number, to compare by."""
        return float(str(self)) if self.major != NO_BOOTLOADER else 0.0


@dataclass(frozen=True)
class RangeList:
    """Range list of one measurement (tables 38 and 39).

    Range, standard deviation, variance, minimum and maximum in m (the variance is sent in
    micrometres like the others), amplitude in dB, temperature in °C.
    """

    range: float
    amplitude: float
    temperature: float
    standard_deviation: float
    variance: float
    minimum: float
    maximum: float


@dataclass(frozen=True)
class RawSignals:
    """Sampled signals of one measurement (section 3.3.10).

    Attributes:
        sample_time: Time between two samples in s.
        samples: Shape (signals, samples), int16 or float32.
    """

    sample_time: float
    samples: npt.NDArray[Any]


def _exactly(pdu: bytes, form: str) -> tuple[int, ...]:
    size = struct.calcsize(form)
    if len(pdu) != size:
        raise FrameError(f"reply carries {len(pdu)} bytes instead of {size}: {pdu.hex(' ')}")
    return struct.unpack(form, pdu)


def _nothing(pdu: bytes) -> None:
    _exactly(pdu, "")


def _text(pdu: bytes) -> str:
    return printable_text(pdu.split(b"\0", 1)[0].strip())


def _version(pdu: bytes) -> Version:
    return Version(*_exactly(pdu, ">HHH"))


def _number(pdu: bytes) -> int:
    return _exactly(pdu, ">H")[0]


def _thresholds_celsius(pdu: bytes) -> tuple[float, ...]:
    return tuple(raw * 0.01 for raw in _exactly(pdu, ">hhh"))


def _board_celsius(pdu: bytes) -> float:
    if len(pdu) < 2:
        raise FrameError(f"temperature of {len(pdu)} bytes is too short")
    return _exactly(pdu[:2], ">h")[0] * 0.01  # errata I12: more bytes can follow


def _outputs(pdu: bytes) -> tuple[int, ...]:
    return _exactly(pdu, ">hhh")


def _range_list(pdu: bytes) -> RangeList:
    distance, amplitude, temperature, *statistics = _exactly(pdu, ">ihh4i")  # errata I19
    return RangeList(distance * 1e-6, amplitude * 0.01, temperature * 0.01,
                     *(value * 1e-6 for value in statistics))


def _raw_signals(pdu: bytes) -> RawSignals:
    if len(pdu) < 7:
        raise FrameError(f"raw signals of {len(pdu)} bytes are too short")
    signals, blocks, size, microseconds = struct.unpack(">BBBI", pdu[:7])  # errata I18
    if signals * blocks == 0 or size not in (2, 4) or len(pdu) != 7 + signals * blocks * 16 * size:
        raise FrameError(f"raw signals of {len(pdu)} bytes do not hold {signals} signals of "
                         f"{blocks * 16} samples of {size} bytes")
    wire, native = (">i2", np.int16) if size == 2 else (">f4", np.float32)
    interleaved = np.frombuffer(pdu, wire, offset=7).reshape(-1, signals)
    return RawSignals(microseconds * 1e-6, np.ascontiguousarray(interleaved.T, native))


@dataclass(frozen=True)
class Command(Generic[T]):
    """A command: how it is asked, and how the reply is understood.

    Attributes:
        name: What it does, in words.
        function_code: FC of request and reply.
        decode: Turns the reply's PDU into the result; raises FrameError.
        sub_function: First bytes of the request's PDU.
        section: Section of the manual.
    """

    name: str
    function_code: int
    decode: Callable[[bytes], T]
    _: KW_ONLY
    sub_function: bytes = b""
    section: str

    def request(self, address: int) -> Frame:
        """Return the request to the device with this address."""
        return Frame(address, MASTER, self.function_code, self.sub_function)


READ_DEVICE_NAME = Command("read the device name", 0xD0, _text, section="3.3.2")
START = Command("start the acquisition", 0xD1, _nothing, sub_function=b"\0\0", section="3.3.3.1")
STOP = Command("stop the acquisition", 0xD1, _nothing, sub_function=b"\0\1", section="3.3.3.1")
SET_DEFAULT_TEMPERATURE_THRESHOLDS = Command(
    "set the default temperature thresholds", 0xD1, _thresholds_celsius, sub_function=b"\x01\x33",
    section="3.3.3.2")
READ_DSP_TEMPERATURE = Command("read the DSP temperature", 0xD1, _board_celsius,
                               sub_function=b"\x01\x09", section="3.3.3.3")
READ_RFE_TEMPERATURE = Command("read the RFE temperature", 0xD1, _board_celsius,
                               sub_function=b"\x01\x0A", section="3.3.3.4")  # errata I12
READ_ADDRESS = Command("read the address", READ_SENSOR, _number, sub_function=b"\0\1",
                       section="3.3.4.1")
READ_FIRMWARE_VERSION = Command("read the firmware version", 0xD6, _version,
                                sub_function=b"\x01\x01", section="3.3.6.1")
READ_DSP_HARDWARE_VERSION = Command("read the DSP hardware version", 0xD6, _version,
                                    sub_function=b"\x01\x02", section="3.3.6.2")
READ_RFE_HARDWARE_VERSION = Command("read the RFE hardware version", 0xD6, _version,
                                    sub_function=b"\x01\x03", section="3.3.6.3")
READ_PRODUCT_INFORMATION = Command("read the product information", 0xD6, _number,
                                   sub_function=b"\x01\x04", section="3.3.6.4")
READ_BOOTLOADER_VERSION = Command("read the bootloader version", 0xD6, _version,
                                  sub_function=b"\x02\x20", section="3.3.6.5")
READ_DIGITAL_OUTPUTS = Command("read the digital outputs", 0xDB, _outputs, section="3.3.8")
RESTORE_FACTORY_SETTINGS = Command("restore the factory settings", 0xDF, _nothing,
                                   sub_function=b"\x01", section="3.3.9.1")
SAVE_SENSOR_SETTINGS = Command("save the sensor settings", 0xDF, _nothing,
                               sub_function=b"\x02", section="3.3.9.2")
SAVE_APPLICATION_SETTINGS = Command("save the application settings", 0xDF, _nothing,
                                    sub_function=b"\x03", section="3.3.9.2")
SAVE_ALL_SETTINGS = Command("save the sensor and application settings", 0xDF, _nothing,
                            sub_function=b"\x04", section="3.3.9.2")
READ_RAW = Command("read the raw signals", READ_RAW_SIGNALS, _raw_signals, section="3.3.10")
READ_RANGE_LIST = Command("read the range list", 0xE1, _range_list, section="3.3.11")

TARGET_LIST_SECTION = "3.3.7"
TEMPERATURE_THRESHOLDS_SECTION = "3.3.5.17"  # what "set the default temperature thresholds" sets


def read_target_list(address: int, output: int, resolution: Resolution) -> Frame:
    """Return the request for a target list (tables 25 and 26)."""
    pdu = bytes((output,)) if resolution is Resolution.NONE else bytes((output, resolution))
    return Frame(address, MASTER, READ_TARGET_LIST, pdu)


def change_address(address: int, new_address: int) -> Frame:
    """Return the request that changes a device's address, for good and at once (errata I17).

    Raises:
        SettingError: The new address is not one of a device.
    """
    if not FIRST_ADDRESS <= new_address <= LAST_ADDRESS:
        raise SettingError(f"the new address {new_address} is out of range, allowed is "
                           f"{FIRST_ADDRESS} … {LAST_ADDRESS}")
    return Frame(address, MASTER, READ_SENSOR + 1,
                 struct.pack(">HH", SENSOR_ADDRESS, new_address))


@dataclass(frozen=True)
class IsysRecord(Record):
    """A block of settings (tables 10 and 13).

    Attributes:
        function_code: FC to read; the one to write is one more.
        sub_function: Sub-function code.
        has_location: Whether request and write carry a save location.
        stored_at_once: Whether every write goes to the EEPROM as well.
        selector: Number of the output or zone, in the bytes behind the location.
    """

    function_code: int
    sub_function: int
    _: KW_ONLY
    has_location: bool = False
    stored_at_once: bool = False
    selector: bytes = b""

    def _prefix(self, location: Location) -> bytes:
        return (bytes((location,)) if self.has_location else b"") + self.selector

    def _request(self, address: int, function_code: int, location: Location, data: bytes) -> Frame:
        return Frame(address, MASTER, function_code,
                     struct.pack(">H", self.sub_function) + self._prefix(location) + data)

    def read_request(self, address: int, location: Location = Location.RAM) -> Frame:
        """Return the request to read this record (errata I14)."""
        return self._request(address, self.function_code, location, b"")

    def write_request(self, address: int, values: Sequence[Raw],
                      location: Location = Location.RAM) -> Frame:
        """Return the request to write this record."""
        return self._request(address, self.function_code + 1, location, self.pack(values))

    def decode_reply(self, pdu: bytes, location: Location = Location.RAM) -> tuple[Raw, ...]:
        """Return the fields of a reply to a read.

        Some devices repeat location and output in front of the values, others do not; the length
        tells (errata I14, I25).

        Raises:
            FrameError: Length or repeated bytes do not fit the request.
        """
        prefix = self._prefix(location)
        if len(pdu) == self.size:
            return self.unpack(pdu)
        if len(pdu) != self.size + len(prefix):
            longer = f" or {self.size + len(prefix)}" if prefix else ""
            raise FrameError(f"reply to reading 0x{self.sub_function:04X} carries {len(pdu)} bytes "
                             f"instead of {self.size}{longer}: {pdu.hex(' ')}")
        if not pdu.startswith(prefix):
            raise FrameError(f"reply to reading 0x{self.sub_function:04X} is for another location "
                             f"or output, it starts with {pdu[:len(prefix)].hex(' ')} instead of "
                             f"{prefix.hex(' ')}: {pdu.hex(' ')}")
        return self.unpack(pdu[len(prefix):])
