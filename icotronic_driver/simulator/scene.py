# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What simulated sensors measure: a vibration."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

SWEEP_TIME = 10.0  # s in which the sine sweeps up and down
SWEEP_FREQUENCIES = (20.0, 500.0)  # Hz
IMPACT_INTERVAL, IMPACT_FREQUENCY, IMPACT_DECAY = 2.0, 400.0, 0.01  # s, Hz, s

Times = npt.NDArray[np.float64]


def vibration(times: Times) -> npt.NDArray[np.float64]:
    """Return the truth: acceleration in x, y and z in g at times in s since the epoch.

    A sine that sweeps in x and, smaller and a quarter turn later, in y; an impact every two
    seconds in y and z; gravity in z.

    Args:
        times: Any number of times.

    Returns:
        Shape (times, 3).
    """
    low, high = SWEEP_FREQUENCIES
    turn = 2 * math.pi * (times % SWEEP_TIME) / SWEEP_TIME
    # The frequency goes from low to high and back like a cosine; this is its integral.
    phase = SWEEP_TIME * ((low + high) / 2 * turn - (high - low) / 2 * np.sin(turn))
    since = times % IMPACT_INTERVAL
    impact = np.exp(-since / IMPACT_DECAY) * np.sin(2 * math.pi * IMPACT_FREQUENCY * since)
    return np.column_stack((5.0 * np.sin(phase), 2.0 * np.cos(phase) + 30.0 * impact,
                            1.0 + 10.0 * impact))


def rest(times: Times) -> npt.NDArray[np.float64]:
    """Return the truth of a sensor that lies still: gravity in z; see `vibration`."""
    return np.tile([0.0, 0.0, 1.0], (len(times), 1))


Vibration = Callable[[Times], npt.NDArray[np.float64]]
