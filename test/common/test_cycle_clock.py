# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The time of measurements in regular cycles, behind adapters that are polled; simulated time."""

import numpy as np
import pytest

from driver_common.cycle_clock import CycleClock

START = 5 * 10**14  # ns
POLLS = 16e6  # ns


def polled(times):
    return np.ceil(times / POLLS) * POLLS


def play(nominal, measured, arrivals):
    """Return errors in ms and stamps in ns after `START`, and the clock."""
    clock = CycleClock(nominal)
    stamps = np.array([clock.stamp(START + round(arrival)) - START for arrival in arrivals])
    assert (stamps <= np.round(arrivals)).all()
    assert np.diff(stamps).min() > 0
    return (stamps - measured) * 1e-6, stamps, clock


def cycles(period, seconds, missed, noise):
    return np.flatnonzero(noise.random(int(seconds / period)) >= missed) * period * 1e9


@pytest.mark.parametrize("deviation", [0.0, 0.008, -0.008])
@pytest.mark.parametrize("nominal", [0.0523, 0.0747, 0.1303, 0.3101])
@pytest.mark.parametrize("missed", [0.0, 0.05])
def test_regular_cycles_do_not_carry_the_jitter_of_polls(nominal, deviation, missed):
    noise = np.random.default_rng(2)
    measured = cycles(nominal * (1 + deviation), 120, missed, noise)
    arrivals = polled(measured + noise.exponential(0.2e6, len(measured)))
    errors, _, clock = play(nominal, measured, arrivals)
    late = errors[measured > 40e9]
    assert np.quantile(np.abs(late - np.median(late)), 0.99) < 1.0
    assert clock.is_regular
    assert np.std(arrivals - measured) > 4e6


def test_measurements_at_any_time_keep_their_arrival():
    noise = np.random.default_rng(3)
    arrivals = np.cumsum(noise.uniform(0.05e9, 0.25e9, 300))
    errors, _, clock = play(0.1, arrivals, arrivals)
    assert not clock.is_regular
    assert np.abs(errors).max() < 0.001


def test_a_device_that_begins_anew_is_followed():
    noise = np.random.default_rng(4)
    measured = cycles(0.0747, 60, 0.0, noise)
    measured = np.concatenate((measured, measured[-1] + 0.561e9 + measured))
    errors, _, clock = play(0.0747, measured, polled(measured))
    assert np.abs(errors[measured > 90e9]).max() < 2.0
    assert clock.is_regular
    assert np.abs(errors).max() < 80


def test_a_reply_that_a_busy_host_took_late_moves_no_other():
    noise = np.random.default_rng(5)
    measured = cycles(0.0747, 60, 0.0, noise)
    arrivals = polled(measured)
    late = len(arrivals) // 2
    kept = np.ones(len(arrivals), bool)
    kept[late + 1:late + 8] = False  # nobody asked for these
    arrivals[late] += 0.5e9
    errors, _, clock = play(0.0747, measured[kept], arrivals[kept])
    after = errors[late + 1:]
    assert np.abs(after - np.median(after)).max() < 2.0
    assert clock.is_regular
