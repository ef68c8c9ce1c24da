"""Measuring: distances, alone or in groups, and temperatures."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

from driver_common import device_bus
from driver_common.device_thread import Backoff
from driver_common.errors import DriverError, LinkError, RefusedError, SettingError
from driver_common.settings import suggestion
from uc4000_driver import commands
from uc4000_driver.access import Access
from uc4000_driver.commands import Distance, Profile
from uc4000_driver.line import Line, most_together
from uc4000_driver.sensor import Measurement, Sensor

OPERATING_TEMPERATURE = (-25, 70)  # °C, section 2.1


class Listener(device_bus.Listener[Sensor]):
    """What a user of the bus wants to hear; all called in the thread of the bus."""

    def on_measurement(self, sensor: Sensor, measurement: Measurement) -> None:
        """Take a measurement."""

    def on_temperature(self, sensor: Sensor, celsius: float, stamp: int) -> None:
        """Take a temperature; `stamp` is the host's time in ns when it was asked for."""


@dataclass
class Group:
    """Sensors that do not hear each other and may measure together.

    Attributes:
        names: Names of the sensors.
        failures: Number of measurements together that had to be repeated one by one.
        due: Monotonic time in s until which they measure one by one.
        backoff: Pauses after failures.
    """

    names: frozenset[str]
    failures: int = 0
    due: float = 0.0
    backoff: Backoff = field(default_factory=lambda: Backoff(first=1.0, last=60.0))


def make_groups(texts: Iterable[str], names: Sequence[str]) -> list[Group]:
    """Return groups from texts such as "left right".

    Raises:
        SettingError: A sensor is not known, or in two groups.
    """
    groups: list[Group] = []
    for text in texts:
        members = frozenset(text.replace(",", " ").split())
        for name in sorted(members):
            if name not in names:
                raise SettingError(f'groups: there is no sensor "{name}"{suggestion(name, names)}')
            if any(name in group.names for group in groups):
                raise SettingError(f"groups: {name} is in two groups")
        groups.append(Group(members))
    return groups


class Acquisition:
    """Has the sensors on a wire measure, and reports what they found.

    Attributes:
        groups: Sensors that may measure together.
    """

    def __init__(self, line: Line, sensors: Sequence[Sensor], groups: Sequence[Group],
                 wants: Callable[[Sensor], bool], listener: Listener) -> None:
        """Prepare; nothing is sent.

        Args:
            line: The wire.
            sensors: All sensors on it.
            groups: Those that may measure together.
            wants: Whether a sensor is to measure.
            listener: Told what was measured.
        """
        self.groups = groups
        self._line = line
        self._sensors = sensors
        self._wants = wants
        self._listener = listener

    def measure(self, sensor: Sensor) -> None:
        """Measure with a sensor, and with those of its group that are due; raises DriverError."""
        if sensor.wants_temperature:
            self._read_temperature(sensor)
        group = next((group for group in self.groups if sensor.options.name in group.names), None)
        together = self._together_with(sensor, group) if group else []
        if group is None or len(together) < 2:
            self._measure_alone(sensor)
            return
        try:
            self._measure_together(together)
            group.backoff.reset()
        except LinkError:
            raise
        except DriverError as error:
            group.failures += 1
            group.due = time.monotonic() + group.backoff.pause()
            self._listener.on_note(sensor, f"cannot measure together with its group ({error}), "
                                   "for a while alone")
            self._measure_alone(sensor)

    def _together_with(self, sensor: Sensor, group: Group) -> list[Sensor]:
        """Return the sensors that can measure together now."""
        now = time.monotonic()
        if now < group.due or sensor.misses:
            return [sensor]
        others = [other for other in self._sensors
                  if other is not sensor and other.options.name in group.names
                  and other.is_connected and not other.misses and not other.error
                  and self._wants(other)
                  and other.due <= now and not other.wants_temperature
                  and other.options.cycles == sensor.options.cycles]
        others.sort(key=lambda other: other.served)
        return [sensor, *others][:most_together(sensor.options.cycles)]

    def _measure_alone(self, sensor: Sensor) -> None:
        sensor.plan_next()
        profile, cycles = sensor.profile, sensor.options.cycles
        distance, sent = Access(self._line, sensor).timed(
            commands.measure(profile, cycles), attempts=1)
        self._report(sensor, distance, profile, sent)

    def _measure_together(self, sensors: Sequence[Sensor]) -> None:
        profiles = [sensor.profile for sensor in sensors]
        results = self._line.ask_together(
            [(sensor.address, commands.measure(profile, sensor.options.cycles))
             for sensor, profile in zip(sensors, profiles, strict=True)],
            ", ".join(map(str, sensors)))
        for sensor, profile, (distance, sent) in zip(  # those not asked have their turn next
                sensors, profiles, results, strict=False):
            sensor.served = time.monotonic()
            sensor.plan_next()
            self._report(sensor, distance, profile, sent)

    def _report(self, sensor: Sensor, distance: Distance, profile: Profile, sent: int) -> None:
        sensor.count(distance.outcome)
        half = round(sensor.options.cycles * commands.CYCLE_TIME / 2 * 1e9)
        self._listener.on_measurement(sensor, Measurement(distance, profile, sent + half))

    def _read_temperature(self, sensor: Sensor) -> None:
        sensor.temperature_due = time.monotonic() + sensor.options.temperature_period
        try:
            celsius, stamp = Access(self._line, sensor).timed(commands.READ_TEMPERATURE)
        except RefusedError as error:  # the distance can be measured all the same
            self._listener.on_note(sensor, str(error), warning=True)
            return
        low, high = OPERATING_TEMPERATURE
        if not low <= celsius <= high and celsius != sensor.temperature:
            self._listener.on_note(sensor, f"reports {celsius} °C, but is made for {low} … {high} "
                                   "°C: too hot, too cold or defective", warning=True)
        sensor.temperature = float(celsius)
        self._listener.on_temperature(sensor, sensor.temperature, stamp)
