# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What became of the faults, and of the programs: as tables, and whether all is well."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass, field

from bench.soak.faults import Fault

MEMORY_GROWTH = 24.0  # MB; the recorder of the last minute may hold 16
WARM_UP = 90.0  # s in which that recorder, and the allocator, get what they need


@dataclass
class Event:
    """A fault that came and went.

    Attributes:
        driver: Whom it met.
        fault: Its name.
        begin: When it came, in s since the start of the soak.
        noticed: By what it was noticed first; "" = not at all.
        must_notice: Whether it had to be.
        recovery: Time in s from its end until all was as before; None = it never was.
        bound: How long that may take.
        lag: By how much data may come late, in s.
        end: When all was as before, in s since the start of the soak.
        lost: Samples that were due and did not come.
        explained: Those of them that the diagnostics explain.
        wrong: Wrong values that came meanwhile.
        trouble: What else went wrong.
        said: What the diagnostics said meanwhile.
    """

    driver: str
    fault: str
    begin: float
    noticed: str = ""
    must_notice: bool = False
    recovery: float | None = None
    bound: float = math.inf
    lag: float = 0.0
    end: float = math.inf
    lost: int = 0
    explained: int = 0
    wrong: int = 0
    trouble: list[str] = field(default_factory=list)
    said: list[str] = field(default_factory=list)

    @classmethod
    def of(cls, driver: str, fault: Fault, begin: float) -> Event:
        """Return the event of a fault that comes now."""
        return cls(driver, fault.name, begin, must_notice=bool(fault.notices), bound=fault.bound,
                   lag=fault.lag)

    def complaints(self) -> list[str]:
        """Return what is wrong with it."""
        place = f"{self.driver}, {self.fault}, at {self.begin:.0f} s:"
        return [f"{place} {text}" for text, is_so in (
            ("not noticed", self.must_notice and not self.noticed),
            ("no recovery", self.recovery is None),
            (f"recovered after {self.recovery or 0.0:.1f} s instead of {self.bound:g} s",
             self.recovery is not None and self.recovery > self.bound),
            (f"{self.wrong} wrong values", self.wrong), *((text, True) for text in self.trouble),
        ) if is_so]


@dataclass(frozen=True)
class Usage:
    """What a process has: seconds since the start of the soak, MB, descriptors, threads."""

    time: float
    memory: float
    descriptors: int
    threads: int


@dataclass
class Program:
    """What a node used and how it ended.

    Attributes:
        driver: Which node.
        usage: What it had, now and then, while no fault was there.
        code: Its exit code; None = it did not end.
        published: How many samples it published, as its diagnostics say.
        received: How many of them came.
        trouble: What else was wrong with it.
    """

    driver: str
    usage: list[Usage] = field(default_factory=list)
    code: int | None = None
    published: int = 0
    received: int = 0
    trouble: list[str] = field(default_factory=list)

    @property
    def slope(self) -> float | None:
        """How fast its memory grows in MB/min once it is warm; None where that cannot be told."""
        warm = [usage for usage in self.usage if usage.time >= WARM_UP]
        if len({usage.time for usage in warm}) < 3:
            return None
        return 60 * statistics.linear_regression(
            [usage.time for usage in warm], [usage.memory for usage in warm]).slope

    @property
    def growth(self) -> float:
        """By how much its memory grew in MB since it was warm."""
        warm = [usage for usage in self.usage if usage.time >= WARM_UP]
        return warm[-1].memory - warm[0].memory if warm else 0.0

    def complaints(self) -> list[str]:
        """Return what is wrong with it."""
        found = [*self.trouble]
        if self.code != 0:
            found.append("did not end" if self.code is None else f"exit code {self.code}")
        if self.usage:
            first, last = self.usage[0], self.usage[-1]
            found += [f"{name} grew from {before} to {after}" for name, before, after in (
                ("descriptors", first.descriptors, last.descriptors),
                ("threads", first.threads, last.threads)) if after > before]
        if self.growth > MEMORY_GROWTH:
            found.append(f"memory grew by {self.growth:.0f} MB")
        return [f"{self.driver}: {text}" for text in found]


def complaints(events: Sequence[Event], programs: Sequence[Program]) -> list[str]:
    """Return all that is wrong; nothing means that the drivers passed."""
    return [text for event in events for text in event.complaints()] + [
        text for program in programs for text in program.complaints()]


def fault_table(events: Sequence[Event]) -> str:
    """Return a line per driver and fault."""
    groups: dict[tuple[str, str], list[Event]] = {}
    for event in events:
        groups.setdefault((event.driver, event.fault), []).append(event)
    rows = [("driver", "fault", "injected", "noticed", "by", "recovered", "median", "worst",
             "bound", "lost", "explained", "wrong")]
    for (driver, fault), group in sorted(groups.items()):
        times = [event.recovery for event in group if event.recovery is not None]
        ways = {event.noticed for event in group if event.noticed}
        rows.append((
            driver, fault, str(len(group)), str(sum(bool(event.noticed) for event in group))
            if group[0].must_notice else "–", ", ".join(sorted(ways)), str(len(times)),
            f"{statistics.median(times):.2f} s" if times else "", f"{max(times):.2f} s"
            if times else "", f"{group[0].bound:g} s", str(sum(event.lost for event in group)),
            str(sum(event.explained for event in group)),
            str(sum(event.wrong for event in group))))
    return _aligned(rows)


def program_table(programs: Sequence[Program]) -> str:
    """Return a line per node."""
    rows = [("node", "published", "received", "memory", "slope", "descriptors", "threads",
             "exit code")]
    for program in programs:
        first, last = (program.usage[index] if program.usage else Usage(0, 0, 0, 0)
                       for index in (0, -1))
        slope = "not known" if program.slope is None else f"{program.slope:+.2f} MB/min"
        rows.append((program.driver, str(program.published), str(program.received),
                     f"{first.memory:.0f} → {last.memory:.0f} MB", slope,
                     f"{first.descriptors} → {last.descriptors}",
                     f"{first.threads} → {last.threads}",
                     "none" if program.code is None else str(program.code)))
    return _aligned(rows)


def _aligned(rows: Sequence[Sequence[str]]) -> str:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join("  ".join(map(str.ljust, row, widths)).rstrip() for row in rows)
