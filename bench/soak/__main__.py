# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The command: `./dev soak [--minutes N] [--seed N] [--only DRIVER/FAULT] [--json FILE]`.

All drivers run at full rate against their simulators while faults come and go. Exit code 0 if each
fault was noticed where it must be and recovered from, no wrong value was published, no node leaked
anything, and all of them ended well.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import signal
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from bench.measure import Failure
from bench.soak.report import complaints, fault_table, program_table
from sensor_tools.ros_domain import claim_domain


def main(args: Sequence[str] | None = None) -> int:
    """Soak the drivers, show what became of it, and return 0 if all is well."""
    options = _parse(args)
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    os.environ["ROS_DOMAIN_ID"] = str(claim_domain())
    from bench.soak.stage import Stage, sorts_with  # ROS reads the environment when it starts

    chosen = sorts_with(options.only)
    if not chosen:
        print(f"error: no fault has {options.only!r} in its DRIVER/FAULT", file=sys.stderr)
        return 2
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that no process is left behind
    print(f"Soaking {', '.join(sort.name for sort in chosen)} for {options.minutes:g} min; seed "
          f"{options.seed}.", flush=True)
    with contextlib.ExitStack() as stack:
        directory = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="soak-")))
        os.environ["ROS_LOG_DIR"] = str(directory)
        try:
            stage = Stage(chosen, directory)
            with stage:
                stage.run(60 * options.minutes, options.only, options.seed)
        except KeyboardInterrupt:
            print("Stopped early.", file=sys.stderr)
        except Failure as failure:
            print(f"error: {failure}", file=sys.stderr)
            return 1
    events = [event for lane in stage.lanes for event in lane.events]
    programs = [lane.program for lane in stage.lanes]
    wrong = complaints(events, programs)
    print(f"\n{fault_table(events)}\n\n{program_table(programs)}\n")
    verdict = "not well:" if wrong else "all is well"
    print("\n".join([f"{len(events)} faults; {verdict}", *wrong]))
    if options.json:
        options.json.write_text(json.dumps(
            {"seed": options.seed, "complaints": wrong, "events": list(map(asdict, events)),
             "programs": list(map(asdict, programs))}, indent=2, ensure_ascii=False) + "\n")
    return int(bool(wrong))


def _parse(args: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="soak", description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0, help="how long (default: 10)")
    parser.add_argument("--seed", type=int, default=int(time.time()) % 10_000,
                        help="the same number gives the same order of the faults")
    parser.add_argument("--only", default="", metavar="DRIVER/FAULT",
                        help="only faults with this in their name, such as 'isys pty/' or 'echo'")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the results into FILE")
    options = parser.parse_args(args)
    if options.json:
        try:
            options.json.touch()
        except OSError as error:
            parser.error(f"cannot write {options.json}: {error.strerror}")
    return options


if __name__ == "__main__":
    sys.exit(main())
