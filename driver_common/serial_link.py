# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A serial port, opened well: errors in words, bytes in and out."""

from __future__ import annotations

import contextlib
import fcntl
import math
import os
import re
import socket
import termios
import threading
import time
from collections.abc import Iterator
from typing import Any

import serial
from serial.tools import list_ports

from driver_common.advice import SERIAL_ERRORS
from driver_common.errors import STEP_INTERRUPTED, LinkError, StepInterruptedError
from driver_common.flight_recorder import FlightRecorder, Kind
from driver_common.port_use import group_of, holders_text

BITS_PER_BYTE = 10  # 8N1
WRITE_TIMEOUT = 1.0  # s
HELD_UP = 0.02  # s by which a wait may be too long before the host counts as held up
GRACE = 1.0  # s that are waited once more after that, at most
NETWORK = ("socket", "rfc2217")  # URLs of ports elsewhere
SCHEMES = (*NETWORK, "hwgrep")
SILENCE = 10.0  # s without an answer over a network: its other end may be gone unnoticed
SLICE = 0.01  # s of a wait where the port cannot change its time-out


class SerialLink:
    """A serial port: a device path, `hwgrep://` a part of its description, or one elsewhere.

    A port elsewhere (`socket://host:port`, `rfc2217://host:port`) that has not answered for
    `SILENCE` is opened again, because nothing else tells that its other end has gone.

    Attributes:
        time: The host's time in ns when the last write began or the last read ended.
        has_low_latency: Whether the port's driver hands over at once what it receives.

    Args:
        port: Device path or URL.
        baud_rate: In Bd.
        recorder: Gets all that passes.

    Raises:
        LinkError: From every method, with what is wrong and what to do.
    """

    def __init__(self, port: str, baud_rate: int, recorder: FlightRecorder | None = None) -> None:
        """Open the port for this process alone."""
        self.port = port
        self.time = 0
        self._recorder = recorder or FlightRecorder()
        self._baud_rate = baud_rate
        self._scheme = port.partition("://")[0].lower() if "://" in port else ""
        self._unanswered = math.inf  # monotonic time of the first request without any answer
        self._interrupted = threading.Event()
        if not port:
            raise LinkError(f"serial_port is not set; give a device path{_other_ports()}, "
                            f"a URL such as socket://host:port, or sim://MODEL")
        if self._scheme and self._scheme not in SCHEMES:
            raise LinkError(f"cannot open {port}: {self._scheme}:// is not possible here; give a "
                            f"device path, sim://MODEL, {', '.join(map('{}://'.format, SCHEMES))}")
        self._serial = self._opened()
        self._record(Kind.OPENED)

    def _opened(self) -> Any:
        """Return the open port of pyserial."""
        # RFC 2217 has no write time-out, and negotiates anew when the other one changes.
        negotiates = self._scheme == "rfc2217"
        options: dict[str, Any] = {"timeout": SLICE} if negotiates else {
            "timeout": 0, "write_timeout": WRITE_TIMEOUT, "exclusive": True}
        try:
            port = serial.serial_for_url(self.port, self._baud_rate, **options)
        except (serial.SerialException, ValueError, TypeError, OSError, re.error) as error:
            raise LinkError(f"cannot open {self.port}: {_reason(self.port, error)}") from error
        # Not on a pseudo-terminal, a socket, or with every driver.
        self.has_low_latency = False
        with contextlib.suppress(AttributeError, ValueError, OSError, NotImplementedError):
            port.set_low_latency_mode(True)
            self.has_low_latency = True
        # A lock keeps out who asks for it, this one everybody but root.
        with contextlib.suppress(AttributeError, ValueError, OSError, NotImplementedError):
            fcntl.ioctl(port.fileno(), termios.TIOCEXCL)
        self._waits_in_slices = negotiates
        return port

    @property
    def baud_rate(self) -> int:
        """Baud rate in Bd."""
        return self._baud_rate

    @baud_rate.setter
    def baud_rate(self, baud_rate: int) -> None:
        if baud_rate != self._baud_rate:
            with self._guarded():
                self._serial.baudrate = baud_rate
            self._baud_rate = baud_rate
            self._recorder.note(f"{baud_rate} Bd")

    def seconds(self, length: int) -> float:
        """Return the time that `length` bytes take on the line."""
        return length * BITS_PER_BYTE / self._baud_rate

    def write(self, data: bytes) -> None:
        """Send all bytes without a break."""
        now = time.monotonic()
        if self._scheme in NETWORK and now - self._unanswered > SILENCE:
            self.close()
            self._serial = self._opened()
            self._unanswered = math.inf
        self._unanswered = min(self._unanswered, now)
        self._record(Kind.SENT, data)
        with self._guarded():
            self._serial.write(data)

    def read(self, timeout: float) -> bytes:
        """Return what has arrived; wait up to `timeout` s for the first byte, else b"".

        A busy or paused host may have held up adapter, network or simulator as well: the time that
        it took from us is waited once more.
        """
        self._check_interrupted()
        with self._guarded():
            waiting = self._serial.in_waiting
            first = b"" if waiting else self._first_byte(max(timeout, 0))
            waiting = waiting or (self._serial.in_waiting if first else 0)
            data: bytes = first + (self._serial.read(waiting) if waiting else b"")
        if data:
            self._unanswered = math.inf
        self._record(Kind.RECEIVED if data else Kind.NOTHING, data)
        return data

    def interrupt(self) -> None:
        """Have reads end with a StepInterruptedError until `resume`; called from another thread."""
        self._interrupted.set()

    def _check_interrupted(self) -> None:
        if self._interrupted.is_set():
            raise StepInterruptedError(STEP_INTERRUPTED)

    def resume(self) -> None:
        """Read again."""
        self._interrupted.clear()

    def _first_byte(self, timeout: float) -> bytes:
        start = time.monotonic()
        first = self._wait(timeout)
        held_up = time.monotonic() - start - timeout
        if not first and timeout and held_up > HELD_UP:
            first = self._wait(min(held_up, GRACE))
        return first

    def _wait(self, timeout: float) -> bytes:
        """Return the first byte that comes in time, else b""."""
        first: bytes
        if not self._waits_in_slices:
            self._serial.timeout = timeout
            first = self._serial.read(1)
            return first
        end = time.monotonic() + timeout
        while not (first := self._serial.read(1)) and time.monotonic() < end:
            pass
        return first

    def close(self) -> None:
        """Close the port; it may be gone already."""
        with contextlib.suppress(OSError):  # unplugged
            self._serial.close()

    @contextlib.contextmanager
    def _guarded(self) -> Iterator[None]:
        """Turn what pyserial raises when a port vanishes into a LinkError."""
        try:
            yield
        except (OSError, TypeError, termios.error) as error:
            # TypeError: pyserial's own when the port was closed under it.
            text = (f"{self.port} takes no bytes; is flow control on?"
                    if isinstance(error, serial.SerialTimeoutException)
                    else f"lost {self.port}: {_reason(self.port, error)}")
            self._record(Kind.LOST, text.encode())
            raise LinkError(text) from error

    def _record(self, kind: Kind, content: bytes = b"") -> None:
        now = time.monotonic_ns()
        self._recorder.follow_offset()
        self._recorder.add(now, kind, content)
        self.time = now + self._recorder.offset


def _reason(port: str, error: Exception) -> str:
    causes: list[BaseException] = [error]
    while (cause := causes[-1].__context__) is not None:
        causes.append(cause)
    if any(isinstance(cause, socket.gaierror) for cause in causes):
        return "there is no such host; check its name"
    scheme = port.partition("://")[0]
    if scheme in NETWORK and any(isinstance(cause, (TypeError, ValueError, KeyError))
                                 for cause in causes):
        return f"a host and a port are needed, as in {scheme}://host:port"
    number = next((cause.args[0] for cause in causes
                   if isinstance(cause, (OSError, termios.error))
                   and cause.args and isinstance(cause.args[0], int)), None)
    if number in SERIAL_ERRORS:
        return SERIAL_ERRORS[number].text(ports=_other_ports(), group=group_of(port),
                                          holder=holders_text(port), where="")
    if "disconnected" in str(error) or "returned no data" in str(error):
        return "it was unplugged or closed by the other side"
    if number is not None:
        return os.strerror(number)
    return str(error)


def _other_ports() -> str:
    ports = sorted(port.device for port in list_ports.comports())
    return f" (present: {', '.join(ports)})" if ports else " (no serial port is present)"
