# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Measured values beside the truth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass, field

import numpy as np
import numpy.typing as npt

from sensor_tools.demo.machine import Array

ENOUGH = 0.95  # share of the values that must be within their tolerance …
ENOUGH_BUSY = 0.75  # … also with those that were measured while the machine was busy
FEW = 0.1  # share of the values; fewer lie between two busy times, and are no better than these


@dataclass(frozen=True)
class Comparison:
    """Measured values beside the truth. The arrays have one entry per value.

    Attributes:
        quantity: What was measured, with its unit.
        error_name: What the error is, with its unit.
        seconds: When, since the first value.
        tracks: Index of the curve that a value belongs to.
        names: Name of each curve.
        measured: The values; NaN where one is missing.
        errors: Distance from the truth; infinite where a value is missing.
        tolerances: Largest error that resolution and timing explain.
        places: Positions (x, y) in m, if the sensor tells any.
        busy: Whether the machine was busy then.
        curve_seconds: Times of the curves, which are the truth.
        curves: Their values, one row per time and one column per track.
        curve_places: Positions of the truth.
        delay: By how much in s all stamps are late.
        delay_limit: By how much they may be.
        remark: What else is to be said.
    """

    quantity: str
    error_name: str
    _: KW_ONLY
    seconds: Array
    tracks: npt.NDArray[np.int64]
    names: Sequence[str]
    measured: Array
    errors: Array
    tolerances: Array
    busy: npt.NDArray[np.bool_]
    curve_seconds: Array
    curves: Array
    places: Array = field(default_factory=lambda: np.empty((0, 2)))
    curve_places: Array = field(default_factory=lambda: np.empty((0, 0, 2)))
    delay: float = 0.0
    delay_limit: float = math.inf
    remark: str = ""

    @property
    def agrees(self) -> bool:
        """Whether the measurements agree with the truth."""
        near = self.errors <= self.tolerances
        quiet = near[~self.busy]
        return (abs(self.delay) <= self.delay_limit and bool(np.mean(near) >= ENOUGH_BUSY)
                and (quiet.size < FEW * near.size or bool(np.mean(quiet) >= ENOUGH)))

    def __str__(self) -> str:
        """Say how well the measurements agree with the truth, in one line."""
        half, most = np.quantile(self.errors, (0.5, ENOUGH), method="higher")
        within = np.count_nonzero(self.errors <= self.tolerances)
        remarks = [f"common delay {1e3 * self.delay:.2g} ms, allowed {1e3 * self.delay_limit:.2g}"
                   ] if self.delay_limit < math.inf else []
        if self.busy.any():
            remarks.append(f"{np.count_nonzero(self.busy)} were measured on a busy machine")
        return "; ".join([
            f"{within} of {self.errors.size} values are as near to the truth as resolution and "
            "timing allow",
            f"{self.error_name}: median {half:.3g}, 95 % below {most:.3g}, allowed "
            f"{np.min(self.tolerances):.3g} to {np.max(self.tolerances):.3g}",
            *remarks, *filter(None, [self.remark])])
