# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The benchmark runs, and both sides of each comparison do the same work. How fast is not asked."""

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from bench import measure
from bench.__main__ import STEPS
from bench.measure import Cost, ForeignLoad, Row

ROOT = Path(__file__).resolve().parent.parent.parent
AIMS = {  # of the steps that the suite has time for: one of each kind
    "decoding": {"decode": 0.3},
    "samples": {"can to imu, idiomatic": 0.35, "can to imu, bare loop": 1.15},
    "stamps": {"error of stamps, jitter of 2 ms": 0.1, "error of stamps, polls of 16 ms": 0.1},
    "latency": {"radar, last byte to cloud": 1.0},
    "lines": {"CPU per measurement, 2 × uc4000": 1.2},
}
SAME_WORK = ("decoding", "samples")
TOO_BUSY = "lost something"  # what the bench says of a machine that could not follow


@pytest.mark.timeout(180)  # a busy machine takes long to start so many processes
@pytest.mark.parametrize("step", AIMS)
def test_a_step_tells_what_was_measured(step, tmp_path):
    assert step in STEPS
    file = tmp_path / "results.json"
    done = subprocess.run(
        [sys.executable, "-m", "bench", "--quick", "--only", step, "--json", file], cwd=ROOT,
        timeout=170, capture_output=True, text=True, check=False)
    if done.returncode and TOO_BUSY in done.stderr:
        pytest.skip("this machine is too busy for a comparison in which nothing may get lost")
    assert done.returncode == 0, done.stderr
    rows = json.loads(file.read_text())
    assert {row["name"]: row["aim"] for row in rows} == AIMS[step]
    for row in rows:
        assert row["name"] in done.stdout
        # test/icotronic/ looks like a package of that name, but has no such module.
        if step == "decoding" and importlib.util.find_spec("icotronic.can") is None:
            assert row["ours"] is row["other"] is row["figure"] is row["met"] is None
            assert "icotronic is not installed" in row["note"]
            continue
        assert row["unit"]
        assert 0 <= row["foreign"] <= 1
        ours, other = row["processed"]
        assert ours > 0
        assert ours == other or step not in SAME_WORK


# --- what is made of the measurements ------------------------------------------------------------

def costs(*values):
    return [Cost(value, 10) for value in values]


def test_the_figure_of_a_row_is_the_median_of_the_rounds():
    row = Row.compare("a", "µs", 0.5, costs(1, 2, 9), costs(4, 4, 10))
    assert (row.ours, row.other, row.figure, row.spread) == (2, 4, 0.5, (0.25, 0.9))
    assert row.met
    assert row.processed == (30, 30)
    assert not Row.compare("a", "µs", 0.4, costs(1, 2, 9), costs(4, 4, 10)).met
    assert Row.compare("a", "s", 1.0, costs(3, 5), costs(2, 4.5), difference=True).figure == 0.75
    assert not Row.compare("a", "×", 0.85, costs(4), costs(5), at_least=True).met


def test_a_busy_machine_is_told_with_the_verdict():
    row = Row.compare("a", "µs", 0.5, costs(1), costs(4))
    row.foreign = 0.01
    assert row.verdict == "yes"
    row.foreign = 0.3
    assert row.verdict == "yes (busy: 30% by others)"
    assert Row("a", "µs", 0.5, note="no such thing").verdict == "not measured: no such thing"


def test_the_load_of_others_is_what_is_neither_idle_nor_ours(monkeypatch, tmp_path):
    stat = tmp_path / "stat"
    monkeypatch.setattr(measure, "STAT", stat)
    monkeypatch.setattr(measure, "TICKS", 100)
    own = iter([(1.0, 0.5, 2.0, 0.5, 0), (1.2, 0.5, 2.2, 0.6, 0)])
    monkeypatch.setattr(os, "times", lambda: next(own))
    stat.write_text("cpu  1000 0 500 8000 100 0 0 0 0 0\ncpu0 …\n")
    with ForeignLoad() as load:  # in which 4 s pass, 2 of them busy, half a second with ours
        stat.write_text("cpu  1120 0 560 8190 110 10 5 5 0 0\ncpu0 …\n")
    assert load.share == pytest.approx(1.5 / 4)
