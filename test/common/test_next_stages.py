# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What others make of our messages, by their own rules, which are written here in our words.

The rules are those of diagnostic_aggregator (GenericAnalyzer, StatusItem), nav2_costmap_2d
(RangeSensorLayer), imu_filter_madgwick and robot_localization, as their sources have them.
"""

import math
import subprocess
import sys
from dataclasses import make_dataclass
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import yaml
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from nodes import NodeProcess, Ros
from sensor_msgs.msg import Imu, Range

from driver_common.diagnostics import LATEST, PERIOD
from msg_conversions.imu import to_imu, variances_of
from msg_conversions.point_cloud import to_point_cloud
from msg_conversions.range import NO_ECHO_VALUES, published_distance, to_range

ROOT = Path(__file__).resolve().parent.parent.parent
CONFIG = ROOT / "config"
EXAMPLES = CONFIG / "next_stages"
NODES = ("isys_radar", "icotronic", "uc4000")
OK, ERROR, STALE = (ord(level) for level in (
    DiagnosticStatus.OK, DiagnosticStatus.ERROR, DiagnosticStatus.STALE))


def example(name, node):
    """Return the parameters of a node in an example."""
    return yaml.safe_load((EXAMPLES / f"{name}.yaml").read_text())[node]["ros__parameters"]


# --- diagnostic_aggregator ---


class GenericAnalyzer:
    """Takes the statuses that match, and reports each, and the worst of them."""

    def __init__(self, parameters):
        assert parameters["type"] == "diagnostic_aggregator/GenericAnalyzer"
        assert all(isinstance(parameters.get(key, []), list) for key in ("startswith", "contains"))
        assert isinstance(parameters.get("timeout", 5.0), float)  # another type ends the aggregator
        self.parameters, self.items = parameters, {}

    def match(self, name):
        return (any(name.startswith(text) for text in self.parameters.get("startswith", []))
                or any(text in name for text in self.parameters.get("contains", [])))

    def analyze(self, name, level, now):
        self.items[name] = level, now

    def report(self, now):
        """Return the level of all together, and of each item by its name for people."""
        levels, worst = {}, OK
        for name, (level, updated) in self.items.items():
            stale = now - updated > self.parameters.get("timeout", 5.0)
            levels[name.replace("/", " ")] = STALE if stale else level
            worst = STALE if stale else max(worst, level)
        if all(level == STALE for level in levels.values()):
            return STALE, levels
        return (ERROR if worst == STALE else worst), levels


@pytest.fixture
def analyzers():
    ((node, content),) = yaml.safe_load((CONFIG / "diagnostics.yaml").read_text()).items()
    assert node == "analyzers"  # the name that the aggregator gives itself
    parameters = content["ros__parameters"]
    return {name: GenericAnalyzer(parameters[name]) for name in NODES}


@pytest.mark.parametrize("node", NODES)
@pytest.mark.parametrize("name", ["{}: {}", "{}: front", "car/{}: rear", "a/b/{}: {}"])
def test_one_analyzer_takes_each_status(analyzers, node, name):
    name = name.replace("{}", node)
    assert [key for key, analyzer in analyzers.items() if analyzer.match(name)] == [node]


def test_no_analyzer_takes_those_of_others(analyzers):
    for name in ("camera: isys_radar", "icotronic_2: x", "controller_manager", "my_uc4000_test"):
        assert not any(analyzer.match(name) for analyzer in analyzers.values())


@pytest.mark.parametrize(("node", "parameters", "sensor"), [
    ("isys_radar", {"serial_port": "sim://iSYS-4001"}, "radar"),
    ("uc4000", {"serial_port": "sim://UC4000"}, "sensor"),
    ("icotronic", {"can_interface": "sim", "sample_rate": 1000.0}, "sensor")])
def test_a_running_node_has_a_status_that_its_analyzer_takes(analyzers, node, parameters, sensor):
    analyzer = analyzers[node]

    def healthy():
        for status in (status for array in arrays for status in array.status):
            assert analyzer.match(status.name)
            analyzer.analyze(status.name, ord(status.level), 0.0)
        level, levels = analyzer.report(PERIOD)
        return level == OK and levels

    with Ros() as ros, NodeProcess(f"{node}_driver.program", parameters,
                                   "-r", "__ns:=/car") as process:
        arrays = ros.subscribe(DiagnosticArray, "/diagnostics")
        assert ros.wait_until(healthy) == {f"car {node}: {sensor}": OK}
        process.stop()


def test_stale_is_a_node_that_is_gone_and_none_that_is_late(analyzers):
    analyzer = analyzers["uc4000"]
    analyzer.analyze("uc4000: left", OK, 0.0)
    analyzer.analyze("uc4000: right", OK, 0.0)
    timeout = analyzer.parameters["timeout"]
    assert timeout > LATEST + PERIOD  # the node itself says before that its bus hangs
    assert analyzer.report(timeout - 0.1)[0] == OK
    analyzer.analyze("uc4000: right", OK, timeout)
    assert analyzer.report(timeout + 0.1) == (
        ERROR, {"uc4000: left": STALE, "uc4000: right": OK})
    assert analyzer.report(2 * timeout + 0.1)[0] == STALE


# --- nav2: RangeSensorLayer ---


def range_layer(message, parameters):
    """Return what the layer does with a Range: "drop", "mark", "clear" or "broken"."""
    assert parameters["input_sensor_type"] == "VARIABLE"
    assert message.min_range < message.max_range
    if message.range < message.min_range or message.range > message.max_range:
        return "drop"
    if math.isnan(message.range):
        return "broken"  # no comparison above is true: it goes on and transforms a point at nan
    if message.range >= message.max_range and parameters.get("clear_on_max_reading", False):
        return "clear"
    return "mark"


LIMITS = 0.25, 4.0  # m, of a UC4000


def layer_sees(distance, no_echo_value, too_close_value, **parameters):
    published = published_distance(distance, LIMITS, no_echo_value, too_close_value)
    if published is None:
        return "nothing"
    message = to_range(published, LIMITS, 0.26, "uc4000_link", 0)
    return range_layer(message, {"input_sensor_type": "VARIABLE", **parameters})


@pytest.mark.parametrize(("distance", "seen"), [
    (-math.inf, "mark"), (0.1, "mark"), (0.25, "mark"), (2.0, "mark"), (4.5, "clear"),
    (math.inf, "clear")])
def test_with_the_example_the_range_layer_marks_and_clears(distance, seen):
    driver = example("nav2_range_layer", "/uc4000")
    layer = example("nav2_range_layer", "/local_costmap/local_costmap")["range_layer"]
    assert layer["topics"] == ["/uc4000/range"]
    assert layer_sees(distance, driver["no_echo_value"], driver["too_close_value"],
                      clear_on_max_reading=layer["clear_on_max_reading"]) == seen


def test_by_default_the_range_layer_drops_both_ends():
    assert layer_sees(-math.inf, "inf", "-inf") == layer_sees(math.inf, "inf", "-inf") == "drop"
    assert layer_sees(math.inf, "max_range", "-inf") == "mark"  # unless it clears there


def test_nan_breaks_the_range_layer_and_nothing_else_that_can_be_set():
    seen = {value: layer_sees(math.inf, value, "min_range", clear_on_max_reading=True)
            for value in NO_ECHO_VALUES}
    assert seen == {"inf": "drop", "max_range": "clear", "nan": "broken", "skip": "nothing"}


def test_the_message_of_a_running_node_clears_with_the_example():
    layer = example("nav2_range_layer", "/local_costmap/local_costmap")["range_layer"]
    with Ros() as ros, NodeProcess(
            "uc4000_driver.program", {"serial_port": "sim://UC4000"},
            "--params-file", str(EXAMPLES / "nav2_range_layer.yaml")) as process:
        messages = ros.subscribe(Range, "/uc4000/range")
        ros.wait_until(lambda: len(messages) >= 5)
        assert {range_layer(message, layer) for message in messages} <= {"mark", "clear"}
        assert ros.remote("/uc4000").get("no_echo_value", "too_close_value") == [
            "max_range", "min_range"]
        process.stop()


# --- imu_filter_madgwick, stateless ---


def tilt(imu):
    """Return the direction of gravity that the filter takes, None in free fall; it reads no more.

    It looks at no covariance: an angular velocity that is not measured counts as 0.
    """
    acceleration = np.array([getattr(imu.linear_acceleration, axis) for axis in "xyz"])
    if (np.abs(acceleration) <= 0.1).all():
        return None
    return acceleration / np.linalg.norm(acceleration)


def test_three_axes_at_rest_give_a_tilt():
    leaning = np.array([0.0, 9.80665 * math.sin(0.3), 9.80665 * math.cos(0.3)])
    direction = tilt(to_imu(leaning, variances_of((0, 1, 2), 0.5), "imu_link", 0))
    assert math.atan2(direction[1], direction[2]) == pytest.approx(0.3)


def test_an_axis_that_is_not_measured_makes_the_tilt_wrong():
    # Measured is only what is left of gravity in x: the filter takes that for all of it.
    direction = tilt(to_imu((9.80665 * math.sin(0.1), 0.0, 0.0), variances_of((0,), 0.5), "", 0))
    assert math.degrees(math.asin(direction[0])) == pytest.approx(90)
    assert example("tilt", "/icotronic")["channels"] == "xyz"


def test_the_example_keeps_the_filter_from_using_what_is_not_measured():
    parameters = example("tilt", "/imu_filter_madgwick")
    assert parameters["stateless"] is True  # else it integrates an angular velocity of 0
    assert parameters["use_mag"] is False  # else it waits for a magnetometer for ever


# --- robot_localization ---

LEAST_VARIANCE = 1e-9  # what the filter takes where a variance is less


def fused(imu, config):
    """Return what the filter takes of an Imu: value and variance of each acceleration by axis.

    Args:
        imu: The message.
        config: The 15 switches of `imu0_config`.
    """
    assert len(config) == 15
    if any(config[3:6]):
        assert imu.orientation_covariance[0] == -1, "an orientation would be fused"
    if any(config[9:12]):
        assert imu.angular_velocity_covariance[0] == -1, "an angular velocity would be fused"
    if abs(imu.linear_acceleration_covariance[0] + 1) < LEAST_VARIANCE:
        return {}
    return {axis: (getattr(imu.linear_acceleration, axis),
                   max(abs(imu.linear_acceleration_covariance[4 * number]), LEAST_VARIANCE))
            for number, axis in enumerate("xyz") if config[12 + number]}


def test_robot_localization_takes_the_acceleration_and_nothing_else():
    config = example("robot_localization", "/ekf_filter_node")["imu0_config"]
    imu = to_imu((1.0, 2.0, 9.8), variances_of((0, 1, 2), 0.5), "imu_link", 0)
    assert fused(imu, config) == {"x": (1.0, 0.25), "y": (2.0, 0.25)}
    assert fused(imu, [True] * 15) == {"x": (1.0, 0.25), "y": (2.0, 0.25), "z": (9.8, 0.25)}


def test_an_axis_that_is_not_measured_weighs_next_to_nothing_even_if_it_is_switched_on():
    imu = to_imu((1.0, 0.0, 0.0), variances_of((0,), 0.5), "imu_link", 0)
    assert fused(imu, [True] * 15) == {"x": (1.0, 0.25), "y": (0.0, 1e6), "z": (0.0, 1e6)}


def test_an_unknown_variance_would_be_taken_for_nearly_perfect():
    imu = to_imu((1.0, 2.0, 9.8), variances_of((0, 1, 2), 0.0), "imu_link", 0)
    assert fused(imu, [True] * 15)["x"] == (1.0, LEAST_VARIANCE)
    assert example("robot_localization", "/icotronic")["linear_acceleration_stddev"] > 0


@pytest.mark.parametrize("name", ["tilt", "robot_localization"])
def test_a_running_node_takes_the_example(name):
    with Ros() as ros, NodeProcess(
            "icotronic_driver.program", {"can_interface": "sim"},
            "--params-file", str(EXAMPLES / f"{name}.yaml")) as process:
        messages = ros.subscribe(Imu, "/icotronic/imu/data_raw")
        ros.wait_until(lambda: len(messages) >= 5)
        wanted = example(name, "/icotronic")
        assert ros.remote("/icotronic").get("channels") == wanted["channels"]
        imu = messages[-1]
        assert tilt(imu) is not None
        assert fused(imu, [True] * 15)["z"][1] == wanted["linear_acceleration_stddev"] ** 2
        process.stop()


# --- radar_msgs ---

RETURN = make_dataclass("RadarReturn", [(name, float, 0.0) for name in (
    "range", "azimuth", "elevation", "doppler_velocity", "amplitude")])
SCAN = make_dataclass("RadarScan", ["header", "returns"])


@pytest.fixture
def radar_scan(monkeypatch):
    """The converter, with the messages of radar_msgs, or classes with their fields."""
    if "radar_msgs" not in sys.modules:
        messages = ModuleType("radar_msgs.msg")
        messages.RadarReturn, messages.RadarScan = RETURN, SCAN
        monkeypatch.setitem(sys.modules, "radar_msgs", ModuleType("radar_msgs"))
        monkeypatch.setitem(sys.modules, "radar_msgs.msg", messages)
    name = "msg_conversions.radar_scan"
    monkeypatch.setitem(sys.modules, name, ModuleType(name))
    del sys.modules[name]
    from msg_conversions import radar_scan

    return radar_scan


def test_a_scan_has_a_return_per_point(radar_scan):
    cloud = to_point_cloud([(10.0, 0.5, -2.0, 30.0), (20.0, -0.25, math.nan, 31.0)], "link", 7)
    scan = radar_scan.to_radar_scan(cloud)
    assert scan.header == cloud.header
    first, second = scan.returns
    assert (first.range, first.azimuth, first.elevation) == (10.0, 0.5, 0.0)
    assert (first.doppler_velocity, first.amplitude) == (-2.0, 30.0)
    assert math.isnan(second.doppler_velocity)
    assert radar_scan.to_radar_scan(to_point_cloud([], "link", 0)).returns == []


def test_without_radar_msgs_the_program_says_what_to_install():
    code = "import sys; sys.modules['radar_msgs'] = None; from sensor_tools import radar_scan as r"
    done = subprocess.run([sys.executable, "-c", f"{code}; sys.exit(r.main())"], cwd=ROOT,
                          capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr == ("error: the ROS package radar_msgs is missing; install it with "
                           "'sudo apt install ros-jazzy-radar-msgs'\n")
