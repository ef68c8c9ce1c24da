# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What people look with: each topic, field, plugin and frame that a layout names is there."""

import importlib
import json
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml

from msg_conversions import imu_batch
from msg_conversions.point_cloud import FIELD_NAMES
from sensor_tools.demo.families import FAMILIES
from sensor_tools.record_qos import NODES

ROOT = Path(__file__).resolve().parent.parent.parent


def get_message(name):
    """Return the class of such a name as sensor_msgs/msg/Imu."""
    package, _, kind = name.split("/")
    return getattr(importlib.import_module(f"{package}.msg"), kind)


TOPICS = {f"/{name}/{topic}": kind for name, node in NODES.items()
          for topic, (kind, _) in node.TOPICS.items()}
TOPICS["/diagnostics"] = get_message("diagnostic_msgs/msg/DiagnosticArray")
FRAMES = {name: yaml.safe_load((ROOT / "config" / f"{name}.yaml").read_text())
          ["/**"]["ros__parameters"]["frame_id"] for name in NODES}
CLOUDS = {"/isys_radar/points": FIELD_NAMES, "/icotronic/imu/batch": ("t", "x", "y", "z")}
PLUGINS = {  # of rviz_default_plugins in Jazzy and the type that they show, but for rviz_imu_plugin
    "rviz_default_plugins/Grid": None, "rviz_default_plugins/Axes": None,
    "rviz_default_plugins/TF": None, "rviz_default_plugins/RobotModel": None,
    "rviz_default_plugins/PointCloud2": "PointCloud2", "rviz_default_plugins/Range": "Range",
    "rviz_imu_plugin/Imu": "Imu"}
TOOLS = {f"rviz_default_plugins/{name}" for name in ("MoveCamera", "Select", "Measure")}
VIEWS = {"rviz_default_plugins/Orbit", "rviz_default_plugins/TopDownOrtho"}


def assert_field(path):
    """A path such as /uc4000/range/range is a topic and a field of its messages."""
    topic = max((topic for topic in TOPICS if path.startswith(topic)), key=len)
    kind = TOPICS[topic]
    *groups, field = path.removeprefix(topic).strip("/.").replace("/", ".").split(".")
    for group in groups:
        kind = get_message(kind.get_fields_and_field_types()[group].replace("/", "/msg/"))
    assert kind.get_fields_and_field_types()[field] in ("double", "float", "uint32"), path


def manager(name):
    return yaml.safe_load((ROOT / "rviz" / f"{name}.rviz").read_text())["Visualization Manager"]


def test_the_topics_are_those_of_the_demonstration():
    for family in FAMILIES:
        for topic in family.topics:
            assert TOPICS[topic.name] is get_message(topic.kind)


@pytest.mark.parametrize("name", [*FRAMES, "sensors"])
def test_rviz(name):
    shown = manager(name)
    for display in shown["Displays"]:
        kind, topic = PLUGINS[display["Class"]], display.get("Topic", {}).get("Value")
        assert (TOPICS[topic].__name__ if topic else None) == kind, display
        if kind == "PointCloud2" and display["Color Transformer"] == "Intensity":
            assert display["Channel Name"] == "radial_velocity"
        if kind:
            assert topic.startswith(f"/{name}/") or name == "sensors"
    assert shown["Global Options"]["Fixed Frame"] == FRAMES.get(name, "base_link")
    assert {tool["Class"] for tool in shown["Tools"]} <= TOOLS
    assert shown["Views"]["Current"]["Class"] in VIEWS


def test_all_of_them_in_one_view():
    shown = {display.get("Topic", {}).get("Value") for display in manager("sensors")["Displays"]}
    assert shown >= {topic.name for family in FAMILIES for topic in family.topics}


def test_all_sensors_of_the_machine_in_one_view():
    shown = [display["Topic"]["Value"] for display in manager("machine")["Displays"]
             if "Topic" in display]
    wires = [("isys_radar", "isys_radars", "points"), ("uc4000", "uc4000_sensors", "range")]
    wanted = [f"/{node}/{sensor}/{topic}" for node, file, topic in wires for sensor in
              yaml.safe_load((ROOT / "config" / f"{file}_on_one_line.yaml").read_text())
              ["/**"]["ros__parameters"]["sensors"]]
    assert sorted(shown) == sorted([*wanted, "/icotronic/imu/data_raw"])
    plain = {display["Class"]: display for display in manager("sensors")["Displays"]}
    for display in manager("machine")["Displays"]:  # all the rest is as for one of each
        like = plain[display["Class"]]
        assert display.keys() == like.keys()
        assert all(display[key] == like[key] for key in display.keys() - {"Name", "Topic"})


def test_samples_as_points_are_what_the_stock_rviz_can_show():
    fields = {field.name: field.datatype for field in imu_batch.FIELDS}
    assert tuple(fields) == CLOUDS["/icotronic/imu/batch"]
    assert all(fields[axis] == imu_batch.PointField.FLOAT32 for axis in "xyz")


def test_foxglove():
    layout = json.loads((ROOT / "layouts" / "foxglove.json").read_text())
    panels = layout["configById"]
    for name, panel in panels.items():
        assert name.partition("!")[0] in ("3D", "Plot", "DiagnosticSummary")
        for path in panel.get("paths", ()):
            assert_field(path["value"])
        for topic, how in panel.get("topics", {}).items():
            assert topic in TOPICS or topic == "/robot_description"
            assert how.get("colorField") in (None, *CLOUDS.get(topic, ()))
    assert panels["DiagnosticSummary!all"]["topicToRender"] == "/diagnostics"

    def placed(node):
        return [node] if isinstance(node, str) else placed(node["first"]) + placed(node["second"])

    assert sorted(placed(layout["layout"])) == sorted(panels)


def test_plotjuggler():
    layout = ElementTree.parse(ROOT / "layouts" / "plotjuggler.xml").getroot()
    curves = [curve.get("name") for curve in layout.iter("curve")]
    for curve in curves:
        assert_field(curve)
    for family in FAMILIES:
        assert any(curve.startswith(family.topics[0].name) for curve in curves)


def test_a_field_that_is_not_there_would_be_noticed():
    with pytest.raises((KeyError, ValueError)):
        assert_field("/icotronic/imu/data_raw/acceleration/x")
    with pytest.raises(ValueError, match="empty"):
        assert_field("/isys_radar_2/points/width")


def test_the_model_of_the_sensors_has_the_frames_of_the_drivers():
    xacro = pytest.importorskip("xacro")
    robot = ElementTree.fromstring(xacro.process(str(ROOT / "urdf" / "sensors.urdf.xacro")))
    links = {link.get("name") for link in robot.iter("link")}
    assert links == {"base_link", *FRAMES.values()}
    for joint in robot.iter("joint"):
        assert joint.get("type") == "fixed"
        assert joint.find("parent").get("link") == "base_link"
    assert {joint.find("child").get("link") for joint in robot.iter("joint")} == {*FRAMES.values()}


@pytest.mark.parametrize("name", FRAMES)
def test_a_macro_takes_another_frame_and_place(name, tmp_path):
    xacro = pytest.importorskip("xacro")
    (tmp_path / "robot.xacro").write_text(f"""
        <robot name="robot" xmlns:xacro="http://www.ros.org/wiki/xacro">
          <xacro:include filename="{ROOT}/urdf/{name}.urdf.xacro"/>
          <link name="arm"/>
          <xacro:{name} parent="arm" frame="front_link" xyz="1 2 3" rpy="0 0 1"/>
        </robot>""")
    robot = ElementTree.fromstring(xacro.process(str(tmp_path / "robot.xacro")))
    (joint,) = robot.iter("joint")
    assert joint.find("origin").attrib == {"xyz": "1 2 3", "rpy": "0 0 1"}
    assert joint.find("child").get("link") == "front_link"
    assert joint.find("parent").get("link") == "arm"
