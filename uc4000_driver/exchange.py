# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Requests that are under way on the wire, in most cases one, and the replies to them.

What arrives is judged by what a sensor can have done, never by when this process got the
processor: a reply can come as soon as its request was begun, and is late only where the wire was
seen empty at the time at which it had to be there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Protocol

from driver_common import clocks as time
from uc4000_driver.commands import CYCLE_TIME, Command
from uc4000_driver.telegram import (
    BYTE_TIME,
    GAP,
    REQUEST_LENGTH,
    SHORT_REPLY,
    ReplyParser,
)

REPLY_TIMEOUT = 0.050  # s until a reply that needs no measurement
REPLY_SPREAD = 0.010  # s by which the reply to a measurement may be late (section 3.1.1)
EEPROM_TIMEOUT = 0.500  # s more for a write; the manual gives no time
ADAPTER_LATENCY = 0.020  # s, of an adapter with the usual latency timer of 16 ms
BYTE_GAP = 0.100  # s that a reply which has begun may pause on its way through adapter and host
NOISE_TIME = 2.0  # s after which noise that does not end is no reply
SHORTEST = 0.8  # of a measurement's usual time; what comes before that may be somebody else's

REQUEST_TIME = REQUEST_LENGTH * BYTE_TIME
REPLY_TIME = SHORT_REPLY * BYTE_TIME


def stagger(latency: float) -> float:
    """Return the time in s between the requests to sensors that measure together.

    So their replies come one after the other, in the order of the requests, each in its window.

    Args:
        latency: Time in s by which adapter and host may hold up a reply.
    """
    return REPLY_SPREAD + REPLY_TIME + latency + GAP


def most_together(cycles: int, latency: float) -> int:
    """Return how many sensors can be asked before the first one can reply; see `stagger`."""
    return 1 + math.floor((cycles * CYCLE_TIME - REQUEST_TIME - GAP) / stagger(latency))


class Wire(Protocol):
    """What an exchange needs of the wire."""

    def read(self, timeout: float, until: float) -> bytes:
        """Return what arrives within `timeout` s, in a wait that may last until a time."""

    def write(self, data: bytes) -> int:
        """Send bytes, and return the host's time in ns when that began."""


class Exchange:
    """One or several requests, and what comes back.

    Attributes:
        parser: Has the replies.
        sent: The host's time in ns at which each request had been sent; a busy host may have sent
            it later.
    """

    def __init__(self, wire: Wire, command: Command[Any], latency: float) -> None:
        """Prepare; nothing is sent.

        Args:
            wire: The wire.
            command: What is asked; of several, those that follow take as long.
            latency: Time in s by which adapter and host may hold up a reply.
        """
        self.parser = ReplyParser(command.reply_length)
        self.sent: list[int] = []
        self._wire = wire
        self._duration = command.duration
        self._patience = latency + (
            REPLY_SPREAD + REPLY_TIME if command.duration else REPLY_TIMEOUT) + (
            EEPROM_TIMEOUT if command.is_write else 0.0)
        self._latency = latency
        self._ends: list[float] = []  # of the measurements, monotonic, at the earliest
        self._deadlines: list[float] = []  # of the replies

    @property
    def over(self) -> float:
        """Monotonic time at which the last measurement is over and its reply is here."""
        return max(self._ends, default=0.0) + REPLY_SPREAD + REPLY_TIME + ADAPTER_LATENCY

    @property
    def lateness(self) -> list[float]:
        """Time in s from the end of each measurement to its reply, at most."""
        return [arrived - end
                for arrived, end in zip(self.parser.times, self._ends, strict=True)]

    def send(self, requests: Sequence[bytes]) -> None:
        """Send requests as far apart as their replies need it.

        The last ones are not sent where that took so long that a reply could begin.
        """
        begun = due = time.monotonic()
        for request in requests:
            while (remaining := due - time.monotonic()) > 0:
                self.parser.feed(self._wire.read(remaining, due), time.monotonic())
            begun = time.monotonic()
            if self._ends and begun + REQUEST_TIME + GAP > self._ends[0]:
                break
            begun_ns = self._wire.write(request)
            self.parser.sent(request)
            self.sent.append(begun_ns + round(REQUEST_TIME * 1e9))
            self._ends.append(begun + REQUEST_TIME + self._duration)
            written = time.monotonic()
            self._deadlines.append(written + REQUEST_TIME + self._duration + self._patience)
            due = written + stagger(self._latency)

    def receive(self) -> None:
        """Take replies until all are there, or the next one is late.

        One that has begun may finish, as long as its bytes keep coming.
        """
        parser, last = self.parser, self._deadlines[-1] + NOISE_TIME
        while not parser.complete and (now := time.monotonic()) < last:
            deadline = self._deadlines[len(parser.replies)]
            data = self._wire.read(BYTE_GAP if parser.pending else deadline - now,
                                   last if parser.pending else deadline)
            if data:
                parser.feed(data, time.monotonic())
            elif parser.pending:
                parser.gap()
            elif time.monotonic() >= deadline:
                break
        if parser.complete:
            self._listen_on()

    def _listen_on(self) -> None:
        """Hear whether more comes than was asked for.

        The manual promises no earliest time for a distance. But one that comes before sound can
        have been there and back may be noise, or the reply to another request: then this one's is
        still to come.
        """
        early = self._duration * (1 - SHORTEST)
        doubtful = any(reply.acknowledged and lateness < -early for reply, lateness in zip(
            self.parser.replies, self.lateness, strict=True)) if early else False
        end = self.over if doubtful else time.monotonic() + GAP
        while not self.parser.pending and (remaining := end - time.monotonic()) > 0:
            self.parser.feed(self._wire.read(remaining, end), time.monotonic())
