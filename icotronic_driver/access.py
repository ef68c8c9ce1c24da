"""Requests to the sensor and to the stationary unit: who they are, settings, EEPROM."""

from __future__ import annotations

import contextlib
from typing import TypeVar

from driver_common.errors import FrameError, RefusedError
from driver_common.settings import Raw, Record
from icotronic_driver import commands
from icotronic_driver.commands import SELF, IcotronicRecord, decode_name
from icotronic_driver.eeprom import STH_EEPROM, Field, FieldValue, Status
from icotronic_driver.identifier import STH_1, STU_1
from icotronic_driver.line import Line
from icotronic_driver.request import Command
from icotronic_driver.sensor import UnitIdentity
from icotronic_driver.streaming import AXES, Calibration
from icotronic_driver.values import decode_text

T = TypeVar("T")


class Access:
    """What the sensor and the stationary unit can be asked; a `RecordAccess` of the sensor.

    Everything raises DriverError where no good answer comes.
    """

    def __init__(self, line: Line) -> None:
        """Ask over this line."""
        self._line = line

    def is_connected(self) -> bool:
        """Return whether the stationary unit has a connection to a sensor."""
        return self._line.request(commands.CHECK_CONNECTED.request(STU_1))

    def identify(self, node: int) -> UnitIdentity:
        """Return who a node is."""
        def ask(command: Command[[], T]) -> T | None:
            with contextlib.suppress(RefusedError, FrameError):
                return self._line.request(command.request(node))
            return None

        name = decode_name(*(self._line.request(part.request(node, SELF))
                             for part in (commands.READ_NAME_1, commands.READ_NAME_2)))
        serial = [ask(part) for part in commands.READ_SERIAL_NUMBER]
        return UnitIdentity(
            name, self._line.request(commands.READ_MAC.request(node, SELF)),
            ask(commands.READ_GTIN), ask(commands.READ_HARDWARE_VERSION),
            ask(commands.READ_FIRMWARE_VERSION), ask(commands.READ_RELEASE_NAME),
            decode_text(b"".join(part or b"" for part in serial)),
            ask(commands.READ_PRODUCTION_DATE))

    # --- settings ---

    def read_record(self, record: Record) -> tuple[Raw, ...]:
        """Return the raw fields of a record of the sensor."""
        assert isinstance(record, IcotronicRecord)
        return record.decode_answers([self._line.request(request)
                                      for request in record.read_requests(STH_1)])

    def write_record(self, record: Record, values: tuple[Raw, ...]) -> None:
        """Write all fields of a record of the sensor."""
        assert isinstance(record, IcotronicRecord)
        for request in record.write_requests(STH_1, values):
            self._line.request(request)

    # --- EEPROM ---

    def read_field(self, node: int, field: Field) -> FieldValue:
        """Return what a field of a node's EEPROM holds."""
        return field.decode(b"".join(
            self._line.request(commands.READ_EEPROM.request(node, field.page, offset, length))
            for offset, length in field.chunks))

    def write_field(self, field: Field, value: FieldValue) -> None:
        """Write a field of the sensor's EEPROM."""
        data = field.encode(value)
        for offset, length in field.chunks:
            start = offset - field.offset
            self._line.request(commands.WRITE_EEPROM.request(
                STH_1, field.page, offset, data[start:start + length]))

    def eeprom_warning(self) -> str:
        """Return why the sensor's EEPROM will not keep what it holds, "" where it will.

        See section 8.3.1.1.1.
        """
        byte = self.read_field(STH_1, STH_EEPROM["EEPROM Status"])
        assert isinstance(byte, int)
        if Status.of(byte) is not Status.UNINITIALIZED:
            return ""
        return (f"the sensor's EEPROM is not initialised (0x{byte:02X}): at its next reset it "
                "takes default values")

    def eeprom_calibrations(self) -> dict[str, Calibration]:
        """Return the calibration factors in the sensor's EEPROM, by axis."""
        calibrations = {}
        for axis in AXES:
            pair = [self.read_field(STH_1, STH_EEPROM[f"Acceleration {axis.upper()}: {part}"])
                    for part in ("Slope", "Offset")]
            calibrations[axis] = Calibration(*map(float, pair))
        return calibrations
