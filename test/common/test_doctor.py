# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The doctor: each thing that can be wrong is said in words, with what to do about it."""

from __future__ import annotations

import errno
import json
import os
import stat
import subprocess
import sys
import threading
import time
from types import SimpleNamespace

import can
import pytest
import rclpy
import serial
from bench_sensors import Bench, VirtualLink, run
from bus_master import needs_errors_of_socketcand

from driver_common.simulator.bus import CanFrame
from sensor_tools.cli.places import Wanted
from sensor_tools.doctor import can_bus, middleware, serial_port
from sensor_tools.search import icotronic
from sensor_tools.search.place import CanPlace, SerialPlace
from sensor_tools.search.result import Progress


@pytest.fixture
def bench(monkeypatch):
    bench = Bench(monkeypatch)
    yield bench
    bench.close()


@pytest.fixture
def doctor(capfd, monkeypatch):
    """Run the doctor; return the causes of what is wrong, and of what is well."""
    monkeypatch.setattr(icotronic, "RANGE_TIME", 0.6)

    def examine(*words):
        outcome = run(capfd, "doctor", "--json", *words)
        findings = outcome.json["findings"]
        wrong = [one for one in findings if one["is_wrong"]]
        assert outcome.json["wrong"] == len(wrong)
        assert outcome.code == (1 if wrong else 0)
        assert all(one["remedy"] for one in wrong)
        return ([one["cause"] for one in wrong],
                [one["cause"] for one in findings if not one["is_wrong"]])

    return examine


# --- serial ports ------------------------------------------------------------------------------

def test_a_healthy_sensor_has_nothing(bench, doctor):
    line, _ = bench.ultrasonic_sensors(3)
    wrong, well = doctor("--port", line.port)
    assert not wrong
    assert well == ["opens, and no other program uses it",
                    "UC4000 at address 3, 19200 Bd, serial number 40000016900001"]


def test_people_get_a_table(bench, capfd):
    line, _ = bench.ultrasonic_sensors(3)
    outcome = run(capfd, "doctor", "--port", line.port, "--address", 5)
    assert outcome.out.splitlines()[1].split("  ")[0] == "wrong"
    assert "correct the parameter address" in outcome.out
    assert outcome.out.splitlines()[-1] == "1 thing is wrong"
    assert outcome.code == 1


def test_a_missing_port(doctor):
    wrong, _ = doctor("--port", "/dev/ttyMissing")
    assert wrong[0].startswith("cannot open /dev/ttyMissing: there is no such port")


def test_a_port_without_permission(bench, capfd):
    port, _ = bench.empty_port()
    mode = stat.S_IMODE(os.stat(port).st_mode)
    os.chmod(port, 0)
    root = os.geteuid() == 0
    if root:
        os.seteuid(65534)  # nobody; root may open everything
    try:
        outcome = run(capfd, "doctor", "--port", port, "--json")
    finally:
        if root:
            os.seteuid(0)
        os.chmod(port, mode)
    (finding,) = outcome.json["findings"]
    assert finding["cause"] == f"cannot open {port}: no permission"
    assert "sudo usermod -aG dialout $USER" in finding["remedy"]


def test_a_port_that_another_program_holds(bench, doctor):
    port, _ = bench.empty_port()
    code = "import serial, sys; p = serial.Serial(sys.argv[1], exclusive=True); input(print('on'))"
    with subprocess.Popen([sys.executable, "-c", code, port], stdin=subprocess.PIPE,
                          stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout.readline()
        (cause,), _ = doctor("--port", port)
        holder.communicate("\n")
    assert cause.endswith(f"(pid {holder.pid})")
    assert "it is in use by python" in cause


def test_silence(monkeypatch, doctor):
    VirtualLink.answering(monkeypatch, b"")
    wrong, _ = doctor("--port", VirtualLink.PORT)
    assert wrong == ["no sensor answers, at no address and no baud rate"]


def test_noise(bench):
    port, master = bench.empty_port()
    ended = threading.Event()

    def talk():
        while not ended.is_set():
            os.write(master, b"\x55" * 16)
            ended.wait(0.02)

    talker = threading.Thread(target=talk)
    talker.start()
    try:
        findings = list(serial_port._examine_line(SerialPlace(port)))
    finally:
        ended.set()
        talker.join()
    (noise,) = (finding for finding in findings if finding.is_wrong)
    assert noise.cause.startswith("bytes arrive that nobody asked for (")


def test_answers_that_are_no_frames(monkeypatch, doctor):
    VirtualLink.answering(monkeypatch, b"\xa5\x5a\x00\x81\x7e\x33\x44\x55", 115200)
    wrong, _ = doctor("--port", VirtualLink.PORT)
    assert wrong == ["bytes arrive that are no iSYS frames"]


@pytest.mark.parametrize(("words", "cause"), [
    (["--address", "9"], "a sensor answers at address 30"),
    (["--baud", "115200"], "a sensor answers at 9600 Bd, not at 115200"),
    (["--family", "uc4000"],
     "iSYS-4003 answers, which is no Pepperl+Fuchs UC4000 ultrasonic sensor")])
def test_another_sensor_than_the_one_that_is_wanted(monkeypatch, doctor, words, cause):
    VirtualLink.radars(monkeypatch, ("iSYS-4003", 30))
    wrong, _ = doctor("--port", VirtualLink.PORT, *words)
    assert wrong == [cause]


def test_several_sensors_with_one_address(monkeypatch, doctor):
    VirtualLink.ultrasonic_sensors(monkeypatch, 1, 4, 4)
    wrong, well = doctor("--port", VirtualLink.PORT)
    assert wrong == ["only damaged answers come from address 4"]
    assert any("address 1" in cause for cause in well)


@pytest.mark.parametrize("family", ["radars", "ultrasonic_sensors"])
def test_an_own_echo_is_told_but_not_wrong(monkeypatch, doctor, family):
    wanted = ("iSYS-4001", 30) if family == "radars" else 4
    made = getattr(VirtualLink, family)(monkeypatch, wanted)
    (made[0] if family == "radars" else made).echo = True
    wrong, well = doctor("--port", VirtualLink.PORT)
    assert not wrong
    assert "the line returns what is sent" in well


def test_an_echo_without_an_answer_shows_how_far_the_line_is_right(monkeypatch, doctor):
    VirtualLink.answering(monkeypatch, b"").echo = True
    wrong, well = doctor("--port", VirtualLink.PORT)
    assert wrong == ["the line returns what is sent, so it is right up to there"]
    assert well.count("the line returns what is sent") == 1


@pytest.mark.parametrize(("milliseconds", "causes"), [
    ("16", [(True, "its driver hands over what it received only every 16 ms")]), ("1", []),
    ("?", [(False, "its driver has no mode of low latency")])])  # true of a pseudo-terminal
def test_an_adapter_that_holds_bytes_back(bench, monkeypatch, tmp_path, milliseconds, causes):
    port, _ = bench.empty_port()
    device = tmp_path / port.rpartition("/")[2] / "device"
    device.mkdir(parents=True)
    (device / "latency_timer").write_text(milliseconds)
    monkeypatch.setattr(serial_port, "TTYS", tmp_path)
    found = [one for one in serial_port._examine_line(SerialPlace(port)) if one.check == "latency"]
    assert [(one.is_wrong, one.cause) for one in found] == causes


def test_a_port_that_vanishes_meanwhile(bench, monkeypatch):
    port, _ = bench.empty_port()

    def vanish(*_):
        raise serial.SerialException("device reports readiness to read but returned no data")

    monkeypatch.setattr(serial.Serial, "read", vanish)
    findings = list(serial_port.examine(SerialPlace(port), Wanted(None), Progress()))
    assert findings[-1].cause.startswith(f"lost {port}: ")


# --- CAN ---------------------------------------------------------------------------------------

def test_a_healthy_bus_has_nothing(bench, doctor):
    network, words = bench.network("One")
    wrong, well = doctor(*words)
    assert not wrong
    assert f'STH "One" at address {network.sensors[0].mac}, -52 dBm' in well


def test_no_unit_no_sensor_another_sensor(bench, doctor):
    network, words = bench.network("One")
    wrong, _ = doctor(*words, "--name", "Two")
    assert wrong == [
        "the sensor Two is not in range of the stationary unit (in range: STH \"One\" at address "
        f"{network.sensors[0].mac})"]
    network.sensors[0].in_range = False
    network.power_loss(network.stu)
    deadline = time.monotonic() + 30
    while (wrong := doctor(*words)[0]) != ["no sensor is in range of the stationary unit"]:
        assert time.monotonic() < deadline, wrong  # it starts up
    network.faults.silent = True
    assert doctor(*words)[0] == ["no stationary unit answers"]


def test_a_bus_that_is_not_there(doctor):
    wrong, _ = doctor("--can", "can0")
    assert wrong[0].startswith("cannot open socketcan can0: ")
    wrong, _ = doctor("--can", "can0", "--can-interface", "socketcand", "--can-option",
                      "host=127.0.0.1", "--can-option", "port=1")
    assert wrong == ["cannot open socketcand can0 at 127.0.0.1:1: nothing listens there"]


def test_a_bus_that_is_down(doctor, monkeypatch):
    def bus(**_):
        raise OSError(errno.ENETDOWN, "Network is down")

    monkeypatch.setattr(can, "Bus", bus)
    assert doctor("--can", "can0")[0] == ["cannot open socketcan can0: it is down"]


@needs_errors_of_socketcand
def test_error_frames(bench, doctor):
    network, words = bench.network("One")
    for number in range(100):
        network.send(CanFrame(0x04, bytes(8), error=True), time.monotonic() + 0.02 * number)
    wrong, _ = doctor(*words)
    assert any("error frames in 0.5 s" in cause for cause in wrong)


def link(**data):
    """Return what 'ip -json -details link show' says of a CAN channel."""
    return json.dumps([{"ifname": "can0", "linkinfo": {"info_kind": "can", "info_data": data}}])


@pytest.fixture
def fake_ip(tmp_path, monkeypatch):
    """Let a program called ip print something."""
    def answer(text, code=0):
        program = tmp_path / "ip"
        program.write_text(f"#!/bin/sh\ncat <<'EOF'\n{text}\nEOF\nexit {code}\n")
        program.chmod(0o755)
        monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")

    return answer


@pytest.mark.parametrize(("text", "code", "causes"), [
    (link(state="ERROR-ACTIVE", bittiming={"bitrate": 500000}), 0,
     ["it runs at 500000 bit/s, not at 1000000"]),
    (link(state="BUS-OFF", bittiming={"bitrate": 1000000}), 0, ["it is bus-off"]),
    (link(state="ERROR-ACTIVE", bittiming={"bitrate": 1000000}), 0, []),
    (link(), 0, []), ("[]", 0, []), ("nonsense", 0, []), ("", 1, [])])
def test_what_the_kernel_says_of_a_controller(fake_ip, text, code, causes):
    fake_ip(text, code)
    findings = list(can_bus._examine_controller(CanPlace("can0")))
    assert [finding.cause for finding in findings if finding.is_wrong] == causes


def test_a_small_receive_buffer(bench, monkeypatch):
    _, words = bench.network()
    monkeypatch.setattr(icotronic, "RANGE_TIME", 0.3)
    monkeypatch.setattr("icotronic_driver.line.Line.buffer_warning",
                        "the kernel keeps only 208 KiB; 'sudo sysctl …' allows more")
    where = CanPlace(words[1], words[3], options=(words[5], words[7]))
    findings = list(can_bus.examine(where, Wanted(where), Progress()))
    assert [one.cause for one in findings if one.is_wrong] == ["the kernel keeps only 208 KiB"]


# --- ROS ---------------------------------------------------------------------------------------

@pytest.mark.parametrize(("environment", "causes"), [
    ({}, []), ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, []),
    ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}, [(True, "ROS_AUTOMATIC_DISCOVERY_RANGE is OFF")]),
    ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}, [(False, "nodes of other computers")]),
    ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "LAN"},
     [(True, "ROS_AUTOMATIC_DISCOVERY_RANGE is 'LAN', which ROS does not know")]),
    ({"ROS_LOCALHOST_ONLY": "1"}, [(True, "ROS_LOCALHOST_ONLY is set")]),
    ({"ROS_LOCALHOST_ONLY": "0"}, [])])
def test_variables_that_limit_discovery(environment, causes):
    findings = list(middleware.examine_discovery(environment))
    assert len(findings) == len(causes)
    for finding, (is_wrong, cause) in zip(findings, causes, strict=True):
        assert finding.is_wrong is is_wrong
        assert finding.cause.startswith(cause)


def test_nodes_of_the_same_name():
    context = rclpy.Context()
    rclpy.init(context=context)
    nodes = [rclpy.create_node(name, namespace="/cart", context=context)
             for name in ("radar", "radar", "other")]
    causes, deadline = [], time.monotonic() + 40
    try:
        while not causes and time.monotonic() < deadline:  # they are discovered
            causes = [one.cause for one in middleware.examine() if one.check == "names"]
    finally:
        for node in nodes:
            node.destroy_node()
        rclpy.shutdown(context=context)
    assert causes == ["2 nodes have the name /cart/radar"]


@pytest.fixture
def recorder():
    """Start something that looks like 'ros2 bag record'."""
    started = []

    def start(*words):
        started.append(subprocess.Popen(
            [sys.executable, "-c", "input(print('on', flush=True))", "/opt/ros/bin/ros2", "bag",
             "record", *words], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True))
        assert started[-1].stdout.readline()
        return started[-1].pid

    yield start
    for process in started:
        process.communicate("\n")


TOPIC = "/icotronic/imu/data_raw"


@pytest.mark.parametrize(("words", "depth", "is_shallow"), [
    (["-a"], 0, True), (["--topics", TOPIC], 0, True), (["/other"], 0, False),
    (["-a", "--qos-profile-overrides-path", "{file}"], 10_000, False),
    (["-a", "--qos-profile-overrides-path={file}"], 50, True),
    (["-a", "--qos-profile-overrides-path", "/missing.yaml"], 0, True)])
def test_a_recorder_with_too_shallow_a_queue(recorder, tmp_path, words, depth, is_shallow):
    file = tmp_path / "qos.yaml"
    file.write_text(f"{TOPIC}: {{history: keep_last, depth: {depth}}}\n")
    pid = recorder(*(word.format(file=file) for word in words))
    findings = [one for one in middleware.examine_recorders([TOPIC, "/rosout"])
                if f"(pid {pid})" in one.cause]
    assert [f"keeps {depth or 10} messages of {TOPIC}" in one.cause for one in findings] == (
        [True] if is_shallow else [])


def test_everything_is_looked_at_where_nothing_is_named(doctor, monkeypatch):
    monkeypatch.setattr("sensor_tools.cli.doctor.all_places", list)
    monkeypatch.setattr(middleware, "DISCOVERY_TIME", 0.1)
    wrong, well = doctor()
    assert wrong[0] == "it has no serial port and no CAN channel"
    assert any(cause.startswith("domain ") for cause in well)
    assert not any(cause.startswith("domain ") for cause in doctor("--no-ros")[1])


def test_all_ports_and_channels_are_places(monkeypatch):
    from sensor_tools.search import place

    monkeypatch.setattr(place.list_ports, "comports",
                        lambda: [SimpleNamespace(device="/dev/ttyUSB1"),
                                 SimpleNamespace(device="/dev/ttyUSB0")])
    monkeypatch.setattr(place, "can_channels", lambda: ["can0"])
    assert place.all_places() == [SerialPlace("/dev/ttyUSB0"), SerialPlace("/dev/ttyUSB1"),
                                  CanPlace("can0")]
