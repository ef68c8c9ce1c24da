# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The tables of what the diagnostics say, against what running nodes publish."""

import ast
import json
import re
from contextlib import ExitStack
from pathlib import Path

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from nodes import NodeProcess, Process, Ros

from driver_common.health import GAP, pattern, unexplained
from sensor_tools.document import DRIVERS

ROOT = Path(__file__).resolve().parent.parent.parent
LEVELS = {getattr(DiagnosticStatus, level): level
          for level in ("OK", "WARN", "ERROR", "STALE")}
HEALTH = {driver.name: driver.health for driver in DRIVERS}
# Settings that are not as wanted; "check" leaves them so.
NODES = {
    "isys_radar": [
        {"serial_port": "sim://iSYS-4001", "config_mode": "check", "output1.range_max": 12.0},
        {"serial_port": "sim://iSYS-6003", "publish_range_list": True}],
    "icotronic": [{"can_interface": "sim", "config_mode": "check", "status_period": 0.5,
                   "adc.oversampling_rate": 128}],
    "uc4000": [{"serial_port": "{line}", "sensors": ["a", "b"], "groups": ["a b"],
                "a.address": 1, "b.address": 2, "config_mode": "check", "a.gain_db": 60.0}],
}
PIECES = re.compile(rf"{GAP}|,|(?=instead of)")  # where a message is put together
PACKAGES = {"isys_radar": "isys_radar_driver", "icotronic": "icotronic_driver",
            "uc4000": "uc4000_driver"}


@pytest.fixture
def ros():
    with Ros() as ros:
        yield ros


@pytest.fixture
def line(tmp_path):
    """Two ultrasonic sensors, one of which can be told to refuse."""
    link = tmp_path / "line"
    with Process("sensor_tools.simulate", "uc4000", "--addresses", "1,2", "--link",
                 str(link)) as process:
        process.wait_for_line("UC4000")
        yield process, str(link)


def start(name, link, directory):
    """Yield the nodes of a driver, which write recordings into a directory."""
    for number, parameters in enumerate(NODES[name]):
        given = json.loads(json.dumps(parameters).replace("{line}", link))
        given["recording_directory"] = str(directory)
        yield NodeProcess(f"{PACKAGES[name]}.program", given, "-r", f"__node:={name}_{number}")


@pytest.mark.parametrize("name", NODES)
def test_every_key_is_explained_and_every_explained_key_is_there(name, ros, line, tmp_path):
    simulator, link = line
    statuses = []
    ros.node.create_subscription(DiagnosticArray, "/diagnostics",
                                 lambda array: statuses.extend(array.status), 10)

    def missing():
        seen = {value.key for status in statuses for value in status.values}
        assert not unexplained(seen, HEALTH[name].keys)
        return {key.text for key in HEALTH[name].keys if unexplained(seen, [key]) == seen}

    with ExitStack() as stack:
        nodes = [stack.enter_context(node) for node in start(name, link, tmp_path)]
        for number, node in enumerate(nodes):
            node.wait_for_line("connected to")
            assert ros.remote(f"/{name}_{number}").trigger("save_recording").success
        ros.wait_until(lambda: missing() <= {"refusals: …"})
        if name == "uc4000":
            simulator.tell("refuse 0x0B")
            ros.wait_until(lambda: not missing())
    for level in LEVELS:
        messages = {status.message for status in statuses if status.level == level}
        rows = [state for state in HEALTH[name].states if state.level == LEVELS[level]]
        assert not unexplained(messages, rows, "; ")


@pytest.mark.parametrize("name", HEALTH)
def test_every_explained_message_is_one_of_the_code(name):
    folder = ROOT / PACKAGES[name]
    code = "\n".join(
        path.read_text() for path in (*folder.glob("*.py"), *(ROOT / "driver_common").glob("*.py"))
        if path.name != "health.py")
    code = re.sub(r'"\s+f?"', "", code)  # texts of several lines
    for state in HEALTH[name].states:
        for piece in filter(None, map(str.strip, PIECES.split(state.text))):
            assert piece in code, state.text


def said(path):
    """Yield each level and text, with gaps, that a file says together."""
    for tree in ast.walk(ast.parse(path.read_text())):
        parts = getattr(tree, "elts", None) or getattr(tree, "args", None)
        if not isinstance(parts, list) or len(parts) != 2:
            continue
        level, text = parts
        if isinstance(text, ast.Constant):
            text = ast.JoinedStr([text])
        if getattr(level, "attr", "") in LEVELS.values() and isinstance(text, ast.JoinedStr):
            yield level.attr, "".join(
                GAP if isinstance(part, ast.FormattedValue) else part.value for part in text.values)


@pytest.mark.parametrize("name", HEALTH)
def test_every_level_is_that_of_the_code(name):
    files = ROOT / PACKAGES[name] / "node", ROOT / "driver_common" / "device_node"
    pairs = [pair for file in files for pair in said(file.with_suffix(".py"))]
    assert len(pairs) >= 4
    for level, text in pairs:
        assert any(row.level == level and re.fullmatch(pattern(text), row.text)
                   for row in HEALTH[name].states), (level, text)


def test_gaps_stand_for_anything_but_nothing():
    rows = [key for key in HEALTH["uc4000"].keys if key.text == "refusals: …"]
    assert unexplained({"refusals: x", "refusals: ", "x"}, rows) == {"refusals: ", "x"}
