# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Looking for ICOtronic stationary units and sensors on a CAN bus, read-only.

No sensor is connected. So of those in range only name, MAC address and strength are known.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import TypeVar

from driver_common import advice
from driver_common.errors import FrameError, NoAnswerError, RefusedError
from icotronic_driver import commands
from icotronic_driver.commands import SELF, decode_name
from icotronic_driver.identifier import STU_1
from icotronic_driver.line import Line
from icotronic_driver.request import Command, Request
from icotronic_driver.sensor import SeenSensor
from icotronic_driver.values import decode_text
from sensor_tools.search.place import CanPlace
from sensor_tools.search.result import Finding, Found, Progress, Result

T = TypeVar("T")

FAMILY = "icotronic"
LISTEN_TIME = 0.5  # s for error frames and other hosts to be heard
ANSWER_TIME, ATTEMPTS = 0.3, 3
RANGE_TIME = 3.0  # s in which all sensors are seen: asleep they advertise every 2.5 s at most
LOOK_PERIOD = 0.2  # s
STEPS = 10
NO_MAC = "00:00:00:00:00:00"


def search(place: CanPlace, progress: Progress) -> Iterator[Result]:
    """Yield the stationary unit on a bus and the sensors in its range; raises LinkError."""
    progress.expect(STEPS)
    line = Line(place.interface, place.channel, place.bitrate, place.options)
    line.open()
    try:
        progress.step(f"{place}: listening")
        line.listen(LISTEN_TIME)
        if line.counts.errors:
            yield Finding.of(place, "errors", advice.BUS_ERRORS, count=line.counts.errors,
                             seconds=LISTEN_TIME)
        if line.buffer_warning:
            cause, _, remedy = line.buffer_warning.partition("; ")
            yield Finding(str(place), "buffer", cause, remedy)
        yield from _unit(place, line, progress)
    finally:
        line.close()


def _unit(place: CanPlace, line: Line, progress: Progress) -> Iterator[Result]:
    """Yield the stationary unit and what is behind it."""
    progress.step(f"{place}: stationary unit")
    try:
        is_connected = _ask(line, commands.CHECK_CONNECTED.request(STU_1))
        name, mac = _name_and_mac(line, SELF)
    except (NoAnswerError, RefusedError, FrameError):
        yield Finding.of(place, "stationary unit", advice.NO_UNIT)
        return
    serial = [_optional(line, command) for command in commands.READ_SERIAL_NUMBER]
    firmware = _optional(line, commands.READ_FIRMWARE_VERSION)
    yield Found(FAMILY, place, "STU", mac, place.bitrate, name=name,
                serial_number=decode_text(b"".join(part or b"" for part in serial)),
                firmware=str(firmware or ""), is_sensor=False)
    if line.counts.other_host:
        yield Finding.of(place, "other hosts", advice.OTHER_HOST)
    if is_connected:
        yield Finding.of(place, "sensors", advice.CONNECTED_ELSEWHERE)
        return
    sensors = _in_range(place, line, progress)
    for sensor in sensors:
        yield Found(FAMILY, place, "STH", sensor.mac, place.bitrate, name=sensor.name,
                    rssi=sensor.rssi, parameters={"sensor_mac": sensor.mac})
    if not sensors:
        yield Finding.of(place, "sensors", advice.NONE_IN_RANGE)


def _in_range(place: CanPlace, line: Line, progress: Progress) -> list[SeenSensor]:
    """Return the sensors in range; of one just discovered MAC and RSSI come later."""
    seen: dict[int, SeenSensor] = {}
    end = time.monotonic() + RANGE_TIME
    steps = STEPS - 2
    _ask(line, commands.ACTIVATE_BLUETOOTH.request(STU_1))
    while (remaining := end - time.monotonic()) > 0:
        if remaining < steps * RANGE_TIME / (STEPS - 2):
            progress.step(f"{place}: sensors in range: {len(seen)}")
            steps -= 1
        for number in range(_ask(line, commands.COUNT_DEVICES.request(STU_1))):
            name, mac = _name_and_mac(line, number)
            rssi = _ask(line, commands.READ_RSSI.request(STU_1, number))
            seen[number] = SeenSensor(number, name, mac, rssi)
        line.listen(LOOK_PERIOD)
    return [one for one in seen.values() if one.mac != NO_MAC]


def _name_and_mac(line: Line, number: int) -> tuple[str, str]:
    """Return name and MAC address of a device that the unit sees, or of the unit itself."""
    name = decode_name(*(_ask(line, part.request(STU_1, number))
                         for part in (commands.READ_NAME_1, commands.READ_NAME_2)))
    return name, _ask(line, commands.READ_MAC.request(STU_1, number))


def _ask(line: Line, request: Request[T]) -> T:
    return line.request(request, ANSWER_TIME, ATTEMPTS)


def _optional(line: Line, command: Command[[], T]) -> T | None:
    """Return what not every unit tells."""
    try:
        return line.request(command.request(STU_1), ANSWER_TIME, 1)
    except (NoAnswerError, RefusedError, FrameError):
        return None
