# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A recording in the place of a CAN bus."""

from __future__ import annotations

from collections.abc import Sequence

import can

from driver_common.can_link import CanLink
from driver_common.flight_recorder import (
    ERROR,
    EXTENDED,
    REMOTE,
    FlightRecorder,
    Frame,
    frame_of,
    pack_frame,
)
from driver_common.recording import CAN
from driver_common.replay import INTERFACE, Replay, recording_path


def can_recorder(interface: str, channel: str) -> FlightRecorder:
    """Return what records a bus, or the replay that it is; raises SettingError."""
    path = recording_path({"can_interface": interface, "can_channel": channel})
    return FlightRecorder() if path is None else Replay(path, CAN)


def open_can(interface: str, channel: str, bitrate: int, options: Sequence[str],
             filters: Sequence[tuple[int, int]], recorder: FlightRecorder) -> CanLink:
    """Open a CAN bus, or a recording of one; raises LinkError."""
    if isinstance(recorder, Replay):
        return ReplayedCan(recorder)
    return CanLink(interface, channel, bitrate, options, filters, recorder)


def can_interface(interface: str, recorder: FlightRecorder) -> str:
    """Return the interface that the frames came through."""
    if isinstance(recorder, Replay):
        return recorder.recording.facts.get("interface", interface)
    return interface


class ReplayedCan(CanLink):
    """A recording in the place of a CAN bus."""

    def __init__(self, replay: Replay) -> None:
        """Go to where the bus was opened next."""
        self.interface, self.channel = INTERFACE, str(replay.path)
        self.receive_buffer = 0
        self._replay = replay
        replay.open()
        self.arrived = self.heard = replay.arrived

    def receive(self, timeout: float) -> can.Message | None:
        """Return what arrived then."""
        entry = self._replay.receive(timeout)
        self.arrived = self._replay.arrived
        if entry is None:
            return None
        self.heard = self.arrived
        bus_time, identifier, data = frame_of(entry.content)
        return can.Message(
            timestamp=bus_time, arbitration_id=identifier & ~(EXTENDED | REMOTE | ERROR),
            is_extended_id=bool(identifier & EXTENDED), is_remote_frame=bool(identifier & REMOTE),
            is_error_frame=bool(identifier & ERROR), data=data)

    def send(self, identifier: int, data: bytes) -> None:
        """Go to where the same was sent."""
        self._replay.send(pack_frame(Frame(0.0, identifier | EXTENDED, data)))

    def close(self) -> None:
        """Leave the recording where it is."""
        self._replay.close()
