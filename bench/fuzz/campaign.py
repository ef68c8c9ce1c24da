# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Feeds a target with inputs, and keeps what fails, once for each way to fail."""

from __future__ import annotations

import time
import traceback
from dataclasses import dataclass, field
from pathlib import Path
from random import Random

from bench.fuzz.inputs import invent, minimise
from bench.fuzz.targets import TARGETS, Target

_LOOK = 256  # inputs between two looks at the clock


@dataclass
class Result:
    """What became of a target; the failures by what was raised where, each with its input."""

    name: str
    inputs: int = 0
    seconds: float = 0.0
    failures: dict[str, bytes] = field(default_factory=dict)


def failure(target: Target, data: bytes, seed: str) -> str:
    """Return what a target raises and where, "" if it keeps its promises."""
    try:
        target.check(data, Random(seed))
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__} in {Path(place.filename).name}, {place.name}: {place.line}"
    return ""


def fuzz(target: Target, inputs: int, seconds: float, seed: int) -> Result:
    """Feed a target until it had all inputs or the time is over."""
    result = Result(target.name)
    examples, random = target.seeds, Random(f"{seed} {target.name}")
    begin = time.monotonic()
    while result.inputs < inputs:
        if result.inputs % _LOOK == 0 and time.monotonic() - begin > seconds:
            break
        data, choices = invent(random, examples), f"{seed} {result.inputs}"
        result.inputs += 1
        fault = failure(target, data, choices)
        if fault and fault not in result.failures:
            result.failures[fault] = minimise(
                data, lambda shorter, fault=fault, choices=choices:  # type: ignore[misc]
                failure(target, shorter, choices) == fault)
    result.seconds = time.monotonic() - begin
    return result


def fuzz_named(name: str, inputs: int, seconds: float, seed: int) -> Result:
    """Feed the target with this name; for other processes, which take no functions."""
    return fuzz(next(target for target in TARGETS if target.name == name), inputs, seconds, seed)
