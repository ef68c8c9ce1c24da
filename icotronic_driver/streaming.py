# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Streams of measured values (section 10.3): formats, decoding with loss accounting, bus load.

Nothing here does I/O. Decoding is the hot path: a frame of the usual form costs well under a
microsecond, in batches less.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from driver_common.errors import FrameError
from icotronic_driver.identifier import MAX_PAYLOAD, MAX_PAYLOAD_FD, padded_length
from icotronic_driver.laws import ADC_MAX

DATA_SETS = (0, 1, 3, 6, 10, 15, 20, 30)  # by code; 0 stops the stream
AXES = "xyz"
SUPPLY_DIVIDER = 5.7  # 470 kΩ and 100 kΩ, section 10.3.3.1
COUNTER_TURN = 256
HALF_TURN = COUNTER_TURN // 2

LOAD_LIMIT, LOAD_MAXIMUM = 0.4, 0.6  # with stuff bits, without (section 9.2.10)

_HEAD = 2  # format and counter
_MAX_DELAY = 0.25  # s; nothing on the way holds frames back for longer
_MAX_BACKLOG = 10.0  # s; no more frames than that wait for a busy host
_SETTLED = 64  # frames by which a stream that catches up comes nearer within a turn, at least


@dataclass(frozen=True)
class StreamFormat:
    """The format byte of a request and of each of its data frames (section 10.3.1).

    Attributes:
        channels: Which of the three channels are measured.
        data_sets: Tuples of values in a frame; 0 stops the stream.
        value_size: Bytes of a value, 2 or 3.
        stream: Whether frames follow until the stop, else it is a single request.
    """

    channels: tuple[bool, bool, bool] = (True, False, False)
    data_sets: int = 1
    value_size: int = 2
    stream: bool = True

    def __str__(self) -> str:
        """Return for example "stream of x, z, 1 data set of 2-byte values"."""
        if self.data_sets == 0:
            return "stop"
        axes = ", ".join(axis for axis, active in zip(AXES, self.channels, strict=True) if active)
        return (f"{'stream' if self.stream else 'single request'} of {axes or 'no channel'}, "
                f"{self.data_sets} data set{'s' * (self.data_sets > 1)} of "
                f"{self.value_size}-byte values")

    @property
    def channel_count(self) -> int:
        """Number of measured channels."""
        return sum(self.channels)

    @property
    def values_per_frame(self) -> int:
        """Number of values in a data frame."""
        return self.data_sets * self.channel_count

    @property
    def frame_length(self) -> int:
        """Payload length of a data frame; above 8 bytes padded to what CAN-FD has."""
        return padded_length(_HEAD + self.values_per_frame * self.value_size)

    @property
    def full_scale(self) -> int:
        """Largest raw value."""
        return int((1 << 8 * self.value_size) - 1)

    def encode(self) -> int:
        """Return the format byte.

        Raises:
            ValueError: The protocol has no such format.
        """
        if self.data_sets not in DATA_SETS:
            raise ValueError(f"{self.data_sets} data sets are not possible, only "
                             f"{', '.join(map(str, DATA_SETS))} are")
        if self.value_size not in (2, 3):
            raise ValueError(f"values have 2 or 3 bytes, not {self.value_size}")
        x, y, z = self.channels
        return (self.stream << 7 | (self.value_size == 3) << 6 | x << 5 | y << 4 | z << 3
                | DATA_SETS.index(self.data_sets))

    @classmethod
    def decode(cls, code: int) -> StreamFormat:
        """Return what a format byte says."""
        return cls((bool(code & 0x20), bool(code & 0x10), bool(code & 0x08)),
                   DATA_SETS[code & 0x07], 3 if code & 0x40 else 2, bool(code & 0x80))

    def frame_rate(self, sample_rate: float) -> float:
        """Return the data frames per s at an ADC rate, which the channels share (errata C7)."""
        return sample_rate / self.values_per_frame

    def bus_load(self, sample_rate: float, bit_rate: float = 1e6,
                 data_bit_rate: float | None = None, *, stuffing: bool = True) -> float:
        """Return the share of the bus that the stream takes, 1.0 = all (see `bus_load`)."""
        return bus_load([(self.frame_rate(sample_rate), self.frame_length)], bit_rate,
                        data_bit_rate, stuffing=stuffing)


STOP = StreamFormat((False, False, False), 0)


def stream_format(channels: tuple[bool, bool, bool], *, can_fd: bool = False) -> StreamFormat:
    """Return the format that streams these channels in the fewest frames.

    On CAN 2.0 that is 3 values of one channel, or one tuple of several (errata C7).

    Raises:
        ValueError: No channel is active.
    """
    if not any(channels):
        raise ValueError("at least one channel must be active")
    limit = MAX_PAYLOAD_FD if can_fd else MAX_PAYLOAD
    fitting = [sets for sets in DATA_SETS[1:] if _HEAD + 2 * sets * sum(channels) <= limit]
    return StreamFormat(channels, fitting[-1])


def bus_load(messages: Iterable[tuple[float, int]], bit_rate: float = 1e6,
             data_bit_rate: float | None = None, *, stuffing: bool = True) -> float:
    """Return the share of the bus that messages take, 1.0 = all (section 9.2.10).

    Args:
        messages: Messages per s and payload length in bytes of each kind.
        bit_rate: Bit rate of the bus in bit/s.
        data_bit_rate: Bit rate of the payload in bit/s with CAN-FD; None = the same.
        stuffing: Whether the worst case of stuff bits is counted.
    """
    head, payload = 0.0, 0.0
    for rate, length in messages:
        head += rate * (79 if stuffing else 67)
        payload += rate * (8 * length + (8 * length // 5 if stuffing else 0))
    return head / bit_rate + payload / (data_bit_rate or bit_rate)


def supply_voltage(raw: int, reference_voltage: float) -> float:
    """Return the battery's voltage in V from the raw value of voltage 1 (errata C8)."""
    return raw * SUPPLY_DIVIDER * reference_voltage / ADC_MAX


@dataclass
class StreamStatistics:
    """What was counted of a stream.

    Attributes:
        frames: Data frames that were decoded.
        lost: Data frames that are missing, by the counter.
        duplicates: Data frames that came again and were dropped.
        damaged: Frames whose length does not fit their format.
        others: Frames of another format: acknowledgements of a stop, answers to single requests.
        fault: What was wrong with the last damaged frame.
    """

    frames: int = 0
    lost: int = 0
    duplicates: int = 0
    damaged: int = 0
    others: int = 0
    fault: str = ""


@dataclass(frozen=True)
class StreamBatch:
    """Decoded data frames, oldest first.

    Attributes:
        numbers: Number of each frame in the stream; a step of more than one is a loss.
        arrivals: Arrival time of each frame as it was given, in s.
        values: Raw values, shape (frames, data sets, channels).
    """

    numbers: npt.NDArray[np.int64]
    arrivals: npt.NDArray[np.float64]
    values: npt.NDArray[Any]

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.numbers)


@dataclass
class _Doubt:
    """A gap in which frames were late, or lost by whole turns of the counter.

    Attributes:
        number: Number of the last frame in front of the gap.
        before: When it arrived, in s.
        since: From when on the frames behind the gap are watched, in s.
        late: How late they were before that, in frames.
        least: How late the least late one has been since then.
    """

    number: int
    before: float
    since: float
    late: float
    least: float = math.inf


class StreamDecoder:
    """Decodes the data frames of one stream, and counts what is missing.

    A frame is identified by its number: 0 for the first that arrived, from there by the 8-bit
    counter (errata C7). So value `i` of data set `j` in frame `n` was measured
    `n * data_sets + j` sample intervals after the first one, whatever was lost in between. The
    counter hides whole turns (80 ms at the sensor's usual pace); the time tells of those.

    Bounds: one payload is held, and a frame costs the same however much is missing before it.

    Attributes:
        format: Format of the stream.
        statistics: What was counted.
        number: Number of the frame that was decoded last, -1 before the first.
        last: Its payload.
    """

    def __init__(self, format: StreamFormat, frame_rate: float = 0.0) -> None:
        """Begin a stream.

        Args:
            format: Format of the stream.
            frame_rate: Frames per s; where it is 0, whole turns of the counter go unnoticed.
        """
        self.format = format
        self.statistics = StreamStatistics()
        self.number = -1
        self._frame_rate = frame_rate
        self._code = format.encode()
        self._length = format.frame_length
        self._counter = 0
        self._arrival = 0.0
        self._seen: int | None = None
        self.last: bytes | bytearray = b""
        self._doubt: _Doubt | None = None
        self._usual_gap = min(_MAX_DELAY, HALF_TURN / frame_rate) if frame_rate else math.inf
        padding = self._length - _HEAD - format.values_per_frame * format.value_size
        wide = format.value_size == 3
        self._unpack = struct.Struct(
            f"<{_HEAD}x{('HB' if wide else 'H') * format.values_per_frame}{padding}x").unpack
        self._wide = wide

    def fits(self, data: bytes | bytearray) -> bool:
        """Whether a payload is one of this stream, by format and length."""
        return len(data) == self._length and data[0] == self._code

    def decode_frame(self, arrival: float, data: bytes | bytearray,
                     seen: int | None = None) -> tuple[int, ...] | None:
        """Return the raw values of a data frame, oldest first; afterwards `number` is its number.

        Returns None for what is to be skipped: a duplicate, a damaged frame, one of another format;
        `statistics` tells which.

        Args:
            arrival: When it was on the bus, in s of a clock that may be set.
            data: Its payload.
            seen: When it came to us, in monotonic ns, where that is known.
        """
        if len(data) != self._length:
            self._count_unfit(data)
            return None
        if data[0] != self._code:
            self.statistics.others += 1
            return None
        counter = data[1]
        step = (counter - self._counter) & 0xFF
        if step != 1 or self._doubt or arrival - self._arrival > self._usual_gap:
            step = self._unusual_step(step, arrival, data, seen)
            if step == 0:
                return None
        self._counter = counter
        self._arrival = arrival
        self._seen = seen
        self.last = data
        self.number += step
        self.statistics.frames += 1
        values = self._unpack(data)
        if self._wide:
            return tuple(low | high << 16 for low, high in zip(values[::2], values[1::2],
                                                               strict=True))
        return values

    def decode(self, frames: Sequence[tuple[float, bytes | bytearray]]) -> StreamBatch:
        """Return the data frames among `frames`, each given with its arrival time in s."""
        return self._decode_regular(frames) or self._decode_one_by_one(frames)

    def _decode_regular(self, frames: Sequence[tuple[float, bytes | bytearray]],
                        ) -> StreamBatch | None:
        """Return all frames at once where they follow each other without fault, else None."""
        count, length = len(frames), self._length
        if self.number < 0 or self._doubt or {len(data) for _, data in frames} != {length}:
            return None
        joined = b"".join([data for _, data in frames])
        table = np.frombuffer(joined, np.uint8).reshape(count, length)
        counters = np.arange(self._counter + 1, self._counter + 1 + count).astype(np.uint8)
        arrivals = np.array([arrival for arrival, _ in frames])
        if ((table[:, 0] != self._code).any() or (table[:, 1] != counters).any()
                or np.diff(arrivals, prepend=self._arrival).max() > self._usual_gap):
            return None
        numbers = np.arange(self.number + 1, self.number + 1 + count)
        self._counter = int(counters[-1])
        self._arrival, self.last = frames[-1]
        self.number += count
        self.statistics.frames += count
        return StreamBatch(numbers, arrivals, self._values(table))

    def _values(self, table: npt.NDArray[np.uint8]) -> npt.NDArray[Any]:
        size = self.format.value_size
        raw = np.ascontiguousarray(table[:, _HEAD:_HEAD + self.format.values_per_frame * size])
        if self._wide:
            parts = raw.reshape(len(table), -1, 3).astype(np.uint32)
            values: npt.NDArray[Any] = parts[..., 0] | parts[..., 1] << 8 | parts[..., 2] << 16
        else:
            values = raw.view("<u2")
        return values.reshape(len(table), self.format.data_sets, self.format.channel_count)

    def _decode_one_by_one(self, frames: Sequence[tuple[float, bytes | bytearray]]) -> StreamBatch:
        numbers, arrivals, rows = [], [], []
        for arrival, data in frames:
            values = self.decode_frame(arrival, data)
            if values is not None:
                numbers.append(self.number)
                arrivals.append(arrival)
                rows.append(values)
        shape = (len(rows), self.format.data_sets, self.format.channel_count)
        kind = np.uint32 if self._wide else np.uint16
        return StreamBatch(np.array(numbers, np.int64), np.array(arrivals, np.float64),
                           np.array(rows, kind).reshape(shape))

    def _unusual_step(self, step: int, arrival: float, data: bytes | bytearray,
                      seen: int | None) -> int:
        """Return the frames from the last to this one, 0 for a duplicate; count what is missing."""
        if self.number < 0:
            return 1
        silence = arrival - self._arrival
        if seen is not None and self._seen is not None:
            waited = (seen - self._seen) * 1e-9
            if silence > waited + _MAX_BACKLOG:  # the clock was set
                silence = waited
        if step == 0 and data != self.last and self._frame_rate:
            step = COUNTER_TURN  # it is none that came again
        turns = max(0, round((silence * self._frame_rate - step) / COUNTER_TURN))
        if silence > _MAX_DELAY:
            step += COUNTER_TURN * turns
        elif turns and self._doubt is None:
            self._doubt = _Doubt(self.number, self._arrival, arrival,
                                 silence * self._frame_rate - step)
        if step == 0:
            self.statistics.duplicates += 1
            return 0
        if self._doubt is not None:
            step += self._missed_turns(self._doubt, self.number + step, arrival)
        self.statistics.lost += step - 1
        return step

    def _missed_turns(self, doubt: _Doubt, number: int, arrival: float) -> int:
        """Return the frames that were lost unseen in a gap, once it is clear, until then 0.

        Frames that were only late come faster than usual afterwards, until they have caught up;
        where some were lost, the rest stays late.
        """
        late = (arrival - doubt.before) * self._frame_rate - (number - doubt.number)
        doubt.least = min(doubt.least, late)
        if late < HALF_TURN:
            self._doubt = None
        elif (arrival - doubt.since) * self._frame_rate > COUNTER_TURN:
            if doubt.least > doubt.late - _SETTLED:
                self._doubt = None
                return COUNTER_TURN * round(doubt.least / COUNTER_TURN)
            doubt.since, doubt.late, doubt.least = arrival, doubt.least, math.inf
        return 0

    def _count_unfit(self, data: bytes | bytearray) -> None:
        if data and data[0] != self._code:
            self.statistics.others += 1
            return
        self.statistics.damaged += 1
        self.statistics.fault = (f"data frame of {len(data)} bytes instead of {self._length}: "
                                 f"{data.hex(' ').upper() or 'empty'}")


def decode_single(format: StreamFormat, data: bytes | bytearray) -> tuple[int, ...]:
    """Return the raw values of the answer to a single request, oldest first.

    Raises:
        FrameError: Format or length is not the one that was asked for.
    """
    padded = len(data) == MAX_PAYLOAD > format.frame_length  # field note N9
    values = StreamDecoder(format).decode_frame(
        0.0, data[:format.frame_length] if padded else data)
    if values is None:
        raise FrameError(f"answer to a {format} does not fit: {data.hex(' ').upper() or 'empty'}")
    return values
