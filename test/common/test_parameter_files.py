# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Parameter files go round: what ros2 param dump writes can be loaded, by rcl and by PyYAML.

Both read YAML in their own way: rcl takes an unquoted y for true, PyYAML does not; an empty list
has no type.
"""

import contextlib
import itertools
import math

import pytest
import rclpy
import yaml
from nodes import NodeProcess, Ros
from rclpy.context import Context
from rclpy.parameter import Parameter, parameter_dict_from_yaml_file, parameter_value_to_python
from rclpy.signals import SignalHandlerOptions

from driver_common.errors import SettingError
from icotronic_driver.node import IcotronicNode
from icotronic_driver.settings import SETTINGS as ICOTRONIC_SETTINGS
from isys_radar_driver.models import MODELS
from isys_radar_driver.node import IsysRadarNode
from isys_radar_driver.settings import settings_of
from uc4000_driver.node import Uc4000Node
from uc4000_driver.settings import ALL_SETTINGS as UC4000_SETTINGS

NODES = {IsysRadarNode: "isys_radar_driver.program", IcotronicNode: "icotronic_driver.program",
         Uc4000Node: "uc4000_driver.program"}
ROWS = {
    **{f"the options of {node.__name__}":
       {option.name: option for option in (*node.bus_options(), *node.SENSOR_OPTIONS)}
       for node in NODES},
    **{f"the {model.name}": settings_of(model) for model in MODELS.values()},
    "the ICOtronic sensor": ICOTRONIC_SETTINGS, "the UC4000": UC4000_SETTINGS}


def values_of(row):
    """Return what a parameter may show: each word, each limit, what a device did not tell."""
    if row.choices is not None:
        return [*row.choices, "unknown"]
    values = [limit for limit in row.limits if limit is not None]
    values += {bool: [False, True], str: ["", "on", "y", "1234", "a b"], int: [], float: [0.1],
               list: [[], ["left", "front"]]}[row.kind]
    possible = [math.nan] * (row.kind is float)
    for value in values:
        with contextlib.suppress(SettingError):
            possible.append(row.check(row.kind(value)))
    return possible


def dumped(values):
    """Return a parameter file as ros2 param dump writes it."""
    tree = {}
    for name, value in values.items():
        *groups, last = name.split(".")
        place = tree
        for group in groups:
            place = place.setdefault(group, {})
        place[last] = value
    return yaml.dump({"/node": {"ros__parameters": tree}}, default_flow_style=False)


def read_by_rcl(path):
    context = Context()
    rclpy.init(args=["--ros-args", "--params-file", str(path)], context=context,
               signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = rclpy.create_node("node", context=context, start_parameter_services=False,
                                 enable_rosout=False)
        return {name: parameter.value for name, parameter in node._parameter_overrides.items()
                if parameter.value is not None}
    finally:
        rclpy.shutdown(context=context)


def read_by_ros2_param_load(path):
    return {name: parameter_value_to_python(message.value)
            for name, message in parameter_dict_from_yaml_file(str(path)).items()}


@pytest.mark.parametrize("read", [read_by_rcl, read_by_ros2_param_load])
@pytest.mark.parametrize("owner", ROWS)
def test_every_value_of_every_parameter_comes_back(owner, read, tmp_path):
    rows = ROWS[owner]
    columns = [[(name, value) for value in values_of(row)] for name, row in rows.items()]
    for number, chosen in enumerate(itertools.zip_longest(*columns)):
        values = dict(pair for pair in chosen if pair is not None)
        path = tmp_path / f"{number}.yaml"
        path.write_text(dumped(values))
        back = read(path)
        for name, value in values.items():
            if value in ([], ""):  # an empty list or text cannot differ
                continue
            row = rows[name]
            loaded = back[name]
            if isinstance(value, str) and row.choices is None and isinstance(loaded, bool):
                continue  # an unquoted y or on for a free text: the word is gone
            assert row.is_same(loaded, value) or row.check(loaded) == value, name


def all_of(remote):
    """Return all parameters of a node."""
    names = sorted(remote.names())
    return dict(zip(names, remote.get(*names), strict=True))


PARAMETERS = [
    (IsysRadarNode, {"serial_port": "sim://iSYS-4001"}),
    (IcotronicNode, {"can_interface": "sim"}),
    (Uc4000Node, {"serial_port": "sim://UC4000"})]


@pytest.mark.parametrize(("node", "parameters"), PARAMETERS, ids=lambda of: getattr(
    of, "__name__", ""))
def test_a_node_takes_its_own_dump(node, parameters, tmp_path):
    with Ros() as ros, NodeProcess(NODES[node], parameters, "-r", "__node:=node") as process:
        process.wait_for_line("connected to")
        remote = ros.remote("/node")
        ros.wait_until(lambda: {*node.ALL_SETTINGS} & remote.names())
        before = all_of(remote)
        path = tmp_path / "dump.yaml"
        path.write_text(dumped(before))
        for name, message in parameter_dict_from_yaml_file(str(path)).items():
            result = remote.set_raw(message)
            assert result.successful, f"{name}: {result.reason}"
        process.stop()
        with NodeProcess(NODES[node], None, "-r", "__node:=node", "--params-file", str(path)
                         ) as again:
            again.wait_for_line("connected to")
            ros.wait_until(lambda: before.keys() <= remote.names())
            assert repr(all_of(remote)) == repr(before)  # where NaN is NaN
            assert not [line for line in again.lines
                        if "WARN" in line and any(name in line for name in before)]
            again.stop()


def test_lists_that_were_empty_can_be_set():
    with Ros() as ros, NodeProcess("icotronic_driver.program", {"autostart": False}) as process:
        remote = ros.remote("/icotronic")
        assert remote.set("can_options", ["host=127.0.0.1", "port=1"]).successful
        assert remote.get("can_options") == ["host=127.0.0.1", "port=1"]
        assert remote.set_raw(Parameter("can_options", Parameter.Type.STRING_ARRAY, []
                                        ).to_parameter_msg()).successful
        assert list(remote.get("can_options")) == []
        process.stop()
