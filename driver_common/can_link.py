# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A CAN bus through python-can, opened well: errors in words, frames in and out."""

from __future__ import annotations

import contextlib
import errno
import logging
import os
import re
import socket
import time
from collections.abc import Sequence

import can
import serial

from driver_common.advice import CAN_ERRORS, NO_ACKNOWLEDGE
from driver_common.errors import LinkError, SettingError
from driver_common.flight_recorder import ERROR, EXTENDED, REMOTE, FlightRecorder, Kind
from driver_common.settings import suggestion

CONNECT_TIMEOUT = 2.0  # s
GREETING = b"< hi >"  # of a socketcand server
NUMBER = re.compile("-?[0-9]+")
SEND_TIMEOUT = 0.5  # s
RECEIVE_BUFFER = 4 * 1024 * 1024  # bytes; some seconds of the fastest stream


class CanLink:
    """A CAN bus.

    Attributes:
        arrived: Monotonic time in ns when `receive` returned last.
        heard: Monotonic time in ns of the last frame, at first of the opening.
        receive_buffer: Bytes that the kernel keeps for us, 0 while that is not known.

    Args:
        interface: Interface of python-can, such as "socketcan" or "socketcand".
        channel: Channel of the interface, such as "can0".
        bitrate: In bit/s; some interfaces are set up outside and ignore it.
        options: Further options of the interface, each "name=value".
        filters: Identifier and mask of the extended frames that are wanted; given to the kernel
            where it can filter. Frames that pass must still be looked at.
        recorder: Gets all that passes.

    Raises:
        LinkError: From every method, with what is wrong and what to do.
        SettingError: An option has no "=".
    """

    def __init__(self, interface: str, channel: str, bitrate: int, options: Sequence[str],
                 filters: Sequence[tuple[int, int]],
                 recorder: FlightRecorder | None = None) -> None:
        """Open the bus; returns or raises within a few seconds."""
        logging.getLogger("can").setLevel(logging.CRITICAL)  # its warnings come per frame
        self.interface, self.channel, self._bitrate = interface, channel, bitrate
        more = parse_options(options)
        if interface == "socketcand":
            self._try_server(more)
        elif interface == "socketcan":  # others filter in Python, which costs more than it saves
            more["can_filters"] = [{"can_id": number, "can_mask": mask, "extended": True}
                                   for number, mask in filters]
        try:
            self._bus = can.Bus(interface=interface, channel=channel, bitrate=bitrate,
                                ignore_config=True, **more)  # type: ignore[arg-type]
        except (can.CanError, OSError, ImportError, NotImplementedError, ValueError, TypeError,
                AssertionError) as error:
            raise LinkError(f"cannot open {self}: {self._reason(error)}") from error
        self.arrived = 0
        self.heard = time.monotonic_ns()
        self.receive_buffer = 0
        self._prepare_socket()
        self._receive = self._bus.recv
        self._recorder = recorder or FlightRecorder()
        self._recorder.add(time.monotonic_ns(), Kind.OPENED)

    def __str__(self) -> str:
        """Return interface and channel."""
        return f"{self.interface} {self.channel}"

    def receive(self, timeout: float) -> can.Message | None:
        """Return the next frame, or None after a time in s; raises what python-can does."""
        message = self._receive(timeout)
        self.arrived = now = time.monotonic_ns()
        if message is None:
            self._recorder.add(now, Kind.NOTHING)
            return None
        self.heard = now
        identifier = message.arbitration_id
        if message.is_extended_id:
            identifier |= EXTENDED
        if message.is_error_frame or message.is_remote_frame:
            identifier |= ERROR if message.is_error_frame else REMOTE
        self._recorder.add_frame(now, Kind.RECEIVED, message.timestamp, identifier, message.data)
        return message

    def send(self, identifier: int, data: bytes) -> None:
        """Send an extended frame."""
        self._recorder.add_frame(time.monotonic_ns(), Kind.SENT, 0.0, identifier | EXTENDED, data)
        try:
            self._bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=True),
                           timeout=SEND_TIMEOUT)
        except (can.CanError, OSError) as error:
            raise self.lost(error) from error

    def lost(self, error: Exception) -> LinkError:
        """Return the error in words, for one that `receive` raised."""
        text = f"lost {self}: {self._reason(error)}"
        self._recorder.add(time.monotonic_ns(), Kind.LOST, text.encode())
        return LinkError(text)

    def close(self) -> None:
        """Close the bus; it may be gone already."""
        with contextlib.suppress(can.CanError, OSError):
            self._bus.shutdown()

    def _try_server(self, options: dict[str, object]) -> None:
        """Connect once: python-can tries for ten seconds, and waits for a greeting for ever."""
        host, port = options.get("host"), options.get("port")
        if not isinstance(host, str) or not isinstance(port, int):
            raise LinkError('socketcand needs can_options such as ["host=127.0.0.1", '
                            '"port=29536"]')
        where = f"cannot open {self} at {host}:{port}"
        try:
            with socket.create_connection((host, port), CONNECT_TIMEOUT) as server:
                greeting = server.recv(len(GREETING))
        except (OSError, OverflowError) as error:
            raise LinkError(f"{where}: {self._reason(error)}") from error
        if greeting != GREETING:
            raise LinkError(f"{where}: that is no socketcand server; check host and port in "
                            "can_options")

    def _prepare_socket(self) -> None:
        """Let the kernel keep what arrives while this process waits for the processor.

        Raises:
            LinkError: The kernel has an error for us; binding to a channel that is down gives none.
        """
        duplicate = self._socket()
        if duplicate is None:
            return
        with duplicate:
            duplicate.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
            self.receive_buffer = duplicate.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
            fault = duplicate.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        if fault:
            self.close()
            raise LinkError(f"cannot open {self}: {self._reason(OSError(fault, ''))}")

    def _socket(self) -> socket.socket | None:
        """Return the socket behind the bus once more, None where there is another thing."""
        try:
            descriptor = os.dup(self._bus.fileno())
        except (OSError, NotImplementedError, ValueError):
            return None
        try:
            return socket.socket(fileno=descriptor)
        except OSError:
            os.close(descriptor)
            return None

    def _reason(self, error: BaseException) -> str:
        cause: BaseException | None = error
        while cause is not None:
            if isinstance(cause, OSError) and cause.errno in CAN_ERRORS:
                return CAN_ERRORS[cause.errno].text(channel=self.channel, bitrate=self._bitrate,
                                                    where=" in can_options")
            if isinstance(cause, serial.SerialException) and cause.errno == errno.ENOENT:
                return f"there is no serial port {self.channel}; can_channel is the path of one"
            cause = cause.__cause__ or cause.__context__
        if self.interface not in can.VALID_INTERFACES:
            known = sorted(can.VALID_INTERFACES)
            return (f"python-can has no such interface{suggestion(self.interface, known)}; "
                    f"can_interface can be {', '.join(known)}")
        if isinstance(error, can.CanInterfaceNotImplementedError):
            return _lacking(str(error))
        if "buffer full" in str(error):
            return NO_ACKNOWLEDGE.text()
        if isinstance(error, TimeoutError):
            return "no answer; check host and port in can_options"
        if isinstance(error, socket.gaierror):
            return f"{error.strerror}; check host in can_options"
        text = str(error.__cause__ or error).partition("\n")[0] or type(error).__name__
        return f"can_{text}" if text.startswith("channel ") else text


def _lacking(text: str) -> str:
    """Return in words why python-can has an interface that does not work here."""
    if not text.startswith("Cannot import"):
        return text.partition("\n")[0]
    package = re.search(r"No module named '(\w+)'", text)
    what = f"the Python package {package[1]}" if package else "the library of its maker"
    return f"python-can needs {what} for it, which is not here; see its page on this interface"


def parse_options(options: Sequence[str]) -> dict[str, object]:
    """Return the options as python-can takes them: numbers and true or false in their own type.

    Raises:
        SettingError: An option is not "name=value".
    """
    parsed: dict[str, object] = {}
    for option in options:
        name, separator, text = option.partition("=")
        if not separator or not name:
            raise SettingError(f'can_options must be like "host=127.0.0.1", not {option!r}')
        words: dict[str, object] = {"true": True, "false": False}
        parsed[name] = int(text) if NUMBER.fullmatch(text) else words.get(text.lower(), text)
    return parsed
