# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Vibration: values of signals that are known, and the filter beside that of SciPy."""

import math

import numpy as np
import pytest

from icotronic_driver.gathering import Samples
from icotronic_driver.vibration import COLUMNS, SETTLING, Vibration, velocity_filter

RATE = 9523.8  # samples/s
START = 1_800_000_000_000_000_000  # ns since the epoch


def samples_of(signals, rate=RATE, first=0):
    """Return samples that begin with number `first`; signals has a column per axis."""
    accelerations = np.zeros((len(signals), 3), np.float32)
    accelerations[:, :signals.shape[1]] = signals
    numbers = first + np.arange(len(signals))
    return Samples(START + np.round(numbers * 1e9 / rate).astype(np.int64), accelerations)


def sine(amplitude, frequency, seconds, rate=RATE, mean=0.0):
    times = np.arange(round(seconds * rate)) / rate
    return (mean + amplitude * np.sin(2 * math.pi * frequency * times))[:, None]


def noise(seconds, rate=RATE):
    return np.random.default_rng(1).normal(9.81, 3.0, (round(seconds * rate), 2))


def summary(signals, rate=RATE):
    """Return the values of the second half of signals, by name, of the first axis."""
    half = len(signals) // 2
    vibration = Vibration(rate, range(signals.shape[1]))
    vibration.summary(samples_of(signals[:half], rate))
    row, *_ = vibration.summary(samples_of(signals[half:], rate, half))
    return dict(zip(COLUMNS, row.tolist(), strict=True))


def velocities_by_scipy(signals, rate):
    """Return what SciPy makes of accelerations: filtered, and integrated by trapezoids."""
    from scipy import integrate, signal  # takes seconds, which every worker would spend

    bands = [("hp", 10)] + [("lp", 1000)] * (rate >= 2500)
    sections = np.concatenate([signal.butter(4, corner, kind, fs=rate, output="sos")
                               for kind, corner in bands])
    filtered = signal.sosfilt(sections, signals, axis=0)
    return integrate.cumulative_trapezoid(filtered, dx=1 / rate, axis=0, initial=0)


# --- signals that are known ----------------------------------------------------------------------

def test_a_sine_has_the_values_of_a_sine():
    amplitude, frequency = 10.0, 100.0
    values = summary(sine(amplitude, frequency, 4.0, mean=-3.0))
    assert values["mean"] == pytest.approx(-3.0, abs=1e-3)
    assert values["rms"] == pytest.approx(amplitude / math.sqrt(2), rel=1e-3)
    assert values["peak"] == pytest.approx(amplitude, rel=1e-3)
    assert values["crest_factor"] == pytest.approx(math.sqrt(2), rel=2e-3)
    assert values["velocity_rms"] == pytest.approx(
        1e3 * amplitude / math.sqrt(2) / (2 * math.pi * frequency), rel=2e-3)


@pytest.mark.parametrize(("frequency", "share"), [
    (2.0, 0.0), (10.0, math.sqrt(0.5)), (40.0, 1.0), (500.0, 1.0), (1000.0, math.sqrt(0.5)),
    (4000.0, 0.0)])
def test_only_the_band_counts_for_the_velocity(frequency, share):
    velocity = 1e3 * 5.0 / math.sqrt(2) / (2 * math.pi * frequency)
    assert summary(sine(5.0, frequency, 6.0))["velocity_rms"] == pytest.approx(
        share * velocity, abs=0.03 * velocity)  # trapezoids give 3.6 % less at 1000 Hz


def test_no_vibration_has_no_crest_factor_and_no_velocity():
    values = summary(np.full((40_000, 1), 9.5))
    assert values == pytest.approx({"mean": 9.5, "rms": 0, "peak": 0, "crest_factor": math.nan,
                                    "velocity_rms": 0}, abs=1e-9, nan_ok=True)


def test_axes_that_are_not_measured_have_no_row():
    samples = samples_of(noise(1.0))
    rows = Vibration(RATE, [1, 0]).summary(samples)
    assert rows.shape == (2, len(COLUMNS))
    np.testing.assert_allclose(rows[0], Vibration(RATE, [0]).summary(samples)[0])


# --- the filter ----------------------------------------------------------------------------------

@pytest.mark.parametrize("rate", [RATE, 2000.0, 100.0])
def test_the_filter_is_the_one_of_scipy(rate):
    signals = noise(3.0, rate)
    wanted = velocities_by_scipy(signals - signals[0], rate)
    made = velocity_filter(rate)
    made.reset(2)
    parts = [made.run(part) for part in np.split(signals - signals[0], [1, 64, 100, 250])]
    velocities = np.concatenate(parts)
    # The rule of trapezoids begins with half a step less, which the high-pass forgets.
    settled = round(SETTLING * rate)
    np.testing.assert_allclose(velocities[settled:], wanted[settled:], atol=1e-4 * wanted.std())


def test_the_velocity_of_a_period_is_the_one_of_scipy():
    signals = noise(4.0)
    wanted = 1e3 * np.sqrt(np.mean(velocities_by_scipy(
        signals - signals[0], RATE)[len(signals) // 2:, 0] ** 2))
    assert summary(signals)["velocity_rms"] == pytest.approx(wanted, rel=1e-4)


def test_a_rate_too_low_for_the_band_gives_no_velocity():
    values = summary(sine(1.0, 2.0, 20.0, 20.0), 20.0)
    assert math.isnan(values["velocity_rms"])
    assert values["peak"] == pytest.approx(1.0, rel=0.1)


# --- gaps ----------------------------------------------------------------------------------------

def test_the_velocity_is_unknown_until_the_filter_has_settled():
    vibration = Vibration(RATE, [0])
    count = round(SETTLING * RATE)
    signals = sine(5.0, 100.0, 2.0, mean=9.81)
    (first,) = vibration.summary(samples_of(signals[:count]))
    (second,) = vibration.summary(samples_of(signals[count:], first=count))
    assert math.isnan(first[-1])
    assert second[-1] == pytest.approx(1e3 * 5.0 / math.sqrt(2) / (2 * math.pi * 100), rel=0.01)


@pytest.mark.parametrize("place", [0, 3000])
def test_a_gap_begins_the_filter_anew(place):
    vibration = Vibration(RATE, [0])
    signals = noise(2.0)[:, :1]
    vibration.summary(samples_of(signals[:10_000]))
    stamps, accelerations = samples_of(signals[10_000:], first=10_000)
    stamps[place:] += round(3e9 / RATE)
    (gap,) = vibration.summary(Samples(stamps, accelerations))
    behind = max(place + round(SETTLING * RATE), 0)
    fresh = velocity_filter(RATE)
    fresh.reset(1)
    velocities = fresh.run(accelerations[place:, :1].astype(float)
                           - accelerations[place, 0])[behind - place:]
    going = velocity_filter(RATE)
    going.reset(1)
    before = going.run((signals[:10_000 + place] - signals[0]).astype(np.float32).astype(float))
    both = np.concatenate((before[10_000:], velocities))
    assert gap[-1] == pytest.approx(1e3 * np.sqrt(np.mean(both ** 2)), rel=1e-3)
