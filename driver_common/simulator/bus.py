# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The wire of simulated CAN devices: a socketcand server, to which python-can connects over TCP.

The devices themselves are sans-I/O: frames in, frames with their time out. One thread serves any
number of clients; what one client sends, the devices and the other clients hear.
"""

from __future__ import annotations

import contextlib
import os
import re
import selectors
import socket
import threading
import time
from collections.abc import Iterable
from typing import NamedTuple, Protocol

from driver_common.errors import LinkError

BATCH_TIME = 0.002  # s of frames that are sent at once
IDLE_TIME = 0.05  # s after which the devices are asked again in any case
ATTACH_TIME = 0.2  # s for which frames wait for a new client that says nothing
MAX_WAITING = 1 << 20  # bytes that wait for a slow client; what comes on top is dropped
MAX_MESSAGE = 4096  # bytes without an end after which they are no message
EXTENDED_ID, STANDARD_ID = 0x1FFFFFFF, 0x7FF
_STOP, _HANG = b"s", b"h"  # what the thread is told

_MESSAGE = re.compile(rb"<\s*([^<>]*?)\s*>")


class CanFrame(NamedTuple):
    """One frame on the bus; an error frame has an error class in place of the identifier."""

    can_id: int
    data: bytes
    extended: bool = True
    error: bool = False

    def encode(self, timestamp: float) -> str:
        """Return the message that tells a client of this frame."""
        if self.error:
            return f"< error {self.can_id:03X} {timestamp:.6f} >"
        number = f"{self.can_id:08X}" if self.extended else f"{self.can_id:03X}"
        return f"< frame {number} {timestamp:.6f} {self.data.hex()} >"

    @classmethod
    def parse(cls, words: list[str]) -> CanFrame:
        """Return the frame that a client wants to send: identifier, length, data bytes.

        Raises:
            ValueError: It is none.
        """
        number, length, *data = words
        frame = cls(int(number, 16), bytes(int(byte, 16) for byte in data), len(number) == 8)
        limit = EXTENDED_ID if frame.extended else STANDARD_ID
        if len(frame.data) != int(length, 16) or not 0 <= frame.can_id <= limit:
            raise ValueError("length and data do not agree")
        return frame


class SimulatedDevices(Protocol):
    """Devices on one bus, without I/O. All times are monotonic."""

    def receive(self, frame: CanFrame, now: float) -> None:
        """Take a frame from the bus."""

    def poll(self, now: float) -> Iterable[tuple[float, CanFrame]]:
        """Return the frames that are due, in order, each with its time."""

    def next_due(self, now: float) -> float | None:
        """Return when `poll` should be called next; None: not before a frame is received."""


class SimulatedBus:
    """A CAN bus with simulated devices, served by a thread.

    Attributes:
        host: Where the server listens.
        port: The TCP port.
        dropped: Frames that slow clients did not take.
    """

    def __init__(self, devices: SimulatedDevices, listen: str = "127.0.0.1:0",
                 channel: str = "") -> None:
        """Open the server; `start` serves it.

        Args:
            devices: What is connected to the bus.
            listen: "host:port"; port 0 takes a free one.
            channel: The only name under which a client can open the bus; "" = any.

        Raises:
            LinkError: The TCP port cannot be made.
        """
        self._server = _listen(listen)
        self.host, self.port = self._server.getsockname()[:2]
        self.dropped = 0
        self._devices = devices
        self._channel = channel
        self._clients: set[_Client] = set()
        self._hung: list[_Client] = []
        self._selector = selectors.DefaultSelector()
        self._wake_reader, self._wake_writer = os.pipe()
        self._selector.register(self._wake_reader, selectors.EVENT_READ)
        self._wall_offset = time.time() - time.monotonic()
        self._thread: threading.Thread | None = None

    def start(self) -> SimulatedBus:
        """Serve the bus in a thread."""
        self._selector.register(self._server, selectors.EVENT_READ)
        self._thread = threading.Thread(target=self._run, name="simulated bus", daemon=True)
        self._thread.start()
        return self

    def unplug(self) -> None:
        """Take the server away; the devices keep their power."""
        if self._thread is not None:
            os.write(self._wake_writer, _STOP)
            self._thread.join()
            self._thread = None
            self._selector.unregister(self._server)
        for client in list(self._clients):
            self._part(client)
        for client in self._hung:
            client.socket.close()
        self._hung.clear()
        self._server.close()

    def plug(self) -> None:
        """Give the server back, and serve the bus; raises LinkError."""
        if self._thread is None:
            self._server = _listen(f"{self.host}:{self.port}")
            self.start()

    def hang(self) -> None:
        """Forget the clients without a word, as a server that lost its power."""
        os.write(self._wake_writer, _HANG)

    def close(self) -> None:
        """Take the server away for good."""
        self.unplug()
        self._selector.close()
        with contextlib.suppress(OSError):
            os.close(self._wake_reader)
            os.close(self._wake_writer)

    def _run(self) -> None:
        while True:
            now = time.monotonic()
            due = self._devices.next_due(now)
            # Never sooner than a batch: what is due until then is sent together.
            pause = IDLE_TIME if due is None else max(due - now, BATCH_TIME)
            ready = self._selector.select(min(pause, IDLE_TIME))
            for key, events in ready:
                if key.fd == self._wake_reader:
                    if os.read(self._wake_reader, 1) == _STOP:
                        return
                    self._forget_clients()
                    break  # the others of this round may be forgotten
                if key.fileobj is self._server:
                    self._accept()
                else:
                    self._serve(key.data, events)
            self._distribute(self._devices.poll(time.monotonic()))
            for client in list(self._clients):
                if client.waiting and client.events == selectors.EVENT_READ:
                    self._send(client, b"")  # it may be attached by now

    def _forget_clients(self) -> None:
        for client in self._clients:
            self._selector.unregister(client.socket)
            self._hung.append(client)
        self._clients.clear()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            client = _Client(self._server.accept()[0])
            self._clients.add(client)
            self._selector.register(client.socket, selectors.EVENT_READ, client)
            self._send(client, b"< hi >")

    def _serve(self, client: _Client, events: int) -> None:
        if events & selectors.EVENT_WRITE:
            self._send(client, b"")
        if events & selectors.EVENT_READ and client in self._clients:
            messages = client.receive()
            if messages is None:
                self._part(client)
                return
            for message in messages:
                self._obey(client, message)

    def _obey(self, client: _Client, message: str) -> None:
        """Carry out what a client says; whatever is not understood is answered with an error."""
        command, *words = message.split()
        client.attach_time = 0.0
        if command == "send" and client.raw:
            with contextlib.suppress(ValueError):
                frame = CanFrame.parse(words)
                now = time.monotonic()
                self._devices.receive(frame, now)
                self._distribute([(now, frame)], sender=client)
                return
        elif command == "open" and len(words) == 1 and self._channel in ("", words[0]):
            self._send(client, b"< ok >")
            return
        elif command == "rawmode":
            self._send(client, b"< ok >")
            client.raw = True
            client.attach_time = time.monotonic() + ATTACH_TIME
            return
        elif command == "echo":
            self._send(client, b"< echo >")
            return
        self._send(client, b"< error could not open bus >" if command == "open" else
                   b"< error unknown command >")

    def _distribute(self, frames: Iterable[tuple[float, CanFrame]],
                    sender: _Client | None = None) -> None:
        offset = self._wall_offset
        messages = [frame.encode(due + offset) for due, frame in frames]
        if not messages:
            return
        text = "".join(messages).encode()
        for client in list(self._clients):
            if client is not sender and client.raw:
                self._send(client, text, len(messages))

    def _send(self, client: _Client, text: bytes, frames: int = 0) -> None:
        """Send to a client as much as it takes now, and the rest when it takes more."""
        if len(client.waiting) + len(text) > MAX_WAITING:
            self.dropped += frames
            text = b""
        client.waiting += text
        if client.attach_time > time.monotonic():
            return
        try:
            if client.waiting:
                del client.waiting[:client.socket.send(client.waiting)]
        except BlockingIOError:
            pass
        except OSError:
            self._part(client)
            return
        wanted = selectors.EVENT_READ | (selectors.EVENT_WRITE if client.waiting else 0)
        if wanted != client.events:
            client.events = wanted
            self._selector.modify(client.socket, wanted, client)

    def _part(self, client: _Client) -> None:
        if client in self._clients:
            self._clients.remove(client)
            self._selector.unregister(client.socket)
            client.socket.close()


def _listen(address: str) -> socket.socket:
    host, _, port = address.rpartition(":")
    try:
        server = socket.create_server((host or "127.0.0.1", int(port)))
    except (OSError, ValueError, OverflowError) as error:
        raise LinkError(f"cannot listen on {address}: {error}") from error
    server.setblocking(False)
    return server


class _Client:
    """One client and what is known of it.

    Attributes:
        socket: Its connection.
        raw: Whether it asked for frames.
        attach_time: When it has read the last answer of the greeting, unless it says something
            before: python-can takes a frame in the same piece for a wrong answer.
        waiting: Bytes that it did not take yet.
        events: What the selector waits for.
    """

    def __init__(self, connection: socket.socket) -> None:
        self.socket = connection
        self.socket.setblocking(False)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.raw = False
        self.attach_time = 0.0
        self.waiting = bytearray()
        self.events = selectors.EVENT_READ
        self._received = b""

    def receive(self) -> list[str] | None:
        """Return the messages that it completed, None when it has gone; garbage is skipped."""
        try:
            data = self.socket.recv(65536)
        except BlockingIOError:
            return []
        except OSError:
            return None
        if not data:
            return None
        self._received += data
        messages = []
        end = 0
        for found in _MESSAGE.finditer(self._received):
            end = found.end()
            text = found[1].decode("ascii", errors="replace")
            if text:
                messages.append(text)
        self._received = self._received[end:][-MAX_MESSAGE:]
        return messages
