# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The conversation with the radars on one serial line: each is found, and then measures.

One request at a time, each with its time-out; several radars take turns. All of `RadarBus` runs in
one thread (see `driver_common.device_thread`).
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Mapping

from driver_common import clocks as time
from driver_common.device_bus import DeviceBus
from driver_common.errors import (
    DriverError,
    FrameError,
    LinkError,
    NoAnswerError,
    RefusedError,
    SettingError,
)
from driver_common.settings import Value
from isys_radar_driver.access import Access
from isys_radar_driver.acquisition import Acquisition
from isys_radar_driver.connection import Connection
from isys_radar_driver.frames import BROADCAST
from isys_radar_driver.line import Line
from isys_radar_driver.listener import Listener
from isys_radar_driver.maintenance import Maintenance
from isys_radar_driver.radar import Options, Radar

PATIENCE = 5.0  # s since a good step for which a radar with a bad line is not lost


class RadarBus(DeviceBus[Radar]):
    """Several radars on one serial line, or one.

    Attributes:
        line: The serial line.
        access: Requests to a radar.
        acquisition: Measuring.
        connection: Finding, configuring and looking after a radar.
        maintenance: What a user asks of a radar.
    """

    _listener: Listener

    def __init__(self, port: str, baud_rate: int, radars: Iterable[Options],
                 listener: Listener) -> None:
        """Prepare the bus; nothing is opened.

        Args:
            port: Device path or pyserial URL.
            baud_rate: In Bd; 0 = try the default rates of the models.
            radars: How each radar is to be used.
            listener: Told of everything that happens.

        Raises:
            SettingError: Of several radars, one has no address of its own.
        """
        super().__init__(map(Radar, radars), listener)
        self._check_addresses()
        self.line = Line(port)
        self.access = Access(self.line)
        self.acquisition = Acquisition(self.access, self.devices, self.wants, listener)
        self.connection = Connection(self.access, self.devices, self.acquisition, listener,
                                     baud_rate)
        self.maintenance = Maintenance(self.access, self.devices, self.acquisition,
                                       self.connection, listener, self.require, self._lose)

    def _check_addresses(self) -> None:
        owners: dict[int, str] = {}
        for radar in self.devices:
            name, address = radar.options.name, radar.options.address
            if len(self.devices) > 1 and address == BROADCAST:
                raise SettingError(f"{name}.address must be given, as there are several sensors")
            if address in owners:
                raise SettingError(f"{name}.address is {address}, but that is the address of "
                                   f"{owners[address]}")
            owners[address] = name

    def close(self) -> None:
        """Leave the radars stopped and close the port."""
        if not self.line.is_open:
            return
        self.resume()
        for radar in self.devices:
            if radar.is_connected:
                with contextlib.suppress(DriverError):
                    self.acquisition.stop(radar)
                radar.forget()
        self.line.close()

    def interrupt(self) -> None:
        """Have the present step end soon; called from another thread."""
        with contextlib.suppress(LinkError):  # it is not open
            self.line.link.interrupt()

    def resume(self) -> None:
        """Ask the radars again."""
        with contextlib.suppress(LinkError):
            self.line.link.resume()

    def _open_link(self) -> None:
        self.line.open(self.connection.baud_candidates(self.devices[0])[0])

    def _find(self, radar: Radar) -> None:
        """Find, identify and configure a radar."""
        self.connection.find(radar)
        self._note_found(radar)

    def _explained(self, radar: Radar, error: DriverError) -> DriverError:
        return self.connection.explained(radar, error)

    def _start_or_stop(self, radar: Radar) -> None:
        self.acquisition.start_or_stop(radar)

    def _attend(self, radar: Radar) -> None:
        """Measure, or look whether the radar is there."""
        begin = time.monotonic()
        try:
            if radar.measuring != self.wants(radar):
                self.acquisition.start_or_stop(radar)  # it did not work when it was asked for
            if radar.sends_lists:
                if self.connection.is_check_due(radar):
                    self.connection.check_reset(radar)
                self.acquisition.measure(radar)
            else:
                self.connection.keep_alive(radar)
            radar.refused = 0
            radar.well = time.monotonic()
            self._note_well(radar)
        except (RefusedError, NoAnswerError, FrameError) as error:
            if not radar.is_connected:  # it could not be configured again
                raise
            if isinstance(error, RefusedError):
                self._note_refusal(radar, error)
            else:
                self._note_failure(radar, error, begin)

    def _note_failure(self, radar: Radar, error: NoAnswerError | FrameError,
                      begin: float) -> None:
        """Ask a radar again whose answer did not come, or arrived damaged.

        One that sends good lists now and then is there, as long as it answers something.
        """
        damaged = isinstance(error, FrameError)
        radar.statistics.damaged_replies += damaged
        radar.statistics.timeouts += not damaged
        if time.monotonic() < radar.well + PATIENCE and (damaged or radar.answered > begin):
            radar.misses = int(not damaged)  # after a silence a setting is looked at
        else:
            self._note_miss(radar, error)

    def _note_refusal(self, radar: Radar, error: RefusedError) -> None:
        """Configure a radar again that refuses; if it refuses then, ask it ever more rarely."""
        radar.refused += 1
        if radar.refused == 1:
            self.connection.configure_again(radar, "it refuses to measure, as after a reset")
            return
        self._complain(radar, error)
        radar.measuring = None  # so that it is started again
        radar.due = time.monotonic() + self._pause(radar)

    def write(self, radar: Radar, changes: Mapping[str, Value]) -> dict[str, Value]:
        """Write settings, see `Maintenance.write`."""
        return self.maintenance.write(radar, changes)
