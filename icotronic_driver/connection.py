# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Finding and life of a sensor: search, choose, connect, greet, release (errata C4)."""

from __future__ import annotations

import math

from driver_common import advice
from driver_common import clocks as time
from driver_common.device import Note
from driver_common.errors import (
    DriverError,
    FrameError,
    NoAnswerError,
    RefusedError,
    WrongDeviceError,
)
from icotronic_driver import commands
from icotronic_driver.access import READINGS, Access, Survey
from icotronic_driver.commands import decode_name
from icotronic_driver.identifier import STH_1, STU_1
from icotronic_driver.line import Line
from icotronic_driver.sensor import Options, Phase, Readings, SeenSensor, Sensor
from icotronic_driver.settings import SETTINGS

CONNECT_RETRY = 3.0  # s until the connect is asked for again (errata C4)
CONNECT_TIMEOUT = 21.0  # s until another search; a sensor may take 20 (field note N1)
CONNECT_POLL = 0.05  # s; what is asked for in it takes some ms
SETTLE_TIME = 0.6  # s in which the same sensors must be in range before one is taken
PATIENCE = 3.0  # s in which all sensors are seen: asleep they advertise every 2.5 s (field note N5)
RELEASE_TIMEOUT, RELEASE_ATTEMPTS = 0.3, 3  # s
OTHER_HOST_TIME = 1.0  # s in which another host with the same connection lets itself be heard


class Connection:
    """The way to a sensor behind the stationary unit, and back."""

    def __init__(self, line: Line, sensor: Sensor, access: Access, note: Note) -> None:
        """Prepare to look for `sensor` over `line`; `note` is told what is worth a line."""
        self._line = line
        self._sensor = sensor
        self._access = access
        self._note = note
        self._asked_for: SeenSensor | None = None
        self._connect_until = self._connect_again = 0.0
        self._before: set[tuple[int, str, str]] = set()  # number, name, MAC at the last look
        self._settled: list[SeenSensor] = []
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
        """Release the sensor, so that it can sleep; raises DriverError."""
        self._asked_for = None
        self._line.request(commands.DEACTIVATE_BLUETOOTH.request(STU_1), RELEASE_TIMEOUT,
                           RELEASE_ATTEMPTS)

    def _search(self) -> None:
        """Look for the wanted sensor, and begin to connect it."""
        try:
            if self._access.is_connected():
                self._keep_or_release()
            if self._sensor.phase is Phase.SEARCHING:
                self.look_around()
        except DriverError:
            self._searching_since = math.inf
            raise
        self._searching_since = min(self._searching_since, time.monotonic())
        target = self._choose() if self._sensor.phase is Phase.SEARCHING else None
        if target is not None:
            self._begin_to_connect(target)
            self._connect_again = 0.0

    def _begin_to_connect(self, target: SeenSensor) -> None:
        self._sensor.target = self._asked_for = target
        self._sensor.phase = Phase.CONNECTING
        now = time.monotonic()
        self._connect_until, self._connect_again = now + CONNECT_TIMEOUT, now + CONNECT_RETRY

    def _keep_or_release(self) -> None:
        """Keep a connection that came late or was left over, if it is the wanted one.

        Raises:
            WrongDeviceError: Another host is at work with it.
        """
        if self._asked_for is None:
            self._require_no_other_host()
        try:
            name, mac = self._access.read_name_and_mac(STH_1)
        except (FrameError, NoAnswerError, RefusedError):
            name = mac = ""
        asked_for = self._asked_for
        if asked_for is not None and asked_for.mac == mac and self._is_wanted(asked_for):
            self._begin_to_connect(asked_for)
        elif self._is_named and self._is_wanted(found := SeenSensor(-1, name, mac, 0)):
            self._note("keeping a connection that was left over")
            self._line.request(commands.STOP_ACCELERATION.request(STH_1))
            self._begin_to_connect(found)
        else:
            self._note("releasing a connection that was left over")
            self.release()

    def _require_no_other_host(self) -> None:
        before = self._line.counts.other_host
        self._line.listen(OTHER_HOST_TIME)
        if self._line.counts.other_host != before:
            raise WrongDeviceError(advice.OTHER_HOST.text())

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
        before, self._before = self._before, {one[:3] for one in seen}
        settled = [one for one in seen if one.is_complete and one[:3] in before]
        if self._before != before or len(settled) != len(self._settled):
            self._settled_since = time.monotonic()
        self._sensor.seen, self._settled = seen, settled

    @property
    def _is_named(self) -> bool:
        """Whether the user said which sensor."""
        options = self._sensor.options
        return bool(options.sensor_name or options.sensor_mac or options.sensor_number >= 0)

    def _is_wanted(self, one: SeenSensor) -> bool:
        options = self._sensor.options
        return ((not options.sensor_name or one.name == options.sensor_name)
                and (not options.sensor_mac or one.mac == options.sensor_mac)
                and options.sensor_number in (-1, one.number))

    def _choose(self) -> SeenSensor | None:
        """Return the wanted sensor; None where more may still come into range.

        Raises:
            NoAnswerError: The wanted sensor is not in range.
            WrongDeviceError: Several are in range, and none was named.
        """
        wanted = [one for one in self._settled if self._is_wanted(one)]
        now = time.monotonic()
        more_may_come = (now - self._searching_since < PATIENCE
                         or (bool(self._sensor.seen) and now - self._settled_since < SETTLE_TIME))
        if more_may_come and not (wanted and self._is_named):
            self._sensor.due = now + CONNECT_POLL
            return None
        if not wanted:
            raise NoAnswerError(self._why_none())
        if len(wanted) > 1:
            raise WrongDeviceError(
                f"{len(wanted)} sensors are in range: {'; '.join(map(str, wanted))}; say which one "
                "with the parameter sensor_name, sensor_mac or sensor_number")
        return wanted[0]

    def _why_none(self) -> str:
        """Return why no sensor can be taken, for people."""
        in_range = "; ".join(map(str, self._sensor.seen))
        if self._is_named:
            return advice.NOT_IN_RANGE.text(which=_described(self._sensor.options),
                                            in_range=in_range or "none")
        if in_range:
            return ("no sensor has told its name, its MAC address and its RSSI yet (in range: "
                    f"{in_range})")
        return advice.NONE_IN_RANGE.text()

    def _await_connection(self) -> bool:
        """Ask for the connection, again every few seconds, until it is there."""
        assert self._sensor.target is not None
        now = time.monotonic()
        if self._access.is_connected():
            self._sensor.phase = Phase.GREETING
            self._greet()
            return True
        if now > self._connect_until:
            raise NoAnswerError(advice.DOES_NOT_CONNECT.text(which=self._sensor.target))
        if now >= self._connect_again:
            self._line.request(commands.CONNECT_MAC.request(STU_1, self._sensor.target.mac))
            self._connect_again = now + CONNECT_RETRY
        self._sensor.due = now + CONNECT_POLL
        return False

    def _greet(self) -> None:
        """Ask the sensor that was connected who it is, how it is set, and what it can tell."""
        sensor, survey = self._sensor, Survey(self._line)
        assert sensor.target is not None
        name, mac = survey.read_name_and_mac(STH_1)
        if mac != sensor.target.mac:
            raise WrongDeviceError(f'instead of {sensor.target} "{name}" ({mac}) was connected')
        sensor.values = {}
        sensor.read_all(survey, SETTINGS, _say_nothing)
        sensor.identity = survey.identify(STH_1)
        sensor.stu_identity = survey.identify(STU_1)
        warning = survey.eeprom_warning()
        if warning:
            self._note(warning, warning=True)
        sensor.readings = Readings(**{reading.name: survey.take_reading(sensor, reading)
                                      for reading in READINGS})
        sensor.readable = {name for name, value in vars(sensor.readings).items()
                           if value is not None}
        sensor.phase = Phase.CONNECTED
        if sensor.missing:
            self._note(f"not offered, because there is no answer: {', '.join(sensor.missing)}")


def _say_nothing(text: str, *, warning: bool = False) -> None:
    """Take no note of each missing setting: all that is missing is told in one line."""


def _described(options: Options) -> str:
    parts = [f' "{options.sensor_name}"'] if options.sensor_name else []
    parts += [f" {options.sensor_mac}"] if options.sensor_mac else []
    parts += [f" number {options.sensor_number}"] if options.sensor_number >= 0 else []
    return "".join(parts)
