# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A simulated radar of any model: real bytes, settings with RAM and EEPROM, moving targets."""

from __future__ import annotations

import dataclasses
import fnmatch
import itertools
import math
import statistics
import struct
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, cast

import numpy as np

from driver_common.errors import SettingError
from driver_common.settings import Raw, Setting, Value
from isys_radar_driver import commands
from isys_radar_driver.commands import IsysRecord, Location
from isys_radar_driver.frames import (
    FAILURE,
    FIRST_ADDRESS,
    LAST_ADDRESS,
    MASTER,
    READ_RAW_SIGNALS,
    READ_TARGET_LIST,
    Delimiter,
    Frame,
)
from isys_radar_driver.models import FAST, Model
from isys_radar_driver.settings import OTHER_VIEW, is_application_setting, settings_of
from isys_radar_driver.simulator.scene import scene_of
from isys_radar_driver.targets import (
    FIXED_LENGTH,
    Resolution,
    Target,
    TargetList,
    encode_target_list,
)

TURNAROUND = 0.001  # s from the end of a request to the reply
BOOT_TIME = 0.5  # s without answers after power-on
FIXED_TARGETS = 10  # length of a fixed-length list; the manual leaves it to the data sheet
MAX_DELAY = 1000  # cycles that rising and falling delays look back
RAW_SIGNAL_COUNT, RAW_SAMPLES, RAW_SAMPLE_TIME_US = 4, 512, 25

# Factory values by name pattern; the first that matches counts, 0 or the minimum otherwise.
_FACTORY: Sequence[tuple[str, Value]] = (
    ("*.range_max*", math.inf), ("*.signal_max_db", math.inf), ("*.velocity_max", math.inf),
    ("*.alpha_filter_*", 100), ("*.direction", "both"), ("output1.mode", "digital"),
    ("frequency_channel", 1), ("measurement_mode", "multi_target"), ("led", "enabled"),
    ("line_filter*.frequency", 50), ("threshold_minimum_db", 10.0),
    ("amplifier_potentiometer", 50), ("ip.address", "192.168.60.20"),
    ("ip.subnet_mask", "255.255.255.0"), ("ip.gateway", "192.168.60.1"),
    ("ip_destination.address", "192.168.60.30"), ("ip_destination.target_list_port", 2050),
    ("ip_destination.record_port", 2048), ("target_list_interface", "ethernet"),
    ("output1.temperature_threshold_celsius", 55.0),
    ("output2.temperature_threshold_celsius", 60.0), ("output1.temperature_warning_celsius", 55.0),
    ("output2.temperature_warning_celsius", 60.0), ("range_bound", "150_m"),
    ("moving_target_sensitivity.*", 3.0), ("target_clustering", True),
)

_SINGLE_VALUE: Mapping[str, Callable[[list[float]], float]] = {
    "mean": statistics.fmean, "median": statistics.median_low,
    "min": lambda values: min(values), "max": lambda values: max(values)}

# What cannot be true of a list, for any model that measures it.
_NONSENSE: Sequence[Callable[[TargetList], TargetList]] = (
    lambda measured: dataclasses.replace(measured, output=measured.output % 3 + 1),
    lambda measured: dataclasses.replace(measured, targets=(Target(40.0, 0.0, -5.0, 0.0),)),
    lambda measured: dataclasses.replace(measured, targets=(Target(40.0, 0.0, 2000.0, 0.0),)),
    lambda measured: dataclasses.replace(measured, targets=(Target(300.0, 0.0, 1.0, 0.0),)),
)


OPTIONAL = ("led", "frequency_channel")  # settings without which a radar measures as well


class Refusal(Exception):  # noqa: N818
    """The radar answers with a failure."""


class Silence(Exception):  # noqa: N818
    """The radar does not answer."""


class SimulatedRadar:
    """One radar, without I/O.

    Attributes:
        model: Its model.
        address: Its address.
        started: Monotonic time in s at which its first cycle began.
        scene: Truth of the targets; can be replaced.
        clipping: Whether the receiver is overloaded.
        refuse: Function codes which it refuses although it could.
        silent: Whether it does not answer.
        strict: Whether it refuses a start while it measures, and a stop while it does not.
        self_starting: Whether it measures from power-on, without being told.
        bare: Whether it stays silent where a driver can do without an answer.
        nonsense: Whether its target lists say what cannot be true, behind a good checksum.
    """

    def __init__(self, model: Model, address: int = 0, serial_number: int = 1, *,
                 range_bound: bool = False) -> None:
        """Power it on with factory settings.

        Args:
            model: Its model.
            address: Its address; 0 = that of the model.
            serial_number: Its serial number.
            range_bound: Whether its firmware has the setting of this name, if its model can.
        """
        self.model = model
        self.address = address or model.address
        self.serial_number = serial_number
        self.scene = scene_of(model)
        self.clipping = False
        self.refuse: set[int] = set()
        self.silent = False
        self.strict = False
        self.self_starting = False
        self.bare = False
        self.nonsense = False
        self.temperature = 41.5
        self.measuring = False
        self.settings = settings_of(model)
        if not range_bound:
            self.settings.pop("range_bound", None)
        self._fields: dict[IsysRecord, dict[int, Setting]] = {}
        for setting in self.settings.values():
            record = cast(IsysRecord, setting.record)
            self._fields.setdefault(record, {})[setting.field] = setting
        self._by_address = {(record.function_code, record.sub_function, record.selector): record
                            for record in self._fields}
        self.ram = self._factory()
        self.eeprom = dict(self.ram)
        self.started = 0.0
        self._ready = 0.0
        self._nonsense = itertools.cycle(_NONSENSE)

    # --- for tests and people ---

    def power_cycle(self, now: float | None = None) -> None:
        """Lose the RAM and the acquisition; answer again after the boot time."""
        self.ram = dict(self.eeprom)
        self._ready = (time.monotonic() if now is None else now) + BOOT_TIME
        self.measuring = self.self_starting
        self.started = max(self._ready, 0.0)

    def value(self, name: str, location: Location = Location.RAM) -> Value:
        """Return the value of a setting."""
        setting = self.settings[name]
        store = self.eeprom if location is Location.EEPROM else self.ram
        return setting.decode(store[cast(IsysRecord, setting.record)][setting.field])

    def set_value(self, name: str, value: Value) -> None:
        """Change a setting in the RAM, behind the driver's back."""
        self._store(self.settings[name], value)
        self._show_in_other_view(self.settings[name])

    def _store(self, setting: Setting, value: Value) -> None:
        record = cast(IsysRecord, setting.record)
        raws = list(self.ram[record])
        raws[setting.field] = setting.encode(value)
        self.ram[record] = tuple(raws)

    # --- protocol ---

    def reply(self, request: Frame, now: float) -> tuple[float, Frame] | None:
        """Return the reply to a request and the monotonic time at which it begins."""
        if self.silent or now < self._ready or (self.bare and _is_optional(request)):
            return None
        due = now + TURNAROUND
        delimiter = Delimiter.SD2
        try:
            if request.function_code in self.refuse:
                raise Refusal
            handler = self._HANDLERS.get(request.function_code)
            if handler is None:
                raise Refusal
            if request.function_code in (READ_TARGET_LIST, READ_RAW_SIGNALS):
                due = self._next_cycle(due)
                delimiter = self._delimiter(request)
            pdu = handler(self, request.pdu, due)
            function_code = request.function_code
        except Silence:
            return None
        except (Refusal, struct.error, IndexError):
            pdu, function_code, delimiter = b"", FAILURE, Delimiter.SD2
        return due, Frame(MASTER, self.address, function_code, pdu, delimiter)

    def _read_device_name(self, pdu: bytes, now: float) -> bytes:
        self._require(commands.READ_DEVICE_NAME)
        return f"{self.model.name} {self.serial_number:06d}\0".encode()

    def _command(self, pdu: bytes, now: float) -> bytes:
        for command in (commands.START, commands.STOP, commands.READ_DSP_TEMPERATURE,
                        commands.READ_RFE_TEMPERATURE,
                        commands.SET_DEFAULT_TEMPERATURE_THRESHOLDS):
            if pdu == command.sub_function:
                self._require(command)
                break
        else:
            raise Refusal
        if command in (commands.START, commands.STOP):
            self._start_or_stop(command is commands.START, now)
        elif command is commands.SET_DEFAULT_TEMPERATURE_THRESHOLDS:
            for number, value in ((1, 55.0), (2, 60.0)):
                self.set_value(f"output{number}.temperature_threshold_celsius", value)
            return struct.pack(">3h", 5500, 6000, 0)
        else:
            offset = 3.0 if command is commands.READ_DSP_TEMPERATURE else 0.0
            return struct.pack(">h", round((self.temperature + offset) * 100))
        return b""

    def _start_or_stop(self, start: bool, now: float) -> None:
        if self.strict and start == self.measuring:
            raise Refusal
        if start and not self.measuring:
            self.started = now
        self.measuring = start

    def _read_sensor(self, pdu: bytes, now: float) -> bytes:
        if pdu == commands.READ_ADDRESS.sub_function:
            return struct.pack(">H", self.address)
        return self._read_record(commands.READ_SENSOR, pdu)

    def _write_sensor(self, pdu: bytes, now: float) -> bytes:
        if pdu[:2] == commands.READ_ADDRESS.sub_function:
            (address,) = struct.unpack(">H", pdu[2:])
            if not FIRST_ADDRESS <= address <= LAST_ADDRESS:
                raise Refusal
            self.address = address  # stored at once, acknowledged from the new one (errata I17)
            return b""
        return self._write_record(commands.READ_SENSOR, pdu)

    def _read_application(self, pdu: bytes, now: float) -> bytes:
        return self._read_record(commands.READ_APPLICATION, pdu)

    def _write_application(self, pdu: bytes, now: float) -> bytes:
        return self._write_record(commands.READ_APPLICATION, pdu)

    def _find_record(self, function_code: int, pdu: bytes) -> tuple[IsysRecord, Location, bytes]:
        (sub_function,) = struct.unpack(">H", pdu[:2])
        for record in self._fields:
            if (record.function_code, record.sub_function) != (function_code, sub_function):
                continue
            location, rest = Location.RAM, pdu[2:]
            if record.has_location:
                if rest[0] not in (Location.RAM, Location.EEPROM):
                    raise Refusal
                location, rest = Location(rest[0]), rest[1:]
            if rest.startswith(record.selector):
                return record, location, rest[len(record.selector):]
        raise Refusal

    def _read_record(self, function_code: int, pdu: bytes) -> bytes:
        record, location, rest = self._find_record(function_code, pdu)
        if rest:
            raise Refusal
        if self.bare and any(setting.name in OPTIONAL for setting in self._fields[record].values()):
            raise Silence
        store = self.eeprom if location is Location.EEPROM else self.ram
        repeats = record.has_location and record.sub_function >> 8 == 0x07  # errata I14
        prefix = bytes((location,)) + record.selector if repeats else b""
        return prefix + record.pack(store[record])

    def _write_record(self, function_code: int, pdu: bytes) -> bytes:
        record, location, rest = self._find_record(function_code, pdu)
        if len(rest) != record.size:
            raise Refusal
        values = record.unpack(rest)
        for index, setting in self._fields[record].items():
            self._check(setting, values[index])
        changed = [setting for index, setting in self._fields[record].items()
                   if values[index] != self.ram[record][index]]
        self.ram[record] = values
        for setting in changed:
            self._show_in_other_view(setting)
        if location is Location.EEPROM or record.stored_at_once:
            self.eeprom[record] = values
        return b""

    def _show_in_other_view(self, setting: Setting) -> None:
        """Have the other setting of the same boundary, if any, show the new value (N15)."""
        other = self.settings.get(OTHER_VIEW.get(setting.name, ""))
        if other is not None:
            value, (low, high) = self.value(setting.name), other.limits
            assert isinstance(value, float)
            assert low is not None
            assert high is not None
            self._store(other, min(max(value, low), high))

    def _check(self, setting: Setting, raw: Raw) -> None:
        """Refuse what is out of range, not possible now, or beyond its own other limit."""
        if setting.read_only or (setting.needs_stop and self.measuring):
            raise Refusal
        if setting.kind is bool and raw not in (0, 1):
            raise Refusal
        try:
            value = setting.check(setting.decode(raw))
        except SettingError:
            raise Refusal from None
        for here, there, sign in (("_min", "_max", 1), ("_max", "_min", -1)):
            other = self.settings.get(setting.name.replace(here, there))
            if here in setting.name and other is not None and other.record != setting.record:
                limit = self.value(other.name)
                if sign * cast(float, value) > sign * cast(float, limit):
                    raise Refusal

    def _read_calibration(self, pdu: bytes, now: float) -> bytes:
        if pdu == commands.READ_PRODUCT_INFORMATION.sub_function:
            return struct.pack(">H", self.model.product_code)
        versions = {commands.READ_FIRMWARE_VERSION: (1, 3, 310),
                    commands.READ_DSP_HARDWARE_VERSION: (1, 1, 1),
                    commands.READ_RFE_HARDWARE_VERSION: (1, 1, 2),
                    commands.READ_BOOTLOADER_VERSION: (1, 4, 0)}
        for command, version in versions.items():
            if pdu == command.sub_function:
                return struct.pack(">HHH", *version)
        raise Refusal

    def _read_target_list(self, pdu: bytes, now: float) -> bytes:
        output, resolution = self._list_request(pdu)
        if not self.measuring or resolution.bits not in (
                possible.bits for possible in self.model.resolutions
                if possible.fixed_length == resolution.fixed_length):
            raise Refusal
        targets = self.targets(output, self._wall_time(now))
        fixed = FIXED_TARGETS if resolution.fixed_length else 0
        limit = fixed or self.model.max_targets.get(self._mode, 1)
        measured = TargetList(output, () if self.clipping else tuple(targets[:limit]),
                              self.clipping)
        if self.nonsense:
            measured = next(self._nonsense)(measured)
        return encode_target_list(measured, resolution, self.model.range_step_16, fixed)

    @staticmethod
    def _list_request(pdu: bytes) -> tuple[int, Resolution]:
        if len(pdu) not in (1, 2) or pdu[0] not in (1, 2, 3):
            raise Refusal
        try:
            return pdu[0], Resolution(pdu[1]) if len(pdu) == 2 else Resolution.NONE
        except ValueError:
            raise Refusal from None

    def _delimiter(self, request: Frame) -> Delimiter:
        """Raw signals and 32-bit lists come with SD3 (section 3.2.7)."""
        if request.function_code == READ_RAW_SIGNALS:
            return Delimiter.SD3
        bits = request.pdu[1] & ~FIXED_LENGTH if len(request.pdu) > 1 else 16
        return Delimiter.SD3 if bits == 32 else Delimiter.SD2

    def _read_digital_outputs(self, pdu: bytes, now: float) -> bytes:
        self._require(commands.READ_DIGITAL_OUTPUTS)
        return struct.pack(">3h", *(self._digital_output(n, self._wall_time(now))
                                    for n in (1, 2, 3)))

    def _digital_output(self, number: int, now: float) -> int:
        targets = self.targets(number, now)
        mode = self.value(f"output{number}.mode")
        if mode == "pwm" and targets:
            nearest = min(targets, key=lambda target: target.range)
            by_velocity = self.value(f"output{number}.filter_signal") == "velocity"
            return round((nearest.velocity if by_velocity else nearest.range) * 100)
        closed = self.value(f"output{number}.contact") == "normally_closed"
        return int((mode == "digital" and bool(targets)) != closed)

    def _eeprom_function(self, pdu: bytes, now: float) -> bytes:
        self._require(commands.SAVE_ALL_SETTINGS)
        if pdu == commands.RESTORE_FACTORY_SETTINGS.sub_function:
            self.ram = self._factory()
            self.eeprom = dict(self.ram)
            return b""
        wanted = {commands.SAVE_SENSOR_SETTINGS.sub_function: (False,),
                  commands.SAVE_APPLICATION_SETTINGS.sub_function: (True,),
                  commands.SAVE_ALL_SETTINGS.sub_function: (False, True)}.get(pdu)
        if wanted is None:
            raise Refusal
        for record, fields in self._fields.items():
            if is_application_setting(next(iter(fields.values()))) in wanted:
                self.eeprom[record] = self.ram[record]
        return b""

    def _read_raw_signals(self, pdu: bytes, now: float) -> bytes:
        self._require(commands.READ_RAW)
        if not self.measuring or pdu:
            raise Refusal
        times = np.arange(RAW_SAMPLES) * RAW_SAMPLE_TIME_US * 1e-6
        signals = np.stack([8000.0 * np.sin(2 * np.pi * 500.0 * (index + 1) * times)
                            for index in range(RAW_SIGNAL_COUNT)])
        wire, size = (">f4", 4) if self.model.raw_as_float else (">i2", 2)
        header = struct.pack(">BBBI", RAW_SIGNAL_COUNT, RAW_SAMPLES // 16, size,
                             RAW_SAMPLE_TIME_US)
        return header + signals.T.astype(wire).tobytes()

    def _read_range_list(self, pdu: bytes, now: float) -> bytes:
        self._require(commands.READ_RANGE_LIST)
        if not self.measuring:
            raise Refusal
        targets = self.targets(1, self._wall_time(now))
        nearest = min(targets, key=lambda target: target.range, default=Target(0, 0, 0, 0))
        return struct.pack(">ihh4i", round(nearest.range * 1e6), round(nearest.signal * 100),
                           round(self.temperature * 100), 0, 0, 0, 0)

    def targets(self, output: int, now: float) -> list[Target]:
        """Return the targets which an output's filter lets through, at a time since the epoch."""
        rising, falling = (cast(int, self.value(f"output{output}.{edge}_delay_cycles"))
                           if f"output{output}.{edge}_delay_cycles" in self.settings else 0
                           for edge in ("rising", "falling"))
        passed = self._filtered(output, now)
        if rising or falling:
            passed = self._delayed(output, now, rising, falling)
        return self._single_target(output, [target for target in passed if target is not None])

    def _delayed(self, output: int, now: float, rising: int, falling: int) -> list[Target | None]:
        """Report what was seen in enough cycles, and until it was not for enough (3.3.5.3)."""
        cycle_time = self.model.cycle_time(self._mode)
        reported: dict[int, Target] = {}
        seen: dict[int, int] = {}  # cycles in a row, negative where it was not seen
        for cycle in range(min(MAX_DELAY, 2 * (rising + falling) + 1), -1, -1):
            for index, target in enumerate(self._filtered(output, now - cycle * cycle_time)):
                before = seen.get(index, 0)
                seen[index] = max(before, 0) + 1 if target else min(before, 0) - 1
                if target and (index in reported or seen[index] >= rising):
                    reported[index] = target
                elif -seen[index] >= falling:
                    reported.pop(index, None)
        return [*reported.values()]

    def _filtered(self, output: int, now: float) -> list[Target | None]:
        """Return the targets of a cycle, None for those which the limits do not let through."""
        def limits(what: str, more: str = "") -> tuple[float, float]:
            pair = [self.settings.get(f"output{output}.{what.format(end)}{more}")
                    for end in ("min", "max")]
            low, high = (cast(float, self.value(setting.name)) if setting else default
                         for setting, default in zip(pair, (-math.inf, math.inf), strict=True))
            return low, high

        def within(value: float, pair: tuple[float, float]) -> bool:
            return pair[0] <= value <= pair[1]

        fine = f"output{output}.range_min_extended" in self.settings
        ranges = limits("range_{}", "_extended" if fine else "")
        signals, velocities = limits("signal_{}_db"), limits("velocity_{}")
        direction = (self.value(f"output{output}.direction")
                     if f"output{output}.direction" in self.settings else "both")
        offset = (cast(float, self.value("mounting_offset"))
                  if "mounting_offset" in self.settings else 0.0)

        def on_course(target: Target) -> bool:
            return direction == "both" or (target.velocity > 0) == (direction == "approaching")

        measured = [target._replace(range=target.range - offset) for target in self.scene(now)
                    if target.range <= self._farthest]
        return [target if within(target.range, ranges) and within(target.signal, signals)
                and within(abs(target.velocity), velocities) and on_course(target) else None
                for target in measured]

    def _single_target(self, output: int, targets: list[Target]) -> list[Target]:
        signal = self.value(f"output{output}.filter_signal")
        if signal == "disabled" or not targets:
            return targets
        kind = self.value(f"output{output}.filter_type")
        if kind == "highest_amplitude":
            return [max(targets, key=lambda target: target.signal)]
        attribute = "velocity" if signal == "velocity" else "range"
        values = [getattr(target, attribute) for target in targets]
        wanted = _SINGLE_VALUE[str(kind)](values)
        nearest = min(targets, key=lambda target: abs(getattr(target, attribute) - wanted))
        return [nearest._replace(**{attribute: wanted})]

    @property
    def _farthest(self) -> float:
        """Range in m beyond which it measures nothing."""
        bound = self.value("range_bound") if "range_bound" in self.settings else ""
        return 50.0 if bound == "50_m" else math.inf

    # --- helpers ---

    def _require(self, command: commands.Command[Any]) -> None:
        if not self.model.supports(command):
            raise Refusal

    @property
    def _mode(self) -> int:
        if "measurement_mode" not in self.settings:
            return FAST
        return cast(int, self.ram[cast(IsysRecord, self.settings["measurement_mode"].record)][0])

    def _next_cycle(self, now: float) -> float:
        """Return the end of the measurement that is going on."""
        if not self.measuring:
            return now
        cycle_time = self.model.cycle_time(self._mode)
        cycles = math.floor((now - self.started) / cycle_time) + 1
        return self.started + cycles * cycle_time

    @staticmethod
    def _wall_time(now: float) -> float:
        return time.time() + now - time.monotonic()

    def _factory(self) -> dict[IsysRecord, tuple[Raw, ...]]:
        stores: dict[IsysRecord, tuple[Raw, ...]] = {}
        for record, fields in self._fields.items():
            raws: list[Raw] = [0] * len(record.layout)
            for index, setting in fields.items():
                raws[index] = self._factory_value(setting)
            stores[record] = tuple(raws)
        return stores

    @staticmethod
    def _factory_value(setting: Setting) -> Raw:
        for pattern, value in _FACTORY:
            if fnmatch.fnmatch(setting.name, pattern):
                return setting.encode(setting.limits[1] if value == math.inf else value)
        if setting.choices is not None:
            return next(iter(setting.choices.values()))
        return setting.encode(setting.minimum) if setting.minimum is not None else 0

    _HANDLERS: ClassVar[dict[int, Callable[[SimulatedRadar, bytes, float], bytes]]] = {
        0xD0: _read_device_name, 0xD1: _command,
        commands.READ_SENSOR: _read_sensor, commands.READ_SENSOR + 1: _write_sensor,
        commands.READ_APPLICATION: _read_application,
        commands.READ_APPLICATION + 1: _write_application,
        0xD6: _read_calibration, READ_TARGET_LIST: _read_target_list,
        0xDB: _read_digital_outputs, 0xDF: _eeprom_function,
        READ_RAW_SIGNALS: _read_raw_signals, 0xE1: _read_range_list,
    }


def _is_optional(request: Frame) -> bool:
    """Whether a driver can do without the answer."""
    return (request.function_code, request.pdu) in {
        (command.function_code, command.sub_function) for command in (
            commands.READ_DSP_HARDWARE_VERSION, commands.READ_RFE_HARDWARE_VERSION,
            commands.READ_BOOTLOADER_VERSION, commands.READ_DSP_TEMPERATURE,
            commands.READ_RFE_TEMPERATURE)}
