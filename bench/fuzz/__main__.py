# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The command: feeds targets with inputs, or with what failed before.

Each target gets the inputs, or as many as fit into its share of the minutes. What fails is kept as
a small file; `fuzz FILE` tries it again. Exit code 0 if nothing failed, 1 if something did.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from functools import partial
from multiprocessing import get_context
from pathlib import Path

from bench.fuzz.campaign import Result, fault_of
from bench.fuzz.failures import keep, read_failure
from bench.fuzz.targets import TARGETS, fuzz_named
from driver_common.errors import SettingError


def table(results: Sequence[Result]) -> str:
    """Return the results for people."""
    lines = [f"{'target':24}{'inputs':>12}{'seconds':>10}{'branches':>10}{'examples':>14}"
             f"{'failures':>10}"]
    for result in results:
        grown = f"{result.seeds:,} + {result.grown:,}"
        lines.append(f"{result.name:24}{result.inputs:12,}{result.seconds:10.1f}"
                     f"{result.branches:10,}{grown:>14}{len(result.failures):10}")
        lines += [f"  {failure}" for failure in result.failures]
    return "\n".join(lines)


def as_json(results: Sequence[Result]) -> str:
    """Return the results for programs."""
    rows = [asdict(result) for result in results]
    for row in rows:
        for failure in row["failures"]:
            failure["data"] = failure["data"].hex(" ").upper()
    return json.dumps(rows, indent=1) + "\n"


def repeat(path: Path) -> int:
    """Try an input again that failed, say what becomes of it, and return 1 if it fails.

    Raises:
        SettingError: The file keeps no such input.
    """
    failure = read_failure(path)
    target = next((one for one in TARGETS if one.name == failure.target), None)
    if target is None:
        raise SettingError(f"{path} is of {failure.target!r}, which is no target")
    fault = fault_of(target, failure.data, failure.choices)
    print(f"{path}: {fault or 'nothing is wrong any more'}")
    return int(bool(fault))


def _options(args: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="fuzz", description=__doc__)
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE", help="what failed before")
    parser.add_argument("--inputs", type=int, default=sys.maxsize, help="inputs of each target")
    parser.add_argument("--minutes", type=float, help="how long, 5 if no inputs are given")
    parser.add_argument("--only", metavar="WORD", default="", help="targets with this in the name")
    parser.add_argument("--seed", type=int, default=1, help="other numbers give other inputs")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1,
                        help="targets at the same time")
    parser.add_argument("--keep", type=Path, default=Path("fuzz_failures"), metavar="DIRECTORY",
                        help="where what fails is kept")
    parser.add_argument("--json", type=Path, metavar="FILE", help="where the table is written too")
    options = parser.parse_args(args)
    options.names = [target.name for target in TARGETS if options.only in target.name]
    if not options.names:
        parser.error(f"no target has {options.only!r} in its name")
    return options


def main(args: Sequence[str] | None = None) -> int:
    """Fuzz, show the table, and return 1 if something failed."""
    options = _options(args)
    if options.files:
        try:
            return max(map(repeat, options.files))
        except SettingError as error:
            sys.exit(f"error: {error}")
    jobs = max(1, min(options.jobs, len(options.names)))
    minutes = options.minutes or (5.0 if options.inputs == sys.maxsize else 1e6)
    share = 60 * minutes * jobs / len(options.names)
    with ProcessPoolExecutor(jobs, get_context("spawn")) as pool:
        results = list(pool.map(partial(fuzz_named, inputs=options.inputs, seconds=share,
                                        seed=options.seed), options.names))
    print(table(results))
    for path in keep((one for result in results for one in result.failures), options.keep):
        print(f"kept {path}")
    if options.json:
        options.json.write_text(as_json(results), encoding="utf-8")
    return int(any(result.failures for result in results))


if __name__ == "__main__":
    sys.exit(main())
