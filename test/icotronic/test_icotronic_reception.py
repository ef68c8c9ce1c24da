# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""From frames to samples with their times, in simulated time."""

import random

import numpy as np
import pytest

from driver_common.sample_clock import HostClock, SampleClock
from icotronic_driver.reception import Reception
from icotronic_driver.streaming import StreamDecoder, StreamFormat

RATE = 9523.8
FRAME_TIME = 3e9 / RATE  # ns
START = 10**15  # ns on the monotonic clock
EPOCH = 1_800_000_000_000_000_000 - START  # ns from there to the time of day
PATH = 1_000_000  # ns


class Receiver:
    """Receives a stream whose frames hold their number."""

    def __init__(self, kernel_stamps=False):
        self.decoder = StreamDecoder(StreamFormat((True, False, False), 3), RATE / 3)
        self.clock = SampleClock(RATE, waits=True)
        self.numbers, self.stamps = [], []
        self.reception = Reception(self.decoder, self.clock, HostClock(lambda: EPOCH), self.take,
                                   kernel_stamps=kernel_stamps)
        self.handle = self.reception.handler()

    def take(self, stamp, period, values):
        self.numbers.append(values[1] << 16 | values[0])
        self.stamps += [stamp, stamp + round(period), stamp + round(2 * period)]

    def receive(self, number, bus_time, seen, counter=None):
        """Receive a frame; times in ns after `START`."""
        counter = number if counter is None else counter
        data = bytearray((0xA2, counter & 0xFF)) + number.to_bytes(4, "little") + bytes(2)
        self.handle(data, (EPOCH + START + bus_time) * 1e-9, START + round(seen))

    @property
    def errors(self):
        """Errors of all stamps in ms."""
        first = 3 * np.array(self.numbers)[:, None] + np.arange(-2, 1)
        return (np.array(self.stamps) - EPOCH - START - PATH
                - first.ravel() * FRAME_TIME / 3) * 1e-6


def sent(number):
    return number * FRAME_TIME + PATH


def test_the_first_samples_wait_for_a_good_time():
    receiver = Receiver()
    for number in range(3000):
        receiver.receive(number, sent(number), sent(number) + 2e6 * random.Random(number).random())
    assert receiver.numbers == list(range(3000))
    assert np.abs(receiver.errors).max() < 0.5
    steps = np.diff(receiver.stamps) / (FRAME_TIME / 3)
    assert np.abs(steps - 1).max() < 0.01


def test_what_is_held_is_handed_over_at_the_end():
    receiver = Receiver()
    for number in (*range(20), 21):
        receiver.receive(number, sent(number), sent(number))
    assert receiver.numbers == []
    receiver.reception.finish()
    assert receiver.numbers == [*range(20), 21]
    assert np.diff(receiver.stamps).min() > 0


def test_what_is_held_keeps_its_pace_though_a_frame_comes_early():
    receiver, number, late = Receiver(), 0, 30e6
    while not receiver.numbers:
        receiver.receive(number, sent(number) + late, sent(number) + late)
        number += 1
    held = number
    while len(receiver.numbers) < held:  # all have been late until now
        receiver.receive(number, sent(number), sent(number))
        number += 1
    steps = np.diff(np.reshape(receiver.stamps, (-1, 3))[:held - 1].ravel()) / (FRAME_TIME / 3)
    assert np.abs(steps - 1).max() < 0.011
    assert np.diff(receiver.stamps).min() > 0


def test_a_stream_that_brought_nothing_ends_as_well():
    receiver = Receiver()
    receiver.reception.finish()
    assert receiver.numbers == []


@pytest.mark.parametrize("kernel_stamps", [False, True])
@pytest.mark.parametrize("pause", [0.05e9, 0.5e9, 5e9, 20e9])
def test_a_pause_of_the_process_loses_nothing_and_moves_no_stamp(pause, kernel_stamps):
    receiver = Receiver(kernel_stamps)
    begin, seen = 3e9, 0.0
    for number in range(int((begin + pause + 2e9) / FRAME_TIME)):
        due = sent(number)
        late = begin + pause if begin < due < begin + pause else 0.0
        seen = max(due, late, seen + 10e3)  # it takes 10 µs to read a frame
        receiver.receive(number, due, seen)
    assert receiver.decoder.statistics.lost == receiver.clock.breaks == 0
    assert np.abs(receiver.errors[10_000:]).max() < 0.1
    assert np.abs(np.diff(receiver.stamps[10_000:]) / (FRAME_TIME / 3) - 1).max() < 0.01


def test_bus_times_of_the_kernel_take_the_place_of_a_late_look():
    noise = random.Random(2)
    receiver = Receiver(kernel_stamps=True)
    seen = 0.0
    for number in range(12_000):
        seen = max(seen, sent(number) + noise.expovariate(1 / 3e6))
        receiver.receive(number, sent(number), seen)
    assert np.abs(receiver.errors[3000:]).max() < 0.1


@pytest.mark.parametrize("fault", ["swap", "double", "damage", "all"])
def test_frames_twice_swapped_or_damaged_have_even_stamps(fault):
    noise = random.Random(3)
    receiver = Receiver()
    order = list(range(15_000))
    damaged = set()
    for place in range(1000, 14_000, 2):  # no frame comes before it was sent
        kind = noise.random() if fault == "all" else {
            "swap": 0.005, "double": 0.015, "damage": 0.025}[fault]
        if noise.random() > 0.02 or kind > 0.03:
            continue
        if kind < 0.01:
            order[place], order[place + 1] = order[place + 1], order[place]
        elif kind < 0.02:
            order[place] = order[place - 1]
        else:
            damaged.add(place)
    for place, number in enumerate(order):
        counter = noise.randrange(256) if place in damaged else number
        receiver.receive(number, sent(place), sent(place), counter)
    assert np.diff(receiver.numbers).min() > 0
    assert np.diff(receiver.stamps).min() > 0
    assert np.abs(receiver.errors[3000:]).max() < 0.5
    assert len(receiver.numbers) > 0.95 * len(set(order))
