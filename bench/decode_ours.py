# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""This package's session, decoding a flood of frames; prints CPU time in s and frames."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable

from icotronic_driver.line import Line
from icotronic_driver.listener import Listener
from icotronic_driver.sensor import Options, Sensor
from icotronic_driver.session import IcotronicBus


class Counter(Listener):
    """Counts frames, and prints the CPU time between two of them."""

    def __init__(self, first: int, last: int) -> None:
        """Take the numbers of the two frames."""
        self._first, self._last = first, last

    def on_stream(self, sensor: Sensor) -> Callable[[int, float, tuple[int, ...]], None]:
        """Return what counts the frames of a stream."""
        first, last = self._first, self._last
        count, start = 0, 0.0

        def take(stamp: int, period: float, values: tuple[int, ...]) -> None:
            nonlocal count, start
            count += 1
            if count == first:
                start = time.process_time()
            elif count == last:
                print(time.process_time() - start, last - first, sensor.statistics.lost,
                      flush=True)
                os._exit(0)  # the flood would go on

        return take


def main() -> None:
    """Decode the frames."""
    port, first, last = map(int, sys.argv[1:])
    bus = IcotronicBus(Line("socketcand", "can0", 1_000_000, ["host=127.0.0.1", f"port={port}"]),
                       Options(sensor_name="Bench", status_period=0.0), Counter(first, last))
    bus.open()
    bus.set_active(True)
    while True:
        time.sleep(bus.poll())


if __name__ == "__main__":
    main()
