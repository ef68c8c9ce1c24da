# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What came of a driver: when its data were measured, what its diagnostics and its log said."""

from __future__ import annotations

import math
import re
import time
from bisect import bisect_left
from collections import deque
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

LEVELS = ("OK", "WARN", "ERROR", "STALE")
KEPT = 60.0  # s of stamps; longer than a fault
WHOLE, ENOUGH = 1.0, 0.5  # s in which this share of the usual data must come, to be well again
OUTAGE = 0.5  # s without data
FIGURE = r"[0-9.]+"


class Status(NamedTuple):
    """A status of a sensor: when it was said in s since the epoch, and what."""

    time: float
    level: int
    message: str
    values: Mapping[str, str]


class Line(NamedTuple):
    """A line of a log."""

    time: float
    text: str


class Watch:
    """What came of one driver. All times are in s since the epoch.

    Attributes:
        rate: Data per s that it should publish.
        statuses: The last ones of its sensor.
        log: The last lines of its log.
        values: The newest values of each key of the diagnostics.
        received: How many data came.
        published: How many were published, by the driver's own counter.
    """

    def __init__(self, rate: float, published: str) -> None:
        """Nothing came yet; `published` is the counter that tells what is published."""
        self.rate = rate
        self._key = published
        self.published = 0.0
        self.statuses: deque[Status] = deque(maxlen=600)
        self.log: deque[Line] = deque(maxlen=1000)
        self.values: dict[str, str] = {}
        self.received = 0
        self._stamps: list[float] = []

    def add_stamps(self, stamps: Sequence[float]) -> None:
        """Take the stamps of data."""
        self.received += len(stamps)
        self._stamps += stamps
        if len(self._stamps) > 2 * KEPT * self.rate:
            del self._stamps[:-int(KEPT * self.rate)]

    def add_status(self, status: Status) -> None:
        """Take a status."""
        self.statuses.append(status)
        if self._key in status.values:
            before = {self._key: self.values.get(self._key, "0")}
            self.values[self._key] = status.values[self._key]
            self.published += self.grown(self._key, before)
        self.values.update(status.values)

    @property
    def newest(self) -> float:
        """The newest stamp."""
        return self._stamps[-1] if self._stamps else -math.inf

    def level(self) -> int:
        """Return the newest level of the diagnostics, and that of silence if there is none."""
        fresh = self.statuses and self.statuses[-1].time > time.time() - 3.0
        return self.statuses[-1].level if fresh else LEVELS.index("STALE")

    def came(self, begin: float, end: float) -> int:
        """Return how many data were measured in a time."""
        return len(self._between(begin, end))

    def outages(self, begin: float, end: float) -> float:
        """Return for how long in s no data were measured in a time, short gaps left out."""
        edges = [begin, *self._between(begin, end), end]
        gaps = (after - before for before, after in pairwise(edges))
        return sum(gap for gap in gaps if gap > OUTAGE)

    def whole_since(self, moment: float) -> float | None:
        """Return from when on, after a moment, data were measured as usual; None: not yet."""
        stamps = self._between(moment, math.inf)
        count = max(2, math.ceil(ENOUGH * WHOLE * self.rate))
        for first, last in zip(stamps, stamps[count - 1:], strict=False):
            if last - first <= WHOLE:
                return first
        return None

    def _between(self, begin: float, end: float) -> list[float]:
        return self._stamps[bisect_left(self._stamps, begin):bisect_left(self._stamps, end)]

    # --- what it told ---

    def said(self, since: float) -> list[str]:
        """Return the different levels and messages of the statuses since a moment, in order."""
        return list(dict.fromkeys(
            f"{LEVELS[status.level]} {re.sub(FIGURE, '…', status.message)}"
            for status in self.statuses if status.time >= since))

    def grown(self, key: str, before: Mapping[str, str]) -> float:
        """Return by how much a counter of the diagnostics has grown; they begin anew at 0."""
        now, then = (float(values.get(key, 0)) for values in (self.values, before))
        return now - then if now >= then else now

    def noticed(self, notice: str, since: float, before: Mapping[str, str]) -> float | None:
        """Return when a notice came after a moment, None if it did not; see faults.py."""
        if notice.startswith("+"):
            return time.time() if self.grown(notice[1:], before) else None
        kind, _, text = notice.partition(" ")
        if kind == "log":
            times = [line.time for line in self.log
                     if line.time >= since and re.search(text, line.text)]
        else:
            times = [status.time for status in self.statuses if status.time >= since
                     and status.level >= LEVELS.index(kind) and re.search(text, status.message)]
        return min(times, default=None)
