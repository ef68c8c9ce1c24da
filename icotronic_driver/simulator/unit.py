# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a simulated sensor and a simulated stationary unit have in common: commands and EEPROM."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable, Iterator, Mapping

from driver_common.errors import SettingError
from icotronic_driver.commands import (
    BLUETOOTH,
    CONFIGURATION,
    EEPROM,
    EEPROM_CHUNK,
    PRODUCT_DATA,
    STATISTICS,
    STREAMING,
    SYSTEM,
    TEST,
)
from icotronic_driver.eeprom import PAGE_SIZE, Field, FieldValue, Status
from icotronic_driver.eeprom import PRODUCT_DATA as PRODUCT_PAGE
from icotronic_driver.eeprom import STATISTICS as STATISTICS_PAGE
from icotronic_driver.identifier import SPU_1, Identifier
from icotronic_driver.values import CodeLocation, NetworkState

BOOT_TIME = 0.2  # s without answers after a reset
STARTUP_TIME = 0.1  # s after it in which a node says it starts up

NOT_AVAILABLE, GENERAL_ERROR, WRITE_NOT_ALLOWED, UNSUPPORTED_FORMAT = 1, 2, 3, 4  # section 10.9


UNUSED = {(CONFIGURATION, 0x60), (CONFIGURATION, 0x61), (CONFIGURATION, 0xC0)}
NEEDED = {(SYSTEM, 0x01), (STREAMING, 0x00),
          *((*BLUETOOTH, number) for number in (1, 2, 5, 6, 7, 8, 9, 12, 17, 18))}
SILENT_ON: Mapping[str, Callable[[tuple[int, ...]], bool]] = {
    "nothing": lambda command: False,
    "unused": lambda command: command in UNUSED or command[0] in (STATISTICS, PRODUCT_DATA),
    "optional": lambda command: command not in NEEDED}


class Refusal(Exception):  # noqa: N818
    """The node answers with an error acknowledgement."""

    def __init__(self, number: int, *details: int) -> None:
        """Take the number of section 10.9 and the bytes behind it."""
        self.payload = bytes((number, *details)).ljust(8, b"\0")


class SimulatedEeprom:
    """Pages of 256 bytes with fields in them.

    Attributes:
        fields: The fields, by name.
        writes: Write requests since the first power-on.
    """

    def __init__(self, fields: dict[str, Field]) -> None:
        """Fill it with the defaults."""
        self.fields = fields
        self.writes = 0
        self._pages: dict[int, bytearray] = {}
        for each in fields.values():
            if each.default is not None:
                self[each.name] = each.default

    def __getitem__(self, name: str) -> FieldValue:
        """Return the value of a field."""
        each = self.fields[name]
        return each.decode(self.read(each.page, each.offset, each.length))

    def __setitem__(self, name: str, value: FieldValue) -> None:
        """Change a field, behind the protocol's back."""
        each = self.fields[name]
        self._store(each.page, each.offset, each.encode(value))

    def number(self, name: str) -> int:
        """Return the value of a field that is a whole number."""
        value = self[name]
        assert isinstance(value, int)
        return value

    def read(self, page: int, offset: int, length: int) -> bytes:
        """Return bytes of a page."""
        return bytes(self._page(page)[offset:offset + length])

    def write(self, page: int, offset: int, content: bytes) -> None:
        """Write as the protocol does; raises Refusal where the EEPROM is locked."""
        end = offset + len(content)
        if Status.of(self.number("EEPROM Status")) is Status.LOCKED and any(
                each.read_only and each.page == page
                and each.offset < end and offset < each.offset + each.length
                for each in self.fields.values()):
            raise Refusal(WRITE_NOT_ALLOWED)
        self.writes += 1
        self._store(page, offset, content)

    def initialize(self) -> None:
        """Store the defaults of the first page, as a reset does where they never were."""
        if Status.of(self.number("EEPROM Status")) is Status.UNINITIALIZED:
            for each in self.fields.values():
                if each.page == 0 and each.default is not None:
                    self[each.name] = each.default

    def _page(self, page: int) -> bytearray:
        return self._pages.setdefault(page, bytearray(PAGE_SIZE))

    def _store(self, page: int, offset: int, content: bytes) -> None:
        self._page(page)[offset:offset + len(content)] = content


Handler = Callable[[bytes, float], bytes | None]


class SimulatedNode:
    """What sensors and stationary units have in common, without I/O.

    Attributes:
        number: Node number.
        mac: MAC address.
        eeprom: Its EEPROM.
        state: Its network state, as far as it was set.
        refuse: Commands, as (block, block command), which it refuses although it could.
        ignore: Those to which it stays silent, as real units do (field note N2).
    """

    def __init__(self, number: int, mac: str, fields: dict[str, Field], name_field: str) -> None:
        """Power it on for the first time."""
        self.number = number
        self.mac = mac
        self.eeprom = SimulatedEeprom(fields)
        self.refuse: set[tuple[int, int]] = set()
        self.ignore: set[tuple[int, ...]] = set()
        self._name_field = name_field
        self._host = SPU_1
        self._handlers: dict[tuple[int, int], Handler] = {
            (SYSTEM, 0x01): self._reset, (SYSTEM, 0x02): self._state_command,
            (SYSTEM, 0x05): self._node_status, (SYSTEM, 0x06): self._error_status,
            BLUETOOTH: self._bluetooth,
            (STATISTICS, 0x00): self._power_cycles, (STATISTICS, 0x01): self._operating_time,
            (STATISTICS, 0x02): lambda _, now: self._counter("Under Voltage Counter"),
            (STATISTICS, 0x03): lambda _, now: self._counter("Watchdog Reset Counter"),
            (STATISTICS, 0x04): lambda _, now: self.eeprom.read(STATISTICS_PAGE, 20, 8),
            (EEPROM, 0x00): self._read_eeprom, (EEPROM, 0x01): self._write_eeprom,
            (EEPROM, 0x20): lambda _, now: struct.pack("<II", 0, self.eeprom.writes),
            (TEST, 0x01): lambda payload, now: payload,
        }
        for part in range(PAGE_SIZE // 8):  # the page of section 8.2.1.2 in pieces of 8 bytes
            self._handlers[PRODUCT_DATA, part] = self._product_data(part)
        self._fill_product_data()
        self.boot(time.monotonic() - BOOT_TIME - STARTUP_TIME)

    @property
    def name(self) -> str:
        """Name under which it advertises."""
        return str(self.eeprom[self._name_field])

    @name.setter
    def name(self, name: str) -> None:
        self.eeprom[self._name_field] = name

    def stay_silent(self, on: str) -> None:
        """Stay silent on some commands: "nothing", "unused" or "optional" ones.

        Unused are those that the vendor's client never sends, optional those without which a sensor
        can be found, connected and streamed from.
        """
        try:
            self.ignore = {command for command in self._commands() if SILENT_ON[on](command)}
        except KeyError:
            raise SettingError(f"there is no silence on {on!r}, only on "
                               f"{', '.join(SILENT_ON)}") from None

    def _commands(self) -> Iterator[tuple[int, ...]]:
        """Yield all commands, those of Bluetooth with their sub-command."""
        for command in self._handlers:
            yield from ([(*command, number) for number in range(256)] if command == BLUETOOTH
                        else [command])

    def boot(self, now: float) -> None:
        """Lose the RAM and begin anew; a reset counts as power-on (section 8.2.1.3.1)."""
        self.state = NetworkState.OPERATING
        self.booted = now
        self.eeprom.initialize()
        self.eeprom["Power On Cycles"] = self.eeprom.number("Power On Cycles") + 1

    def is_up(self, now: float) -> bool:
        """Whether it has booted."""
        return now >= self.booted + BOOT_TIME

    def answer(self, request: Identifier, payload: bytes, now: float,
               ) -> tuple[bool, bytes] | None:
        """Return whether the answer is an error, and its payload; None where there is none."""
        command = request.block, request.block_command
        handler = self._handlers.get(command)
        self._host = request.sender
        if command in self.ignore or (
                command == BLUETOOTH and (*command, payload[0]) in self.ignore):
            return None
        try:
            if handler is None or command in self.refuse:
                raise Refusal(NOT_AVAILABLE)
            answer = handler(payload.ljust(8, b"\0"), now)
        except Refusal as refusal:
            return True, refusal.payload
        return None if answer is None else (False, answer)

    def _fill_product_data(self) -> None:
        versions = {"Hardware Version": (1, 4, 0), "Firmware Version": (2, 1, 10)}
        for name, version in versions.items():
            for part, value in zip(("Major", "Minor", "Patch"), version, strict=True):
                self.eeprom[f"{name}: {part}"] = value
        for name, text in (("Year", "2021"), ("Month", "10"), ("Day", "05")):
            self.eeprom[f"Production Date: {name}"] = text
        self.eeprom["Batch Number"] = 1

    def _product_data(self, part: int) -> Handler:
        return lambda payload, now: self.eeprom.read(PRODUCT_PAGE, 8 * part, 8)

    def _reset(self, payload: bytes, now: float) -> bytes:
        self.boot(now)
        return b""

    def _state_command(self, payload: bytes, now: float) -> bytes:
        location, state = payload[0] >> 4 & 3, NetworkState(payload[0] & 7)
        if payload[0] & 0x80:
            if location == CodeLocation.BOOTLOADER:
                raise Refusal(0, 2)  # wrong subscriber
            if state not in (NetworkState.STANDBY, NetworkState.OPERATING,
                             NetworkState.NO_CHANGE):
                raise Refusal(0, 1)  # set state not available
            if state is not NetworkState.NO_CHANGE:
                self.state = state
        return bytes((payload[0] & 0x80 | CodeLocation.APPLICATION << 4
                      | self._network_state(now),))

    def _network_state(self, now: float) -> NetworkState:
        starting = now < self.booted + BOOT_TIME + STARTUP_TIME
        return NetworkState.STARTUP if starting else self.state

    def _node_status(self, payload: bytes, now: float) -> bytes:
        word = self._network_state(now) << 1 | self._status_bits()
        if any(payload[4:]):
            raise Refusal(1, 0, 0, *struct.pack("<I", word), 0)  # using the mask is not allowed
        return struct.pack("<II", word, 0)

    def _error_status(self, payload: bytes, now: float) -> bytes:
        if any(payload[4:]):
            raise Refusal(1)
        return bytes(8)

    def _status_bits(self) -> int:
        return 0

    def _bluetooth(self, payload: bytes, now: float) -> bytes:
        raise NotImplementedError

    def _name_part(self, subcommand: int) -> bytes:
        text = self.eeprom.read(0, 1, 8)
        return (text[:6] if subcommand == 5 else text[6:]).ljust(6, b"\0")

    def _write_name_part(self, subcommand: int, payload: bytes) -> None:
        if subcommand == 3:  # the second part becomes empty, section 10.2.6
            self.eeprom.write(0, 1, payload[2:8] + bytes(2))
        else:
            self.eeprom.write(0, 7, payload[2:4])

    def _energy(self, subcommand: int, payload: bytes) -> bytes:
        """Read or write the times of an energy mode; zeros are a read (section 10.2.6)."""
        offset = 9 if subcommand in (13, 14) else 15
        if subcommand in (14, 16) and any(payload[2:8]):
            self.eeprom.write(0, offset, payload[2:8])
        return self.eeprom.read(0, offset, 6)

    def _counter(self, name: str) -> bytes:
        return struct.pack(">II", self.eeprom.number(name), 0)

    def _power_cycles(self, payload: bytes, now: float) -> bytes:
        return struct.pack(">II", self.eeprom.number("Power On Cycles"),
                           self.eeprom.number("Power Off Cycles"))

    def _operating_time(self, payload: bytes, now: float) -> bytes:
        since_reset = max(0, int(now - self.booted))
        return struct.pack(">II", since_reset, self.eeprom.number("Operating Time") + since_reset)

    def _read_eeprom(self, payload: bytes, now: float) -> bytes:
        page, offset, length = self._area(payload)
        content = self.eeprom.read(page, offset, length)
        return payload[:3] + b"\0" + content.ljust(EEPROM_CHUNK, b"\0")

    def _write_eeprom(self, payload: bytes, now: float) -> bytes:
        page, offset, length = self._area(payload)
        self.eeprom.write(page, offset, payload[4:4 + length])
        return payload

    def _area(self, payload: bytes) -> tuple[int, int, int]:
        page, offset, length = payload[:3]
        if not 1 <= length <= EEPROM_CHUNK or offset + length > PAGE_SIZE:
            raise Refusal(UNSUPPORTED_FORMAT)
        return page, offset, length
