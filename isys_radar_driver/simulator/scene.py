# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What simulated radars see: the truth of their targets."""

from __future__ import annotations

import math
from collections.abc import Callable

from isys_radar_driver.models import Model
from isys_radar_driver.targets import Target

Scene = Callable[[float], list[Target]]


def scene_of(model: Model, count: int = 3) -> Scene:
    """Return the truth: the targets in front of a model at a time in s since the epoch.

    Velocities are positive when approaching and angles positive to the left, as on the wire.
    Ranges and velocities stay within what the model can report.

    Args:
        model: The model.
        count: Number of targets, as far as the model has so many.
    """
    span = model.range_max or 40.0
    count = min(count, max(model.max_targets.values()))

    def scene(now: float) -> list[Target]:
        targets = []
        for index in range(count):
            centre, amplitude = span * (0.25 + 0.6 * index / count), span * 0.05
            period = 8.0 + 3.0 * (index % 10)
            phase = 2 * math.pi * now / period + index
            distance = centre + amplitude * math.sin(phase)
            speed = amplitude * math.cos(phase) * 2 * math.pi / period
            angle = math.radians(20.0) * math.sin(2 * math.pi * now / (3.0 + period) + index)
            signal = 60.0 - 30.0 * index / count - 5.0 * math.log10(max(distance, 0.1))
            targets.append(Target(
                signal, -speed if model.velocity_max else 0.0,
                distance if model.range_max else 0.0,
                angle if model.name.startswith("iSYS-4") else 0.0))
        return targets

    return scene
