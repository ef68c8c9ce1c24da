"""Finding and life of a sensor: search, choose, connect, greet, release (errata C4)."""

from __future__ import annotations

import math
import time

from driver_common.device import Note
from driver_common.errors import DriverError, NoAnswerError, WrongDeviceError
from icotronic_driver import commands
from icotronic_driver.access import Access
from icotronic_driver.commands import decode_name
from icotronic_driver.identifier import STH_1, STU_1
from icotronic_driver.line import Line
from icotronic_driver.sensor import Options, Phase, Readings, SeenSensor, Sensor
from icotronic_driver.settings import SETTINGS

CONNECT_RETRY = 3.0  # s until the connect is asked for again (errata C4)
CONNECT_TIMEOUT = 12.0  # s until another search
CONNECT_POLL = 0.1  # s
SETTLE_TIME = 0.6  # s in which the same sensors must be in range before one is taken
PATIENCE = 3.0  # s until a sensor that only advertises now and then must have been seen
DISCONNECT_TIMEOUT = 0.3  # s
OTHER_HOST_TIME = 1.0  # s in which another host with the same connection lets itself be heard


class Connection:
    """The way to a sensor behind the stationary unit, and back."""

    def __init__(self, line: Line, sensor: Sensor, access: Access, note: Note) -> None:
        """Prepare to look for `sensor` over `line`; `note` is told what is worth a line."""
        self._line = line
        self._sensor = sensor
        self._access = access
        self._note = note
        self._connect_until = self._connect_again = 0.0
        self._settled_since = 0.0
        self._searching_since = 0.0

    def begin(self) -> None:
        """Take note that the search begins now: a sensor may need some time to be seen."""
        self._searching_since = time.monotonic()

    def advance(self) -> bool:
        """Do the next step to a connection; return whether there is one, with a known sensor.

        Raises:
            DriverError: The sensor is not to be had now.
        """
        if self._sensor.phase is Phase.SEARCHING:
            self._search()
            return False
        return self._await_connection()

    def release(self) -> None:
        """Release the sensor, so that it can sleep."""
        if self._sensor.phase is not Phase.SEARCHING:
            self._line.request(commands.DEACTIVATE_BLUETOOTH.request(STU_1), DISCONNECT_TIMEOUT)

    def _search(self) -> None:
        """Look for the wanted sensor, and begin to connect it."""
        sensor = self._sensor
        try:
            self._give_up_old_connection()
            self.look_around()
        except DriverError:
            self._searching_since = math.inf
            raise
        self._searching_since = min(self._searching_since, time.monotonic())
        target = self._choose()
        if target is None:
            return
        sensor.target = target
        sensor.phase = Phase.CONNECTING
        self._connect_until = time.monotonic() + CONNECT_TIMEOUT
        self._connect_again = 0.0

    def _give_up_old_connection(self) -> None:
        """Release what a host that was killed, or a sensor that was reset, left connected.

        Raises:
            WrongDeviceError: Another host is at work with it.
        """
        if self._access.is_connected():
            before = self._line.counts.other_host
            self._line.listen(OTHER_HOST_TIME)
            if self._line.counts.other_host != before:
                raise WrongDeviceError("another host on the bus works with this stationary unit; "
                                       "end one of the two")
            self._note("releasing a connection that was left over")
            self._line.request(commands.DEACTIVATE_BLUETOOTH.request(STU_1))

    def look_around(self) -> None:
        """Ask the stationary unit which sensors are in range; raises DriverError."""
        self._line.request(commands.ACTIVATE_BLUETOOTH.request(STU_1))
        seen = []
        for number in range(self._line.request(commands.COUNT_DEVICES.request(STU_1))):
            name = decode_name(*(self._line.request(part.request(STU_1, number))
                                 for part in (commands.READ_NAME_1, commands.READ_NAME_2)))
            mac = self._line.request(commands.READ_MAC.request(STU_1, number))
            rssi = self._line.request(commands.READ_RSSI.request(STU_1, number))
            seen.append(SeenSensor(number, name, mac, rssi))
        if [one.mac for one in seen] != [one.mac for one in self._sensor.seen]:
            self._settled_since = time.monotonic()
        self._sensor.seen = seen

    def _choose(self) -> SeenSensor | None:
        """Return the wanted sensor; None where more may still come into range.

        Raises:
            NoAnswerError: The wanted sensor is not in range.
            WrongDeviceError: Several are in range, and none was named.
        """
        options, seen = self._sensor.options, self._sensor.seen
        wanted = [one for one in seen
                  if (not options.sensor_name or one.name == options.sensor_name)
                  and (not options.sensor_mac or one.mac == options.sensor_mac)
                  and options.sensor_number in (-1, one.number)]
        named = options.sensor_name or options.sensor_mac or options.sensor_number >= 0
        now = time.monotonic()
        if ((not wanted and now - self._searching_since < PATIENCE)
                or (wanted and not named and now - self._settled_since < SETTLE_TIME)):
            self._sensor.due = now + CONNECT_POLL
            return None
        if not wanted:
            in_range = "; ".join(map(str, seen)) or "none"
            raise NoAnswerError(
                f"the sensor{_described(options)} is not in range of the stationary unit (in "
                f"range: {in_range}); wake it up, bring it nearer or correct the parameter"
                if named else "no sensor is in range of the stationary unit; wake it up or bring "
                              "it nearer")
        if len(wanted) > 1:
            raise WrongDeviceError(
                f"{len(wanted)} sensors are in range: {'; '.join(map(str, wanted))}; say which one "
                "with the parameter sensor_name, sensor_mac or sensor_number")
        return wanted[0]

    def _await_connection(self) -> bool:
        """Ask for the connection, again every few seconds, until it is there."""
        assert self._sensor.target is not None
        now = time.monotonic()
        if self._connect_again and self._access.is_connected():
            self._greet()
            return True
        if now > self._connect_until:
            raise NoAnswerError(f"the sensor {self._sensor.target} does not connect; bring it "
                                "nearer, or check its battery")
        if now >= self._connect_again:
            self._line.request(commands.CONNECT_MAC.request(STU_1, self._sensor.target.mac))
            self._connect_again = now + CONNECT_RETRY
        self._sensor.due = now + CONNECT_POLL
        return False

    def _greet(self) -> None:
        """Ask the sensor that was connected who it is and how it is set."""
        sensor, access = self._sensor, self._access
        sensor.stu_identity = access.identify(STU_1)
        sensor.identity = access.identify(STH_1)
        sensor.readings = Readings()
        warning = access.eeprom_warning()
        if warning:
            self._note(warning, warning=True)
        sensor.read_all(access, SETTINGS, self._note)
        sensor.eeprom_calibrations = access.eeprom_calibrations()
        sensor.phase = Phase.CONNECTED


def _described(options: Options) -> str:
    parts = [f' "{options.sensor_name}"'] if options.sensor_name else []
    parts += [f" {options.sensor_mac}"] if options.sensor_mac else []
    parts += [f" number {options.sensor_number}"] if options.sensor_number >= 0 else []
    return "".join(parts)
