# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The wire of a simulated serial device: a pseudo-terminal or a TCP port, with real timing.

The device itself is sans-I/O: bytes in, timed replies out. Here they get a transport which keeps
the baud rate, and which can misbehave.
"""

from __future__ import annotations

import contextlib
import heapq
import itertools
import math
import os
import random
import select
import socket
import termios
import threading
import time
import tty
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Protocol

from driver_common.errors import LinkError
from driver_common.serial_link import BITS_PER_BYTE

CHUNK_TIME = 0.002  # s of line time that is written at once
IDLE_TIME = 0.05  # s after which a silent line looks whether it misbehaves otherwise now
_STOP, _HANG = b"s", b"h"  # what the thread is told
DAMAGES = ("drop", "flip", "double", "delay", "split")
PAUSES = {"split": (0.002, 0.010), "delay": (0.02, 0.3)}  # s in front of a byte
SPEEDS = {getattr(termios, name): int(name[1:]) for name in dir(termios) if name[1:].isdigit()}


class SimulatedDevice(Protocol):
    """Devices on one line, without I/O."""

    baud_rate: int

    def receive(self, data: bytes, now: float) -> Iterable[tuple[float, bytes]]:
        """Take the master's bytes; return replies, each with the monotonic time it begins.

        Where a silence ends a telegram, no bytes at all mean that there was one.
        """


@dataclass
class Faults:
    """How the line misbehaves; probabilities are per reply, but for `damage`.

    Attributes:
        drop: Probability that a reply is lost.
        corrupt: Probability that one of its bytes is damaged.
        noise: Probability that random bytes come in front of it.
        split: Pause in s in the middle of each reply.
        delay: Additional time in s before each reply.
        damage: Probability that a byte, in either direction, is hurt: lost, one of its bits
            flipped, doubled, or late, by much or by little.
        babble: Share of the time in which something else sends, without end …
        babble_byte: … this byte value, or any at -1.
        echo: Whether the master hears its own bytes.
        silent: Whether nothing gets through.
    """

    drop: float = 0.0
    corrupt: float = 0.0
    noise: float = 0.0
    split: float = 0.0
    delay: float = 0.0
    damage: float = 0.0
    babble: float = 0.0
    babble_byte: int = -1
    echo: bool = False
    silent: bool = False
    random: random.Random = field(default_factory=lambda: random.Random(1))

    def apply(self, due: float, reply: bytes) -> list[tuple[float, bytes]]:
        """Return the pieces that arrive in place of `reply`, each with its time."""
        if self.silent or self.random.random() < self.drop:
            return []
        due += self.delay
        if self.random.random() < self.corrupt:
            damaged = bytearray(reply)
            damaged[self.random.randrange(len(reply))] ^= 1 << self.random.randrange(8)
            reply = bytes(damaged)
        if self.random.random() < self.noise:
            reply = self.random.randbytes(self.random.randint(1, 20)) + reply
        if self.split:
            middle = len(reply) // 2
            return [(due, reply[:middle]), (due + self.split, reply[middle:])]
        return [(due + delay, piece) for delay, piece in self.hurt(reply)]

    def babbled(self, count: int) -> bytes:
        """Return what something else sends in the time of so many bytes."""
        count = round(count * self.babble)
        if self.babble_byte < 0:
            return self.random.randbytes(count)
        return bytes((self.babble_byte,)) * count

    def hurt(self, data: bytes) -> list[tuple[float, bytes]]:
        """Return the pieces that arrive in place of `data`, each with its delay in s."""
        pieces = [(0.0, bytearray())]
        for byte in data:
            kind = (self.random.choice(DAMAGES)
                    if self.damage and self.random.random() < self.damage else "")
            if kind in PAUSES:
                pause = self.random.uniform(*PAUSES[kind])
                pieces.append((pieces[-1][0] + pause, bytearray()))
            if kind == "flip":
                byte ^= 1 << self.random.randrange(8)
            pieces[-1][1].extend([byte] * {"drop": 0, "double": 2}.get(kind, 1))
        return [(delay, bytes(piece)) for delay, piece in pieces if piece]


class SimulatedLine:
    """A serial line with simulated devices, served by a thread.

    Attributes:
        port: What a driver opens: the path of a pseudo-terminal, or a socket:// URL.
        faults: How the line misbehaves; may be changed at any time.
    """

    def __init__(self, device: SimulatedDevice, *, link: str = "", listen: str = "",
                 gap: float = math.inf) -> None:
        """Open the line; `start` serves it.

        Args:
            device: What is connected to it.
            link: Path of a symbolic link to the pseudo-terminal.
            listen: "host:port" to serve TCP instead of a pseudo-terminal.
            gap: Silence in s that ends a telegram of the master.

        Raises:
            LinkError: The link or the TCP port cannot be made.
        """
        self.faults = Faults()
        self._device = device
        self._listen, self._link = listen, link
        self._gap = gap
        self._due: list[tuple[float, int, Callable[[float], None]]] = []  # what to do, and when
        self._order = itertools.count()
        self._late_until = 0.0
        self._arrived_until = self._last_arrival = 0.0
        self._busy: list[tuple[float, float]] = []  # when the line is taken, from … until
        self._wake_reader, self._wake_writer = os.pipe()
        self._works = False
        self._babbled_until = time.monotonic()
        self._transport: _Tcp | _Pty | None = None
        self._thread: threading.Thread | None = None
        self._open()

    def _open(self) -> None:
        self._transport = _Tcp(self._listen) if self._listen else _Pty(self._link)
        self.port = self._transport.port
        if isinstance(self._transport, _Tcp):
            self._listen = self.port.partition("//")[2]  # also the next time, if any port was taken

    def start(self) -> SimulatedLine:
        """Serve the line in a thread."""
        assert self._transport is not None
        self._thread = threading.Thread(target=self._run, args=(self._transport,),
                                        name="simulated line", daemon=True)
        self._thread.start()
        return self

    def unplug(self) -> None:
        """Take the port away; the devices keep their power."""
        if self._transport is None:  # its descriptors may belong to others by now
            return
        if self._thread is not None:
            os.write(self._wake_writer, _STOP)
            self._thread.join()
        self._transport.close()
        self._transport = self._thread = None
        self._due.clear()

    def plug(self) -> None:
        """Give the port back, and serve it; raises LinkError."""
        if self._transport is None:
            self._open()
            self.start()

    @property
    def is_behind(self) -> bool:
        """Whether something is due that the machine holds up; from any thread."""
        transport, thread = self._transport, self._thread
        if transport is None or thread is None or not thread.is_alive():
            return False
        with contextlib.suppress(OSError, ValueError):  # unplugged meanwhile
            return (bool(select.select(transport.readers(), [], [], 0)[0]) or self._works
                    or any(due <= time.monotonic() for due, _, _ in self._due[:1]))
        return False

    def hang(self) -> None:
        """Forget the client without a word, as a server that lost its power; TCP only."""
        os.write(self._wake_writer, _HANG)

    def set_baud_rate(self, baud_rate: int) -> None:
        """Have the devices talk at a rate in Bd."""
        self._device.baud_rate = baud_rate

    def close(self) -> None:
        """Take the line away for good."""
        if self._wake_reader < 0:
            return
        self.unplug()
        os.close(self._wake_reader)
        os.close(self._wake_writer)
        self._wake_reader = -1

    def _run(self, transport: _Tcp | _Pty) -> None:
        while True:
            due = self._due[0][0] - time.monotonic() if self._due else IDLE_TIME
            pause = CHUNK_TIME if self.faults.babble else IDLE_TIME
            self._works = False
            ready, _, _ = select.select([self._wake_reader, *transport.readers()], [], [],
                                        min(max(due, 0.0), pause))
            self._works = True  # before anything is taken that shows that there is work
            if self._wake_reader in ready:
                if os.read(self._wake_reader, 1) == _STOP:
                    return
                transport.hang()
            data = transport.read(ready)
            if data:
                self._receive(data, transport.speed(), time.monotonic())
            while self._due and self._due[0][0] <= time.monotonic():
                due, _, action = heapq.heappop(self._due)
                action(due)
            self._babble(transport)

    def _babble(self, transport: _Tcp | _Pty) -> None:
        now = time.monotonic()
        count = round(min(now - self._babbled_until, IDLE_TIME) / self._byte_time)
        if not self.faults.babble:
            self._babbled_until = now
        elif count:
            self._babbled_until = now
            transport.write(self.faults.babbled(count))

    def _plan(self, due: float, action: Callable[[float], None]) -> None:
        heapq.heappush(self._due, (due, next(self._order), action))

    def _receive(self, data: bytes, speed: int, now: float) -> None:
        if self.faults.echo:  # made by the adapter, so at its own rate
            self._schedule(now, data)
        if speed and speed != self._device.baud_rate:
            data = bytes(byte ^ 0x5A for byte in data)  # what a wrong baud rate makes of them
        for delay, piece in self.faults.hurt(data):
            due = max(now + delay, self._arrived_until)  # nothing overtakes what is under way
            self._arrived_until = due + len(piece) * self._byte_time
            self._plan(due, partial(self._reach_device, piece))

    def _reach_device(self, data: bytes, due: float) -> None:
        arrived = due + len(data) * self._byte_time
        self._reply(self._device.receive(data, arrived))
        self._last_arrival = arrived
        if self._gap != math.inf:
            self._plan(arrived + self._gap, self._end_telegram)

    def _end_telegram(self, due: float) -> None:
        if due >= self._last_arrival + self._gap:  # else more came
            self._reply(self._device.receive(b"", due))

    def _reply(self, replies: Iterable[tuple[float, bytes]]) -> None:
        for due, reply in replies:
            for piece_due, piece in self.faults.apply(due, reply):
                piece_due = max(piece_due, self._late_until)
                self._schedule(piece_due, piece)
                if self.faults.delay or self.faults.damage:
                    self._late_until = piece_due  # nothing overtakes what is under way

    @property
    def _byte_time(self) -> float:
        return BITS_PER_BYTE / self._device.baud_rate

    def _schedule(self, due: float, data: bytes) -> None:
        """Plan bytes in chunks, each at the time at which its last byte has been sent."""
        due = self._first_free(due, len(data) * self._byte_time)
        size = max(1, round(CHUNK_TIME / self._byte_time))
        for start in range(0, len(data), size):
            chunk = data[start:start + size]
            due += len(chunk) * self._byte_time
            self._plan(due, partial(self._write, chunk))

    def _write(self, chunk: bytes, due: float) -> None:
        assert self._transport is not None
        self._transport.write(chunk)

    def _first_free(self, due: float, duration: float) -> float:
        """Return when the line is free for so long, at `due` or later, and take it."""
        now = time.monotonic()
        self._busy = [(start, end) for start, end in self._busy if end > now]
        for start, end in self._busy:
            if due < end and start < due + duration:
                due = end
        self._busy = sorted([*self._busy, (due, due + duration)])
        return due


class _Pty:
    """A pseudo-terminal; the other side sees a serial port."""

    def __init__(self, link: str) -> None:
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        terminal = os.ttyname(self._slave)
        self.port = link or terminal
        self._link = Path(link) if link else None
        if self._link is not None:
            try:
                if self._link.is_symlink():
                    self._link.unlink()
                self._link.symlink_to(terminal)
            except OSError as error:
                raise LinkError(f"cannot make the link {link}: {error.strerror}") from error

    def readers(self) -> list[int]:
        return [self._master]

    def read(self, ready: list[int]) -> bytes:
        if self._master not in ready:
            return b""
        try:
            return os.read(self._master, 4096)
        except BlockingIOError:
            return b""

    def speed(self) -> int:
        """Return the baud rate that the other side has set."""
        return SPEEDS.get(termios.tcgetattr(self._master)[5], 0)

    def write(self, data: bytes) -> None:
        with contextlib.suppress(BlockingIOError):  # nobody reads: a real line forgets as well
            os.write(self._master, data)

    def hang(self) -> None:
        """Do nothing: who unplugs a serial port is noticed."""

    def close(self) -> None:
        if self._link is not None and self._link.is_symlink():
            with contextlib.suppress(OSError):
                self._link.unlink()
        for descriptor in (self._master, self._slave):
            with contextlib.suppress(OSError):
                os.close(descriptor)


class _Tcp:
    """A TCP port for one client after the other, like a serial device server."""

    def __init__(self, listen: str) -> None:
        host, _, port = listen.rpartition(":")
        try:
            self._server = socket.create_server((host or "127.0.0.1", int(port)))
        except (OSError, ValueError) as error:
            raise LinkError(f"cannot listen on {listen}: {error}") from error
        self._client: socket.socket | None = None
        self._hung: list[socket.socket] = []
        address = self._server.getsockname()
        self.port = f"socket://{address[0]}:{address[1]}"

    def readers(self) -> list[int]:
        return [self._server.fileno()] + ([self._client.fileno()] if self._client else [])

    def read(self, ready: list[int]) -> bytes:
        if self._server.fileno() in ready:
            if self._client is not None:
                self._client.close()
            self._client = self._server.accept()[0]
            self._client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        elif self._client is not None and self._client.fileno() in ready:
            try:
                data = self._client.recv(4096)
            except OSError:
                data = b""
            if data:
                return data
            self._client.close()
            self._client = None
        return b""

    def speed(self) -> int:
        return 0

    def write(self, data: bytes) -> None:
        if self._client is not None:
            with contextlib.suppress(OSError):
                self._client.sendall(data)

    def hang(self) -> None:
        """Leave the client alone, with a connection that looks well."""
        if self._client is not None:
            self._hung.append(self._client)
            self._client = None

    def close(self) -> None:
        for client in filter(None, (self._client, *self._hung)):
            client.close()
        self._server.close()
