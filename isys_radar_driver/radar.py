"""One radar on a line: how it is to be used, what is known of it, and what was counted."""

from __future__ import annotations

import math
import time
from collections import deque
from dataclasses import dataclass

from driver_common.device import Device, DeviceOptions
from isys_radar_driver.commands import Version
from isys_radar_driver.frames import BROADCAST
from isys_radar_driver.line import OVERHEAD
from isys_radar_driver.models import FAST, Model
from isys_radar_driver.targets import Resolution

RATE_WINDOW = 5.0  # s over which the rate is measured
EARLY = 0.25  # cycles by which a list may come before it is expected


@dataclass(frozen=True)
class Identity:
    """Who a radar says it is (sections 3.3.2 and 3.3.6)."""

    model: Model
    device_name: str
    firmware: Version
    dsp_hardware: Version | None
    rfe_hardware: Version | None
    bootloader: Version | None

    @property
    def serial_number(self) -> str:
        """What follows the model in the device name (errata I23)."""
        return self.device_name.removeprefix(self.model.name).strip(" ,:#") or "unknown"

    def __str__(self) -> str:
        """Return model, serial number and firmware."""
        return f"{self.model.name} {self.serial_number}, firmware {self.firmware}"


@dataclass
class Statistics:
    """What was counted for one radar since the start."""

    target_lists: int = 0
    lost_cycles: int = 0
    clippings: int = 0
    timeouts: int = 0
    refusals: int = 0


@dataclass
class Options(DeviceOptions):
    """How one radar is to be used.

    Attributes:
        address: Its address; 0 = ask by broadcast.
        model: The only model that is accepted; None = any.
        output: Output filter of the target lists, 1 to 3.
        resolution: 16 or 32 bit; 0 = what fits the line.
        read_digital_outputs: Read the digital outputs after every target list.
        read_range_list: Read the range list after every target list.
    """

    address: int = BROADCAST
    model: Model | None = None
    output: int = 1
    resolution: int = 0
    read_digital_outputs: bool = False
    read_range_list: bool = False


class Radar(Device):
    """One radar on the line: what is known of it, and what was counted.

    Attributes:
        options: How it is to be used.
        address: Its address, 0 while unknown.
        identity: Who it is; None while it is not connected.
        temperatures: Board temperatures in °C, by name.
        measuring: Whether acquisition was started.
    """

    KIND = "radar"

    options: Options

    def __init__(self, options: Options) -> None:
        """Begin as an unknown radar."""
        super().__init__(options)
        self.address = options.address
        self.identity: Identity | None = None
        self.temperatures: dict[str, float] = {}
        self.measuring = False
        self.statistics = Statistics()
        self.arrivals: deque[float] = deque()
        self._cycle_end = 0.0  # when the cycle of the last arrival ended, as far as known
        self.fixed_targets = 0  # learned length of fixed-length lists
        self.checks = 0  # how often it was checked for a reset

    def __str__(self) -> str:
        """Return name or address for messages."""
        return self.options.name or (f"address {self.address}" if self.address else self.KIND)

    @property
    def is_connected(self) -> bool:
        """Whether it was found, identified and configured."""
        return self.identity is not None

    def forget(self) -> None:
        """Take note that the radar is not connected any more."""
        super().forget()
        self.identity = None
        self.measuring = False
        self.arrivals.clear()
        self.address = self.options.address

    @property
    def model(self) -> Model | None:
        """The connected model."""
        return self.identity.model if self.identity else None

    @property
    def product(self) -> str:
        """Name of what is connected."""
        return self.model.name if self.model else "radar"

    @property
    def cycle_time(self) -> float:
        """Cycle time in s in the present measurement mode."""
        if self.model is None:
            return 0.0
        return self.model.cycle_time(self._mode)

    @property
    def _mode(self) -> int:
        setting = self.settings.get("measurement_mode")
        value = self.values.get("measurement_mode")
        if setting is None or setting.choices is None:
            return FAST
        return setting.choices.get(str(value), FAST)

    @property
    def max_targets(self) -> int:
        """Most targets in a list in the present measurement mode."""
        if self.model is None:
            return 0
        return self.model.max_targets.get(self._mode, max(self.model.max_targets.values()))

    @property
    def rate(self) -> float:
        """Measured target lists per second."""
        arrivals = self.arrivals
        if len(arrivals) < 2 or time.monotonic() - arrivals[-1] > RATE_WINDOW:
            return 0.0
        return (len(arrivals) - 1) / (arrivals[-1] - arrivals[0])

    def resolution(self, baud_rate: int) -> Resolution:
        """Return the resolution to ask for; "auto" takes the finest that fits the cycle (I24).

        Raises:
            SettingError: The model does not have the resolution that was asked for.
        """
        assert self.model is not None
        possible = self.model.resolutions_of(self.options.resolution)
        for resolution in possible:
            size = OVERHEAD + self.max_targets * (14 if resolution.bits == 32 else 7)
            if size * 10 / baud_rate < self.cycle_time:
                return resolution
        return possible[-1]

    def count_list(self, now: float, *, clipping: bool) -> None:
        """Count a target list, and the cycles that passed without one."""
        self.statistics.target_lists += 1
        self.statistics.clippings += clipping
        expected = now
        if self.arrivals:
            cycles = max(1, math.floor((now - self._cycle_end) / self.cycle_time + EARLY))
            self.statistics.lost_cycles += cycles - 1
            expected = self._cycle_end + cycles * self.cycle_time
        self._cycle_end = min(now, (expected + now) / 2)  # lists come late, never early
        self.arrivals.append(now)
        while now - self.arrivals[0] > RATE_WINDOW:
            self.arrivals.popleft()
