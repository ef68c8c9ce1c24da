# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A recording in the place of a serial port."""

from __future__ import annotations

import threading

from driver_common.flight_recorder import FlightRecorder
from driver_common.recording import SERIAL
from driver_common.replay import Replay, recording_path
from driver_common.serial_link import SerialLink


def serial_recorder(port: str) -> FlightRecorder:
    """Return what records a port, or the replay that it is; raises SettingError."""
    path = recording_path({"serial_port": port})
    return FlightRecorder() if path is None else Replay(path, SERIAL)


def open_serial(port: str, baud_rate: int, recorder: FlightRecorder) -> SerialLink:
    """Open a serial port, or a recording of one; raises LinkError."""
    if isinstance(recorder, Replay):
        return ReplayedSerial(port, baud_rate, recorder)
    return SerialLink(port, baud_rate, recorder)


class ReplayedSerial(SerialLink):
    """A recording in the place of a serial port."""

    def __init__(self, port: str, baud_rate: int, replay: Replay) -> None:
        """Go to where the port was opened next."""
        self.port = port
        self.time = 0
        self._baud_rate = baud_rate
        self._interrupted = threading.Event()
        self._replay = replay
        replay.open()

    @property
    def baud_rate(self) -> int:
        """Baud rate in Bd."""
        return self._baud_rate

    @baud_rate.setter
    def baud_rate(self, baud_rate: int) -> None:
        self._baud_rate = baud_rate

    def write(self, data: bytes) -> None:
        """Go to where the same was sent."""
        self._replay.send(data)
        self.time = self._replay.arrived + self._replay.offset

    def read(self, timeout: float) -> bytes:
        """Return what arrived then."""
        self._check_interrupted()
        entry = self._replay.receive(timeout)
        self.time = self._replay.arrived + self._replay.offset
        return entry.content if entry else b""

    def close(self) -> None:
        """Leave the recording where it is."""
        self._replay.close()
