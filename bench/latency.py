# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A radar's target list: from its last byte on the wire to the cloud that a subscriber has."""

from __future__ import annotations

import bisect
import statistics
import time
from functools import partial

from bench.measure import Cost, Failure, Process, Row, in_turn
from bench.receiver import BARE_RADAR, RADAR, Program, Receiver

ADDRESS = 0x64
GLANCE = 0.0001  # s between two looks at the queue
AIM = 1.0  # ms more than the bare loop


def compare(receiver: Receiver, clouds: int, rounds: int) -> list[Row]:
    """Return the row: medians of the delay of so many clouds."""
    results = list(in_turn({program.node: partial(_delay, receiver, program, clouds)
                            for program in (RADAR, BARE_RADAR)}, rounds))
    return [Row.compare("radar, last byte to cloud", "ms", AIM,
                        [result[RADAR.node] for result in results],
                        [result[BARE_RADAR.node] for result in results], difference=True)]


def _delay(receiver: Receiver, program: Program, clouds: int) -> Cost:
    with Process("bench.wire", "isys_radar", ADDRESS, "--times") as wire:
        port = wire.line()
        with receiver.running(program, {"port": port}) as running:
            arrivals = [running.first()]
            while len(arrivals) <= clouds and running.process.is_running():
                if running.take() is not None:
                    arrivals.append(time.monotonic())
                else:
                    time.sleep(GLANCE)
    sent = [float(line) for line in wire.rest()]
    delays = [arrival - sent[bisect.bisect(sent, arrival) - 1] for arrival in arrivals[1:]]
    if len(delays) < clouds:
        raise Failure(f"{program.node} published {len(delays)} of {clouds} clouds")
    return Cost(1e3 * statistics.median(delays), len(delays))
