# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Having a sensor measure for a while; what `watch` and `record` share."""

from __future__ import annotations

import math
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import click

from sensor_tools.cli.sensor import Session

STEP = 0.1  # s between two looks at whether it is to end

duration_option = click.option("--duration", type=click.FloatRange(0, min_open=True), metavar="S",
                               help="Time in s; without it, until Ctrl-C.")


def measure(one: Session, duration: float | None, show: Callable[[], object],
            period: float) -> None:
    """Have a connected sensor measure until the time is over or somebody wants it to end.

    Args:
        one: The session.
        duration: In s; None = until a signal comes.
        show: Called every `period` s, and at the end.
        period: In s.

    Raises:
        DriverError: The sensor or the link was lost.
    """
    with _signals() as stopped:
        one.bus.set_active(True)
        begin = time.monotonic()
        due, end = begin + period, begin + (duration or math.inf)
        while not stopped and time.monotonic() < end:
            pause = one.bus.poll()
            if one.device.error is not None:
                raise one.device.error
            if time.monotonic() >= due:
                show()
                due = time.monotonic() + period
            if pause > 0:
                time.sleep(min(pause, STEP))
        show()


@contextmanager
def _signals() -> Iterator[list[int]]:
    """Yield a list of the signals that came meanwhile and asked for an end."""
    came: list[int] = []
    before = {number: signal.signal(number, lambda number, _: came.append(number))
              for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield came
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
