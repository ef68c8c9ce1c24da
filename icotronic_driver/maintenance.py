# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a user asks of a sensor: write, save, scan, reset, any command."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping
from typing import TypeVar

from driver_common import clocks as time
from driver_common.errors import (
    DriverError,
    FrameError,
    NoAnswerError,
    RefusedError,
    SettingError,
)
from driver_common.settings import Value
from icotronic_driver import commands, eeprom
from icotronic_driver.access import Access
from icotronic_driver.acquisition import Acquisition
from icotronic_driver.connection import Connection
from icotronic_driver.eeprom import STH_EEPROM, STU_EEPROM, Field, FieldValue
from icotronic_driver.identifier import STH_1
from icotronic_driver.line import Line
from icotronic_driver.request import Request
from icotronic_driver.sensor import Phase, SeenSensor, Sensor
from icotronic_driver.values import CalibrationElement

T = TypeVar("T")

RESET_TIMEOUT = 2.0  # s that a node may take to acknowledge a reset (field note N1)
RESET_TIME = 2.0  # s that it may take to come up (field note N1)
RATE_SETTINGS = frozenset({"adc.prescaler", "adc.acquisition_time", "adc.oversampling_rate"})


class Maintenance:
    """What a user asks for, in the thread of the bus; all of it raises DriverError."""

    def __init__(self, line: Line, sensor: Sensor, access: Access, connection: Connection,
                 acquisition: Acquisition, require: Callable[[], None],
                 lose: Callable[[DriverError], None]) -> None:
        """Serve the user of a sensor.

        Args:
            line: The bus on which it is.
            sensor: The sensor.
            access: Its settings and its EEPROM.
            connection: How it is found.
            acquisition: How it measures.
            require: Raises NoAnswerError where it is not connected.
            lose: Takes note that it is not connected any more, and why.
        """
        self._line = line
        self._sensor = sensor
        self._access = access
        self._connection = connection
        self._acquisition = acquisition
        self._require = require
        self._lose = lose

    def write(self, changes: Mapping[str, Value]) -> dict[str, Value]:
        """Write settings, all or none, and return what the sensor reports; raises DriverError."""
        self._require()
        given = RATE_SETTINGS.intersection(changes)
        if given and self._acquisition.follows_sample_rate:
            raise SettingError(f"{min(given)} follows from sample_rate; set sample_rate to 0 first")
        return self._acquisition.write(changes)

    def scan(self) -> list[SeenSensor]:
        """Return the sensors in range; a connected one hides the others."""
        if self._sensor.phase is Phase.SEARCHING:
            self._connection.look_around()
        elif self._sensor.target is not None:
            return [self._sensor.target]
        return self._sensor.seen

    def disconnect(self) -> None:
        """Stop the stream and release the sensor, so that it can sleep."""
        if self._sensor.is_connected:
            with contextlib.suppress(NoAnswerError, RefusedError, FrameError):
                self._acquisition.stop()
        if self._sensor.phase is not Phase.SEARCHING:
            self._connection.release()

    def reconnect(self) -> None:
        """Disconnect, and search again."""
        self.disconnect()
        self._lose(DriverError("reconnecting, as asked for"))
        self._sensor.due = 0.0

    def reset(self, node: int) -> None:
        """Reset the sensor or the stationary unit; the connection comes back by itself."""
        if node == STH_1:
            self._require()
        self._line.request(commands.RESET.request(node), RESET_TIMEOUT, attempts=2)
        self._lose(DriverError("reset, as asked for"))
        self._sensor.due = time.monotonic() + RESET_TIME

    def execute(self, request: Request[T]) -> T:
        """Carry out any request, and read what it may have changed; raises DriverError."""
        if request.frame.identifier.receiver == STH_1:
            self._require()
        result = self._line.request(request)
        if request.writes and self._sensor.is_connected:
            self._acquisition.read_again()
        return result

    def measure(self) -> dict[str, float]:
        """Make a calibration measurement of everything; return the results by name."""
        self._require()
        results: dict[str, float] = {}
        for element, dimension in _MEASUREMENTS:
            name = f"{element.name.lower()} {dimension}"
            with contextlib.suppress(RefusedError):
                results[name] = self._line.request(
                    commands.MEASURE.request(STH_1, element, dimension))
        with contextlib.suppress(RefusedError):
            results["temperature [°C]"] = self._line.request(
                commands.READ_TEMPERATURE.request(STH_1))
        return results

    def read_eeprom(self, node: int) -> dict[Field, FieldValue]:
        """Return all fields of the EEPROM of the sensor or the stationary unit."""
        if node == STH_1:
            self._require()
        fields = STH_EEPROM if node == STH_1 else STU_EEPROM
        return {field: self._access.read_field(node, field) for field in fields.values()}

    def unsaved(self) -> dict[Field, tuple[FieldValue, FieldValue]]:
        """Return the EEPROM fields that a save would change: (stored, new).

        These are only settings that were changed: what the sensor works with otherwise need not be
        what its EEPROM is to keep.
        """
        self._require()
        changes: dict[Field, tuple[FieldValue, FieldValue]] = {}
        for name, field in STORED.items():
            if name in self._sensor.unsaved and name in self._sensor.values:
                new = self._sensor.values[name]
                assert isinstance(new, (int, float, str))
                stored = self._access.read_field(STH_1, field)
                if field.encode(new) != _raw(field, stored):
                    changes[field] = (stored, new)
        return changes

    def save(self) -> dict[Field, tuple[FieldValue, FieldValue]]:
        """Write what differs into the EEPROM, read it back, and return what was changed.

        Raises:
            DriverError: A field was not saved; the text says which, and which were before it.
        """
        changes = self.unsaved()
        saved: list[str] = []
        for field, (_, new) in changes.items():
            try:
                self._save_field(field, new)
            except DriverError as error:
                raise type(error)(f"{field.name} was not saved: {error} (saved before: "
                                  f"{', '.join(saved) or 'nothing'})") from error
            saved.append(field.name)
        self._sensor.unsaved -= set(STORED)
        return changes

    def _save_field(self, field: Field, value: FieldValue) -> None:
        if field.name.endswith("Slope") and not value:
            raise SettingError("a slope of 0 would make every measurement the same")
        self._access.write_field(field, value)
        stored = self._access.read_field(STH_1, field)
        if _raw(field, stored) != field.encode(value):
            raise RefusedError(f"the EEPROM took {field.text(value)} but holds "
                               f"{field.text(stored)}; it may be locked")


def _raw(field: Field, value: FieldValue) -> bytes:
    """Return the bytes of a value that was read, also of a number that cannot be written."""
    try:
        return field.encode(value)
    except SettingError:
        return b""


_MEASUREMENTS = tuple(
    (element, dimension) for element, dimensions in (
        (CalibrationElement.ACCELERATION, (1, 2, 3)), (CalibrationElement.VOLTAGE, (1, 2, 3)),
        (CalibrationElement.GROUND, (1,)), (CalibrationElement.SUPPLY, (1,)),
        (CalibrationElement.REGULATED_POWER, (1,)), (CalibrationElement.AMPLIFIER_OUTPUT, (1,)))
    for dimension in dimensions)

# Settings that the EEPROM can keep, and the field that keeps them.
STORED: Mapping[str, Field] = {
    "name": STH_EEPROM["STH Name"],
    "reduced_energy.sleep_time": STH_EEPROM["Sleep Time 1"],
    "reduced_energy.advertisement_time": STH_EEPROM["Advertisement Time 1"],
    "lowest_energy.sleep_time": STH_EEPROM["Sleep Time 2"],
    "lowest_energy.advertisement_time": STH_EEPROM["Advertisement Time 2"],
    **{f"calibration.{setting}.{part.lower()}": STH_EEPROM[f"{stored}: {part}"]
       for setting, stored in zip(
           ("acceleration_x", "acceleration_y", "acceleration_z", "voltage1", "voltage2",
            "voltage3", "temperature1", "temperature2", "temperature3"), eeprom.CALIBRATED,
           strict=True)
       for part in ("Slope", "Offset")},
}
