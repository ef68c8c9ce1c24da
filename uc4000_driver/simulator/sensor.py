# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A simulated UC4000: real bytes, stored parameters that change what is detected, a scene."""

from __future__ import annotations

import math
import statistics
import time

from driver_common.errors import SettingError
from driver_common.settings import Value
from uc4000_driver.commands import CYCLE_TIME, PROFILES, STEP, OpCode, Uc4000Record
from uc4000_driver.settings import ALL_SETTINGS
from uc4000_driver.simulator.scene import scene_of
from uc4000_driver.telegram import (
    CAST,
    FACTORY_ADDRESS,
    FIRST_ADDRESS,
    GAP,
    LAST_ADDRESS,
    ErrorCode,
    Reply,
    Request,
)

PRODUCT = "UC4000"
EVALUATION = 0.005  # s from the end of the last cycle to the reply, at most 10 ms
WRITE_TIME = 0.010  # s to store a parameter
BOOT_TIME = 0.025  # s, section 2.1
VERSION = b"HW:V0.1 SW:V1.200\0"
LIMITS = (0.25, 4.0)  # m
FACTORY_VALUES: dict[str, Value] = {"burst_periods": 32, "gain_db": 72.0, "current_ma": 325,
                                    "temperature_compensation": "on"}

# Sensitivity in dB. The loss of the sound grows with its way, see `_loss`.
_SENSITIVITY = {OpCode.PROFILE_A: 65.34, OpCode.PROFILE_B: 72.0, OpCode.PROFILE_C: 78.0}
_PROFILES = {profile.op_code: profile for profile in PROFILES.values()}
_RECORDS = {setting.record.op_code: (setting, setting.record) for setting in ALL_SETTINGS.values()
            if isinstance(setting.record, Uc4000Record)}


class Refusal(Exception):  # noqa: N818
    """The sensor refuses, with the code that it is given."""


class SimulatedSensor:
    """One sensor, without I/O.

    Attributes:
        address: Its address.
        scene: The truth: distance in m at a time in s since the epoch, None = nothing there.
        temperature: In °C; NaN = its thermometer is broken.
        version: What it says its version is.
        codes: Stored raw values by op-code; they survive a power cycle (errata U11).
        refuse: Error codes with which it refuses, by op-code.
        silent: Whether it does not answer.
        at_once: Whether it answers without measuring first.
        evaluation: Time in s from the last cycle to the reply.
        limits: Smallest and largest distance in m that it reports as one.
        overreach: In dB, by which it hears more than its profiles promise.
        hears: Sensors that disturb it while both measure.
        measurements: When its last measurements began and ended, monotonic.
    """

    def __init__(self, address: int = FACTORY_ADDRESS, serial_number: int = 1) -> None:
        """Power it on with factory settings."""
        self.address = address
        self.serial_number = f"{40000016900000 + serial_number:014d}"
        self.scene = scene_of(address)
        self.temperature = 21.0
        self.version = VERSION
        self.codes: dict[int, int] = {}
        self.refuse: dict[int, int] = {}
        self.silent = False
        self.at_once = False
        self.evaluation = EVALUATION
        self.limits = LIMITS
        self.overreach = 0.0
        self.hears: list[SimulatedSensor] = []
        self.measurements: list[tuple[float, float]] = []
        self._ready = 0.0
        self.restore_factory_settings()

    def restore_factory_settings(self) -> None:
        """Forget all settings but the address."""
        for name, value in FACTORY_VALUES.items():
            self.set_value(name, value)

    def power_cycle(self, now: float | None = None) -> None:
        """Begin anew, and answer after the boot time."""
        self._ready = (time.monotonic() if now is None else now) + BOOT_TIME

    def value(self, name: str) -> Value:
        """Return the value of a setting."""
        setting = ALL_SETTINGS[name]
        return setting.decode(self.codes[_op_code(name)])

    def set_value(self, name: str, value: Value) -> None:
        """Change a setting behind the driver's back."""
        raw = ALL_SETTINGS[name].encode(value)
        assert isinstance(raw, int)
        self.codes[_op_code(name)] = raw

    # --- protocol ---

    def reply(self, request: Request, now: float) -> tuple[float, Reply] | None:
        """Return the reply to a request that ended at `now`, and when it begins (monotonic)."""
        if self.silent or now < self._ready or request.address not in (CAST, self.address):
            return None
        try:
            if request.op_code in self.refuse:
                raise Refusal(self.refuse[request.op_code])
            if request.address == CAST and request.op_code != OpCode.CAST:
                return None  # the manual knows one cast
            return self._answer(request, now)
        except Refusal as refusal:
            return now + GAP, Reply(bytes(refusal.args), acknowledged=False)

    def _answer(self, request: Request, now: float) -> tuple[float, Reply]:
        if request.op_code in _PROFILES:
            return self._measure(request, now)
        if request.op_code in _RECORDS or request.op_code == OpCode.ADDRESS:
            return self._read_or_write(request, now)
        known: dict[int, bytes] = {
            OpCode.CAST: bytes((self.address,)), OpCode.VERSION: self.version,
            OpCode.TEMPERATURE: self._temperature_code(),
            OpCode.SERIAL_NUMBER: self.serial_number.encode()}
        data = known.get(request.op_code)
        if data is None:
            raise Refusal(ErrorCode.OP_CODE_ERROR)
        if request.is_write:
            raise Refusal(ErrorCode.OBJECT_IS_READ_ONLY)
        if not data:
            raise Refusal(ErrorCode.TEMPERATURE_ERROR)
        return now + GAP, Reply(data)

    def _temperature_code(self) -> bytes:
        """Return the data byte of the temperature (errata U5), none where it has none."""
        if not -128 <= self.temperature <= 127:  # or not a number: its thermometer is broken
            return b""
        return round(self.temperature).to_bytes(1, "big", signed=True)

    def _read_or_write(self, request: Request, now: float) -> tuple[float, Reply]:
        if not request.is_write:
            if request.op_code == OpCode.TEMPERATURE_COMPENSATION:
                raise Refusal(ErrorCode.OP_CODE_ERROR)  # the manual knows no way to read it
            code = self.address if request.op_code == OpCode.ADDRESS else self.codes[
                request.op_code]
            return now + GAP, Reply(bytes((code,)))
        if request.op_code == OpCode.ADDRESS:
            if not FIRST_ADDRESS <= request.data <= LAST_ADDRESS:
                raise Refusal(ErrorCode.PARAMETER_ERROR)
            self.address = request.data
        else:
            setting, _ = _RECORDS[request.op_code]
            try:
                setting.check(setting.decode(request.data))
            except SettingError:
                raise Refusal(ErrorCode.PARAMETER_ERROR) from None
            self.codes[request.op_code] = request.data
        return now + GAP + WRITE_TIME, Reply(bytes((request.data,)))

    # --- measuring ---

    def _measure(self, request: Request, now: float) -> tuple[float, Reply]:
        cycles = 0xFF - request.data
        if request.is_write:
            raise Refusal(ErrorCode.OBJECT_IS_READ_ONLY)
        if not cycles:
            raise Refusal(ErrorCode.PARAMETER_ERROR)  # errata U3
        end = now + cycles * CYCLE_TIME
        self.measurements = [*self.measurements[-99:], (now, end)]
        wall_time = time.time() + now - time.monotonic()
        found = [self.detected(OpCode(request.op_code), wall_time + (cycle + 0.5) * CYCLE_TIME)
                 for cycle in range(cycles)]
        echoes = [distance for distance in found if distance is not None]
        distance = statistics.fmean(echoes) if echoes else None
        if any(other.measurements and other.measurements[-1][1] > now for other in self.hears):
            distance = self.limits[0]  # the burst of the other one
        due = now if self.at_once else end + self.evaluation
        return due, Reply(bytes((self._distance_code(distance),)))

    def _distance_code(self, distance: float | None) -> int:
        """Return the data byte of a distance (errata U4)."""
        if distance is None:
            return 0x00
        if distance < self.limits[0]:
            return 0x01
        return round(distance / STEP) if distance <= self.limits[1] else 0xFF

    def detected(self, op_code: OpCode, now: float) -> float | None:
        """Return the distance in m that a profile finds at a time since the epoch, None = none."""
        distance = self.scene(now)
        if distance is None or _loss(distance) > self._sensitivity(op_code) + self.overreach:
            return None
        if self.value("temperature_compensation") == "off":
            distance *= _speed_of_sound(20.0) / _speed_of_sound(self.temperature)
        return distance

    def _sensitivity(self, op_code: OpCode) -> float:
        """Return the sensitivity of a profile in dB; the user's follows from its parameters."""
        if op_code != OpCode.USER_PROFILE:
            return _SENSITIVITY[op_code]
        burst, gain, current = (self._number(name) for name in (
            "burst_periods", "gain_db", "current_ma"))
        return gain + 10 * math.log10(burst / 32) + 20 * math.log10(current / 325)

    def _number(self, name: str) -> float:
        value = self.value(name)
        assert isinstance(value, (int, float))
        return value


def _op_code(name: str) -> int:
    record = ALL_SETTINGS[name].record
    assert isinstance(record, Uc4000Record)
    return record.op_code


def _loss(distance: float) -> float:
    """Return what the sound loses on its way in dB: it spreads, and the air absorbs."""
    return 26.07 + 40 * math.log10(max(distance, 0.01)) + 5 * distance


def _speed_of_sound(celsius: float) -> float:
    return 331.3 * math.sqrt(1 + celsius / 273.15)
