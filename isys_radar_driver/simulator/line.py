# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Simulated radars on one line: what they answer together, and the line on a real transport."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from driver_common.errors import SettingError
from driver_common.simulator.line import SimulatedLine
from isys_radar_driver.frames import (
    BROADCAST,
    FIRST_ADDRESS,
    LAST_ADDRESS,
    MASTER,
    MAX_GAP,
    Frame,
    FrameParser,
)
from isys_radar_driver.models import find_model
from isys_radar_driver.simulator.radar import SimulatedRadar


class SimulatedRadars:
    """Radars on one line, without I/O: the device side of the protocol.

    Attributes:
        radars: The radars.
        baud_rate: The line's baud rate in Bd.
    """

    def __init__(self, radars: Iterable[SimulatedRadar], baud_rate: int = 0) -> None:
        """Connect radars to a line; the baud rate is the first one's unless given."""
        self.radars = list(radars)
        self.baud_rate = baud_rate or self.radars[0].model.baud_rate
        self._parser = FrameParser()
        self._last = 0.0

    def receive(self, data: bytes, now: float) -> list[tuple[float, bytes]]:
        """Take the master's bytes; return replies, each with the time at which it begins."""
        if self._parser.pending and now - self._last > MAX_GAP + len(data) * 10 / self.baud_rate:
            self._parser = FrameParser()  # section 3.2.8: the gap ends the frame
        self._last = now
        replies: list[tuple[float, bytes]] = []
        for request in self._parser.feed(data):
            if request.source == MASTER:
                replies += self._answer(request, now)
        return replies

    def _answer(self, request: Frame, now: float) -> list[tuple[float, bytes]]:
        answers = [answer for radar in self.radars
                   if request.destination in (BROADCAST, radar.address)
                   and (answer := radar.reply(request, now)) is not None]
        if len(answers) < 2:
            return [(due, frame.encode()) for due, frame in answers]
        return [(answers[0][0], _collision([frame.encode() for _, frame in answers]))]


def _collision(frames: Sequence[bytes]) -> bytes:
    """Return what a line carries while several drive it: a low bit wins."""
    size = max(map(len, frames))
    collided = bytearray(b"\xff" * size)
    for frame in frames:
        for index, byte in enumerate(frame.ljust(size, b"\xff")):
            collided[index] &= byte
    return bytes(collided)


def simulated_line(models: Sequence[str], addresses: Sequence[int] = (), *, baud_rate: int = 0,
                   link: str = "", listen: str = "", range_bound: bool = False,
                   ) -> tuple[SimulatedLine, list[SimulatedRadar]]:
    """Return a line with one radar per address (or model), not yet started.

    Raises:
        WrongDeviceError: A model is not known.
        SettingError: An address or the baud rate is not possible.
        LinkError: The link or the TCP port cannot be made.
    """
    for address in addresses:
        if not FIRST_ADDRESS <= address <= LAST_ADDRESS:
            raise SettingError(f"address {address} is out of range, allowed is "
                               f"{FIRST_ADDRESS} … {LAST_ADDRESS}")
    if baud_rate < 0:
        raise SettingError(f"{baud_rate} is no baud rate")
    count = max(len(models), len(addresses))
    padded = [*models, *[models[-1]] * (count - len(models))]
    radars = [SimulatedRadar(find_model(name), address, index + 1, range_bound=range_bound)
              for index, (name, address) in enumerate(
                  zip(padded, [*addresses, *[0] * (count - len(addresses))], strict=True))]
    line = SimulatedLine(SimulatedRadars(radars, baud_rate), link=link, listen=listen)
    return line, radars
