# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What is fuzzed of the ultrasonic sensors: telegrams, exchanges, and what replies mean."""

from __future__ import annotations

import contextlib
from random import Random
from typing import Any

from bench.examples.uc4000 import REFUSALS, REPLIES, REQUESTS, TABLE_A1
from bench.fuzz.pretended import pretended_time
from bench.fuzz.settings import check_raws
from bench.fuzz.target import Target, check_text, from_hex, pieces
from driver_common.clocks import ReplayClock, monotonic
from driver_common.errors import FrameError
from uc4000_driver import commands
from uc4000_driver.commands import PROFILES, Command, Distance, Uc4000Record
from uc4000_driver.exchange import NOISE_TIME, Exchange
from uc4000_driver.settings import ALL_SETTINGS
from uc4000_driver.telegram import REQUEST_LENGTH, SHORT_REPLY, Reply, ReplyParser, Request

ASKED = from_hex(request.telegram for request in REQUESTS) + [row.request for row in TABLE_A1]
ANSWERS = from_hex(answer.telegram for answer in (*REPLIES, *REFUSALS)) + [
    row.reply for row in TABLE_A1]
COMMANDS: tuple[Command[Any], ...] = (
    commands.READ_TEMPERATURE, commands.READ_ADDRESS, commands.READ_VERSION,
    commands.READ_SERIAL_NUMBER, *map(commands.measure, PROFILES.values()))


def _check_replies(data: bytes, random: Random) -> None:
    length = random.choice((SHORT_REPLY, 15, 19))
    request = Request(random.randrange(8), random.randrange(256)).encode()
    data = random.choice((b"", request)) + data[:60]
    whole, parts = ReplyParser(length), ReplyParser(length)
    for parser, some in ((whole, [data[:60]]), (parts, pieces(data[:60], random))):
        parser.sent(request)
        for piece in some:
            parser.feed(piece)
            assert len(parser.pending) <= 64
        parser.gap()
        assert not parser.pending
    assert whole.replies == parts.replies
    assert (whole.damaged, whole.echo) == (parts.damaged, parts.echo)
    assert len(whole.replies) <= 1
    assert all(reply.encode() in data for reply in whole.replies)
    whole.feed(data * 3)
    assert len(whole.pending) <= 64


def _check_telegrams(data: bytes, random: Random) -> None:
    with contextlib.suppress(FrameError):
        assert Reply.decode(data).encode() == data
    with contextlib.suppress(FrameError):
        assert Request.decode(data[:REQUEST_LENGTH]).encode() == data[:REQUEST_LENGTH]
    for command in COMMANDS:
        if len(data) >= command.data_length:
            with contextlib.suppress(FrameError):
                _check_meaning(command.decode(data[:command.data_length]))
    for setting in ALL_SETTINGS.values():
        record = setting.record
        assert isinstance(record, Uc4000Record)
        raw = record.read().decode(data[:1].ljust(1, b"\0"))
        check_raws(setting, raw)
        assert record.write([raw]).data == raw


def _check_meaning(value: object) -> None:
    check_text(value)
    if isinstance(value, Distance):
        assert (value.outcome is commands.Outcome.ECHO) == (0.25 <= value.value <= 4.0)


class _Wire:
    """A wire in a time of its own, on which an input arrives in pieces, or does not."""

    def __init__(self, data: bytes, random: Random, clock: ReplayClock) -> None:
        self._random, self._clock = random, clock
        self._pieces = [*pieces(data, random, 4)]

    def read(self, timeout: float, until: float) -> bytes:
        waited = self._random.choice((0.0, 0.001, timeout))
        self._clock.pass_until(self._clock.now + int(min(waited, timeout) * 1e9))
        if self._pieces and (waited < timeout or self._random.random() < 0.5):
            return self._pieces.pop(0)
        self._clock.pass_until(int(min(until, monotonic() + timeout - waited) * 1e9))
        return b""

    def write(self, data: bytes) -> int:
        return self._clock.now


def _check_exchange(data: bytes, random: Random) -> None:
    """Have one or two requests answered by an input; what is asked ends, whatever comes."""
    command = random.choice(COMMANDS)
    asked = [command.request(address).encode() for address in (1, 2)]
    with pretended_time() as clock:
        begin = monotonic()
        exchange = Exchange(_Wire(data, random, clock), command, 0.1)
        exchange.send(asked if command.duration and random.random() < 0.3 else asked[:1])
        exchange.receive()
        parser = exchange.parser
        assert len(parser.replies) <= len(exchange.sent)
        assert not parser.complete or len(exchange.lateness) == len(exchange.sent)
        assert all(reply.encode() in data for reply in parser.replies)
        assert monotonic() < begin + 2 * (command.duration + 0.5) + NOISE_TIME


TARGETS = (
    Target("uc4000 replies", _check_replies, ANSWERS),
    Target("uc4000 exchange", _check_exchange, ANSWERS),
    Target("uc4000 telegrams", _check_telegrams, ASKED + ANSWERS),
)
