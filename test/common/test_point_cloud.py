# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Plain values to ROS messages: point clouds, temperatures, arrays."""

from __future__ import annotations

import array
import math
import struct

import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import PointCloud2, PointField

from msg_conversions.header import to_header
from msg_conversions.multi_array import to_float32_multi_array
from msg_conversions.point_cloud import to_point_cloud
from msg_conversions.temperature import to_temperature

STAMP = 1_700_000_000_123_456_789  # ns


def test_a_header_has_frame_and_time():
    header = to_header("mast", STAMP)
    assert header.frame_id == "mast"
    assert (header.stamp.sec, header.stamp.nanosec) == (1_700_000_000, 123_456_789)


def test_a_cloud_has_the_promised_fields():
    cloud = to_point_cloud([(1.0, 0.0, 0.0, 0.0)], "mast", STAMP)
    assert [(field.name, field.offset, field.datatype, field.count) for field in cloud.fields] == [
        ("x", 0, PointField.FLOAT32, 1), ("y", 4, PointField.FLOAT32, 1),
        ("z", 8, PointField.FLOAT32, 1), ("intensity", 12, PointField.FLOAT32, 1),
        ("range", 16, PointField.FLOAT32, 1), ("azimuth", 20, PointField.FLOAT32, 1),
        ("elevation", 24, PointField.FLOAT32, 1), ("radial_velocity", 28, PointField.FLOAT32, 1)]
    assert (cloud.height, cloud.width, cloud.point_step, cloud.row_step) == (1, 1, 32, 32)
    assert (cloud.is_bigendian, cloud.is_dense) == (False, True)
    assert cloud.header == to_header("mast", STAMP)


def test_a_point_is_x_forward_and_y_left():
    cloud = to_point_cloud([(10.0, math.radians(30.0), -2.5, 42.0)], "mast", STAMP)
    assert struct.unpack("<8f", cloud.data) == pytest.approx((
        8.6602540, 5.0, 0.0, 42.0, 10.0, 0.52359878, 0.0, -2.5), rel=1e-6)


def test_points_keep_their_order():
    cloud = to_point_cloud([(float(n), 0.0, 0.0, 0.0) for n in range(35)], "mast", STAMP)
    assert (cloud.width, cloud.row_step, len(cloud.data)) == (35, 1120, 1120)
    assert [struct.unpack_from("<f", cloud.data, 32 * n)[0] for n in range(35)] == list(range(35))


def test_a_cloud_may_be_empty():
    cloud = to_point_cloud([], "mast", STAMP)
    assert (cloud.height, cloud.width, cloud.point_step, cloud.row_step) == (1, 0, 32, 0)
    assert len(cloud.data) == 0
    assert len(cloud.fields) == 8


def test_a_cloud_survives_the_wire():
    cloud = to_point_cloud([(10.0, 0.1, 1.0, 2.0)], "mast", STAMP)
    again = deserialize_message(serialize_message(cloud), PointCloud2)
    assert again == cloud
    assert isinstance(cloud.data, array.array)


def test_a_temperature():
    message = to_temperature(-12.34, "mast", STAMP)
    assert (message.temperature, message.variance) == (-12.34, 0.0)  # 0 = variance unknown
    assert message.header == to_header("mast", STAMP)


@pytest.mark.parametrize("kind", [np.int16, np.float32])
def test_an_array_keeps_shape_and_values(kind):
    values = np.array([[1, -2, 3], [30000, 5, -30000]], dtype=kind)
    message = to_float32_multi_array(values, ["signal", "sample"])
    assert [(part.label, part.size, part.stride) for part in message.layout.dim] == [
        ("signal", 2, 6), ("sample", 3, 3)]
    assert list(message.data) == [1.0, -2.0, 3.0, 30000.0, 5.0, -30000.0]
    assert message.layout.data_offset == 0


def test_an_array_that_is_no_block_of_memory_is_taken_as_well():
    values = np.arange(6, dtype=np.float32).reshape(3, 2).T
    assert list(to_float32_multi_array(values, ["a", "b"]).data) == [0, 2, 4, 1, 3, 5]


def test_an_array_needs_a_label_for_each_axis():
    with pytest.raises(ValueError, match="zip"):
        to_float32_multi_array(np.zeros((2, 2), np.float32), ["a"])
