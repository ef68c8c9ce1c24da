# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Messages as bytes: what ROS makes of them, but for what lies between the fields."""

import pytest
from geometry_msgs.msg import Vector3
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import BatteryState, Imu, PointCloud2, PointField
from std_msgs.msg import Float64MultiArray, Header, MultiArrayDimension, MultiArrayLayout

from msg_conversions.cdr import serialise


@pytest.mark.parametrize("message", [
    Header(frame_id="imu"), Imu(header=Header(frame_id="ä"), linear_acceleration=Vector3(y=-1.5)),
    BatteryState(voltage=3.5, present=True, cell_voltage=[1.0, 2.0], location="here"),
    PointCloud2(fields=[PointField(name="t", offset=4, datatype=8, count=1)], is_dense=True,
                data=b"12345"),
    Float64MultiArray(layout=MultiArrayLayout(dim=[MultiArrayDimension(label="x", size=2)]),
                      data=[1.0, -2.0])], ids=lambda message: type(message).__name__)
def test_ros_reads_the_same_message(message):
    data = serialise(message)
    assert len(data) % 4 == 0 <= len(data) - len(serialize_message(message)) < 4
    assert deserialize_message(data, type(message)) == message
    assert serialise(deserialize_message(data, type(message))) == data


def test_what_lies_between_the_fields_is_zero():
    assert serialise(Header(frame_id="imu")).hex(" ", -4) == (
        "00010000 00000000 00000000 04000000 696d7500")
    assert serialise(PointField(name="t", offset=4, datatype=8, count=1)).hex(" ", -4) == (
        "00010000 02000000 74000000 04000000 08000000 01000000")
