# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the parameter services answer to messages that no ROS tool sends."""

from __future__ import annotations

from nodes import NodeProcess, Ros
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import SetParameters, SetParametersAtomically


def test_a_value_of_a_type_that_ros_does_not_have_is_refused():
    wrong = Parameter(name="frame_id", value=ParameterValue(type=77))
    right = Parameter(name="time_offset", value=ParameterValue(type=3, double_value=0.5))
    with Ros() as ros, NodeProcess("uc4000_driver.node", {"serial_port": "loop://"}):
        remote = ros.remote("/uc4000")
        results = remote._call(SetParameters, "set_parameters", parameters=[wrong, right]).results
        assert [result.successful for result in results] == [False, True]
        assert results[0].reason == "frame_id has a value of type 77, which ROS does not have"
        right.value.double_value = -0.5
        assert not remote._call(SetParametersAtomically, "set_parameters_atomically",
                                parameters=[right, wrong]).result.successful
        assert remote.get("time_offset", "frame_id") == [0.5, "uc4000_link"]
