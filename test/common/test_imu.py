# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Accelerations as messages: the object, and the bytes that are patched."""

import math
import struct

import numpy as np
import pytest
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Imu, PointCloud2, PointField

from msg_conversions.battery import to_battery_state
from msg_conversions.cdr import serialise
from msg_conversions.imu import ImuTemplate, to_imu
from msg_conversions.imu_batch import ImuBatchTemplate, from_imu_batch
from msg_conversions.point_cloud import to_point_cloud

VARIANCES = (0.25, 1e6, 1e6)
STAMP = 1_800_000_000_123_456_789


@pytest.mark.parametrize("frame_id", ["", "i", "imu", "imu_link", "a_rather_long_frame_name_1"])
def test_patched_bytes_are_those_of_the_message(frame_id):
    template = ImuTemplate(VARIANCES, frame_id)
    for stamp, acceleration in ((STAMP, (9.80665, -0.5, 1e-3)), (999_999_999, (0.0, 0.0, -2.0))):
        message = to_imu(acceleration, VARIANCES, frame_id, stamp)
        assert template.serialised(stamp, *acceleration) == serialise(message)


def test_an_imu_tells_what_it_does_not_measure():
    imu = deserialize_message(ImuTemplate(VARIANCES, "imu_link").serialised(STAMP, 1.0, 2.0, 3.0),
                              Imu)
    assert (imu.header.stamp.sec, imu.header.stamp.nanosec) == (1_800_000_000, 123_456_789)
    assert imu.header.frame_id == "imu_link"
    acceleration = imu.linear_acceleration
    assert (acceleration.x, acceleration.y, acceleration.z) == (1.0, 2.0, 3.0)
    assert imu.orientation_covariance[0] == imu.angular_velocity_covariance[0] == -1.0
    assert list(imu.linear_acceleration_covariance) == [0.25, 0, 0, 0, 1e6, 0, 0, 0, 1e6]
    assert imu.orientation.w == 1.0


@pytest.mark.parametrize("frame_id", ["", "i", "imu", "imu_link", "a_rather_long_frame_name_1"])
def test_the_bytes_of_a_batch_are_those_of_the_message(frame_id):
    for count in (1, 190):
        stamps = STAMP + 105_000 * np.arange(count)
        accelerations = np.arange(3 * count, dtype=np.float32).reshape(-1, 3)
        data = ImuBatchTemplate(frame_id).serialised(stamps, accelerations)
        cloud = deserialize_message(data, PointCloud2)
        assert (cloud.header.frame_id, cloud.width) == (frame_id, count)
        assert serialise(cloud) == data


def test_a_batch_is_a_cloud_with_a_point_per_sample():
    stamps = np.array([STAMP, STAMP + 105_000, STAMP + 7_000_000_001])
    accelerations = np.array([[1.5, 0, -2], [0.1, 0, 3], [4, 0, 5]], np.float32)
    cloud = deserialize_message(
        ImuBatchTemplate("imu_link").serialised(stamps, accelerations), PointCloud2)
    assert (cloud.header.stamp.sec, cloud.header.stamp.nanosec) == (1_800_000_000, 123_456_789)
    assert (cloud.header.frame_id, cloud.height, cloud.width) == ("imu_link", 1, 3)
    assert (cloud.point_step, cloud.row_step, cloud.is_dense) == (20, 60, True)
    assert [(field.name, field.offset, field.datatype, field.count) for field in cloud.fields] == [
        ("t", 0, PointField.FLOAT64, 1), ("x", 8, PointField.FLOAT32, 1),
        ("y", 12, PointField.FLOAT32, 1), ("z", 16, PointField.FLOAT32, 1)]
    assert struct.unpack_from("<dfff", bytes(cloud.data), 20) == (
        0.000105, pytest.approx(0.1), 0.0, 3.0)
    read = from_imu_batch(cloud)
    assert read[0].tolist() == stamps.tolist()
    np.testing.assert_array_equal(read[1], accelerations)


def test_another_cloud_is_no_batch():
    with pytest.raises(ValueError, match=r"fields \['x', 'y', 'z', .* is no batch"):
        from_imu_batch(to_point_cloud([], "radar_link", STAMP))


def test_a_battery_tells_its_voltage_and_nothing_else():
    state = to_battery_state(3.7, "imu_link", STAMP)
    assert state.voltage == pytest.approx(3.7)
    assert all(math.isnan(value) for value in (state.current, state.percentage, state.charge))
    assert state.present
