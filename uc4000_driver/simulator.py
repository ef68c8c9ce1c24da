"""Simulated UC4000 sensors: real bytes, stored parameters that change what is detected, a scene.

`SimulatedSensors` is one wire with one or more sensors, without I/O; see
`driver_common.simulated_line` for the transport. The truth is the function `scene` of a sensor.
"""

from __future__ import annotations

import functools
import math
import statistics
import time
from collections.abc import Callable, Iterable, Sequence

from driver_common.errors import FrameError, SettingError, WrongDeviceError
from driver_common.settings import Value
from driver_common.simulated_line import SimulatedLine
from uc4000_driver.commands import CYCLE_TIME, PROFILES, STEP, OpCode, Uc4000Record
from uc4000_driver.settings import ALL_SETTINGS
from uc4000_driver.telegram import (
    BAUD_RATE,
    BYTE_TIME,
    CAST,
    FACTORY_ADDRESS,
    FIRST_ADDRESS,
    GAP,
    LAST_ADDRESS,
    REQUEST_LENGTH,
    ErrorCode,
    Reply,
    Request,
)

PRODUCT = "UC4000"
EVALUATION = 0.005  # s from the end of the last cycle to the reply, at most 10 ms
WRITE_TIME = 0.010  # s to store a parameter
BOOT_TIME = 0.025  # s, section 2.1
VERSION = b"HW:V0.1 SW:V1.200\0"
MIN_DISTANCE, MAX_DISTANCE = 0.25, 4.0  # m
FACTORY_VALUES: dict[str, Value] = {"burst_periods": 32, "gain_db": 72.0, "current_ma": 325,
                                    "temperature_compensation": "on"}

# Sensitivity in dB. The loss of the sound grows with its way, see `_loss`.
_SENSITIVITY = {OpCode.PROFILE_A: 65.34, OpCode.PROFILE_B: 72.0, OpCode.PROFILE_C: 78.0}
_PROFILES = {profile.op_code: profile for profile in PROFILES.values()}
_RECORDS = {setting.record.op_code: (setting, setting.record) for setting in ALL_SETTINGS.values()
            if isinstance(setting.record, Uc4000Record)}

Scene = Callable[[float], float | None]

FILLING_TIME, EMPTYING_TIME = 54.0, 6.0  # s
EMPTY, FULL = 3.8, 0.1  # m from the sensor to the contents


def filling(now: float, phase: float = 0.0) -> float:
    """Return the distance in m to what is in a container that is filled and emptied in turn.

    Args:
        now: Time in s since the epoch.
        phase: Lead in s.
    """
    seconds = (now + phase) % (FILLING_TIME + EMPTYING_TIME)
    if seconds < FILLING_TIME:
        return EMPTY + (FULL - EMPTY) * seconds / FILLING_TIME
    return FULL + (EMPTY - FULL) * (seconds - FILLING_TIME) / EMPTYING_TIME


def scene_of(address: int) -> Scene:
    """Return the truth for the sensor with an address: each has a container of its own."""
    return functools.partial(filling, phase=7.0 * address)


class Refusal(Exception):  # noqa: N818
    """The sensor refuses, with the code that it is given."""


class SimulatedSensor:
    """One sensor, without I/O.

    Attributes:
        address: Its address.
        scene: The truth: distance in m at a time in s since the epoch, None = nothing there.
        temperature: In °C.
        version: What it says its version is.
        codes: Stored raw values by op-code; they survive a power cycle (errata U11).
        refuse: Error codes with which it refuses, by op-code.
        silent: Whether it does not answer.
        evaluation: Time in s from the last cycle to the reply.
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
        self.evaluation = EVALUATION
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
        try:
            data = {OpCode.CAST: bytes((self.address,)), OpCode.VERSION: self.version,
                    OpCode.TEMPERATURE: round(self.temperature).to_bytes(1, "big", signed=True),
                    OpCode.SERIAL_NUMBER: self.serial_number.encode()}[OpCode(request.op_code)]
        except (KeyError, ValueError):
            raise Refusal(ErrorCode.OP_CODE_ERROR) from None
        if request.is_write:
            raise Refusal(ErrorCode.OBJECT_IS_READ_ONLY)
        return now + GAP, Reply(data)

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
            distance = MIN_DISTANCE  # the burst of the other one
        return end + self.evaluation, Reply(bytes((_distance_code(distance),)))

    def detected(self, op_code: OpCode, now: float) -> float | None:
        """Return the distance in m that a profile finds at a time since the epoch, None = none."""
        distance = self.scene(now)
        if distance is None or _loss(distance) > self._sensitivity(op_code):
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


def _distance_code(distance: float | None) -> int:
    """Return the data byte of a distance (errata U4)."""
    if distance is None:
        return 0x00
    if distance < MIN_DISTANCE:
        return 0x01
    return round(distance / STEP) if distance <= MAX_DISTANCE else 0xFF


class SimulatedSensors:
    """Sensors on one wire, without I/O: the device side of the protocol.

    Two that talk at once damage each other's replies. A request that meets a reply is lost.

    Attributes:
        sensors: The sensors.
        baud_rate: The line's baud rate in Bd.
    """

    def __init__(self, sensors: Iterable[SimulatedSensor]) -> None:
        """Connect sensors to a wire."""
        self.sensors = list(sensors)
        self.baud_rate = BAUD_RATE
        self._buffer = bytearray()
        self._last = 0.0
        self._replies: list[tuple[float, float, bytes]] = []  # begin, end, bytes

    def receive(self, data: bytes, now: float) -> list[tuple[float, bytes]]:
        """Take the master's bytes; return replies, each with the time at which it begins.

        A request that stays incomplete is forgotten after a gap; a real sensor says so.
        """
        if now - self._last > GAP + len(data) * BYTE_TIME:
            self._buffer.clear()
        self._last = now
        self._buffer += data
        replies: list[tuple[float, bytes]] = []
        while len(self._buffer) >= REQUEST_LENGTH:
            if self._buffer[0] & 0xF0 != 0xA0:
                del self._buffer[0]
                continue
            telegram = bytes(self._buffer[:REQUEST_LENGTH])
            del self._buffer[:REQUEST_LENGTH]
            replies += self._answer(telegram, now - len(self._buffer) * BYTE_TIME)
        return replies

    def _answer(self, telegram: bytes, now: float) -> list[tuple[float, bytes]]:
        self._replies = [reply for reply in self._replies if reply[1] > now - 1.0]
        if any(begin < now and end > now - REQUEST_LENGTH * BYTE_TIME
               for begin, end, _ in self._replies):
            return []
        answers = [answer for sensor in self.sensors
                   if (answer := _ask(sensor, telegram, now)) is not None]
        return [(due, self._on_the_wire(due, reply)) for due, reply in _merged(answers)]

    def _on_the_wire(self, due: float, reply: bytes) -> bytes:
        """Return what the master hears of a reply that may meet an earlier one."""
        end = due + len(reply) * BYTE_TIME
        for begin, until, other in self._replies:
            if begin < end and due < until:
                reply = _collision([reply, other])
        self._replies.append((due, end, reply))
        return reply


def _ask(sensor: SimulatedSensor, telegram: bytes, now: float) -> tuple[float, bytes] | None:
    try:
        answer = sensor.reply(Request.decode(telegram), now)
    except FrameError:
        if sensor.silent or telegram[0] & 0x07 not in (CAST, sensor.address):
            return None
        answer = now + GAP, Reply(bytes((ErrorCode.CHECKSUM_ERROR,)), acknowledged=False)
    return (answer[0], answer[1].encode()) if answer else None


def _merged(answers: Sequence[tuple[float, bytes]]) -> list[tuple[float, bytes]]:
    """Return what the master hears of replies to one request, which all begin at once."""
    if len(answers) < 2:
        return list(answers)
    return [(min(due for due, _ in answers), _collision([reply for _, reply in answers]))]


def _collision(telegrams: Sequence[bytes]) -> bytes:
    """Return what a wire carries while several drive it: a low bit wins."""
    size = max(map(len, telegrams))
    return bytes(functools.reduce(lambda a, b: a & b, column) for column in zip(
        *(telegram.ljust(size, b"\xff") for telegram in telegrams), strict=True))


def simulated_line(addresses: Sequence[int] = (), *, product: str = PRODUCT, link: str = "",
                   listen: str = "") -> tuple[SimulatedLine, list[SimulatedSensor]]:
    """Return a line with one sensor per address (default: one at the factory's), not yet started.

    Raises:
        SettingError: An address is none of a sensor.
        WrongDeviceError: There is no such product.
        LinkError: The link or the TCP port cannot be made.
    """
    if product.upper() != PRODUCT:
        raise WrongDeviceError(f"there is no simulated {product}; use sim://{PRODUCT}")
    for address in addresses:
        if not FIRST_ADDRESS <= address <= LAST_ADDRESS:
            raise SettingError(f"address {address} is out of range, allowed is "
                               f"{FIRST_ADDRESS} … {LAST_ADDRESS}")
    sensors = [SimulatedSensor(address, serial_number=number)
               for number, address in enumerate(addresses or [FACTORY_ADDRESS], 1)]
    return SimulatedLine(SimulatedSensors(sensors), link=link, listen=listen), sensors
