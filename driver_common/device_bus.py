# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the sessions of all drivers share: devices are found, served in turn, lost, waited for."""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Iterable, Iterator
from functools import partial
from typing import Generic, TypeVar

from driver_common import clocks as time
from driver_common.device import Device, Note
from driver_common.errors import (
    DriverError,
    FrameError,
    LinkError,
    NoAnswerError,
    RefusedError,
    SettingError,
    StepInterruptedError,
)

DeviceT = TypeVar("DeviceT", bound=Device)

MISSES_UNTIL_LOST = 3
NEWS_TIME = 60.0  # s in which a reason is told once, though others come between
CHANGING = re.compile(r"(?<![\w:])[0-9A-F]{2}( [0-9A-F]{2})*(?![\w:])|-?\d+ dBm")  # bytes, RSSI


class Listener(Generic[DeviceT]):
    """What a user of a bus wants to hear; all called in the thread of the bus."""

    def on_found(self, device: DeviceT) -> None:
        """Tell that the device was identified and configured."""

    def on_values(self, device: DeviceT) -> None:
        """Tell that values of settings were read again."""

    def on_lost(self, device: DeviceT, error: DriverError) -> None:
        """Tell that the device is not there (any more), or a reason that was not told lately."""

    def on_note(self, device: DeviceT, text: str, *, warning: bool = False) -> None:
        """Tell something worth a line in the log."""


class DeviceBus(Generic[DeviceT]):
    """One or several devices on a link, each in its turn.

    Attributes:
        devices: The devices.
        active: Whether to measure.
        link_error: Why the link is not open.
    """

    def __init__(self, devices: Iterable[DeviceT], listener: Listener[DeviceT]) -> None:
        """Prepare the bus; nothing is opened."""
        self.devices = list(devices)
        self.active = False
        self.link_error: LinkError | None = None
        self._listener = listener

    # --- what a driver provides ---

    def _open_link(self) -> None:
        """Open the link; raises LinkError."""
        raise NotImplementedError

    def _find(self, device: DeviceT) -> None:
        """Do the next step until it is found, identified and configured; raises DriverError."""
        raise NotImplementedError

    def _attend(self, device: DeviceT) -> None:
        """Do the next step with a connected device; it is lost by any DriverError."""
        raise NotImplementedError

    def _start_or_stop(self, device: DeviceT) -> None:
        """Have a connected device measure, or not, as `wants` says; raises DriverError."""
        raise NotImplementedError

    def _explained(self, device: DeviceT, error: DriverError) -> DriverError:
        """Add what can be found out about the reason why a device was not found."""
        return error

    # --- what the thread of the bus calls ---

    def open(self) -> None:
        """Open the link; raises LinkError."""
        with self._link_errors_noted():
            self._open_link()
        self.link_error = None
        for device in self.devices:
            device.due = 0.0
            device.backoff.reset()

    def poll(self) -> float:
        """Serve the device that has waited longest; return the time in s until the next turn."""
        now = time.monotonic()
        due = [device for device in self.devices if device.due <= now]
        if due:
            with self._link_errors_noted():
                self._serve(min(due, key=lambda device: device.served))
        return max(0.0, min(device.due for device in self.devices) - time.monotonic())

    # --- what a user calls, through the thread ---

    def set_active(self, active: bool) -> None:
        """Start or stop measuring, now and after every reconnection.

        A device that does not do so now is told again in its next turn.
        """
        self.active = active
        for device in self.devices:
            if device.is_connected:
                device.due = 0.0
                with contextlib.suppress(NoAnswerError, FrameError, RefusedError):
                    self._start_or_stop(device)

    def set_enabled(self, device: DeviceT, enabled: bool) -> None:
        """Start or stop one device; raises DriverError."""
        self.require(device)
        if enabled and not self.active:
            raise SettingError("the node is not active, so nothing would be published; "
                               "activate it first")
        device.enabled = enabled
        device.due = 0.0
        self._start_or_stop(device)

    # --- life of a device ---

    def _serve(self, device: DeviceT) -> None:
        """Do the next step with a device; only a LinkError gets out."""
        device.served = time.monotonic()
        connected = device.is_connected
        try:
            if connected:
                self._attend(device)
            else:
                self._find(device)
        except StepInterruptedError:
            device.due = 0.0
            if not connected:
                device.forget()  # nobody knows how far it came
            raise
        except LinkError:
            raise
        except DriverError as error:
            self._lose(device, error if connected else self._explained(device, error))

    def wants(self, device: DeviceT) -> bool:
        """Whether a device is to measure."""
        return self.active and device.enabled

    def _note_found(self, device: DeviceT) -> None:
        """Take note that a device was found, identified and configured."""
        device.error = None
        device.backoff.reset()
        device.connections += 1
        self._listener.on_found(device)

    def _note_well(self, device: DeviceT) -> None:
        """Take note that a device does what it should."""
        device.misses = 0
        device.backoff.reset()
        device.error = None
        if device.complained:
            device.complained = False
            self._listener.on_note(device, "is well again")

    def _complain(self, device: DeviceT, error: DriverError) -> None:
        """Take note of what is wrong with a connected device; each reason is told once a minute."""
        now, gist = time.monotonic(), _gist(error)
        if gist != _gist(device.error):
            device.complained = False
        if not device.complained and now - device.told.get(gist, -math.inf) > NEWS_TIME:
            device.complained = True
            device.told[gist] = now
            self._listener.on_note(device, f"{error}; it is asked again", warning=True)
        device.error = error

    def _note_miss(self, device: DeviceT, error: DriverError) -> None:
        """Ask a device again that did not answer; raises the error after too many times."""
        device.misses += 1
        if device.misses >= MISSES_UNTIL_LOST:
            raise error
        device.due = time.monotonic() + self._pause(device) if device.misses > 1 else 0.0

    def _lose(self, device: DeviceT, error: DriverError) -> None:
        """Note that a device is not there; it is looked for more and more rarely."""
        news = device.is_connected or self._is_news(device, error)
        device.told[_gist(error)] = time.monotonic()
        device.forget()
        device.error = error
        device.due = time.monotonic() + self._pause(device)
        if news:
            self._listener.on_lost(device, error)

    def _is_news(self, device: DeviceT, error: DriverError) -> bool:
        """Whether the reason is another one, and none that was told lately: some take turns."""
        gist = _gist(error)
        return (gist != _gist(device.error)
                and time.monotonic() - device.told.get(gist, -math.inf) > NEWS_TIME)

    def _pause(self, device: DeviceT) -> float:
        """Return how long to leave a device alone that does not do what it should."""
        others_work = any(other.is_connected and not other.error
                          for other in self.devices if other is not device)
        device.backoff.last = 10.0 if others_work else 2.0
        return device.backoff.pause()

    def require(self, device: DeviceT) -> None:
        """Raise NoAnswerError where a device is not connected."""
        if not device.is_connected:
            reason = self.link_error or device.error or "still searching"
            raise NoAnswerError(f"{device} is not connected: {reason}")

    def _note_of(self, device: DeviceT) -> Note:
        return partial(self._listener.on_note, device)

    @contextlib.contextmanager
    def _link_errors_noted(self) -> Iterator[None]:
        try:
            yield
        except StepInterruptedError:
            raise
        except LinkError as error:
            self.link_error = error
            raise


def _gist(error: DriverError | None) -> str:
    """Return an error without what changes at every look."""
    return CHANGING.sub("", str(error))
