# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The nodes at their normal rates: time to start, CPU and memory, and what more sensors cost."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import NamedTuple

from bench.imu import SENSOR_RATE
from bench.measure import Cost, Process, Row, in_turn
from bench.receiver import (
    BARE_NODE,
    BATCHES,
    IDLE_NODE,
    RADAR,
    SETTLE_TIME,
    ULTRASONIC,
    Program,
    Receiver,
    Running,
)

MANY_FRAMES = 10_000_000  # of a stream that ends with its server
FIRST_ADDRESSES = {"isys_radar": 0x64, "uc4000": 1}


class Load(NamedTuple):
    """What a node took at its normal rate.

    Attributes:
        cpu: Share of a core in %.
        memory: In MB.
        message: CPU time for a message in ms.
        messages: Messages that came.
    """

    cpu: float
    memory: float
    message: float
    messages: int


DRIVERS = (RADAR, ULTRASONIC, BATCHES)


@contextmanager
def _running(receiver: Receiver, program: Program, sensors: int = 1) -> Iterator[Running]:
    """Run a program with what it is to talk to, which is there before it starts."""
    first = FIRST_ADDRESSES.get(program.node)
    if program is BATCHES:
        with Process("bench.server", "--frames", MANY_FRAMES, "--rate", SENSOR_RATE) as server:
            values = {"port": server.line(), "rate": SENSOR_RATE}
            server.tell(program.start)
            with receiver.running(program, values) as running:
                yield running
    elif first is None:
        with receiver.running(program, {}) as running:
            yield running
    else:
        addresses = range(first, first + sensors)
        names = [f"sensor_{address}" for address in addresses]
        with Process("bench.wire", program.node, *addresses) as wire:
            parameters = (f"sensors:=[{', '.join(names)}]", *(
                f"{name}.address:={address}" for name, address in zip(names, addresses,
                                                                      strict=True)))
            with receiver.running(program, {"port": wire.line(), "parameters": parameters},
                                  names) as running:
                yield running


# --- start ---------------------------------------------------------------------------------------

def compare_starts(receiver: Receiver, rounds: int) -> list[Row]:
    """Return a row per driver: from its start to the first message, against a bare node."""
    results = list(in_turn({program.node: partial(_start, receiver, program)
                            for program in (*DRIVERS, BARE_NODE)}, rounds))
    bare = [result[BARE_NODE.node] for result in results]
    return [Row.compare(f"start to first message, {program.node}", "s", 1.0,
                        [result[program.node] for result in results], bare, difference=True)
            for program in DRIVERS]


def _start(receiver: Receiver, program: Program) -> Cost:
    with _running(receiver, program) as running:
        return Cost(running.first() - running.process.started, 1)


# --- CPU and memory ------------------------------------------------------------------------------

def compare_loads(receiver: Receiver, duration: float, rounds: int) -> list[Row]:
    """Return rows per driver: CPU and memory at its normal rate, against an idle node."""
    results = list(in_turn({program.node: partial(_load, receiver, program, duration)
                            for program in (*DRIVERS, IDLE_NODE)}, rounds))
    rows = []
    for program in DRIVERS:
        ours, idle = ([result[name] for result in results]
                      for name in (program.node, IDLE_NODE.node))
        rows += [
            Row.compare(f"CPU, {program.node}", "% of a core", 10.0,
                        [Cost(load.cpu, load.messages) for load in ours],
                        [Cost(load.cpu, load.messages) for load in idle], difference=True),
            Row.compare(f"memory, {program.node}", "MB", 25.0,
                        [Cost(load.memory, load.messages) for load in ours],
                        [Cost(load.memory, load.messages) for load in idle], difference=True)]
    return rows


def compare_lines(receiver: Receiver, numbers: Sequence[tuple[Program, int]], duration: float,
                  rounds: int) -> list[Row]:
    """Return rows: CPU for a measurement with several sensors on a line, against one alone."""
    sides: dict[str, Callable[[], Load]] = {
        f"{program.node} {count}": partial(_load, receiver, program, duration, count)
        for program, most in numbers for count in {1, most}}
    results = list(in_turn(sides, rounds))
    return [Row.compare(f"CPU per measurement, {most} × {program.node}", "ms", 1.2,
                        *([Cost(result[f"{program.node} {count}"].message,
                                result[f"{program.node} {count}"].messages) for result in results]
                          for count in (most, 1)))
            for program, most in numbers]


def _load(receiver: Receiver, program: Program, duration: float, sensors: int = 1) -> Load:
    with _running(receiver, program, sensors) as running:
        if program is IDLE_NODE:
            running.await_publishers()
        else:
            running.first()
        running.count(SETTLE_TIME)
        start, begin = running.process.cpu_time(), time.monotonic()
        count = running.count(duration)
        used, passed = running.process.cpu_time() - start, time.monotonic() - begin
        return Load(100 * used / passed, running.process.memory, 1e3 * used / max(count, 1), count)
