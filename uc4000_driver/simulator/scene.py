# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What simulated sensors see: containers that are filled and emptied."""

from __future__ import annotations

import functools
from collections.abc import Callable

Scene = Callable[[float], float | None]

FILLING_TIME, EMPTYING_TIME = 54.0, 6.0  # s
EMPTY, FULL = 3.8, 0.1  # m from the sensor to the contents


def filling(now: float, phase: float = 0.0) -> float:
    """Return the distance in m to what is in a container that is filled and emptied in turn.

    Args:
        now: Time in s since the epoch.
        phase: Lead in s.
    """
    seconds = (now + phase) % (FILLING_TIME + EMPTYING_TIME)
    if seconds < FILLING_TIME:
        return EMPTY + (FULL - EMPTY) * seconds / FILLING_TIME
    return FULL + (EMPTY - FULL) * (seconds - FILLING_TIME) / EMPTYING_TIME


def scene_of(address: int) -> Scene:
    """Return the truth for the sensor with an address: each has a container of its own."""
    return functools.partial(filling, phase=7.0 * address)
