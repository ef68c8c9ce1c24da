# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The command: `./dev fuzz [--inputs N] [--minutes N] [--only WORD] [--seed N] [--keep DIRECTORY]`.

Each target gets the inputs, or as many as fit into its share of the minutes. What fails is kept as
a small file. Exit code 0 if nothing failed, 1 if something did.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

from bench.fuzz.campaign import Result, fuzz_named
from bench.fuzz.targets import TARGETS


def table(results: Sequence[Result]) -> str:
    """Return the results for people."""
    lines = [f"{'target':24}{'inputs':>12}{'seconds':>10}{'failures':>10}"]
    for result in results:
        lines.append(f"{result.name:24}{result.inputs:12,}{result.seconds:10.1f}"
                     f"{len(result.failures):10}")
        lines += [f"  {fault}: {data.hex(' ') or 'nothing'}"
                  for fault, data in result.failures.items()]
    return "\n".join(lines)


def keep(results: Sequence[Result], directory: Path) -> None:
    """Write each input that fails into a file of its own."""
    for result in results:
        for number, data in enumerate(result.failures.values(), 1):
            directory.mkdir(parents=True, exist_ok=True)
            (directory / f"{result.name.replace(' ', '_')}_{number}.bin").write_bytes(data)


def main(args: Sequence[str] | None = None) -> int:
    """Fuzz, show the table, and return 1 if something failed."""
    parser = argparse.ArgumentParser(prog="fuzz", description=__doc__)
    parser.add_argument("--inputs", type=int, default=sys.maxsize, help="inputs of each target")
    parser.add_argument("--minutes", type=float, help="how long, 5 if no inputs are given")
    parser.add_argument("--only", metavar="WORD", default="", help="targets with this in the name")
    parser.add_argument("--seed", type=int, default=1, help="other numbers give other inputs")
    parser.add_argument("--keep", type=Path, default=Path("fuzz_failures"), metavar="DIRECTORY",
                        help="where what fails is kept")
    options = parser.parse_args(args)
    names = [target.name for target in TARGETS if options.only in target.name]
    workers = min(os.cpu_count() or 1, len(names))
    if not names:
        parser.error(f"no target has {options.only!r} in its name")
    minutes = options.minutes or (5.0 if options.inputs == sys.maxsize else 1e6)
    share = 60 * minutes * workers / len(names)
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        results = list(pool.map(partial(fuzz_named, inputs=options.inputs, seconds=share,
                                        seed=options.seed), names))
    keep(results, options.keep)
    print(table(results))
    return int(any(result.failures for result in results))


if __name__ == "__main__":
    sys.exit(main())
