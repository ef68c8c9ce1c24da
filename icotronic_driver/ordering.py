# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Data frames in the order of their counters: none twice, none where it cannot belong.

A frame whose counter does not follow the last one is held until the next ones tell what it is: one
behind a gap, one that overtook another, or one with a damaged counter.
"""

from __future__ import annotations

from typing import NamedTuple

from icotronic_driver.streaming import COUNTER_TURN, StreamDecoder

NONE = -1  # no counter
MOST_HELD = 5  # frames; more that do not follow each other are not worth to wait for


class Frame(NamedTuple):
    """A frame: payload, when it was on the bus in s, and when it came to us in monotonic ns."""

    data: bytes | bytearray
    bus_time: float
    seen: int


class FrameOrder:
    """Puts the frames of a stream in order.

    Bounds: less than `MOST_HELD` frames are held, and a frame is compared with those alone.

    Attributes:
        expected: Counter of a frame that needs no `sort`: who has such a one only counts on.
    """

    def __init__(self, decoder: StreamDecoder) -> None:
        """Begin a stream; the decoder's statistics say what was dropped."""
        self.expected = NONE
        self._decoder = decoder
        self._last = NONE
        self._held: list[Frame] = []

    def sort(self, frame: Frame) -> list[Frame]:
        """Take a frame; return those that come next, which are to be decoded before another."""
        data, held = frame.data, self._held
        if not self._decoder.fits(data):
            return [frame]  # it has no counter
        if not held:
            if self.expected == NONE:
                return self._go_on([frame])
            self._last = (self.expected - 1) % COUNTER_TURN
            if data[1] == self.expected or data == self._decoder.last:
                return self._go_on([frame])
            self.expected = NONE
        elif data == held[-1].data:
            self._decoder.statistics.duplicates += 1
            return []
        else:
            following = self._find_place(frame)
            if following:
                return self._go_on(following)
        held.append(frame)
        return self._give_up() if len(held) == MOST_HELD else []

    def rest(self) -> list[Frame]:
        """Return what is held, because nothing more may come."""
        return self._go_on(self._rising(self._held)) if self._held else []

    def _find_place(self, frame: Frame) -> list[Frame]:
        """Return what follows up to a frame that has its place, [] where it is not clear."""
        held, step = self._held, self._step(frame)
        steps = [self._step(one) for one in held]
        if steps[-2:] == [(step - back) % COUNTER_TURN for back in (2, 1)]:
            return [*self._rising(held[:-2], steps[-2]), *held[-2:], frame]  # all behind a gap
        if step == 1 and 2 in steps:  # it was overtaken
            following = [frame]
            while len(following) + 1 in steps:
                following.append(held[steps.index(len(following) + 1)]._replace(
                    bus_time=frame.bus_time, seen=frame.seen))
            return following
        if step == len(held) + 1:  # none is missing: what is not in its place is damaged
            return [*(one for place, one in enumerate(held, 1) if self._step(one) == place), frame]
        return []

    def _give_up(self) -> list[Frame]:
        """Return what rises, but for the last of it, which only the next ones can confirm."""
        rising = self._rising(self._held)
        last = rising[-1:]
        self._held = [one for one in self._held if one not in last]
        following = self._go_on(rising[:-1])
        if last:
            self._held, self.expected = last, NONE
        return following

    def _step(self, frame: Frame) -> int:
        return (frame.data[1] - self._last) % COUNTER_TURN

    def _rising(self, frames: list[Frame], end: int = COUNTER_TURN) -> list[Frame]:
        """Return the most of those frames whose counters rise and stay below `end`.

        Of as many, those with the least missing between them: a damaged counter claims more.
        """
        best: list[list[Frame]] = [[]]  # chains, each the longest that ends with its last frame
        for frame in frames:
            if 0 < self._step(frame) < end:
                best.append([*max((chain for chain in best if self._end(chain) < self._step(frame)),
                                  key=len), frame])
        return max(best, key=lambda chain: (len(chain), -self._end(chain)))

    def _end(self, chain: list[Frame]) -> int:
        return self._step(chain[-1]) if chain else 0

    def _go_on(self, frames: list[Frame]) -> list[Frame]:
        """Return frames, from the last of which it goes on, and drop what else is held."""
        statistics = self._decoder.statistics
        for frame in self._held:
            if not any(frame.data == one.data for one in frames):
                statistics.damaged += 1
                statistics.fault = f"data frame with counter {frame.data[1]} behind {self._last}"
        self._held = []
        if frames:
            self._last = frames[-1].data[1]
        self.expected = (self._last + 1) % COUNTER_TURN
        return frames
