# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Files beside the code: they fit the tables of the drivers, and the programs that read them."""

import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from sensor_tools import document

ROOT = Path(__file__).resolve().parent.parent.parent
PARAMETER_FILES = [
    path for path in sorted((ROOT / "config").glob("*.yaml"))
    if "/**:" in path.read_text()  # else of other nodes: diagnostic_aggregator
]
DRIVERS = {driver.name: driver for driver in document.DRIVERS}


def parameters(text):
    """Return what a parameter file says, and to which node."""
    ((node, content),) = yaml.safe_load(text).items()
    assert node == "/**"
    assert list(content) == ["ros__parameters"]
    return content["ros__parameters"]


def driver_of(path):
    """Return the driver whose name the file begins with, in the singular or the plural."""
    return next(d for name, d in DRIVERS.items() if path.stem.replace("radars", "radar", 1)
                .startswith(name))


def rows(driver):
    """Return all rows of a driver by name."""
    options = {option.name: option for option in driver.options}
    return {**driver.node.ALL_SETTINGS, **options}


def test_they_are_up_to_date(capsys):
    assert document.main(["--check"]) == 0, capsys.readouterr().out


def test_a_stale_one_is_named(monkeypatch, capsys):
    monkeypatch.setattr(document, "documents", lambda: {ROOT / "README.rst": "?"})
    assert document.main(["--check"]) == 1
    assert capsys.readouterr().out == (
        "README.rst is stale\nRun 'python -m sensor_tools.document'.\n"
    )


@pytest.mark.parametrize("name", DRIVERS)
@pytest.mark.parametrize("word", ["-h", "--help"])
def test_a_node_tells_its_topics_and_parameters_without_the_middleware(name, word):
    program = ("import rclpy; rclpy.init = None; "
               f"from industrial_sensor_drivers.programs import {name}_node; {name}_node()")
    done = subprocess.run([sys.executable, "-c", program, word], cwd=ROOT, text=True, timeout=60,
                          capture_output=True)
    assert (done.returncode, done.stderr) == (0, "")
    usage, _, described = done.stdout.partition("\n")
    assert usage.startswith(f"usage: ros2 run industrial_sensor_drivers {name}_node ")
    for topic in DRIVERS[name].node.TOPICS:
        assert f"  ~/{topic} " in described
    driver = DRIVERS[name]
    for row in (*(option.name for option in driver.options),
                *filter(driver.variants, driver.node.ALL_SETTINGS)):
        assert re.search(rf"^ +(# )?{re.escape(row)}: ", described, re.MULTILINE), row


@pytest.mark.parametrize("path", PARAMETER_FILES, ids=lambda path: path.name)
def test_a_parameter_file_holds_what_the_driver_has(path):
    values = parameters(path.read_text())
    known = rows(driver_of(path))
    for name, value in values.items():
        sensor, _, rest = name.partition(".")
        row = known[rest if sensor in values.get("sensors", ()) else name]
        assert type(value) is row.kind, name
        row.check(value)


@pytest.mark.parametrize("driver", DRIVERS.values(), ids=DRIVERS)
def test_every_line_of_a_made_file_may_be_used(driver):
    text = re.sub(r"^    # ([a-z0-9_.]+:) ", r"    \1 ", document.parameter_file(driver),
                  flags=re.MULTILINE)
    values = parameters(text)
    settings = {name for name in driver.node.ALL_SETTINGS if driver.variants(name)}
    assert set(values) == settings | {option.name for option in driver.options}
    for name, value in values.items():
        for row in driver.variants(name).values() or [rows(driver)[name]]:
            assert type(value) is row.kind, name
            assert row.check(value) == value, name


@pytest.mark.parametrize("driver", DRIVERS.values(), ids=DRIVERS)
def test_every_setting_is_listed(driver):
    listed = set()
    for name, numbers in re.findall(r"^\| `([\w.]+)`(?:, N = ([\d, ]+))? \|",
                                    document.table(driver), re.MULTILINE):
        listed |= {name.replace("N", number) for number in numbers.split(", ")}
    assert listed == set(rows(driver))


@pytest.mark.parametrize(
    ("rows_", "text"),
    [
        (("output1.range_min", "output3.range_min"), "`outputN.range_min`, N = 1, 2, 3"),
        (("output1.temperature_threshold_celsius",), "`output1.temperature_threshold_celsius`"),
    ],
)
def test_settings_that_differ_by_a_number_share_a_line(rows_, text):
    lines = [line for line in document.table(DRIVERS["isys_radar"]).splitlines() if text in line]
    assert len(lines) == 1
    assert all(name in DRIVERS["isys_radar"].node.ALL_SETTINGS for name in rows_)


@pytest.mark.parametrize("name", DRIVERS)
def test_launch_files_start_what_there_is(name):
    path = ROOT / "launch" / f"{name}.launch.py"
    text = path.read_text()
    compile(text, str(path), "exec")
    assert [(f"{name}_node", name)] == re.findall(r'describe_driver\("(\w+)", "(\w+)"', text)
    assert f'"{name}_node = ' in (ROOT / "setup.py").read_text()
    assert (ROOT / "config" / f"{name}.yaml").exists()


OF_A_NODE = {"params_file", "namespace", "name"}


@pytest.mark.parametrize(("name", "wanted"), [
    ("isys_radar", {*OF_A_NODE, "serial_port"}), ("uc4000", {*OF_A_NODE, "serial_port"}),
    ("icotronic", {*OF_A_NODE, "can_interface", "can_channel"}),
    ("lifecycle", {*OF_A_NODE, "driver", "port"}), ("record", {"output", "topics", "qos_file"}),
    ("diagnostics", {"params_file"}), ("description", {"model"})])
def test_launch_files_have_arguments(name, wanted):
    pytest.importorskip("launch_ros.actions", reason="launch comes with a sourced ROS only")
    content = runpy.run_path(str(ROOT / "launch" / f"{name}.launch.py"))
    arguments = content["generate_launch_description"]().get_launch_arguments()
    assert {argument.name for argument in arguments} == wanted


@pytest.mark.parametrize("path", [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))],
                         ids=lambda path: path.name)
def test_every_table_has_a_head(path):
    lines = ["", *path.read_text().splitlines(), ""]
    for before, line, after in zip(lines, lines[1:], lines[2:], strict=False):
        if line.startswith("|") and not before.startswith("|"):
            assert after.startswith("| ---"), f"{line} stands below an empty line"
