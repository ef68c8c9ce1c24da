# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Processes that are measured, and what is made of the measurements."""

from __future__ import annotations

import contextlib
import os
import queue
import signal
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, TypeVar

T = TypeVar("T")

ROOT = Path(__file__).resolve().parent.parent
PATIENCE = 30.0  # s until a process must have said something
END_TIME = 5.0  # s in which it must end when it is asked to
QUIET = 0.05  # share of the processor time that others may use, for a figure to be trusted
STAT = Path("/proc/stat")
KEPT = 10_000  # lines of complaints
TICKS = os.sysconf("SC_CLK_TCK")


class Failure(Exception):  # noqa: N818
    """A measurement did not come about."""


class Process:
    """A child process; a context manager that ends it.

    Attributes:
        started: Monotonic time in s at which it was started.

    Args:
        module: What Python runs, as "module" or "module:function".
        arguments: Its command line.
        core: The only processor core that it may use, where the system can do that.
        environment: Variables that it gets in addition.
    """

    def __init__(self, module: str, *arguments: object, core: int | None = None,
                 environment: Mapping[str, str] | None = None) -> None:
        """Start it."""
        self._name = module
        module, _, function = module.partition(":")
        start = ["-c", f"from {module} import {function}; {function}()"] if function else [
            "-m", module]
        self.started = time.monotonic()
        self._process = subprocess.Popen(
            [sys.executable, *start, *map(str, arguments)], cwd=ROOT, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            start_new_session=True, env={**os.environ, **(environment or {})})
        if core is not None:
            os.sched_setaffinity(self._process.pid, {core})
        self._lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._complaints: list[str] = []
        for read in (self._read, self._read_complaints):
            threading.Thread(target=read, daemon=True).start()

    def __enter__(self) -> Process:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the process."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
        try:
            self._process.wait(END_TIME)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def tell(self, line: str) -> None:
        """Write a line to its standard input."""
        assert self._process.stdin is not None
        print(line, file=self._process.stdin, flush=True)

    def line(self, timeout: float = PATIENCE) -> str:
        """Return the next line that it printed; raises Failure where none comes."""
        try:
            line = self._lines.get(timeout=timeout)
        except queue.Empty:
            line = None
        if line is None:
            raise self.failure("did not answer")
        return line

    def said(self) -> list[str]:
        """Return the lines that it printed since the last call."""
        lines = []
        with contextlib.suppress(queue.Empty):
            while (line := self._lines.get_nowait()) is not None:
                lines.append(line)
        return lines

    def rest(self) -> list[str]:
        """Return what else it printed until it ended."""
        return list(iter(lambda: self._lines.get(timeout=PATIENCE), None))

    def failure(self, text: str) -> Failure:
        """Return an exception with what the process complained about."""
        return Failure("\n".join([f"{self._name} {text}", *self._complaints[-15:]]))

    def is_running(self) -> bool:
        """Whether it has not ended."""
        return self._process.poll() is None

    @property
    def number(self) -> int:
        """Its process number."""
        return self._process.pid

    def send_signal(self, number: int) -> None:
        """Send it a signal."""
        self._process.send_signal(number)

    def wait(self, timeout: float = END_TIME) -> int | None:
        """Return its exit code once it has ended, None where it goes on."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            return self._process.wait(timeout)
        return None

    def complaints(self) -> list[str]:
        """Return the last lines of what it wrote to its standard error."""
        return list(self._complaints)

    def cpu_time(self) -> float:
        """Return the CPU time in s that all of its threads have used so far."""
        # The CPU-time clock of another process, as clock_getcpuclockid(3) makes it.
        return time.clock_gettime(~self._process.pid << 3 | 2)

    @property
    def memory(self) -> float:
        """Memory in MB that it has for itself, and its share of what it has with others."""
        text = Path(f"/proc/{self._process.pid}/smaps_rollup").read_text()
        return int(text.split("Pss:")[1].split()[0]) / 1000

    def _read(self) -> None:
        for line in self._process.stdout or ():
            self._lines.put(line.rstrip("\n"))
        self._lines.put(None)

    def _read_complaints(self) -> None:
        for line in self._process.stderr or ():
            self._complaints.append(line.rstrip("\n"))
            del self._complaints[:-KEPT]


def divide_cores() -> int | None:
    """Keep this process and its children off one core, and return that; None if impossible."""
    if not hasattr(os, "sched_setaffinity"):
        return None
    *others, core = sorted(os.sched_getaffinity(0))
    if not others:
        return None
    os.sched_setaffinity(0, others)
    return core


class Cost(NamedTuple):
    """What one side cost: per piece, in the unit of its row, and how many pieces it processed."""

    each: float
    pieces: int


def in_turn(sides: Mapping[str, Callable[[], T]], rounds: int) -> Iterator[dict[str, T]]:
    """Measure all sides once per round, in an order that changes from round to round."""
    for number in range(rounds):
        names = list(sides)[::-1 if number % 2 else 1]
        yield {name: sides[name]() for name in names}


class ForeignLoad:
    """What others did on this machine during a measurement; a context manager.

    Attributes:
        share: Share of the processor time that others used.
    """

    share = 0.0

    def __enter__(self) -> ForeignLoad:
        """Begin."""
        self._begin = self._times()
        return self

    def __exit__(self, *_: object) -> None:
        """End; all processes of the measurement have ended as well."""
        total, others = (after - before for before, after in
                         zip(self._begin, self._times(), strict=True))
        self.share = max(0.0, others / total) if total else 0.0

    @staticmethod
    def _times() -> tuple[float, float]:
        """Return processor time of the machine, and of it what others used, in s."""
        fields = [int(field) / TICKS for field in STAT.read_text().split("\n", 1)[0].split()[1:9]]
        own = os.times()
        idle = fields[3] + fields[4]
        return sum(fields), sum(fields) - idle - sum(own[:4])


@dataclass
class Row:
    """A result; `None` for what was not measured.

    Attributes:
        name: What was measured.
        unit: Of both sides.
        aim: What the figure should be at most, or at least.
        ours: Median of this package.
        other: Median of what it is compared with.
        figure: Median of ours / other, or of ours − other, within a round.
        spread: Smallest and largest of these.
        processed: Pieces that each of the two sides processed in all.
        difference: Whether the figure is ours − other.
        at_least: Whether a higher figure is better.
        met: Whether the aim is met.
        foreign: Share of the processor time that other programs used meanwhile.
        note: Why it was not measured.
    """

    name: str
    unit: str
    aim: float
    ours: float | None = None
    other: float | None = None
    figure: float | None = None
    spread: tuple[float, float] | None = None
    processed: tuple[int, int] | None = None
    difference: bool = False
    at_least: bool = False
    met: bool | None = None
    foreign: float | None = None
    note: str = ""

    @classmethod
    def compare(cls, name: str, unit: str, aim: float, ours: Sequence[Cost],
                other: Sequence[Cost], *, difference: bool = False,
                at_least: bool = False) -> Row:
        """Return the row of a comparison, from what each side cost in each round."""
        figures = [one.each - two.each if difference else one.each / two.each
                   for one, two in zip(ours, other, strict=True)]
        figure = statistics.median(figures)
        return cls(name, unit, aim, statistics.median(cost.each for cost in ours),
                   statistics.median(cost.each for cost in other), figure,
                   (min(figures), max(figures)),
                   (sum(cost.pieces for cost in ours), sum(cost.pieces for cost in other)),
                   difference, at_least, figure >= aim if at_least else figure <= aim)

    @property
    def verdict(self) -> str:
        """Whether the aim is met, as far as the machine lets that be said."""
        if self.met is None:
            return f"not measured: {self.note}"
        busy = self.foreign is not None and self.foreign > QUIET
        return ("yes" if self.met else "no") + f" (busy: {self.foreign:.0%} by others)" * busy
