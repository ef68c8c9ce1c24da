# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""How a node ends: well, whatever it does when a signal comes, and in bounded time."""

import os
import re
import signal
from pathlib import Path

import pytest
from nodes import DEADLINE, Process

from isys_radar_driver.simulator.line import simulated_line

HERE = f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})"
IMPORT = """
import os, signal, sys
class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == {module!r}:
            sys.meta_path.remove(self)
            os.kill(os.getpid(), signal.{signal})
sys.meta_path.insert(0, Finder())
"""


def end_of(process):
    """Return the exit code; nobody wants to see a traceback."""
    code = process.wait()
    assert "Traceback" not in process.log, process.log
    return code


def send(process):
    """Send a signal and wait until it was taken: two that wait count as one."""
    os.kill(process.number, signal.SIGINT)
    status = Path(f"/proc/{process.number}/status")
    while "ShdPnd:\t0000000000000002" in status.read_text():
        os.sched_yield()


@pytest.mark.parametrize("number", ["SIGINT", "SIGTERM"])
@pytest.mark.parametrize("module", ["isys_radar_driver.node", "rclpy", "isys_radar_driver.line"])
def test_a_signal_while_modules_are_imported(module, number):
    before = IMPORT.format(module=module, signal=number)
    with Process("isys_radar_driver.program", before=before) as process:
        assert end_of(process) == 0


@pytest.mark.parametrize("numbers", [
    (signal.SIGINT, signal.SIGINT), (signal.SIGINT, signal.SIGTERM),
    (signal.SIGTERM, signal.SIGTERM)])
def test_two_signals_at_once_leave_the_device_stopped(numbers):
    line, (radar,) = simulated_line(["iSYS-4001"])
    line.start()
    arguments = "--ros-args", "-p", f"serial_port:={line.port}"
    with Process("isys_radar_driver.program", *arguments) as process:
        process.wait_for_line("connected to")
        for number in numbers:
            os.kill(process.number, number)
        assert end_of(process) == 0
    assert not radar.measuring
    line.close()


def test_a_signal_in_the_middle_of_the_start():
    before = IMPORT.format(module="isys_radar_driver.simulator.line", signal="SIGINT")
    arguments = "--ros-args", "-p", "serial_port:=sim://iSYS-4001"
    with Process("isys_radar_driver.program", *arguments, before=before) as process:
        assert end_of(process) == 0


def test_a_third_signal_forces_the_end_of_a_bus_that_hangs():
    with Process("hanging_node", before=HERE) as process:
        process.wait_for_line("hangs")
        for _ in range(3):
            send(process)
        assert end_of(process) == 1


def test_a_bus_that_hangs_does_not_keep_the_process():
    before = f"{HERE}\nimport driver_common.program as p; p.STOP_TIME = 0.2"
    with Process("hanging_node", before=before) as process:
        process.wait_for_line("hangs")
        os.kill(process.number, signal.SIGINT)
        assert end_of(process) == 1
        assert "error: the devices could not be stopped in time" in process.log


def test_a_middleware_that_hangs_does_not_keep_the_process():
    before = ("import threading, rclpy.lifecycle, driver_common.program as p\n"
              "p.MIDDLEWARE_TIME = 0.2\n"
              "rclpy.lifecycle.LifecycleNode.destroy_node = lambda self: threading.Event().wait()")
    arguments = "--ros-args", "-p", "serial_port:=sim://iSYS-4001"
    with Process("isys_radar_driver.program", *arguments, before=before) as process:
        process.wait_for_line("connected to")
        os.kill(process.number, signal.SIGINT)
        assert end_of(process) == 0


def test_a_node_leaves_no_shared_memory_of_the_middleware():
    before = f"import driver_common.program as p; p.MIDDLEWARE_TIME = {DEADLINE}"
    arguments = "--ros-args", "-p", "serial_port:=sim://iSYS-4001"
    with Process("isys_radar_driver.program", *arguments, before=before) as process:
        process.wait_for_line("connected to")
        mapped = set(re.findall(r"/dev/shm/fastrtps_[0-9a-f]{16}$",
                                Path(f"/proc/{process.number}/maps").read_text(), re.MULTILINE))
        if not mapped:
            pytest.skip("another middleware")
        os.kill(process.number, signal.SIGINT)
        assert end_of(process) == 0
    assert [name for name in mapped if Path(name).exists()] == []
