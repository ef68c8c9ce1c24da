# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Requests to the sensor and to the stationary unit: who they are, settings, readings, EEPROM."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

from driver_common.errors import FrameError, NoAnswerError, RefusedError
from driver_common.settings import Raw, Record
from icotronic_driver import commands
from icotronic_driver.commands import (
    BLUETOOTH,
    CONFIGURATION,
    PRODUCT_DATA,
    SELF,
    STATISTICS,
    SYSTEM,
    IcotronicRecord,
    decode_name,
)
from icotronic_driver.eeprom import STH_EEPROM, Field, FieldValue, Status
from icotronic_driver.identifier import STH_1, STU_1, node_name
from icotronic_driver.laws import Calibration
from icotronic_driver.line import Line
from icotronic_driver.request import Command, Request
from icotronic_driver.sensor import Sensor, UnitIdentity
from icotronic_driver.streaming import AXES, supply_voltage
from icotronic_driver.values import decode_text

T = TypeVar("T")

READING_TIMEOUT = 0.3  # s that one reading may take from the others
SILENCE_LIMIT = 0.6  # s that a new unit may let us wait for answers that do not come
SILENCE_SHARE = 0.375  # of what is left of them, for the next answer
SHORTEST_WAIT = 0.02  # s, where nothing is left


class Reading(NamedTuple):
    """Something that is read now and then.

    Attributes:
        name: Its name in `Readings`.
        make_request: Returns the request.
        convert: Turns the answer into the value.
    """

    name: str
    make_request: Callable[[], Request[Any]]
    convert: Callable[[Sensor, Any], Any] = lambda sensor, value: value


READINGS = (
    Reading("rssi", lambda: commands.READ_RSSI.request(STH_1, SELF)),
    Reading("battery_voltage", lambda: commands.read_voltage(STH_1),
            lambda sensor, values: supply_voltage(values[0], sensor.adc.reference_voltage)),
    Reading("temperature", lambda: commands.READ_TEMPERATURE.request(STH_1)),
    Reading("sth_status", lambda: commands.READ_STH_STATUS.request(STH_1)),
    Reading("stu_status", lambda: commands.READ_STU_STATUS.request(STU_1)),
    Reading("sth_errors", lambda: commands.READ_STH_ERRORS.request(STH_1)),
    Reading("stu_errors", lambda: commands.READ_STU_ERRORS.request(STU_1)),
    Reading("power_cycles", lambda: commands.READ_POWER_CYCLES.request(STH_1)),
    Reading("operating_time", lambda: commands.READ_OPERATING_TIME.request(STH_1)),
    Reading("under_voltages", lambda: commands.READ_UNDER_VOLTAGES.request(STH_1)),
    Reading("watchdog_resets", lambda: commands.READ_WATCHDOG_RESETS.request(STH_1)),
)


class Access:
    """What the sensor and the stationary unit can be asked; a `RecordAccess` of the sensor.

    Everything raises DriverError where no good answer comes.
    """

    def __init__(self, line: Line) -> None:
        """Ask over this line."""
        self._line = line

    def request(self, request: Request[T]) -> T:
        """Carry out a request."""
        return self._line.request(request)

    def is_connected(self) -> bool:
        """Return whether the stationary unit has a connection to a sensor."""
        return self._line.request(commands.CHECK_CONNECTED.request(STU_1))

    def read_name_and_mac(self, node: int) -> tuple[str, str]:
        """Return who a node is, which every unit tells."""
        name = decode_name(*(self._line.request(part.request(node, SELF))
                             for part in (commands.READ_NAME_1, commands.READ_NAME_2)))
        return name, self._line.request(commands.READ_MAC.request(node, SELF))

    def take_reading(self, sensor: Sensor, reading: Reading) -> Any:
        """Return a new value of a reading; asked once only, because there will be another."""
        return reading.convert(sensor, self._line.request(reading.make_request(), READING_TIMEOUT,
                                                          attempts=1))

    # --- settings ---

    def read_record(self, record: Record) -> tuple[Raw, ...]:
        """Return the raw fields of a record of the sensor."""
        assert isinstance(record, IcotronicRecord)
        return record.decode_answers([self.request(request)
                                      for request in record.read_requests(STH_1)])

    def write_record(self, record: Record, values: tuple[Raw, ...]) -> None:
        """Write all fields of a record of the sensor."""
        assert isinstance(record, IcotronicRecord)
        for request in record.write_requests(STH_1, values):
            self.request(request)

    def require_answer(self) -> None:
        """Ask who the sensor is."""
        self.read_name_and_mac(STH_1)

    # --- EEPROM ---

    def read_field(self, node: int, field: Field) -> FieldValue:
        """Return what a field of a node's EEPROM holds."""
        return field.decode(b"".join(
            self.request(commands.READ_EEPROM.request(node, field.page, offset, length))
            for offset, length in field.chunks))

    def write_field(self, field: Field, value: FieldValue) -> None:
        """Write a field of the sensor's EEPROM."""
        data = field.encode(value)
        for offset, length in field.chunks:
            start = offset - field.offset
            self.request(commands.WRITE_EEPROM.request(
                STH_1, field.page, offset, data[start:start + length]))

    def eeprom_calibrations(self) -> dict[str, Calibration]:
        """Return the calibration factors in the sensor's EEPROM, by axis."""
        calibrations = {}
        for axis in AXES:
            pair = [self.read_field(STH_1, STH_EEPROM[f"Acceleration {axis.upper()}: {part}"])
                    for part in ("Slope", "Offset")]
            calibrations[axis] = Calibration(*map(float, pair))
        return calibrations


class Survey(Access):
    """Finds out what units that were just connected have of what not every unit has.

    A real unit stays silent on a command that it does not take (field note N2). So each command is
    asked once and for a short time, ever shorter with every silence, and is not asked again with
    other arguments where it stayed silent.
    """

    def __init__(self, line: Line) -> None:
        """Begin with all of the patience."""
        super().__init__(line)
        self._patience = SILENCE_LIMIT
        self._silent: set[tuple[int, ...]] = set()

    def request(self, request: Request[T]) -> T:
        """Carry out a request; raises RefusedError where the unit has nothing of the kind."""
        kind = _kind(request)
        missing = f"{node_name(kind[0])} has nothing to {request.name}"
        if kind in self._silent:
            raise RefusedError(missing)
        wait = max(SHORTEST_WAIT, SILENCE_SHARE * self._patience)
        try:
            return self._line.request(request, wait, attempts=1)
        except FrameError as error:
            raise RefusedError(missing) from error
        except NoAnswerError as error:
            self._silent.add(kind)
            self._patience -= wait
            raise RefusedError(missing) from error

    def require_answer(self) -> None:
        """Let it be: how often it is silent is counted already."""

    def identify(self, node: int) -> UnitIdentity:
        """Return who a node is; raises NoAnswerError where it does not even tell its name."""
        name, mac = self.read_name_and_mac(node)

        def ask(command: Command[[], T]) -> T | None:
            try:
                return self.request(command.request(node))
            except RefusedError:
                return None

        firmware = ask(commands.READ_FIRMWARE_VERSION)
        serial = [ask(part) for part in commands.READ_SERIAL_NUMBER]
        return UnitIdentity(
            name, mac, ask(commands.READ_GTIN), ask(commands.READ_HARDWARE_VERSION),
            firmware, ask(commands.READ_RELEASE_NAME),
            None if None in serial else decode_text(b"".join(part or b"" for part in serial)),
            ask(commands.READ_PRODUCTION_DATE))

    def eeprom_warning(self) -> str:
        """Return why the sensor's EEPROM will not keep what it holds, "" where it will.

        See section 8.3.1.1.1.
        """
        try:
            byte = self.read_field(STH_1, STH_EEPROM["EEPROM Status"])
        except RefusedError:
            return ""
        assert isinstance(byte, int)
        if Status.of(byte) is not Status.UNINITIALIZED:
            return ""
        return (f"the sensor's EEPROM is not initialised (0x{byte:02X}): at its next reset it "
                "takes default values")

    def take_reading(self, sensor: Sensor, reading: Reading) -> Any:
        """Return the first value of a reading, None where the unit has none."""
        try:
            return reading.convert(sensor, self.request(reading.make_request()))
        except RefusedError:
            return None


# Of two commands that say the same of different things, a unit has both or none.
_PAIRS = {(CONFIGURATION, 0x61): (CONFIGURATION, 0x60), (SYSTEM, 0x06): (SYSTEM, 0x05),
          (*BLUETOOTH, 15): (*BLUETOOTH, 13)}


def _kind(request: Request[Any]) -> tuple[int, ...]:
    """Return who is asked for what, whatever the arguments; of some blocks all is alike."""
    identifier, data = request.frame.identifier, request.frame.data
    command: tuple[int, ...] = identifier.block, identifier.block_command
    if identifier.block in (PRODUCT_DATA, STATISTICS):
        command = command[:1]
    elif command == BLUETOOTH:
        command = *command, data[0]
    return identifier.receiver, *_PAIRS.get(command, command)
