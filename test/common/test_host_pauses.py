# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Pauses of the host are noticed, and what is lost in them is told apart."""

import time

import pytest

from driver_common.host_pauses import CATCH_UP, HostPauses


@pytest.fixture
def clock(monkeypatch):
    """A clock that the test sets, in s."""
    now = [1000.0]
    monkeypatch.setattr(time, "clock_gettime", lambda _: now[0])
    return now


@pytest.fixture
def pauses(clock):
    pauses = HostPauses()
    pauses.watch()
    return pauses


def step(pauses, clock, seconds, lost=0):
    """A wait of at most 0.05 s; then it is found that something was lost, and the next begins."""
    pauses.wait(0.05)
    clock[0] += seconds
    pauses.wait(0.0)
    pauses.count_lost(lost)


def test_steps_that_take_their_time_are_no_pauses(clock, pauses):
    for _ in range(10):
        step(pauses, clock, 0.2, lost=3)
    assert (pauses.count, pauses.longest, pauses.lost) == (0, 0.0, 0)


def test_what_gets_lost_in_a_pause_and_in_its_backlog_was_lost_here(clock, pauses):
    step(pauses, clock, 4.05, lost=1)
    step(pauses, clock, 0.6, lost=2)
    step(pauses, clock, 0.25, lost=4)
    assert (pauses.count, pauses.lost) == (2, 7)
    assert pauses.longest == pytest.approx(4.0)
    for _ in range(round((CATCH_UP + 4.0) / 0.05)):
        step(pauses, clock, 0.05)
    step(pauses, clock, 0.05, lost=8)
    assert pauses.lost == 7


def test_a_pause_between_two_waits_is_one(clock, pauses):
    step(pauses, clock, 0.05)
    clock[0] += 3.0
    step(pauses, clock, 0.05)
    assert (pauses.count, pauses.longest) == (1, pytest.approx(3.0))


def test_nothing_is_a_pause_while_nobody_watches(clock, pauses):
    pauses.rest()
    step(pauses, clock, 60.0)
    pauses.watch()
    step(pauses, clock, 0.05)
    assert pauses.count == 0
