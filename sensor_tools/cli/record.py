# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""`sensors record`: measurements into a CSV file, or into a bag with the messages of the node."""

from __future__ import annotations

import csv
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TextIO

import click

from driver_common.errors import DriverError
from sensor_tools.bags import Write, write_bag
from sensor_tools.cli.measuring import duration_option, measure
from sensor_tools.cli.places import Wanted, place_options
from sensor_tools.cli.sensor import Session, session
from sensor_tools.measurements import Row

if TYPE_CHECKING:
    from sensor_tools.messages import Convert

FLUSH_PERIOD = 0.2  # s of measurements that wait in memory
SECOND = 1_000_000_000  # ns
BAG = ".mcap"


class Output(Protocol):
    """Takes measurements for a file.

    They wait for `flush`: an error of the file must not be taken for one of the bus.

    Attributes:
        count: Measurements so far.
    """

    count: int

    def begin(self, one: Session) -> None:
        """Get ready for what a connected sensor measures."""

    def take(self, stamp: int, rows: Sequence[Row]) -> None:
        """Take a measurement of so many ns since the epoch."""

    def flush(self) -> None:
        """Write what waits; raises OSError."""


class Table:
    """Writes measurements as CSV: RFC 4180, UTF-8, a heading with units, times since the epoch."""

    def __init__(self, file: TextIO) -> None:
        """Write to a file."""
        self.count = 0
        self._file = file
        self._writer = csv.writer(file)
        self._waiting: list[tuple[str, ...]] = []

    def begin(self, one: Session) -> None:
        """Write the heading: names and units."""
        columns = one.family.columns(one.device)
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


class Messages:
    """Writes measurements as the messages of the sensor's node."""

    def __init__(self, write: Write) -> None:
        """Write to a bag."""
        self.count = 0
        self._write = write
        self._waiting: list[tuple[int, Sequence[Row]]] = []
        self._convert: Convert

    def begin(self, one: Session) -> None:
        """Prepare the messages; raises DriverError."""
        try:
            from sensor_tools.messages import CONVERSIONS
        except ModuleNotFoundError as error:
            raise DriverError("a bag needs the message classes of ROS: source ROS 2 Jazzy, use "
                              f"./dev, or record CSV ({error})") from error
        self._convert = CONVERSIONS[one.family.name](one.device)

    def take(self, stamp: int, rows: Sequence[Row]) -> None:
        """Take a measurement of so many ns since the epoch."""
        self._waiting.append((stamp, rows))
        self.count += 1

    def flush(self) -> None:
        """Write what waits; raises OSError."""
        for stamp, rows in self._waiting:
            for record in self._convert(stamp, rows):
                self._write(record)
        self._waiting.clear()


@click.command()
@click.argument("file", type=click.Path(dir_okay=False, allow_dash=True, path_type=Path))
@place_options(measuring=True)
@duration_option
@click.option("--overwrite", is_flag=True, help="Replace a file that exists.")
def record(wanted: Wanted, file: Path, duration: float | None, overwrite: bool) -> None:
    """Write what a sensor measures to a file.

    FILE.mcap is a bag with the messages of the sensor's node, for Foxglove, PlotJuggler and ros2
    bag. Any other FILE is CSV: each target, distance or sample is a row; - is standard output.
    Times are those of the measurement.
    """
    with _opened(file, overwrite) as output:
        with session(wanted, output.take) as one:
            one.connect()
            output.begin(one)
            measure(one, duration, output.flush, FLUSH_PERIOD)
        output.flush()  # what came while the sensor was stopped
    click.echo(f"{output.count} measurements in {file}", err=True)


@contextmanager
def _opened(file: Path, overwrite: bool) -> Iterator[Output]:
    """Yield what writes to a file; raises DriverError for all that goes wrong with it."""
    if str(file) == "-":
        yield Table(sys.stdout)
        return
    try:
        if file.suffix == BAG:
            with _bag(file, overwrite) as messages:
                yield messages
        else:
            with file.open("w" if overwrite else "x", newline="", encoding="utf-8") as stream:
                yield Table(stream)
    except FileExistsError:
        raise DriverError(f"{file} exists already; --overwrite replaces it") from None
    except OSError as error:
        raise DriverError(f"cannot write {file}: {error.strerror}") from None


@contextmanager
def _bag(file: Path, overwrite: bool) -> Iterator[Messages]:
    """Yield what writes to a bag of one file, which takes its place when something is in it."""
    if file.exists() and not overwrite:
        raise FileExistsError(file)
    with tempfile.TemporaryDirectory(dir=file.parent, prefix=f"{file.name}.") as folder:
        bag = Path(folder) / file.stem
        try:
            with write_bag(bag) as write:
                messages = Messages(write)
                yield messages
        finally:
            for part in bag.glob(f"*{BAG}"):
                if messages.count:
                    part.replace(file)


def _text(value: float | str | None) -> str:
    if value is None:
        return ""
    return f"{value:.9g}" if isinstance(value, float) else str(value)
