# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The whole path of a sample: from a CAN frame to an Imu, or a batch, that a subscriber has."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import NamedTuple

from rclpy.serialization import deserialize_message
from sensor_msgs.msg import PointCloud2

from bench.measure import Cost, Failure, Process, Row, in_turn
from bench.receiver import (
    BARE_LOOP,
    BATCHES,
    IDIOMATIC,
    MATCH_TIME,
    PAUSE,
    SAMPLES,
    Program,
    Receiver,
    Running,
)
from icotronic_driver.settings import nearest_adc_configuration
from icotronic_driver.values import AdcConfiguration

SENSOR_RATE = AdcConfiguration().sample_rate  # values/s
VALUES_PER_FRAME = 3
SILENCE = 3.0  # s without a message after which no more is awaited
ATTEMPTS = 3  # for a stream that must not lose anything; the machine may have been busy
MAX_LATENESS = 0.25  # s; a node that cannot follow is later and later
LAST_BATCH = 0.5  # s for which a node waits until it gives up an incomplete period
MULTIPLES = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16)
SENSORS = 20  # whose rates together one core must follow in batches
UNIT = "µs CPU per sample"


class Run(NamedTuple):
    """What came of one stream.

    Attributes:
        sent: Samples that the stream had.
        received: Samples that the subscriber got.
        cost: CPU time of the program in µs per sample, behind the first tenth.
        lateness: Time in s from when the last frame was sent until its last sample was received.
    """

    sent: int
    received: int
    cost: float
    lateness: float


@contextmanager
def streaming(receiver: Receiver, program: Program, frames: int,
              rate: float = SENSOR_RATE) -> Iterator[tuple[Running, Process]]:
    """Run a program and the server of its CAN bus, which awaits the word to begin."""
    with Process("bench.server", "--frames", frames, "--rate", rate) as server:
        values = {"port": server.line(), "rate": rate}
        with receiver.running(program, values) as running:
            running.await_publishers()
            yield running, server


def run(receiver: Receiver, program: Program, frames: int, rate: float = SENSOR_RATE) -> Run:
    """Have a program publish a stream, and return what came of it.

    Args:
        receiver: Runs and receives.
        program: What to run.
        frames: CAN frames of the stream.
        rate: Values/s of the stream.
    """
    samples = frames * VALUES_PER_FRAME
    with streaming(receiver, program, frames, rate) as (running, server):
        server.tell(program.start)
        received, cost = _receive(running, samples, batches=program is BATCHES)
        ended = time.monotonic()
        return Run(samples, received, cost, ended - float(server.line()))


def _receive(running: Running, samples: int, *, batches: bool) -> tuple[int, float]:
    """Return how many samples came, and the CPU time in µs for each behind the first tenth."""
    first = samples // 10
    count = seen = at_mark = 0
    start = 0.0
    end = time.monotonic() + MATCH_TIME
    while count < samples:
        message = running.take()
        if message is not None:
            count += deserialize_message(message, PointCloud2).width if batches else 1
            if not start and count >= first:
                start, at_mark = running.process.cpu_time(), count
            continue
        now = time.monotonic()
        if count > seen:
            seen, end = count, now + SILENCE
        elif now > end or not running.process.is_running():
            break
        time.sleep(PAUSE)
    if count <= at_mark or not start:
        raise running.process.failure(f"published {count} of {samples} samples")
    return count, (running.process.cpu_time() - start) / (count - at_mark) * 1e6


def compare(receiver: Receiver, frames: int, rounds: int) -> list[Row]:
    """Return the rows of the comparisons, at the sensor's own rate.

    Args:
        receiver: Runs and receives.
        frames: CAN frames of each run.
        rounds: How often all programs are run.
    """
    results = list(in_turn({program.node: partial(_cost, receiver, program, frames)
                            for program in (SAMPLES, IDIOMATIC, BARE_LOOP)}, rounds))
    ours, idiomatic, bare = ([result[program.node] for result in results]
                             for program in (SAMPLES, IDIOMATIC, BARE_LOOP))
    return [Row.compare("can to imu, idiomatic", UNIT, 0.35, ours, idiomatic),
            Row.compare("can to imu, bare loop", UNIT, 1.15, ours, bare)]


def find_highest_rates(receiver: Receiver, multiples: Sequence[int], duration: float,
                       rounds: int) -> list[Row]:
    """Return the row of the highest rates that our node and the bare loop publish without a loss.

    Args:
        receiver: Runs and receives.
        multiples: Multiples of the sensor's rate, tried in this order until one does not work.
        duration: Time in s of each stream.
        rounds: How often.
    """
    results = list(in_turn({program.node: partial(_highest, receiver, program, multiples, duration)
                            for program in (SAMPLES, BARE_LOOP)}, rounds))
    return [Row.compare("highest rate, bare loop", f"× {SENSOR_RATE:.0f} values/s", 0.85,
                        [result[SAMPLES.node] for result in results],
                        [result[BARE_LOOP.node] for result in results], at_least=True)]


def follow_many(receiver: Receiver, duration: float) -> list[Row]:
    """Return the row of the batches of many sensors' rates together: what came of what was sent.

    A stream whose end comes too late counts as lost.
    """
    rate = nearest_adc_configuration(SENSORS * SENSOR_RATE).sample_rate
    frames = round(duration * rate / VALUES_PER_FRAME)
    runs = [run(receiver, BATCHES, frames, rate) for _ in range(ATTEMPTS)]
    received = [one.received * (one.lateness <= MAX_LATENESS + LAST_BATCH) for one in runs]
    return [Row.compare(f"batches, {SENSORS} sensors' rates", "samples", 1.0,
                        [Cost(count, one.received) for count, one in zip(received, runs,
                                                                         strict=True)],
                        [Cost(one.sent, one.sent) for one in runs], at_least=True)]


def _highest(receiver: Receiver, program: Program, multiples: Sequence[int],
             duration: float) -> Cost:
    best, samples = 0, 0
    for multiple in multiples:
        rate = nearest_adc_configuration(multiple * SENSOR_RATE).sample_rate
        got = _lossless(receiver, program, round(duration * rate / VALUES_PER_FRAME), rate)
        if got is None or got.lateness > MAX_LATENESS:
            break
        best, samples = multiple, samples + got.received
    if not best:
        raise Failure(f"{program.node} lost something at {multiples[0]} times the sensor's rate")
    return Cost(best, samples)


def _cost(receiver: Receiver, program: Program, frames: int) -> Cost:
    got = _lossless(receiver, program, frames)
    if got is None:
        raise Failure(f"{program.node} lost something in each of {ATTEMPTS} runs")
    return Cost(got.cost, got.received)


def _lossless(receiver: Receiver, program: Program, frames: int,
              rate: float = SENSOR_RATE) -> Run | None:
    """Return the first run in which nothing got lost; None where that is in all of them."""
    runs = (run(receiver, program, frames, rate) for _ in range(ATTEMPTS))
    return next((run for run in runs if run.received == run.sent), None)
