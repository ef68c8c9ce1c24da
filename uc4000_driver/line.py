"""The wire seen from the master: time-outs, echo, and replies that come too late.

One request at a time; only `ask_together` has several sensors measure at the same time.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Sequence
from typing import TypeVar

from driver_common.errors import (
    DriverError,
    FrameError,
    LinkError,
    NoAnswerError,
    RefusedError,
    SettingError,
)
from driver_common.serial_link import SerialLink
from uc4000_driver.commands import CYCLE_TIME, READ_SERIAL_NUMBER, READ_VERSION, Command, Distance
from uc4000_driver.telegram import (
    BAUD_RATE,
    BYTE_TIME,
    CAST,
    GAP,
    REQUEST_LENGTH,
    SHORT_REPLY,
    ErrorCode,
    Reply,
    ReplyParser,
    error_text,
)

T = TypeVar("T")

REPLY_TIMEOUT = 0.050  # s until a reply that needs no measurement
REPLY_SPREAD = 0.010  # s by which the reply to a measurement may be late (section 3.1.1)
EEPROM_TIMEOUT = 0.500  # s more for a write; the manual gives no time
LATENCY = 0.100  # s, allowance for USB adapters and the host
BYTE_GAP = 0.100  # s that a reply which has begun may pause on its way through adapter and host
QUIET = 0.200  # s of silence after which no late reply is expected any more
NOISE_TIME = 2.0  # s to wait for such a silence
SLICE = 0.1  # s after which a long wait looks whether it is to end

REQUEST_TIME = REQUEST_LENGTH * BYTE_TIME
# With several sensors measuring: the time from the end of a measurement in which its reply has to
# arrive, and the time between two requests. So the replies come one after the other, in the order
# of the requests, and one that is out of order is noticed.
GROUP_LATENCY = 0.008  # s, allowance for adapters and the host; more would leave fewer sensors
REPLY_WINDOW = REPLY_SPREAD + SHORT_REPLY * BYTE_TIME + GROUP_LATENCY
STAGGER = REPLY_WINDOW + GAP
SHORTEST = 0.4  # of a measurement's usual time; sound needs as much for 4 m and back

ECHO_CHOICES = {"auto": None, "on": True, "off": False}


class TelegramRefusedError(RefusedError):
    """A sensor answered with an error code.

    Attributes:
        code: The code; `uc4000_driver.telegram.error_text` has it in words.
    """

    def __init__(self, who: str, what: str, code: int) -> None:
        """Put it in words."""
        super().__init__(f"{who} cannot {what}: {error_text(code)}")
        self.code = code

    @property
    def is_transmission(self) -> bool:
        """Whether it was the transmission that failed; then the same can be asked again."""
        return self.code in (ErrorCode.CHECKSUM_ERROR, ErrorCode.TELEGRAM_TIMEOUT,
                             ErrorCode.TELEGRAM_UNDERFLOW, ErrorCode.TELEGRAM_OVERFLOW,
                             ErrorCode.TRANSMISSION_ERROR)


def most_together(cycles: int) -> int:
    """Return how many sensors can be asked before the first one can reply."""
    return 1 + math.floor((cycles * CYCLE_TIME - REQUEST_TIME - GAP) / STAGGER)


class Line:
    """A wire with sensors.

    Attributes:
        port: Device path or pyserial URL.
        local_echo: Whether the line returns what is sent, as the user says (errata U9).
        echo: Whether it does, as far as we heard; None while unknown.
        stray_bytes: Bytes that answered nothing.
    """

    def __init__(self, port: str, local_echo: str = "auto") -> None:
        """Prepare the line; nothing is opened."""
        self.port = port
        self.local_echo = local_echo
        self.echo: bool | None = None
        self.stray_bytes = 0
        self._link: SerialLink | None = None
        self._late: set[int] = set()  # lengths of replies that may still come
        self._late_until = 0.0  # monotonic time until which a slow sensor may still reply
        self._interrupted = threading.Event()

    def open(self) -> None:
        """Open the port; raises LinkError."""
        self._link = SerialLink(self.port, BAUD_RATE)
        self.echo = None
        self._late = {SHORT_REPLY}  # to what another program asked just now

    def close(self) -> None:
        """Close the port."""
        if self._link is not None:
            self._link.close()
            self._link = None

    def interrupt(self) -> None:
        """Have a measurement of many cycles end soon; called from another thread."""
        self._interrupted.set()

    @property
    def link(self) -> SerialLink:
        """The open port; raises LinkError where it is closed."""
        if self._link is None:
            raise LinkError(f"{self.port} is not open")
        return self._link

    def ask(self, address: int, command: Command[T], who: str) -> tuple[T, int]:
        """Carry out a command, once.

        Args:
            address: Of the sensor.
            command: What is asked.
            who: The sensor in words, for messages.

        Returns:
            The result, and the host's time in ns when the request had been sent.

        Raises:
            TelegramRefusedError: The sensor answered with an error code.
            FrameError: The reply was damaged.
            NoAnswerError: Nothing came in time.
            SettingError: `local_echo` is wrong.
            LinkError: The port failed.
        """
        self._let_late_replies_pass(address, who)
        (reply,), (sent,) = self._converse([command.request(address).encode()], command, who)
        if not reply.acknowledged:
            raise TelegramRefusedError(who, command.name, reply.data[0])
        return command.decode(reply.data), sent

    def ask_together(self, asked: Sequence[tuple[int, Command[Distance]]],
                     who: str) -> list[tuple[Distance, int]]:
        """Have several sensors measure at the same time.

        Replies do not say from whom they are, but they come in the order of the requests. So only
        a full set of distances counts, each in its time. With one missing, damaged, late or a
        refusal, which comes at once, it would be a guess whose they are.

        Args:
            asked: Addresses and what is asked there; all measure with the same number of cycles.
            who: The sensors in words, for messages.

        Returns:
            The distances, and the host's time in ns when each request had been sent. They are
            fewer than asked for where sending took so long that a reply could begin.

        Raises:
            DriverError: As `ask`; then none of the replies counts.
        """
        address, command = asked[0]
        self._let_late_replies_pass(address, who)
        replies, times = self._converse(
            [command.request(address).encode() for address, command in asked], command, who)
        if not all(reply.acknowledged for reply in replies):
            raise RefusedError(f"one of {who} refuses")
        return [(command.decode(reply.data), sent)
                for reply, sent in zip(replies, times, strict=True)]

    def _let_late_replies_pass(self, address: int, who: str) -> None:
        """Make sure that no reply to an earlier request is taken for the next one's.

        A reply does not tell to what it belongs. After a time-out the sensor gets the time of its
        measurement once more. What adapters and networks hold back can take any time: so
        something is asked then whose reply has a length that no late one can have, and all in
        front of it is old. Where every length may still come, silence has to do.
        """
        if not self._late:
            return
        self._discard_until(self._late_until)
        barrier = next((command for command in (READ_VERSION, READ_SERIAL_NUMBER)
                        if command.reply_length not in self._late), None)
        if address == CAST or barrier is None:
            self._wait_for_silence()
        else:
            (reply,), _ = self._converse([barrier.request(address).encode()], barrier, who)
            if not reply.acknowledged:  # that, too, may be old
                self._late.add(barrier.reply_length)
                raise NoAnswerError(f"{who} cannot {barrier.name}: {error_text(reply.data[0])}")
        self._late.clear()

    def _discard_until(self, end: float) -> None:
        while (remaining := end - time.monotonic()) > 0 and not self._interrupted.is_set():
            self.stray_bytes += len(self.link.read(min(SLICE, remaining)))

    def _wait_for_silence(self) -> None:
        end = time.monotonic() + NOISE_TIME
        while (data := self.link.read(QUIET)) and time.monotonic() < end:
            self.stray_bytes += len(data)

    def _converse(self, requests: Sequence[bytes], command: Command[T],
                  who: str) -> tuple[list[Reply], list[int]]:
        """Send requests as far apart as their replies need it, and receive those."""
        self.stray_bytes += len(self.link.read(0))
        parser = ReplyParser(command.reply_length)
        times: list[int] = []
        ends: list[float] = []  # of the measurements, monotonic
        next_time = time.monotonic()
        last_time = next_time + command.duration - REQUEST_TIME - GAP
        for request in requests:
            self._receive_until(next_time, parser)
            if times and time.monotonic() > last_time:
                break
            self.link.write(request)
            times.append(time.time_ns() + round(REQUEST_TIME * 1e9))
            ends.append(time.monotonic() + REQUEST_TIME + command.duration)
            next_time = time.monotonic() + STAGGER
            parser.sent(request)
        timeout = command.duration + (REPLY_SPREAD if command.duration else REPLY_TIMEOUT)
        timeout += EEPROM_TIMEOUT if command.is_write else 0.0
        self._receive_all(time.monotonic() + REQUEST_TIME + timeout + LATENCY, parser)
        try:
            self._check(parser, who)
            self._check_times(parser, ends, command.duration, who)
        except DriverError:
            self._late.add(command.reply_length)
            self._late_until = time.monotonic() + command.duration
            raise
        self.stray_bytes += parser.skipped
        return parser.replies, times

    def _receive_until(self, end: float, parser: ReplyParser) -> None:
        """Take what arrives until a time."""
        while (remaining := end - time.monotonic()) > 0:
            parser.feed(self.link.read(remaining), time.monotonic())

    def _receive_all(self, deadline: float, parser: ReplyParser) -> None:
        """Take what arrives until all replies are there, or the time is over.

        A reply that has begun may finish, as long as its bytes keep coming.
        """
        while not parser.complete and time.monotonic() < deadline + NOISE_TIME:
            if self._interrupted.is_set():
                raise LinkError("the driver is stopping")
            remaining = max(0.0, deadline - time.monotonic())
            data = self.link.read(BYTE_GAP if parser.pending else min(SLICE, remaining))
            if data:
                parser.feed(data, time.monotonic())
            elif parser.pending:
                parser.gap()
            elif not remaining:
                break
        if parser.complete:
            parser.feed(self.link.read(GAP))  # the silence that the next request needs anyway

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
        if parser.pending or parser.damaged:
            what = (parser.pending or parser.damaged).hex(" ").upper()
            raise FrameError(f"damaged reply from {who}: {what}")
        hint = ""
        if wanted and not parser.echo:
            hint = ", not even the echo of what was sent: is the line connected, or local_echo off?"
        raise NoAnswerError(f"no answer from {who} on {self.port}{hint}")

    @staticmethod
    def _check_times(parser: ReplyParser, ends: Sequence[float], duration: float,
                     who: str) -> None:
        """Raise where it is not certain which reply belongs to which request.

        A distance takes its time: what looks like one before is noise, or an older one. Of several,
        all have to come in the order of the requests.
        """
        if any(reply.acknowledged and arrived < end - duration * (1 - SHORTEST)
               for reply, arrived, end in zip(parser.replies, parser.times, ends, strict=True)):
            raise FrameError(f"a reply from {who} that came too early to be measured")
        if len(ends) == 1:
            return
        if parser.damaged or any(arrived > end + REPLY_WINDOW
                                 for arrived, end in zip(parser.times, ends, strict=True)):
            raise FrameError(f"damaged or late replies from {who}")
