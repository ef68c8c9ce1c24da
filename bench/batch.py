# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Batches against single samples: what a sample costs the node, and a subscriber with rclpy."""

from __future__ import annotations

import time
from functools import partial

from bench.imu import SENSOR_RATE, UNIT, VALUES_PER_FRAME
from bench.measure import Cost, Process, Row, in_turn
from bench.receiver import SETTLE_TIME

NODE = "icotronic_driver.node:main"


def compare(core: int | None, duration: float, rounds: int) -> list[Row]:
    """Return the rows for node and subscriber.

    Args:
        core: Where the node runs.
        duration: Time in s that is measured.
        rounds: How often.
    """
    results = list(in_turn({topic: partial(_run, topic, core, duration)
                            for topic in ("imu/batch", "imu/data_raw")}, rounds))
    return [Row.compare(f"batches, {side}", UNIT, 0.1,
                        [result["imu/batch"][number] for result in results],
                        [result["imu/data_raw"][number] for result in results])
            for number, side in enumerate(("node", "subscriber"))]


def _run(topic: str, core: int | None, duration: float) -> tuple[Cost, Cost]:
    """Return what a sample costs the node and the subscriber."""
    frames = round((duration + 30) * SENSOR_RATE / VALUES_PER_FRAME)
    with Process("bench.server", "--frames", frames, "--rate", SENSOR_RATE) as server:
        node = ["--ros-args"]
        for parameter in ("can_interface:=socketcand", "sensor_name:=Bench",
                          f"can_options:=[host=127.0.0.1, port={server.line()}]"):
            node += ["-p", parameter]
        with (Process(NODE, *node, core=core) as driver,
              Process("bench.listener", f"/icotronic/{topic}") as listener):
            assert listener.line() == "ready"
            server.tell("find")
            _samples(listener)
            time.sleep(SETTLE_TIME)
            before = _figures(driver, listener)
            time.sleep(duration)
            passed, received, ours, theirs = (
                late - early for early, late in zip(before, _figures(driver, listener),
                                                    strict=True))
            sent = passed * SENSOR_RATE  # a subscriber that cannot follow does not get all
            return (Cost(ours / sent * 1e6, round(sent)),
                    Cost(theirs / received * 1e6, round(received)))


def _figures(driver: Process, listener: Process) -> tuple[float, int, float, float]:
    """Return the time in s, how many samples have come, and what both have used, in s of CPU."""
    received = _samples(listener)
    return time.monotonic(), received, driver.cpu_time(), listener.cpu_time()


def _samples(listener: Process) -> int:
    """Return how many samples have come, as soon as some have."""
    listener.tell("count")
    return int(listener.line())
