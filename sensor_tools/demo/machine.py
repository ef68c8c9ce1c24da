# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the machine did to the programs, so that no driver is blamed for that."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

NEAR = 1.0  # s before and after a moment whose lateness can show in its stamps …
NEAR_LOSS = 0.5  # … and whose waiting can show in what is missing
BUSY_LATENESS = 0.002  # s from which a machine excuses messages that are missing …
BUSY_WAIT = 0.4  # … and share of the time for which a program may wait, all its threads together


class Machine:
    """The notes of the heartbeat.

    Args:
        programs: Names of the programs that it watched.
        notes: One row per report: time in s since the epoch, lateness integrated over time in s²,
            and how long in s each program has waited. With none, the machine did nothing.
    """

    def __init__(self, programs: Sequence[str] = (), notes: Array | None = None) -> None:
        """Keep the notes."""
        self._programs = programs
        self._notes = np.empty((0, 2)) if notes is None else notes

    @classmethod
    def of_log(cls, path: Path, programs: Sequence[str]) -> Machine:
        """Read what the heartbeat has printed until now."""
        lines = path.read_text().splitlines(keepends=True)
        return cls.of_lines([line for line in lines if line.endswith("\n")], programs)

    @classmethod
    def of_lines(cls, lines: Iterable[str], programs: Sequence[str]) -> Machine:
        """Take lines that the heartbeat has printed."""
        notes = [line.split() for line in lines]
        return cls(programs, np.array(notes, float).reshape(-1, 2 + len(programs)))

    def lateness(self, times: Array) -> Array:
        """Return by how much in s a program that wanted to run was late on average.

        Single turns are some times as late.

        Args:
            times: Moments near which, in s since the epoch.
        """
        return self._growth(1, times, NEAR)

    def of(self, programs: Iterable[str]) -> Machine:
        """Return what the machine did to some programs."""
        chosen = [name for name in programs if name in self._programs]
        columns = [2 + self._programs.index(name) for name in chosen]
        return Machine(chosen, self._notes[:, [0, 1, *columns]])

    def is_busy(self, times: Array) -> npt.NDArray[np.bool_]:
        """Return whether near `times` a program did not get what it needs to be in time."""
        busy = self.lateness(times) > BUSY_LATENESS
        for column in range(2, self._notes.shape[1]):
            busy |= self._growth(column, times, NEAR_LOSS) > BUSY_WAIT
        return np.asarray(busy)

    def _growth(self, column: int, times: Array, near: float) -> Array:
        """Return by how much a column grows in a second, near `times`."""
        seconds = self._notes[:, 0]
        if seconds.size < 2:
            return np.zeros_like(times)
        first = np.clip(times - near, seconds[0], max(seconds[0], seconds[-1] - near))
        last = np.clip(times + near, np.minimum(first + near, seconds[-1]), seconds[-1])
        totals = self._notes[:, column]
        return np.asarray((np.interp(last, seconds, totals) - np.interp(first, seconds, totals))
                          / (last - first))
