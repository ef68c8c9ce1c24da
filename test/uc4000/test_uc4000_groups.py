# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Sensors that measure in turn, and together."""

from __future__ import annotations

import itertools
import random

import pytest
from uc4000_master import Requests, counts, named, still

from driver_common.errors import SettingError
from uc4000_driver.acquisition import CALM, Group
from uc4000_driver.commands import OpCode
from uc4000_driver.exchange import ADAPTER_LATENCY, most_together
from uc4000_driver.listener import Listener
from uc4000_driver.sensor import Options
from uc4000_driver.session import Uc4000Bus
from uc4000_driver.telegram import ErrorCode, Reply, Request


def overlap(first, second):
    """Whether two sensors ever measured at the same time."""
    return any(begin < other_end and other_begin < end
               for begin, end in first.measurements
               for other_begin, other_end in second.measurements)


def test_sensors_that_hear_each_other_measure_in_turn(connect):
    line, sensors = connect(1, 2, 3)
    master = connect.master(line, *named(1, 2, 3))
    master.measure(9)
    assert not any(overlap(first, second) for first in sensors for second in sensors
                   if first is not second)
    numbers = counts(master).values()
    assert max(numbers) - min(numbers) <= 1


@pytest.mark.parametrize("echo", [False, True])
def test_those_of_a_group_measure_together(connect, echo):
    line, sensors = connect(1, 2, 3)
    line.faults.echo = echo
    sensors[0].hears = [sensors[2]]
    master = connect.master(line, *named(1, 2, 3), groups=["s1 s2"])
    master.measure(12)
    master.until(lambda: overlap(sensors[0], sensors[1]))
    for name, measurement in master.heard.measurements:
        assert measurement.distance.value == still(int(name[1]) - 1)
    times = {stamp for sensor in sensors for stamp in (
        measurement.stamp for name, measurement in master.heard.measurements
        if name == f"s{sensor.address}")}
    assert len(times) == len(master.heard.measurements)


def test_a_group_of_seven_is_as_fair_as_it_is_fast(connect):
    line, sensors = connect(*range(1, 8))
    master = connect.master(line, *named(*range(1, 8)),
                            groups=["s1, s2, s3, s4, s5, s6, s7"]).find()
    master.measure(7)
    before = counts(master)
    for sensor in sensors:
        sensor.measurements.clear()
    master.measure(21)
    gained = [count - before[name] for name, count in counts(master).items()]
    assert max(gained) - min(gained) <= 2
    for name, measurement in master.heard.measurements:
        assert measurement.distance.value == still(int(name[1]) - 1)
    times = sorted(times for sensor in sensors for times in sensor.measurements)
    together = sum(begin < end for (_, end), (begin, _) in itertools.pairwise(times))
    assert together >= len(times) / 2 or master.bus.acquisition.groups[0].failures


def test_replies_anywhere_in_their_spread_do_not_meet(connect):
    line, sensors = connect(1, 2, 3)
    chance = random.Random(5)
    for sensor in sensors:
        def another(request, answer, sensor=sensor):
            sensor.evaluation = chance.uniform(0.0, 0.010)
            return answer
        Requests(sensor, another)
    master = connect.master(line, *named(1, 2, 3), groups=["s1 s2 s3"])
    master.measure(18)
    for name, measurement in master.heard.measurements:
        assert measurement.distance.value == still(int(name[1]) - 1)
    master.until(lambda: overlap(sensors[0], sensors[1]))


def test_replies_out_of_order_are_not_mixed_up(connect):
    line, sensors = connect(1, 2)
    master = connect.master(line, *named(1, 2), groups=["s1 s2"])
    master.until(lambda: overlap(*sensors))
    sensors[0].evaluation = 0.040  # four times what the manual allows: it answers after the other
    master.until(lambda: master.bus.acquisition.groups[0].failures)
    sensors[0].measurements.clear()
    master.measure(6)
    assert not overlap(*sensors)  # one that is late alone is not asked together with others
    for name, measurement in master.heard.measurements:
        assert measurement.distance.value == still(int(name[1]) - 1)


def test_how_many_can_measure_together():
    # 20.1 or 32.1 ms apart, and the last one is asked before the first one can reply
    assert [most_together(cycles, 0.008) for cycles in (1, 2, 3)] == [3, 5, 8]
    assert [most_together(cycles, 0.020) for cycles in (1, 2, 3)] == [2, 4, 5]


@pytest.mark.parametrize("trouble", ["slow", "refuses", "silent"])
def test_where_one_of_a_group_is_in_trouble_the_others_measure_on(connect, trouble):
    line, sensors = connect(1, 2, 3)
    master = connect.master(line, *named(1, 2, 3), groups=["s1 s2 s3"])
    master.until(lambda: overlap(sensors[0], sensors[1]))
    if trouble == "slow":
        sensors[1].evaluation = 0.050  # more than the manual allows: its reply meets the next
    elif trouble == "refuses":
        sensors[1].refuse[OpCode.PROFILE_B] = ErrorCode.SESSION_ERROR
    else:
        sensors[1].silent = True
    master.until(lambda: master.bus.acquisition.groups[0].failures >= 1)
    sensors[0].measurements.clear()
    master.until(lambda: overlap(sensors[0], sensors[2]))
    sensors[1].evaluation, sensors[1].silent = 0.005, False
    sensors[1].refuse.clear()
    sensors[1].measurements.clear()
    master.until(lambda: overlap(sensors[0], sensors[1]))
    for name, measurement in master.heard.measurements:
        assert measurement.distance.value == still(int(name[1]) - 1)


def test_on_a_bad_line_those_of_a_group_are_not_mixed_up(connect):
    line, sensors = connect(1, 2, 3)
    master = connect.master(line, *named(1, 2, 3), groups=["s1 s2 s3"]).find()
    group = master.bus.acquisition.groups[0]
    line.faults.corrupt = line.faults.drop = line.faults.noise = 0.05
    master.until(lambda: group.failures >= 3)
    line.faults.corrupt = line.faults.drop = line.faults.noise = 0.0
    sensors[0].measurements.clear()
    master.until(lambda: overlap(sensors[0], sensors[1]))
    for name, measurement in master.heard.measurements:
        assert measurement.distance.value == still(int(name[1]) - 1)


def test_an_adapter_with_a_latency_timer_lets_fewer_measure_together(connect):
    line, sensors = connect(1, 2, 3)
    master = connect.master(line, *named(1, 2, 3), groups=["s1 s2 s3"])
    chance = random.Random(7)
    for sensor in sensors:
        def hold_back(request, answer, sensor=sensor):  # 5 ms of evaluation, up to 16 ms of timer
            sensor.evaluation = 0.005 + chance.uniform(0.0, 0.016)
            return answer
        Requests(sensor, hold_back)
    group = master.bus.acquisition.groups[0]
    master.until(lambda: group.latency == ADAPTER_LATENCY)
    for sensor in sensors:
        sensor.measurements.clear()
    master.until(lambda: overlap(sensors[0], sensors[1]) or overlap(sensors[1], sensors[2])
                 or overlap(sensors[2], sensors[0]))
    for name, measurement in master.heard.measurements:
        assert measurement.distance.value == still(int(name[1]) - 1)


def failures_until_a_pause(count, latency):
    """Return how many of twenty sets may fail until a group of so many sensors takes a pause."""
    group = Group(frozenset())
    group.latency = latency
    failures = 1
    while not group.note_failure(count, cycles=1):
        failures += 1
    assert group.is_paused
    assert group.is_failing
    assert group.failing == failures / 20
    assert group.sets == group.failures == failures
    return failures


def test_a_group_measures_together_only_while_that_is_quicker():
    assert [failures_until_a_pause(count, 0.008) for count in (3, 2)] == [5, 4]
    assert failures_until_a_pause(2, ADAPTER_LATENCY) == 3


def test_a_group_has_as_much_patience_as_its_members_need():
    group = Group(frozenset())
    assert group.note_lateness(0.019)  # 10 ms by the manual, 1 ms of transmission, 8 ms
    assert group.latency == 0.008
    assert group.note_lateness(0.020)
    assert group.latency == ADAPTER_LATENCY
    assert not group.note_lateness(0.032)
    for _ in range(CALM):
        assert group.latency == ADAPTER_LATENCY
        group.note_success()
    assert group.latency == 0.008  # perhaps it was only once


def test_a_group_that_always_fails_is_told(connect):
    line, sensors = connect(1, 2)
    master = connect.master(line, *named(1, 2), groups=["s1 s2"])
    master.until(lambda: overlap(*sensors))

    measure_2 = Request(2, OpCode.PROFILE_B, 0xFE)

    def refuse(request, answer):  # only where the other one measures as well
        if request != measure_2 or not overlap(*sensors):
            return answer
        sensors[0].measurements.clear()
        return answer[0], Reply(bytes([ErrorCode.SESSION_ERROR]), acknowledged=False)

    Requests(sensors[1], refuse)
    group = master.bus.acquisition.groups[0]
    master.until(lambda: group.is_paused)
    master.note("of the measurements together with its group fail, for a while alone; the last "
                "time: ")
    master.measure(2, "s1")
    for name, measurement in master.heard.measurements:
        assert measurement.distance.value == still(int(name[1]) - 1)


@pytest.mark.parametrize(("groups", "text"), [
    (["left rear", "front left"], "groups: left is in two groups"),
    (["left raer"], 'groups: there is no sensor "raer"; did you mean "rear"?'),
])
def test_bad_groups(groups, text):
    options = [Options(name=name, address=number)
               for number, name in enumerate(("left", "rear", "front"), 1)]
    with pytest.raises(SettingError) as caught:
        Uc4000Bus("", options, Listener(), groups=groups)
    assert str(caught.value) == text


@pytest.mark.parametrize(("addresses", "text"), [
    ((1, 0), r"s1\.address must be given, 1 … 7: only a single sensor can be asked for it"),
    ((3, 3), r"s0\.address = 3 belongs to two sensors"),
])
def test_bad_addresses(addresses, text):
    with pytest.raises(SettingError, match=text):
        Uc4000Bus("", [Options(name=f"s{number}", address=address)
                       for number, address in enumerate(addresses)], Listener())
