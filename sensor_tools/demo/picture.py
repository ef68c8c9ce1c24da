# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The picture of the demonstration: what was measured, beside the truth."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from sensor_tools.demo.comparison import Comparison

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Panel: TypeAlias = Callable[["Axes", Comparison], None]

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
TRUTH: dict[str, Any] = {"color": "black", "linewidth": 1.0, "alpha": 0.6, "zorder": 1}
DOTS: dict[str, Any] = {"s": 16, "linewidths": 0, "alpha": 0.6, "zorder": 2}
WAVEFORM_TIME = 0.06  # s
ROW_SIZE = (16.0, 5.4)  # inches


def draw(rows: Sequence[tuple[str, Sequence[Panel], Comparison]], path: Path) -> None:
    """Draw one row of panels per comparison.

    Args:
        rows: Title, panels and comparison of each.
        path: Where to save the picture; its suffix says in which format.
    """
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    figure = pyplot.figure(figsize=(ROW_SIZE[0], ROW_SIZE[1] * len(rows)), layout="constrained")
    bands = figure.subfigures(len(rows), 1, squeeze=False)[:, 0]
    for band, (title, panels, comparison) in zip(bands, rows, strict=True):
        band.suptitle(title, fontsize="x-large", fontweight="bold")
        for axes, panel in zip(band.subplots(1, len(panels), squeeze=False)[0], panels,
                               strict=True):
            axes.grid(alpha=0.3)
            axes.spines[["top", "right"]].set_visible(False)
            panel(axes, comparison)
    figure.savefig(path, dpi=100)
    pyplot.close(figure)


def top_view(axes: Axes, comparison: Comparison) -> None:
    """Draw positions as seen from above: forward is up, left is left."""
    axes.set_title("Seen from above")
    for track, colour in _tracks(comparison):
        chosen = comparison.tracks == track
        x, y = comparison.places[chosen].T
        axes.plot(comparison.curve_places[:, track, 1], comparison.curve_places[:, track, 0],
                  **TRUTH)
        axes.scatter(y, x, color=colour, **DOTS)
    axes.plot(0, 0, marker="^", color="black", markersize=10)
    axes.annotate("sensor", (0, 0), xytext=(10, -4), textcoords="offset points")
    axes.set_aspect("equal", adjustable="datalim")
    axes.invert_xaxis()
    axes.set_xlabel("y, to the left [m]")
    axes.set_ylabel("x, forward [m]")


def over_time(axes: Axes, comparison: Comparison) -> None:
    """Draw the measured values over time, on the curves of the truth."""
    axes.set_title("Measured, on the truth")
    for track, colour in _tracks(comparison):
        chosen = comparison.tracks == track
        axes.plot(comparison.curve_seconds, comparison.curves[:, track],
                  label="truth" if track == 0 else None, **TRUTH)
        axes.scatter(comparison.seconds[chosen], comparison.measured[chosen], color=colour,
                     label=comparison.names[track], **DOTS)
    axes.set_xlabel("time [s]")
    axes.set_ylabel(comparison.quantity)
    axes.margins(y=0.15)
    axes.legend(loc="upper center", ncols=1 + len(comparison.names), frameon=False,
                columnspacing=1.0, handletextpad=0.4)


def errors_over_time(axes: Axes, comparison: Comparison) -> None:
    """Draw the distances from the truth over time, and which ones are allowed."""
    axes.set_title("Distance from the truth; lines: allowed")
    for track, colour in _tracks(comparison):
        chosen = comparison.tracks == track
        seconds = comparison.seconds[chosen]
        axes.scatter(seconds, comparison.errors[chosen], color=colour, **DOTS)
        axes.plot(seconds, comparison.tolerances[chosen], color=colour, linewidth=1.2)
    axes.set_yscale("log" if (comparison.errors > 0).any() else "linear")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.set_xlabel("time [s]")
    axes.set_ylabel(comparison.error_name)


def waveform(axes: Axes, comparison: Comparison) -> None:
    """Draw the first moments of a fast signal, sample by sample."""
    axes.set_title("Every sample, on the truth")
    curve, dots = (times < WAVEFORM_TIME for times in (comparison.curve_seconds,
                                                       comparison.seconds))
    axes.plot(1e3 * comparison.curve_seconds[curve], comparison.curves[curve, 0], label="truth",
              **TRUTH)
    axes.scatter(1e3 * comparison.seconds[dots], comparison.measured[dots], color=COLOURS[0],
                 label=comparison.names[0], **DOTS)
    axes.set_xlabel("time [ms]")
    axes.set_ylabel(comparison.quantity)
    axes.margins(y=0.15)
    axes.legend(loc="upper center", ncols=2, frameon=False)


def spectrum(axes: Axes, comparison: Comparison) -> None:
    """Draw the power spectral density of a fast signal and of the truth."""
    axes.set_title("Spectrum")
    rate = (len(comparison.seconds) - 1) / comparison.seconds[-1]
    for values, label, style in ((comparison.curves[:, 0], "truth", {**TRUTH, "zorder": 3}),
                                 (comparison.measured, comparison.names[0],
                                  {"color": COLOURS[0], "alpha": 0.7})):
        axes.psd(values, NFFT=4096, Fs=rate, label=label, **style)
    axes.set_xscale("log")
    axes.set_xlim(10, rate / 2)
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylabel("power spectral density [dB re (m/s²)²/Hz]")
    axes.legend(loc="lower left", frameon=False)


def error_shares(axes: Axes, comparison: Comparison) -> None:
    """Draw how many values have at most which distance from the truth."""
    axes.set_title("Distance from the truth")
    shares = np.linspace(0, 100, 501)
    for values, label, style in (
            (comparison.errors, "measured", {"color": COLOURS[0], "linewidth": 2}),
            (comparison.tolerances, "allowed", TRUTH)):
        axes.plot(np.percentile(values, shares), shares, label=label, **style)
    axes.set_xscale("log")
    axes.set_xlabel(comparison.error_name)
    axes.set_ylabel("share of the samples below [%]")
    axes.legend(loc="lower right", frameon=False)


def _tracks(comparison: Comparison) -> list[tuple[int, str]]:
    """Return the index of each track with its colour."""
    return [(track, COLOURS[track % len(COLOURS)]) for track in range(len(comparison.names))]
