# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Simulated sensors on one wire: what they answer together, and the wire on a real transport."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Sequence

from driver_common.errors import FrameError, SettingError, WrongDeviceError
from driver_common.simulator.line import SimulatedLine
from uc4000_driver.simulator.sensor import PRODUCT, SimulatedSensor
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

_SYNC = 0xA0


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

        A request is complete with its four bytes, and ends with a gap in any case: then there are
        no bytes at all (section 4.5.2).
        """
        if data and now - self._last > GAP + len(data) * BYTE_TIME:
            self._buffer.clear()
        self._last = now
        self._buffer += data
        if data and len(self._buffer) < REQUEST_LENGTH:
            return []
        telegram = bytes(self._buffer)
        self._buffer.clear()
        return self._answer(telegram, now)

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
    """Return when and what a sensor answers; what has no SYNC byte is no telegram."""
    if not telegram or telegram[0] & 0xF0 != _SYNC:
        return None
    try:
        answer = sensor.reply(Request.decode(telegram), now)
    except FrameError:
        if sensor.silent or telegram[0] & 0x07 not in (CAST, sensor.address):
            return None
        answer = now + GAP, Reply(bytes((_what_is_wrong(telegram),)), acknowledged=False)
    return (answer[0], answer[1].encode()) if answer else None


def _what_is_wrong(telegram: bytes) -> ErrorCode:
    """Return the error code of a damaged request; the manual only names them (section 4.6.2)."""
    if len(telegram) == REQUEST_LENGTH:
        return ErrorCode.CHECKSUM_ERROR
    if len(telegram) > REQUEST_LENGTH:
        return ErrorCode.TELEGRAM_OVERFLOW
    return ErrorCode.TELEGRAM_TIMEOUT if len(telegram) == 1 else ErrorCode.TELEGRAM_UNDERFLOW


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
    return SimulatedLine(SimulatedSensors(sensors), link=link, listen=listen, gap=GAP), sensors
