# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Feeds a target with inputs, and keeps what fails, once for each way to fail.

An input that reaches a branch which none before it did becomes an example for those that follow.
"""

from __future__ import annotations

import contextlib
import signal
import time
import traceback
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from types import FrameType

from bench.fuzz.coverage import Coverage
from bench.fuzz.failures import Failure
from bench.fuzz.inputs import invent, minimise
from bench.fuzz.target import Target

LONGEST = 30.0  # s of the processor that an input may take


class HangError(Exception):
    """An input takes too long."""


@dataclass
class Result:
    """What became of a target.

    Attributes:
        name: Name of the target.
        inputs: How many inputs it got.
        seconds: How long that took.
        seeds: With how many examples it began.
        grown: How many inputs became examples.
        branches: How many branches of the drivers' code were reached.
        failures: One for each way to fail.
    """

    name: str
    inputs: int = 0
    seconds: float = 0.0
    seeds: int = 0
    grown: int = 0
    branches: int = 0
    failures: list[Failure] = field(default_factory=list)


def fault_of(target: Target, data: bytes, choices: int) -> str:
    """Return what a target raises and where, "" if it keeps its promises."""
    try:
        with _limited():
            target.check(data, Random(choices))
    except (Exception, SystemExit) as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__} in {Path(place.filename).name}, {place.name}: {place.line}"
    return ""


def fuzz(target: Target, inputs: int, seconds: float, seed: int) -> Result:
    """Feed a target with its seeds and what is made of them, until it had all or time is over."""
    result = Result(target.name, seeds=len(target.seeds))
    random, examples = Random(f"{seed} {target.name}"), list(target.seeds)
    begin = time.monotonic()
    with Coverage() as coverage:
        while result.inputs < inputs and time.monotonic() < begin + seconds:
            known = result.inputs < len(target.seeds)
            data = target.seeds[result.inputs] if known else invent(
                random, examples, target.longest)
            choices = random.getrandbits(32)
            result.inputs += 1
            fault = fault_of(target, data, choices)
            if fault:
                _note(result, target, Failure(target.name, fault, data, choices))
            elif coverage.branches > result.branches and not known:
                examples.append(data)
            result.branches = coverage.branches
    result.grown = len(examples) - len(target.seeds)
    result.seconds = time.monotonic() - begin
    return result


def _note(result: Result, target: Target, failure: Failure) -> None:
    """Keep a failure of a new kind, as small as it can be."""
    if any(failure.fault == other.fault for other in result.failures):
        return
    data = failure.data
    if not failure.fault.startswith(HangError.__name__):  # which would take long
        data = minimise(data, lambda less: fault_of(
            target, less, failure.choices) == failure.fault)
    result.failures.append(Failure(target.name, failure.fault, data, failure.choices))


@contextlib.contextmanager
def _limited() -> Iterator[None]:
    """Raise HangError where something takes more of the processor than it may."""
    signal.signal(signal.SIGVTALRM, _hang)
    signal.setitimer(signal.ITIMER_VIRTUAL, LONGEST)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)


def _hang(number: int, frame: FrameType | None) -> None:
    raise HangError
