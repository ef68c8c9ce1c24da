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
