# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the commands print: tables for people, JSON for programs, progress bars on a terminal."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager

import click
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from sensor_tools.search.result import Finding
from sensor_tools.search.result import Progress as Steps

PLAIN_WIDTH = 200  # of tables that go into a file or a pipe


def console() -> Console:
    """Return what writes to standard output, in colours on a terminal."""
    return Console(highlight=False, emoji=False, markup=False, soft_wrap=False,
                   width=None if sys.stdout.isatty() else PLAIN_WIDTH)


def print_json(value: object) -> None:
    """Print a value for programs; what JSON has no word for (nan, inf) becomes null."""
    click.echo(json.dumps(_plain(value), indent=2, ensure_ascii=False, default=str))


def _plain(value: object) -> object:
    if isinstance(value, Mapping):
        return {name: _plain(item) for name, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def print_table(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Print a table; columns without any content are left out."""
    lines = [["" if cell is None else str(cell) for cell in row] for row in rows]
    used = [index for index in range(len(columns)) if any(line[index] for line in lines)]
    table = Table(box=None, pad_edge=False, header_style="bold")
    for index in used:
        table.add_column(columns[index], overflow="fold")
    for line in lines:
        table.add_row(*(line[index] for index in used))
    console().print(table)


def print_pairs(pairs: Mapping[str, object]) -> None:
    """Print names and values."""
    width = max(map(len, pairs), default=0) + 2
    for name, value in pairs.items():
        click.echo(f"{name + ':':{width}}{value}")


def print_findings(findings: Sequence[Finding]) -> None:
    """Print what was found out, one line each, what is wrong first."""
    print_table(("", "WHERE", "WHAT", "FOUND", "WHAT TO DO"), (
        ("wrong" if finding.is_wrong else "ok", finding.subject, finding.check, finding.cause,
         finding.remedy) for finding in sorted(findings, key=lambda one: not one.is_wrong)))


class _Bar(Steps):
    """Shows the steps of a search."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._task = progress.add_task("", total=0)
        self._total = 0

    def expect(self, steps: int) -> None:
        """Make the bar longer."""
        self._total += steps
        self._progress.update(self._task, total=self._total)

    def step(self, what: str) -> None:
        """Fill one part of the bar more."""
        self._progress.update(self._task, advance=1, description=what)


@contextmanager
def progress_bar() -> Iterator[Steps]:
    """Show a progress bar on a terminal (standard error), nothing elsewhere."""
    if not sys.stderr.isatty():
        yield Steps()
        return
    columns = TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        yield _Bar(progress)
