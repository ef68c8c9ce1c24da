# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The demonstration as its user sees it: what it prints, what it leaves, and what it does not."""

import contextlib
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from sensor_tools.demo import views

rosbags = pytest.importorskip(
    "rosbags.highlevel", reason="rosbags is not installed; Ubuntu 24.04 has no package of it")

ROOT = Path(__file__).resolve().parent.parent.parent
DEADLINE = 200  # seconds
TOPICS = {
    "/isys_radar/points": "sensor_msgs/msg/PointCloud2",
    "/icotronic/imu/data_raw": "sensor_msgs/msg/Imu",
    "/uc4000/range": "sensor_msgs/msg/Range",
    "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
}
# Without the sensor that keeps the machine busy.
QUICK = ("from sensor_tools.demo import families, program; "
         "main = lambda: program.main(families=families.FAMILIES[::2])")
QUICK_PROCESSES = 2 * 2 + 1  # a simulator and a driver for each family, and the heartbeat
PNG = b"\x89PNG\r\n\x1a\n"


class Demo:
    """Runs the demonstration in a directory of its own."""

    def __init__(self, directory):
        self.directory = directory
        self.temporary = directory / "tmp"
        self.temporary.mkdir()
        self.process = None

    def start(self, *arguments, code="from sensor_tools.demo.program import main"):
        path = os.pathsep.join(
            filter(None, (str(ROOT), str(self.directory), os.environ.get("PYTHONPATH")))
        )
        environment = {**os.environ, "TMPDIR": str(self.temporary), "PYTHONPATH": path}
        del environment["ROS_DOMAIN_ID"]  # it takes one of its own
        self.process = subprocess.Popen(
            [sys.executable, "-c", f"{code}; import sys; sys.exit(main())", *arguments],
            cwd=self.directory,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        return self.process

    def run(self, *arguments, **options):
        self.start(*arguments, **options)
        output, errors = self.process.communicate(timeout=DEADLINE)
        return self.process.returncode, output, errors

    def wait_for_line(self, text):
        for line in self.process.stdout:
            if text in line:
                return
        pytest.fail(f"{text!r} was not printed:\n{self.process.stderr.read()}")

    def children(self):
        """Command lines of running processes that this demonstration started."""
        marker = f"TMPDIR={self.temporary}".encode()
        found = []
        for process in Path("/proc").glob("[0-9]*"):
            with contextlib.suppress(OSError):
                if (int(process.name) != self.process.pid
                        and marker in (process / "environ").read_bytes().split(b"\0")):
                    found.append((process / "cmdline").read_bytes().replace(b"\0", b" ").decode())
        return found

    def assert_nothing_is_left(self):
        assert self.children() == []
        assert list(self.temporary.iterdir()) == []


@pytest.fixture
def demo(tmp_path):
    demo = Demo(tmp_path)
    yield demo
    if demo.process is not None:
        demo.process.kill()
        demo.process.communicate()


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A demonstration that ran to its end, with its exit code, output and errors."""
    demo = Demo(tmp_path_factory.mktemp("demo"))
    return demo, *demo.run("--duration", "4", "--bag", "recording")


def summary(output):
    """Return type and count of each topic, from the last lines of the output."""
    rows = re.findall(r"^(/\S+) +(\S+) +(\d+) messages +[\d.]+ per second$", output, re.MULTILINE)
    return {name: (kind, int(count)) for name, kind, count in rows}


def recorded(bag):
    """Return type and count of each topic in a bag, after reading every message."""
    with rosbags.AnyReader([bag]) as reader:
        counts = dict.fromkeys(reader.topics, 0)
        for connection, stamp, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            sent = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
            assert sent <= 1e-9 * stamp + 1e-6  # recorded when it came
            counts[connection.topic] += 1
        return {name: (reader.topics[name].msgtype, count) for name, count in counts.items()}


def test_it_lives_before_it_loads_what_takes_long(demo):
    code, output, errors = demo.run(code="import sys; sys.modules.update(rclpy=None, numpy=None); "
                                         "from sensor_tools.demo.program import main")
    assert (code, len(output.splitlines())) == (1, 1)
    assert "is ROS 2 Jazzy sourced?" in errors


def test_two_at_once_have_a_domain_each():
    code = "from sensor_tools.ros_domain import claim_domain; print(claim_domain(), flush=True)"
    runs = [subprocess.Popen([sys.executable, "-c", f"{code}; input()"], cwd=ROOT, text=True,
                             stdin=subprocess.PIPE, stdout=subprocess.PIPE) for _ in range(3)]
    domains = [int(run.stdout.readline()) for run in runs]
    for run in runs:
        run.communicate("\n")
    assert len({*domains, int(os.environ["ROS_DOMAIN_ID"])}) == 4
    assert all(0 < domain <= 100 for domain in domains)


def test_it_succeeds_and_says_what_came(finished):
    _, code, output, errors = finished
    assert (code, errors) == (0, "")
    counts = summary("\n".join(output.splitlines()[-len(TOPICS):]))
    assert {name: kind for name, (kind, _) in counts.items()} == TOPICS
    assert all(count > 0 for _, count in counts.values())
    assert len(re.findall(r"\d+ of \d+ values are as near to the truth", output)) == 3


def test_the_bag_holds_what_came(finished):
    demo, _, output, _ = finished
    assert recorded(demo.directory / "recording") == summary(output)


def test_the_bag_is_one_of_jazzy(finished):
    demo, *_ = finished
    with rosbags.AnyReader([demo.directory / "recording"]) as reader:
        digests = {connection.msgtype: connection.digest for connection in reader.connections}
    metadata = (demo.directory / "recording" / "metadata.yaml").read_text()
    assert "version: 9" in metadata
    assert "storage_identifier: mcap" in metadata
    # As printed by "ros2 topic info --verbose".
    assert digests["sensor_msgs/msg/PointCloud2"] == (
        "RIHS01_9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5"
    )


def test_each_sensor_has_a_view(finished, tmp_path):
    demo, *_ = finished
    views.main([str(demo.directory / "recording"), str(tmp_path / "images")])
    names = {path.name for path in (ROOT / "docs" / "images").glob("*.png")}
    assert {path.name for path in (tmp_path / "images").iterdir()} == names
    for path in (tmp_path / "images").iterdir():
        assert path.read_bytes().startswith(PNG)
        assert 10_000 < path.stat().st_size < 150_000


def test_there_is_a_picture(finished):
    demo, *_ = finished
    picture = demo.directory / "recording" / "picture.png"
    assert picture.read_bytes().startswith(PNG)
    assert picture.stat().st_size > 20_000


def test_nothing_else_is_left(finished):
    demo, *_ = finished
    demo.assert_nothing_is_left()
    assert {path.name for path in demo.directory.iterdir()} == {"tmp", "recording"}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_with_what_it_has(demo, number):
    process = demo.start("--duration", "60", "--bag", "recording", code=QUICK)
    demo.wait_for_line("2 of 60 s")
    assert len(demo.children()) == QUICK_PROCESSES
    process.send_signal(number)
    output, errors = process.communicate(timeout=DEADLINE)
    assert (process.returncode, errors) == (128 + number, "")
    assert recorded(demo.directory / "recording") == summary(output)
    demo.assert_nothing_is_left()


def test_a_signal_before_the_first_message_leaves_nothing(demo):
    process = demo.start("--bag", "recording")
    demo.wait_for_line("Started")
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=DEADLINE)
    assert (process.returncode, errors) == (130, "")
    demo.assert_nothing_is_left()


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a child is not told")
def test_when_it_is_killed_its_processes_end(demo):
    process = demo.start("--duration", "60", "--bag", "recording", code=QUICK)
    demo.wait_for_line("1 of 60 s")
    process.kill()
    deadline = time.monotonic() + DEADLINE
    while demo.children() and time.monotonic() < deadline:
        time.sleep(0.1)
    assert demo.children() == []


@pytest.mark.parametrize(
    ("bag", "message"),
    [
        ("tmp", "error: tmp exists already; name another directory with --bag\n"),
        ("file/bag", "error: cannot make the bag file/bag: Not a directory\n"),
    ],
)
def test_a_bag_that_cannot_be_made_is_said_in_one_line(demo, bag, message):
    (demo.directory / "file").touch()
    code, _, errors = demo.run("--bag", bag)
    assert (code, errors) == (1, message)
    demo.assert_nothing_is_left()


FAMILY = """
import dataclasses, numpy
from sensor_tools.demo import program
from sensor_tools.demo.families import FAMILIES, Comparison, Program, Topic
from sensor_tools.demo.machine import Machine

def compare(messages, machine):
    numbers = numpy.array([message.linear_acceleration.x for message in messages])
    losses = numpy.abs(numpy.diff(numbers, prepend=numbers[0] - 1) - 1)
    times = numpy.arange(numbers.size, dtype=float)
    return Comparison("number [1]", "losses [1]", seconds=times, tracks=times.astype(int) * 0,
                      names=["x"], measured=numbers, errors=losses, tolerances=times * 0,
                      busy=times < 0, curve_seconds=times, curves=numbers[:, None])

def main():
    Machine.of_log = lambda path, programs: Machine()  # whatever it did: it excuses nothing
    family = dataclasses.replace(
        FAMILIES[0], name="fake", simulator=Program("fake", ("simulator", "{port}")),
        node=Program("fake", ("driver",)), compare=compare, panels=FAMILIES[0].panels[1:],
        topics=(Topic("/fake", "sensor_msgs/msg/Imu", RATE),))
    return program.main(families=[family])
"""
# It waits for those who read slowly.
DRIVER = """
import signal, sys, time
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Vector3
from rclpy.duration import Duration
from sensor_msgs.msg import Imu

def main():
    if sys.argv[1] == "simulator":
        signal.pause()
    rclpy.init()
    node = rclpy.create_node("fake")
    publisher = node.create_publisher(Imu, "/fake", 5000)
    diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
    start, count = time.monotonic(), 0
    while rclpy.ok():
        while count < (time.monotonic() - start) * 9524:
            if count % 4000 == 0:
                publisher.wait_for_all_acked(Duration(seconds=60))
            if count % 400 == 0:
                array = DiagnosticArray()
                array.header.stamp = node.get_clock().now().to_msg()
                diagnostics.publish(array)
            imu = Imu(linear_acceleration=Vector3(x=float(count)))
            imu.header.stamp = node.get_clock().now().to_msg()
            publisher.publish(imu)
            count += 1
        time.sleep(0.005)
"""


@pytest.fixture
def fake(demo):
    """A demonstration of a sensor whose driver is `DRIVER`, changed as the test likes."""

    def run(old="", new="", rate=0.0):
        (demo.directory / "fake.py").write_text(DRIVER.replace(old, new))
        (demo.directory / "family.py").write_text(FAMILY.replace("RATE", str(rate)))
        return demo.run("--duration", "3", code="from family import main")

    return run


def test_ten_thousand_messages_a_second_come_without_loss(fake, demo):
    code, output, errors = fake()
    assert (code, errors) == (0, "")
    assert re.search(r"fake: (\d+) of \1 values", output)
    demo.assert_nothing_is_left()


def test_a_driver_that_ends_is_named_with_its_last_lines(fake, demo):
    code, _, errors = fake("    rclpy.init()", "    sys.exit('no sensor today')")
    assert code == 1
    assert errors == "error: the fake driver has ended; its last lines:\n    no sensor today\n"
    assert [path.name for path in (demo.directory / "demo_output").iterdir()] == [".gitignore"]
    demo.assert_nothing_is_left()


def test_a_driver_that_is_too_slow_is_named(fake, demo):
    code, output, errors = fake("* 9524", "* 5000", rate=9524.0)
    assert code == 1
    had, due = re.match(r"error: /fake had (\d+) messages instead of (\d+)\n", errors).groups()
    assert int(had) < 0.6 * int(due)
    assert "last lines of the fake driver" in errors
    assert "/fake" in summary(output)
    demo.assert_nothing_is_left()


def test_wrong_measurements_are_named(fake):
    code, _, errors = fake("count += 1", "count += 2")
    assert code == 1
    assert errors == "error: the measurements of the fake do not agree with the truth\n"
