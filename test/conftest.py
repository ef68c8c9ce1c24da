"""The environment of every test. It must be in place before rclpy is first imported."""

import atexit
import os
import shutil
import tempfile

import pytest

log_directory = tempfile.mkdtemp(prefix="ros-log-")
atexit.register(shutil.rmtree, log_directory, ignore_errors=True)

os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
os.environ.setdefault("ROS_DOMAIN_ID", str(os.getpid() % 100 + 1))  # own to this run
os.environ["ROS_LOG_DIR"] = log_directory
os.environ["ROS_PYTHON_CHECK_FIELDS"] = "1"  # a field of the wrong type is an error, not a crash


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
