# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The diagnostics: one name per sensor, whatever is wrong, and nothing that is out of date."""

from pathlib import Path

from diagnostic_msgs.msg import DiagnosticStatus
from nodes import Process, Ros

BEFORE = (f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
          "import driver_common.diagnostics as d; d.PERIOD, d.LATEST = 0.1, 0.5")


def test_a_bus_that_hangs_is_an_error_of_every_sensor():
    arguments = "--ros-args", "-r", "__ns:=/car", "-p", 'sensors:=["left", "right"]'
    with Ros() as ros, Process("hanging_node", *arguments, before=BEFORE) as process:
        for sensor in "left", "right":
            status = ros.wait_for_status(f"car/hanging: {sensor}", lambda status: (
                status.level == ord(DiagnosticStatus.ERROR)))
            assert "the bus has been busy for" in status.message
        process.tell("")
        for sensor in "left", "right":
            status = ros.wait_for_status(f"car/hanging: {sensor}", lambda status: (
                status.level == ord(DiagnosticStatus.OK)))
            assert status.message == "well"
        process.stop()


def test_the_publisher_takes_overrides_of_its_qos():
    with Ros() as ros, Process("hanging_node", before=BEFORE):
        assert ros.remote("/hanging").get("qos_overrides./diagnostics.publisher.depth") == 10
