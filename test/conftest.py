# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The environment of every test. It must be in place before rclpy is first imported."""

import atexit
import functools
import os
import pathlib
import shutil
import signal
import tempfile
import zlib

import pytest

from driver_common.serial_link import SerialLink
from driver_common.simulator.line import SimulatedLine
from sensor_tools.ros_domain import claim_domain

# Fast DDS 2.14 hangs where a participant leaves in the moment in which its lease is looked at. That
# is when the lease ends, by default every 20 s. Nodes of tests say when they leave.
LEASE = """<?xml version="1.0" encoding="UTF-8"?>
<profiles xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <participant profile_name="test" is_default_profile="true">
    <rtps><builtin><discovery_config>
      <leaseDuration><sec>600</sec></leaseDuration>
      <leaseAnnouncement><sec>3</sec></leaseAnnouncement>
    </discovery_config></builtin></rtps>
  </participant>
</profiles>
"""

# A shell has programs in the background ignore it, and so would all that the tests start.
signal.signal(signal.SIGINT, signal.default_int_handler)

log_directory = tempfile.mkdtemp(prefix="ros-log-")
atexit.register(shutil.rmtree, log_directory, ignore_errors=True)

os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
os.environ["ROS_DOMAIN_ID"] = str(claim_domain())  # own to this process, also with pytest-xdist
os.environ["ROS_LOG_DIR"] = log_directory
profile = pathlib.Path(log_directory, "fastdds.xml")
profile.write_text(LEASE)
os.environ["FASTRTPS_DEFAULT_PROFILES_FILE"] = str(profile)
os.environ["ROS_PYTHON_CHECK_FIELDS"] = "1"  # a field of the wrong type is an error, not a crash


@functools.cache
def shares(path):
    """Whether the tests of a file share something that starts slowly."""
    return 'scope="module"' in path.read_text(encoding="utf-8")


def place(item):
    """Where a test comes: mixed with the others; no long one, with a limit of its own, is last."""
    if shares(item.path):
        return 0
    return zlib.crc32(item.nodeid.encode()) >> bool(item.get_closest_marker("timeout"))


def pytest_collection_modifyitems(config, items):
    """Have tests that wait run beside tests that compute: mix them where there are workers."""
    if hasattr(config, "workerinput"):
        items.sort(key=place)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Hand out tests one by one, but those of files that share something as a whole, and first."""
    from xdist.scheduler import LoadScopeScheduling

    class Scheduling(LoadScopeScheduling):
        def _split_scope(self, nodeid):
            path = nodeid.partition("::")[0]
            return path if shares(config.rootpath / path) else nodeid

    return Scheduling(config, log)


@pytest.fixture(autouse=True)
def patience(monkeypatch):
    """Have no wait for a simulated line of this process end while the machine holds that up."""
    lines = {}
    start, first_byte = SimulatedLine.start, SerialLink._first_byte

    def start_one(line):
        lines[line.port] = line
        return start(line)

    def held_up(link, line):
        while line.is_behind:
            if first := link._wait(0.002):
                return first
        return b""

    def patient_first_byte(link, timeout):
        line = lines.get(link.port)
        if line is None or not timeout:
            return first_byte(link, timeout)
        return (held_up(link, line) or first_byte(link, timeout)
                or held_up(link, line) or link._wait(0))

    monkeypatch.setattr(SimulatedLine, "start", start_one)
    monkeypatch.setattr(SerialLink, "_first_byte", patient_first_byte)


@pytest.fixture
def launch(request):
    """Start nodes of the test's MODULE with parameters and ROS arguments; killed at last."""
    from nodes import NodeProcess

    processes = []

    def launch_one(parameters=None, *arguments):
        processes.append(NodeProcess(request.module.MODULE, parameters, *arguments))
        return processes[-1]

    yield launch_one
    for process in processes:
        process.__exit__()
        print(process.log)  # for the report of a test that failed
