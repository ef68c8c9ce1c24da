# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Requests to one sensor on the wire: asked again, counted; and its records."""

from __future__ import annotations

import contextlib
from typing import TypeVar

from driver_common import advice
from driver_common.errors import FrameError, NoAnswerError, RefusedError
from driver_common.settings import UNKNOWN, Raw, Record
from uc4000_driver.commands import READ_ADDRESS, Command, Uc4000Record
from uc4000_driver.line import (
    Answer,
    DamagedRequestError,
    LateReplyError,
    Line,
    TelegramRefusedError,
)
from uc4000_driver.sensor import Sensor

T = TypeVar("T")

ATTEMPTS = 3


class Access:
    """What can be asked of one sensor; its records are for `read_settings` and `write_settings`."""

    def __init__(self, line: Line, sensor: Sensor) -> None:
        """Take the wire and the sensor."""
        self._line = line
        self._sensor = sensor

    def execute(self, command: Command[T], attempts: int = ATTEMPTS) -> T:
        """Carry out a command; raises DriverError."""
        return self.ask(command, attempts).value

    def ask(self, command: Command[T], attempts: int = ATTEMPTS) -> Answer[T]:
        """Carry out a command, again where the transmission fails; see `Line.ask`."""
        for _ in range(attempts - 1):
            with contextlib.suppress(NoAnswerError, FrameError):
                return self._ask_once(command)
        return self._ask_once(command)

    def _ask_once(self, command: Command[T]) -> Answer[T]:
        """Ask, and count what goes wrong."""
        sensor = self._sensor
        try:
            return self._line.ask(sensor.address, command, str(sensor))
        except TelegramRefusedError as error:
            sensor.statistics.refusals[error.code] += 1
            raise
        except (NoAnswerError, LateReplyError):
            sensor.statistics.timeouts += 1
            raise
        except DamagedRequestError:
            sensor.statistics.damaged_requests += 1
            raise
        except FrameError as error:
            sensor.statistics.damaged += 1
            why = advice.SAME_ADDRESS.filled(address=sensor.address).remedy
            raise FrameError(f"{error}; {why}") from None

    def read_record(self, record: Record) -> tuple[Raw, ...]:
        """Return what a record holds; where it cannot be read, what was acknowledged."""
        assert isinstance(record, Uc4000Record)
        if record.write_only:
            return (self._sensor.acknowledged.get(record.name, UNKNOWN),)
        return (self.execute(record.read()),)

    def require_answer(self) -> None:
        """Ask for the address; raises DriverError."""
        self.execute(READ_ADDRESS)

    def write_record(self, record: Record, values: tuple[Raw, ...]) -> None:
        """Write a record; raises RefusedError where the sensor stores something else."""
        assert isinstance(record, Uc4000Record)
        self._sensor.acknowledged.pop(record.name, None)
        if values == (UNKNOWN,):
            return  # nobody knows what was there before
        command = record.write(values)
        stored = self.execute(command)
        if record.write_only:  # its reply is not shown in the manual
            self._sensor.acknowledged[record.name] = values[0]
        elif stored != values[0]:
            raise RefusedError(f"{self._sensor} cannot {command.name}: it stored code {stored} "
                               f"instead of {values[0]!r}")
