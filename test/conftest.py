"""The environment of every test. It must be in place before rclpy is first imported."""

import atexit
import os
import shutil
import tempfile

import pytest

from sensor_tools.ros_domain import claim_domain

log_directory = tempfile.mkdtemp(prefix="ros-log-")
atexit.register(shutil.rmtree, log_directory, ignore_errors=True)

os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
os.environ["ROS_DOMAIN_ID"] = str(claim_domain())  # own to this process, also with pytest-xdist
os.environ["ROS_LOG_DIR"] = log_directory
os.environ["ROS_PYTHON_CHECK_FIELDS"] = "1"  # a field of the wrong type is an error, not a crash


@pytest.hookimpl(tryfirst=True)  # before pytest-xdist looks
def pytest_collection_modifyitems(items):
    """Let tests that share something of their module run in one process (of pytest-xdist)."""
    for item in items:
        fixtures = item._fixtureinfo.name2fixturedefs.values()
        if any(definition.scope != "function" for definitions in fixtures
               for definition in definitions if definition.baseid):
            item.add_marker(pytest.mark.xdist_group(item.module.__name__))


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
