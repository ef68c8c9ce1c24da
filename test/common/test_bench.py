"""The benchmark runs, and both sides of each comparison do the same work. How fast is not asked."""

import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent
AIMS = {"decode": 0.4, "can to imu, idiomatic": 0.4, "can to imu, bare loop": 1.25,
        "highest rate without a loss": 8}


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    file = tmp_path_factory.mktemp("bench") / "results.json"
    done = subprocess.run([sys.executable, "-m", "bench", "--quick", "--json", file], cwd=ROOT,
                          timeout=55, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    rows = json.loads(file.read_text())
    for row in rows:
        assert row["name"] in done.stdout
    return {row["name"]: row for row in rows}


def test_each_comparison_has_a_row(rows):
    assert {name: row["aim"] for name, row in rows.items()} == AIMS


@pytest.mark.parametrize("name", AIMS)
def test_a_row_says_what_was_measured(rows, name):
    row = rows[name]
    if name == "decode" and importlib.util.find_spec("icotronic") is None:
        assert row["ours"] is row["other"] is row["ratio"] is row["met"] is None
        assert row["note"].startswith("not measured: ")
        return
    assert row["unit"]
    assert row["ratio"] == pytest.approx(row["ours"] / row["other"])  # of a single round
    met = row["ratio"] >= row["aim"] if row["at_least"] else row["ratio"] <= row["aim"]
    assert row["met"] is met
    ours, other = row["processed"]
    assert ours == other > 0
