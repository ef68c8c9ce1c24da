# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a user asks for beside measuring: settings, identity, another address."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping, Sequence

from driver_common.errors import DriverError, FrameError, NoAnswerError, SettingError
from driver_common.settings import Value
from uc4000_driver import commands
from uc4000_driver.access import Access
from uc4000_driver.connection import Connection
from uc4000_driver.line import Line
from uc4000_driver.sensor import Identity, Sensor


class Maintenance:
    """Carries out what users ask of connected sensors; all in the thread of the bus."""

    def __init__(self, line: Line, sensors: Sequence[Sensor], connection: Connection,
                 require: Callable[[Sensor], None]) -> None:
        """Prepare; nothing is sent.

        Args:
            line: The wire.
            sensors: All sensors on it.
            connection: Identifies them.
            require: Raises NoAnswerError where a sensor is not connected.
        """
        self._line = line
        self._sensors = sensors
        self._connection = connection
        self._require = require

    def write(self, sensor: Sensor, changes: Mapping[str, Value]) -> dict[str, Value]:
        """Write settings, all or none, and return what the sensor reports.

        Raises:
            DriverError: Not connected, a bad value, a refusal or no answer.
        """
        self._require(sensor)
        return sensor.write(Access(self._line, sensor), changes)

    def identify(self, sensor: Sensor) -> Identity:
        """Ask the sensor who it is; raises DriverError."""
        self._require(sensor)
        sensor.identity = self._connection.identify(sensor)
        return sensor.identity

    def change_address(self, sensor: Sensor, address: int) -> None:
        """Give the sensor another address, for good, and follow it.

        Raises:
            SettingError: The address is not allowed or taken.
            DriverError: The sensor refused, or does not answer at the new address.
        """
        self._require(sensor)
        command = commands.write_address(address)
        if address == sensor.address:
            raise SettingError(f"the sensor has address {address} already")
        if any(other is not sensor and other.options.address == address
               for other in self._sensors) or self._connection.answers_at(
                    address, silences=2):
            raise SettingError(f"address {address} belongs to another sensor")
        with contextlib.suppress(NoAnswerError, FrameError):  # what counts is where it answers
            Access(self._line, sensor).execute(command)
        old, sensor.address = sensor.address, address
        try:
            self._connection.check_address(sensor)
        except DriverError:
            sensor.address = old
            raise
        sensor.options.address = address
