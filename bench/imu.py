"""The whole path: from a CAN frame to Imu messages that a subscriber in another process has.

The subscriber is this process. It takes the serialised messages straight from the middleware,
because the executor of rclpy could not follow the faster streams.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import rclpy
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions
from rclpy.subscription import Subscription
from sensor_msgs.msg import Imu

from bench.measure import Cost, Failure, Process, Row, in_turn
from icotronic_driver.settings import nearest_adc_configuration
from icotronic_driver.values import AdcConfiguration

SENSOR_RATE = AdcConfiguration().sample_rate  # values/s
VALUES_PER_FRAME = 3
QUEUE = 100_000  # messages; the subscriber must not be what loses some
MATCH_TIME = 20.0  # s until publisher and subscriber must have found each other
SETTLE_TIME = 0.5  # s more, for the other direction, and for the CAN bus
SILENCE = 3.0  # s without a message after which no more is awaited
ATTEMPTS = 3  # for a stream that must not lose anything; the machine may have been busy
MAX_LATENESS = 0.25  # s; a node that cannot follow is later and later
PAUSE = 0.001  # s between two looks at the queue
UNIT = "µs CPU per sample"


@dataclass(frozen=True)
class Program:
    """A node that publishes what it receives on the CAN bus.

    Attributes:
        module: What Python runs.
        node: Name of the node.
        parameters: Its parameters; {port} is the one of the server.
        start: What the server is told to begin.
    """

    module: str
    node: str
    parameters: tuple[str, ...] = ("port:={port}",)
    start: str = "stream"


OURS = Program(
    "icotronic_driver.node:main", "icotronic",
    ("can_interface:=socketcand", "can_options:=[host=127.0.0.1, port={port}]",
     "sensor_name:=Bench", "sample_rate:={rate}"), "find")
IDIOMATIC = Program("bench.idiomatic_node", "idiomatic")
BARE = Program("bench.bare_loop", "bare")


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


class Subscriber:
    """Subscribes to the programs, one after the other."""

    _numbers = itertools.count()

    def __init__(self, node: Node, core: int | None) -> None:
        """Take a node of this process, and the core for the measured programs."""
        self._node = node
        self._core = core

    def run(self, program: Program, frames: int, rate: float = SENSOR_RATE) -> Run:
        """Have a program publish a stream, and return what came of it.

        Args:
            program: What to run.
            frames: CAN frames of the stream.
            rate: Values/s of the stream.
        """
        samples = frames * VALUES_PER_FRAME
        namespace = f"bench_{next(self._numbers)}"
        with Process("bench.server", "--frames", frames, "--rate", rate) as server:
            values = {"port": server.line(), "rate": rate, "namespace": namespace}
            arguments = ["--ros-args", "-r", f"__ns:=/{namespace}"]
            for parameter in program.parameters:
                arguments += ["-p", parameter.format_map(values)]
            with (self._subscription(f"/{namespace}/{program.node}/imu/data_raw") as subscription,
                  Process(program.module, *arguments, core=self._core) as process):
                self._await_publisher(subscription, process)
                server.tell(program.start)
                received, cost = self._receive(subscription, process, samples)
                ended = time.monotonic()
                return Run(samples, received, cost, ended - float(server.line()))

    @staticmethod
    def _await_publisher(subscription: Subscription, process: Process) -> None:
        end = time.monotonic() + MATCH_TIME
        while not subscription.get_publisher_count():
            if time.monotonic() > end or not process.is_running():
                raise process.failure("did not come up")
            time.sleep(0.05)
        time.sleep(SETTLE_TIME)

    @staticmethod
    def _receive(subscription: Subscription, process: Process,
                 samples: int) -> tuple[int, float]:
        """Return how many samples came, and the CPU time in µs for each behind the first tenth."""
        first = samples // 10
        count = seen = 0
        start = 0.0
        end = time.monotonic() + MATCH_TIME
        take = subscription.handle.take_message
        with subscription.handle:
            while count < samples:
                if take(Imu, True) is not None:
                    count += 1
                    if count == first:
                        start = process.cpu_time()
                    continue
                now = time.monotonic()
                if count > seen:
                    seen, end = count, now + SILENCE
                elif now > end or not process.is_running():
                    break
                time.sleep(PAUSE)
        if count <= first:
            raise process.failure(f"published {count} of {samples} samples")
        return count, (process.cpu_time() - start) / (count - first) * 1e6

    @contextmanager
    def _subscription(self, topic: str) -> Iterator[Subscription]:
        subscription = self._node.create_subscription(Imu, topic, lambda _: None,
                                                      QoSProfile(depth=QUEUE), raw=True)
        yield subscription
        self._node.destroy_subscription(subscription)


@contextmanager
def make_subscriber(core: int | None) -> Iterator[Subscriber]:
    """Yield the subscriber of this process; `core` is for the programs."""
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    try:
        yield Subscriber(rclpy.create_node("bench"), core)
    finally:
        rclpy.try_shutdown()


def compare(subscriber: Subscriber, frames: int, rounds: int) -> list[Row]:
    """Return the rows of the comparisons, at the sensor's own rate.

    Args:
        subscriber: Receives what is published.
        frames: CAN frames of each run.
        rounds: How often all programs are run.
    """
    results = list(in_turn({program.node: partial(_cost, subscriber, program, frames)
                            for program in (OURS, IDIOMATIC, BARE)}, rounds))
    ours, idiomatic, bare = ([result[program.node] for result in results]
                             for program in (OURS, IDIOMATIC, BARE))
    return [Row.of_costs("can to imu, idiomatic", UNIT, 0.4, ours, idiomatic),
            Row.of_costs("can to imu, bare loop", UNIT, 1.25, ours, bare)]


def find_highest_rate(subscriber: Subscriber, multiples: Sequence[int], duration: float) -> Row:
    """Return the row of the highest rate that our node publishes without a loss.

    Args:
        subscriber: Receives what is published.
        multiples: Multiples of the sensor's rate, tried in this order until one does not work.
        duration: Time in s of each stream.
    """
    best: tuple[int, Run] | None = None
    for multiple in multiples:
        rate = nearest_adc_configuration(multiple * SENSOR_RATE).sample_rate
        run = _lossless(subscriber, OURS, round(duration * rate / VALUES_PER_FRAME), rate)
        if run is None or run.lateness > MAX_LATENESS:
            break
        best = multiple, run
    if best is None:
        raise Failure(f"something got lost even at {multiples[0]} times the sensor's rate")
    highest, run = best
    return Row("highest rate without a loss", highest, 1, f"× {SENSOR_RATE:.0f} values/s", highest,
               8, highest >= 8, None, (run.received, run.sent), at_least=True)


def _cost(subscriber: Subscriber, program: Program, frames: int) -> Cost:
    run = _lossless(subscriber, program, frames)
    if run is None:
        raise Failure(f"{program.node} lost something in each of {ATTEMPTS} runs")
    return Cost(run.cost, run.received)


def _lossless(subscriber: Subscriber, program: Program, frames: int,
              rate: float = SENSOR_RATE) -> Run | None:
    """Return the first run in which nothing got lost; None where that is in all of them."""
    runs = (subscriber.run(program, frames, rate) for _ in range(ATTEMPTS))
    return next((run for run in runs if run.received == run.sent), None)
