# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The clock of a stream: from sample numbers to host times, in trials whose truth is known."""

import time

import arrival_trials as trials
import numpy as np
import pytest
from arrival_trials import PATH, PERIOD, RATE, SAMPLES, START, feed, numbers_of, run

from driver_common.sample_clock import HostClock, SampleClock

DRIFTS = pytest.mark.parametrize("drift", [0.0, 200e-6, -200e-6])
DELAYS = {
    "none": trials.nothing,
    "independent jitter of 2 ms": trials.independent(2.0),
    "polls every 1 ms": trials.poll(1.0),
    "polls every 4 ms": trials.poll(4.0),
    "polls every 8 ms": trials.poll(8.0),
    "polls every 16 ms": trials.poll(16.0),
    "pauses of 10 ms": trials.pauses,
}


@DRIFTS
@pytest.mark.parametrize("delays", DELAYS.values(), ids=DELAYS.keys())
def test_stamps_are_right_and_at_the_sensor_s_pace(delays, drift):
    trial = run(delays, drift)
    assert trial.error(0, 3) < 0.5
    assert trial.error(3) < 0.1
    assert trial.largest_step(0.5) < 0.01
    assert trial.back == trial.future == trial.clock.breaks == 0
    assert trial.clock.drift == pytest.approx(drift, abs=2e-6)
    assert np.mean(np.abs(trial.errors) < 3 * trial.uncertainty) > 0.99


@DRIFTS
def test_stamps_of_frames_that_hold_each_other_up(drift):
    """Nearly no frame comes without delay here; docs/timing.md says why more is not possible."""
    trial = run(trials.in_order(2.0), drift, seconds=30)
    assert trial.error(0.5, 3) < 0.5
    assert trial.error(3) < 0.3
    assert trial.error(15) < 0.15
    assert trial.largest_step(0.5) < 0.01
    assert trial.back == trial.future == trial.clock.breaks == 0
    late = trial.seconds > 3
    assert np.mean(np.abs(trial.errors)[late] < 3 * trial.uncertainty[late]) > 0.99


@DRIFTS
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_polls_of_what_jitters_already_are_no_queue(drift, seed):
    def delays(sent, noise):
        return trials.poll(16.0)(trials.in_order(0.1)(sent, noise), noise)
    trial = run(delays, drift, seed=seed)
    assert trial.error(0.5) < 0.3
    assert trial.largest_step(0.5) < 0.01
    assert trial.back == trial.future == trial.clock.breaks == 0


@pytest.mark.parametrize("mean", [0.05, 0.3, 1.0, 5.0])
def test_jitter_of_any_size_leaves_stamps_even(mean):
    trial = run(trials.in_order(mean))
    assert trial.largest_step(1.0) < 0.01
    assert trial.back == trial.future == 0


@pytest.mark.parametrize("drift", [-0.015, 0.015])
def test_a_sensor_far_from_its_nominal_rate_is_followed(drift):
    trial = run(trials.independent(0.2), drift)
    assert trial.error(3) < 0.1
    assert trial.clock.drift == pytest.approx(drift, abs=2e-6)


# --- pauses, losses, restarts --------------------------------------------------------------------

@pytest.mark.parametrize("frame_cost", [20e-9, 30e-6])
@pytest.mark.parametrize("length", [0.05, 0.5, 5.0, 20.0])
def test_what_waited_for_a_host_that_paused_keeps_its_time(length, frame_cost):
    trial = run(trials.host_pause(6.0, length, frame_cost), 50e-6, seconds=8 + 1.2 * length)
    assert trial.error(3, share=1.0) < 0.1
    assert trial.largest_step(1.0) < 0.01
    assert trial.back == trial.future == trial.clock.breaks == 0


@pytest.mark.parametrize("pace", [0.99, 0.92, 0.5])
@pytest.mark.parametrize("length", [0.5, 2.0, 4.0])
def test_what_waits_for_a_host_that_falls_behind_keeps_its_time(length, pace):
    trial = run(trials.host_falls_behind(6.0, length, pace), 50e-6, seconds=8 + 2.5 * length)
    assert trial.error(3, share=1.0) < 0.1
    assert trial.largest_step(1.0) < 0.01
    assert trial.back == trial.future == trial.clock.breaks == 0


@pytest.mark.parametrize("change", [0.002, 0.02])
def test_a_sensor_that_changes_its_pace_is_followed_at_last(change):
    def slow_down(numbers, measured, arrivals, later):
        slower = later * change * (measured - 6e9)
        return numbers, measured + slower, arrivals + slower
    trial = stream_with(slow_down, seconds=24.0)
    assert trial.error(3, 6, share=1.0) < 0.1
    assert trial.error(19, share=1.0) < 0.1
    assert trial.clock.breaks == 1
    assert trial.back == trial.future == 0


def stream_with(change, seconds=12.0):
    """Run a stream that is changed after 6 s: numbers, times measured and arrivals, in ns."""
    numbers = numbers_of(seconds)
    measured = numbers * PERIOD
    arrivals = trials.independent(0.2)(measured + PATH, np.random.default_rng(1))
    later = measured > 6e9
    return feed(SampleClock(RATE), *change(numbers, measured, np.maximum.accumulate(arrivals),
                                           later))


def test_a_loss_of_a_second_shifts_nothing():
    def lose(numbers, measured, arrivals, later):
        there = ~later | (measured > 7e9)
        return numbers[there], measured[there], arrivals[there]
    trial = stream_with(lose)
    assert trial.error(3, share=1.0) < 0.1
    assert trial.clock.breaks == trial.back == trial.future == 0


@pytest.mark.parametrize("pause", [0.003, 0.3, 8.0])
def test_a_sensor_that_paused_unnoticed_is_followed(pause):
    def stop(numbers, measured, arrivals, later):
        return numbers, measured + later * pause * 1e9, arrivals + later * pause * 1e9
    trial = stream_with(stop)
    assert trial.error(7 + pause, share=1.0) < 0.1
    assert trial.clock.breaks == 1
    assert trial.back == trial.future == 0


@pytest.mark.parametrize("asleep", [0.003, 0.3, 5.0])
def test_a_host_that_slept_without_counting_it_is_followed(asleep):
    def sleep(numbers, measured, arrivals, later):
        there = ~later | (measured > (6 + asleep) * 1e9)
        return [values[there] for values in (
            numbers, measured - later * asleep * 1e9, arrivals - later * asleep * 1e9)]
    trial = stream_with(sleep)
    assert trial.error(3, 6, share=1.0) < 0.1
    assert trial.errors[-1] == pytest.approx(0, abs=0.1)
    after = trial.seconds[trial.steps.size // SAMPLES // 2]
    assert trial.error(max(after, 6.9), share=1.0) < 0.1
    assert trial.clock.breaks == 1
    assert trial.back == trial.future == 0


@pytest.mark.parametrize("step", [-1.0, 1.0])
def test_a_clock_of_the_host_that_is_set_is_followed_within_a_second(step):
    def set_clock(numbers, measured, arrivals, later):
        return numbers, measured + later * step * 1e9, arrivals + later * step * 1e9
    trial = stream_with(set_clock)
    assert np.abs(trial.errors[-int(5 * RATE / SAMPLES):]).max() < 0.1
    assert trial.clock.breaks == 1
    assert trial.back == (step < 0)


def test_numbers_that_begin_anew_begin_a_new_stream():
    def restart(numbers, measured, arrivals, later):
        anew = numbers - numbers[later][0] + SAMPLES - 1
        return np.where(later, anew, numbers), measured, arrivals
    trial = stream_with(restart)
    assert trial.error(7, share=1.0) < 0.1
    assert trial.clock.breaks == 1


def test_a_late_start_is_corrected_by_the_first_early_frame():
    numbers = numbers_of(2)
    measured = numbers * PERIOD
    late = np.maximum(measured, 50e6) + PATH
    assert feed(SampleClock(RATE), numbers, measured, late).error(0.2, share=1.0) < 0.2


# --- frames that cannot be ----------------------------------------------------------------------

def test_numbers_that_come_twice_or_in_the_wrong_order_have_one_time_each():
    noise = np.random.default_rng(4)
    clock, stamps = SampleClock(RATE), {}
    numbers = numbers_of(5).astype(int)
    swapped = noise.choice(len(numbers) - 1, len(numbers) // 100, replace=False)
    for one in swapped:
        numbers[one], numbers[one + 1] = numbers[one + 1], numbers[one]
    for place, number in enumerate(numbers.tolist()):
        for _ in range(1 + (place % 100 == 0)):
            clock.update(number, START + round(PATH + (place + 1) * SAMPLES * PERIOD))
            for one in range(number - SAMPLES + 1, number + 1):
                stamps[one] = clock.time_of(one)
    times = np.array([stamps[number] for number in sorted(stamps)])
    assert np.diff(times).min() > 0


# --- a user that waits, figures, slow cycles -----------------------------------------------------

@pytest.mark.parametrize("delays", [trials.poll(16.0), trials.in_order(2.0)])
def test_a_user_that_waits_gets_even_stamps_from_the_first_sample_on(delays):
    clock = SampleClock(RATE, waits=True)
    numbers = numbers_of(2)
    measured = numbers * PERIOD
    arrivals = np.ceil(delays(measured + PATH, np.random.default_rng(0))).astype(int)
    stamps: list[int] = []
    for number, arrival in zip(numbers.astype(int).tolist(), arrivals.tolist(), strict=True):
        clock.update(number, arrival)
        if clock.settled:
            stamps += [clock.time_of(one) for one in range(len(stamps), number + 1)]
            assert stamps[-1] <= arrival
    steps = np.diff(stamps) / PERIOD - 1
    assert len(stamps) == numbers[-1] + 1
    assert np.abs(steps).max() < 0.01


def test_the_figures_of_the_delays():
    clock = run(trials.independent(2.0)).clock
    assert clock.jitter == pytest.approx(2e6, rel=0.1)
    assert 10e6 < clock.delay_spread < 40e6
    clock = run(trials.poll(4.0)).clock
    assert clock.jitter == pytest.approx(4e6 / 12 ** 0.5, rel=0.1)
    assert clock.delay_spread == pytest.approx(4e6, rel=0.1)


@pytest.mark.parametrize("deviation", [0.0, 0.008, -0.008])
@pytest.mark.parametrize("period", [0.0523, 0.0747, 0.1303, 0.3101])
def test_regular_cycles_do_not_carry_the_jitter_of_polls(period, deviation):
    noise = np.random.default_rng(2)
    clock = SampleClock(1 / period, tolerance=0.01, jitter=8e6)
    numbers = np.flatnonzero(noise.random(int(100 / period)) > 0.02)  # some are missed
    measured = numbers * period * 1e9 * (1 + deviation)
    polls = 16e6
    arrivals = np.ceil((measured + PATH + noise.exponential(0.2e6, len(numbers))) / polls) * polls
    errors, last = [], -np.inf
    for number, arrival, true in zip(numbers.tolist(), arrivals.astype(int).tolist(), measured,
                                     strict=True):
        clock.update(number, START + arrival)
        stamp = clock.time_of(number) - START
        assert last < stamp <= arrival
        errors.append((stamp - true) * 1e-6)
        last = stamp
    late = np.array(errors)[measured > 30e9]
    assert np.quantile(np.abs(late - np.median(late)), 0.99) < 1.0


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


@pytest.mark.parametrize("change", [-3600 * 10**9, 300 * 10**6])
def test_a_time_of_day_that_was_set_counts_at_once(monkeypatch, change):
    clocks = Clocks(monkeypatch)
    clock = HostClock()
    clocks.ahead += change
    clock.follow()
    assert clocks.ahead - 200 < clock.offset <= clocks.ahead  # so no stamp lies in the future
    assert clock.steps == 1


@pytest.mark.parametrize("change", [-25_000, 25_000])
def test_a_time_of_day_that_was_corrected_counts_little_by_little(monkeypatch, change):
    clocks = Clocks(monkeypatch)
    clock = HostClock()
    before = clock.offset
    clocks.ahead += change
    clock.follow()
    assert clock.offset == before
    clock.slew(400)
    assert abs(clock.offset - before) == 400
    for _ in range(70):
        clock.slew(400)
    assert clocks.ahead - 200 < clock.offset <= clocks.ahead
    assert (clock.rest, clock.steps) == (0, 0)


def test_the_kernel_tells_when_something_was_on_the_bus(monkeypatch):
    clocks = Clocks(monkeypatch)
    clock = HostClock()
    now = clocks.now

    def when(ago, seen):
        return clock.when((now - ago + clocks.ahead) * 1e-9, seen)

    assert when(0, now + 10**6) == pytest.approx(now, abs=1000)
    assert when(5 * 10**9, now) == pytest.approx(now - 5 * 10**9, abs=1000)  # it waited
    assert when(-10**6, now) == now  # not yet: no time of this clock
    assert when(3600 * 10**9, now) == now
    clocks.ahead -= 300 * 10**6  # the clock is set between two frames
    assert when(0, now + 10**6) == pytest.approx(now, abs=1000)


def test_what_comes_between_two_readings_does_not_count(monkeypatch):
    clocks = Clocks(monkeypatch)
    clocks.interruptions = [10**9, 50, 10**6]
    assert HostClock().offset == clocks.ahead - 50
