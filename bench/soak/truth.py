# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Whether what a driver published is true: measured values beside the simulators' scenes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import PointCloud2, Range

from isys_radar_driver.simulator.scene import scene_of
from msg_conversions.point_cloud import FIELD_NAMES
from sensor_tools.demo.families import (
    ANGLE_STEP,
    RADAR,
    RANGE_STEP,
    compare_accelerations,
    seconds_of,
)
from sensor_tools.demo.machine import Array, Machine
from uc4000_driver.commands import STEP as ULTRASONIC_STEP
from uc4000_driver.simulator.scene import scene_of as filling_of
from uc4000_driver.telegram import FACTORY_ADDRESS

EARLY, LATE = 0.1, 0.4  # s by which stamps may be off: time-outs, and pauses of a busy host
SHIFT = 0.05  # s between the moments at which a value may have been true
VELOCITY_STEP = 0.1  # m/s; the coarser of its target lists
SPEED_OF_SOUND_ERROR = 0.003  # share of a distance, where the sensor does not correct it
TOO_BUSY = 0.1  # share of the samples of some seconds that come while the machine is busy
ACCELERATION = slice(-96, -88)  # where a serialised Imu has the acceleration in x



class Wrong(NamedTuple):
    """Wrong values: how many, when the first one came in s since the epoch, and what it was."""

    values: int
    time: float
    example: str


Judge = Callable[[Sequence[bytes], Machine, float], Wrong | None]


def _moments(stamp: float, lag: float) -> Array:
    """Return the times at which a value may have been true."""
    late = LATE + lag
    return stamp + np.linspace(-late, EARLY, round((late + EARLY) / SHIFT) + 1)


def judge_clouds(messages: Sequence[bytes], machine: Machine, lag: float) -> Wrong | None:
    """Compare each point with the targets: its place and its velocity.

    Args:
        messages: Serialised point clouds.
        machine: What the machine did to the programs.
        lag: Time in s by which the data came late, without a sign of that.
    """
    scene = scene_of(RADAR)

    def truth(now: float) -> Array:
        return np.array([(target.range * math.cos(target.angle),
                          target.range * math.sin(target.angle), -target.velocity)
                         for target in scene(now)])

    found: list[Wrong] = []
    for data in messages:
        message = deserialize_message(data, PointCloud2)
        points = np.frombuffer(message.data, "<f4").reshape(-1, len(FIELD_NAMES))
        measured = points[:, [*map(FIELD_NAMES.index, ("x", "y", "radial_velocity"))]]
        true = np.array([truth(now) for now in _moments(seconds_of(message), lag)])
        change = np.abs(np.diff(true, axis=0)).max(axis=(0, 1))
        place = RANGE_STEP + np.linalg.norm(true[0, :, :2], axis=1).max() * ANGLE_STEP
        allowed = change + np.array((place, place, VELOCITY_STEP))
        fits = np.abs(measured[:, np.newaxis] - true.reshape(-1, 3)) <= allowed
        false = ~fits.all(axis=2).any(axis=1)
        if false.any():
            now = seconds_of(message)
            found.append(Wrong(int(false.sum()), now, f"{measured[false][0].tolist()} is none of "
                                                      f"{truth(now).round(3).tolist()}"))
    return _all_of(found)


def judge_ranges(messages: Sequence[bytes], machine: Machine, lag: float) -> Wrong | None:
    """Compare each distance with the container, as `judge_clouds`; infinity is no distance."""
    truth = filling_of(FACTORY_ADDRESS)
    found: list[Wrong] = []
    for data in messages:
        message = deserialize_message(data, Range)
        if not math.isfinite(message.range):
            continue
        true = [truth(now) or math.inf for now in _moments(seconds_of(message), lag)]
        step = ULTRASONIC_STEP + SPEED_OF_SOUND_ERROR * message.range
        if not min(true) - step <= message.range <= max(true) + step:
            now = seconds_of(message)
            found.append(Wrong(1, now, f"{message.range} m instead of {truth(now)} m"))
    return _all_of(found)


def _all_of(found: Sequence[Wrong]) -> Wrong | None:
    if not found:
        return None
    return Wrong(sum(one.values for one in found), found[0].time, found[0].example)


def judge_accelerations(messages: Sequence[bytes], machine: Machine,
                        lag: float) -> Wrong | None:
    """Compare accelerations with the vibration, as the demonstration does; there is no lag.

    A machine that is too busy for the demonstration's stamps says nothing about them.
    """
    rows = np.frombuffer(b"".join(messages), np.uint8).reshape(len(messages), -1)
    measured = np.ascontiguousarray(rows[:, ACCELERATION]).view("<f8").ravel()
    stamps = np.ascontiguousarray(rows[:, 4:12]).view("<u4")
    times = stamps[:, 0] + 1e-9 * stamps[:, 1]
    comparison = compare_accelerations(times, measured, machine)
    false = comparison.errors > comparison.tolerances
    if comparison.agrees or np.mean(comparison.busy) > TOO_BUSY:
        return None
    first = times[false.argmax()] if false.any() else times[0]
    return Wrong(int(np.count_nonzero(false)), float(first), str(comparison))
