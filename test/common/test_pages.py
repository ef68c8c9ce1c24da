# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The pages: links lead somewhere, what they tell to run exists, and the site builds."""

import ast
import re
import subprocess
import sys
import unicodedata
from pathlib import Path

import click
import numpy as np
import pytest
from click.testing import CliRunner
from nodes import NodeProcess, Process

from msg_conversions.imu_batch import ImuBatchTemplate
from sensor_tools import simulate
from sensor_tools.bags import Record, write_bag
from sensor_tools.cli.program import sensors
from sensor_tools.document import DRIVERS

ROOT = Path(__file__).resolve().parent.parent.parent
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(DOCS.glob("*.md"))]
FENCE = re.compile(r"^( *)```(\S*).*?\n(.*?)^\1```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"!?\[(?:[^\[\]]|\[[^\]]*\])*\]\(([^)\s]+)\)")
PROGRAM = re.compile(r"(?:ros2 run industrial_sensor_drivers|\./dev run) ([\w./-]+)")
SENSORS = re.compile(r"(?:^|[`\s])sensors ([a-z-]+)((?:[^`\n|]|\\\n)*)")
OPTION = re.compile(r"(?<!\S)--[a-z][a-z-]*")
LAUNCHED = re.compile(r"ros2 launch industrial_sensor_drivers ([\w.]+)")
TOOLS = {"python", "pytest", "ruff", "mypy", "PROGRAM"}  # of the environment

PIECES = re.compile(r"…|(?=instead of)")  # where a message is put together

pages = pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)


def anchors(path):
    """Return the anchors of the headings of a page, as GitHub and MyST make them."""
    text = FENCE.sub("", path.read_text())
    for heading in re.findall(r"^#+ (.+)$", text, re.MULTILINE):
        words = "".join(character for character in heading.lower()
                        if character in " -_" or unicodedata.category(character)[0] in "LN")
        yield words.replace(" ", "-")


def commands(path):
    """Return all that a page tells to run, lines that go on joined."""
    return re.sub(r" *\\\n *", " ", path.read_text())


@pages
def test_links_and_pictures_resolve(path):
    for target in LINK.findall(FENCE.sub("", path.read_text())):
        if target.startswith(("https://", "http://")):
            continue
        file, _, anchor = target.partition("#")
        aim = (path.parent / file).resolve() if file else path
        assert aim.exists(), target
        assert not anchor or anchor in anchors(aim), target


@pages
def test_programs_that_it_names_exist(path):
    text = commands(path)
    programs = set(re.findall(r'"(\w+) = ', (ROOT / "setup.py").read_text()))
    assert set(PROGRAM.findall(text)) <= programs | TOOLS
    for name in LAUNCHED.findall(text):
        assert (ROOT / "launch" / name).exists(), name
    for name in re.findall(r"(?<![\w/])config/[\w.]+", text):
        assert (ROOT / name).exists(), name
    for name in re.findall(r"simulate (\w+) --", text):
        assert name in simulate.FAMILIES, name


@pages
def test_subcommands_and_options_of_sensors_exist(path):
    for name, rest in SENSORS.findall(commands(path)):
        command = sensors.get_command(click.Context(sensors), name)
        if command is None:  # a sentence about sensors
            assert not OPTION.search(rest), name
            continue
        known = {option for parameter in command.params
                 for option in (*parameter.opts, *parameter.secondary_opts)}
        assert set(OPTION.findall(rest)) <= known, (name, rest)


@pages
def test_parameters_and_services_that_it_names_exist(path):
    text = commands(path)
    rows = {driver.name: {*(option.name for option in driver.options), *driver.node.ALL_SETTINGS}
            for driver in DRIVERS}
    for node, name in re.findall(r"ros2 param (?:set|get|describe) /(\w+) ([\w.]+)", text):
        assert name in rows[node] or name.partition(".")[2] in rows[node], name
    code = "\n".join(file.read_text() for file in (
        *ROOT.glob("*_driver/node.py"), *(ROOT / "driver_common").glob("*node*.py")))
    for name in re.findall(r"ros2 service call /\w+/(\w+)", text):
        assert re.search(f'["/]{name}"', code), name


@pytest.mark.parametrize("driver", DRIVERS, ids=lambda driver: driver.name)
def test_a_driver_has_a_page_with_all_that_its_users_ask_for(driver):
    text = (DOCS / f"{driver.page}.md").read_text()
    headings = re.findall(r"^## (.+)$", text, re.MULTILINE)
    wanted = ["Wiring", "First start", "Topics", "Parameters of the driver", "Services",
              "Diagnostics", "When something is wrong", "Timing", "Limits", "Without hardware"]
    assert [heading for heading in headings if heading in wanted] == wanted
    for topic, (kind, _) in driver.node.TOPICS.items():
        topic = re.sub(r"^channel_[yz]", "channel_x", topic)
        assert re.search(rf"`~/{topic}`[^|]*\| \w+/{kind.__name__} \|", text), topic
    text += (DOCS / "recordings.md").read_text()
    for option in driver.options:
        name = re.sub(r"^channel\.[xyz](?=\.[uv])", "", option.name)  # a row that has several
        name = re.sub(r"^channel\.[yz]", "channel.x", name)
        assert re.search(rf"\b{re.escape(name)}\b|`{re.escape(name)}`", text), option.name


@pytest.mark.parametrize("driver", DRIVERS, ids=lambda driver: driver.name)
def test_the_messages_of_its_failure_table_are_in_the_code(driver):
    page = (DOCS / f"{driver.page}.md").read_text()
    head = "| what you see | what it means | what to do |"
    rows = page.partition(head)[2].partition("\n\n")[0].splitlines()[2:]
    assert len(rows) > 10
    code = "\n".join(path.read_text() for folder in (f"{driver.name}_driver", "driver_common")
                     for path in (ROOT / folder).glob("*.py") if path.name != "health.py")
    code = re.sub(r'"\s+f?"', "", code)  # texts of several lines
    for row in rows:
        for message in re.findall(r"`([^`]+)`", row.split(" | ")[0]):
            for piece in filter(None, map(str.strip, PIECES.split(message))):
                assert piece in code, message


def test_the_spectrum_finds_what_vibrates(tmp_path, monkeypatch, capsys):
    """The lines of the page itself, on a bag with lost samples."""
    pytest.importorskip("rosbags", reason="rosbags comes with ./dev")
    page = (DOCS / "record_and_analyse.md").read_text()
    (lines,) = (code for _, language, code in FENCE.findall(page) if language == "python")
    assert len([line for line in lines.splitlines()
                if line and not line.startswith(("import", "print"))]) == 10
    start, rate = 1_795_000_000_123_456_789, 9524.0
    numbers = np.delete(np.arange(2 * 9524), np.s_[5000:5003])
    stamps = start + np.round(numbers / rate * 1e9).astype(np.int64)
    wave = np.zeros((len(stamps), 3), np.float32)
    wave[:, 0] = 9.81 + 4.0 * np.sin(2 * np.pi * 437.0 * numbers / rate)
    template = ImuBatchTemplate("imu_link")
    with write_bag(tmp_path / "my_bag") as write:
        for part in np.array_split(np.arange(len(stamps)), 100):
            write(Record("/icotronic/imu/batch", "sensor_msgs/msg/PointCloud2",
                         template.serialised(stamps[part], wave[part]), int(stamps[part[-1]])))
    monkeypatch.chdir(tmp_path)
    exec(compile(lines, "record_and_analyse.md", "exec"), {})
    amplitude, frequency = map(float, re.fullmatch(
        r"strongest: ([\d.]+) m/s² at ([\d.]+) Hz\n", capsys.readouterr().out).groups())
    assert amplitude == pytest.approx(4.0, rel=0.02)
    assert frequency == pytest.approx(437.0, abs=0.5)


def test_a_spectrum_can_be_made_from_csv(tmp_path, monkeypatch):
    page = (DOCS / "record_and_analyse.md").read_text()
    (line,) = re.findall(r"`(times, x = np.loadtxt.*?)`", page)
    monkeypatch.chdir(tmp_path)
    assert CliRunner().invoke(sensors, [
        "record", "spindle.csv", "--can", "sim", "--duration", "0.5"]).exit_code == 0
    found = {"np": np}
    exec(line, found)
    assert len(found["times"]) == len(found["x"]) > 100
    assert np.all(np.diff(found["times"]) > 0)


def test_commands_of_the_vendors_tool_are_those_that_it_has():
    parse = pytest.importorskip("icotronic.cmdline.parse", reason="the vendor's tool is not here")
    commands = re.findall(r"`icon ([^`]+)`", (DOCS / "from_vendor_tool.md").read_text())
    assert {command.split()[0] for command in commands} == {
        "list", "measure", "dataloss", "rename", "stu", "config"}
    for command in commands:
        arguments = command.split()
        if arguments[0] in ("measure", "dataloss") and "--name" not in arguments:
            arguments += "--name", "Spindle"  # it always wants one
        parse.create_icon_parser().parse_args(arguments)


@pytest.mark.parametrize(("family", "arguments", "module", "sensors"), [
    ("isys", ("--model", "iSYS-4001,iSYS-4001", "--address", "128,129"),
     "isys_radar_driver.program", ("front", "rear")),
    ("uc4000", ("--addresses", "1,2,3,4,5"), "uc4000_driver.program",
     ("left", "right", "front", "rear", "tank"))])
def test_the_shipped_file_of_a_wire_finds_its_sensors(family, arguments, module, sensors, tmp_path):
    """The command line of the page, but for the program that starts the node."""
    line = str(tmp_path / "line")
    (file,) = (ROOT / "config").glob(f"{family}*_on_one_line.yaml")
    page = (DOCS / "several_sensors.md").read_text()
    assert f"simulate {family} {' '.join(arguments)} --link" in page
    assert file.name in page
    with Process("sensor_tools.simulate", family, *arguments, "--link", line) as simulator:
        simulator.wait_for_line(line)
        with NodeProcess(module, None, "--params-file", str(file), "-p",
                         f"serial_port:={line}") as node:
            for sensor in sensors:
                node.wait_for_line(f"{sensor}: connected to")
            node.stop()


def test_python_in_pages_is_python():
    for path in PAGES:
        for _, language, code in FENCE.findall(path.read_text()):
            if language == "python" and path.name != "CONTRIBUTING.md":  # there it is rows
                ast.parse(code)


def test_the_site_builds_without_a_warning(tmp_path):
    pytest.importorskip("myst_parser", reason="Sphinx and MyST come with ./dev")
    result = subprocess.run(
        [sys.executable, "-m", "sphinx", "-b", "html", "-E", "-W", "--keep-going", "-q",
         "-d", str(tmp_path / "doctrees"), str(DOCS), str(tmp_path / "site")],
        capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    assert all((tmp_path / "site" / f"{page.stem}.html").exists() for page in DOCS.glob("*.md"))
