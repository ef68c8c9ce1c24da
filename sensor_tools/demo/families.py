# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the demonstration shows: one row per sensor, and how its measurements meet the truth."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from icotronic_driver.laws import PARTS_BY_NUMBER, STANDARD_GRAVITY, USUAL_REFERENCE
from icotronic_driver.simulator.scene import vibration
from icotronic_driver.values import AdcConfiguration
from isys_radar_driver.models import FAST, find_model
from isys_radar_driver.simulator.scene import scene_of
from msg_conversions.point_cloud import FIELD_NAMES
from sensor_tools.demo import picture
from sensor_tools.demo.comparison import Comparison
from sensor_tools.demo.machine import Array, Machine
from sensor_tools.demo.processes import Program
from uc4000_driver.commands import STEP as ULTRASONIC_STEP
from uc4000_driver.simulator.scene import scene_of as filling_of
from uc4000_driver.telegram import FACTORY_ADDRESS

STH_RESOLUTION, _ = PARTS_BY_NUMBER[1].law.factors(USUAL_REFERENCE)  # m/s²
TIMING = 0.010  # s by which a stamp may be off
COMMON_DELAY = 0.003  # s by which all stamps of a topic may be late
LATEST = 3.0  # 95 % of the turns of a busy machine are not later than so many times the mean


@dataclass(frozen=True)
class Topic:
    """A topic to record: its message type, and the expected messages per second."""

    name: str
    kind: str
    rate: float


@dataclass(frozen=True)
class Family:
    """One sensor of the demonstration.

    Attributes:
        name: What people call it.
        simulator: Stands in for the hardware.
        node: The driver.
        topics: What the driver publishes; the first one is compared with the truth and drawn.
        compare: Turns the messages of the first topic into a comparison.
        panels: What is drawn of it, from left to right.
    """

    name: str
    simulator: Program
    node: Program
    topics: tuple[Topic, ...]
    compare: Callable[[Sequence[Any], Machine], Comparison]
    panels: tuple[picture.Panel, ...]


def seconds_of(message: Any) -> float:
    """Return the time of measurement in s since the epoch."""
    return float(message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec)


RADAR = find_model("iSYS-4001")
RANGE_STEP, ANGLE_STEP = 0.01, math.radians(0.01)  # the coarser of its target lists


def common_delay(errors: Array, speeds: Array) -> float:
    """Return the delay in s of the stamps that explains position errors best, whatever the others.

    Args:
        errors: What was measured minus the truth at the stamps, shape (values, coordinates).
        speeds: The derivatives of the truth.
    """
    if not errors.size:
        return 0.0
    weights = np.sum(speeds ** 2, axis=1)
    delays = -np.sum(errors * speeds, axis=1) / np.maximum(weights, 1e-12)
    order = np.argsort(delays)
    sums = np.cumsum(weights[order])
    return float(delays[order][np.searchsorted(sums, sums[-1] / 2)])


def compare_radar(messages: Sequence[Any], machine: Machine) -> Comparison:
    """Compare point clouds with the simulator's scene: each target with the nearest point."""
    scene = scene_of(RADAR)

    def truth(now: float) -> Array:
        return np.array([(target.range * math.cos(target.angle),
                          target.range * math.sin(target.angle)) for target in scene(now)])

    times = np.array([seconds_of(message) for message in messages])
    places = np.array([truth(now) for now in times])  # shape (messages, targets, 2)
    speeds = np.array([truth(now + 1e-3) - truth(now - 1e-3) for now in times]) / 2e-3
    measured = np.array([_nearest(message, there)
                         for message, there in zip(messages, places, strict=True)])
    late = TIMING + LATEST * machine.lateness(times)
    tolerances = (RANGE_STEP + np.linalg.norm(places, axis=2) * ANGLE_STEP
                  + late[:, np.newaxis] * np.linalg.norm(speeds, axis=2))
    errors = np.nan_to_num(np.linalg.norm(measured - places, axis=2), nan=math.inf)
    there = np.isfinite(errors)
    targets = places.shape[1]
    curve_times = np.linspace(times[0], times[-1], 2 * len(times))
    curve_places = np.array([truth(now) for now in curve_times])
    return Comparison(
        "range [m]", "position error [mm]", seconds=np.repeat(times - times[0], targets),
        tracks=np.tile(np.arange(targets), len(times)),
        names=[f"target {track + 1}" for track in range(targets)],
        measured=np.linalg.norm(measured, axis=2).ravel(), errors=1e3 * errors.ravel(),
        tolerances=1e3 * tolerances.ravel(), busy=np.repeat(machine.is_busy(times), targets),
        places=measured.reshape(-1, 2),
        curve_seconds=curve_times - times[0], curves=np.linalg.norm(curve_places, axis=2),
        curve_places=curve_places, delay=common_delay((measured - places)[there], speeds[there]),
        delay_limit=COMMON_DELAY + float(np.median(machine.lateness(times))))


def _nearest(message: Any, places: Array) -> Array:
    """Return the point of a cloud that is nearest to each place, NaN where there is none."""
    points = np.frombuffer(message.data, "<f4").reshape(-1, len(FIELD_NAMES))[:, :2]
    if not points.size:
        return np.full_like(places, math.nan)
    distances = np.linalg.norm(points - places[:, np.newaxis], axis=2)
    return points[distances.argmin(axis=1)].astype(float)


VIBRATION_TIMING = 0.0002  # s by which single samples may be off, beside a common delay …
SETTLING, SETTLING_TIMING = 3.0, 0.0005  # … and in the first seconds so much more
DELAY_STEP, GRID = VIBRATION_TIMING / 4, 1_000_000  # s, and how many of them at most
PIECE = 1000  # samples that are shifted together
CLOCK_LATEST = 10.0  # as LATEST: a clock suffers from the worst turns of its last seconds


def vibration_in_x(times: Array) -> Array:
    """Return the truth in m/s² at times in s since the epoch."""
    return vibration(times)[:, 0] * STANDARD_GRAVITY


def compare_vibration(messages: Sequence[Any], machine: Machine) -> Comparison:
    """Compare the accelerations in x of messages with the simulator's vibration."""
    times = np.array([seconds_of(message) for message in messages])
    return compare_accelerations(
        times, np.array([message.linear_acceleration.x for message in messages]), machine)


def compare_accelerations(times: Array, measured: Array, machine: Machine) -> Comparison:
    """Compare accelerations in x with the simulator's vibration, but for a delay they share.

    The radio and the bus delay all samples alike, which nothing in the data can show; the delay
    is fitted. Where the stamps cannot be that good, because the stream has just begun or the
    machine was late, pieces of the stream may be shifted; their values must fit as well.
    """
    late = machine.lateness(times)
    part = slice(0, len(times), max(1, len(times) // 5000))
    delay = best_delay(times[part], measured[part], TIMING)
    delays = np.full_like(times, delay)
    reach = np.minimum(CLOCK_LATEST * late, TIMING)
    reach[times < times[0] + SETTLING] += SETTLING_TIMING
    gaps = np.flatnonzero(np.abs(np.diff(times) * AdcConfiguration().sample_rate - 1.0) > 0.1) + 1
    for piece in np.split(np.arange(len(times)), np.union1d(gaps, np.arange(0, len(times), PIECE))):
        if piece.size:
            delays[piece] += best_delay(times[piece] - delay, measured[piece], reach[piece].max())
    true_times = times - delays
    true = vibration_in_x(true_times)
    step = VIBRATION_TIMING / 2
    slopes = np.abs(vibration_in_x(true_times + step) - vibration_in_x(true_times - step))
    even = np.linspace(0.0, times[-1] - times[0], len(times))
    return Comparison(
        "acceleration [m/s²]", "acceleration error [m/s²]", seconds=times - times[0],
        tracks=np.zeros(len(times), np.int64), names=["x"], measured=measured,
        errors=np.abs(measured - true), tolerances=2 * STH_RESOLUTION + slopes,
        busy=machine.is_busy(times),
        curve_seconds=even, curves=vibration_in_x(even + times[0] - delay)[:, np.newaxis],
        delay=delay, delay_limit=COMMON_DELAY + float(np.median(late)))


def best_delay(times: Array, measured: Array, reach: float) -> float:
    """Return the delay in s, at most `reach`, with which stamps fit the vibration best."""
    steps = math.ceil(reach / DELAY_STEP)
    places = np.clip(np.round((times - times[0]) / DELAY_STEP), 0, GRID).astype(int)
    grid = vibration_in_x(
        times[0] + np.arange(-steps, places.max() + steps + 1) * DELAY_STEP)
    shifted = grid[places[:, np.newaxis] + np.arange(2 * steps + 1)]
    misfits = np.mean((shifted - measured[:, np.newaxis]) ** 2, axis=0)
    return float(steps - np.argmin(misfits)) * DELAY_STEP


FILL_LEVEL_RATE = 10.0  # Hz


def compare_fill_level(messages: Sequence[Any], machine: Machine) -> Comparison:
    """Compare ranges with the simulator's container; too close to measure is -inf (REP-117)."""
    truth = np.vectorize(filling_of(FACTORY_ADDRESS), otypes=[float])
    times = np.array([seconds_of(message) for message in messages])
    measured = np.array([message.range for message in messages])
    true = truth(times)
    speeds = np.abs(truth(times + 1e-3) - truth(times - 1e-3)) / 2e-3
    tolerances = ULTRASONIC_STEP + (TIMING + LATEST * machine.lateness(times)) * speeds
    too_close = measured == -math.inf
    hidden = too_close & (true < messages[0].min_range + tolerances)
    errors = np.where(hidden, 0.0, np.abs(np.where(too_close, math.inf, measured) - true))
    even = np.linspace(times[0], times[-1], 2 * len(times))
    return Comparison(
        "range [m]", "range error [mm]", seconds=times - times[0],
        tracks=np.zeros(len(times), np.int64), names=["fill level"],
        measured=np.where(np.isfinite(measured), measured, math.nan), errors=1e3 * errors,
        tolerances=1e3 * tolerances, busy=machine.is_busy(times), curve_seconds=even - times[0],
        curves=truth(even)[:, np.newaxis],
        remark=f"{np.count_nonzero(too_close)} in the blind zone" if too_close.any() else "")


FAMILIES = (
    Family(
        f"{RADAR.name} radar",
        Program("sensor_tools.simulate",
                ("isys", "--model", RADAR.name, "--link", "{directory}/radar")),
        Program("isys_radar_driver.node",
                ("--ros-args", "-p", "serial_port:={directory}/radar")),
        (Topic("/isys_radar/points", "sensor_msgs/msg/PointCloud2",
               1 / RADAR.cycle_time(FAST)),),
        compare_radar,
        (picture.top_view, picture.over_time, picture.errors_over_time)),
    Family(
        "ICOtronic accelerometer",
        Program("sensor_tools.simulate", ("icotronic", "--listen", "127.0.0.1:{port}")),
        Program("icotronic_driver.node",
                ("--ros-args", "-p", "can_interface:=socketcand", "-p",
                 'can_options:=["host=127.0.0.1", "port={port}"]')),
        (Topic("/icotronic/imu/data_raw", "sensor_msgs/msg/Imu", AdcConfiguration().sample_rate),),
        compare_vibration,
        (picture.waveform, picture.spectrum, picture.error_shares)),
    Family(
        "UC4000 ultrasonic sensor",
        Program("sensor_tools.simulate", ("uc4000", "--link", "{directory}/ultrasonic")),
        Program("uc4000_driver.node",
                ("--ros-args", "-p", "serial_port:={directory}/ultrasonic", "-p",
                 f"rate:={FILL_LEVEL_RATE}")),
        (Topic("/uc4000/range", "sensor_msgs/msg/Range", FILL_LEVEL_RATE),),
        compare_fill_level,
        (picture.over_time, picture.errors_over_time)),
)
