# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Finding a sensor on the wire, and whether it is still there and as it was."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial

from driver_common import advice
from driver_common.device_bus import Listener
from driver_common.errors import (
    DriverError,
    FrameError,
    NoAnswerError,
    RefusedError,
    WrongDeviceError,
)
from driver_common.settings import UNKNOWN
from uc4000_driver import commands
from uc4000_driver.access import ATTEMPTS, Access
from uc4000_driver.line import Line
from uc4000_driver.sensor import PRODUCT, Identity, Sensor
from uc4000_driver.settings import ALL_SETTINGS
from uc4000_driver.telegram import CAST, FIRST_ADDRESS, LAST_ADDRESS


class Connection:
    """Finds, identifies and configures the sensors on a wire."""

    def __init__(self, line: Line, listener: Listener[Sensor], *, alone: bool) -> None:
        """Prepare; nothing is sent.

        Args:
            line: The wire.
            listener: Told what is worth a line in the log.
            alone: Whether only one sensor is expected on the wire.
        """
        self._line = line
        self._listener = listener
        self._alone = alone

    def find(self, sensor: Sensor) -> None:
        """Find the sensor, identify and configure it; raises DriverError."""
        if sensor.options.address == CAST:
            sensor.address = self._ask_address()
        self.check_address(sensor, attempts=1)
        sensor.identity = self.identify(sensor)
        sensor.values = {}  # it may be another one
        try:
            self._read_all(sensor)
            self._make_as_wanted(sensor)
        except DriverError:
            sensor.identity = None
            raise

    def identify(self, sensor: Sensor) -> Identity:
        """Ask the sensor who it is; raises DriverError."""
        access = Access(self._line, sensor)
        version = access.execute(commands.READ_VERSION)
        if not version.startswith("HW"):
            raise WrongDeviceError(f"{sensor} says that its version is {version!r}, which is not "
                                   f"that of a {PRODUCT}; connect the right device")
        return Identity(version, access.execute(commands.READ_SERIAL_NUMBER))

    def check_address(self, sensor: Sensor, attempts: int = ATTEMPTS) -> None:
        """Ask the sensor for its address; raises DriverError."""
        address = Access(self._line, sensor).execute(commands.READ_ADDRESS, attempts)
        if address != sensor.address:
            raise FrameError(f"{sensor} says that its address is {address}")

    def look_again(self, sensor: Sensor) -> None:
        """Look after a silence whether the sensor is as it was: it may have lost its settings."""
        self.check_address(sensor, attempts=1)
        before = sensor.values
        self._read_all(sensor)
        if sensor.values != before:
            sensor.acknowledged.clear()  # it must be taken for lost as well
            self._read_all(sensor)
            self._make_as_wanted(sensor)
            self._listener.on_values(sensor)

    def _read_all(self, sensor: Sensor) -> None:
        sensor.read_all(Access(self._line, sensor), ALL_SETTINGS,
                        partial(self._listener.on_note, sensor))

    def _make_as_wanted(self, sensor: Sensor) -> None:
        note = partial(self._listener.on_note, sensor)
        for name, value in sensor.values.items():
            if value == UNKNOWN:
                note(f"the code that it reports for {name} is not in table A1 of the manual",
                     warning=True)
        sensor.make_as_wanted(partial(sensor.write, Access(self._line, sensor)), note)

    # --- addresses ---

    def answers_at(self, address: int, silences: int = 1) -> bool:
        """Whether a sensor answers at an address; what says another one comes from elsewhere.

        Args:
            address: The address.
            silences: How often nothing has to come until nobody is there.

        Raises:
            FrameError: Only damaged answers came.
            LinkError: The port failed.
        """
        for _ in range(ATTEMPTS):
            damage = None
            try:
                answer = self._line.ask(address, commands.READ_ADDRESS, f"address {address}")
                if answer.value == address:
                    return True
            except RefusedError:
                return True
            except NoAnswerError:
                silences -= 1
                if not silences:
                    return False
            except FrameError as error:
                damage = error
        if damage is not None:
            raise damage
        return False

    def _answering(self, addresses: Iterable[int]) -> list[int]:
        return list(filter(self.answers_at, addresses))

    def _ask_address(self) -> int:
        """Ask for the address by cast; one sensor on the wire may answer (section 5.1.6.3)."""
        try:
            address = self._line.ask(CAST, commands.ASK_ADDRESS, "any sensor").value
        except FrameError:
            found = self._answering(range(FIRST_ADDRESS, LAST_ADDRESS + 1))
            if len(found) == 1:
                return found[0]
            if not found:
                raise
        else:  # the wire carries a 1 only where all send one: others may hide behind the answer
            found = self._answering(other for other in range(address + 1, LAST_ADDRESS + 1)
                                    if other & address == address)
            if not found:
                return address
            found = [*self._answering([address]), *found]
        raise WrongDeviceError(
            advice.SEVERAL.text(addresses=", ".join(map(str, found)))) from None

    def explained(self, sensor: Sensor, error: DriverError) -> DriverError:
        """Add to "no answer" what could be found out about the reason."""
        if not isinstance(error, NoAnswerError):
            return error
        silence = advice.SILENCE_BEHIND_ECHO if self._line.echo else advice.SILENCE
        hint = f"; {silence.text()}"
        if self._alone and sensor.options.address != CAST:
            hint = self._other_address(sensor) or hint
        return NoAnswerError(f"{error}{hint}")

    def _other_address(self, sensor: Sensor) -> str:
        """Return what to say of the sensors that answer instead, "" where none does."""
        try:
            address = self._ask_address()
        except WrongDeviceError as several:
            return f", but {several}"
        except (NoAnswerError, FrameError, RefusedError):
            return ""
        if address == sensor.options.address:
            return f"; {advice.POOR_LINE.text()}"
        return ", but " + advice.ANOTHER_ADDRESS.text(address=address, rate="",
                                                      parameters=" address")
