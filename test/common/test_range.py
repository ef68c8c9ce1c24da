# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Distances as sensor_msgs/Range, and what stands for those that are none."""

from __future__ import annotations

import math

import pytest
from sensor_msgs.msg import Range

from msg_conversions.header import to_header
from msg_conversions.range import (
    NO_ECHO_VALUES,
    TOO_CLOSE_VALUES,
    published_distance,
    to_range,
)

STAMP = 1_700_000_000_123_456_789  # ns
LIMITS = (0.25, 4.0)


def test_a_range():
    message = to_range(7.5, (0.1, 20.0), 0.2, "mast", STAMP)
    assert message.range == 7.5
    assert (message.min_range, message.max_range) == pytest.approx((0.1, 20.0))
    assert message.field_of_view == pytest.approx(0.2)
    assert message.radiation_type == Range.ULTRASOUND
    assert message.header == to_header("mast", STAMP)


@pytest.mark.parametrize("distance", [0.25, 1.5, 4.0])
def test_a_distance_within_the_limits_is_published_as_it_is(distance):
    for no_echo_value in NO_ECHO_VALUES:
        for too_close_value in TOO_CLOSE_VALUES:
            assert published_distance(
                distance, LIMITS, no_echo_value, too_close_value) == distance


@pytest.mark.parametrize("distance", [4.001, math.inf])
@pytest.mark.parametrize(("word", "published"), [
    ("inf", math.inf), ("max_range", 4.0), ("skip", None)])
def test_what_is_too_far_is_published_as_wanted(distance, word, published):
    assert published_distance(distance, LIMITS, word, "skip") == published


@pytest.mark.parametrize("distance", [0.249, -math.inf])
@pytest.mark.parametrize(("word", "published"), [
    ("-inf", -math.inf), ("min_range", 0.25), ("skip", None)])
def test_what_is_too_close_is_published_as_wanted(distance, word, published):
    assert published_distance(distance, LIMITS, "skip", word) == published


def test_nothing_seen_can_be_no_number():
    distance = published_distance(math.inf, LIMITS, "nan", "-inf")
    assert distance is not None
    assert math.isnan(distance)
