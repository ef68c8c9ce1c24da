# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Invents inputs out of examples, always the same ones for the same seed, and makes them small."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from random import Random

_EDGES = (0x00, 0x01, 0x10, 0x16, 0x68, 0x7F, 0x80, 0xA2, 0xFE, 0xFF)


def _overwrite(random: Random, data: bytearray, _: bytes) -> None:
    data[random.randrange(len(data))] = random.randrange(256)


def _overwrite_with_edge(random: Random, data: bytearray, _: bytes) -> None:
    data[random.randrange(len(data))] = random.choice(_EDGES)


def _flip(random: Random, data: bytearray, _: bytes) -> None:
    data[random.randrange(len(data))] ^= 1 << random.randrange(8)


def _insert(random: Random, data: bytearray, _: bytes) -> None:
    data.insert(random.randrange(len(data) + 1), random.choice(_EDGES))


def _delete(random: Random, data: bytearray, _: bytes) -> None:
    start = random.randrange(len(data))
    del data[start:start + random.randint(1, 4)]


def _repeat(random: Random, data: bytearray, _: bytes) -> None:
    start = random.randrange(len(data))
    data[start:start] = data[start:start + random.randint(1, 16)] * random.randint(1, 4)


def _splice(random: Random, data: bytearray, other: bytes) -> None:
    data[random.randrange(len(data)):] = other[random.randrange(len(other) + 1):]


def _append(random: Random, data: bytearray, other: bytes) -> None:
    data += other


_CHANGES: tuple[Callable[[Random, bytearray, bytes], None], ...] = (
    _overwrite, _overwrite_with_edge, _flip, _insert, _delete, _repeat, _splice, _append)


def invent(random: Random, examples: Sequence[bytes], longest: int) -> bytes:
    """Return an example with up to six changes, or noise; of so many bytes at most."""
    if random.random() < 0.05:
        return random.randbytes(random.randrange(64))
    data = bytearray(random.choice(examples))
    for _ in range(random.randrange(7)):
        if data:
            random.choice(_CHANGES)(random, data, random.choice(examples))
    return bytes(data[:longest])


def minimise(data: bytes, fails: Callable[[bytes], bool]) -> bytes:
    """Return what is left of an input when all is taken away without which it still fails."""
    size = len(data)
    while size:
        for start in range(0, len(data), size):
            shorter = data[:start] + data[start + size:]
            if shorter != data and fails(shorter):
                data = shorter
                break
        else:
            size //= 2
    return data
