# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Diagnostics: what the drivers say on /diagnostics (REP-107)."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node
from rclpy.qos_overriding_options import QoSOverridingOptions

from driver_common.sample_clock import SampleClock
from msg_conversions.header import to_header

PERIOD = 1.0  # s
LATEST = 3.0  # s after which what was said is not true any more

OK, WARN, ERROR, STALE = (DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR,
                          DiagnosticStatus.STALE)


def to_status(name: str, hardware_id: str, level: bytes, message: str,
              values: Mapping[str, object]) -> DiagnosticStatus:
    """Return a status; values become text, numbers with at most six digits."""
    status = DiagnosticStatus(name=name, hardware_id=hardware_id, level=level, message=message)
    add_values(status, values)
    return status


def add_values(status: DiagnosticStatus, values: Mapping[str, object]) -> None:
    """Add values to a status, as `to_status` does."""
    status.values += [
        KeyValue(key=key, value=f"{value:.6g}" if isinstance(value, float) else str(value))
        for key, value in values.items()]


def clock_values(clock: SampleClock, breaks: int) -> dict[str, object]:
    """Return what a clock says of itself; `breaks` were those of its predecessors."""
    return {"drift of the clock [ppm]": 1e6 * clock.drift,
            "jitter of the arrivals [ms]": 1e-6 * clock.jitter,
            "spread of the path delays [ms]": 1e-6 * clock.delay_spread,
            "uncertainty of the stamps [ms]": 1e-6 * clock.uncertainty,
            "breaks of the clock": breaks + clock.breaks}


class Diagnostics:
    """Publisher of /diagnostics."""

    def __init__(self, node: Node) -> None:
        """Create the publisher."""
        self._publisher = node.create_publisher(
            DiagnosticArray, "/diagnostics", 10,
            qos_overriding_options=QoSOverridingOptions.with_default_policies())

    def publish(self, statuses: Iterable[DiagnosticStatus]) -> None:
        """Publish statuses, stamped with the host's clock like the data."""
        self._publisher.publish(DiagnosticArray(
            header=to_header("", time.time_ns()), status=list(statuses)))
