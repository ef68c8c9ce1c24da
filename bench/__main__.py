# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The command: `./dev bench [--quick] [--only WORD] [--json FILE]`."""

from __future__ import annotations

import argparse
import json
import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

from bench import batch, decode, imu, latency, nodes, stamps
from bench.measure import Failure, ForeignLoad, Row, divide_cores
from bench.receiver import RADAR, ULTRASONIC, Receiver, make_receiver

LINES = tuple((ULTRASONIC, count) for count in (2, 4, 7)) + tuple(
    (RADAR, count) for count in (2, 4))

Step = Callable[[Receiver], list[Row]]

# What is measured, by name: how it is done well, and how it is done quickly.
STEPS: dict[str, tuple[Step, Step]] = {
    "decoding": (lambda to: [decode.compare(to.core, 300_000, 5)],
                 lambda to: [decode.compare(to.core, 20_000, 1)]),
    "samples": (lambda to: imu.compare(to, 8000, 7), lambda to: imu.compare(to, 2000, 1)),
    "batches": (lambda to: batch.compare(to.core, 4.0, 5),
                lambda to: batch.compare(to.core, 0.5, 1)),
    "many sensors": (lambda to: imu.follow_many(to, 4.0), lambda to: imu.follow_many(to, 0.2)),
    "highest rates": (lambda to: imu.find_highest_rates(to, imu.MULTIPLES, 3.0, 1),
                      lambda to: imu.find_highest_rates(to, (1,), 0.5, 1)),
    "stamps": (lambda to: stamps.compare(12.0), lambda to: stamps.compare(4.0)),
    "latency": (lambda to: latency.compare(to, 60, 5), lambda to: latency.compare(to, 5, 1)),
    "starts": (lambda to: nodes.compare_starts(to, 5), lambda to: nodes.compare_starts(to, 1)),
    "loads": (lambda to: nodes.compare_loads(to, 5.0, 3),
              lambda to: nodes.compare_loads(to, 0.5, 1)),
    "lines": (lambda to: nodes.compare_lines(to, LINES, 5.0, 3),
              lambda to: nodes.compare_lines(to, LINES[:1], 0.5, 1)),
}


def main(args: Sequence[str] | None = None) -> int:
    """Measure, and show the results; return 0 if everything could be measured."""
    parser = argparse.ArgumentParser(prog="bench", description=__doc__)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the results into FILE")
    parser.add_argument("--quick", action="store_true",
                        help="once and briefly: whether it works, without worth as a measurement")
    parser.add_argument("--only", choices=STEPS, metavar="STEP", action="append",
                        help=f"measure only this; can be repeated ({', '.join(STEPS)})")
    options = parser.parse_args(args)
    if options.json:
        try:
            options.json.touch()
        except OSError as error:
            parser.error(f"cannot write {options.json}: {error.strerror}")
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that no process is left behind
    failures: list[Failure] = []
    try:
        rows = list(_measure(options.only or list(STEPS), options.quick, failures))
    except KeyboardInterrupt:
        return 1
    if options.json:
        options.json.write_text(json.dumps([asdict(row) for row in rows], indent=2,
                                           ensure_ascii=False) + "\n")
    print(table(rows))
    return 1 if failures else 0


def _measure(names: Sequence[str], quick: bool, failures: list[Failure]) -> Iterator[Row]:
    """Yield what could be measured; a failure ends only the step in which it happens."""
    with make_receiver(divide_cores()) as receiver:
        for number, name in enumerate(names, 1):
            print(f"{number} of {len(names)}: {name} …", file=sys.stderr, flush=True)
            try:
                with ForeignLoad() as load:
                    rows = STEPS[name][quick](receiver)
            except Failure as failure:
                print(f"error: {failure}", file=sys.stderr)
                failures.append(failure)
                continue
            for row in rows:
                row.foreign = load.share
                yield row


def table(rows: Sequence[Row]) -> str:
    """Return the rows for people."""
    lines = [("", "ours", "other", "", "figure", "min … max", "aim", "met")]
    for row in rows:
        sign = "+" if row.difference else ""
        measured = ("", "", row.unit, "") if row.figure is None else (
            f"{row.ours:.3g}", f"{row.other:.3g}", row.unit, f"{row.figure:{sign}.3g}")
        spread = "{:.3g} … {:.3g}".format(*row.spread) if row.spread else ""
        aim = f"{'≥' if row.at_least else '≤'} {row.aim:{sign}g}"
        lines.append((row.name, *measured, spread, aim, row.verdict))
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return "\n".join("  ".join(map(str.ljust, line, widths)).rstrip() for line in lines)


if __name__ == "__main__":
    sys.exit(main())
