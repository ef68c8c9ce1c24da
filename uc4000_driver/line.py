# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The wire seen from the master: who may speak, echo, and replies that come too late.

One request at a time; only `ask_together` has several sensors measure at the same time.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from driver_common import advice
from driver_common import clocks as time
from driver_common.errors import (
    DriverError,
    FrameError,
    LinkError,
    NoAnswerError,
    RefusedError,
    SettingError,
)
from driver_common.replayed_serial import open_serial, serial_recorder
from driver_common.serial_link import SerialLink
from uc4000_driver.commands import READ_SERIAL_NUMBER, READ_VERSION, Command, Distance
from uc4000_driver.exchange import NOISE_TIME, Exchange
from uc4000_driver.telegram import (
    BAUD_RATE,
    CAST,
    SHORT_REPLY,
    ErrorCode,
    Reply,
    ReplyParser,
    decoded,
    error_text,
)

T = TypeVar("T")

LATENCY = 0.100  # s, allowance for USB adapters and the host
QUIET = 0.200  # s of silence after which no late reply is expected any more
SLICE = 0.1  # s after which a long wait looks whether it is to end
PATIENCE = 0.5  # s for which others can wait as well

ECHO_CHOICES = {"auto": None, "on": True, "off": False}
TRANSMISSION_ERRORS = (ErrorCode.CHECKSUM_ERROR, ErrorCode.TELEGRAM_TIMEOUT,
                       ErrorCode.TELEGRAM_UNDERFLOW, ErrorCode.TELEGRAM_OVERFLOW,
                       ErrorCode.TRANSMISSION_ERROR)


class TelegramRefusedError(RefusedError):
    """A sensor answered with an error code.

    Attributes:
        code: The code; `uc4000_driver.telegram.error_text` has it in words.
    """

    def __init__(self, who: str, what: str, code: int) -> None:
        """Put it in words."""
        super().__init__(f"{who} cannot {what}: {error_text(code)}")
        self.code = code


class DamagedRequestError(FrameError):
    """A sensor answered that the request arrived damaged; the same can be asked again."""


class LateReplyError(FrameError):
    """What came may be the reply to an earlier request."""

    def __init__(self, who: str) -> None:
        """Put it in words."""
        super().__init__(f"{who} answers late: what came may answer an earlier request")


class BusyError(DriverError):
    """The line is in use, for longer than a user wants to wait."""


@dataclass(frozen=True)
class Answer(Generic[T]):
    """The answer to a command.

    Attributes:
        value: What it says.
        sent: The host's time in ns when the request had been sent.
        lateness: Time in s from the end of the measurement to the reply, at most.
    """

    value: T
    sent: int
    lateness: float


class Line:
    """A wire with sensors.

    Attributes:
        port: Device path or pyserial URL.
        recorder: Has what passed of late.
        local_echo: Whether the line returns what is sent, as the user says (errata U9).
        echo: Whether it does, as far as we heard; None while unknown.
        stray_bytes: Bytes that answered nothing.
        on_wait: Called now and then in a long wait; what it does cannot have the line.
    """

    def __init__(self, port: str, local_echo: str = "auto") -> None:
        """Prepare the line; nothing is opened."""
        self.port = port
        self.recorder = serial_recorder(port)
        self.local_echo = local_echo
        self.echo: bool | None = None
        self.stray_bytes = 0
        self.on_wait: Callable[[], None] = lambda: None
        self._link: SerialLink | None = None
        self._late: set[int] = set()  # lengths of replies that may still come
        self._late_until = 0.0  # monotonic time until which a slow sensor may still reply
        self._use = ""  # what it is in use for
        self._use_until = 0.0  # monotonic time until which that may take

    def open(self) -> None:
        """Open the port; raises LinkError."""
        self._link = open_serial(self.port, BAUD_RATE, self.recorder)
        self.echo = None
        self._late = {SHORT_REPLY}  # to what another program asked just now

    def close(self) -> None:
        """Close the port."""
        if self._link is not None:
            self._link.close()
            self._link = None

    def interrupt(self) -> None:
        """Have every wait end soon; called from another thread."""
        if self._link is not None:
            self._link.interrupt()

    def resume(self) -> None:
        """Wait for replies again."""
        if self._link is not None:
            self._link.resume()

    @property
    def link(self) -> SerialLink:
        """The open port; raises LinkError where it is closed."""
        if self._link is None:
            raise LinkError(f"{self.port} is not open")
        return self._link

    def write(self, data: bytes) -> int:
        """Send bytes, and return the host's time in ns when that began; raises LinkError."""
        self.link.write(data)
        return self.link.time

    def read(self, timeout: float, until: float) -> bytes:
        """Return what arrives within `timeout` s, at most a slice of a long wait.

        Args:
            timeout: In s.
            until: Monotonic time in s until which the whole wait may last.

        Raises:
            LinkError: The port failed, or the driver is to stop.
        """
        self._use_until = until
        if until - time.monotonic() > PATIENCE:
            self.on_wait()
        return self.link.read(min(SLICE, timeout))

    def ask(self, address: int, command: Command[T], who: str) -> Answer[T]:
        """Carry out a command, once.

        Args:
            address: Of the sensor.
            command: What is asked.
            who: The sensor in words, for messages.

        Raises:
            TelegramRefusedError: The sensor answered with an error code.
            DamagedRequestError: The sensor could not read the request.
            LateReplyError: The reply may be that to an earlier request.
            FrameError: The reply was damaged.
            NoAnswerError: Nothing came in time.
            BusyError: It was asked from within a long wait.
            SettingError: `local_echo` is wrong.
            LinkError: The port failed, or the driver is to stop.
        """
        with self._in_use(f"{who}: {command.name}"):
            self._let_late_replies_pass(address, who)
            (answer,) = self._converse([(address, command)], who, LATENCY)
            return answer

    def ask_together(self, asked: Sequence[tuple[int, Command[Distance]]], who: str,
                     latency: float) -> list[Answer[Distance]]:
        """Have several sensors measure at the same time.

        Replies do not say from whom they are, but they come in the order of the requests. So only
        a full set of distances counts. With one missing, damaged, late or a refusal, which comes at
        once, it would be a guess whose they are.

        Args:
            asked: Addresses and what is asked there; all measure with the same number of cycles.
            who: The sensors in words, for messages.
            latency: Time in s by which adapter and host may hold up a reply.

        Returns:
            The answers. They are fewer than asked for where sending took so long that a reply
            could begin.

        Raises:
            DriverError: As `ask`; then none of the replies counts.
        """
        with self._in_use(f"{who}: measure"):
            self._let_late_replies_pass(asked[0][0], who)
            return self._converse(asked, who, latency)

    @contextlib.contextmanager
    def _in_use(self, use: str) -> Iterator[None]:
        if self._use:
            seconds = max(0.0, self._use_until - time.monotonic())
            raise BusyError(f"the line is in use for up to {seconds:.1f} s more ({self._use}); "
                            "try again then, or set cycles to less")
        self._use = use
        try:
            yield
        finally:
            self._use = ""

    def _let_late_replies_pass(self, address: int, who: str) -> None:
        """Make sure that no reply to an earlier request is taken for the next one's.

        A reply does not tell to what it belongs. After a time-out the sensor gets the time of its
        measurement once more. What adapters and networks hold back can take any time: so
        something is asked then whose reply has a length that no late one can have, and all in
        front of it is old. Where every length may still come, silence has to do.
        """
        if not self._late:
            return
        while (remaining := self._late_until - time.monotonic()) > 0:
            self.stray_bytes += len(self.read(remaining, self._late_until))
        barrier = next((command for command in (READ_SERIAL_NUMBER, READ_VERSION)
                        if command.reply_length not in self._late), None)
        if address == CAST or barrier is None:
            self._wait_for_silence()
        else:
            try:
                self._converse([(address, barrier)], who, LATENCY)
            except RefusedError:
                self._late.add(barrier.reply_length)
                raise LateReplyError(who) from None
        self._late.clear()

    def _wait_for_silence(self) -> None:
        end = time.monotonic() + NOISE_TIME
        quiet_at = time.monotonic() + QUIET
        while (now := time.monotonic()) < min(quiet_at, end):
            data = self.read(quiet_at - now, end)
            if data:
                self.stray_bytes += len(data)
                quiet_at = time.monotonic() + QUIET

    def _converse(self, asked: Sequence[tuple[int, Command[T]]], who: str,
                  latency: float) -> list[Answer[T]]:
        """Send requests and return the answers; raises DriverError as `ask`."""
        self.stray_bytes += len(self.link.read(0))
        command = asked[0][1]
        exchange = Exchange(self, command, latency)
        parser = exchange.parser
        try:
            exchange.send([command.request(address).encode() for address, command in asked])
            exchange.receive()
            self._check(parser, who)
            if len(exchange.sent) > 1 and parser.damaged:
                raise FrameError(f"damaged replies from {who}: {parser.damaged.hex(' ').upper()}")
            values = [_value(command, reply, who)
                      for (_, command), reply in zip(asked, parser.replies, strict=False)]
        except DamagedRequestError:  # so no other reply will come
            raise
        except (FrameError, NoAnswerError, SettingError) as error:
            self._late.add(command.reply_length)
            again = command.duration if isinstance(error, NoAnswerError) else 0.0
            self._late_until = max(exchange.over, time.monotonic() + again)
            raise
        self.stray_bytes += parser.skipped
        return list(map(Answer, values, exchange.sent, exchange.lateness))

    def _check(self, parser: ReplyParser, who: str) -> None:
        """Raise what is wrong with the replies."""
        wanted = ECHO_CHOICES[self.local_echo]
        if parser.echo is not None:
            self.echo = parser.echo
            if wanted not in (None, parser.echo):
                does, right = ("returns", "on") if parser.echo else ("does not return", "off")
                raise SettingError(f"local_echo is {self.local_echo}, but the line {does} what is "
                                   f"sent; set local_echo to {right} or auto")
        if parser.complete and not parser.pending:
            return
        data = parser.pending or parser.damaged
        if any(decoded(data[:length]) for length in self._late):
            raise LateReplyError(who)
        if data:
            raise FrameError(f"damaged reply from {who}: {data.hex(' ').upper()}")
        hint = ""
        if wanted and not parser.echo:
            hint = f", {advice.NO_ECHO.text()}"
        raise NoAnswerError(f"no answer from {who} on {self.port}{hint}")


def _value(command: Command[T], reply: Reply, who: str) -> T:
    """Return what a reply means; raises RefusedError or FrameError."""
    if reply.acknowledged:
        return command.decode(reply.data)
    code = reply.data[0]
    if code in TRANSMISSION_ERRORS:
        raise DamagedRequestError(f"{who} received a damaged request: {error_text(code)}")
    raise TelegramRefusedError(who, command.name, code)
