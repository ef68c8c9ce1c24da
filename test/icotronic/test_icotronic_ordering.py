# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Frames in the order of their counters."""

import pytest
from operations import calls

from icotronic_driver.ordering import MOST_HELD, Frame, FrameOrder
from icotronic_driver.streaming import StreamDecoder, StreamFormat

FRAME_TIME = 315_000  # ns


def frame(counter, value=None, seen=0):
    value = counter if value is None else value
    return Frame(bytes((0xA2, counter & 0xFF)) + 3 * value.to_bytes(2, "little"), 0.0, seen)


def play(frames):
    """Return number and first value of the frames that are left, and what was counted."""
    decoder = StreamDecoder(StreamFormat((True, False, False), 3), 3175.0)
    order, found = FrameOrder(decoder), []

    def decode(several):
        for data, bus_time, seen in several:
            values = decoder.decode_frame(bus_time, data, seen)
            if values is not None:
                found.append((decoder.number, values[0]))

    for place, one in enumerate(frames):
        decode(order.sort(one._replace(bus_time=place / 3175, seen=place * FRAME_TIME)))
    decode(order.rest())
    return found, decoder.statistics


def numbered(*numbers):
    return [(number, number) for number in numbers]


@pytest.mark.parametrize(("counters", "left", "lost", "duplicates"), [
    ([0, 1, 2, 3], [0, 1, 2, 3], 0, 0),
    ([0, 2, 1, 3], [0, 1, 2, 3], 0, 0),  # swapped
    ([0, 1, 1, 2], [0, 1, 2], 0, 1),  # twice
    ([0, 2, 2, 1, 3], [0, 1, 2, 3], 0, 1),
    ([0, 1, 3, 4], [0, 1, 3, 4], 1, 0),  # one lost
    ([0, 1, 5, 9, 10], [0, 1, 5, 9, 10], 6, 0),  # losses one behind the other
    ([0, 1, 5], [0, 1, 5], 3, 0),  # at the end
    ([0, 1, 240, 241], [0, 1, 240, 241], 238, 0),
    ([0, 2, 1, 4, 3, 6, 5, 7], list(range(8)), 0, 0)])
def test_frames_in_their_order(counters, left, lost, duplicates):
    found, statistics = play([frame(counter) for counter in counters])
    assert found == numbered(*left)
    assert (statistics.lost, statistics.duplicates, statistics.damaged) == (lost, duplicates, 0)


def test_counters_turn():
    found, statistics = play([frame(number, number) for number in (*range(600), 601, 600, 602)])
    assert found == numbered(*range(603))
    assert statistics.lost == 0


@pytest.mark.parametrize("counter", [0, 1, 5, 77, 200, 255])
def test_a_damaged_counter_moves_no_other_frame(counter):
    frames = [frame(number) for number in range(10)]
    frames[4] = frame(counter, 4)
    found, statistics = play(frames)
    assert found == numbered(0, 1, 2, 3, 5, 6, 7, 8, 9)
    assert (statistics.lost, statistics.damaged) == (1, 1)
    assert statistics.fault == f"data frame with counter {counter} behind 3"


@pytest.mark.parametrize("damage", [
    (9, 200), (200, 6), (0, 0), (8, 7), (200, 201), (9, 4), (77, 200, 201), (200, 4, 77)])
def test_damaged_counters_side_by_side_move_no_other_frame(damage):
    frames = [frame(number) for number in range(15)]
    frames[4:4 + len(damage)] = [frame(counter, 40 + counter) for counter in damage]
    found, statistics = play(frames)
    assert found == numbered(*range(4), *range(4 + len(damage), 15))
    assert statistics.damaged + statistics.duplicates == len(damage)


@pytest.mark.parametrize("first", [254, 255, 256, 257])
def test_a_loss_of_about_a_turn(first):
    found, statistics = play([frame(number) for number in (0, 1, *range(first, first + 5))])
    assert found == numbered(0, 1, *range(first, first + 5))
    assert (statistics.lost, statistics.damaged) == (first - 2, 0)


def test_a_damaged_counter_among_losses_moves_no_other_frame():
    numbers = (0, 1, 3, 4, 6, 7, 8, 9, 10, 12, 13)
    found, _ = play([frame(177 if number == 7 else number, number) for number in numbers])
    assert found == numbered(*(number for number in numbers if number != 7))


def test_losses_beside_a_damaged_counter():
    found, statistics = play([frame(0), frame(1), frame(77, 2), *map(frame, (4, 5, 6))])
    assert found == numbered(0, 1, 4, 5, 6)
    assert (statistics.lost, statistics.damaged) == (2, 1)


def test_a_radio_that_loses_every_other_frame():
    found, statistics = play([frame(number) for number in range(0, 41, 2)])
    assert found == numbered(*range(0, 41, 2))
    assert statistics.lost == 20


def test_a_frame_that_was_overtaken_by_two_gets_its_place():
    found, statistics = play([frame(number) for number in (0, 2, 3, 1, 4, 5)])
    assert found == numbered(*range(6))
    assert (statistics.lost, statistics.damaged) == (0, 0)


def test_a_frame_that_was_overtaken_by_three_is_dropped():
    found, statistics = play([frame(number) for number in (0, 2, 3, 4, 1, 5, 6)])
    assert found == numbered(0, *range(2, 7))
    assert (statistics.lost, statistics.damaged) == (1, 1)


def test_what_is_no_frame_of_the_stream_passes():
    found, statistics = play([frame(0), Frame(b"", 0.0, 0), Frame(b"\x80", 0.0, 0), frame(1)])
    assert found == numbered(0, 1)
    assert (statistics.damaged, statistics.others) == (1, 1)


def test_a_frame_that_was_overtaken_keeps_the_later_arrival_of_both():
    order = FrameOrder(StreamDecoder(StreamFormat((True, False, False), 3), 3175.0))
    order.sort(frame(0))
    assert order.sort(frame(2, seen=10)) == []
    assert [one.seen for one in order.sort(frame(1, seen=20))] == [20, 20]


@pytest.mark.parametrize("counters", [
    [0], [0, 2], [0, 2, 4, 8, 16, 32], [9, 7, 5, 3, 1], [0, 255], [0, 128], [3, 1, 2, 0, 90]])
def test_a_frame_costs_the_same_whatever_came_before(counters):
    short, long = ([frame(counter, place) for place, counter in enumerate(counters * count)]
                   for count in (200, 800))
    assert calls(lambda: play(long)) <= 4.5 * calls(lambda: play(short))


@pytest.mark.parametrize("counters", [
    [0], [0, 2], [0, 2, 4, 8, 16, 32], [9, 7, 5, 3, 1], [0, 255], [0, 128], [3, 1, 2, 0, 90]])
def test_few_frames_are_held_whatever_comes(counters):
    order = FrameOrder(StreamDecoder(StreamFormat((True, False, False), 3), 3175.0))
    for place, counter in enumerate(counters * 50):
        order.sort(frame(counter, place))
        assert len(order._held) < MOST_HELD
