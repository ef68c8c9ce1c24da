# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""`sensors watch`: live values in the terminal."""

from __future__ import annotations

import sys
import time
from collections import deque
from collections.abc import Mapping, Sequence

import click
from rich.live import Live
from rich.table import Table

from sensor_tools.cli.measuring import duration_option, measure
from sensor_tools.cli.output import console
from sensor_tools.cli.places import Wanted, place_options
from sensor_tools.cli.sensor import session
from sensor_tools.measurements import Row

REFRESH = 0.1  # s on a terminal
PLAIN_REFRESH = 1.0  # s elsewhere, where each time is a line more
RATE_WINDOW = 2.0  # s
MOST_ROWS = 40


class Values:
    """The last measurement, and how many come in a second.

    Attributes:
        rows: Rows of the last measurement.
        count: Measurements so far.
    """

    def __init__(self) -> None:
        """Begin with nothing."""
        self.rows: Sequence[Row] = ()
        self.count = 0
        self._counts: deque[tuple[float, int]] = deque()

    def take(self, stamp: int, rows: Sequence[Row]) -> None:
        """Take a measurement."""
        if not self._counts:
            self._counts.append((time.monotonic(), 0))
        self.rows = rows
        self.count += 1

    def rate(self) -> float:
        """Return the measurements per second of the last few seconds."""
        now = time.monotonic()
        self._counts.append((now, self.count))
        while now - self._counts[0][0] > RATE_WINDOW:
            self._counts.popleft()
        first, before = self._counts[0]
        return (self.count - before) / (now - first) if now > first else 0.0


@click.command()
@place_options(measuring=True)
@duration_option
def watch(wanted: Wanted, duration: float | None) -> None:
    """Show live what a sensor measures.

    Its settings stay as they are. Where the output is no terminal, it is a line a second.
    """
    values = Values()
    with session(wanted, values.take) as one:
        one.connect()
        title, columns = str(one.found), one.family.columns(one.device)
        if sys.stdout.isatty():
            with Live(console=console(), auto_refresh=False) as live:
                measure(one, duration, lambda: live.update(_table(title, columns, values),
                                                        refresh=True), REFRESH)
        else:
            measure(one, duration, lambda: click.echo(_line(columns, values)), PLAIN_REFRESH)


def _table(title: str, columns: Mapping[str, str], values: Values) -> Table:
    """Return the last measurement as a table."""
    table = Table(title=title, title_justify="left", pad_edge=False, box=None,
                  caption=f"{values.count} measurements, {values.rate():.1f} per second; Ctrl-C "
                          "ends", caption_justify="left")
    for name, unit in columns.items():
        table.add_column(f"{name} [{unit}]" if unit else name, justify="right", min_width=9)
    for row in values.rows[:MOST_ROWS]:
        table.add_row(*map(_text, row))
    return table


def _line(columns: Mapping[str, str], values: Values) -> str:
    """Return the last measurement in a line."""
    rows = "; ".join(", ".join(
        f"{name} {_text(value)} {unit}".rstrip() for (name, unit), value in zip(
            columns.items(), row, strict=True) if value is not None)
        for row in values.rows[:MOST_ROWS])
    return f"{values.rate():.1f} per second: {rows or 'nothing yet'}"


def _text(value: float | str | None) -> str:
    if value is None:
        return ""
    return f"{value:.3f}" if isinstance(value, float) else str(value)
