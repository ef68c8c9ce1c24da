"""Accelerations as messages: the object, and the bytes that are patched."""

import math

import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import Imu

from msg_conversions.battery import to_battery_state
from msg_conversions.imu import ImuTemplate, to_imu

VARIANCES = (0.25, 1e6, 1e6)
STAMP = 1_800_000_000_123_456_789


@pytest.mark.parametrize("frame_id", ["", "i", "imu", "imu_link", "a_rather_long_frame_name_1"])
def test_patched_bytes_are_those_of_the_message(frame_id):
    template = ImuTemplate(VARIANCES, frame_id)
    for stamp, acceleration in ((STAMP, (9.80665, -0.5, 1e-3)), (999_999_999, (0.0, 0.0, -2.0))):
        message = to_imu(acceleration, VARIANCES, frame_id, stamp)
        assert template.serialised(stamp, *acceleration) == serialize_message(message)


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


def test_a_battery_tells_its_voltage_and_nothing_else():
    state = to_battery_state(3.7, "imu_link", STAMP)
    assert state.voltage == pytest.approx(3.7)
    assert all(math.isnan(value) for value in (state.current, state.percentage, state.charge))
    assert state.present
