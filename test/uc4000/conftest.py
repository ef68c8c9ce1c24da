# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Lines with simulated sensors, and masters on them."""

from __future__ import annotations

import pytest
from uc4000_master import Master, still

from uc4000_driver.simulator.line import simulated_line


@pytest.fixture
def connect():
    """Make lines with sensors and masters; all are closed with the test."""
    opened = []

    def make(*addresses, **more):
        line, sensors = simulated_line(addresses, **more)
        for index, sensor in enumerate(sensors):
            sensor.scene = lambda now, index=index: still(index)
        opened.append(line.close)
        return line.start(), sensors

    def connect_master(line, *options, **more):
        master = Master(line.port, *options, **more)
        opened.append(master.bus.close)
        return master

    make.master = connect_master
    yield make
    for close in reversed(opened):
        close()


@pytest.fixture
def one(connect):
    """One sensor and its master."""
    line, (sensor,) = connect()
    return line, sensor, connect.master(line)
