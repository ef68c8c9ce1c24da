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


def step(pauses, clock, seconds, lost=0):
    pauses.begin()
    clock[0] += seconds
    pauses.end(0.05, lost)


def test_steps_that_take_their_time_are_no_pauses(clock):
    pauses = HostPauses()
    for _ in range(10):
        step(pauses, clock, 0.2, lost=3)
    assert (pauses.count, pauses.longest, pauses.lost) == (0, 0.0, 0)


def test_what_gets_lost_in_a_pause_and_in_its_backlog_was_lost_here(clock):
    pauses = HostPauses()
    step(pauses, clock, 4.05, lost=1)
    step(pauses, clock, 0.6, lost=2)
    step(pauses, clock, 0.25, lost=4)
    assert (pauses.count, pauses.lost) == (2, 7)
    assert pauses.longest == pytest.approx(4.0)
    clock[0] += CATCH_UP + 4.0
    step(pauses, clock, 0.05, lost=8)
    assert pauses.lost == 7
