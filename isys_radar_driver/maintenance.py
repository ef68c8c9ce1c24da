# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a user asks of a radar: write, save and restore settings, a new address, raw signals."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

from driver_common.errors import (
    DriverError,
    FrameError,
    NoAnswerError,
    RefusedError,
    SettingError,
)
from driver_common.settings import Raw, Setting, Value, read_settings
from isys_radar_driver import commands
from isys_radar_driver.access import EEPROM_TIMEOUT, Access, acknowledged
from isys_radar_driver.acquisition import Acquisition
from isys_radar_driver.commands import Command, IsysRecord, Location, RawSignals
from isys_radar_driver.connection import Connection
from isys_radar_driver.frames import FIRST_ADDRESS, LAST_ADDRESS
from isys_radar_driver.line import REPLY_TIMEOUT
from isys_radar_driver.listener import Listener
from isys_radar_driver.models import Model
from isys_radar_driver.radar import Radar
from isys_radar_driver.settings import is_application_setting, record_of

T = TypeVar("T")

RAW_TIMEOUT = 3.0  # s until the first byte of raw signals


class Maintenance:
    """The user's commands to a radar; every method raises DriverError where it is not connected."""

    def __init__(self, access: Access, radars: Sequence[Radar], acquisition: Acquisition,
                 connection: Connection, listener: Listener, require: Callable[[Radar], None],
                 lose: Callable[[Radar, DriverError], None]) -> None:
        """Serve radars that share a line.

        Args:
            access: Requests to a radar.
            radars: All radars on the line.
            acquisition: Starts and stops a radar.
            connection: Reads the settings of a radar.
            listener: Told of settings that were read again.
            require: Raises NoAnswerError where a radar is not connected.
            lose: Takes note that a radar is not connected any more.
        """
        self._access = access
        self._radars = radars
        self._acquisition = acquisition
        self._connection = connection
        self._listener = listener
        self._require = require
        self._lose = lose

    def execute(self, radar: Radar, command: Command[T]) -> T:
        """Carry out a command that the model has."""
        self._require_support(radar, command)
        return self._access.execute(radar, command)

    def read_raw_signals(self, radar: Radar) -> RawSignals:
        """Read the raw signals of one measurement; needs the acquisition to run."""
        self._require_support(radar, commands.READ_RAW)
        if not radar.measuring:
            raise SettingError("raw signals need the acquisition to run; start it first")
        radar.forget_lists()  # the cycle is expanded on purpose (section 3.3.10)
        return self._access.execute(radar, commands.READ_RAW, RAW_TIMEOUT)

    def _require_support(self, radar: Radar, command: Command[T]) -> Model:
        self._require(radar)
        model = radar.known_model
        if not model.supports(command):
            raise SettingError(f"{model.name} cannot {command.name}")
        return model

    # --- settings ---

    def write(self, radar: Radar, changes: Mapping[str, Value]) -> dict[str, Value]:
        """Write settings, all or none, and return what the radar reports.

        Raises:
            DriverError: Not connected, a bad value, a refusal or no answer.
        """
        self._require(radar)
        try:
            return self._acquisition.write(radar, changes)
        except (NoAnswerError, FrameError) as error:
            radar.known = None  # nobody knows what it holds now
            self._lose(radar, error)
            raise

    def set_default_thresholds(self, radar: Radar) -> tuple[float, ...]:
        """Set the default temperature thresholds in the RAM, and read what they are then."""
        thresholds = self.execute(radar, commands.SET_DEFAULT_TEMPERATURE_THRESHOLDS)
        records = self._access.records(radar)
        changed = read_settings(records, (
            setting for setting in radar.settings.values()
            if setting.section == commands.TEMPERATURE_THRESHOLDS_SECTION))
        radar.take_over(changed)
        radar.read_other_views(records, changed)
        self._listener.on_values(radar)
        return thresholds

    def restore_factory_settings(self, radar: Radar) -> None:
        """Restore the factory settings, and read everything again."""
        command = commands.RESTORE_FACTORY_SETTINGS
        model = self._require_support(radar, command)
        self._acquisition.stop(radar)
        try:
            self._access.exchange(radar, command.request(radar.address), acknowledged,
                                  EEPROM_TIMEOUT, sources=(radar.address, model.address))
            radar.options.wanted.clear()
            radar.differing.clear()
            radar.unsaved.clear()
            try:
                self._access.execute(radar, commands.READ_DEVICE_NAME)
            except NoAnswerError:  # the address may have been restored as well
                radar.address = model.address
                radar.options.address = radar.options.address and model.address
            self._connection.read_all(radar)
        finally:
            self._acquisition.start_or_stop(radar)
        self._listener.on_values(radar)

    # --- save ---

    def save(self, radar: Radar, command: Command[None]) -> list[str]:
        """Save settings in the EEPROM; return the names of those changed since the last time."""
        self._require(radar)
        if radar.known_model.supports(command):
            self._access.execute(radar, command)
            saved = self.unsaved(radar, command)
        else:
            saved = self._save_records(radar, command)
        radar.unsaved -= set(saved)
        return saved

    def unsaved(self, radar: Radar, command: Command[None], *, possible: bool = True) -> list[str]:
        """Return the settings that this driver changed and that a save would keep, or would not."""
        self._require(radar)
        has_command = radar.known_model.supports(command)
        return sorted(name for name in radar.unsaved
                      if _covers(command, radar.settings[name])
                      and (has_command or record_of(radar.settings[name]).has_location) == possible)

    def stored_values(self, radar: Radar) -> dict[str, Value]:
        """Return what the EEPROM holds, for the settings that can be read from there."""
        self._require(radar)
        return read_settings(self._access.records(radar, Location.EEPROM), (
            setting for setting in radar.settings.values() if record_of(setting).has_location))

    def _save_records(self, radar: Radar, command: Command[None]) -> list[str]:
        """Write each record that has a location to the EEPROM, where that holds something else.

        Models without the commands to save have no other way (sections 3.3.4.6, 3.3.5.21 …).
        """
        covered = [setting for setting in radar.settings.values()
                   if _covers(command, setting) and record_of(setting).has_location]
        if not covered:
            self._require_support(radar, command)
        now, stored = ({record: self._access.read_record(radar, record, location)
                        for record in dict.fromkeys(map(record_of, covered))}
                       for location in (Location.RAM, Location.EEPROM))
        differing = {setting.name: record_of(setting) for setting in covered
                     if now[record_of(setting)][setting.field]
                     != stored[record_of(setting)][setting.field]}
        with self._acquisition.stopped_for(radar, differing):
            for record in dict.fromkeys(differing.values()):
                self._save_record(radar, record, now[record])
        return sorted({setting.name for setting in covered} & radar.unsaved | differing.keys())

    def _save_record(self, radar: Radar, record: IsysRecord, values: tuple[Raw, ...]) -> None:
        names = ", ".join(setting.name for setting in radar.settings.values()
                          if setting.record == record)
        try:
            self._access.write_record(radar, record, values, Location.EEPROM)
        except RefusedError as error:
            raise RefusedError(f"cannot save {names}: {error}") from error
        if self._access.read_record(radar, record, Location.EEPROM) != values:
            raise RefusedError(f"the device took {names} but did not store it")

    # --- address ---

    def change_address(self, radar: Radar, address: int) -> None:
        """Give the radar another address, for good, and follow it (errata I17).

        Raises:
            SettingError: The address is not allowed or taken.
            DriverError: The radar refused or did not answer from the new address.
        """
        self._require(radar)
        if not FIRST_ADDRESS <= address <= LAST_ADDRESS:
            raise SettingError(f"address {address} is out of range, "
                               f"allowed is {FIRST_ADDRESS} … {LAST_ADDRESS}")
        if any(other is not radar and other.address == address for other in self._radars):
            raise SettingError(f"address {address} belongs to another radar of this driver")
        if address != radar.address and self._access.answers_at(radar, address):
            raise SettingError(f"address {address} belongs to another device on the line")
        request = commands.change_address(radar.address, address)
        try:
            self._access.exchange(radar, request, lambda frame: None,
                                  REPLY_TIMEOUT + EEPROM_TIMEOUT, sources=(address, radar.address))
        except NoAnswerError:  # of the request, or only of its acknowledge
            if not self._access.answers_at(radar, address):
                raise
        radar.address = address
        radar.options.address = address


def _covers(command: Command[None], setting: Setting) -> bool:
    """Whether a command to save keeps a setting."""
    return (command is commands.SAVE_ALL_SETTINGS or is_application_setting(setting)
            == (command is commands.SAVE_APPLICATION_SETTINGS))
