"""The command: `./dev bench [--quick] [--json FILE]`."""

from __future__ import annotations

import argparse
import json
import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

from bench import decode, imu
from bench.measure import Failure, Row, divide_cores
from sensor_tools.ros_domain import claim_domain

MULTIPLES = (2, 4, 6, 8, 10, 12, 14, 16)


def main(args: Sequence[str] | None = None) -> int:
    """Measure, and show the results; return 0 if everything could be measured."""
    parser = argparse.ArgumentParser(prog="bench", description=__doc__)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the results into FILE")
    parser.add_argument("--quick", action="store_true",
                        help="once and briefly: whether it works, without worth as a measurement")
    options = parser.parse_args(args)
    if options.json:
        try:
            options.json.touch()
        except OSError as error:
            parser.error(f"cannot write {options.json}: {error.strerror}")
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    os.environ.setdefault("ROS_DOMAIN_ID", str(claim_domain()))
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that no process is left behind
    failures: list[Failure] = []
    try:
        rows = list(_measure(options.quick, failures))
    except Failure as failure:  # of the subscriber, which most steps need
        print(f"error: {failure}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 1
    if options.json:
        options.json.write_text(json.dumps([asdict(row) for row in rows], indent=2,
                                           ensure_ascii=False) + "\n")
    print(table(rows))
    return 1 if failures else 0


def _measure(quick: bool, failures: list[Failure]) -> Iterator[Row]:
    """Yield what could be measured; a failure ends only the step in which it happens."""
    core = divide_cores()
    with imu.make_subscriber(core) as subscriber:
        steps: dict[str, Callable[[], list[Row]]]
        if quick:
            steps = {"decoding": lambda: [decode.compare(core, 20_000, 1)],
                     "the whole path": lambda: imu.compare(subscriber, 2000, 1),
                     "the highest rate": lambda: [imu.find_highest_rate(subscriber, (1,), 0.5)]}
        else:
            steps = {"decoding": lambda: [decode.compare(core, 300_000, 5)],
                     "the whole path": lambda: imu.compare(subscriber, 8000, 7),
                     "the highest rate": lambda: [
                         imu.find_highest_rate(subscriber, MULTIPLES, 4.0)]}
        for number, (what, measure) in enumerate(steps.items(), 1):
            print(f"{number} of {len(steps)}: measuring {what} …", file=sys.stderr, flush=True)
            try:
                yield from measure()
            except Failure as failure:
                print(f"error: {failure}", file=sys.stderr)
                failures.append(failure)


def table(rows: Sequence[Row]) -> str:
    """Return the rows for people."""
    lines = [("", "ours", "other", "", "ratio", "min … max", "aim", "met")]
    for row in rows:
        figures = ("", "", row.unit, "") if row.ratio is None else (
            f"{row.ours:.3g}", f"{row.other:.3g}", row.unit, f"{row.ratio:.2f}")
        spread = "{:.2f} … {:.2f}".format(*row.spread) if row.spread else ""
        aim = f"{'≥' if row.at_least else '≤'} {row.aim:g}"
        lines.append((row.name, *figures, spread, aim,
                      row.note or ("yes" if row.met else "no")))
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return "\n".join("  ".join(map(str.ljust, line, widths)).rstrip() for line in lines)


if __name__ == "__main__":
    sys.exit(main())
