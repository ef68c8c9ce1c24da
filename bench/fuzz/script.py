# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A script of what becomes of a device's answers: an input, two bytes for each step."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from enum import Enum
from random import Random
from typing import Generic, NamedTuple, TypeVar

T = TypeVar("T")

LATEST = 3.0  # s


class Kind(Enum):
    """What becomes of an answer."""

    RIGHT = "right"  # and as many more as the argument says
    DAMAGED = "damaged"
    LATE = "late"
    TWICE = "twice"
    FOREIGN = "foreign"  # another device's in its place
    REFUSED = "refused"
    SILENT = "silent"
    GARBAGE = "garbage"
    NOISE = "noise"  # in front of it
    CUT = "cut"
    SPLIT = "split"
    RESET = "reset"  # and the device loses what it has not stored


KINDS = tuple(Kind)


class Arrival(NamedTuple, Generic[T]):
    """What arrives in the place of an answer, and how much later in s."""

    later: float
    what: T


class Script:
    """Decides what becomes of each answer.

    Attributes:
        done: How often each kind came.
        waits: Whether it has not begun.
    """

    def __init__(self, data: bytes, random: Random) -> None:
        """Read a script; what is left open is random."""
        self.done: Counter[Kind] = Counter()
        self.waits = False
        self._steps = list(zip(data[::2], data[1::2], strict=False))
        self._random = random
        self._right = 0

    @property
    def is_over(self) -> bool:
        """Whether all answers are right from now on."""
        return not self._steps and not self._right

    def end(self) -> None:
        """Have all answers be right from now on."""
        self._steps.clear()
        self._right = 0

    def step(self) -> tuple[Kind, int]:
        """Return what becomes of the next answer, and how much of it, 0 … 255."""
        if self.waits:
            return Kind.RIGHT, 0
        if self._right or not self._steps:
            self._right = max(0, self._right - 1)
            return Kind.RIGHT, 0
        kind, argument = self._steps.pop(0)
        chosen = KINDS[kind % len(KINDS)]
        if chosen is Kind.RIGHT:
            self._right = argument
        self.done[chosen] += 1
        return chosen, argument

    def answer(self, right: bytes, foreign: Callable[[bytes], bytes],
               refusal: Callable[[bytes], bytes], reset: Callable[[], None],
               ) -> list[Arrival[bytes]]:
        """Return what arrives in the place of an answer on a serial line.

        Args:
            right: The answer.
            foreign: Makes another device's of it.
            refusal: Makes a refusal of it.
            reset: Has the device begin anew.
        """
        kind, argument = self.step()
        if kind is Kind.SILENT:
            return []
        if kind is Kind.RESET:
            reset()
            return []
        if kind is Kind.LATE:
            return [Arrival(LATEST * argument / 255, right)]
        if kind is Kind.TWICE:
            return [Arrival(0.0, right), Arrival(0.001 * argument, right)]
        if kind is Kind.SPLIT:
            half = len(right) // 2
            return [Arrival(0.0, right[:half]), Arrival(0.001 * argument, right[half:])]
        noise = self._random.randbytes(1 + argument % 40)
        return [Arrival(0.0, {
            Kind.RIGHT: lambda: right,
            Kind.DAMAGED: lambda: _with_a_bit_flipped(right, argument),
            Kind.FOREIGN: lambda: foreign(right),
            Kind.REFUSED: lambda: refusal(right),
            Kind.GARBAGE: lambda: noise,
            Kind.NOISE: lambda: noise + right,
            Kind.CUT: lambda: right[:1 + argument % len(right)],
        }[kind]())]


def _with_a_bit_flipped(data: bytes, place: int) -> bytes:
    damaged = bytearray(data)
    damaged[place % len(data)] ^= 1 << place % 8
    return bytes(damaged)
