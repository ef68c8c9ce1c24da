# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Decoding of streams, what is missing in them, bus load and calibration."""

from __future__ import annotations

import math
import random
import timeit

import numpy as np
import pytest

from driver_common.errors import FrameError
from icotronic_driver.laws import Calibration
from icotronic_driver.streaming import (
    STOP,
    StreamBatch,
    StreamDecoder,
    StreamFormat,
    bus_load,
    decode_single,
    stream_format,
    supply_voltage,
)

X, Y, XY, XZ, YZ, XYZ = ((True, False, False), (False, True, False), (True, True, False),
                         (True, False, True), (False, True, True), (True, True, True))
FORMATS = [  # format byte, meaning, payload length of a data frame (CAN-FD above 8)
    (0x80, STOP, 2), (0xA1, StreamFormat(X, 1), 4), (0x91, StreamFormat(Y, 1), 4),
    (0xA2, StreamFormat(X, 3), 8), (0xB1, StreamFormat(XY, 1), 6), (0xA9, StreamFormat(XZ, 1), 6),
    (0x99, StreamFormat(YZ, 1), 6), (0xB9, StreamFormat(XYZ, 1), 8),
    (0x39, StreamFormat(XYZ, 1, stream=False), 8), (0xE1, StreamFormat(X, 1, 3), 5),
    (0xF1, StreamFormat(XY, 1, 3), 8), (0xF9, StreamFormat(XYZ, 1, 3), 12),
    (0xA3, StreamFormat(X, 6), 16), (0xA4, StreamFormat(X, 10), 24),
    (0xA5, StreamFormat(X, 15), 32), (0xA6, StreamFormat(X, 20), 48),
    (0xA7, StreamFormat(X, 30), 64),
    (0xBC, StreamFormat(XYZ, 10), 64), (0xB5, StreamFormat(XY, 15), 64),
    (0xE6, StreamFormat(X, 20, 3), 64),
]


@pytest.mark.parametrize(("code", "format", "length"), FORMATS)
def test_formats(code: int, format: StreamFormat, length: int) -> None:
    assert format.encode() == code
    assert StreamFormat.decode(code) == format
    assert format.frame_length == length


def test_every_format_byte_survives() -> None:
    assert all(StreamFormat.decode(code).encode() == code for code in range(256))


def test_what_is_no_format() -> None:
    for wrong, words in ((StreamFormat(X, 2), "2 data sets"), (StreamFormat(X, 1, 4), "not 4")):
        with pytest.raises(ValueError, match=words):
            wrong.encode()
    with pytest.raises(ValueError, match="at most 64"):
        _ = StreamFormat(XYZ, 30).frame_length
    with pytest.raises(ValueError, match="at least one channel"):
        stream_format((False, False, False))


@pytest.mark.parametrize(("channels", "can_fd", "sets", "rate"), [
    (X, False, 3, 3174.6), (Y, False, 3, 3174.6), (XZ, False, 1, 4761.9), (XYZ, False, 1, 3174.6),
    (X, True, 30, 317.46), (XY, True, 15, 317.46), (XYZ, True, 10, 317.46)])
def test_fewest_frames(channels: tuple[bool, bool, bool], can_fd: bool, sets: int,
                       rate: float) -> None:  # errata C7
    format = stream_format(channels, can_fd=can_fd)
    assert format == StreamFormat(channels, sets)
    assert format.frame_rate(38.4e6 / 3 / 21 / 64) == pytest.approx(rate, abs=0.05)


def test_text_for_people() -> None:
    assert str(StreamFormat(XZ, 3)) == "stream of x, z, 3 data sets of 2-byte values"
    assert str(StreamFormat(Y, 1, 3, stream=False)) == (
        "single request of y, 1 data set of 3-byte values")
    assert str(STOP) == "stop"


FRAMES = [  # a data frame and its values, data set by data set, all in the order of time
    (StreamFormat(X, 1), "A1 00 34 12", [[0x1234]]),
    (StreamFormat(X, 3), "A2 00 01 00 02 00 FF FF", [[1], [2], [0xFFFF]]),
    (StreamFormat(XZ, 1), "A9 00 34 12 78 56", [[0x1234, 0x5678]]),
    (StreamFormat(XYZ, 1), "B9 00 01 80 02 80 03 80", [[0x8001, 0x8002, 0x8003]]),
    (StreamFormat(X, 1, 3), "E1 00 56 34 12", [[0x123456]]),
    (StreamFormat(XY, 1, 3), "F1 00 56 34 12 FF FF FF", [[0x123456, 0xFFFFFF]]),
    (StreamFormat(XYZ, 1, 3), "F9 00 01 00 00 02 00 00 03 00 00 00", [[1, 2, 3]]),
    (StreamFormat(X, 6), "A3 00 01 00 02 00 03 00 04 00 05 00 06 00 00 00",
     [[1], [2], [3], [4], [5], [6]]),
    (StreamFormat(XY, 3), "B2 00 01 00 02 00 03 00 04 00 05 00 06 00 00 00",
     [[1, 2], [3, 4], [5, 6]]),
    (StreamFormat(X, 30), "A7 00" + "".join(f" {value:02X} 01" for value in range(30)) + " 00 00",
     [[256 + value] for value in range(30)]),
    (StreamFormat(XYZ, 10), "BC 00" + "".join(f" {value:02X} 02" for value in range(30)) + " 00 00",
     [[512 + 3 * row, 513 + 3 * row, 514 + 3 * row] for row in range(10)]),
]


@pytest.mark.parametrize(("format", "text", "values"), FRAMES)
def test_data_frames(format: StreamFormat, text: str, values: list[list[int]]) -> None:
    data = bytes.fromhex(text)
    flat = tuple(value for row in values for value in row)
    assert StreamDecoder(format).decode_frame(0.0, data) == flat
    assert decode_single(format, data) == flat
    decoder = StreamDecoder(format)
    first = decoder.decode([(0.001, bytearray(data))])
    assert first.values.tolist() == [values]
    following = [(0.002 + index / 1000, data[:1] + bytes((1 + index,)) + data[2:])
                 for index in range(5)]
    batch = decoder.decode(following)
    assert batch.values.tolist() == [values] * 5
    assert batch.numbers.tolist() == [1, 2, 3, 4, 5]
    assert batch.arrivals.tolist() == [arrival for arrival, _ in following]
    assert len(batch) == 5
    assert decoder.statistics.frames == 6


def _frame(number: int) -> bytes:
    """Return data frame `number` of a stream of x, whose values are the number three times."""
    value = (number & 0xFFFF).to_bytes(2, "little")
    return bytes((0xA2, number & 0xFF)) + 3 * value


def _run(numbers: list[int], rate: float = 3175.0) -> StreamDecoder:
    decoder = StreamDecoder(StreamFormat(X, 3), rate)
    got = []
    for number in numbers:
        values = decoder.decode_frame(number / rate, _frame(number))
        if values is not None:
            got.append((decoder.number, values[0]))
    wanted = sorted(set(numbers))
    assert got == [(number - wanted[0], number) for number in wanted]
    return decoder


@pytest.mark.parametrize("jump", [3600.0, 1.8e9, -3600.0])
def test_a_clock_that_is_set_is_no_loss(jump: float) -> None:
    decoder = StreamDecoder(StreamFormat(X, 3), 3175.0)
    for number in range(2000):
        time = number / 3175.0
        decoder.decode_frame(time + jump * (number >= 1000), _frame(number), round(time * 1e9))
    assert (decoder.statistics.lost, decoder.number) == (0, 1999)


def test_an_outage_of_whole_turns_is_seen_by_both_clocks() -> None:
    decoder = StreamDecoder(StreamFormat(X, 3), 3175.0)
    for number in (*range(1000), *range(1000 + 10 * 256, 5000)):
        time = number / 3175.0
        decoder.decode_frame(time, _frame(number), round(time * 1e9))
    assert (decoder.statistics.lost, decoder.number) == (10 * 256, 4999)


def test_frames_that_got_lost_while_the_host_was_busy_are_counted() -> None:
    decoder = StreamDecoder(StreamFormat(X, 3), 3175.0)
    kept, lost = 635, 2540  # the host is away for 1 s, and the kernel keeps the first 0.2 s
    back = round((1000 + kept + lost) / 3175.0 * 1e9)
    for number in (*range(1000 + kept), *range(1000 + kept + lost, 8000)):
        arrival = number / 3175.0
        seen = max(back, round(arrival * 1e9)) if number >= 1000 else round(arrival * 1e9)
        decoder.decode_frame(arrival, _frame(number), seen)
    assert (decoder.statistics.lost, decoder.number) == (lost, 7999)


@pytest.mark.parametrize("first", [0, 1, 2, 200, 255])
def test_nothing_is_lost_over_wrap_arounds(first: int) -> None:  # errata C7
    decoder = _run(list(range(first, first + 1000)))
    assert decoder.statistics.frames == 1000
    assert decoder.statistics.lost == decoder.statistics.duplicates == 0


@pytest.mark.parametrize("missing", [[5], [0], [255], [256], [254, 255, 256], list(range(100, 350)),
                                     [3, 7, 300, 301], list(range(10, 265))])
def test_lost_frames_are_counted(missing: list[int]) -> None:
    decoder = _run([number for number in range(600) if number not in missing])
    assert decoder.statistics.lost == len([number for number in missing if number])
    assert decoder.statistics.frames == 600 - len(missing)


def test_duplicates_are_dropped() -> None:
    decoder = _run([0, 0, 1, 2, 2, 2, 3, 255, 255, 256, 256])
    assert decoder.statistics.duplicates == 5
    assert decoder.statistics.lost == 251


def _play(arrivals: dict[int, float], rate: float = 3175.0) -> tuple[StreamDecoder, int]:
    """Decode frames that arrive at these times; return how many had a wrong number too."""
    decoder = StreamDecoder(StreamFormat(X, 3), rate)
    wrong = 0
    for number, arrival in arrivals.items():
        assert decoder.decode_frame(arrival, _frame(number)) is not None
        wrong += decoder.number != number
    return decoder, wrong


@pytest.mark.parametrize("gap", [40, 128, 200, 255, 256, 257, 300, 512, 700, 1000, 3175, 31750])
def test_lost_turns_of_the_counter_are_noticed(gap: int) -> None:
    decoder, wrong = _play({number: number / 3175.0
                            for number in [*range(100), *range(100 + gap, 1500 + gap)]})
    assert decoder.statistics.lost == gap
    assert decoder.number == 1499 + gap
    assert wrong <= 257  # until it is clear that they were lost


@pytest.mark.parametrize("delay", [0.05, 0.1, 0.15, 0.2, 0.24])
@pytest.mark.parametrize("speed", [math.inf, 2.4])  # all at once, or as fast as CAN carries them
def test_late_frames_are_not_lost(delay: float, speed: float) -> None:
    arrivals = {}
    for number in range(6000):
        due = number / 3175.0
        behind = max(0.0, 1.0 + delay - due) if due >= 1.0 else 0.0
        caught_up = (1.0 + delay) + (number - 3175) / 3175.0 / speed if due >= 1.0 else 0.0
        arrivals[number] = max(due, due + behind if speed == math.inf else caught_up)
    decoder, wrong = _play(arrivals)
    assert decoder.statistics.lost == wrong == 0


def test_a_stream_that_arrives_in_bursts_has_lost_nothing() -> None:
    decoder, wrong = _play({number: math.ceil(number / 3175.0 / 0.2) * 0.2
                            for number in range(4000)})
    assert decoder.statistics.lost == wrong == 0


def test_losses_in_a_stream_that_arrives_in_bursts() -> None:
    decoder, _ = _play({number: math.ceil(number / 3175.0 / 0.05) * 0.05
                        for number in range(10000) if not 3000 <= number < 3300})
    assert decoder.statistics.lost == 300
    assert decoder.number == 9999


def test_slow_streams_are_not_silent() -> None:
    decoder = _run(list(range(0, 900, 3)), rate=2.0)
    assert decoder.statistics.lost == 2 * 299


def test_what_belongs_to_no_stream() -> None:
    decoder = StreamDecoder(StreamFormat(X, 3))
    for data in (b"\x80", b"\x21\x00\x34\x12", bytes.fromhex("39 00 01 80 02 80 03 80"), b"\x00"):
        assert decoder.decode_frame(0.0, data) is None
    assert decoder.statistics.others == 4
    for data in (b"", b"\xa2", _frame(0)[:7], _frame(0) + b"\0"):
        assert decoder.decode_frame(0.0, data) is None
    assert decoder.statistics.damaged == 4
    assert decoder.statistics.fault == (
        "data frame of 9 bytes instead of 8: A2 00 00 00 00 00 00 00 00")
    assert decoder.number == -1
    assert decoder.decode_frame(0.0, _frame(7)) == (7, 7, 7)
    assert decoder.number == 0
    assert decoder.statistics.lost == 0


@pytest.mark.parametrize("data", ["21 07 34 12", "21 07 34 12 00 00 00 00"])
def test_a_single_answer_may_be_padded(data: str) -> None:  # field note N9
    assert decode_single(StreamFormat(X, 1, stream=False), bytes.fromhex(data)) == (0x1234,)


def test_a_single_answer_of_another_format_is_refused() -> None:
    with pytest.raises(FrameError, match="single request of x"):
        decode_single(StreamFormat(X, 1, stream=False), b"\xa2\x00\x34\x12")


def test_batches_give_what_frames_give() -> None:
    """Any mixture, cut into any batches, gives the same as one frame after the other."""
    chance = random.Random(7)
    frames: list[tuple[float, bytes]] = []
    for number in range(5000):
        arrival = number / 3175.0 + 0.4 * (number > 3000)
        kind = chance.random() if 1000 < number < 4000 else 1.0
        if kind < 0.02:
            continue  # lost
        frames.append((arrival, _frame(number)))
        if kind < 0.03:
            frames.append(frames[-1])
        elif kind < 0.04:
            frames.append((arrival, chance.choice((b"\x80", b"", b"\xa2\x00", bytes(8)))))
    single, batched = (StreamDecoder(StreamFormat(X, 3), 3175.0) for _ in range(2))
    wanted = [(single.number, arrival, values) for arrival, data in frames
              if (values := single.decode_frame(arrival, data)) is not None]
    batches: list[StreamBatch] = []
    start = 0
    while start < len(frames):
        size = chance.choice((1, 2, 7, 50, 400))
        batches.append(batched.decode(frames[start:start + size]))
        start += size
    assert batched.statistics == single.statistics
    assert single.statistics.lost > 0 < single.statistics.duplicates
    assert np.concatenate([batch.numbers for batch in batches]).tolist() == [
        number for number, _, _ in wanted]
    assert np.concatenate([batch.arrivals for batch in batches]).tolist() == [
        arrival for _, arrival, _ in wanted]
    assert np.concatenate([batch.values for batch in batches]).reshape(-1, 3).tolist() == [
        list(values) for _, _, values in wanted]


def test_an_empty_batch() -> None:
    batch = StreamDecoder(StreamFormat(XYZ, 1)).decode([])
    assert len(batch) == 0
    assert batch.values.shape == (0, 1, 3)


def test_decoding_leaves_the_processor_alone() -> None:
    """Eight times the sensor's 3175 frames/s must need a small part of one core."""
    decoder = StreamDecoder(StreamFormat(X, 3), 8 * 3175.0)
    frames = [(number / 25400.0, _frame(number)) for number in range(25400)]

    def run() -> None:
        for arrival, data in frames:
            decoder.decode_frame(arrival, data)

    assert min(timeit.repeat(run, number=1, repeat=3)) < 0.25  # s for a second; 0.012 measured


# --- section 9.2.10 ---

def test_bus_load_of_the_manual() -> None:
    messages = [(1000.0, 64)]
    assert bus_load(messages, 1e6, 8e6) == pytest.approx(0.15575, abs=1e-9)
    assert bus_load(messages, 1e6, 8e6, stuffing=False) == pytest.approx(0.131, abs=1e-9)


def test_bus_load_of_can_2() -> None:
    # 79 + 64 + floor(12.8) = 155 bits a frame with stuffing, 67 + 64 without
    assert bus_load([(1000.0, 8)]) == pytest.approx(0.155)
    assert bus_load([(1000.0, 8)], stuffing=False) == pytest.approx(0.131)
    assert bus_load([(1000.0, 8)], 500e3) == pytest.approx(0.31)
    assert bus_load([(1000.0, 8), (100.0, 0)]) == pytest.approx(0.155 + 0.0079)
    assert bus_load([]) == 0
    rate = 38.4e6 / 3 / 21 / 64
    assert stream_format(X).bus_load(rate) == pytest.approx(0.492, abs=0.001)
    assert StreamFormat(X, 1).bus_load(rate) == pytest.approx(1.1143, abs=0.001)


# --- calibration ---

def test_supply_voltage() -> None:  # errata C8; figures of the vendor's client
    assert supply_voltage(11000, 3.3) == pytest.approx(3.157, abs=0.001)
    assert supply_voltage(1 << 15, 1.8) == pytest.approx(5.130, abs=0.001)


@pytest.mark.parametrize(("slope", "offset", "words"), [
    (math.nan, -100, "not numbers"), (0.003, math.inf, "not numbers"), (0.0, 0.0, "slope is zero"),
    (0.0, -100.0, "slope is zero"), (1e-9, -3e-5, "absurd"), (1.0, -32768.0, "absurd"),
    (0.003, 5.0, "not within"), (0.003, -500.0, "not within"), (1e-39, -1.0, "absurd")])
def test_calibration_that_is_not_plausible(slope: float, offset: float, words: str) -> None:
    assert words in Calibration(slope, offset).fault


@pytest.mark.parametrize(("slope", "offset"), [
    (200 / 65535, -100.0), (-0.003, 98.0), (4 / 65535, -2.0), (400 / 65536, -201.3)])
def test_calibration_that_is_plausible(slope: float, offset: float) -> None:
    assert Calibration(slope, offset).fault == ""
