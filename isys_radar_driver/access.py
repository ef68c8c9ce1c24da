# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Requests to one radar on the line: commands, and the records of its settings."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from driver_common import clocks as time
from driver_common.errors import FrameError, NoAnswerError, RefusedError
from driver_common.settings import Raw, Record, RecordAccess
from isys_radar_driver import commands
from isys_radar_driver.commands import Command, IsysRecord, Location
from isys_radar_driver.frames import Frame
from isys_radar_driver.line import DAMAGED_ATTEMPTS, REPLY_TIMEOUT, Line
from isys_radar_driver.radar import Radar

T = TypeVar("T")

EEPROM_TIMEOUT = 1.0  # s, writing the EEPROM takes its time
ATTEMPTS = 2


class Access:
    """What can be asked of a radar; every method raises DriverError.

    Attributes:
        line: The serial line.
    """

    def __init__(self, line: Line) -> None:
        """Ask over this line."""
        self.line = line

    def execute(self, radar: Radar, command: Command[T], timeout: float = 0.0) -> T:
        """Carry out a command and return its result."""
        return self.timed(radar, command, timeout)[0]

    def timed(self, radar: Radar, command: Command[T], timeout: float = 0.0,
              attempts: int = ATTEMPTS) -> tuple[T, int]:
        """Carry out a command; return its result, and the host's time in ns when the reply began.

        Args:
            radar: Who is asked.
            command: What is asked.
            timeout: Time in s until the reply begins; 0 = what the command needs.
            attempts: How often to ask.
        """
        if not timeout:
            writes_eeprom = command.function_code == commands.SAVE_ALL_SETTINGS.function_code
            timeout = EEPROM_TIMEOUT if writes_eeprom else REPLY_TIMEOUT
        try:
            return self.exchange(radar, command.request(radar.address),
                                 lambda frame: command.decode(frame.pdu), timeout,
                                 attempts=attempts)
        except RefusedError as error:
            raise RefusedError(f"cannot {command.name}: {error}") from None

    def read_record(self, radar: Radar, record: IsysRecord, location: Location,
                    attempts: int = ATTEMPTS) -> tuple[Raw, ...]:
        """Return the raw fields of a settings record."""
        return self.exchange(radar, record.read_request(radar.address, location),
                             lambda frame: record.decode_reply(frame.pdu, location),
                             REPLY_TIMEOUT, attempts=attempts)[0]

    def write_record(self, radar: Radar, record: IsysRecord, values: tuple[Raw, ...],
                     location: Location = Location.RAM) -> None:
        """Write the raw fields of a settings record; with EEPROM, to the RAM as well."""
        self.exchange(radar, record.write_request(radar.address, values, location),
                      acknowledged, REPLY_TIMEOUT + EEPROM_TIMEOUT)

    def records(self, radar: Radar, location: Location = Location.RAM) -> RecordAccess:
        """Return the records of a radar, for `read_settings` and `write_settings`."""
        return _Records(self, radar, location)

    def exchange(self, radar: Radar, request: Frame, decode: Callable[[Frame], T], timeout: float,
                 sources: tuple[int, ...] = (), attempts: int = ATTEMPTS,
                 damaged_attempts: int = DAMAGED_ATTEMPTS) -> tuple[T, int]:
        """Exchange a request with a radar, see `Line.exchange`."""
        try:
            reply = self.line.exchange(request, decode, timeout, sources=sources,
                                       attempts=attempts, damaged_attempts=damaged_attempts)
        except RefusedError:
            radar.answered = time.monotonic()
            radar.statistics.refusals += 1
            raise
        radar.answered = time.monotonic()
        return reply

    def optional(self, radar: Radar, command: Command[T]) -> T | None:
        """Return the result of a command, or None where the radar refuses it or stays silent."""
        try:
            return self.timed(radar, command, attempts=1)[0]
        except (RefusedError, NoAnswerError, FrameError):
            return None

    def answers_at(self, radar: Radar, address: int) -> bool:
        """Whether a device answers at an address."""
        try:
            self.exchange(radar, commands.READ_DEVICE_NAME.request(address), lambda frame: None,
                          REPLY_TIMEOUT)
        except NoAnswerError:
            return False
        return True


def acknowledged(frame: Frame) -> None:
    """Accept a reply without data; raises FrameError."""
    if frame.pdu:
        raise FrameError(f"acknowledge carries {len(frame.pdu)} bytes: {frame}")


class _Records:
    """The records of one radar in one location."""

    def __init__(self, access: Access, radar: Radar, location: Location) -> None:
        self._access = access
        self._radar = radar
        self._location = location

    def read_record(self, record: Record) -> tuple[Raw, ...]:
        assert isinstance(record, IsysRecord)
        return self._access.read_record(self._radar, record, self._location)

    def write_record(self, record: Record, values: tuple[Raw, ...]) -> None:
        assert isinstance(record, IsysRecord)
        self._access.write_record(self._radar, record, values, self._location)

    def require_answer(self) -> None:
        self._access.execute(self._radar, commands.READ_DEVICE_NAME)
