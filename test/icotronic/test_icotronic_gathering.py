# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Samples in bulk are those that a frame at a time gives, in periods of the clock."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from icotronic_driver.gathering import (
    LATE,
    Consumer,
    Conversion,
    Gatherer,
    Stream,
)

PERIOD = 20_000_000  # ns
START = 1_800_000_000_000_000_000  # ns since the epoch, a multiple of PERIOD
STEP = 105_000  # ns


def law(slope, offset):
    return lambda raw: slope * raw + offset


TWO = Conversion([law(0.01, -300.0), law(0.02, 7.0)], [5, 0])  # −z, x


def gather(frames, conversion=TWO, finish=True):
    """Return the periods that come of frames, as lists of (stamp, x, y, z)."""
    periods = []
    gatherer = Gatherer(PERIOD * 1e-9, conversion, lambda samples: periods.append(
        [(stamp, *row) for stamp, row in zip(
            samples.stamps.tolist(), samples.accelerations.tolist(), strict=True)]))
    for frame in frames:
        gatherer.take(*frame)
    if finish:
        gatherer.finish()
    return periods


def one_by_one(frames, conversion=TWO):
    """Return the samples of frames as `columns` gives them, without arrays."""
    samples, columns = [], conversion.columns()
    for stamp, step, values in frames:
        for first in range(0, len(values), conversion.channels):
            samples.append((stamp, *(table[values[first + channel]]
                                     for channel, table in columns)))
            stamp += step
    return samples


def test_channels_go_to_their_axes_with_their_sign():
    accelerations = TWO.accelerations(np.array([[1000, 0], [0, 65535]]))
    np.testing.assert_array_equal(accelerations, np.array(
        [[7.0, 0, 290.0], [0.02 * 65535 + 7.0, 0, 300.0]], np.float32))


def test_any_law_of_conversion_is_possible():
    conversion = Conversion([np.sqrt], [1])
    assert conversion.accelerations(np.array([[4], [65025]])).tolist() == [[0, 2, 0], [0, 255, 0]]


frame = st.tuples(st.integers(1, 8 * PERIOD // 10), st.integers(1, STEP),
                  st.lists(st.integers(0, 65535), min_size=6, max_size=6).map(tuple))


@given(st.lists(frame, max_size=40))
def test_nothing_gets_lost_and_all_of_a_period_is_together(parts):
    stamp, frames = START + 123, []
    for pause, step, values in parts:  # each frame begins behind the end of the one before
        frames.append((stamp, step, values))
        stamp += 2 * step + pause
    periods = gather(frames)
    assert [sample for period in periods for sample in period] == one_by_one(frames)
    numbers = [{stamp // PERIOD for stamp, *_ in period} for period in periods]
    assert all(len(number) == 1 for number in numbers)
    assert len(set.union(set(), *numbers)) == len(periods)


def test_a_period_is_handed_over_with_the_first_frame_behind_it():
    frames = [(START + number * 3 * STEP, STEP, (1, 2) * 3) for number in range(65)]
    assert gather(frames[:64], finish=False) == []
    (period,) = gather(frames, finish=False)
    assert period[0][0] == START
    assert START + PERIOD - STEP <= period[-1][0] < START + PERIOD


def test_a_clock_that_was_set_back_begins_another_period():
    frames = [(START, STEP, (1, 2)), (START - 10**12, STEP, (3, 4)), (START + STEP, STEP, (5, 6))]
    assert [len(period) for period in gather(frames)] == [1, 1, 1]


# --- a stream and those who listen ---------------------------------------------------------------

class Listener:
    """Somebody who listens or not, and what came."""

    def __init__(self, gathers):
        self.listens = True
        self.frames, self.periods = [], []
        self.gatherer = Gatherer(1e-9 * PERIOD, TWO, self.periods.append) if gathers else None
        take = self.gatherer.take if gathers else lambda *frame: self.frames.append(frame)
        self.consumer = Consumer(lambda: int(self.listens), take, self.gatherer)


@pytest.fixture
def single():
    return Listener(gathers=False)


@pytest.fixture
def batch():
    return Listener(gathers=True)


def test_who_does_not_listen_gets_nothing(single, batch):
    stream = Stream([single.consumer, batch.consumer], 0)
    single.listens = False
    assert not stream.look(START)
    stream.take(START, 100.9, (1, 2))
    stream.finish()
    assert not single.frames
    assert len(batch.periods) == 1


def test_only_who_wants_each_sample_at_once_keeps_frames_from_waiting(single, batch):
    assert not Stream([batch.consumer], 0).look(START)
    assert Stream([single.consumer, batch.consumer], 0).look(START)


def test_what_waits_is_handed_over_when_nothing_follows(batch):
    stream = Stream([batch.consumer], 0)
    stream.look(START)
    stream.take(START, 100.0, (1, 2))
    stream.look(START + PERIOD + LATE)
    assert not batch.periods
    stream.look(START + PERIOD + LATE + 1)
    assert len(batch.periods) == 1
    batch.listens = False
    stream.take(START, 100.0, (1, 2))
    stream.look(START)
    assert len(batch.periods) == 2


def test_a_period_is_whole_though_its_frames_waited_for_a_busy_host(batch):
    stream = Stream([batch.consumer], 0)
    for frame in range(4):
        stream.take(START + 300 * frame, 100.0, (1, 2))
        stream.look(START + PERIOD + 2 * LATE)
    assert not batch.periods
    stream.look(START + PERIOD + 2 * LATE)
    assert len(batch.periods) == 1
