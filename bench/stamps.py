# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Error of the stamps against that of the arrivals, in trials whose truth is known.

They take no real time: neither the machine nor other programs matter.
"""

from __future__ import annotations

import importlib
import sys
from typing import Any

import numpy as np

from bench.measure import ROOT, Cost, Row

AIM = 0.1  # a tenth of the error of who stamps on arrival
FROM = 3.0  # s after the start
SHARE = 0.99  # of the frames
DRIFTS = (0.0, 200e-6, -200e-6)


def compare(seconds: float) -> list[Row]:
    """Return a row per kind of delay, from trials of so many s."""
    sys.path.append(str(ROOT / "test" / "common"))
    trials: Any = importlib.import_module("arrival_trials")
    return [_row(trials, name, delays, seconds) for name, delays in (
        ("jitter of 2 ms", trials.independent(2.0)), ("polls of 16 ms", trials.poll(16.0)))]


def _row(trials: Any, name: str, delays: Any, seconds: float) -> Row:
    ours, other = [], []
    for drift in DRIFTS:
        trial = trials.run(delays, drift, seconds)
        sent = trial.seconds * 1e9 + trials.PATH
        late = (delays(sent, np.random.default_rng(0)) - sent)[trial.seconds >= FROM] * 1e-6
        ours.append(Cost(trial.error(FROM), len(late)))
        other.append(Cost(float(np.quantile(np.abs(late - np.median(late)), SHARE)), len(late)))
    return Row.compare(f"error of stamps, {name}", "ms", AIM, ours, other)
