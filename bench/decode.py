# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Decoding only: CPU time per frame of the session and of the package icotronic."""

from __future__ import annotations

import importlib.util
import json
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bench.measure import Cost, Process, Row, in_turn

NAME, UNIT, AIM = "decode", "µs CPU per frame", 0.3
CONFIGURATION = """\
dynaconf_merge: true
can:
  linux:
    interface: socketcand
    channel: can0
"""


def compare(core: int | None, frames: int, rounds: int) -> Row:
    """Return the row.

    Args:
        core: Where the measured processes run.
        frames: Frames that each run decodes.
        rounds: How often.
    """
    if importlib.util.find_spec("icotronic") is None:
        return Row(NAME, UNIT, AIM, note="the package icotronic is not installed"
                   + "; it needs Python 3.12" * (sys.version_info < (3, 12)))
    skipped = frames // 2  # in these, a first reading of the sensor's state gets its answer
    with tempfile.TemporaryDirectory() as directory:
        home = Path(directory)
        (home / ".config" / "ICOtronic").mkdir(parents=True)
        (home / ".config" / "ICOtronic" / "config.yaml").write_text(CONFIGURATION)

        def ours() -> Cost:
            with _flood() as port:
                return _decode("bench.decode_ours", port, skipped, skipped + frames, core=core)

        def vendor() -> Cost:
            with _flood() as port:
                return _decode("bench.decode_vendor", skipped, skipped + frames, core=core,
                               environment={
                                   "HOME": str(home), "XDG_CONFIG_HOME": str(home / ".config"),
                                   "CAN_CONFIG": json.dumps({"host": "127.0.0.1", "port": port})})

        results = list(in_turn({"ours": ours, "other": vendor}, rounds))
    return Row.compare(NAME, UNIT, AIM, [result["ours"] for result in results],
                       [result["other"] for result in results])


@contextmanager
def _flood() -> Iterator[int]:
    """Serve frames without end; yield the port."""
    with Process("bench.server", "--rate", 1e6) as server:
        server.tell("find")
        yield int(server.line())


def _decode(module: str, *arguments: object, core: int | None,
            environment: dict[str, str] | None = None) -> Cost:
    with Process(module, *arguments, core=core, environment=environment) as client:
        seconds, frames, lost = client.line().split()
        if int(lost):
            raise client.failure(f"lost something, {lost} frames")
        return Cost(float(seconds) / int(frames) * 1e6, int(frames))
