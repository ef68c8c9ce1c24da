# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A target: something that takes what others say, and what must be true of each input."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from random import Random


@dataclass(frozen=True)
class Target:
    """Something that takes what others say.

    Attributes:
        name: What it is.
        check: Feeds it an input, and raises where a promise is broken. The project's own errors are
            answers, as the codecs promise them. What it chooses at random it takes from the second
            argument.
        seeds: Inputs to begin with; some of them are good, some nearly so.
        longest: Most bytes of an input.
    """

    name: str
    check: Callable[[bytes, Random], None]
    seeds: Sequence[bytes]
    longest: int = 400


def from_hex(texts: Iterable[str]) -> list[bytes]:
    """Return literals in hexadecimal as bytes, each once."""
    return [*dict.fromkeys(map(bytes.fromhex, texts))]


def pieces(data: bytes, random: Random, longest: int = 12) -> Iterator[bytes]:
    """Return data as it may arrive: in pieces."""
    start = 0
    while start < len(data):
        end = start + random.randint(1, longest)
        yield data[start:end]
        start = end


def check_text(value: object) -> None:
    """Refuse a text that could steer a terminal."""
    if isinstance(value, str):
        assert value.isprintable(), value
