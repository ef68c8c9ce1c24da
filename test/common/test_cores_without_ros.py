# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The architecture: cores run without ROS, drivers do not know each other, imports go one way."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent
DRIVERS = sorted(path.name for path in ROOT.glob("*_driver") if (path / "__init__.py").exists())
ROS_FILES = {"node.py", "device_node.py", "diagnostics.py", "node_recorder.py",
             "parameter_node.py", "parameters.py"}
ROS_NAMES = ("rclpy", "rcl_interfaces", "builtin_interfaces", "std_srvs", "launch", "launch_ros",
             "ament_index_python", "rosidl_runtime_py", "rosbag2_py")


def is_ros(module):
    top = module.partition(".")[0]
    return top in ROS_NAMES or top.endswith("_msgs")


def files_of(*packages):
    return [path for package in packages for path in sorted((ROOT / package).glob("**/*.py"))]


def imports_of(path):
    """Return the modules that a file imports, also those that a function imports."""
    modules = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            modules |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path} imports relative to itself"
            modules |= {f"{node.module}.{alias.name}" for alias in node.names}
    return modules


def packages_of(path):
    return {module.partition(".")[0] for module in imports_of(path)}


CORES = [path for path in files_of("driver_common", *DRIVERS) if path.name not in ROS_FILES]
CORE_MODULES = [".".join(path.relative_to(ROOT).with_suffix("").parts) for path in CORES]


def identity(path):
    return str(path.relative_to(ROOT))


@pytest.mark.parametrize("path", CORES, ids=identity)
def test_a_core_imports_no_ros(path):
    assert not [module for module in imports_of(path) if is_ros(module)]
    assert not packages_of(path) & {"msg_conversions", "sensor_tools"}
    in_common = [module for module in imports_of(path) if module.startswith("driver_common.")]
    assert not {f"{module.split('.')[1]}.py" for module in in_common} & ROS_FILES


@pytest.mark.parametrize("driver", DRIVERS)
def test_a_driver_imports_no_other_driver(driver):
    others = set(DRIVERS) - {driver}
    for path in files_of(driver):
        assert not packages_of(path) & others, path


def test_what_drivers_share_imports_no_driver():
    for path in files_of("driver_common", "msg_conversions"):
        assert not packages_of(path) & {*DRIVERS, "sensor_tools"}, path
    for path in files_of("msg_conversions"):
        assert "driver_common" not in packages_of(path), path


@pytest.mark.parametrize("driver", DRIVERS)
def test_imports_within_a_driver_go_one_way(driver):
    for path in files_of(driver):
        if path.name != "node.py":
            assert f"{driver}.node" not in {module.rpartition(".")[0] for module in
                                            imports_of(path)} | imports_of(path), path
    codecs = ("frames", "telegram", "identifier", "commands", "targets", "streaming", "models",
              "settings", "eeprom")
    for path in files_of(driver):
        if path.stem in codecs:
            assert not {"time", "threading", "socket", "serial", "can"} & packages_of(path), path


WITHOUT_ROS = """
import importlib, sys

class NoRos:
    def find_spec(self, name, path=None, target=None):
        top = name.partition(".")[0]
        if top in %r or top.endswith("_msgs"):
            raise ModuleNotFoundError(f"{name} is blocked")

sys.meta_path.insert(0, NoRos())
for module in %r:
    importlib.import_module(module)
try:
    import rclpy
except ModuleNotFoundError:
    pass
else:
    raise SystemExit("rclpy is not blocked")
"""

RADAR_SESSION = """
import time
from isys_radar_driver.radar import Options
from isys_radar_driver.listener import Listener
from isys_radar_driver.session import RadarBus
from isys_radar_driver.simulator.line import simulated_line

class Printer(Listener):
    lists = 0
    def on_found(self, radar):
        print(radar.identity)
    def on_target_list(self, radar, targets, stamp):
        self.lists += 1

line, (simulated,) = simulated_line(["iSYS-4001"])
line.start()
listener = Printer()
bus = RadarBus(line.port, 0, [Options(wanted={"output1.range_max": 42.0})], listener)
bus.open()
bus.set_active(True)
while listener.lists < 3:
    time.sleep(bus.poll())
bus.close()
line.close()
print(simulated.value("output1.range_max"), simulated.measuring)
"""


def run(code):
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT,
                          timeout=15, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_every_core_can_be_imported_without_ros():
    assert run(WITHOUT_ROS % (ROS_NAMES, CORE_MODULES)) == []


def test_a_radar_can_be_used_without_ros():
    assert run(WITHOUT_ROS % (ROS_NAMES, CORE_MODULES) + RADAR_SESSION) == [
        "iSYS-4001 000001, firmware 1.310", "42.0 False"]


@pytest.mark.parametrize("driver", DRIVERS)
def test_a_node_loads_its_simulator_only_to_use_it(driver):
    code = (f"import sys, {driver}.node; "
            "print([name for name in sys.modules if 'simulator' in name])")
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True,
                          check=True)
    assert done.stdout == "[]\n"
