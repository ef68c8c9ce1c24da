# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The conversation with the sensors on one wire: find, configure, measure in turn.

All of `Uc4000Bus` runs in one thread (see `driver_common.device_thread`), but for `interrupt`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from driver_common import clocks as time
from driver_common.device_bus import DeviceBus
from driver_common.errors import DriverError, FrameError, NoAnswerError, RefusedError, SettingError
from driver_common.settings import Value
from uc4000_driver.acquisition import Acquisition, make_groups
from uc4000_driver.connection import Connection
from uc4000_driver.line import Line
from uc4000_driver.listener import Listener
from uc4000_driver.maintenance import Maintenance
from uc4000_driver.sensor import Options, Sensor
from uc4000_driver.telegram import CAST, FIRST_ADDRESS, LAST_ADDRESS

DAMAGES_UNTIL_LOST = 10  # in a row; interference alone does not do that
KEEP_ALIVE = 1.0  # s between requests to a sensor that is not measuring


class Uc4000Bus(DeviceBus[Sensor]):
    """Several sensors on one wire, or one.

    Attributes:
        line: The wire.
        acquisition: Has them measure.
        maintenance: What a user may ask for, through the thread.
    """

    _listener: Listener

    def __init__(self, port: str, sensors: Iterable[Options], listener: Listener, *,
                 local_echo: str = "auto", groups: Iterable[str] = ()) -> None:
        """Prepare the bus; nothing is opened.

        Args:
            port: Device path or pyserial URL.
            sensors: How each sensor is to be used.
            listener: Told of everything that happens.
            local_echo: Whether the line returns our own bytes: "auto", "on" or "off".
            groups: Names of sensors that may measure together, such as "left right".

        Raises:
            SettingError: Addresses or groups do not fit.
        """
        super().__init__(map(Sensor, sensors), listener)
        self._check_addresses()
        self.line = Line(port, local_echo)
        self._connection = Connection(self.line, listener, alone=len(self.devices) == 1)
        self.acquisition = Acquisition(
            self.line, self.devices,
            make_groups(groups, [sensor.options.name for sensor in self.devices]), self.wants,
            listener)
        self.maintenance = Maintenance(self.line, self.devices, self._connection, self.require)

    def _check_addresses(self) -> None:
        addresses = [sensor.options.address for sensor in self.devices]
        for options in (sensor.options for sensor in self.devices):
            if len(addresses) > 1 and options.address == CAST:
                raise SettingError(f"{options.name}.address must be given, {FIRST_ADDRESS} … "
                                   f"{LAST_ADDRESS}: only a single sensor can be asked for it")
            if addresses.count(options.address) > 1:
                raise SettingError(f"{options.name}.address = {options.address} belongs to two "
                                   "sensors; each needs its own")

    # --- what the thread of the bus calls ---

    def close(self) -> None:
        """Close the port; a sensor measures only when asked, so there is nothing to stop."""
        for sensor in self.devices:
            sensor.forget()
        self.line.close()

    def interrupt(self) -> None:
        """Have the present step end soon; called from another thread."""
        self.line.interrupt()

    def resume(self) -> None:
        """Ask the sensors again."""
        self.line.resume()

    def while_waiting(self, task: Callable[[], None]) -> None:
        """Have a task done now and then in long waits; what it asks of the sensors is refused."""
        self.line.on_wait = task

    def write(self, sensor: Sensor, changes: Mapping[str, Value]) -> dict[str, Value]:
        """Write settings for `DeviceNode`, see `Maintenance.write`."""
        return self.maintenance.write(sensor, changes)

    # --- life of a sensor ---

    def _open_link(self) -> None:
        self.line.open()

    def _find(self, sensor: Sensor) -> None:
        self._connection.find(sensor)
        sensor.due = sensor.temperature_due = 0.0
        self._note_found(sensor)

    def _explained(self, sensor: Sensor, error: DriverError) -> DriverError:
        return self._connection.explained(sensor, error)

    def _attend(self, sensor: Sensor) -> None:
        """Measure, or look whether the sensor is there."""
        try:
            if sensor.misses:
                self._connection.look_again(sensor)
            if self.wants(sensor):
                self.acquisition.measure(sensor)
            else:
                self._connection.check_address(sensor, attempts=1)
                sensor.due = time.monotonic() + KEEP_ALIVE
            sensor.damages = 0
            self._note_well(sensor)
        except RefusedError as error:
            self._note_refusal(sensor, error)
        except NoAnswerError as error:
            self._note_miss(sensor, error)
        except FrameError as error:
            self._note_damage(sensor, error)

    def _start_or_stop(self, sensor: Sensor) -> None:
        """Begin or end to count the rate; a sensor measures only when asked."""
        sensor.arrivals.clear()

    def _note_damage(self, sensor: Sensor, error: FrameError) -> None:
        """Ask a sensor again that is there, but whose telegrams are damaged."""
        sensor.damages += 1
        if sensor.damages >= DAMAGES_UNTIL_LOST:
            raise error
        sensor.due = 0.0

    def _note_refusal(self, sensor: Sensor, error: RefusedError) -> None:
        """Ask a sensor that refuses ever more rarely."""
        self._complain(sensor, error)
        sensor.due = time.monotonic() + self._pause(sensor)
