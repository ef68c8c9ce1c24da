# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What condition monitoring looks at: mean, RMS, peak, crest factor and velocity RMS of a period.

The velocity is the integral of the acceleration behind a high-pass at 10 Hz, without which the
integral of the smallest offset grows for ever, and in front of a low-pass at 1000 Hz: the band of
ISO 20816. Both are Butterworth filters of fourth order, made digital by the bilinear transform with
their corners in place; the same transform makes the integration the rule of trapezoids.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from icotronic_driver.gathering import Samples

Floats = npt.NDArray[np.float64]

COLUMNS = ("mean", "rms", "peak", "crest_factor", "velocity_rms")
BAND = 10.0, 1000.0  # Hz
LEAST_RATIO = 2.5  # of the rate to a corner; below it, that corner is left out
SETTLING = 0.5  # s after which nothing is left of how the filter began: e⁻¹² for 10 Hz
GAP = 1.5  # sample intervals from one sample to the next
BLOCK = 64  # samples that the filter takes at a time
MM = 1e3  # mm in a metre
QUALITIES = tuple(1 / (2 * math.cos(math.pi / 8 * odd)) for odd in (1, 3))  # of Butterworth's poles


class Filter:
    """A linear filter of several signals at once, in blocks, because NumPy has no recursion.

    In a block the output follows from the input and the state at its beginning by matrices; only
    the state goes on from block to block.
    """

    def __init__(self, sections: Iterable[tuple[Floats, Floats]], rate: float) -> None:
        """Make the matrices.

        Args:
            sections: Numerator and denominator in s of second order each, highest power first.
            rate: Samples/s.
        """
        self._a, self._b, self._c, self._d = _in_series(
            [_discrete(*section, rate) for section in sections])
        order = len(self._b)
        powers = [np.eye(order)]
        for _ in range(BLOCK):
            powers.append(self._a @ powers[-1])
        response = [self._d, *(float(self._c @ power @ self._b) for power in powers[:BLOCK - 1])]
        places = np.subtract.outer(np.arange(BLOCK), np.arange(BLOCK))
        self._forced = np.where(places >= 0, np.array(response)[np.maximum(places, 0)], 0.0)
        self._free = np.array([self._c @ power for power in powers[:BLOCK]])
        self._advance = powers[BLOCK]
        self._reach = np.array([power @ self._b for power in powers[:BLOCK]][::-1]).T
        self._order = order
        self.reset(0)

    def reset(self, signals: int) -> None:
        """Begin anew, with so many signals."""
        self._state = np.zeros((self._order, signals))

    def run(self, signals: Floats) -> Floats:
        """Return the output of signals, shape (samples, signals), that follow what came before."""
        blocks, rest = divmod(len(signals), BLOCK)
        output = np.empty_like(signals)
        for first in range(0, blocks * BLOCK, BLOCK):
            block = signals[first:first + BLOCK]
            output[first:first + BLOCK] = self._free @ self._state + self._forced @ block
            self._state = self._advance @ self._state + self._reach @ block
        for number in range(len(signals) - rest, len(signals)):
            output[number] = self._c @ self._state + self._d * signals[number]
            self._state = self._a @ self._state + np.outer(self._b, signals[number])
        return output


def velocity_filter(rate: float) -> Filter | None:
    """Return the filter from m/s² to m/s in the band; None where the rate is too low for it."""
    low, high = (_warped(corner, rate) for corner in BAND)
    if rate < LEAST_RATIO * BAND[0]:
        return None
    one, two = QUALITIES
    sections = [  # s² and s² of the high-pass, one s of which the integration takes away
        (np.array([0.0, 1.0, 0.0]), np.array([1.0, low / one, low ** 2])),
        (np.array([1.0, 0.0, 0.0]), np.array([1.0, low / two, low ** 2]))]
    if rate >= LEAST_RATIO * BAND[1]:
        sections += [(np.array([0.0, 0.0, high ** 2]), np.array([1.0, high / quality, high ** 2]))
                     for quality in QUALITIES]
    return Filter(sections, rate)


class Vibration:
    """Turns the samples of a period into what condition monitoring looks at."""

    def __init__(self, rate: float, axes: Iterable[int]) -> None:
        """Begin a stream of so many samples/s in which some of x, y, z (0, 1, 2) are measured."""
        self._axes = sorted(axes)
        self._step = 1e9 / rate
        self._settling = math.ceil(SETTLING * rate)
        self._filter = velocity_filter(rate)
        self._last: int | None = None
        self._run = 0  # samples since the filter began
        self._offset: Floats = np.zeros(len(self._axes))

    def summary(self, samples: Samples) -> Floats:
        """Return a row with the values that `COLUMNS` names for each measured axis.

        In m/s², but for the crest factor and the velocity RMS in mm/s. RMS and peak are those of
        the deviation from the mean. What cannot be known is NaN: the crest factor of no vibration,
        the velocity as long as the filter has not settled since the start or since a gap.
        """
        signals = samples.accelerations[:, self._axes].astype(np.float64)
        mean = signals.mean(axis=0)
        rms = signals.std(axis=0)
        peak = np.abs(signals - mean).max(axis=0)
        crest = np.divide(peak, rms, out=np.full_like(peak, math.nan), where=rms > 0)
        return np.stack([mean, rms, peak, crest, MM * self._velocity_rms(samples.stamps, signals)],
                        axis=1)

    def _velocity_rms(self, stamps: npt.NDArray[np.int64], signals: Floats) -> Floats:
        """Return the RMS of the velocity in m/s, where the filter has settled."""
        if self._filter is None:
            return np.full(len(self._axes), math.nan)
        before = stamps[0] if self._last is None else self._last
        gaps = np.flatnonzero(np.diff(stamps, prepend=before) > GAP * self._step).tolist()
        if self._last is None:
            gaps.insert(0, 0)
        self._last = int(stamps[-1])
        squares, count = np.zeros(len(self._axes)), 0
        edges = [*dict.fromkeys([0, *gaps]), len(signals)]
        for first, last in itertools.pairwise(edges):
            if first in gaps:
                self._filter.reset(len(self._axes))
                self._run, self._offset = 0, signals[first]
            velocities = self._filter.run(signals[first:last] - self._offset)
            settled = velocities[max(0, self._settling - self._run):]
            self._run += last - first
            squares += (settled ** 2).sum(axis=0)
            count += len(settled)
        return np.sqrt(squares / count) if count else np.full(len(self._axes), math.nan)


# --- filters ---

_Space = tuple[Floats, Floats, Floats, float]


def _warped(frequency: float, rate: float) -> float:
    """Return the angular frequency that the bilinear transform puts to a frequency in Hz."""
    return 2 * rate * math.tan(math.pi * min(frequency / rate, 0.49))


def _discrete(numerator: Floats, denominator: Floats, rate: float) -> _Space:
    """Return a section in state space (A, B, C, D), by the bilinear transform."""
    k = 2 * rate
    transform = np.array([[k * k, k, 1.0], [-2 * k * k, 0.0, 2.0], [k * k, -k, 1.0]])
    (b0, b1, b2), (a0, a1, a2) = transform @ numerator, transform @ denominator
    b0, b1, b2, a1, a2 = (float(value / a0) for value in (b0, b1, b2, a1, a2))
    return (np.array([[-a1, 1.0], [-a2, 0.0]]), np.array([b1 - a1 * b0, b2 - a2 * b0]),
            np.array([1.0, 0.0]), b0)


def _in_series(sections: Iterable[_Space]) -> _Space:
    """Return sections, each behind the one before, as a single one."""
    first, *others = sections
    a, b, c, d = first
    for a2, b2, c2, d2 in others:
        a = np.block([[a, np.zeros((len(a), len(a2)))], [np.outer(b2, c), a2]])
        b = np.concatenate((b, b2 * d))
        c = np.concatenate((d2 * c, c2))
        d = d2 * d
    return a, b, c, d
