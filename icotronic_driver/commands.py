# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Commands of the MyTooliT protocol (section 10): requests, and what their answers mean.

A `Command` is a row: `request` turns it into a `Request`, which knows the frame to send, which
frame answers it, and what that says. Texts, numbers and units are those of people; bytes are only
inside.
"""

from __future__ import annotations

import ast
import inspect
import math
import re
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from driver_common.errors import FrameError, SettingError
from driver_common.settings import Raw, Record, suggestion
from icotronic_driver.identifier import SPU_1, STH_1, Identifier
from icotronic_driver.request import Command, Request
from icotronic_driver.streaming import STOP, StreamFormat, decode_single
from icotronic_driver.values import (
    AdcConfiguration,
    CalibrationElement,
    CalibrationMethod,
    CodeLocation,
    EnergyTimes,
    ErrorStatus,
    NetworkState,
    NodeStatus,
    OperatingTime,
    PowerCycles,
    Signal,
    State,
    UsedSensors,
    Version,
    decode_mac,
    decode_text,
    encode_mac,
    encode_text,
    reference_code,
    unpack_exactly,
)

T = TypeVar("T")

SYSTEM, STREAMING, STATISTICS = 0x00, 0x04, 0x08
CONFIGURATION, EEPROM, PRODUCT_DATA, TEST = 0x28, 0x3D, 0x3E, 0x3F

BLUETOOTH = (SYSTEM, 0x0B)  # block and command; a sub-command follows
SELF = 0xFF  # device number: the node itself, not one that it sees
NAME_LENGTH, FIRST_PART = 8, 6  # bytes of a name, and how many the first frame carries
EEPROM_CHUNK = 4  # errata C10
LED_NUMBER = 1  # field note N6
ADVERTISEMENT_STEP = 0.625e-3  # s
TEMPERATURE_REFERENCE = 1.25  # V; with it the temperature comes in m°C

_STATE_REASONS = {1: "set state not available", 2: "wrong subscriber"}  # section 10.2.3.1


# --- bytes in and out ---


def _bytes(data: bytes) -> bytes:
    unpack_exactly(data, "8s")
    return bytes(data)


def _done(data: bytes) -> None:
    """Accept any answer: what it carries says nothing."""


def _nothing() -> bytes:
    return bytes(8)  # errata C3


def _empty() -> bytes:
    return b""


# --- system (section 10.2) ---

def _set_state(state: NetworkState, location: CodeLocation = CodeLocation.NO_CHANGE) -> bytes:
    return bytes((0x80 | CodeLocation(location) << 4 | NetworkState(state),))


def _state(data: bytes) -> State:
    if not data:
        raise FrameError("the state is missing")
    return State(CodeLocation(data[0] >> 4 & 3), NetworkState(data[0] & 7))


def _word(data: bytes) -> int:
    """Return a status word; its mask, in the bytes behind it, is not used."""
    return struct.unpack("<I", _bytes(data)[:4])[0]  # type: ignore[no-any-return]


def _sth_status(data: bytes) -> NodeStatus:
    word = _word(data)
    return NodeStatus(bool(word & 1), NetworkState(word >> 1 & 7))


def _stu_status(data: bytes) -> NodeStatus:
    word = _word(data)
    return NodeStatus(bool(word & 1), NetworkState(word >> 1 & 7), bool(word & 0x10),
                      bool(word & 0x20), bool(word & 0x40))


def _sth_errors(data: bytes) -> ErrorStatus:
    word = _word(data)
    return ErrorStatus(bool(word & 1), bool(word & 2))


def _stu_errors(data: bytes) -> ErrorStatus:
    return ErrorStatus(bool(_word(data) & 1))


RESET = Command("reset", SYSTEM, 0x01, _empty, _done, section="10.2.2")
READ_STATE = Command("read the state", SYSTEM, 0x02, lambda: b"\0", _state,
                     reasons=_STATE_REASONS, section="10.2.3")
WRITE_STATE = Command("set the state", SYSTEM, 0x02, _set_state, _state,
                      reasons=_STATE_REASONS, section="10.2.3")
READ_STH_STATUS = Command("read the node status", SYSTEM, 0x05, _nothing, _sth_status,
                          section="10.2.4")
READ_STU_STATUS = Command("read the node status", SYSTEM, 0x05, _nothing, _stu_status,
                          section="10.2.4")
READ_STH_ERRORS = Command("read the error status", SYSTEM, 0x06, _nothing, _sth_errors,
                          section="10.2.5")
READ_STU_ERRORS = Command("read the error status", SYSTEM, 0x06, _nothing, _stu_errors,
                          section="10.2.5")


# --- Bluetooth (section 10.2.6) ---

_SUBCOMMAND_AND_NUMBER, _SUBCOMMAND, _ANY = b"\xff\xff", b"\xff", b""  # errata C5


def _of_device(name: str, subcommand: int, decode: Callable[[bytes], T], *,
               mask: bytes = _SUBCOMMAND_AND_NUMBER) -> Command[[int], T]:
    """Return a sub-command which is sent for a device number and carries no value."""
    def encode(device: int) -> bytes:
        return bytes((subcommand, device)) + bytes(6)

    return Command(name, SYSTEM, 0x0B, encode, lambda data: decode(_bytes(data)[2:]), mask=mask,
                   section="10.2.6")


def _bluetooth(name: str, subcommand: int, decode: Callable[[bytes], T], *,
               number: int = 0) -> Command[[], T]:
    """Return a sub-command which needs no device number and carries no value."""
    payload = bytes((subcommand, number)) + bytes(6)
    return Command(name, SYSTEM, 0x0B, lambda: payload, lambda data: decode(_bytes(data)[2:]),
                   mask=_SUBCOMMAND_AND_NUMBER, section="10.2.6")


def _name_part(name: str, subcommand: int, mask: bytes) -> Command[[int, bytes], None]:
    def encode(device: int, part: bytes) -> bytes:
        return bytes((subcommand, device)) + part.ljust(6, b"\0")

    return Command(name, SYSTEM, 0x0B, encode, _done, mask=mask, section="10.2.6")


def _write_energy(name: str, subcommand: int) -> Command[[float, float], EnergyTimes]:
    def encode(sleep: float, advertisement: float) -> bytes:
        values = round(sleep * 1000), round(advertisement / ADVERTISEMENT_STEP)
        if not (0 < values[0] < 1 << 32 and 0 < values[1] < 1 << 16):
            raise SettingError(f"sleep time {sleep:g} s and advertisement time {advertisement:g} s "
                               "are not possible, allowed is more than 0 up to 4294967.295 s "
                               "and up to 40.959375 s")  # zeros would be a read
        return bytes((subcommand, SELF)) + struct.pack("<IH", *values)

    return Command(name, SYSTEM, 0x0B, encode, lambda data: _energy_times(_bytes(data)[2:]),
                   mask=_ANY, section="10.2.6")


def _energy_times(value: bytes) -> EnergyTimes:
    sleep, advertisement = struct.unpack("<IH", value)  # errata C11
    return EnergyTimes(sleep / 1000, round(advertisement * ADVERTISEMENT_STEP, 9))


def _device_count(value: bytes) -> int:
    text = decode_text(value).strip()
    if not text.isdecimal():
        raise FrameError(f"the number of devices is not in digits: {value.hex(' ').upper()}")
    return int(text)


def _mac(value: bytes) -> str:
    return decode_mac(value[::-1])


def _connect_mac(address: str) -> bytes:
    return bytes((18, 0)) + encode_mac(address)[::-1]


ACTIVATE_BLUETOOTH = _bluetooth("activate Bluetooth", 1, _done)
COUNT_DEVICES = _bluetooth("get the number of available devices", 2, _device_count)
WRITE_NAME_1 = _name_part("write the first part of the name", 3, _SUBCOMMAND_AND_NUMBER)
WRITE_NAME_2 = _name_part("write the second part of the name", 4, _SUBCOMMAND)
READ_NAME_1 = _of_device("read the first part of the name", 5, bytes)
READ_NAME_2 = _of_device("read the second part of the name", 6, lambda value: value[:2])
CONNECT_NUMBER = _of_device("connect by number", 7, lambda value: bool(value[0]))
CHECK_CONNECTED = _bluetooth("check if connected", 8, lambda value: bool(value[0]))
DEACTIVATE_BLUETOOTH = _bluetooth("deactivate Bluetooth", 9, _done)
READ_SEND_COUNTER = _bluetooth("read the send counter", 10,
                               lambda value: int.from_bytes(value, "big"))
READ_RECEIVE_COUNTER = _bluetooth("read the number of received frames", 11,
                                  lambda value: int.from_bytes(value, "big"))
READ_RSSI = _of_device("read the RSSI", 12,
                       lambda value: int.from_bytes(value[:1], "little", signed=True))  # dBm
READ_REDUCED_ENERGY = _bluetooth("read the times of the reduced energy mode", 13, _energy_times,
                                 number=SELF)
WRITE_REDUCED_ENERGY = _write_energy("write the times of the reduced energy mode", 14)
READ_LOWEST_ENERGY = _bluetooth("read the times of the lowest energy mode", 15, _energy_times,
                                number=SELF)
WRITE_LOWEST_ENERGY = _write_energy("write the times of the lowest energy mode", 16)
READ_MAC = _of_device("read the MAC address", 17, _mac, mask=_SUBCOMMAND)
CONNECT_MAC = Command("connect by MAC address", SYSTEM, 0x0B, _connect_mac,
                      lambda data: _mac(_bytes(data)[2:]), mask=_SUBCOMMAND_AND_NUMBER,
                      section="10.2.6")


def decode_name(first: bytes, second: bytes) -> str:
    """Return the name whose two parts were read; a character may be cut by their border."""
    return decode_text(first + second)


def encode_name(name: str) -> tuple[bytes, bytes]:
    """Return the two parts in which a name is written.

    Raises:
        SettingError: It does not fit 8 bytes.
    """
    data = encode_text(name, NAME_LENGTH)
    return data[:FIRST_PART], data[FIRST_PART:]


# --- streaming (section 10.3) ---

def _stream(format: StreamFormat) -> bytes:
    return bytes((format.encode(),))


def _stop() -> bytes:
    return bytes((STOP.encode(),))


_DATA_SETS_ONLY = b"\x07"  # a stop is known by its data sets: 0

# The answer to the start of a stream is its first data frame (errata C6).
START_ACCELERATION = Command("start the stream", STREAMING, 0x00, _stream, _done, mask=b"\xff",
                             section="10.3.2")
STOP_ACCELERATION = Command("stop the stream", STREAMING, 0x00, _stop, _done,
                            mask=_DATA_SETS_ONLY, section="10.3.2")
START_VOLTAGE = Command("start the voltage stream", STREAMING, 0x20, _stream, _done, mask=b"\xff",
                        section="10.3.3")
STOP_VOLTAGE = Command("stop the voltage stream", STREAMING, 0x20, _stop, _done,
                       mask=_DATA_SETS_ONLY, section="10.3.3")

ACCELERATION_DATA = Identifier(STREAMING, 0x00, STH_1, SPU_1, request=False)
VOLTAGE_DATA = Identifier(STREAMING, 0x20, STH_1, SPU_1, request=False)

_SINGLE_ACCELERATION = Command("read single values", STREAMING, 0x00, _stream, _done,
                               mask=b"\xff", section="10.3.2")
_SINGLE_VOLTAGE = Command("read single voltages", STREAMING, 0x20, _stream, _done, mask=b"\xff",
                          section="10.3.3")


def read_acceleration(receiver: int, channels: tuple[bool, bool, bool] = (True, True, True),
                      data_sets: int = 1, value_size: int = 2) -> Request[tuple[int, ...]]:
    """Return the request for single raw values, oldest first (section 10.3.2)."""
    return _single(_SINGLE_ACCELERATION, receiver,
                   StreamFormat(channels, data_sets, value_size, stream=False))


def read_voltage(receiver: int, channels: tuple[bool, bool, bool] = (True, False, False),
                 data_sets: int = 1, value_size: int = 2) -> Request[tuple[int, ...]]:
    """Return the request for single raw voltages; voltage 1 is the battery (section 10.3.3)."""
    return _single(_SINGLE_VOLTAGE, receiver,
                   StreamFormat(channels, data_sets, value_size, stream=False))


def _single(command: Command[[StreamFormat], None], receiver: int,
            format: StreamFormat) -> Request[tuple[int, ...]]:
    return command.with_payload(receiver, _stream(format),
                                lambda data: decode_single(format, data))


# --- statistics (section 10.4) ---

def _statistics(name: str, block_command: int, decode: Callable[[bytes], T],
                section: str) -> Command[[], T]:
    return Command(name, STATISTICS, block_command, _nothing, decode, section=section)


def _counter(data: bytes) -> int:
    """Return the number in the first four bytes; more may follow them."""
    if len(data) not in (4, 8):
        raise FrameError(f"answer carries {len(data)} bytes instead of 4 or 8: "
                         f"{data.hex(' ').upper()}")
    return int.from_bytes(data[:4], "big")


def _production_date(data: bytes) -> str:
    text = decode_text(_bytes(data))
    return f"{text[:4]}-{text[4:6]}-{text[6:]}" if len(text) == 8 and text.isdecimal() else text


READ_POWER_CYCLES = _statistics("read the power cycles", 0x00,
                                lambda data: PowerCycles(*unpack_exactly(data, ">II")), "10.4.1")
READ_OPERATING_TIME = _statistics(
    "read the operating time", 0x01, lambda data: OperatingTime(*unpack_exactly(data, ">II")),
    "10.4.2")
READ_UNDER_VOLTAGES = _statistics("read the under voltage counter", 0x02, _counter, "10.4.3")
READ_WATCHDOG_RESETS = _statistics("read the watchdog reset counter", 0x03, _counter, "10.4.4")
READ_PRODUCTION_DATE = _statistics("read the production date", 0x04, _production_date, "10.4.5")


# --- configuration (section 10.5) ---

_ELEMENT_AND_AXIS, _HIDDEN_FIRST = b"\xff\xff", b"\x00\xff\xff"


def _adc(data: bytes) -> AdcConfiguration:
    return AdcConfiguration.decode(_bytes(data)[1:5])


def _write_adc(configuration: AdcConfiguration) -> bytes:
    return b"\x80" + configuration.encode() + bytes(3)


def _used_sensors(data: bytes) -> UsedSensors:
    return UsedSensors(*_bytes(data)[1:4])


def _write_used_sensors(sensors: UsedSensors) -> bytes:
    if not all(0 <= number <= 255 for number in sensors):
        raise SettingError(f"sensor numbers {sensors} are not possible, allowed is 0 … 255")
    return bytes((0x80, *sensors)) + bytes(4)


def _factor(element: CalibrationElement, axis: int) -> bytes:
    return bytes((element, axis)) + bytes(6)


def _write_factor(element: CalibrationElement, axis: int, value: float) -> bytes:
    if not math.isfinite(value):
        raise SettingError(f"a calibration factor must be a finite number, not {value}")
    return bytes((element, axis, 0x80, 0)) + struct.pack(">f", value)


def _factor_value(data: bytes) -> float:
    return struct.unpack(">f", _bytes(data)[4:])[0]  # type: ignore[no-any-return]


def _measurement(element: CalibrationElement, dimension: int = 1,
                 reference_voltage: float = 3.3,
                 method: CalibrationMethod = CalibrationMethod.MEASURE, *,
                 reset: bool = False) -> bytes:
    return bytes((0x80 | method << 5 | reset << 4, element, dimension,
                  reference_code(reference_voltage))) + bytes(4)


def _last_measurement(element: CalibrationElement, dimension: int = 1,
                      reference_voltage: float = 3.3) -> bytes:
    return bytes((CalibrationMethod.MEASURE << 5, element, dimension,
                  reference_code(reference_voltage))) + bytes(4)


def _celsius(data: bytes) -> float:
    return int.from_bytes(_bytes(data)[4:], "little", signed=True) / 1000


def _read_led(number: int = LED_NUMBER) -> bytes:
    return bytes((0x01, number)) + bytes(6)


def _write_led(on: bool, number: int = LED_NUMBER) -> bytes:
    return bytes((0x81, number, 1 if on else 2)) + bytes(5)


def _led(data: bytes) -> bool:
    code = _bytes(data)[2]
    if code not in (1, 2):
        raise FrameError(f"LED state {code} is neither 1 (on) nor 2 (off)")
    return code == 1


READ_ADC = Command("read the ADC configuration", CONFIGURATION, 0x00, _nothing, _adc,
                   section="10.5.1")
WRITE_ADC = Command("write the ADC configuration", CONFIGURATION, 0x00, _write_adc, _adc,
                    section="10.5.1")
READ_USED_SENSORS = Command("read the used sensors", CONFIGURATION, 0x01, _nothing, _used_sensors,
                            section="10.5.2")
WRITE_USED_SENSORS = Command("write the used sensors", CONFIGURATION, 0x01,
                             _write_used_sensors, _used_sensors, section="10.5.2")
READ_CALIBRATION_K = Command("read a calibration factor k", CONFIGURATION, 0x60, _factor,
                             _factor_value, mask=_ELEMENT_AND_AXIS, section="10.5.3")
WRITE_CALIBRATION_K = Command("write a calibration factor k", CONFIGURATION, 0x60, _write_factor,
                              _factor_value, mask=_ELEMENT_AND_AXIS, section="10.5.3")
READ_CALIBRATION_D = Command("read a calibration factor d", CONFIGURATION, 0x61, _factor,
                             _factor_value, mask=_ELEMENT_AND_AXIS, section="10.5.4")
WRITE_CALIBRATION_D = Command("write a calibration factor d", CONFIGURATION, 0x61, _write_factor,
                              _factor_value, mask=_ELEMENT_AND_AXIS, section="10.5.4")
MEASURE = Command("make a calibration measurement", CONFIGURATION, 0x62, _measurement,
                  lambda data: int.from_bytes(_bytes(data)[4:], "little"), mask=_HIDDEN_FIRST,
                  section="10.5.5")
READ_MEASUREMENT = Command("read the last calibration measurement", CONFIGURATION, 0x62,
                           _last_measurement,
                           lambda data: int.from_bytes(_bytes(data)[4:], "little"),
                           mask=_HIDDEN_FIRST, section="10.5.5")
READ_TEMPERATURE = Command(
    "read the temperature", CONFIGURATION, 0x62,
    lambda: _measurement(CalibrationElement.TEMPERATURE, 1, TEMPERATURE_REFERENCE), _celsius,
    mask=_HIDDEN_FIRST, section="10.5.5")
READ_LED = Command("read the LED", CONFIGURATION, 0xC0, _read_led, _led, mask=b"\x00\xff",
                   section="10.5.6")
WRITE_LED = Command("write the LED", CONFIGURATION, 0xC0, _write_led, _led, mask=b"\x00\xff",
                    section="10.5.6")


# --- EEPROM (section 10.6) ---

_PAGE_OFFSET_LENGTH = b"\xff\xff\xff"


def _read_eeprom(page: int, offset: int, length: int) -> bytes:
    _check_area(page, offset, length)
    return bytes((page, offset, length)) + bytes(5)


def _write_eeprom(page: int, offset: int, content: bytes) -> bytes:
    _check_area(page, offset, len(content))
    return bytes((page, offset, len(content), 0)) + content.ljust(EEPROM_CHUNK, b"\0")


def _check_area(page: int, offset: int, length: int) -> None:
    if not (0 <= page <= 255 and 0 <= offset <= 255 and 1 <= length <= EEPROM_CHUNK
            and offset + length <= 256):
        raise SettingError(f"{length} bytes at offset {offset} of EEPROM page {page} cannot be "
                           f"accessed: 1 … {EEPROM_CHUNK} bytes within the 256 of a page can")


def _eeprom_content(data: bytes) -> bytes:
    length = _bytes(data)[2]
    if not 1 <= length <= EEPROM_CHUNK:
        raise FrameError(f"answer announces {length} bytes of the EEPROM: {data.hex(' ').upper()}")
    return data[4:4 + length]


READ_EEPROM = Command("read the EEPROM", EEPROM, 0x00, _read_eeprom, _eeprom_content,
                      mask=_PAGE_OFFSET_LENGTH, section="10.6.1")
WRITE_EEPROM = Command("write the EEPROM", EEPROM, 0x01, _write_eeprom, _eeprom_content,
                       mask=_PAGE_OFFSET_LENGTH, section="10.6.2")
READ_EEPROM_WRITES = Command("read the number of EEPROM writes", EEPROM, 0x20, _nothing,
                             lambda data: int.from_bytes(_bytes(data)[4:], "little"),
                             section="10.6.3")


# --- product data (section 10.7) ---

def _product(name: str, block_command: int, decode: Callable[[bytes], T],
             section: str) -> Command[[], T]:
    return Command(f"read {name}", PRODUCT_DATA, block_command, _nothing, decode, section=section)


def _parts(name: str, first: int, count: int, section: str) -> tuple[Command[[], bytes], ...]:
    return tuple(_product(f"part {index + 1} of {name}", first + index, _bytes, section)
                 for index in range(count))


def _version(data: bytes) -> Version:
    return Version(*_bytes(data)[5:])


# Like all numbers of the EEPROM it is little endian for the vendor's client; the manual says big.
READ_GTIN = _product("the GTIN", 0x00, lambda data: int.from_bytes(_bytes(data), "little"),
                     "10.7.1")
READ_HARDWARE_VERSION = _product("the hardware version", 0x01, _version, "10.7.2")
READ_FIRMWARE_VERSION = _product("the firmware version", 0x02, _version, "10.7.3")
READ_RELEASE_NAME = _product("the release name", 0x03, decode_text, "10.7.4")
READ_SERIAL_NUMBER = _parts("the serial number", 0x04, 4, "10.7.5")
READ_PRODUCT_NAME = _parts("the product name", 0x08, 16, "10.7.6")
READ_OEM_DATA = _parts("the OEM data", 0x18, 8, "10.7.7")
READ_TOOL_RFID = _product("the tool's RFID product information", 0x80, bytes, "10.7.8")


# --- test (section 10.8) ---

def _test_signal(shape: int, module: int = 0, content: bytes = b"") -> bytes:
    if shape not in (1, 2) or len(content) > 6:
        raise SettingError(f"test signal {shape} with {len(content)} bytes is not possible: "
                           "1 (line) and 2 (ramp) with up to 6 bytes are")
    return bytes((shape, module)) + content.ljust(6, b"\0")


def _signal(data: bytes) -> Signal:
    return Signal(*struct.unpack("<BH5s", _bytes(data)))


TEST_SIGNAL = Command("give a test signal", TEST, 0x01, _test_signal, _signal, mask=b"\xff",
                      section="10.8.1")

COMMANDS: Mapping[str, Command[..., Any]] = {
    name.strip("_").lower() + (f"_{index + 1}" if isinstance(value, tuple) else ""): command
    for name, value in list(globals().items())
    for index, command in enumerate(value if isinstance(value, tuple) else (value,))
    if isinstance(command, Command) and not name.startswith("_")}
_REQUESTS: Mapping[str, Callable[..., Request[Any]]] = {
    **{name: command.request for name, command in COMMANDS.items()},
    "read_acceleration": read_acceleration, "read_voltage": read_voltage}
# Arguments that people give as the numbers of which they are made.
_MADE_OF_NUMBERS: Mapping[str, Callable[..., Any]] = {
    "AdcConfiguration": AdcConfiguration, "StreamFormat": StreamFormat, "UsedSensors": UsedSensors}
_WORD = re.compile(r"""(?:b?'[^']*'|b?"[^"]*"|\S)+""")


def parse_request(text: str, receiver: int) -> Request[Any]:
    """Return the request that a line such as "test_signal 1" or "read_state" asks for.

    Raises:
        SettingError: There is no such command, or its arguments do not fit.
    """
    name, *words = _WORD.findall(text) or [""]
    make = _REQUESTS.get(name)
    if make is None:
        raise SettingError(f'there is no command "{name}"{suggestion(name, _REQUESTS)}')
    takes = inspect.signature(COMMANDS[name].encode if name in COMMANDS else make)
    try:
        values = [ast.literal_eval(word) for word in words]
        kinds = [parameter.annotation for parameter in takes.parameters.values()]
        if len(kinds) == 1 and kinds[0] in _MADE_OF_NUMBERS:
            values = [_MADE_OF_NUMBERS[kinds[0]](*values)]
        return make(receiver, *values)
    except (AttributeError, TypeError, ValueError, SyntaxError, struct.error) as error:
        raise SettingError(f"{name} takes {takes}, not {' '.join(words) or 'nothing'}: "
                           f"{error}") from None


# --- blocks of settings ---

@dataclass(frozen=True)
class Part:
    """What one pair of commands carries of a record.

    Attributes:
        read: Command that reads it.
        write: Command that writes it.
        read_head: First bytes of a reading request; the record's bytes are behind as many bytes of
            its answer.
        write_head: First bytes of a writing request, in front of the record's bytes.
        size: How many of the record's bytes it carries.
    """

    read: Command[..., Any]
    write: Command[..., Any]
    read_head: bytes
    write_head: bytes
    size: int


@dataclass(frozen=True)
class IcotronicRecord(Record):
    """A block of settings, read and written with one request per part."""

    parts: tuple[Part, ...]

    def read_requests(self, receiver: int) -> list[Request[bytes]]:
        """Return the requests to read this record."""
        return [part.read.with_payload(receiver, part.read_head.ljust(8, b"\0"),
                                       _cut(len(part.read_head), part.size))
                for part in self.parts]

    def decode_answers(self, answers: Sequence[bytes]) -> tuple[Raw, ...]:
        """Return the fields from the results of `read_requests`."""
        return self.unpack(b"".join(answers))

    def write_requests(self, receiver: int, values: Sequence[Raw]) -> list[Request[None]]:
        """Return the requests to write this record."""
        requests, data = [], self.pack(values)
        for part in self.parts:
            payload = part.write_head + data[:part.size]
            requests.append(part.write.with_payload(receiver, payload.ljust(8, b"\0"), _done))
            data = data[part.size:]
        return requests


def _cut(start: int, size: int) -> Callable[[bytes], bytes]:
    return lambda data: _bytes(data)[start:start + size]
