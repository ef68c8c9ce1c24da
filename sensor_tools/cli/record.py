# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""`sensors record`: measurements into a CSV file."""

from __future__ import annotations

import csv
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

import click

from driver_common.errors import DriverError
from sensor_tools.cli.measuring import duration_option, measure
from sensor_tools.cli.places import Wanted, place_options
from sensor_tools.cli.sensor import session
from sensor_tools.measurements import Row

FLUSH_PERIOD = 0.2  # s of measurements that wait in memory
SECOND = 1_000_000_000  # ns


class Table:
    """Writes measurements as CSV: RFC 4180, UTF-8, a heading with units, times since the epoch.

    Rows wait for `flush`: an error of the file must not be taken for one of the bus.

    Attributes:
        count: Measurements so far.
    """

    def __init__(self, file: TextIO) -> None:
        """Write to a file."""
        self.count = 0
        self._file = file
        self._writer = csv.writer(file)
        self._waiting: list[tuple[str, ...]] = []

    def begin(self, columns: Mapping[str, str]) -> None:
        """Write the heading: names and units."""
        self._waiting.append(("time [s]", *(f"{name} [{unit}]" if unit else name
                                            for name, unit in columns.items())))

    def take(self, stamp: int, rows: Sequence[Row]) -> None:
        """Take a measurement of so many ns since the epoch."""
        time = f"{stamp // SECOND}.{stamp % SECOND:09d}"
        self._waiting += [(time, *map(_text, row)) for row in rows]
        self.count += 1

    def flush(self) -> None:
        """Write what waits; raises OSError."""
        self._writer.writerows(self._waiting)
        self._waiting.clear()
        self._file.flush()


@click.command()
@click.argument("file", type=click.Path(dir_okay=False, allow_dash=True, path_type=Path))
@place_options(measuring=True)
@duration_option
@click.option("--overwrite", is_flag=True, help="Replace a file that exists.")
def record(wanted: Wanted, file: Path, duration: float | None, overwrite: bool) -> None:
    """Write what a sensor measures to a CSV file.

    FILE may be - for standard output. Each target, distance or sample is a row; times are those
    of the measurement.
    """
    with _opened(file, overwrite) as stream:
        table = Table(stream)
        with session(wanted, table.take) as one:
            one.connect()
            table.begin(one.family.columns(one.device))
            measure(one, duration, table.flush, FLUSH_PERIOD)
        table.flush()  # what came while the sensor was stopped
    click.echo(f"{table.count} measurements in {file}", err=True)


@contextmanager
def _opened(file: Path, overwrite: bool) -> Iterator[TextIO]:
    """Yield a file to write to; raises DriverError for all that goes wrong with it."""
    if str(file) == "-":
        yield sys.stdout
        return
    try:
        with file.open("w" if overwrite else "x", newline="", encoding="utf-8") as stream:
            yield stream
    except FileExistsError:
        raise DriverError(f"{file} exists already; --overwrite replaces it") from None
    except OSError as error:
        raise DriverError(f"cannot write {file}: {error.strerror}") from None


def _text(value: float | str | None) -> str:
    if value is None:
        return ""
    return f"{value:.9g}" if isinstance(value, float) else str(value)
