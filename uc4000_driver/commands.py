# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Commands of the UC4000 (manual chapter 5 and annex A3): requests, and what replies mean."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, dataclass
from enum import Enum, IntEnum
from functools import partial
from typing import Generic, TypeVar

from driver_common.errors import FrameError, SettingError
from driver_common.settings import Raw, Record
from driver_common.text import printable_text
from uc4000_driver.telegram import FIRST_ADDRESS, LAST_ADDRESS, Request

T = TypeVar("T")

CYCLE_TIME = 0.050  # s, section 3.1.1
MAX_CYCLES = 255  # the data byte is 0xFF minus their number (errata U3)
STEP = 0.016  # m, errata U4


class OpCode(IntEnum):
    """Op-codes (annex A3)."""

    CAST = 0x00
    TEMPERATURE_COMPENSATION = 0x0A
    CURRENT = 0x21
    GAIN = 0x22
    BURST = 0x23
    SERIAL_NUMBER = 0x33
    VERSION = 0x34
    ADDRESS = 0x35
    USER_PROFILE = 0x37
    PROFILE_C = 0xFC
    PROFILE_B = 0xFD
    PROFILE_A = 0xFE
    TEMPERATURE = 0xFF


@dataclass(frozen=True)
class Profile:
    """A measurement profile (section 3.1.1).

    Attributes:
        op_code: Starts a measurement with it.
        limits: Smallest and largest distance in m that it detects.
        section: Section of the manual.
    """

    op_code: OpCode
    limits: tuple[float, float]
    section: str


PROFILES = {
    "a": Profile(OpCode.PROFILE_A, (0.25, 3.5), "5.1.2"),
    "b": Profile(OpCode.PROFILE_B, (0.25, 4.0), "5.1.3"),
    "c": Profile(OpCode.PROFILE_C, (0.25, 4.0), "5.1.4"),
    "user": Profile(OpCode.USER_PROFILE, (0.25, 4.0), "5.1.5"),
}


class Outcome(Enum):
    """What a measurement found (section 3.3.2)."""

    ECHO = "echo"
    NO_ECHO = "no echo"
    TOO_CLOSE = "echo in the blind zone"
    TOO_FAR = "echo beyond the range"


@dataclass(frozen=True)
class Distance:
    """A measured distance.

    Attributes:
        value: In m, within the limits of the profile; -inf too close, +inf no echo or one from
            beyond the range.
        outcome: Which of them.
    """

    value: float
    outcome: Outcome = Outcome.ECHO


NO_ECHO = Distance(float("inf"), Outcome.NO_ECHO)
TOO_CLOSE = Distance(float("-inf"), Outcome.TOO_CLOSE)
TOO_FAR = Distance(float("inf"), Outcome.TOO_FAR)
_NO_ECHO_CODE, _TOO_FAR_CODE = 0x00, 0xFF  # 0x01, too close, is below every limit as it is


def _distance(limits: tuple[float, float], data: bytes) -> Distance:
    smallest, largest = limits
    value = round(data[0] * STEP, 3)
    if data[0] == _NO_ECHO_CODE:
        return NO_ECHO
    if data[0] == _TOO_FAR_CODE or value > largest:
        return TOO_FAR
    return TOO_CLOSE if value < smallest else Distance(value)


def _celsius(data: bytes) -> int:
    return int.from_bytes(data, "big", signed=True)  # errata U5


def _number(data: bytes) -> int:
    return data[0]


def _address(data: bytes) -> int:
    if not FIRST_ADDRESS <= data[0] <= LAST_ADDRESS:
        raise FrameError(f"{data[0]} is no address of a sensor")
    return data[0]


def _text(data: bytes) -> str:
    return printable_text(data.split(b"\0", 1)[0].strip())


@dataclass(frozen=True)
class Command(Generic[T]):
    """A command: how it is asked, and how the reply is understood.

    Attributes:
        name: What it does, in words.
        op_code: What is asked.
        decode: Turns the reply's data bytes into the result; raises FrameError.
        data: The request's data byte; 0xFF takes the sensor the least current.
        data_length: Number of data bytes in the reply.
        duration: Time in s that the measurement takes.
        is_write: Whether it changes what the sensor has stored.
        section: Section of the manual.
    """

    name: str
    op_code: int
    decode: Callable[[bytes], T]
    _: KW_ONLY
    data: int = 0xFF
    data_length: int = 1
    duration: float = 0.0
    is_write: bool = False
    section: str

    @property
    def reply_length(self) -> int:
        """Length of the reply in bytes, with CHECK; a refusal has two."""
        return self.data_length + 1

    def request(self, address: int) -> Request:
        """Return the request to the sensor with this address."""
        return Request(address, self.op_code, self.data, self.is_write)


READ_TEMPERATURE = Command("read the temperature", OpCode.TEMPERATURE, _celsius, section="5.1.1")
READ_ADDRESS = Command("read the address", OpCode.ADDRESS, _address, section="5.1.6.1")
READ_VERSION = Command("read the version", OpCode.VERSION, _text, data_length=18,
                       section="5.1.7")  # errata U7
READ_SERIAL_NUMBER = Command("read the serial number", OpCode.SERIAL_NUMBER, _text,
                             data_length=14, section="5.3.2")
ASK_ADDRESS = Command("ask for the address", OpCode.CAST, _address, data=0x00, section="5.1.6.3")


def measure(profile: Profile, cycles: int = 1) -> Command[Distance]:
    """Return the command for a distance, the average of several measurement cycles.

    Raises:
        SettingError: The number of cycles does not fit the telegram.
    """
    if not 1 <= cycles <= MAX_CYCLES:
        raise SettingError(f"cycles = {cycles} is out of range, allowed is 1 … {MAX_CYCLES}")
    return Command("measure", profile.op_code, partial(_distance, profile.limits),
                   data=0xFF - cycles, duration=cycles * CYCLE_TIME, section=profile.section)


def write_address(address: int) -> Command[int]:
    """Return the command that gives a sensor another address.

    Raises:
        SettingError: It is not one of a sensor.
    """
    if not FIRST_ADDRESS <= address <= LAST_ADDRESS:
        raise SettingError(f"address {address} is out of range, allowed is "
                           f"{FIRST_ADDRESS} … {LAST_ADDRESS}")
    return Command("change the address", OpCode.ADDRESS, _address, data=address, is_write=True,
                   section="5.1.6.2")


@dataclass(frozen=True)
class Uc4000Record(Record):
    """A stored byte (section 5.2).

    Attributes:
        name: What it holds, in words.
        op_code: Reads and writes it.
        section: Section of the manual.
        write_only: Whether it cannot be read.
    """

    name: str
    op_code: int
    section: str
    _: KW_ONLY
    layout: tuple[str, ...] = ("B",)
    write_only: bool = False

    def read(self) -> Command[int]:
        """Return the command to read it."""
        return Command(f"read the {self.name}", self.op_code, _number, section=self.section)

    def write(self, values: Sequence[Raw]) -> Command[int]:
        """Return the command to write it; the sensor repeats what it stored."""
        return Command(f"write the {self.name}", self.op_code, _number, is_write=True,
                       data=self.pack(values)[0], section=self.section)
