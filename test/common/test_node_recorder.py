# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Recordings of nodes: on request, at an outage, or of all; and nodes that play them."""

from __future__ import annotations

import functools
import threading
from collections import Counter
from typing import NamedTuple

import pytest
from nodes import DEADLINE, NodeProcess, Ros
from rclpy.serialization import deserialize_message
from rclpy.time import Time
from sensor_msgs.msg import Imu, PointCloud2, Range

from driver_common.device_thread import DeviceThread
from driver_common.flight_recorder import Kind, frame_of
from driver_common.recording import CAN, SERIAL, read_recording
from icotronic_driver.line import STREAM_ID
from sensor_tools.families import FAMILIES
from sensor_tools.messages import CONVERSIONS
from sensor_tools.search.place import CanPlace, SerialPlace
from sensor_tools.search.result import Found
from uc4000_driver.simulator.line import simulated_line


class Driver(NamedTuple):
    """How a driver is started with a simulator, and what it publishes."""

    module: str
    name: str
    parameters: dict[str, object]
    topic: str
    kind: type
    link: str


DRIVERS = [
    Driver("isys_radar_driver.program", "isys_radar", {"serial_port": "sim://iSYS-4001"},
           "points", PointCloud2, SERIAL),
    Driver("uc4000_driver.program", "uc4000", {"serial_port": "sim://UC4000"},
           "range", Range, SERIAL),
    Driver("icotronic_driver.program", "icotronic", {"can_interface": "sim"},
           "imu/batch", PointCloud2, CAN),
]


@pytest.fixture
def ros():
    with Ros() as ros:
        yield ros


@pytest.fixture
def home(tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "ros"))
    return tmp_path / "ros" / "recordings"


def logs(directory, reason):
    return sorted(directory.glob(f"*-{reason}.log"))


@pytest.mark.parametrize("driver", DRIVERS, ids=lambda driver: driver.name)
def test_the_last_minute_is_saved_on_request(ros, home, driver):
    with NodeProcess(driver.module, driver.parameters | {"time_offset": -0.01},
                     "-r", "__ns:=/left") as process:
        node = ros.remote(f"/left/{driver.name}")
        messages = node.subscribe(driver.kind, driver.topic)
        ros.wait_until(lambda: len(messages) > 3)
        response = node.trigger("save_recording")
        status = ros.wait_for_status(
            f"left/{driver.name}: {'radar' if driver.name == 'isys_radar' else 'sensor'}",
            lambda status: "last recording" in status.values)
        process.stop()
    (path,) = logs(home, "request")
    assert status.values["last recording"] == str(path)
    assert response.success
    assert response.message == f"saved {path}"
    recording = read_recording(path)
    assert recording.link == driver.link
    assert recording.parameters["time_offset"] == -0.01
    assert not recording.parameters.keys() & {"serial_port", "can_interface", "autostart"}
    assert recording.facts["node"] == f"/left/{driver.name}"
    assert "numpy" in recording.facts["versions"]
    assert recording.facts["device"]
    counts = Counter(entry.kind for entry in recording.entries)
    assert counts[Kind.OPENED] == 1
    assert counts[Kind.SENT] > 5
    assert counts[Kind.RECEIVED] > 5
    if driver.link == CAN:
        assert any(frame_of(entry.content).identifier & 0x1FFFFFFF == STREAM_ID
                   for entry in recording.entries if entry.kind is Kind.RECEIVED)
    else:
        assert any(title.startswith("setting ") for title in recording.facts)


def test_nothing_is_saved_before_there_is_anything(ros, home):
    with NodeProcess("uc4000_driver.program", {"autostart": False, "serial_port": "sim://UC4000"}):
        node = ros.remote("/uc4000")
        assert node.state() == "unconfigured"
    assert not home.exists()


def test_the_first_error_of_an_outage_is_a_recording(ros, tmp_path):
    line, _ = simulated_line([7])
    line.start()
    with NodeProcess("uc4000_driver.program", {
            "serial_port": line.port, "recording_directory": str(tmp_path / "outages")}) as process:
        ranges = ros.remote("/uc4000").subscribe(Range, "range")
        ros.wait_until(lambda: ranges)
        line.faults.silent = True
        process.wait_for_line("what led to this outage is in")
        process.stop()
    line.close()
    (path,) = (tmp_path / "outages").iterdir()
    recording = read_recording(path)
    assert "no answer" in recording.facts["because"]
    notes = [entry.text for entry in recording.entries if entry.kind is Kind.NOTE]
    assert notes[0].startswith("found sensor: UC4000")
    assert "no answer" in notes[-1]


def test_an_outage_without_a_directory_is_no_recording(ros, home):
    line, _ = simulated_line([7])
    line.start()
    with NodeProcess("uc4000_driver.program", {"serial_port": line.port}) as process:
        ranges = ros.remote("/uc4000").subscribe(Range, "range")
        ros.wait_until(lambda: ranges)
        line.faults.silent = True
        process.wait_for_line("(waiting for it)")
        process.stop()
    line.close()
    assert not home.exists()


def test_all_is_recorded_until_the_end(ros, tmp_path):
    with NodeProcess("uc4000_driver.program", {
            "serial_port": "sim://UC4000", "record_raw": True,
            "recording_directory": str(tmp_path)}) as process:
        ranges = ros.remote("/uc4000").subscribe(Range, "range")
        ros.wait_until(lambda: len(list(tmp_path.glob("*.part"))) and len(ranges) > 40)
        process.stop()
    (path,) = tmp_path.iterdir()
    entries = [entry for entry in read_recording(path).entries if entry.kind is not Kind.OFFSET]
    assert entries[0].kind is Kind.OPENED
    sent = [entry for entry in entries if entry.kind is Kind.SENT]
    assert len(sent) > len(ranges)
    assert not any(entry.kind is Kind.GAP for entry in entries)


def test_a_directory_that_cannot_be_written_is_told_once(ros, tmp_path):
    (tmp_path / "file").write_text("")
    with NodeProcess("uc4000_driver.program", {
            "serial_port": "sim://UC4000", "record_raw": True,
            "recording_directory": str(tmp_path / "file")}) as process:
        node = ros.remote("/uc4000")
        ranges = node.subscribe(Range, "range")
        process.wait_for_line("cannot write a recording to")
        count = len(ranges)
        ros.wait_until(lambda: len(ranges) > count + 40)
        response = node.trigger("save_recording")
        process.stop()
    assert not response.success
    lines = [line for line in process.lines if "cannot write a recording to" in line]
    assert len(lines) == 2  # once of its own accord, once as the answer


# --- replay ------------------------------------------------------------------------------------

def play(driver, path):
    """Return the parameters with which a driver plays a recording."""
    if driver.link == CAN:
        return {"can_interface": "replay", "can_channel": str(path)}
    return {"serial_port": f"replay://{path}"}


def run(ros, driver, parameters, name, until):
    """Run a node from its start on, until something; return what it published, and its log."""
    with NodeProcess(driver.module, parameters | {"autostart": False},
                     "-r", f"__node:={name}") as process:
        node = ros.remote(f"/{name}")
        messages = node.subscribe(driver.kind, driver.topic)
        assert node.change_state("configure")
        ros.wait_until(lambda: ros.node.count_publishers(f"/{name}/{driver.topic}"))
        assert node.change_state("activate")
        until(process, node, messages)
        process.stop()
    messages = list(messages)
    ros.forget()
    return messages, process


@pytest.mark.parametrize("driver", DRIVERS, ids=lambda driver: driver.name)
def test_a_recording_gives_the_same_messages(ros, home, driver):
    counts = []

    def save(process, node, messages):
        ros.wait_until(lambda: len(messages) > 60)
        counts.append(len(messages))
        assert node.trigger("save_recording").success

    def end(process, node, messages):
        ros.wait_until(lambda: "has ended" in process.log)
        ros.wait(lambda: len(messages) >= counts[0], 2.0)

    wanted, _ = run(ros, driver, driver.parameters | {"time_offset": -0.01}, "original", save)
    (path,) = logs(home, "request")
    replayed, process = run(ros, driver, play(driver, path) | {"replay_rate": 4.0}, "again", end)
    assert len(replayed) >= counts[0] - 2  # the last ones of a batch were not in it yet
    assert replayed == wanted[:len(replayed)]
    assert f"playing {path} of /original" in process.log
    assert "this node asks" not in process.log


# Each driver with the topic that `sensors record` writes, and the address of no certain sensor.
RECORDED = [
    (DRIVERS[0], "isys", "0"),
    (DRIVERS[1], "uc4000", "0"),
    (DRIVERS[2]._replace(topic="imu/data_raw", kind=Imu), "icotronic", "")]


@pytest.mark.parametrize(("driver", "family", "address"), RECORDED,
                         ids=[driver.name for driver, *_ in RECORDED])
def test_the_command_records_the_messages_of_the_node(ros, home, driver, family, address):
    def save(process, node, messages):
        ros.wait_until(lambda: len(messages) > 60)
        assert node.trigger("save_recording").success

    wanted, _ = run(ros, driver, driver.parameters, driver.name, save)
    (path,) = logs(home, "request")
    place = SerialPlace(f"replay://{path}") if driver.link == SERIAL else CanPlace(
        str(path), "replay")
    recorded, ended = {}, threading.Event()
    convert = functools.cache(lambda: CONVERSIONS[family](bus.devices[0]))
    bus = FAMILIES[family].make_bus(
        Found(family, place, "", address, 0),
        lambda *measured: recorded.update({one.time: one for one in convert()(*measured)}), {})
    bus.line.recorder.clock.rate = 0.0
    thread = DeviceThread("bus", bus, lambda error: error and ended.set())
    thread.post(lambda: bus.set_active(True))
    thread.start()
    assert ended.wait(DEADLINE)
    thread.stop()
    both = [(message, recorded[stamp]) for message in wanted
            if (stamp := Time.from_msg(message.header.stamp).nanoseconds) in recorded]
    assert len(both) > 50
    for message, record in both:
        assert record.topic == f"/{driver.name}/{driver.topic}"
        assert deserialize_message(record.data, driver.kind) == message


def test_other_parameters_than_recorded_are_said_once(ros, home):
    driver = DRIVERS[0]

    def save(process, node, messages):
        ros.wait_until(lambda: len(messages) > 10)
        node.trigger("save_recording")

    def end(process, node, messages):
        process.wait_for_line("has ended")

    run(ros, driver, driver.parameters, "original", save)
    (path,) = logs(home, "request")
    _, process = run(ros, driver, play(driver, path) | {
        "output": 2, "replay_rate": 100.0}, "again", end)
    assert process.log.count("this node asks") == 1


@pytest.mark.parametrize("driver", DRIVERS, ids=lambda driver: driver.name)
@pytest.mark.parametrize(("text", "fault"), [
    ("hello", "it is no recording of this package"),
    ("# industrial_sensor_drivers recording, format 1, {link}\n# node: /x\n", "it is cut off")])
def test_a_file_that_cannot_be_played_is_one_line(tmp_path, driver, text, fault):
    path = tmp_path / "file.log"
    path.write_text(text.format(link=driver.link))
    with NodeProcess(driver.module, play(driver, path)) as process:
        assert process.wait() == 1
    lines = [line for line in process.lines if line]
    assert len(lines) == 1, lines
    assert fault in lines[0]
    assert f"cannot replay {path}: " in lines[0]
