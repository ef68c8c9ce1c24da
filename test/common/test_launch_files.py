# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the launch files start, alone and included one after the other."""

import itertools

import launch_stand_in
import pytest
from launch_stand_in import ROOT, IncludeLaunchDescription

DRIVERS = ("isys_radar", "icotronic", "uc4000")


@pytest.fixture(autouse=True)
def launch(monkeypatch):
    launch_stand_in.install(monkeypatch)


def include(name, **arguments):
    source = launch_stand_in.Entity(str(ROOT / "launch" / f"{name}.launch.py"))
    return IncludeLaunchDescription(source, launch_arguments=arguments.items())


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
    assert launch_stand_in.start(include("machine"), radar_port="/dev/radars") == [
        ("isys_radar_node", "isys_radar", "", ["isys_radars_on_one_line.yaml"],
         {"serial_port": "/dev/radars"}),
        ("uc4000_node", "uc4000", "", ["uc4000_sensors_on_one_line.yaml"],
         {"serial_port": "/dev/uc4000"}),
        ("icotronic_node", "icotronic", "", ["icotronic.yaml"], {"can_interface": "socketcan"})]
