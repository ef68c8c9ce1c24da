# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Draws what the layouts for RViz, Foxglove and PlotJuggler show, from a bag of the demonstration.

    ./dev demo --bag my_bag && ./dev run python -m sensor_tools.demo.views my_bag docs/images

These are drawings with matplotlib, not screenshots.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Imu, PointCloud2, Range

from msg_conversions.point_cloud import FIELD_NAMES
from sensor_tools.bags import Record, read_bag

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIZE, RESOLUTION = (8.0, 5.0), 80  # inches, dots an inch
DECAY = 2.0  # s for which RViz shows a cloud
SHOWN = 0.25  # s of a vibration
FASTEST = 10.0  # m/s, as in the layouts


def draw_clouds(axes: Axes, clouds: Sequence[Any]) -> None:
    """Draw the last clouds from above, coloured by radial velocity: forward is up, left is left."""
    last = _seconds(clouds[-1])
    points = np.concatenate([np.frombuffer(cloud.data, "<f4").reshape(-1, len(FIELD_NAMES))
                             for cloud in clouds if _seconds(cloud) > last - DECAY])
    x, y, velocity = (points[:, FIELD_NAMES.index(name)] for name in ("x", "y", "radial_velocity"))
    drawn = axes.scatter(y, x, c=velocity, cmap="turbo", vmin=-FASTEST, vmax=FASTEST, s=20)
    axes.figure.colorbar(drawn, label="radial velocity [m/s]")
    axes.plot(0, 0, marker="^", color="black", markersize=10)
    axes.invert_xaxis()
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(title=f"/isys_radar/points, {DECAY:g} s, seen from above", xlabel="y, to the left [m]",
             ylabel="x, forward [m]")


def draw_cones(axes: Axes, ranges: Sequence[Any]) -> None:
    """Draw the cones of some measurements one beside the other, where there is an echo."""
    for place, message in enumerate(ranges[::max(1, len(ranges) // 8)][:8]):
        if message.min_range <= message.range <= message.max_range:
            half = message.range * math.tan(message.field_of_view / 2)
            axes.fill([place, place - half, place + half], [0, message.range, message.range],
                      color="#e69f00", alpha=0.5)
    axes.axhline(ranges[0].min_range, color="black", linewidth=0.8, linestyle=":")
    axes.axhline(ranges[0].max_range, color="black", linewidth=0.8, linestyle=":")
    axes.set(title="/uc4000/range, as cones, one beside the other; dotted: the limits",
             xlabel="measurement (each cone in m)", ylabel="x, along the sound [m]")


def draw_accelerations(axes: Axes, samples: Sequence[Any]) -> None:
    """Draw the first accelerations over time."""
    times = np.array([_seconds(imu) for imu in samples]) - _seconds(samples[0])
    count = int(np.searchsorted(times, SHOWN))
    for axis, colour in zip("xyz", ("#0072b2", "#d55e00", "#009e73"), strict=True):
        axes.plot(times[:count], [getattr(imu.linear_acceleration, axis)
                                  for imu in samples[:count]], color=colour, label=axis)
    axes.legend(loc="upper right")
    axes.set(title="/icotronic/imu/data_raw; y and z are not measured", xlabel="time [s]",
             ylabel="linear_acceleration [m/s²]")


VIEWS = {"/isys_radar/points": (PointCloud2, draw_clouds), "/uc4000/range": (Range, draw_cones),
         "/icotronic/imu/data_raw": (Imu, draw_accelerations)}


def _seconds(message: Any) -> float:
    return float(message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec)


def draw(records: Sequence[Record], directory: Path) -> list[Path]:
    """Draw a picture for each topic that there is a view of, and return the files."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    files = []
    for topic, (kind, view) in VIEWS.items():
        messages = [deserialize_message(record.data, kind) for record in records
                    if record.topic == topic]
        if messages:
            figure, axes = pyplot.subplots(figsize=SIZE, layout="constrained")
            axes.grid(alpha=0.3)
            view(axes, messages)
            files.append(directory / f"{topic.split('/')[1]}.png")
            figure.savefig(files[-1], dpi=RESOLUTION)
            pyplot.close(figure)
    return files


def main(args: Sequence[str] | None = None) -> None:
    """Draw the pictures."""
    parser = argparse.ArgumentParser(prog="views", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("bag", type=Path, help="a bag of the demonstration")
    parser.add_argument("directory", type=Path, help="where to save the pictures")
    options = parser.parse_args(args)
    options.directory.mkdir(parents=True, exist_ok=True)
    for file in draw(list(read_bag(options.bag)), options.directory):
        print(file)


if __name__ == "__main__":
    main()
