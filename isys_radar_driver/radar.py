# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""One radar on a line: how it is to be used, what is known of it, and what was counted."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from driver_common.cycle_clock import CycleClock
from driver_common.device import RATE_WINDOW, Device, DeviceOptions, rate_of
from driver_common.errors import NoAnswerError
from driver_common.serial_link import BITS_PER_BYTE
from driver_common.settings import RecordAccess, Value, read_settings
from isys_radar_driver.commands import Version
from isys_radar_driver.frames import BROADCAST
from isys_radar_driver.line import OVERHEAD
from isys_radar_driver.models import FAST, Model
from isys_radar_driver.plausibility import Continuity, Limits
from isys_radar_driver.settings import OTHER_VIEW, coarser_first, record_of
from isys_radar_driver.targets import TARGET_SIZES, Resolution

EARLY = 0.25  # cycles by which a list may come before it is expected


@dataclass(frozen=True)
class Identity:
    """Who a radar says it is (sections 3.3.2 and 3.3.6)."""

    model: Model
    device_name: str
    firmware: Version
    dsp_hardware: Version | None
    rfe_hardware: Version | None
    bootloader: Version | None

    @property
    def serial_number(self) -> str:
        """What follows the model in the device name (errata I23)."""
        return self.device_name.removeprefix(self.model.name).strip(" ,:#") or "unknown"

    def __str__(self) -> str:
        """Return model, serial number and firmware."""
        return f"{self.model.name} {self.serial_number}, firmware {self.firmware}"


@dataclass
class Statistics:
    """What was counted for one radar since the start.

    Attributes:
        target_lists: Target lists that came.
        lost_cycles: Cycles of which none came.
        shared_cycles: Cycles that ended while the line served another radar.
        clippings: Lists without targets, because the receiver was overloaded.
        implausible_lists: Lists with a good checksum that cannot be true; dropped.
        damaged_replies: Answers that arrived damaged.
        timeouts: Answers that did not come in time.
        refusals: Answers with a failure.
    """

    target_lists: int = 0
    lost_cycles: int = 0
    shared_cycles: int = 0
    clippings: int = 0
    implausible_lists: int = 0
    damaged_replies: int = 0
    timeouts: int = 0
    refusals: int = 0


@dataclass
class Options(DeviceOptions):
    """How one radar is to be used.

    Attributes:
        address: Its address; 0 = ask by broadcast.
        model: The only model that is accepted; None = any.
        output: Output filter of the target lists, 1 to 3.
        resolution: 16 or 32 bit; 0 = what fits the line.
        read_digital_outputs: Read the digital outputs after every target list.
        read_range_list: Read the range list after every target list.
    """

    address: int = BROADCAST
    model: Model | None = None
    output: int = 1
    resolution: int = 0
    read_digital_outputs: bool = False
    read_range_list: bool = False


class Radar(Device):
    """One radar on the line: what is known of it, and what was counted.

    Attributes:
        options: How it is to be used.
        address: Its address, 0 while unknown.
        identity: Who it is; None while it is not connected.
        known: Who it was when its settings were last read; None = they are to be read again.
        baud_rate: At which it was found, in Bd; 0 = never.
        unchecked: Settings of a radar that came back, which may have changed meanwhile.
        absent: Names of optional readings that it does not have.
        answered: Monotonic time in s of its last good answer.
        well: Monotonic time in s of its last step without a fault.
        temperatures: Board temperatures in °C, by name.
        measuring: Whether acquisition was started; None while that is not known.
        cycle_end: Monotonic time in s at which one of its cycles ended, as far as known.
        aligned: Monotonic time in s of its last start.
        continuity: How its target lists go on from each other.
        arrivals: Monotonic times in s at which target lists began, the last few seconds.
        cycles: Gives target lists their times; None before the first one.
        clippings: Those of them that told of an overloaded receiver.
        fixed_targets: Learned length of fixed-length lists, 0 while unknown.
        refused: How many steps in a row it refused.
        checks: How often it was checked for a reset.
        check_due: Monotonic time in s of the next check.
        checked: Monotonic time in s of the last one.
    """

    KIND = "radar"

    options: Options

    def __init__(self, options: Options) -> None:
        """Begin as an unknown radar."""
        super().__init__(options)
        self.address = options.address
        self.identity: Identity | None = None
        self.known: Identity | None = None
        self.baud_rate = 0
        self.unchecked: list[str] = []
        self.absent: set[str] = set()
        self.answered = 0.0
        self.well = -math.inf
        self.temperatures: dict[str, float] = {}
        self.measuring: bool | None = False
        self.statistics = Statistics()
        self.cycle_end = 0.0
        self.aligned = 0.0
        self.continuity = Continuity()
        self.arrivals: deque[float] = deque()
        self.cycles: CycleClock | None = None
        self.clippings: deque[float] = deque()
        self.fixed_targets = 0
        self.refused = 0
        self.checks = 0
        self.check_due = 0.0
        self.checked = -math.inf

    def __str__(self) -> str:
        """Return name or address for messages."""
        return self.options.name or (f"address {self.address}" if self.address else self.KIND)

    @property
    def is_connected(self) -> bool:
        """Whether it was found, identified and configured."""
        return self.identity is not None

    def forget(self) -> None:
        """Take note that the radar is not connected any more."""
        super().forget()
        self.identity = None
        self.measuring = False
        self.fixed_targets = 0
        self.refused = 0
        self.absent.clear()
        self.checked = -math.inf
        self.forget_lists()

    def forget_lists(self) -> None:
        """Count rate, lost cycles and time from the next target list on."""
        self.arrivals.clear()
        self.clippings.clear()
        self.cycles = None

    def time_in_cycle(self, arrival: int, offset: int) -> int:
        """Return when a cycle ended, without the jitter of the target list's arrival.

        Both are times of the host in ns; `offset` is that of its time of day to its monotonic one.
        """
        if self.cycles is None:
            self.cycles = CycleClock(self.cycle_time)
        return self.cycles.stamp(arrival - offset) + offset

    def write(self, access: RecordAccess, changes: Mapping[str, Value]) -> dict[str, Value]:
        """Write settings, see `Device.write`; some are stored for good at once."""
        reported = super().write(access, {name: changes[name] for name in coarser_first(changes)})
        self.unsaved -= {name for name in changes
                         if record_of(self.settings[name]).stored_at_once}
        return reported | self.read_other_views(access, changes)

    def read_other_views(self, access: RecordAccess, names: Iterable[str]) -> dict[str, Value]:
        """Read what the other views of changed boundaries show now; it is not wanted any more."""
        others = {OTHER_VIEW[name] for name in names if name in OTHER_VIEW}.difference(names)
        reported = read_settings(access, (
            self.settings[name] for name in sorted(others & self.settings.keys())))
        changed = {name: value for name, value in reported.items()
                   if value != self.options.wanted.get(name, value)}
        for name in changed:
            del self.options.wanted[name]
            self.differing.pop(name, None)
        self.values |= reported
        return reported

    @property
    def model(self) -> Model | None:
        """The connected model."""
        return self.identity.model if self.identity else None

    @property
    def known_model(self) -> Model:
        """The connected model; raises NoAnswerError where none is."""
        if self.identity is None:
            raise NoAnswerError(f"{self} is not connected")
        return self.identity.model

    @property
    def sends_lists(self) -> bool:
        """Whether it measures, and hands out target lists over its serial port."""
        return bool(self.measuring) and self.model is not None and self.model.has_target_lists

    @property
    def product(self) -> str:
        """Name of what is connected."""
        return self.model.name if self.model else "radar"

    @property
    def cycle_time(self) -> float:
        """Cycle time in s in the present measurement mode."""
        if self.model is None:
            return 0.0
        return self.model.cycle_time(self._mode)

    @property
    def _mode(self) -> int:
        setting = self.settings.get("measurement_mode")
        value = self.values.get("measurement_mode")
        if setting is None or setting.choices is None:
            return FAST
        return setting.choices.get(str(value), FAST)

    @property
    def max_targets(self) -> int:
        """Most targets in a list in the present measurement mode."""
        if self.model is None:
            return 0
        return self.model.max_targets.get(self._mode, max(self.model.max_targets.values()))

    @property
    def rate(self) -> float:
        """Measured target lists per second."""
        return rate_of(self.arrivals)

    @property
    def is_overloaded(self) -> bool:
        """Whether most of the last target lists told of an overloaded receiver."""
        return 2 * len(self.clippings) > len(self.arrivals)

    def limits(self, *, own: bool = False) -> Limits:
        """Return what its target lists keep to.

        Args:
            own: Whether its own filters count as well. No manual promises that every firmware
                filters its lists by them, so they are for when there is doubt in any case.
        """
        def value(name: str, default: float) -> float:
            setting = self.values.get(name, default)
            assert isinstance(setting, float)
            return setting

        model, output = self.known_model, f"output{self.options.output}"
        return Limits.of(
            model, self.options.output, self.max_targets, self.cycle_time,
            range_max=value(f"{output}.range_max", model.range_max) if own else model.range_max,
            velocity_max=(value(f"{output}.velocity_max", model.velocity_max) if own
                          else model.velocity_max),
            offset=value("mounting_offset", 0.0))

    def list_size(self, resolution: Resolution) -> int:
        """Return the bytes of the longest target list in the present measurement mode."""
        return OVERHEAD + self.max_targets * TARGET_SIZES[resolution.bits]

    def resolution(self, baud_rate: int, sharing: int = 1) -> Resolution:
        """Return the resolution to ask for; "auto" takes the finest that fits the cycle (I24).

        Args:
            baud_rate: In Bd.
            sharing: How many radars share the line, and so the cycle.

        Raises:
            SettingError: The model does not have the resolution that was asked for.
        """
        possible = self.known_model.resolutions_of(self.options.resolution)
        for resolution in possible:
            seconds = self.list_size(resolution) * BITS_PER_BYTE / baud_rate
            if seconds * sharing < self.cycle_time:
                return resolution
        return possible[-1]

    def count_list(self, now: float, *, clipping: bool, shared: bool = False) -> int:
        """Count a target list, and the cycles that passed without one.

        Args:
            now: Monotonic time in s at which it began.
            clipping: Whether the receiver was overloaded.
            shared: Whether the line served another radar meanwhile.

        Returns:
            How many cycles passed without a list because the line is shared.
        """
        self.statistics.target_lists += 1
        self.statistics.clippings += clipping
        expected, missed = now, 0
        if self.arrivals:
            cycles = max(1, math.floor((now - self.cycle_end) / self.cycle_time + EARLY))
            missed = cycles - 1
            expected = self.cycle_end + cycles * self.cycle_time
        self.cycle_end = min(now, (expected + now) / 2)  # lists come late, never early
        self.arrivals.append(now)
        self.clippings.extend([now] * clipping)
        for times in (self.arrivals, self.clippings):
            while times and now - times[0] > RATE_WINDOW:
                times.popleft()
        if shared and not self.misses:  # else the line was there, but no answer
            self.statistics.shared_cycles += missed
            return missed
        self.statistics.lost_cycles += missed
        return 0
