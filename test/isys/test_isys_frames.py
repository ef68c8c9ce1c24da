# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The iSYS frame parser: any bytes, split anywhere, and no good frame is lost."""

from __future__ import annotations

import random
from collections.abc import Iterable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from operations import Counting

from bench.examples.isys import EXAMPLES, HAND_TYPED, Example, Targets
from isys_radar_driver.frames import Delimiter, Frame, FrameParser

REPLY = bytes.fromhex("68 05 05 68 01 80 D2 00 80 D3 16")  # table 7 of the manual
ONE_TARGET = bytes.fromhex(  # figure 188
    "A2 01 80 DA 01 01 0E D3 00 00 00 00 00 2B CB 75 00 00 03 E8 94 16")
NO_DATA = bytes.fromhex("10 01 80 D1 52 16")

# Bytes of the largest frame: raw signals, 8 signals of 255 blocks of 16 samples of 4 bytes.
LARGEST = 4 + 7 + 8 * 255 * 16 * 4 + 2


def _has_fixed_length(example: Example) -> bool:
    return isinstance(example.meaning, Targets) and bool(example.meaning.resolution & 0x80)


ALL = tuple(bytes.fromhex(example.frame) for example in EXAMPLES + HAND_TYPED
            if not _has_fixed_length(example))
FIXED = tuple(bytes.fromhex(example.frame) for example in HAND_TYPED
              if _has_fixed_length(example))


def _sum(body: bytes) -> bytes:
    return bytes((sum(body) % 256, 0x16))


def _sd2(body: bytes) -> bytes:
    return bytes((0x68, len(body), len(body), 0x68)) + body + _sum(body)


def _sd3(body: bytes) -> bytes:
    return b"\xa2" + body + _sum(body)


def _list_32(count: int, targets: int | None = None) -> bytes:
    """Return a 32-bit list of `count` targets in a frame of `targets`, no byte of them zero."""
    filled = b"".join(bytes(range(n + 1, n + 15)) for n in range(count))
    return _sd3(b"\x01\x80\xda\x01" + bytes((count,))
                + filled.ljust(14 * (count if targets is None else targets), b"\0"))


def _bytes(frames: Iterable[Frame]) -> list[bytes]:
    return [frame.encode() for frame in frames]


def _parse(*pieces: bytes, parser: FrameParser | None = None) -> list[bytes]:
    parser = parser or FrameParser()
    return [frame.encode() for piece in pieces for frame in parser.feed(piece)]


def _chunks(data: bytes, random_: random.Random, longest: int) -> list[bytes]:
    chunks = []
    while data:
        size = random_.randint(1, longest)
        chunks.append(data[:size])
        data = data[size:]
    return chunks


# --- good frames -------------------------------------------------------------------------------


def test_a_frame_is_taken_apart() -> None:
    assert list(FrameParser().feed(REPLY)) == [Frame(1, 128, 0xD2, b"\x00\x80", Delimiter.SD2)]
    assert list(FrameParser().feed(NO_DATA)) == [Frame(1, 128, 0xD1, b"", Delimiter.SD1)]
    assert list(FrameParser().feed(ONE_TARGET)) == [
        Frame(1, 128, 0xDA, ONE_TARGET[4:-2], Delimiter.SD3)]


def test_every_example_split_at_every_byte() -> None:
    for data in ALL:
        for cut in range(1, len(data)):
            parser = FrameParser()
            assert list(parser.feed(data[:cut])) == []
            assert parser.pending == cut
            assert _bytes(parser.feed(data[cut:])) == [data]
            assert parser.pending == parser.dropped_bytes == parser.damaged_frames == 0


@pytest.mark.parametrize("fixed_targets", [0, 5])
def test_a_fixed_length_list_split_at_every_byte(fixed_targets: int) -> None:
    assert len(FIXED) == 1
    for cut in range(1, len(FIXED[0])):
        parser = FrameParser(fixed_targets)
        assert list(parser.feed(FIXED[0][:cut])) == []
        assert _bytes(parser.feed(FIXED[0][cut:])) == [FIXED[0]]


def test_all_examples_in_one_piece() -> None:
    assert _parse(b"".join(ALL)) == list(ALL)


def test_all_examples_byte_by_byte() -> None:
    assert _parse(*(bytes((byte,)) for byte in b"".join(ALL))) == list(ALL)


@pytest.mark.parametrize("longest", [2, 7, 40, 1000])
def test_all_examples_in_pieces_of_random_length(longest: int) -> None:
    pieces = _chunks(b"".join(ALL), random.Random(longest), longest)
    parser = FrameParser()
    assert _parse(*pieces, parser=parser) == list(ALL)
    assert parser.pending == parser.dropped_bytes == parser.damaged_frames == 0


def test_frames_that_a_caller_leaves_are_given_next_time() -> None:
    parser = FrameParser()
    assert next(parser.feed(REPLY + ONE_TARGET)).encode() == REPLY
    assert _bytes(parser.feed(b"")) == [ONE_TARGET]


def test_shortest_and_longest_frame_with_a_length() -> None:
    shortest, longest = _sd2(b"\x01\x80\xd1"), _sd2(b"\x01\x80\xd0" + bytes(range(252)))
    assert (len(shortest), len(longest)) == (9, 261)
    assert _parse(shortest + longest + shortest) == [shortest, longest, shortest]


def test_35_targets_in_16_bit() -> None:
    data = _sd2(b"\x01\x80\xda\x01\x23" + bytes(range(245)))
    assert _parse(*_chunks(data + REPLY, random.Random(0), 60)) == [data, REPLY]


def test_35_targets_in_32_bit() -> None:
    data = _list_32(35)
    assert len(data) == 498
    assert _parse(*_chunks(data + REPLY, random.Random(0), 60)) == [data, REPLY]


def test_every_number_of_targets() -> None:
    lists = [_list_32(count) for count in range(36)]
    assert [len(data) for data in lists[:3]] == [8, 22, 36]
    assert _parse(b"".join(lists)) == lists


def test_a_clipping_list_has_no_targets() -> None:
    clipping = _sd3(b"\x01\x80\xda\x01\xff")
    assert clipping == bytes.fromhex("A2 01 80 DA 01 FF 5B 16")
    assert _parse(clipping + ONE_TARGET) == [clipping, ONE_TARGET]


@pytest.mark.parametrize(("signals", "blocks", "size"), [(1, 1, 2), (2, 1, 4), (4, 128, 2)])
def test_raw_signals(signals: int, blocks: int, size: int) -> None:
    header = b"\x01\x80\xe0" + bytes((signals, blocks, size)) + b"\x00\x00\x00\x0a"
    samples = random.Random(1).randbytes(signals * blocks * 16 * size)
    data = _sd3(header + samples)
    assert _parse(*_chunks(data + REPLY, random.Random(2), 700)) == [data, REPLY]


def test_the_largest_frame() -> None:
    data = _sd3(b"\x01\x80\xe0\x08\xff\x04\x00\x00\x00\x01" + bytes(8 * 255 * 16 * 4))
    assert len(data) == LARGEST
    assert _parse(data[:-1], data[-1:] + REPLY) == [data, REPLY]


# --- lists of a fixed length -------------------------------------------------------------------


@pytest.mark.parametrize("count", [0, 1, 3, 5])
def test_the_fixed_length_is_learned_from_the_first_list(count: int) -> None:
    parser = FrameParser(fixed_targets=0)
    first = _list_32(count, targets=5)
    assert _parse(first, parser=parser) == [first]
    assert parser.fixed_targets == 5


def test_a_learned_length_stays() -> None:
    parser = FrameParser(fixed_targets=0)
    lists = [_list_32(count, targets=5) for count in (2, 0, 5, 1)]
    stream = b"".join(lists)
    assert _parse(*(stream[at:at + 9] for at in range(0, len(stream), 9)), parser=parser) == lists
    assert parser.fixed_targets == 5
    # A list of another length is none, and changes nothing.
    assert _parse(_list_32(1, targets=6), parser=parser) == []
    assert _bytes(parser.flush()) == []
    assert parser.fixed_targets == 5
    assert _parse(lists[0], parser=parser) == [lists[0]]


def test_the_longest_fixed_length_is_learned() -> None:
    parser = FrameParser(fixed_targets=0)
    data = _list_32(7, targets=35)
    assert _parse(data[:400], data[400:], parser=parser) == [data]
    assert parser.fixed_targets == 35


def test_a_damaged_list_teaches_nothing() -> None:
    parser = FrameParser(fixed_targets=0)
    damaged = bytearray(_list_32(1, targets=5))
    damaged[9] ^= 1
    good = _list_32(1, targets=5)
    assert _parse(bytes(damaged), good, parser=parser) == []
    assert _bytes(parser.flush()) == [good]
    assert parser.fixed_targets == 5


@pytest.mark.parametrize("fixed_targets", [0, 5])
def test_a_clipping_list_among_those_of_a_fixed_length(fixed_targets: int) -> None:
    # The manual: a list with clipping has no targets; and: a fixed number is always sent.
    short, padded = _sd3(b"\x01\x80\xda\x01\xff"), _sd3(b"\x01\x80\xda\x01\xff" + bytes(70))
    good = _list_32(2, targets=5)
    parser = FrameParser(fixed_targets)
    assert _parse(short, parser=parser) == [short]
    assert parser.fixed_targets == fixed_targets
    assert _parse(padded + good + short + good, parser=parser) == [padded, good, short, good]
    assert parser.fixed_targets == 5


# --- noise and damage --------------------------------------------------------------------------


def test_noise_that_cannot_begin_a_frame_is_dropped_at_once() -> None:
    parser = FrameParser()
    noise = bytes(byte for byte in range(256) if byte not in (0x10, 0x68, 0xA2))
    assert _parse(noise, REPLY, noise, ONE_TARGET, noise, parser=parser) == [REPLY, ONE_TARGET]
    assert parser.dropped_bytes == 3 * 253
    assert parser.pending == parser.damaged_frames == 0


@pytest.mark.parametrize("noise", [
    "68", "A2", "10", "16", "68 68", "68 03", "68 03 03", "68 05 05", "68 68 68", "68 68 68 68",
    "68 FF FF 68", "68 02 02 68", "68 00 00 68", "10 10 10 10 10", "10 68", "A2 A2 A2 A2",
    "A2 01 80 DA", "A2 01 80 DA 01", "A2 01 80 DA 01 24", "A2 01 80 DA 01 23", "A2 01 80 DA 01 FF",
    "A2 01 80 E0", "A2 01 80 E0 00", "A2 01 80 E0 01 00", "A2 01 80 E0 01 01 03",
    "A2 01 80 E0 08 FF 04", "A2 01 80 E0 09 01 02", "A2 01 80 D2", "A2 10 68 A2 10 68",
])
@pytest.mark.parametrize("good", [REPLY, ONE_TARGET, NO_DATA], ids=["SD2", "SD3", "SD1"])
def test_what_looks_like_a_beginning_costs_no_frame(noise: str, good: bytes) -> None:
    data = bytes.fromhex(noise)
    parser = FrameParser()
    found = _parse(data, good, data, good, data, parser=parser) + _bytes(parser.flush())
    assert found == [good, good]
    assert parser.dropped_bytes == 3 * len(data)
    assert parser.pending == 0


def test_what_cannot_be_a_header_is_not_waited_for() -> None:
    for noise in ("68 02", "68 05 04", "68 05 05 67", "A2 01 80 D2", "A2 01 80 DA 01 24",
                  "A2 01 80 E0 00 01 02", "A2 01 80 E0 09 01 02", "A2 01 80 E0 01 00 02",
                  "A2 01 80 E0 01 01 03"):
        parser = FrameParser()
        assert _parse(bytes.fromhex(noise), parser=parser) == []
        assert parser.pending == 0, noise


@pytest.mark.parametrize("good", [REPLY, ONE_TARGET, NO_DATA], ids=["SD2", "SD3", "SD1"])
def test_a_good_frame_behind_a_truncated_one(good: bytes) -> None:
    for broken in (REPLY, ONE_TARGET, NO_DATA, _list_32(35), _sd2(bytes(range(255)))):
        for cut in range(1, len(broken)):
            parser = FrameParser()
            found = _parse(broken[:cut] + good, parser=parser)
            assert found + _bytes(parser.flush()) == [good]
            assert parser.pending == 0
            assert parser.dropped_bytes == cut


@pytest.mark.parametrize("good", [REPLY, ONE_TARGET, NO_DATA], ids=["SD2", "SD3", "SD1"])
def test_no_damaged_byte_goes_unnoticed(good: bytes) -> None:
    for index in range(len(good)):
        for bit in range(8):
            damaged = bytearray(good)
            damaged[index] ^= 1 << bit
            parser = FrameParser()
            found = _parse(bytes(damaged), REPLY, parser=parser) + _bytes(parser.flush())
            assert found == [REPLY]
            assert parser.dropped_bytes == len(good)


@pytest.mark.parametrize(("data", "damaged"), [
    ("68 05 05 68 01 80 D2 00 80 D4 16", 1),  # checksum
    ("68 05 05 68 01 80 D2 00 80 D3 17", 1),  # end
    ("68 05 04 68 01 80 D2 00 80 D3 16", 0),  # the two lengths differ: no header
    ("10 01 80 D1 53 16", 1),
    ("10 01 80 D1 52 61", 1),
    ("A2 01 80 DA 01 00 5D 16", 1),
    ("A2 01 80 DA 01 00 5C 00", 1),
])
def test_damaged_frames_are_counted(data: str, damaged: int) -> None:
    parser = FrameParser()
    assert _parse(bytes.fromhex(data), parser=parser) == []
    assert _bytes(parser.flush()) == []
    assert parser.damaged_frames == damaged
    assert parser.dropped_bytes == len(bytes.fromhex(data))
    assert _parse(REPLY, parser=parser) == [REPLY]
    assert parser.damaged_frames == damaged


def test_flush_recovers_the_frames_behind_a_truncated_one() -> None:
    parser = FrameParser()
    assert _parse(_list_32(35)[:100] + REPLY + ONE_TARGET + REPLY[:5], parser=parser) == []
    assert parser.pending == 100 + len(REPLY) + len(ONE_TARGET) + 5
    assert _bytes(parser.flush()) == [REPLY, ONE_TARGET]
    assert parser.pending == 0
    assert parser.dropped_bytes == 105
    assert _bytes(parser.flush()) == []


def test_a_truncated_frame_is_given_up_when_enough_follows() -> None:
    parser = FrameParser()
    assert _parse(ONE_TARGET[:12], *[REPLY] * 3, parser=parser) == [REPLY] * 3
    assert parser.damaged_frames == 1


@pytest.mark.parametrize("header", [
    "68 FF FF 68", "A2 01 80 DA 01 23", "A2 01 80 E0 08 FF 04", "A2 01 80 E0 04 80 02", "10"])
@pytest.mark.parametrize("fixed_targets", [None, 0, 35])
def test_the_buffer_is_bounded(header: str, fixed_targets: int | None) -> None:
    parser = FrameParser(fixed_targets)
    most = 0
    for _ in range(2 * LARGEST // 4096 + 2):
        assert _parse(bytes.fromhex(header).ljust(4096, b"\0"), parser=parser) == []
        most = max(most, parser.pending)
    assert most < LARGEST


def test_the_buffer_of_target_lists_is_bounded_by_35_targets() -> None:
    parser = FrameParser(fixed_targets=0)
    for _ in range(2000):
        assert _parse(b"\xa2\x01\x80\xda\x01\x02", parser=parser) == []
        assert parser.pending < 498


# Bytes that begin frames and headers, but never 0x16: no frame can end within the noise.
NOISE = st.binary(max_size=30).map(lambda data: data.replace(b"\x16", b"")) | st.lists(
    st.sampled_from([0x10, 0x68, 0xA2, 0xDA, 0xE0, 0x00, 0x01, 0x02, 0x03, 0x05, 0x80, 0xFF]),
    max_size=30).map(bytes)


def _is_within(frames: list[bytes], found: list[bytes]) -> bool:
    """Return whether all frames were found, in their order, among others perhaps."""
    rest = iter(found)
    return all(frame in rest for frame in frames)


@settings(max_examples=150, derandomize=True, deadline=None, database=None)
@given(st.lists(st.tuples(NOISE, st.sampled_from(ALL)), max_size=8), NOISE, st.randoms())
def test_no_frame_between_noise_is_lost(parts: list[tuple[bytes, bytes]], end: bytes,
                                        random_: random.Random) -> None:
    stream = b"".join(noise + frame for noise, frame in parts) + end
    frames = [frame for _, frame in parts]
    parser = FrameParser()
    found = _parse(*_chunks(stream, random_, 20), parser=parser) + _bytes(parser.flush())
    assert _is_within(frames, found)
    assert all(frame in stream for frame in found)
    assert parser.pending == 0
    assert parser.dropped_bytes == len(stream) - sum(len(frame) for frame in found)


@settings(max_examples=100, derandomize=True, deadline=None, database=None)
@given(st.binary(max_size=400), st.sampled_from([None, 0, 3]), st.randoms())
def test_what_is_found_does_not_depend_on_the_pieces(
        stream: bytes, fixed_targets: int | None, random_: random.Random) -> None:
    whole, pieces = FrameParser(fixed_targets), FrameParser(fixed_targets)
    found = _parse(stream, parser=whole) + _bytes(whole.flush())
    split = _parse(*_chunks(stream, random_, 9), parser=pieces) + _bytes(pieces.flush())
    assert found == split
    assert whole.dropped_bytes == pieces.dropped_bytes
    assert whole.dropped_bytes + sum(map(len, found)) == len(stream)


@settings(max_examples=60, derandomize=True, deadline=None, database=None)
@given(st.sampled_from(ALL), st.integers(0, 10_000), NOISE)
def test_flush_finds_a_frame_behind_a_truncated_one_and_noise(
        broken: bytes, cut: int, noise: bytes) -> None:
    parser = FrameParser()
    found = _parse(broken[:cut % len(broken)] + noise + REPLY, parser=parser)
    assert REPLY in found + _bytes(parser.flush())
    assert parser.pending == 0


@pytest.mark.parametrize("noise", [
    "A2 01 80 E0 04 FF 04", "A2 01 80 DA 01 23", "68 FF FF 68", "10"])
def test_noise_without_an_end_fills_no_memory_where_no_raw_signals_may_come(noise: str) -> None:
    parser = FrameParser()
    parser.raw_signals = False
    for _ in range(2000):
        assert not list(parser.feed(bytes.fromhex(noise)))
        assert parser.pending <= 500


@pytest.mark.parametrize("noise", [
    "A2 01 80 E0 08 FF 04", "A2 01 80 E0 01 01 02", "A2 01 80 DA 01 23", "A2 01 80 DA 01 01",
    "A2 01 80 DA 01 FF", "68 FF FF 68", "68 03 03 68", "10", "16"])
@pytest.mark.parametrize("piece", [1, 4096])
@pytest.mark.parametrize("fixed_targets", [None, 0, 35])
def test_no_byte_costs_more_than_a_look_at_every_length(
        noise: str, piece: int, fixed_targets: int | None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Counting, "looks", 0)
    parser = FrameParser(fixed_targets)
    parser._buffer, parser._sums = Counting(), Counting(1)
    stream = bytes.fromhex(noise) * (1500 // len(bytes.fromhex(noise)))
    if piece > 1:
        stream = bytes.fromhex(noise).ljust(7, b"\0") * (LARGEST // 7 + 600)
    for start in range(0, len(stream), piece):
        assert not list(parser.feed(stream[start:start + piece]))
        assert parser.pending < LARGEST
    assert not list(parser.flush())
    assert Counting.looks <= 4 * 35 * len(stream) + LARGEST
