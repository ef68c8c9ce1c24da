"""A serial port, opened well: errors in words, bytes in and out."""

from __future__ import annotations

import contextlib
import errno
import os
import socket
import termios
import time

import serial
from serial.tools import list_ports

from driver_common.errors import LinkError

BITS_PER_BYTE = 10  # 8N1
WRITE_TIMEOUT = 1.0  # s
HELD_UP = 0.02  # s by which a wait may be too long before the host counts as held up
GRACE = 1.0  # s that are waited once more after that, at most
_ADVICE = {
    errno.ENOENT: "there is no such port{ports}; is it plugged in?",
    errno.EACCES: "no permission; add yourself to the group dialout with "
                  "'sudo usermod -aG dialout $USER' and log in again",
    errno.EWOULDBLOCK: "it is in use by another program; close that one first "
                       "('fuser -v {port}' names it)",
    errno.EBUSY: "it is in use by another program; close that one first "
                 "('fuser -v {port}' names it)",
    errno.EIO: "it is gone; is it plugged in?",
    errno.ENXIO: "it is gone; is it plugged in?",
    errno.ECONNREFUSED: "nothing listens there; check host and port",
    errno.EISDIR: "that is no serial port{ports}",
    errno.ENOTTY: "that is no serial port{ports}",
}


class SerialLink:
    """A serial port, or any pyserial URL such as `socket://host:port`.

    Args:
        port: Device path or URL.
        baud_rate: In Bd.

    Raises:
        LinkError: From every method, with what is wrong and what to do.
    """

    def __init__(self, port: str, baud_rate: int) -> None:
        """Open the port for this process alone."""
        self.port = port
        self._baud_rate = baud_rate
        if not port:
            raise LinkError(f"serial_port is not set; give a device path{_other_ports()}, "
                            f"a URL such as socket://host:port, or sim://MODEL")
        try:
            self._serial = serial.serial_for_url(
                port, baud_rate, timeout=0, write_timeout=WRITE_TIMEOUT, exclusive=True)
        except (serial.SerialException, ValueError, OSError) as error:
            raise LinkError(f"cannot open {port}: {_reason(port, error)}") from error
        # Not on a pseudo-terminal, a socket, or with every driver.
        with contextlib.suppress(AttributeError, ValueError, OSError, NotImplementedError):
            self._serial.set_low_latency_mode(True)

    @property
    def baud_rate(self) -> int:
        """Baud rate in Bd."""
        return self._baud_rate

    @baud_rate.setter
    def baud_rate(self, baud_rate: int) -> None:
        if baud_rate != self._baud_rate:
            with _Guard(self.port):
                self._serial.baudrate = baud_rate
            self._baud_rate = baud_rate

    def seconds(self, length: int) -> float:
        """Return the time that `length` bytes take on the line."""
        return length * BITS_PER_BYTE / self._baud_rate

    def write(self, data: bytes) -> None:
        """Send all bytes without a break."""
        with _Guard(self.port):
            self._serial.write(data)

    def read(self, timeout: float) -> bytes:
        """Return what has arrived; wait up to `timeout` s for the first byte, else b"".

        A busy or paused host may have held up adapter, network or simulator as well: the time that
        it took from us is waited once more.
        """
        with _Guard(self.port):
            waiting = self._serial.in_waiting
            if waiting:
                data: bytes = self._serial.read(waiting)
                return data
            first = self._first_byte(max(timeout, 0))
            waiting = self._serial.in_waiting if first else 0
            return first + (self._serial.read(waiting) if waiting else b"")

    def _first_byte(self, timeout: float) -> bytes:
        start = time.monotonic()
        self._serial.timeout = timeout
        first: bytes = self._serial.read(1)
        held_up = time.monotonic() - start - timeout
        if not first and timeout and held_up > HELD_UP:
            self._serial.timeout = min(held_up, GRACE)
            first = self._serial.read(1)
        return first

    def close(self) -> None:
        """Close the port; it may be gone already."""
        with contextlib.suppress(OSError):  # unplugged
            self._serial.close()


class _Guard:
    """Turns what pyserial raises when a port vanishes into a LinkError."""

    def __init__(self, port: str) -> None:
        self._port = port

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if isinstance(error, serial.SerialTimeoutException):
            raise LinkError(f"{self._port} takes no bytes; is flow control on?") from error
        # TypeError: pyserial's own when the port was closed under it.
        if isinstance(error, (OSError, TypeError, termios.error)):
            raise LinkError(f"lost {self._port}: {_reason(self._port, error)}") from error


def _reason(port: str, error: Exception) -> str:
    number, cause = getattr(error, "errno", None), error.__context__
    if isinstance(cause, socket.gaierror):
        return "there is no such host; check its name"
    if port.startswith("socket:") and isinstance(cause, (TypeError, ValueError, KeyError)):
        return "a host and a port are needed, as in socket://host:port"
    if number is None and isinstance(cause, (OSError, termios.error)):
        number = cause.args[0]
    if number in _ADVICE:
        return _ADVICE[number].format(port=port, ports=_other_ports())
    if "disconnected" in str(error) or "returned no data" in str(error):
        return "it was unplugged or closed by the other side"
    if number is not None:
        return os.strerror(number)
    return str(error)


def _other_ports() -> str:
    ports = sorted(port.device for port in list_ports.comports())
    return f" (present: {', '.join(ports)})" if ports else " (no serial port is present)"
