# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the launch files start, alone and included one after the other."""

import itertools
from xml.etree import ElementTree

import launch_stand_in
import pytest
import yaml
from launch_stand_in import ROOT, IncludeLaunchDescription
from lifecycle_msgs.msg import Transition, TransitionEvent
from nodes import NodeProcess, Ros

DRIVERS = ("isys_radar", "icotronic", "uc4000")


@pytest.fixture(autouse=True)
def launch(monkeypatch):
    launch_stand_in.install(monkeypatch)


def include(name, **arguments):
    source = launch_stand_in.Entity(str(ROOT / "launch" / f"{name}.launch.py"))
    return IncludeLaunchDescription(source, launch_arguments=arguments.items())


def read_parameters(name):
    content = yaml.safe_load((ROOT / "config" / f"{name}.yaml").read_text())
    return content["/**"]["ros__parameters"]


@pytest.mark.parametrize("name", DRIVERS)
def test_one_driver(name):
    assert launch_stand_in.start(include(name)) == [
        (f"{name}_node", name, "", [f"{name}.yaml"], {})]
    port = "can_channel" if name == "icotronic" else "serial_port"
    assert launch_stand_in.start(include(name), name="left", namespace="car", params_file="my.yaml",
                                 **{port: "0"}) == [
        (f"{name}_node", "left", "car", ["my.yaml"], {port: "0"})]


@pytest.mark.parametrize("names", list(itertools.permutations(DRIVERS)))
def test_no_default_leaks_into_what_is_included_next(names):
    assert launch_stand_in.start(*map(include, names)) == [
        (f"{name}_node", name, "", [f"{name}.yaml"], {}) for name in names]


def test_a_whole_machine():
    pytest.importorskip("xacro")
    *drivers, description = launch_stand_in.start(include("machine"), radar_port="/dev/radars")
    assert drivers == [
        ("isys_radar_node", "isys_radar", "", ["isys_radars_on_one_line.yaml"],
         {"serial_port": "/dev/radars"}),
        ("uc4000_node", "uc4000", "", ["uc4000_sensors_on_one_line.yaml"],
         {"serial_port": "/dev/uc4000"}),
        ("icotronic_node", "icotronic", "", ["icotronic.yaml"], {"can_interface": "socketcan"})]
    robot = ElementTree.fromstring(description[-1]["robot_description"])
    frames = [value for name in ("isys_radars_on_one_line", "uc4000_sensors_on_one_line",
                                 "icotronic")
              for key, value in read_parameters(name).items() if key.endswith("frame_id")]
    assert len(frames) == 8
    assert {link.get("name") for link in robot.iter("link")} == {"base_link", *frames}


@pytest.mark.parametrize("name", DRIVERS)
def test_a_lifecycle_manager(name):
    port = "can_channel" if name == "icotronic" else "serial_port"
    context = launch_stand_in.launch(include("lifecycle"), driver=name, port="0")
    assert context.nodes == [
        (f"{name}_node", name, "", [f"{name}.yaml"], {"autostart": False, port: "0"})]
    assert context.requests == [Transition.TRANSITION_CONFIGURE]
    assert context.launch_configurations == {"driver": name, "port": "0"}
    assert launch_stand_in.start(
        include("lifecycle"), driver=name, name="left", namespace="car", params_file="my.yaml",
    ) == [(f"{name}_node", "left", "car", ["my.yaml"], {"autostart": False})]


def test_what_the_lifecycle_manager_asks_for_activates_a_node():
    context = launch_stand_in.launch(include("lifecycle"), driver="uc4000", port="sim://UC4000")
    ((_, name, _, _, parameters),) = context.nodes
    with Ros() as ros, NodeProcess("uc4000_driver.program", parameters) as process:
        remote = ros.remote(f"/{name}")
        events = remote.subscribe(TransitionEvent, "transition_event")
        ros.wait_until(lambda: remote.state() == "unconfigured")
        done = 0
        while done < len(context.requests):
            assert remote.change_state_by_number(context.requests[done])
            done += 1
            ros.wait_until(lambda: any(event.goal_state.label in ("inactive", "active")
                                       for event in events))
            for event in events:
                context.tell(context.lifecycle_node, event.start_state.label,
                             event.goal_state.label)
            events.clear()
        assert remote.state() == "active"
        process.stop()


def test_recording_names_every_topic_and_its_profile():
    file = ROOT / "config" / "record_qos.yaml"
    (command,) = launch_stand_in.launch(include("record"), output="my_bag").commands
    assert command == [
        "ros2", "bag", "record", "--storage", "mcap", "--max-cache-size", "268435456",
        "--qos-profile-overrides-path", str(file), "--output", "my_bag",
        "--topics", *yaml.safe_load(file.read_text())]
    (command,) = launch_stand_in.launch(include("record"), topics="/a /b").commands
    assert command[9:] == ["--topics", "/a", "/b"]


def test_the_aggregator_gets_its_analyzers():
    assert launch_stand_in.start(include("diagnostics")) == [
        ("aggregator_node", None, None, ["diagnostics.yaml"], {})]


def test_the_description_is_what_xacro_makes_of_the_model():
    pytest.importorskip("xacro")
    ((executable, _, _, _, parameters),) = launch_stand_in.start(include("description"))
    assert executable == "robot_state_publisher"
    assert ElementTree.fromstring(parameters["robot_description"]).tag == "robot"
