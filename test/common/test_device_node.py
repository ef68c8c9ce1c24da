# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a node does for others while its bus is busy with what somebody wants."""

from pathlib import Path

from nodes import Process, Ros

HERE = (f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
        "import driver_common.device_node as d; d.STOP_TIME = 0.1")


def start(ros, process):
    """Return the node, once its device is there."""
    process.tell("")
    node = ros.remote("/hanging")
    ros.wait_until(lambda: "gain" in node.names())
    return node


def test_others_are_served_while_two_wait_for_the_bus():
    with Ros() as ros, Process("hanging_node", before=HERE) as process:
        node = start(ros, process)
        sets = [node.begin_set("gain", value) for value in (2, 3)]
        process.wait_for_line("writes 2")
        assert node.get("gain") == 1
        assert node.state() == "active"
        assert "is not a parameter of this node" in node.set("weight", 3).reason
        assert ros.wait_for_status("hanging: sensor").message == "well"
        assert not any(future.done() for future in sets)
        process.tell("")
        process.wait_for_line("writes 3")
        process.tell("")
        for future in sets:
            ros.wait_until(future.done)
            assert future.result().results[0].successful
        assert node.get("gain") == 3
        process.stop()


def test_a_set_is_answered_though_the_node_is_cleaned_up_meanwhile():
    with Ros() as ros, Process("hanging_node", before=HERE) as process:
        node = start(ros, process)
        setting = node.begin_set("gain", 2)
        process.wait_for_line("writes 2")
        assert node.change_state("deactivate")
        process.wait_for_line("some may measure until they are told again")
        clean_up = node.begin_change_of_state("cleanup")
        process.tell("")
        ros.wait_until(clean_up.done)
        ros.wait_until(setting.done)
        assert clean_up.result().success
        assert setting.result().results[0].successful
        assert "gain" not in node.names()
        assert "the node is not configured" in node.set("gain", 3).reason
        assert "the node is not configured" in node.trigger("start_acquisition").message
        process.stop()
