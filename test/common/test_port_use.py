# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Who holds a serial port: other processes that opened or locked a real pseudo-terminal."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from driver_common import advice, port_use
from driver_common.advice import Advice
from driver_common.errors import LinkError
from driver_common.serial_link import SerialLink

HOLD = "import serial, sys; port = serial.Serial(sys.argv[1], exclusive=True); input(print('open'))"
LOCK = """
import fcntl, os, sys
port = os.open(sys.argv[1], os.O_RDWR | os.O_NOCTTY)
fcntl.flock(port, fcntl.LOCK_EX)
input(print("open"))
"""


@pytest.fixture
def terminal():
    master, slave = os.openpty()
    yield os.ttyname(slave)
    os.close(master)
    os.close(slave)


@pytest.fixture
def hold(tmp_path):
    """Start processes that hold a port, as a program called `holder.py`."""
    processes = []

    def start(port, code=HOLD):
        script = tmp_path / "holder.py"
        script.write_text(code)
        processes.append(subprocess.Popen([sys.executable, script, port], text=True,
                                          stdin=subprocess.PIPE, stdout=subprocess.PIPE))
        assert processes[-1].stdout.readline()
        return processes[-1].pid

    yield start
    for process in processes:
        process.kill()
        process.communicate()


@pytest.mark.parametrize("code", [HOLD, LOCK], ids=["pyserial", "flock"])
def test_a_holder_is_named(terminal, hold, code):
    assert port_use.holders(terminal) == []  # this process does not count
    pid = hold(terminal, code)
    assert [str(process) for process in port_use.holders(terminal)] == [f"holder.py (pid {pid})"]


def test_a_holder_whose_files_are_hidden_is_known_by_its_lock(terminal, hold, monkeypatch):
    pid = hold(terminal)
    monkeypatch.setattr(port_use, "_with_file", lambda status: iter(()))
    assert [process.pid for process in port_use.holders(terminal)] == [pid]


def test_the_link_names_the_holder(terminal, hold):
    pid = hold(terminal)
    with pytest.raises(LinkError) as caught:
        SerialLink(terminal, 115200)
    assert str(caught.value) == (
        f"cannot open {terminal}: it is in use by holder.py (pid {pid}); close that one first")


def test_what_is_not_there_is_held_by_nobody():
    assert port_use.holders("/dev/ttyMissing") == []


def test_the_group_of_a_port(terminal):
    os.chown(terminal, -1, 20) if os.geteuid() == 0 else None
    assert port_use.group_of(terminal)
    assert port_use.group_of("/dev/ttyMissing") == "dialout"


ALL = {name: value for name, value in vars(advice).items() if isinstance(value, Advice)}


@pytest.mark.parametrize("name", ALL)
def test_every_advice_is_in_words(name):
    cause, remedy = ALL[name]
    assert cause or remedy
    assert not {cause[:1], remedy[:1]} & {" ", ";", ","}
    assert not {cause[-1:], remedy[-1:]} & {" ", ";", ",", "."}


def test_causes_and_remedies_are_one_line():
    assert advice.GONE.text() == "it is gone; is it plugged in?"
    assert advice.SILENCE.text() == "check power, wiring and the address"
    assert advice.SERVER_CLOSED.text() == "the server closed the connection"
