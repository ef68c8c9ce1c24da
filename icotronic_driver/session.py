# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The conversation with a sensor behind a stationary unit: find, connect, configure, stream.

The stationary unit (STU) sits on the bus, the sensor (STH) behind its radio. All of `IcotronicBus`
runs in one thread (see `driver_common.device_thread`), but for `interrupt`.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from functools import partial

from driver_common.device_bus import DeviceBus
from driver_common.errors import DriverError, NoAnswerError
from driver_common.settings import Value
from icotronic_driver.access import Access
from icotronic_driver.acquisition import Acquisition
from icotronic_driver.connection import Connection
from icotronic_driver.line import Line
from icotronic_driver.listener import Listener
from icotronic_driver.maintenance import Maintenance
from icotronic_driver.sensor import Options, Phase, Sensor


class IcotronicBus(DeviceBus[Sensor]):
    """A stationary unit on a CAN bus, and one sensor behind it.

    Attributes:
        line: The CAN bus.
        sensor: The sensor, the only one of `devices`.
        acquisition: How it measures.
        maintenance: What a user can ask for, through the thread.
    """

    def __init__(self, line: Line, options: Options, listener: Listener) -> None:
        """Prepare the bus; nothing is opened."""
        self.line = line
        self.sensor = sensor = Sensor(options)
        super().__init__([sensor], listener)
        self._note = self._note_of(sensor)
        access = Access(line)
        self._connection = Connection(line, sensor, access, self._note)
        self.acquisition = Acquisition(line, sensor, access, listener,
                                       partial(self.wants, sensor))
        self.maintenance = Maintenance(line, sensor, access, self._connection, self.acquisition,
                                       partial(self.require, sensor), partial(self._lose, sensor))
        self._told_buffer = False

    def close(self) -> None:
        """Leave the sensor stopped and disconnected, and close the bus."""
        self.line.resume(hurried=True)
        if self.line.is_open:
            with contextlib.suppress(DriverError):
                self.maintenance.disconnect()
        self.acquisition.end_stream()
        self.sensor.forget()
        self.line.close()

    def interrupt(self) -> None:
        """Have the present step end soon; called from another thread."""
        self.line.interrupt()

    def resume(self) -> None:
        """Ask the sensor again."""
        self.line.resume()

    def write(self, sensor: Sensor, changes: Mapping[str, Value]) -> dict[str, Value]:
        """Write settings, all or none, and return what the sensor reports; raises DriverError."""
        return self.maintenance.write(changes)

    def _open_link(self) -> None:
        self.line.open()
        warning = self.line.buffer_warning
        if warning and not self._told_buffer:
            self._note(warning, warning=True)
            self._told_buffer = True
        self._connection.begin()

    def _find(self, sensor: Sensor) -> None:
        if self._connection.advance():
            self.acquisition.configure()
            self._note_found(sensor)
            self.acquisition.start_or_stop()

    def _attend(self, sensor: Sensor) -> None:
        self.acquisition.attend()

    def _start_or_stop(self, sensor: Sensor) -> None:
        self.acquisition.start_or_stop()

    def _lose(self, sensor: Sensor, error: DriverError) -> None:
        """Note that the sensor is not there; look for it more and more rarely."""
        self.acquisition.end_stream()
        if sensor.phase in (Phase.GREETING, Phase.CONNECTED):
            with contextlib.suppress(DriverError):
                self._connection.release()
        if sensor.phase is not Phase.SEARCHING:
            self._connection.begin()
        sensor.time_outs += isinstance(error, NoAnswerError)
        super()._lose(sensor, error)
