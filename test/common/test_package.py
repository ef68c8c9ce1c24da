# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The package as its user gets it: built by colcon, found by ROS, started where it is installed."""

import ast
import importlib.metadata
import os
import shutil
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from catkin_pkg.package import InvalidPackage, parse_package

PACKAGE = "industrial_sensor_drivers"
ROOT = Path(__file__).resolve().parent.parent.parent
DEADLINE = 120  # seconds


def call(*command, **options):
    """Run a command to its end and return what it printed; a failure shows all its output."""
    done = subprocess.run(
        [str(word) for word in command], capture_output=True, text=True, check=False, **options
    )
    assert done.returncode == 0, f"{command} failed:\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    """A copy of the checkout, because building leaves files beside the sources."""
    copy = tmp_path_factory.mktemp("workspace") / PACKAGE
    made_files = (".*", "__pycache__", "*.egg-info", "build", "install", "log")
    return Path(shutil.copytree(ROOT, copy, ignore=shutil.ignore_patterns(*made_files)))


@pytest.fixture(scope="module")
def environment(tmp_path_factory):
    """The environment of a user: the checkout is not importable, colcon has its own settings."""
    paths = [p for p in os.environ.get("PYTHONPATH", "").split(":") if p and Path(p) != ROOT]
    colcon_home = str(tmp_path_factory.mktemp("colcon"))
    return {**os.environ, "PYTHONPATH": ":".join(paths), "COLCON_HOME": colcon_home}


@pytest.fixture(scope="module")
def colcon(tmp_path_factory, environment):
    """Run colcon with the Python of the tests, which it then uses for what it installs."""
    python = Path(sys.executable)
    if " " in str(python):  # colcon writes the path where it must not hold a space
        link = tmp_path_factory.mktemp("python") / "environment"
        link.symlink_to(sys.prefix)
        python = link / python.relative_to(sys.prefix)
    main = "import sys; from colcon_core.command import main; sys.exit(main())"

    def run(workspace, *arguments):
        words = ("--log-base", workspace / "log", *arguments)
        return call(python, "-c", main, *words, cwd=workspace, env=environment)

    return run


@pytest.fixture(scope="module")
def install(sources, colcon):
    """The directory into which colcon installed the package."""
    colcon(sources.parent, "build")
    return sources.parent / "install"


@pytest.fixture
def start(install, environment):
    """Start a command with the installed package set up; it is ended with the test."""
    processes = []

    def start_one(*command):
        shell = ["sh", "-c", '. "$0" && exec "$@"', install / "local_setup.sh", *command]
        process = subprocess.Popen(
            shell, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        processes.append(process)
        return process

    yield start_one
    for process in processes:
        process.kill()
        process.communicate()


def wait_for_line(process, text):
    """Return when the process prints a line with the text; all it printed tells why it did not."""
    lines = []
    alarm = threading.Timer(DEADLINE, process.kill)
    alarm.start()
    try:
        for line in process.stdout:
            lines.append(line)
            if text in line:
                return
    finally:
        alarm.cancel()
    pytest.fail(f"{text!r} was not printed within {DEADLINE} s:\n{''.join(lines)}")


def installed_programs(install):
    """Return the programs that setup.py names, from the metadata of the installed package."""
    site_packages = next((install / PACKAGE / "lib").glob("python3*/site-packages"))
    (distribution,) = importlib.metadata.distributions(path=[str(site_packages)])
    return {point.name for point in distribution.entry_points.select(group="console_scripts")}


def test_package_xml_is_valid():
    warnings = []
    package = parse_package(str(ROOT / "package.xml"), warnings=warnings)
    assert warnings == []
    assert package.name == PACKAGE
    assert package.get_build_type() == "ament_python"


def test_an_invalid_address_would_be_noticed(tmp_path):
    # colcon says nothing about it and installs the programs where ros2 run does not look.
    text = (ROOT / "package.xml").read_text()
    (tmp_path / "package.xml").write_text(text.replace("@example.com", "@localhost"))
    with pytest.raises(InvalidPackage, match="email"):
        parse_package(str(tmp_path / "package.xml"))


def test_package_xml_and_setup_py_agree(sources):
    package = parse_package(str(sources / "package.xml"))
    fields = ["name", "version", "license", "maintainer", "maintainer-email", "description"]
    printed = call(sys.executable, "setup.py", *(f"--{field}" for field in fields), cwd=sources)
    assert printed.splitlines() == [
        package.name,
        package.version,
        *package.licenses,
        *(person.name for person in package.maintainers),
        *(person.email for person in package.maintainers),
        package.description,
    ]


KEYS = {"can": "python3-can", "catkin_pkg": "python3-catkin-pkg", "click": "python3-click",
        "hypothesis": "python3-hypothesis", "numpy": "python3-numpy", "pytest": "python3-pytest",
        "rich": "python3-rich", "scipy": "python3-scipy", "serial": "python3-serial",
        "yaml": "python3-yaml"}  # of rosdep, for what is imported under another name


def imported_when_collected(path):
    """Return what a file imports outside of functions."""
    nodes = ast.parse(path.read_text(encoding="utf-8")).body
    return {
        name.partition(".")[0]
        for node in nodes if isinstance(node, (ast.Import, ast.ImportFrom))
        for name in ([node.module] if isinstance(node, ast.ImportFrom)
                     else [alias.name for alias in node.names])
    }


def test_rosdep_brings_what_tests_import_or_they_are_skipped():
    # One module that is missing would keep "colcon test" from running any test.
    package = parse_package(str(ROOT / "package.xml"))
    promised = {each.name for each in package.exec_depends + package.test_depends}
    files = list(ROOT.glob("test/**/*.py"))
    ours = {path.stem for path in files} | {path.parent.name for path in ROOT.glob("*/__init__.py")}
    assert len(files) > 50
    for path in files:
        for name in imported_when_collected(path) - ours - sys.stdlib_module_names:
            assert KEYS.get(name, name) in promised, f"{path} imports {name}"


def test_colcon_takes_it_for_a_ros_package(sources, colcon):
    assert colcon(sources.parent, "list").split() == [PACKAGE, PACKAGE, "(ros.ament_python)"]


@pytest.mark.timeout(180)
@pytest.mark.parametrize("pattern", [
    "package.xml", "launch/*.py", "config/*.yaml", "config/*/*", "layouts/*", "rviz/*.rviz",
    "urdf/*.xacro"])
def test_shared_files_are_installed(install, pattern):
    share = install / PACKAGE / "share" / PACKAGE
    wanted = {path.relative_to(ROOT): path.read_bytes() for path in ROOT.glob(pattern)}
    assert wanted == {p.relative_to(share): p.read_bytes() for p in share.glob(pattern)}


@pytest.mark.timeout(180)
def test_ros_finds_the_installed_package(start, install):
    code = f"from ament_index_python import *; print(get_package_prefix({PACKAGE!r}))"
    printed, _ = start(sys.executable, "-c", code).communicate(timeout=DEADLINE)
    assert printed.splitlines()[-1] == str(install / PACKAGE)


@pytest.mark.timeout(180)
def test_every_program_is_installed_where_ros2_run_looks(install):
    directory = install / PACKAGE / "lib" / PACKAGE
    assert {path.name for path in directory.iterdir()} == installed_programs(install)
    assert all(os.access(path, os.X_OK) for path in directory.iterdir())


@pytest.fixture
def among_others(start, install, tmp_path):
    """Start an installed program where other packages have each of our names, and come first."""
    for path in ROOT.glob("*/__init__.py"):
        if path.parent.name != PACKAGE:
            (tmp_path / path.parent.name).mkdir()
            (tmp_path / path.parent.name / "__init__.py").write_text("raise SystemExit('not ours')")

    def start_one(program, *arguments):
        shell = ["sh", "-c", 'PYTHONPATH="$0:$PYTHONPATH" exec "$@"', tmp_path]
        return start(*shell, install / PACKAGE / "lib" / PACKAGE / program, *arguments)

    return start_one


@pytest.mark.timeout(180)
def test_programs_find_what_is_theirs(among_others, install):
    tools = [name for name in installed_programs(install) if not name.endswith("_node")]
    assert len(tools) > 5
    for process in [among_others(name, "--help") for name in tools]:
        printed, _ = process.communicate(timeout=DEADLINE)
        assert process.returncode == 0, printed
        assert "usage" in printed.lower()


@pytest.mark.timeout(180)
@pytest.mark.parametrize(("program", "parameter"), [
    ("icotronic_node", "can_channel"), ("isys_radar_node", "serial_port"),
    ("uc4000_node", "serial_port")])
def test_nodes_find_what_is_theirs(among_others, program, parameter):
    process = among_others(program, "--ros-args", "-p", f"{parameter}:=does_not_exist")
    wait_for_line(process, "does_not_exist")


@pytest.mark.timeout(180)
def test_tests_are_not_installed(install):
    site_packages = next((install / PACKAGE / "lib").glob("python3*/site-packages"))
    packages = {path.parent.name for path in site_packages.glob("*/__init__.py")}
    assert packages == {path.parent.name for path in ROOT.glob("*/__init__.py")} - {"test", "bench"}


@pytest.mark.timeout(180)
def test_the_installed_radar_node_starts_and_stops(start, install):
    program = install / PACKAGE / "lib" / PACKAGE / "isys_radar_node"
    node = start(program, "--ros-args", "-p", "serial_port:=/dev/does_not_exist")
    wait_for_line(node, "/dev/does_not_exist")
    node.send_signal(signal.SIGINT)
    rest, _ = node.communicate(timeout=DEADLINE)
    assert node.returncode == 0, rest
