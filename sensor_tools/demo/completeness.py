# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Whether as many messages came as were due, where the machine allowed it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sensor_tools.demo.machine import Array, Machine

WINDOW = 1.0  # s that are judged as a whole
ENOUGH = 0.9  # share of the messages that must come


@dataclass(frozen=True)
class Completeness:
    """How many messages came.

    Attributes:
        came: Messages in the windows that are judged.
        due: How many there should be in them.
        busy: Windows that are not judged, because the machine was busy.
        windows: All windows.
    """

    came: int
    due: float
    busy: int
    windows: int

    @property
    def suffices(self) -> bool:
        """Whether enough came."""
        return self.came + 1 >= ENOUGH * self.due


def count(stamps: Array, rate: float, start: float, end: float, machine: Machine) -> Completeness:
    """Count the messages of a topic.

    Args:
        stamps: Their times of measurement in s since the epoch.
        rate: How many a second are due.
        start: Time since the epoch from which they were recorded.
        end: The same until when.
        machine: What the machine did to the programs through which the messages went.
    """
    edges: Array = start + WINDOW * np.arange(int((end - start) / WINDOW) + 1, dtype=float)
    came, _ = np.histogram(stamps, edges) if edges.size > 1 else (np.zeros(0, int), edges)
    busy = machine.is_busy(edges[:-1] + WINDOW / 2)
    return Completeness(int(came[~busy].sum()), rate * WINDOW * int((~busy).sum()),
                        int(busy.sum()), busy.size)
