# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Serial lines that feed the measured programs: simulated radars or ultrasonic sensors.

Prints the port, and, with --times, the monotonic time after each piece that was sent.
"""

from __future__ import annotations

import argparse
import contextlib
import signal
import time

from driver_common.simulator.line import SimulatedLine
from isys_radar_driver.models import find_model
from isys_radar_driver.simulator.line import SimulatedRadars
from isys_radar_driver.simulator.radar import SimulatedRadar
from uc4000_driver.simulator.line import SimulatedSensors
from uc4000_driver.simulator.sensor import SimulatedSensor
from uc4000_driver.telegram import GAP

MODEL = "iSYS-4001"


class TimedLine(SimulatedLine):
    """A line that tells when it sent something."""

    def _write(self, chunk: bytes, due: float) -> None:
        super()._write(chunk, due)
        print(time.monotonic(), flush=True)


def main() -> None:
    """Serve until a signal."""
    parser = argparse.ArgumentParser()
    parser.add_argument("family", choices=("isys_radar", "uc4000"))
    parser.add_argument("addresses", type=int, nargs="+")
    parser.add_argument("--times", action="store_true")
    options = parser.parse_args()
    kind = TimedLine if options.times else SimulatedLine
    if options.family == "uc4000":
        line = kind(SimulatedSensors([SimulatedSensor(address, serial_number=address)
                                      for address in options.addresses]), gap=GAP)
    else:
        line = kind(SimulatedRadars([
            SimulatedRadar(find_model(MODEL), address, serial_number=address)
            for address in options.addresses]))
    print(line.port, flush=True)
    line.start()
    with contextlib.suppress(KeyboardInterrupt):
        signal.pause()
    line.close()


if __name__ == "__main__":
    main()
