# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Whether a target list can be true: a checksum of one byte lets one damaged list in many through.

Limits are held against every list. While the line is in doubt, because it damages bytes, a list
must also go on from the ones before it: damage hurts one or two values of a list, and a real target
does not change a single one of its four values at a bound.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from isys_radar_driver.models import Model
from isys_radar_driver.targets import Target, TargetList

Values = npt.NDArray[np.float64]  # a row per target, columns as in Target

MARGIN = 1.25  # by which a value may exceed the largest limit that can be set (table 14)
BELOW = 0.5  # m by which a range may fall short of 0
ANGLE_MAX = math.pi / 2  # rad, a radar looks forward
MEMORY = 3  # lists with which the next one is compared
MEMORY_CYCLES = 6.0  # cycles after which they are too old
SHORT_MEMORY = 1.5  # the same where nothing is in doubt: the last list will do
DAMAGED_TARGETS = 4  # most targets that damage hurts in a list whose checksum is good
GATE = 5.0  # times the usual deviation, beyond which a value jumps
QUANTILE = 0.9  # of the targets define the usual deviation
RELEASE, WIDEN = 0.9, 2.0  # change of that by a list that is in line, or is not
WIDEST = np.array((6.0, 2.0, 1.0, math.radians(4.0)))  # deviation of what is the same target
SAME = 2.6  # of 4, what its values may differ by in these units
NARROWEST = np.array((0.02, 0.001, 0.001, math.radians(0.002)))  # so that it can widen again
VELOCITY, RANGE = 1, 2  # columns


@dataclass(frozen=True)
class Limits:
    """What every target list of a radar keeps to.

    Attributes:
        output: The output asked for.
        max_targets: Most targets in the present measurement mode.
        lowest: Smallest values of a target.
        highest: Largest values of a target.
        cycle_time: In s.
    """

    output: int
    max_targets: int
    lowest: Target
    highest: Target
    cycle_time: float

    @classmethod
    def of(cls, model: Model, output: int, max_targets: int, cycle_time: float, *,
           range_max: float, velocity_max: float, offset: float = 0.0) -> Limits:
        """Return the limits of a model; what it does not measure has none.

        Args:
            model: The model.
            output: The output asked for.
            max_targets: Most targets in the present measurement mode.
            cycle_time: In s.
            range_max: Largest range in m that is to be expected.
            velocity_max: Largest velocity in m/s that is to be expected.
            offset: Distance in m that the radar subtracts from every range.
        """
        velocity = MARGIN * velocity_max if model.measures_velocity else math.inf
        angle = ANGLE_MAX if model.measures_angle else math.inf
        nearest, farthest = -math.inf, math.inf
        if model.measures_range:
            nearest, farthest = -BELOW - offset, MARGIN * range_max
        return cls(output, max_targets, cycle_time=cycle_time,
                   lowest=Target(0.0, -velocity, nearest, -angle),
                   highest=Target(model.signal_max, velocity, farthest, angle))

    def objection(self, targets: TargetList) -> str:
        """Return why a list cannot be true, "" where it can."""
        if targets.output != self.output:
            return f"it is of output {targets.output}, not {self.output}"
        if len(targets.targets) > self.max_targets:
            return f"it has {len(targets.targets)} targets, not {self.max_targets} at most"
        for target in targets.targets:
            for name, value, low, high in zip(Target._fields, target, self.lowest, self.highest,
                                              strict=True):
                if not low <= value <= high:
                    return f"a {name} of {value:g} is beyond {low:g} … {high:g}"
        return ""

    def allow_range(self, distance: float) -> bool:
        """Whether a range in m can be true."""
        return self.lowest.range <= distance <= self.highest.range


class _Entry(NamedTuple):
    """A list that was seen: when, its targets, and how fast their values change."""

    time: float
    values: Values
    rates: Values


class Continuity:
    """The last target lists of a radar, and how well each goes on from the ones before it.

    How much a target may deviate from what is expected follows from how much targets usually do,
    so noise, rough manoeuvres and slow cycles widen it by themselves.
    """

    def __init__(self) -> None:
        """Start without any list."""
        self._entries: deque[_Entry] = deque(maxlen=MEMORY)
        self._usual = WIDEST.copy()
        self._slack = 1.0  # more after lists that were not believed

    def follow(self, targets: TargetList, now: float, oldest: float, *, whole: bool = True) -> str:
        """Take the next list, and return which of its targets jumps, "" where none does.

        Args:
            targets: The list.
            now: Monotonic time in s at which it began.
            oldest: Time since when lists before it count.
            whole: Whether its checksum is good. One that arrived damaged tells nothing about
                itself, but most of its targets are good: the next list is compared with it.
        """
        if not targets.targets:
            return ""
        values = np.array(targets.targets, np.float64)
        rates, objection = np.zeros_like(values), ""
        entries = [entry for entry in self._entries if oldest <= entry.time < now]
        if entries:
            deviations, partners, passed = self._nearest(entries, values, now)
            jumps = (deviations > self._gate).any(axis=1)
            steady = ~np.isnan(deviations[:, 0]) & ~jumps
            rates[steady] = ((values - partners) / passed[:, None])[steady]
            if whole:
                objection = self._learn(deviations, jumps)
        self._entries.appendleft(_Entry(now, values, rates))
        return objection

    def _nearest(self, entries: list[_Entry], values: Values,
                 now: float) -> tuple[Values, Values, Values]:
        """Compare each target with the list before that suits it best: some may be damaged.

        Returns:
            How far each value is from where it is expected, nan for a target that is new; what it
            was in that list, and how long ago.
        """
        every = [_deviations(entry, values, now) for entry in entries]
        deviations = np.stack([deviation for deviation, _ in every])
        excess = np.nan_to_num((deviations / self._gate).max(axis=2), nan=math.inf)
        best = excess.argmin(axis=0), np.arange(len(values))
        partners = np.stack([entry.values[partner] for entry, (_, partner) in zip(
            entries, every, strict=True)])
        passed = np.array([now - entry.time for entry in entries])
        return deviations[best], partners[best], passed[best[0]]

    def _learn(self, deviations: Values, jumps: npt.NDArray[np.bool_]) -> str:
        """Judge a list, and learn from one that is in line what is usual."""
        if 0 < jumps.sum() <= max(1, min(DAMAGED_TARGETS, len(jumps) // 2)):
            self._slack *= WIDEN
            return f"target {jumps.argmax() + 1} jumps"
        known = ~np.isnan(deviations[:, 0])
        if known.any():
            share = QUANTILE if self._slack == 1 else 1.0  # a change that stays is usual now
            usual = np.sort(deviations[known], axis=0)[math.ceil(share * known.sum()) - 1]
            self._usual = np.clip(np.maximum(usual, self._usual * RELEASE), NARROWEST, WIDEST)
        self._slack = 1.0
        return ""

    @property
    def _gate(self) -> Values:
        gate: Values = GATE * self._slack * self._usual
        return gate


def _deviations(entry: _Entry, values: Values,
                now: float) -> tuple[Values, npt.NDArray[np.intp]]:
    """Compare targets with those of an earlier list, each with the one that it goes on from.

    Returns:
        How far each value of each target is from where it is expected, nan for a target that is
        not the nearest one of its partner or is too different; and the partners' indices.
    """
    passed = now - entry.time
    every = np.abs(values[:, None] - (entry.values + entry.rates * passed)[None])
    speed = (values[:, None, VELOCITY] + entry.values[None, :, VELOCITY]) / 2  # approaching: N11
    every[..., RANGE] = np.abs(values[:, None, RANGE] - entry.values[None, :, RANGE]
                               + speed * passed)
    distance = np.minimum(every / WIDEST, 1.0).sum(axis=2)  # a damaged value adds 1 at most
    partners = distance.argmin(axis=1)
    rows = np.arange(len(values))
    same = ((distance.argmin(axis=0)[partners] == rows) & (distance[rows, partners] <= SAME))
    deviations = every[rows, partners]
    deviations[~same] = np.nan
    return deviations, partners
