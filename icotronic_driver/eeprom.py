# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The EEPROM of sensors and stationary units (section 8): pages as tables of fields.

Numbers and floats are little endian (errata C10). Nothing here does I/O.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator, Mapping
from dataclasses import KW_ONLY, dataclass
from enum import Enum, IntEnum

from driver_common.errors import FrameError, SettingError
from icotronic_driver.commands import ADVERTISEMENT_STEP, EEPROM_CHUNK, NAME_LENGTH
from icotronic_driver.values import decode_text, encode_text

PAGE_SIZE = 256
SYSTEM_CONFIGURATION, PRODUCT_DATA, STATISTICS, CALIBRATION = 0x0, 0x4, 0x5, 0x8  # page numbers
PAGE_NAMES = {SYSTEM_CONFIGURATION: "System Configuration", PRODUCT_DATA: "Product Data",
              STATISTICS: "Statistics", CALIBRATION: "Calibration"}

FieldValue = int | float | str | bytes


class Status(IntEnum):
    """First byte of the EEPROM (section 8.2.1.1)."""

    INITIALIZED = 0xAC
    LOCKED = 0xCA  # read-only fields cannot be written
    UNINITIALIZED = 0x00  # like any other value; at the next reset the defaults are stored

    @classmethod
    def of(cls, byte: int) -> Status:
        """Return what the first byte means."""
        return cls(byte) if byte in (cls.INITIALIZED, cls.LOCKED) else cls.UNINITIALIZED


class Form(Enum):
    """How a field is stored."""

    UNSIGNED = "unsigned"
    FLOAT = "float"
    TEXT = "text"
    BYTES = "bytes"


@dataclass(frozen=True)
class Field:
    """One field of the EEPROM.

    Attributes:
        name: Name in the manual.
        page: Number of the page.
        offset: First byte within the page.
        length: Number of bytes.
        form: How it is stored.
        unit: Unit of the value, "" where it has none.
        factor: Size of one raw step of a number, in `unit`.
        read_only: Whether a locked EEPROM refuses to write it.
        default: Its value after the first power-on; None where it depends on the device.
    """

    name: str
    page: int
    offset: int
    length: int
    form: Form
    _: KW_ONLY
    unit: str = ""
    factor: float = 1
    read_only: bool = False
    default: FieldValue | None = None

    @property
    def chunks(self) -> Iterator[tuple[int, int]]:
        """Offset and length of each message that reads or writes the field (errata C10)."""
        return chunks(self.offset, self.length)

    def decode(self, data: bytes) -> FieldValue:
        """Return the value of the field's bytes.

        Raises:
            FrameError: Not as many bytes as the field has.
        """
        if len(data) != self.length:
            raise FrameError(f"{self.name} has {self.length} bytes, not {len(data)}: "
                             f"{data.hex(' ').upper()}")
        if self.form is Form.FLOAT:
            return float(struct.unpack("<f", data)[0])
        if self.form is Form.TEXT:
            return decode_text(data)
        if self.form is Form.BYTES:
            return bytes(data)
        raw = int.from_bytes(data, "little")
        return raw if self.factor == 1 else round(raw * self.factor, 9)

    def encode(self, value: FieldValue) -> bytes:
        """Return the field's bytes.

        Raises:
            SettingError: Wrong type, too long, or out of range.
        """
        if self.form is Form.TEXT and isinstance(value, str):
            return encode_text(value, self.length)
        if self.form is Form.BYTES and isinstance(value, bytes) and len(value) == self.length:
            return value
        if isinstance(value, (int, float)) and self.form in (Form.UNSIGNED, Form.FLOAT):
            return self._encode_number(value)
        kind = {Form.TEXT: "a text", Form.BYTES: f"{self.length} bytes"}.get(self.form, "a number")
        raise SettingError(f"{self.name} must be {kind}, not {value!r}")

    def _encode_number(self, value: float) -> bytes:
        try:
            if self.form is Form.FLOAT:
                return struct.pack("<f", value)
            if math.isfinite(value):
                raw = value if self.factor == 1 else value / self.factor  # a float has 53 bits
                return round(raw).to_bytes(self.length, "little")
        except OverflowError:
            pass
        largest = ((1 << 8 * self.length) - 1) * self.factor
        allowed = "32-bit floating-point numbers" if self.form is Form.FLOAT else f"0 … {largest:g}"
        raise SettingError(f"{self.name} = {value:g} {self.unit} is out of range, allowed is "
                           f"{allowed} {self.unit}".replace("  ", " ").rstrip())

    def text(self, value: FieldValue) -> str:
        """Return a value with its unit."""
        shown = value.hex(" ").upper() if isinstance(value, bytes) else (
            f"{value:.9g}" if isinstance(value, float) else str(value))
        return f"{shown} {self.unit}".rstrip()


def chunks(offset: int, length: int) -> Iterator[tuple[int, int]]:
    """Return offset and length of each message for an area of a page (errata C10)."""
    for start in range(offset, offset + length, EEPROM_CHUNK):
        yield start, min(EEPROM_CHUNK, offset + length - start)


def _numbers(page: int, offset: int, length: int, names: str, form: Form = Form.UNSIGNED, *,
             unit: str = "", read_only: bool = False,
             default: FieldValue | None = None) -> tuple[Field, ...]:
    """Return fields that follow each other, one per name."""
    return tuple(Field(name.strip(), page, offset + index * length, length, form, unit=unit,
                       read_only=read_only, default=default)
                 for index, name in enumerate(names.split(",")))


def _system_configuration(name: str, default: str) -> tuple[Field, ...]:
    """Return the page of section 8.2.1.1 with the defaults of 8.3.1.1 and 8.4.1.1."""
    page, unsigned = SYSTEM_CONFIGURATION, Form.UNSIGNED
    fields = [Field("EEPROM Status", page, 0, 1, unsigned, read_only=True,
                    default=int(Status.INITIALIZED)),
              Field(name, page, 1, NAME_LENGTH, Form.TEXT, default=default)]
    for number, offset, sleep, advertisement in ((1, 9, 300.0, 1.25), (2, 15, 259200.0, 2.5)):
        fields += [Field(f"Sleep Time {number}", page, offset, 4, unsigned, unit="s",
                         factor=0.001, default=sleep),
                   Field(f"Advertisement Time {number}", page, offset + 4, 2, unsigned, unit="s",
                         factor=ADVERTISEMENT_STEP, default=advertisement)]
    return tuple(fields)


def _product_data(release: str, *, read_only: bool) -> tuple[Field, ...]:
    """Return the page of section 8.2.1.2; versions and release are read-only in an STU."""
    page = PRODUCT_DATA
    return (
        Field("GTIN", page, 0, 8, Form.UNSIGNED, read_only=True, default=0),
        *_numbers(page, 13, 1, "Hardware Version: Major, Hardware Version: Minor, "
                  "Hardware Version: Patch", read_only=read_only),
        *_numbers(page, 21, 1, "Firmware Version: Major, Firmware Version: Minor, "
                  "Firmware Version: Patch", read_only=read_only),
        Field("Release Name", page, 24, 8, Form.TEXT, read_only=read_only, default=release),
        Field("Serial Number", page, 32, 32, Form.TEXT, read_only=True, default="0"),
        Field("Product Name", page, 64, 128, Form.TEXT, read_only=True, default="0"),
        Field("OEM Free Use", page, 192, 64, Form.BYTES, read_only=True, default=bytes(64)),
    )


def _statistics(*, read_only_date: bool) -> tuple[Field, ...]:
    """Return the page of section 8.2.1.3; the batch number is a number for the vendor's client."""
    page = STATISTICS
    return (
        *_numbers(page, 0, 4, "Power On Cycles, Power Off Cycles", read_only=True, default=0),
        *_numbers(page, 8, 4, "Operating Time", unit="s", read_only=True, default=0),
        *_numbers(page, 12, 4, "Under Voltage Counter, Watchdog Reset Counter", read_only=True,
                  default=0),
        Field("Production Date: Year", page, 20, 4, Form.TEXT, read_only=read_only_date),
        Field("Production Date: Month", page, 24, 2, Form.TEXT, read_only=read_only_date),
        Field("Production Date: Day", page, 26, 2, Form.TEXT, read_only=read_only_date),
        *_numbers(page, 28, 4, "Batch Number", read_only=True),
    )


CALIBRATED = ("Acceleration X", "Acceleration Y", "Acceleration Z", "Voltage Battery", "Voltage 2",
              "Voltage 3", "Internal Temperature", "Temperature 2", "Temperature 3")

STH_FIELDS = (
    *_system_configuration("STH Name", "Tanja"),
    *_product_data("Tanja", read_only=False),
    *_statistics(read_only_date=False),
    *(field for index, name in enumerate(CALIBRATED)
      for field in _numbers(CALIBRATION, 8 * index, 4, f"{name}: Slope, {name}: Offset",
                            Form.FLOAT)),
)
STU_FIELDS = (
    *_system_configuration("STU Name", "Valerie"),
    *_product_data("Valerie", read_only=True),
    *_statistics(read_only_date=True),
)

STH_EEPROM: Mapping[str, Field] = {field.name: field for field in STH_FIELDS}
STU_EEPROM: Mapping[str, Field] = {field.name: field for field in STU_FIELDS}


def decode_page(fields: Mapping[str, Field], page: int, image: bytes) -> dict[str, FieldValue]:
    """Return the values of all fields of a page from its 256 bytes.

    Raises:
        FrameError: Not a whole page.
    """
    if len(image) != PAGE_SIZE:
        raise FrameError(f"a page of the EEPROM has {PAGE_SIZE} bytes, not {len(image)}")
    return {field.name: field.decode(image[field.offset:field.offset + field.length])
            for field in fields.values() if field.page == page}
