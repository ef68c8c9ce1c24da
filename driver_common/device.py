# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A device on a bus: the settings it has, the values it reported, and what the user wants."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from driver_common import clocks as time
from driver_common.device_thread import Backoff
from driver_common.errors import DriverError, NoAnswerError, RefusedError, SettingError
from driver_common.settings import (
    Record,
    RecordAccess,
    Setting,
    Value,
    read_settings,
    write_settings,
)

RATE_WINDOW = 5.0  # s over which a rate is measured
PAUSES = 2.0  # usual pauses after which silence counts


def rate_of(arrivals: Sequence[float]) -> float:
    """Return how often per s something came lately; less, the longer nothing comes any more.

    Args:
        arrivals: Monotonic times in s, of `RATE_WINDOW` s.
    """
    arrivals = tuple(arrivals)  # another thread may go on
    if len(arrivals) < 2:
        return 0.0
    silence, duration = time.monotonic() - arrivals[-1], arrivals[-1] - arrivals[0]
    if silence > RATE_WINDOW:
        return 0.0
    pauses = len(arrivals) - 1
    if silence > PAUSES * duration / pauses:
        duration += silence
    return pauses / duration


class Note(Protocol):
    """Takes something that is worth a line in the log."""

    def __call__(self, text: str, *, warning: bool = False) -> None:
        """Take a line."""


@dataclass
class DeviceOptions:
    """How a device is to be used.

    Attributes:
        name: Its name on a bus with several, "" for a single one.
        wanted: Settings that it is to have.
        config_mode: "push" writes them, "check" compares, "leave" ignores them.
    """

    name: str = ""
    wanted: dict[str, Value] = field(default_factory=dict)
    config_mode: str = "push"


class Device:
    """What is known of a device; the session of a driver fills it.

    Attributes:
        options: How it is to be used.
        settings: The settings that it has, by name.
        values: The values that it reported, by name.
        differing: Settings which are not as wanted: name to (wanted, reported).
        unsaved: Settings that this driver changed and that were not saved since.
        enabled: Whether it is to measure, as far as the user of the services says.
        error: What is wrong with it; why it is not connected.
        complained: Whether the user was told of what is wrong with it though it is connected.
        told: What was wrong before, with the monotonic time in s when it was last so or told.
        misses: Number of steps without a good answer.
        connections: How often it was found.
        backoff: Pauses between attempts to find it.
        due: Monotonic time in s of its next step.
        served: Monotonic time in s of its last step.
    """

    KIND = "sensor"  # what it is called where it has no name

    def __init__(self, options: DeviceOptions) -> None:
        """Begin as an unknown device."""
        self.options = options
        self.settings: dict[str, Setting] = {}
        self.values: dict[str, Value] = {}
        self.differing: dict[str, tuple[Value, Value]] = {}
        self.unsaved: set[str] = set()
        self.enabled = True
        self.error: DriverError | None = None
        self.complained = False
        self.told: dict[str, float] = {}
        self.misses = 0
        self.connections = 0
        self.backoff = Backoff()
        self.due = 0.0
        self.served = 0.0

    def __str__(self) -> str:
        """Return what it is called in messages."""
        return self.title

    @property
    def title(self) -> str:
        """Its name on a bus with several, else what it is."""
        return self.options.name or self.KIND

    @property
    def is_connected(self) -> bool:
        """Whether it was found, identified and configured."""
        raise NotImplementedError

    def forget(self) -> None:
        """Take note that it is not connected any more."""
        self.misses = 0
        self.complained = False

    @property
    def differences(self) -> dict[str, str]:
        """Settings which are not as wanted, for the diagnostics."""
        return {f"{name} differs": f"wanted {wanted}, reported {reported}"
                for name, (wanted, reported) in dict(self.differing).items()}

    def read_all(self, access: RecordAccess, settings: Mapping[str, Setting], note: Note) -> None:
        """Read all settings; those that the device does not tell are not offered.

        Raises:
            DriverError: The device is gone, refuses everything, or does not tell what it told
                before; what was known of it stays as it was.
        """
        records: dict[Record, list[Setting]] = {}
        for setting in settings.values():
            records.setdefault(setting.record, []).append(setting)
        values: dict[str, Value] = {}
        for group in records.values():
            values |= self._read_or_nothing(access, group)
        missing = [name for name in settings if name not in values]
        self.settings = {name: settings[name] for name in settings if name in values}
        self.values = {name: values[name] for name in self.settings}
        if missing:
            note(f"this firmware has no {', '.join(missing)}", warning=True)

    def _read_or_nothing(self, access: RecordAccess, group: list[Setting]) -> dict[str, Value]:
        """Read settings; return nothing where just these are refused or not answered."""
        try:
            return read_settings(access, group)
        except (RefusedError, NoAnswerError):
            access.require_answer()
        try:
            return read_settings(access, group)
        except (RefusedError, NoAnswerError):
            if any(setting.name in self.values for setting in group):
                raise
            return {}

    def write(self, access: RecordAccess, changes: Mapping[str, Value]) -> dict[str, Value]:
        """Write settings, all or none, and return what the device reports; see `write_settings`."""
        reported = write_settings(access, self.settings, changes)
        self.take_over(reported)
        return reported

    def take_over(self, values: Mapping[str, Value]) -> None:
        """Take note of reported values that were changed on purpose: they are wanted now."""
        self.unsaved |= {name for name in values if values[name] != self.values.get(name)}
        self.options.wanted |= values
        self.values |= values
        for name in values:
            self.differing.pop(name, None)

    def make_as_wanted(self, write: Callable[[Mapping[str, Value]], object], note: Note) -> None:
        """Compare with what is wanted; where it differs write, warn or do nothing.

        Args:
            write: Writes settings with what the driver needs around it, and ends in `self.write`.
            note: Told what was changed or refused.
        """
        self.differing = {}
        wanted = self._missing(note)
        if self.options.config_mode == "push":
            self._push(wanted, write, note)
        elif self.options.config_mode == "check":
            self.differing |= {name: (value, self.values[name]) for name, value in wanted.items()}
        for name, (value, reported) in self.differing.items():
            setting = self.settings[name]
            note(f"{name} is {setting.text(reported)}, not {setting.text(value)} as wanted",
                 warning=True)

    def _missing(self, note: Note) -> dict[str, Value]:
        """Return the wanted values, as the device can hold them, that it does not have yet."""
        wanted = {}
        for name, value in self.options.wanted.items():
            if name in self.settings and not self.settings[name].is_same(value, self.values[name]):
                try:
                    checked = self.settings[name].check(value)
                except SettingError as error:
                    note(str(error), warning=True)
                    self.differing[name] = (value, self.values[name])
                else:
                    if checked != self.values[name]:
                        wanted[name] = checked
        return wanted

    def _push(self, wanted: Mapping[str, Value],
              write: Callable[[Mapping[str, Value]], object], note: Note) -> None:
        """Write wanted settings together; where that is refused, each that is not refused."""
        before = dict(self.values)
        try:
            if wanted:
                write(wanted)
        except (RefusedError, SettingError):
            for name, value in wanted.items():
                try:
                    write({name: value})
                except (RefusedError, SettingError) as error:
                    note(str(error), warning=True)
                    self.differing[name] = (value, self.values[name])
        changed = [f"{name}: {self.settings[name].text(before[name])} → "
                   f"{self.settings[name].text(self.values[name])}"
                   for name in wanted if self.values[name] != before[name]]
        if changed:
            note("wrote " + ", ".join(changed))
