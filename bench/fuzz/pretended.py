# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Pretended time: it passes only where somebody waits, so a load changes nothing."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from driver_common import clocks
from driver_common.clocks import SECOND, ReplayClock

BEGIN = 1_000 * SECOND  # ns, monotonic
EPOCH = 1_700_000_000 * SECOND  # ns since the epoch, at zero of the monotonic clock


@contextlib.contextmanager
def pretended_time() -> Iterator[ReplayClock]:
    """Have this thread live in a time that passes as fast as can be."""
    clock = ReplayClock(BEGIN, EPOCH)
    clock.rate = 0.0
    clocks.use(clock)
    try:
        yield clock
    finally:
        clocks.use(None)
