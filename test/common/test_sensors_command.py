# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The command `sensors` against simulators on real transports: what it prints, does and leaves."""

from __future__ import annotations

import csv
import json
import math
import os
import pty
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import click
import numpy as np
import pytest
import yaml
from bench_sensors import PATIENCE, Bench, run

from icotronic_driver.laws import Law
from icotronic_driver.sensor import Channel
from isys_radar_driver.simulator.radar import SimulatedRadar
from sensor_tools import document, messages, node_files
from sensor_tools.cli import output
from sensor_tools.cli.program import sensors
from sensor_tools.search import icotronic
from sensor_tools.search.place import CanPlace, SerialPlace
from sensor_tools.search.result import Found
from uc4000_driver.commands import PROFILES

MODULE = "isys_radar_driver.program"
ROOT = Path(__file__).resolve().parent.parent.parent
RADAR = ("--family", "isys", "--baud", 115200)


@pytest.fixture
def bench(monkeypatch):
    bench = Bench(monkeypatch)
    yield bench
    bench.close()


@pytest.fixture
def command(capfd, monkeypatch):
    """Run the command; sensors that never show up are given up soon."""
    monkeypatch.setattr(icotronic, "RANGE_TIME", 0.6)
    return lambda *words: run(capfd, *words)


# --- scan --------------------------------------------------------------------------------------

def test_scan_shows_a_radar(bench, command):
    line, _ = bench.radars("iSYS-4001", addresses=[30])
    outcome = command("scan", "--port", line.port)
    heading, row = outcome.out.splitlines()
    assert heading.split() == ["FAMILY", "MODEL", "SERIAL", "NUMBER", "FIRMWARE", "PLACE",
                               "ADDRESS", "RATE"]
    assert row.split() == ["isys", "iSYS-4001", "000001", "1.310", line.port, "30", "115200"]
    assert outcome.code == 0


def test_scan_tells_programs_what_a_node_needs(bench, command):
    line, _ = bench.ultrasonic_sensors(2, 5)
    outcome = command("scan", "--port", line.port, "--json")
    assert [one["parameters"] for one in outcome.json["sensors"]] == [
        {"serial_port": line.port, "address": 2}, {"serial_port": line.port, "address": 5}]
    assert outcome.json["findings"] == []


def test_scan_shows_what_is_in_range(bench, command):
    network, words = bench.network("One", "Two")
    outcome = command("scan", "--json", *words)
    assert [(one["model"], one["name"], one["rssi"] is None)
            for one in outcome.json["sensors"]] == [
        ("STU", network.stu.name, True), ("STH", "One", False), ("STH", "Two", False)]


def test_scan_says_why_nothing_was_found(bench, command):
    network, words = bench.network()
    network.faults.silent = True
    outcome = command("scan", *words)
    assert outcome.code == 1
    assert "no sensor answers on socketcand can0" in outcome.out
    assert "no stationary unit answers" in outcome.out
    outcome = command("scan", "--port", "/dev/ttyMissing")
    assert outcome.code == 1
    assert "cannot open /dev/ttyMissing: there is no such port" in outcome.out


def test_a_node_connects_with_the_file_that_scan_wrote(bench, command, launch, tmp_path):
    line, _ = bench.radars("iSYS-4003", addresses=[77])
    outcome = command("scan", "--port", line.port, "--baud", 9600, "--files", tmp_path)
    file = tmp_path / "isys_radar.yaml"
    assert outcome.out.splitlines()[-1] == (
        "ros2 launch industrial_sensor_drivers isys_radar.launch.py name:=isys_radar "
        f"params_file:={file}")
    node = launch(None, "--params-file", str(file))
    node.wait_for_line("connected to iSYS-4003 000001, firmware 1.310, address 77, 9600 Bd")
    node.stop()


# --- files -------------------------------------------------------------------------------------

def found(family, where, address, **more):
    return Found(family, where, "model", str(address), 115200,
                 parameters={"address": address}, **more)


def test_sensors_on_one_line_share_a_file(tmp_path):
    line, other = SerialPlace("/dev/ttyA"), SerialPlace("/dev/ttyB")
    lines = list(node_files.write_files(tmp_path, [
        found("uc4000", line, 1), found("uc4000", line, 4), found("uc4000", other, 7),
        found("icotronic", CanPlace(), 0, is_sensor=False)]))
    assert ["name:=uc4000 " in lines[0], "name:=uc4000_2 " in lines[1], len(lines)] == [
        True, True, 2]
    values = yaml.safe_load((tmp_path / "uc4000.yaml").read_text())["/**"]["ros__parameters"]
    assert values == {"serial_port": "/dev/ttyA", "sensors": ["sensor_1", "sensor_4"],
                      "sensor_1.address": 1, "sensor_4.address": 4}


@pytest.mark.parametrize("one", [
    Found("isys", SerialPlace("/dev/ttyA"), "iSYS-4001", "9", 9600,
          parameters={"address": 9, "serial_baud": 9600}),
    Found("uc4000", SerialPlace("/dev/ttyA"), "UC4000", "3", 19200, parameters={"address": 3}),
    Found("icotronic", CanPlace(options=("host=1",)), "STH", "08:6B:D7:01:DE:81", 1000000,
          rssi=-50, parameters={"sensor_mac": "08:6B:D7:01:DE:81"})],
    ids=lambda one: one.family)
def test_files_hold_parameters_that_the_node_has(one):
    values = yaml.safe_load(node_files.parameter_file([one]))["/**"]["ros__parameters"]
    driver = next(driver for driver in document.DRIVERS
                  if driver.name == node_files.FAMILIES[one.family].node)
    options = {option.name: option for option in driver.options}
    assert {name: options[name].check(value) for name, value in values.items()} == values


class Adapter:
    device, vid, pid, serial_number, location = "/dev/ttyUSB7", 0x0403, 0x6001, "A1B2", "1-4.2"


@pytest.mark.parametrize(("number", "location", "which"), [
    ("A1B2", "1-4.2", 'ATTRS{serial}=="A1B2"'), (None, "1-4.2", 'KERNELS=="1-4.2"'),
    # an adapter with several ports, of which pyserial names the interface
    ("A1B2", "1-4.2:1.3", 'ATTRS{serial}=="A1B2", ENV{ID_USB_INTERFACE_NUM}=="03"'),
    (None, "1-4.2:1.10", 'KERNELS=="1-4.2", ENV{ID_USB_INTERFACE_NUM}=="0a"')])
def test_a_rule_names_the_adapter(monkeypatch, number, location, which):
    monkeypatch.setattr(Adapter, "serial_number", number)
    monkeypatch.setattr(Adapter, "location", location)
    monkeypatch.setattr(node_files.list_ports, "comports", lambda: [Adapter])
    assert node_files.udev_rule(SerialPlace("/dev/ttyUSB7"), "isys_radar") == (
        'SUBSYSTEM=="tty", ATTRS{idVendor}=="0403", ATTRS{idProduct}=="6001", '
        f'{which}, SYMLINK+="isys_radar"')
    assert node_files.udev_rule(SerialPlace("/dev/ttyS0"), "isys_radar") == ""
    assert node_files.udev_rule(CanPlace(), "icotronic") == ""


# --- info, get, set ----------------------------------------------------------------------------

def test_info_and_get_leave_a_radar_that_measures_alone(bench, command):
    line, (radar,) = bench.radars("iSYS-4001")
    radar.measuring = True
    outcome = command("info", "--port", line.port, *RADAR, "--json")
    assert (outcome.json["model"], outcome.json["serial number"], outcome.json["firmware"]) == (
        "iSYS-4001", "000001", "1.310")
    outcome = command("get", "--port", line.port, *RADAR, "output1.range_max", "--json")
    assert outcome.json == {"output1.range_max": radar.value("output1.range_max")}
    assert radar.measuring


def test_get_shows_all_settings_in_words(bench, command):
    line, _ = bench.ultrasonic_sensors(3)
    lines = command("get", "--port", line.port).out.splitlines()
    assert lines[0].split() == ["SETTING", "VALUE", "ALLOWED", "MEANING"]
    assert [line.split("  ")[0] for line in lines[1:]] == [
        "burst_periods", "gain_db", "current_ma", "temperature_compensation"]
    assert "56.5 … 88 dB" in lines[2]


def test_a_sensor_on_the_radio_is_reached_by_its_name(bench, command):
    network, words = bench.network("One", "Two")
    outcome = command("info", *words, "--name", "Two", "--json")
    assert outcome.json["sensor: mac"] == network.sensor("Two").mac
    assert network.stu.connected is None  # it was released


def test_set_writes_and_shows_what_the_sensor_reports(bench, command):
    line, (radar,) = bench.radars("iSYS-4001")
    outcome = command("set", "--port", line.port, *RADAR, "output1.range_max=25.04",
                      "output1.direction=receding")
    assert outcome.out.splitlines() == ["output1.range_max: 150 m → 25 m",
                                        "output1.direction: both → receding"]
    assert (radar.value("output1.range_max"), radar.value("output1.direction")) == (
        25.0, "receding")


def saved_value(radar: SimulatedRadar, name):
    radar.power_cycle()
    return radar.value(name)


@pytest.mark.parametrize("way", ["set --save", "set, then save"])
def test_a_radar_keeps_what_is_saved(bench, command, way):
    line, (radar,) = bench.radars("iSYS-4001")
    flags = ["--save"] if way == "set --save" else []
    outcome = command("set", "--port", line.port, *RADAR, "frequency_channel=3", *flags)
    if not flags:
        outcome = command("save", "--port", line.port, *RADAR)
    assert "saved in its EEPROM" in outcome.out
    assert saved_value(radar, "frequency_channel") == 3


def test_an_sth_keeps_what_is_set_and_saved_in_one_run(bench, command):
    network, words = bench.network("One")
    outcome = command("set", *words, "name=Spindle", "--save")
    assert outcome.out.splitlines() == ["name: One → Spindle", "its EEPROM holds all of it already"]
    assert network.sensors[0].name == "Spindle"
    outcome = command("save", *words)
    assert outcome.code == 1
    assert "use 'sensors set --save'" in outcome.err


def test_an_ultrasonic_sensor_keeps_everything_at_once(bench, command):
    line, _ = bench.ultrasonic_sensors(3)
    outcome = command("save", "--port", line.port)
    assert (outcome.code, "nothing to save" in outcome.out) == (0, True)


@pytest.mark.parametrize(("words", "reason"), [
    (["output1.range_mx=2"], 'there is no setting "output1.range_mx"; did you mean "output1.'),
    (["output1.range_max=2500"], "output1.range_max = 2500 m is out of range, allowed is 0 … 150"),
    (["output1.range_max=far"], "output1.range_max must be a number, not 'far'"),
    (["output1.direction=up"], "output1.direction must be one of approaching, receding, both")])
def test_what_cannot_be_set_is_refused_in_words(bench, command, words, reason):
    line, (radar,) = bench.radars("iSYS-4001")
    before = radar.value("output1.range_min")
    outcome = command("set", "--port", line.port, *RADAR, "output1.range_min=1", *words)
    assert outcome.code == 1
    assert f"error: {reason}" in outcome.err
    assert radar.value("output1.range_min") == before  # all or none


# --- address, factory settings -----------------------------------------------------------------

def test_a_sensor_moves_to_another_address(bench, command):
    line, (sensor, _) = bench.ultrasonic_sensors(3, 6)
    outcome = command("change-address", "5", "--port", line.port, "--address", 3)
    assert outcome.out == "the sensor moved from address 3 to 5 and keeps it\n"
    assert sensor.address == 5
    bench.expect(addresses=(5, 6), ultrasonic_time=PATIENCE)
    outcome = command("change-address", "6", "--port", line.port, "--address", 5)
    assert (outcome.code, "belongs to another" in outcome.err) == (1, True)


def test_a_radar_moves_to_another_address(bench, command):
    line, (radar,) = bench.radars("iSYS-4001")
    command("change-address", "9", "--port", line.port, *RADAR)
    assert radar.address == 9


def test_what_has_no_address_gets_none(bench, command):
    _, words = bench.network()
    outcome = command("change-address", "9", *words)
    assert (outcome.code, "this sensor has no address" in outcome.err) == (1, True)


def test_factory_settings_come_back(bench, command):
    line, (radar,) = bench.radars("iSYS-4001")
    command("set", "--port", line.port, *RADAR, "output1.range_max=25", "--save")
    outcome = command("factory-reset", "--port", line.port, *RADAR, "--yes")
    assert "output1.range_max: 25 m → 150 m" in outcome.out.splitlines()
    assert radar.value("output1.range_max") == 150.0


def test_a_factory_reset_asks_first(bench, command, monkeypatch):
    line, (radar,) = bench.radars("iSYS-4001")
    command("set", "--port", line.port, *RADAR, "output1.range_max=25")
    monkeypatch.setattr(click, "confirm", lambda text, abort: (_ for _ in ()).throw(click.Abort))
    assert command("factory-reset", "--port", line.port, *RADAR).code == 130
    assert radar.value("output1.range_max") == 25.0


# --- watch, record -----------------------------------------------------------------------------

def rows_of(text):
    return list(csv.DictReader(text.splitlines()))


def test_targets_are_recorded_as_the_node_publishes_them(bench, command, tmp_path):
    line, (radar,) = bench.radars("iSYS-4001")
    file = tmp_path / "targets.csv"
    outcome = command("record", file, "--port", line.port, *RADAR, "--duration", 1)
    rows = rows_of(file.read_text())
    assert list(rows[0]) == ["time [s]", "target", "range [m]", "azimuth [rad]",
                             "radial_velocity [m/s]", "intensity [dB]"]
    lists = len({row["time [s]"] for row in rows})
    assert f"{lists} measurements in {file}" in outcome.err
    assert all(0 < float(row["range [m]"]) < 150 for row in rows)
    assert not radar.measuring  # left stopped
    again = command("record", file, "--port", line.port, *RADAR, "--duration", 1)
    assert (again.code, "exists already; --overwrite replaces it" in again.err) == (1, True)


def test_samples_are_recorded_one_by_one(bench, command):
    _, words = bench.network()
    outcome = command("record", "-", *words, "--duration", 0.5, "--with", "channels=xz")
    rows = rows_of(outcome.out)
    times = [float(row["time [s]"]) for row in rows]
    assert times == sorted(times)
    assert list(rows[0]) == ["time [s]", "x [m/s²]", "z [m/s²]"]
    assert all(-1000 < float(row[name]) < 1000 for row in rows for name in list(row)[1:])
    assert f"{len(rows)} measurements" in outcome.err


def read_mcap(file):
    """Return schemas and messages of a file, by rosbags, which knows nothing of ours."""
    rosbags = pytest.importorskip("rosbags.highlevel", reason="rosbags is not installed")
    with rosbags.AnyReader([file]) as reader:
        assert {each.msgdef.format.name for each in reader.connections} == {"MSG"}  # of ros2msg
        found = [(each.topic, each.msgtype, reader.deserialize(data, each.msgtype))
                 for each, _, data in reader.messages()]
    ((topic, kind),) = {(topic, kind) for topic, kind, _ in found}
    return topic, kind, [message for _, _, message in found]


def stamps_of(found):
    return [each.header.stamp.sec * 10**9 + each.header.stamp.nanosec for each in found]


def test_target_lists_become_clouds(bench, command, tmp_path):
    line, _ = bench.radars("iSYS-4001")
    words = ["record", tmp_path / "a.mcap", "--port", line.port, *RADAR, "--duration", 1]
    outcome = command(*words)
    topic, kind, clouds = read_mcap(tmp_path / "a.mcap")
    assert (topic, kind) == ("/isys_radar/points", "sensor_msgs/msg/PointCloud2")
    assert f"{len(clouds)} measurements in " in outcome.err
    for cloud in clouds:
        assert cloud.header.frame_id == "isys_radar_link"
        points = cloud.data.view("<f4").reshape(cloud.width, -1)
        np.testing.assert_allclose(np.hypot(points[:, 0], points[:, 1]), points[:, 4], rtol=1e-5)
    assert max(cloud.width for cloud in clouds) > 0
    assert stamps_of(clouds) == sorted(set(stamps_of(clouds)))
    before = (tmp_path / "a.mcap").read_bytes()
    again = command(*words)
    assert (again.code, "exists already; --overwrite replaces it" in again.err) == (1, True)
    assert (tmp_path / "a.mcap").read_bytes() == before
    assert command(*words, "--overwrite").code == 0
    assert [path.name for path in tmp_path.iterdir()] == ["a.mcap"]


def test_distances_become_ranges(bench, command, tmp_path):
    line, _ = bench.ultrasonic_sensors(2)
    command("record", tmp_path / "a.mcap", "--port", line.port, "--duration", 1)
    topic, kind, ranges = read_mcap(tmp_path / "a.mcap")
    assert (topic, kind) == ("/uc4000/range", "sensor_msgs/msg/Range")
    assert {(round(each.min_range, 3), round(each.max_range, 3)) for each in ranges} == {
        tuple(round(limit, 3) for limit in PROFILES["b"].limits)}
    assert all(math.isinf(each.range) or each.min_range <= each.range <= each.max_range
               for each in ranges)


def test_samples_become_imus(bench, command, tmp_path):
    _, words = bench.network()
    outcome = command("record", tmp_path / "a.mcap", *words, "--duration", 0.5, "--with",
                      "channels=xz")
    topic, kind, imus = read_mcap(tmp_path / "a.mcap")
    assert (topic, kind) == ("/icotronic/imu/data_raw", "sensor_msgs/msg/Imu")
    assert f"{len(imus)} measurements in " in outcome.err
    assert stamps_of(imus) == sorted(stamps_of(imus))
    assert {each.linear_acceleration.y for each in imus} == {0.0}
    assert any(each.linear_acceleration.x for each in imus)
    assert imus[0].angular_velocity_covariance[0] == -1.0


def test_what_is_no_acceleration_has_a_topic_of_its_own():
    channels = [Channel("x", Law((0.0, 1.0), (0.0, 1.0), unit), "", 1.0, 0.0)
                for unit in ("°C", "V")]
    convert = messages.of_sth(SimpleNamespace(channels=[channels[0],
                                                        channels[1]._replace(name="y")]))
    assert [(record.topic, record.kind) for record in convert(5, [(21.0, 1.5)])] == [
        ("/icotronic/channel_x/temperature", "sensor_msgs/msg/Temperature"),
        ("/icotronic/channel_y/value", "std_msgs/msg/Float64")]


def test_without_the_classes_of_ros_only_csv_is_recorded(bench, command, tmp_path, monkeypatch):
    line, _ = bench.radars("iSYS-4001")
    monkeypatch.setitem(sys.modules, "sensor_tools.messages", None)
    outcome = command("record", tmp_path / "a.mcap", "--port", line.port, *RADAR)
    assert (outcome.code, "message classes of ROS" in outcome.err) == (1, True)
    assert list(tmp_path.iterdir()) == []


def test_watch_shows_the_last_measurement_in_a_pipe(bench, command):
    line, _ = bench.ultrasonic_sensors(2)
    outcome = command("watch", "--port", line.port, "--duration", 1)
    assert outcome.code == 0
    assert " per second: range " in outcome.out.splitlines()[-1]
    assert "outcome " in outcome.out


def start(*words, **options):
    return subprocess.Popen([sys.executable, "-m", "sensor_tools.cli.program", *map(str, words)],
                            cwd=ROOT, **options)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_watch_ends_well_when_it_is_told(bench, number):
    line, (radar,) = bench.radars("iSYS-4001")
    with start("watch", "--port", line.port, *RADAR, stdout=subprocess.PIPE, text=True) as process:
        assert " per second: " in process.stdout.readline()
        process.send_signal(number)
        process.communicate(timeout=20)
    assert process.returncode == 0
    assert not radar.measuring


def test_watch_draws_on_a_terminal(bench):
    line, _ = bench.ultrasonic_sensors(2)
    master, slave = pty.openpty()
    with start("watch", "--port", line.port, "--duration", 1, stdout=slave,
               env={**os.environ, "COLUMNS": "100"}):
        os.close(slave)
        drawn = b""
        while b"measurements," not in drawn or b"echo" not in drawn:
            drawn += os.read(master, 4096)
    os.close(master)


def test_record_ends_when_nobody_reads_on(bench):
    _, words = bench.network()
    with start("record", "-", *words, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
               text=True) as process:
        assert process.stdout.readline() == "time [s],x [m/s²]\n"
        process.stdout.close()
        assert process.stderr.read() == ""
    assert process.returncode == 1


def test_record_says_that_the_disk_is_full(bench, command):
    line, _ = bench.ultrasonic_sensors(2)
    outcome = command("record", "/dev/full", "--overwrite", "--port", line.port, "--duration", 9)
    assert outcome.code == 1
    assert "error: cannot write /dev/full: No space left on device" in outcome.err


def test_a_search_shows_how_far_it_is_and_can_be_interrupted(bench):
    port, _ = bench.empty_port()
    master, slave = pty.openpty()
    with start("scan", "--port", port, stderr=slave, stdout=subprocess.PIPE) as process:
        os.close(slave)
        drawn = b""
        while b"iSYS at" not in drawn:
            drawn += os.read(master, 4096)
        process.send_signal(signal.SIGINT)
        assert process.stdout.read() == b""
    os.close(master)
    assert b"UC4000 at address 7" in drawn
    assert b"Traceback" not in drawn
    assert process.returncode == 128 + signal.SIGINT


# --- which sensor, and errors ------------------------------------------------------------------

@pytest.mark.parametrize(("words", "code", "reason"), [
    (["info"], 1, "which sensor? give --port or --can"),
    (["info", "--port", "/dev/ttyA", "--can", "can0"], 2, "give --port or --can, not both"),
    (["info", "--port", "/dev/ttyMissing"], 1, "there is no such port"),
    (["get", "--can", "can0", "--family", "isys"], 1, "an isys sensor is not on socketcan can0"),
    (["info", "--can", "can0", "--can-option", "x"], 1, "can_options must be like"),
    (["info", "--port", "sim://iSYS-9"], 1, '"iSYS-9" is not a known iSYS model'),
    (["set", "--port", "sim://UC4000", "gain_db"], 2, "is not like output1.range_max=25"),
    (["watch", "--port", "sim://UC4000", "--with", "profile=z"], 1,
     "profile must be one of a, b, c, user, not 'z'"),
    (["watch", "--port", "sim://UC4000", "--with", "channels=x"], 1, 'no setting "channels"'),
    (["inform"], 2, "No such command 'inform'"),
    (["record", "/missing/x.csv", "--port", "sim://UC4000"], 1, "cannot write /missing/x.csv: No"),
])
def test_errors_are_in_words(command, words, code, reason):
    outcome = command(*words)
    assert (outcome.code, outcome.out) == (code, "")
    assert reason in outcome.err
    assert "Traceback" not in outcome.err


def test_one_of_several_must_be_named(bench, command):
    line, _ = bench.ultrasonic_sensors(2, 5)
    outcome = command("info", "--port", line.port)
    assert "several sensors answer" in outcome.err
    assert "say which one with --address" in outcome.err
    outcome = command("info", "--port", line.port, "--address", 4)
    assert "there is no such sensor, but UC4000 at address 2; UC4000 at address 5" in outcome.err
    assert command("info", "--port", line.port, "--address", 5, "--json").json["address"] == "5"


def test_silence_comes_with_what_to_do(bench, command):
    port, _ = bench.empty_port()
    outcome = command("info", "--port", port, "--family", "uc4000")
    assert outcome.code == 1
    assert f"no sensor answers on {port}; check power, wiring" in outcome.err


@pytest.mark.parametrize("name", [name for name in sensors.commands
                                  if name not in ("simulate", "demo")])
def test_every_command_explains_itself(command, name):
    outcome = command(name, "-h")
    assert outcome.code == 0
    assert outcome.out.startswith(f"Usage: sensors {name} ")
    assert "--port" in outcome.out


@pytest.mark.parametrize("name", ["simulate", "demo"])
def test_the_other_programs_are_commands_as_well(command, name):
    outcome = command(name, "--help")
    assert (outcome.code, outcome.out.startswith(f"usage: {name} ")) == (0, True)


WITHOUT_ROS = """
import sys

class NoRos:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("rclpy", "yaml") or name.endswith("_msgs"):
            raise ModuleNotFoundError(name)

sys.meta_path.insert(0, NoRos())
from sensor_tools.cli.program import main
main()
"""


@pytest.mark.parametrize("words", [
    ["info", "--port", "sim://iSYS-4001", *map(str, RADAR)], ["doctor", "--port", "sim://UC4000"],
    ["get", "--port", "sim://UC4000"], ["-h"]], ids=lambda words: words[0])
def test_nothing_needs_ros(words):
    done = subprocess.run([sys.executable, "-c", WITHOUT_ROS, *words], cwd=ROOT,
                          capture_output=True, text=True, timeout=50, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("option", [
    option for family in node_files.FAMILIES.values() for option in family.options.values()],
    ids=lambda option: option.name)
def test_how_to_measure_is_said_as_to_the_nodes(option):
    (row,) = {(row.kind, row.limits, row.choices and tuple(row.choices))
              for driver in document.DRIVERS for row in driver.options if row.name == option.name}
    assert row == (option.kind, option.limits, option.choices and tuple(option.choices))


def test_json_has_no_numbers_that_are_none(capsys):
    output.print_json({"offset": float("nan"), "range": [float("inf"), 1.5]})
    assert json.loads(capsys.readouterr().out) == {"offset": None, "range": [None, 1.5]}
