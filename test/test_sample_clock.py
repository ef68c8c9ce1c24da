"""The clock of a stream: from sample numbers to host times."""

import itertools
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
        self.monotonic, self.ahead, self.reading_takes = 10**12, START, 1000
        monkeypatch.setattr(time, "monotonic_ns", self._monotonic)
        monkeypatch.setattr(time, "time_ns", lambda: self.monotonic + self.ahead)

    def _monotonic(self):
        self.monotonic += self.reading_takes
        return self.monotonic


@pytest.mark.parametrize("jump", [-3600 * 10**9, -2 * 10**6, 2 * 10**6, 300 * 10**6])
def test_a_time_of_day_that_was_set_counts_at_once(monkeypatch, jump):
    clocks = Clocks(monkeypatch)
    clock = HostClock()
    clocks.ahead += jump
    clock.follow()
    assert clock.offset == pytest.approx(clocks.ahead, abs=2000)


def test_a_slow_correction_of_the_time_of_day_is_followed_smoothly(monkeypatch):
    clocks = Clocks(monkeypatch)
    clock = HostClock()
    offsets = []
    for _ in range(400):
        clocks.ahead += 25_000  # 500 ppm in 50 ms
        clock.follow()
        offsets.append(clock.offset)
    assert max(after - before for before, after in itertools.pairwise(offsets)) < 26_000
    assert clock.offset == pytest.approx(clocks.ahead, abs=500_000)


def test_a_reading_that_was_interrupted_does_not_count(monkeypatch):
    clocks = Clocks(monkeypatch)
    clock = HostClock()
    before, clocks.reading_takes = clock.offset, 10**6
    clock.follow()
    assert clock.offset == before
