# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Measuring: distances, alone or in groups, and temperatures."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Sequence

from driver_common import clocks as time
from driver_common.device_thread import Backoff
from driver_common.errors import FrameError, NoAnswerError, RefusedError, SettingError
from driver_common.settings import suggestion
from uc4000_driver import commands
from uc4000_driver.access import Access
from uc4000_driver.commands import Distance, Profile
from uc4000_driver.exchange import (
    ADAPTER_LATENCY,
    REPLY_SPREAD,
    REPLY_TIME,
    REQUEST_TIME,
    most_together,
    stagger,
)
from uc4000_driver.line import Answer, Line
from uc4000_driver.listener import Listener
from uc4000_driver.sensor import Measurement, Sensor
from uc4000_driver.telegram import GAP

LATENCIES = (0.008, ADAPTER_LATENCY)  # s, see Group
RECENT = 20  # sets by which a group is judged
CALM = 100  # sets without a failure after which a group tries again whether it can be quicker
NOTEWORTHY = 0.1  # share of failing sets
OPERATING_TEMPERATURE = (-25, 70)  # °C, section 2.1


class Group:
    """Sensors that do not hear each other and may measure together.

    With a late, damaged or missing reply all of a set have to measure again. So they do it only
    where that is quicker than one after the other all the same.

    Attributes:
        names: Names of the sensors.
        sets: Number of measurements together.
        failures: Number of those that had to be repeated one by one.
        latency: Time in s by which adapter and host may hold up a reply; the more, the fewer
            sensors can measure together.
    """

    def __init__(self, names: frozenset[str]) -> None:
        """Begin with confidence."""
        self.names = names
        self.sets = 0
        self.failures = 0
        self.latency = LATENCIES[0]
        self._recent: deque[bool] = deque([False] * RECENT, RECENT)  # whether the last sets failed
        self._calm = 0  # sets since the last failure
        self._paused_until = 0.0
        self._backoff = Backoff(first=1.0, last=60.0)

    @property
    def failing(self) -> float:
        """Share of the last sets that failed."""
        return sum(self._recent) / RECENT

    @property
    def is_paused(self) -> bool:
        """Whether the sensors measure one by one for a while."""
        return time.monotonic() < self._paused_until

    @property
    def is_failing(self) -> bool:
        """Whether it fails so often that a user should know."""
        return self.is_paused or self.failing >= NOTEWORTHY

    def note_success(self) -> None:
        """Take note that a set was complete."""
        self.sets += 1
        self._recent.append(False)
        self._calm += 1
        if self._calm == CALM and self.latency != LATENCIES[0]:
            self._try(LATENCIES[0])
        elif self._calm > RECENT:
            self._backoff.reset()

    def note_failure(self, count: int, cycles: int) -> bool:
        """Take note that a set of so many sensors failed; return whether there will be a pause."""
        self.sets += 1
        self.failures += 1
        self._recent.append(True)
        self._calm = 0
        # One after the other takes n · t, together (n - 1) · stagger + t; a failure costs more.
        alone = cycles * commands.CYCLE_TIME + REPLY_SPREAD
        gain = (1 - 1 / count) * (1 - stagger(self.latency) / alone)
        if self.failing < gain / 2:
            return False
        self._paused_until = time.monotonic() + self._backoff.pause()
        return True

    def note_lateness(self, lateness: float) -> bool:
        """Take note how late a member was alone; return whether it can measure with others."""
        for latency in LATENCIES:
            if lateness <= stagger(latency) - GAP:
                if latency > self.latency:
                    self._try(latency)
                return True
        return False

    def _try(self, latency: float) -> None:
        """Leave replies another time; what failed before says nothing about that."""
        self.latency = latency
        self._recent.extend([False] * RECENT)
        self._calm = 0


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
        self._checked: list[tuple[float, int]] = []  # rates and cycles, when last looked at

    def measure(self, sensor: Sensor) -> None:
        """Measure with a sensor, and with those of its group that are due; raises DriverError."""
        self._check_rates()
        if sensor.wants_temperature:
            self._read_temperature(sensor)
        group = self.group_of(sensor)
        together = self._together_with(sensor, group) if group else []
        if group is None or len(together) < 2:
            self._measure_alone(sensor, group)
            return
        try:
            self._measure_together(together, group)
        except (NoAnswerError, FrameError, RefusedError) as error:
            for other in together:
                other.is_punctual = False  # until it has shown alone that it was not the one
            if group.note_failure(len(together), sensor.options.cycles):
                self._listener.on_note(
                    sensor, f"{group.failing:.0%} of the measurements together with its group "
                            f"fail, for a while alone; the last time: {error}")
            self._measure_alone(sensor, group)
        else:
            group.note_success()

    def _check_rates(self) -> None:
        """Say once where a rate cannot be reached."""
        asked = [(sensor.options.rate, sensor.options.cycles) for sensor in self._sensors]
        if asked == self._checked:
            return
        self._checked = asked
        for sensor in self._sensors:
            reachable = self.reachable_rate(sensor)
            if sensor.options.rate > reachable:
                self._listener.on_note(
                    sensor, f"rate = {sensor.options.rate:g} Hz cannot be reached: with cycles = "
                            f"{sensor.options.cycles}, and what the others on the line are to do, "
                            f"it will be about {reachable:.1f} Hz", warning=True)

    def reachable_rate(self, sensor: Sensor) -> float:
        """Return how often in Hz it can measure about, beside what the others are to do."""
        needs = {other: self._time_of(other) for other in self._sensors}
        others = [other for other in self._sensors if other is not sensor]
        taken = sum(other.options.rate * needs[other] for other in others)
        turn = needs[sensor] + sum(needs[other] for other in others if not other.options.rate)
        return max((1 - taken) / turn, 1 / sum(needs.values()))

    def _time_of(self, sensor: Sensor) -> float:
        """Return the time in s that a measurement takes of the line, a share of it in a group."""
        cycles, group = sensor.options.cycles, self.group_of(sensor)
        alone = REQUEST_TIME + cycles * commands.CYCLE_TIME + REPLY_SPREAD / 2 + REPLY_TIME + GAP
        members = [other for other in self._sensors if self.group_of(other) is group
                   and other.options.cycles == cycles] if group else []
        if group is None or len(members) < 2:
            return alone
        count = min(len(members), most_together(cycles, group.latency))
        return ((count - 1) * stagger(group.latency) + alone) / count

    def group_of(self, sensor: Sensor) -> Group | None:
        """Return the group of a sensor, None where it measures alone."""
        return next((group for group in self.groups if sensor.options.name in group.names), None)

    def _together_with(self, sensor: Sensor, group: Group) -> list[Sensor]:
        """Return the sensors that can measure together now."""
        now = time.monotonic()
        if group.is_paused or sensor.misses or not sensor.is_punctual:
            return [sensor]
        others = [other for other in self._sensors
                  if other is not sensor and other.options.name in group.names
                  and other.is_connected and not other.misses and not other.error
                  and other.is_punctual and self._wants(other)
                  and other.due <= now and not other.wants_temperature
                  and other.options.cycles == sensor.options.cycles]
        others.sort(key=lambda other: other.served)
        return [sensor, *others][:most_together(sensor.options.cycles, group.latency)]

    def _measure_alone(self, sensor: Sensor, group: Group | None) -> None:
        sensor.plan_next()
        profile, cycles = sensor.profile, sensor.options.cycles
        answer = Access(self._line, sensor).ask(commands.measure(profile, cycles), attempts=1)
        if group is not None:
            sensor.is_punctual = group.note_lateness(answer.lateness)
        self._report(sensor, answer, profile, cycles)

    def _measure_together(self, sensors: Sequence[Sensor], group: Group) -> None:
        profiles = [sensor.profile for sensor in sensors]
        cycles = sensors[0].options.cycles
        answers = self._line.ask_together(
            [(sensor.address, commands.measure(profile, cycles))
             for sensor, profile in zip(sensors, profiles, strict=True)],
            ", ".join(map(str, sensors)), group.latency)
        for sensor, profile, answer in zip(  # those not asked have their turn next
                sensors, profiles, answers, strict=False):
            sensor.served = time.monotonic()
            sensor.plan_next()
            self._report(sensor, answer, profile, cycles)

    def _report(self, sensor: Sensor, answer: Answer[Distance], profile: Profile,
                cycles: int) -> None:
        if not self._wants(sensor):  # any more: it took its time
            return
        sensor.count(answer.value.outcome)
        middle = answer.sent + round(cycles * commands.CYCLE_TIME / 2 * 1e9)
        self._listener.on_measurement(sensor, Measurement(answer.value, profile, middle))

    def _read_temperature(self, sensor: Sensor) -> None:
        sensor.temperature_due = time.monotonic() + sensor.options.temperature_period
        try:
            answer = Access(self._line, sensor).ask(commands.READ_TEMPERATURE, attempts=1)
        except RefusedError as error:  # the distance can be measured all the same
            self._listener.on_note(sensor, str(error), warning=True)
            return
        celsius = answer.value
        low, high = OPERATING_TEMPERATURE
        if not low <= celsius <= high and celsius != sensor.temperature:
            self._listener.on_note(sensor, f"reports {celsius} °C, but is made for {low} … {high} "
                                   "°C: too hot, too cold or defective", warning=True)
        sensor.temperature = float(celsius)
        self._listener.on_temperature(sensor, sensor.temperature, answer.sent)
