# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The line of a sensor's clock behind the arrivals of its frames: two estimates of it.

Both work in two coordinates in ns: `due`, when a frame would have come by the nominal rate, and
`late`, how much later than that it came. The sensor's clock is the line
`late = offset + drift * due`, and each frame lies above it by its delay.

- `Envelope`: nothing arrives before it was sent, and where some frames come nearly without delay,
  the earliest ones show the line to microseconds, whatever delays the rest: polls, pauses of the
  host, jitter that is independent from frame to frame.
- `Queue`: where frames keep their order and each may be held up by the one before, hardly any
  comes without delay. What tells then is which ones were held up. An exponential delay has no
  memory: a frame is free of the one before with the probability `exp(-wait / mean)`, the wait being
  the time from when this frame was sent to when the one before arrived, and it then comes another
  such delay later. The line is where as many frames were free as these probabilities add up to.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Point = tuple[float, float]

POINTS = 400  # that an envelope lies below; then it forgets the older half
LOW, MIDDLE = 0.2, 0.4  # shares of the points that show how sharp their edge is; how high they lie
BLUNT = 0.3e6  # ns of mean excess from which the edge of a stream is not sharp
CLEARLY = 4.0  # times that the drift of all points must be better known than that of a sharp edge
FEW, MANY = 5, 20  # points that have no drift in the mean; of which a few high ones do not count
REFUTED = 5.0  # standard deviations from the drift that was to be expected
CLUSTER = 1 / 8  # of a frame interval: frames that come nearer together were held up
KNOWN = 20e-6  # least tolerance of a drift for points to come
DRIFT_CHANGE = 0.02e-6  # of a crystal's drift in 1 s, by its temperature
MEAN_CHANGE = 0.002  # of the mean delay in 1 s, in relation to it
OUTLIER = 4.0  # mean delays; more is a pause
MOST_FREE, DEEPEST = 0.5, 1.5  # largest share of free frames, and least delay in mean ones
EVEN, UNEVEN, SURPRISES = 0.1, 3.0, 10  # mean square of the surprises, in so many blocks


@dataclass(frozen=True)
class Line:
    """An estimate of the sensor's clock.

    Attributes:
        due: Where it was made, in ns.
        late: The line there, in ns.
        drift: Its slope: how much slower the sensor's clock is than its nominal rate.
        uncertainty: Standard deviation of `late` in ns, beside a constant delay.
        drift_uncertainty: Standard deviation of `drift`.
    """

    due: float
    late: float
    drift: float
    uncertainty: float
    drift_uncertainty: float

    def at(self, due: float) -> float:
        """Return where the line is, in ns."""
        return self.late + self.drift * (due - self.due)


@dataclass(frozen=True)
class Prior:
    """What is known before anything arrives.

    Attributes:
        drift: The most likely drift.
        tolerance: Its standard deviation.
        jitter: What the least delays of blocks usually vary by, in ns.
    """

    drift: float
    tolerance: float
    jitter: float


class Envelope:
    """The line below the least delays of blocks of frames.

    Its drift is that of the lower edge of the points, or that of all, whichever is better known;
    its offset the largest with which no point lies below it.

    Attributes:
        excess: Mean height of the points above the line in ns, without regard to few high ones.
    """

    def __init__(self, prior: Prior) -> None:
        """Begin without points."""
        self._prior = prior
        self._count = 0
        self._dues, self._lates = np.empty((2, POINTS))
        self._hull: list[Point] = []
        self.excess = 0.0
        self._scale = prior.jitter
        self._line = Line(0.0, 0.0, prior.drift, math.inf, prior.tolerance)

    def __len__(self) -> int:
        """Return the number of points."""
        return self._count

    def add(self, due: float, late: float) -> Line:
        """Take the point with the least delay of a block; return the line."""
        if self._count == POINTS:
            self._forget_half()
        self._dues[self._count], self._lates[self._count] = due, late
        self._count += 1
        _extend_hull(self._hull, (due, late))
        self._line = self._fit(due)
        return self._line

    def learnt(self) -> Prior:
        """Return what the points have shown, for those to come."""
        tolerance = min(max(self._line.drift_uncertainty, KNOWN), self._prior.tolerance)
        return replace(self._prior, drift=self._line.drift, tolerance=tolerance)

    def _forget_half(self) -> None:
        self._prior = self.learnt()
        self._count = POINTS // 2
        for values in (self._dues, self._lates):
            values[:self._count] = values[-self._count:]
        self._hull.clear()
        for point in zip(self._dues[:self._count].tolist(), self._lates[:self._count].tolist(),
                         strict=True):
            _extend_hull(self._hull, point)

    def lowered(self, line: Line) -> Line:
        """Return a line, moved below all points where it was not."""
        above = max(line.at(due) - late for due, late in self._hull)
        return replace(line, late=line.late - max(above, 0.0))

    def _fit(self, due: float) -> Line:
        count = self._count
        dues, lates = self._dues[:count], self._lates[:count]
        distances = dues - dues.sum() / count
        reach = float(distances[-1])
        drift, certainty = self._drift_of_edge(due - reach, reach)
        in_the_mean, its_certainty = self._drift_of_all(distances, lates)
        if its_certainty > certainty * (1 if self.excess > BLUNT else CLEARLY):
            drift, certainty = in_the_mean, its_certainty
        late = min(late - drift * (there - due) for there, late in self._hull)
        self._learn_shape(lates - (late - drift * (due - dues)))
        drift_uncertainty = 1 / math.sqrt(certainty)
        end = math.hypot(self._scale / count, drift_uncertainty * reach)
        return Line(due, late, drift, 2 * end, drift_uncertainty)

    def _learn_shape(self, heights: Floats) -> None:
        """Learn how high the points lie above the line; two of them are on it."""
        count = self._count
        low, middle = int(LOW * count), int(MIDDLE * count)
        ordered = np.partition(heights, (low, middle))
        self.excess = float(ordered[middle]) / -math.log(1 - MIDDLE)
        if count < MANY:
            self.excess = max(self.excess, float(heights.sum()) / count)
        scale = max(float(ordered[low]) / LOW, self.excess)
        self._scale = (scale * count + self._prior.jitter) / max(count - 1, 1)

    def _drift_of_edge(self, centre: float, reach: float) -> tuple[float, float]:
        """Return the drift of the likeliest line, and its certainty: 1/variance.

        That is the likeliest one if heights become rarer exponentially. Lines through a vertex of
        the hull with a drift between those of the edges beside it lie below all points. In the
        best one the prior's pull on the drift is as strong as that of the points, which is the
        larger the farther their centre lies from the vertex.

        Args:
            centre: The mean of the points' dues.
            reach: How far the last one lies from it.
        """
        prior, count = self._prior, self._count
        pull = prior.tolerance ** 2 * count / self._scale
        drift = -math.inf
        for vertex, most in zip(self._hull, [*map(_slope, pairwise(self._hull)), math.inf],
                                strict=True):
            drift = max(drift, prior.drift + pull * (centre - vertex[0]))
            if drift < most:
                break
            drift = most
        return drift, (reach * count / (3 * self._scale)) ** 2 + prior.tolerance ** -2

    def _drift_of_all(self, distances: Floats, lates: Floats) -> tuple[float, float]:
        """Return the drift that the points have in the mean, and its certainty."""
        prior, spread = self._prior, float(distances @ distances)
        if self._count <= FEW:
            return prior.drift, 0.0
        drift = float(distances @ lates) / spread
        rest = lates - lates.sum() / self._count - drift * distances
        weight = spread / ((float(rest @ rest) + prior.jitter ** 2) / (self._count - 2))
        if abs(drift - prior.drift) > REFUTED * math.hypot(prior.tolerance, weight ** -0.5):
            prior = self._prior = replace(prior, tolerance=abs(drift - prior.drift))
        known = prior.tolerance ** -2
        return (drift * weight + prior.drift * known) / (weight + known), weight + known


def _slope(points: tuple[Point, Point]) -> float:
    (due, late), (other_due, other_late) = points
    return (other_late - late) / (other_due - due)


def _extend_hull(hull: list[Point], point: Point) -> None:
    """Add a point to the right of a lower convex hull."""
    if hull and point[0] <= hull[-1][0]:
        return
    while len(hull) > 1 and _slope((hull[-2], hull[-1])) >= _slope((hull[-2], point)):
        del hull[-1]
    hull.append(point)


class Queue:
    """The line behind frames that hold each other up, and the mean of what delays them.

    A Kalman filter; its state is the line where it was looked at last in ns, the drift, and the
    logarithm of the mean delay in ns.

    """

    def __init__(self, prior: Prior) -> None:
        """Begin without frames."""
        self._state = np.array([0.0, prior.drift, 0.0])
        self._covariance = np.diag([0.0, prior.tolerance ** 2, 0.0])
        self._due = self._last = math.nan
        self._share_free = 1.0
        self._surprise = 0.5

    def add(self, due: Floats, late: Floats) -> Line | None:
        """Take a block of frames in their order; return the line, None while there is none."""
        first = due[0] + late[0] if math.isnan(self._last) else self._last
        arrived = np.maximum.accumulate(np.concatenate(([first], due + late)))
        self._last = float(arrived[-1])
        cluster = CLUSTER * (due[-1] - due[0]) / max(len(due) - 1, 1)
        ahead = arrived[:-1] + cluster - due
        steps = np.diff(arrived) - cluster
        free = steps[steps > 0]
        self._share_free = len(free) / len(steps)
        if math.isnan(self._due):
            if not len(free):
                return None
            self._begin(float(due[0]), ahead, free)
        self._predict(float(due.mean()))
        if len(free):
            self._learn_mean(free)
        self._learn_line(ahead - self._state[1] * (due - self._due), len(free))
        return Line(self._due, float(self._state[0]), float(self._state[1]),
                    math.sqrt(self._covariance[0, 0]), math.sqrt(self._covariance[1, 1]))

    def explains(self, depth: float) -> bool:
        """Whether frames are delayed like that, the least delay being `depth` in ns.

        Many are held up, but not so many that none is nearly free; and from block to block as many
        more or less as chance has it: polls have it more even, a busy host less.
        """
        return (self._share_free < MOST_FREE and depth < DEEPEST * math.exp(self._state[2])
                and EVEN < self._surprise < UNEVEN)

    def _begin(self, due: float, ahead: Floats, free: Floats) -> None:
        mean, least = float(free.mean()), float(ahead.min())
        chances = np.exp((least - ahead) / mean).sum()
        self._state[0] = least - mean * math.log(chances / len(free))
        self._state[2] = math.log(mean)
        self._covariance[0, 0], self._covariance[2, 2] = mean ** 2, 1.0
        self._due = due

    def _predict(self, due: float) -> None:
        step, self._due = due - self._due, due
        move = np.eye(3)
        move[0, 1] = step
        self._state = move @ self._state
        changes = np.array([0.0, DRIFT_CHANGE, MEAN_CHANGE]) ** 2 * abs(step) * 1e-9
        self._covariance = move @ self._covariance @ move.T + np.diag(changes)

    def _learn_mean(self, free: Floats) -> None:
        """Learn from how much later than the one before each free frame came."""
        mean = math.exp(self._state[2])
        found = np.minimum(free, OUTLIER * mean).mean() / (1 - math.exp(-OUTLIER))
        self._learn(np.array([0.0, 0.0, 1.0]), found / mean - 1, 1 / len(free))

    def _learn_line(self, ahead: Floats, free: int) -> None:
        """Learn from how many frames were free."""
        mean = math.exp(self._state[2])
        waits = np.maximum(ahead - self._state[0], 0.0) / mean
        chances = np.exp(-waits)
        expected = float(chances.sum())
        surprise = (free - expected) ** 2 / max(expected, 1.0)
        self._surprise += (surprise - self._surprise) / SURPRISES
        self._learn(np.array([expected / mean, 0.0, float(chances @ waits)]), free - expected,
                    max(expected, 1.0))

    def _learn(self, slope: Floats, surprise: float, variance: float) -> None:
        seen = self._covariance @ slope
        gain = seen / (slope @ seen + variance)
        self._state = self._state + gain * surprise
        self._covariance = self._covariance - np.outer(gain, seen)
