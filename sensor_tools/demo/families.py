"""What the demonstration shows: one row per sensor, and how its measurements meet the truth."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from icotronic_driver.simulator.scene import vibration
from icotronic_driver.simulator.sth import SENSOR_RANGE
from icotronic_driver.streaming import STANDARD_GRAVITY, Calibration
from icotronic_driver.values import AdcConfiguration
from isys_radar_driver.models import FAST, find_model
from isys_radar_driver.simulator.scene import scene_of
from msg_conversions.point_cloud import FIELD_NAMES
from sensor_tools.demo import picture
from sensor_tools.demo.comparison import Array, Comparison
from uc4000_driver.commands import STEP as ULTRASONIC_STEP
from uc4000_driver.simulator.scene import scene_of as filling_of
from uc4000_driver.telegram import FACTORY_ADDRESS

STH_RESOLUTION = Calibration.of_range(SENSOR_RANGE).slope * STANDARD_GRAVITY  # m/s²
TIMING = 0.010  # s by which a stamp may be off


@dataclass(frozen=True)
class Program:
    """`main` of a module with its arguments.

    "{directory}" in an argument stands for a directory that the programs of a demonstration share
    and that vanishes with them, "{port}" for a free TCP port, the same for a whole family.
    """

    module: str
    arguments: tuple[str, ...]


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
    compare: Callable[[Sequence[Any]], Comparison]
    panels: tuple[picture.Panel, ...]


def seconds_of(message: Any) -> float:
    """Return the time of measurement in s since the epoch."""
    return float(message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec)


RADAR = find_model("iSYS-4001")
RANGE_STEP, ANGLE_STEP = 0.01, math.radians(0.01)  # the coarser of its target lists


def compare_radar(messages: Sequence[Any]) -> Comparison:
    """Compare point clouds with the simulator's scene: each target with the nearest point."""
    scene = scene_of(RADAR)

    def truth(now: float) -> Array:
        return np.array([(target.range * math.cos(target.angle),
                          target.range * math.sin(target.angle)) for target in scene(now)])

    times = np.array([seconds_of(message) for message in messages])
    rows = []
    for now, message in zip(times, messages, strict=True):
        points = np.frombuffer(message.data, "<f4").reshape(-1, len(FIELD_NAMES))[:, :2]
        speeds = np.linalg.norm(truth(now + 1e-3) - truth(now - 1e-3), axis=1) / 2e-3
        for track, (place, speed) in enumerate(zip(truth(now), speeds, strict=True)):
            distances = np.linalg.norm(points - place, axis=1)
            x, y = points[distances.argmin()] if points.size else (math.nan, math.nan)
            resolution = RANGE_STEP + math.hypot(*place) * ANGLE_STEP
            rows.append((now, track, x, y, distances.min(initial=math.inf),
                         resolution + TIMING * speed))
    seconds, tracks, x, y, errors, tolerances = np.array(rows, float).T
    curve_times = np.linspace(times[0], times[-1], 2 * len(times))
    curve_places = np.array([truth(now) for now in curve_times])
    return Comparison(
        "range [m]", "position error [mm]", seconds=seconds - times[0], tracks=tracks.astype(int),
        names=[f"target {track + 1}" for track in range(curve_places.shape[1])],
        measured=np.hypot(x, y), errors=1e3 * errors, tolerances=1e3 * tolerances,
        places=np.stack((x, y), axis=1), curve_seconds=curve_times - times[0],
        curves=np.linalg.norm(curve_places, axis=2), curve_places=curve_places)


VIBRATION_TIMING = 0.0002  # s by which single samples may be off, beside a common delay


def compare_vibration(messages: Sequence[Any]) -> Comparison:
    """Compare accelerations in x with the simulator's vibration, but for a delay they share.

    The radio and the bus delay all samples alike, which nothing in the data can show; the delay
    is fitted, and must be smaller than `TIMING`.
    """
    def truth(times: Array) -> Array:
        return vibration(times)[:, 0] * STANDARD_GRAVITY

    times = np.array([seconds_of(message) for message in messages])
    measured = np.array([message.linear_acceleration.x for message in messages])
    part = slice(0, len(times), max(1, len(times) // 20000))
    delays = np.arange(-TIMING, TIMING, VIBRATION_TIMING / 4)
    delay = min(delays, key=lambda delay: float(np.mean(
        (truth(times[part] - delay) - measured[part]) ** 2)))
    true = truth(times - delay)
    step = VIBRATION_TIMING / 2
    slopes = np.abs(truth(times - delay + step) - truth(times - delay - step)) / (2 * step)
    seconds = times - times[0]
    even = np.linspace(0.0, seconds[-1], len(seconds))
    return Comparison(
        "acceleration [m/s²]", "acceleration error [m/s²]", seconds=seconds,
        tracks=np.zeros(len(times), np.int64), names=["x"], measured=measured,
        errors=np.abs(measured - true),
        tolerances=2 * STH_RESOLUTION + slopes * VIBRATION_TIMING,
        curve_seconds=even, curves=truth(even + times[0] - delay)[:, np.newaxis],
        remark=f"common delay {1e3 * delay:.2g} ms")


FILL_LEVEL_RATE = 10.0  # Hz


def compare_fill_level(messages: Sequence[Any]) -> Comparison:
    """Compare ranges with the simulator's container; too close to measure is -inf (REP-117)."""
    truth = np.vectorize(filling_of(FACTORY_ADDRESS), otypes=[float])
    times = np.array([seconds_of(message) for message in messages])
    measured = np.array([message.range for message in messages])
    true = truth(times)
    speeds = np.abs(truth(times + 1e-3) - truth(times - 1e-3)) / 2e-3
    tolerances = ULTRASONIC_STEP + TIMING * speeds
    too_close = measured == -math.inf
    hidden = too_close & (true < messages[0].min_range + tolerances)
    errors = np.where(hidden, 0.0, np.abs(np.where(too_close, math.inf, measured) - true))
    even = np.linspace(times[0], times[-1], 2 * len(times))
    return Comparison(
        "range [m]", "range error [mm]", seconds=times - times[0],
        tracks=np.zeros(len(times), np.int64), names=["fill level"],
        measured=np.where(np.isfinite(measured), measured, math.nan), errors=1e3 * errors,
        tolerances=1e3 * tolerances, curve_seconds=even - times[0],
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
