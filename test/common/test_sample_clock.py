"""The clock of a stream: from sample numbers to host times."""

import random
import time

import pytest

from driver_common.sample_clock import HostClock, SampleClock

RATE = 9523.8
START = 1_800_000_000_000_000_000  # ns


def stream(clock, seconds, delay, drift=0.0, first=0, start=START, samples_per_frame=3):
    """Feed frames; yield (time given, true time) of each frame's last sample."""
    period = 1e9 / RATE * (1 + drift)
    last_arrival = 0
    for number in range(first, first + int(seconds * RATE), samples_per_frame):
        true = start + (number - first) * period
        last_arrival = max(last_arrival, round(true + delay(number)))  # frames keep their order
        clock.update(number, last_arrival)
        yield clock.time_of(number), true


def errors(pairs, after=0.0):
    pairs = list(pairs)
    return [given - true for given, true in pairs[int(after * len(pairs)):]]


def test_without_jitter_each_sample_has_its_time():
    assert max(map(abs, errors(stream(SampleClock(RATE), 5, lambda n: 0)))) < 1000


def test_jitter_is_removed():
    noise = random.Random(1)
    clock = SampleClock(RATE)
    off = errors(stream(clock, 30, lambda n: noise.expovariate(1 / 3e6)), after=0.5)
    # Frames that keep their order are all late by some ms; what counts is that the pace is even.
    assert max(off) - min(off) < 1_000_000


def test_no_sample_is_stamped_before_it_came():
    noise = random.Random(3)
    clock = SampleClock(RATE)
    arrival = START
    for number in range(2, 100_000, 3):
        arrival = max(arrival, START + round(number * 1e9 / RATE + noise.expovariate(1e-6)))
        clock.update(number, arrival)
        assert clock.time_of(number) <= arrival


def test_bursts_are_spread():
    clock = SampleClock(RATE)
    off = errors(stream(clock, 10, lambda n: 20e6 * (1 - (n % 190) / 190)), after=0.3)
    assert max(map(abs, off)) < 1_000_000


@pytest.mark.parametrize("drift", [-0.015, -100e-6, 100e-6, 0.015])
def test_drift_is_followed(drift):
    noise = random.Random(2)
    clock = SampleClock(RATE)
    off = errors(stream(clock, 40, lambda n: noise.uniform(0, 1e6), drift), after=0.5)
    assert max(map(abs, off)) < 500_000
    assert clock.deviation == pytest.approx(drift, abs=20e-6)


def test_a_lost_second_shifts_nothing():
    clock = SampleClock(RATE)
    list(stream(clock, 5, lambda n: 0))
    number = int(6 * RATE)
    true = START + number * 1e9 / RATE
    clock.update(number, round(true))
    assert clock.time_of(number) == pytest.approx(true, abs=1000)


def test_a_sensor_that_paused_for_long_starts_anew():
    clock = SampleClock(RATE)
    list(stream(clock, 3, lambda n: 0))
    later = START + 3600 * 10**9
    off = errors(stream(clock, 3, lambda n: 0, first=int(3 * RATE), start=later))
    assert max(map(abs, off)) < 1000


def test_what_waited_for_a_busy_host_keeps_its_time():
    clock = SampleClock(RATE)
    off = errors(stream(clock, 6, lambda n: max(0, 2e9 - (n - 20_000) / RATE * 1e9)
                        if n > 20_000 else 0))
    assert max(map(abs, off)) < 1_000_000


def test_a_sensor_that_paused_for_some_seconds_is_followed():
    clock = SampleClock(RATE)
    list(stream(clock, 3, lambda n: 0))
    later = START + 3 * 10**9 + 5 * 10**9
    off = errors(stream(clock, 8, lambda n: 0, first=int(3 * RATE), start=later), after=0.6)
    assert max(map(abs, off)) < 1000


def test_a_late_first_frame_is_corrected_by_the_first_early_one():
    clock = SampleClock(RATE)
    off = errors(stream(clock, 1, lambda n: 50e6 if n < 300 else 0), after=0.1)
    assert max(map(abs, off)) < 1000


class Clocks:
    """The clocks of a host that can be set."""

    def __init__(self, monkeypatch):
        self.now, self.ahead, self.interruptions = 10**12, START, []
        monkeypatch.setattr(time, "monotonic_ns", lambda: self.now)
        monkeypatch.setattr(time, "time_ns", self._time_ns)

    def _time_ns(self):
        result = self.now + self.ahead
        self.now += self.interruptions.pop() if self.interruptions else 100
        return result


@pytest.mark.parametrize("change", [-3600 * 10**9, -25_000, 25_000, 300 * 10**6])
def test_a_time_of_day_that_was_set_or_corrected_counts_at_once(monkeypatch, change):
    clocks = Clocks(monkeypatch)
    clock = HostClock()
    clocks.ahead += change
    clock.follow()
    assert clocks.ahead - 200 < clock.offset <= clocks.ahead  # so no stamp lies in the future


def test_what_comes_between_two_readings_does_not_count(monkeypatch):
    clocks = Clocks(monkeypatch)
    clocks.interruptions = [10**9, 50, 10**6]
    assert HostClock().offset == clocks.ahead - 50
