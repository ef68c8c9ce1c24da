"""Processes that are measured, and what is made of the measurements."""

from __future__ import annotations

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
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
PATIENCE = 30.0  # s until a process must have said something
END_TIME = 5.0  # s in which it must end when it is asked to


class Failure(Exception):  # noqa: N818
    """A measurement did not come about."""


class Process:
    """A child process; a context manager that ends it.

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

    def failure(self, text: str) -> Failure:
        """Return an exception with what the process complained about."""
        return Failure("\n".join([f"{self._name} {text}", *self._complaints[-15:]]))

    def is_running(self) -> bool:
        """Whether it has not ended."""
        return self._process.poll() is None

    def cpu_time(self) -> float:
        """Return the CPU time in s that all of its threads have used so far."""
        # The CPU-time clock of another process, as clock_getcpuclockid(3) makes it.
        return time.clock_gettime(~self._process.pid << 3 | 2)

    def _read(self) -> None:
        for line in self._process.stdout or ():
            self._lines.put(line.rstrip("\n"))
        self._lines.put(None)

    def _read_complaints(self) -> None:
        for line in self._process.stderr or ():
            self._complaints.append(line.rstrip("\n"))
            del self._complaints[:-100]


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
    """CPU time in µs per piece, and how many pieces were processed."""

    each: float
    pieces: int


def in_turn(sides: Mapping[str, Callable[[], Cost]], rounds: int) -> Iterator[dict[str, Cost]]:
    """Measure all sides once per round, in an order that changes from round to round."""
    for number in range(rounds):
        names = list(sides)[::-1 if number % 2 else 1]
        yield {name: sides[name]() for name in names}


@dataclass
class Row:
    """A result; `None` for what was not measured.

    Attributes:
        name: What was measured.
        ours: Median of this package.
        other: Median of what it is compared with.
        unit: Of both.
        ratio: Median of ours / other within a round.
        aim: What the ratio should be at most, or at least.
        met: Whether it is.
        spread: Smallest and largest ratio.
        processed: Pieces that each of the two sides processed in all.
        at_least: Whether a higher ratio is better.
        note: What else is to be said.
    """

    name: str
    ours: float | None
    other: float | None
    unit: str
    ratio: float | None
    aim: float
    met: bool | None
    spread: tuple[float, float] | None
    processed: tuple[int, int] | None
    at_least: bool = False
    note: str = ""

    @classmethod
    def of_costs(cls, name: str, unit: str, aim: float, ours: Sequence[Cost],
                 other: Sequence[Cost]) -> Row:
        """Return the row of a comparison: the lower the ratio, the better."""
        ratios = [one.each / two.each for one, two in zip(ours, other, strict=True)]
        ratio = statistics.median(ratios)
        return cls(name, statistics.median(cost.each for cost in ours),
                   statistics.median(cost.each for cost in other), unit, ratio, aim, ratio <= aim,
                   (min(ratios), max(ratios)),
                   (sum(cost.pieces for cost in ours), sum(cost.pieces for cost in other)))

    @classmethod
    def not_measured(cls, name: str, unit: str, aim: float, reason: str) -> Row:
        """Return a row without a result."""
        return cls(name, None, None, unit, None, aim, None, None, None,
                   note=f"not measured: {reason}")
