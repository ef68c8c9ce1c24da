# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Nodes as processes of their own, and a ROS node in the test that talks to them.

    with Ros() as ros, NodeProcess("isys_radar_driver.program", {"serial_port": port}) as process:
        radar = ros.remote("/isys_radar")
        points = radar.subscribe(PointCloud2, "points")
        ros.wait_until(lambda: points)
        assert radar.set("output1.range_max", 20.0).successful
        process.stop()

Nothing sleeps for a fixed time: whoever waits does so until something happens, at most `DEADLINE`.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from typing import NamedTuple

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from forked import Forked
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions
from std_srvs.srv import Trigger

PATIENCE = 5.0  # s for a program that is to end
DEADLINE = 60.0  # s; far more than anything takes, also on a busy machine
# The tests wait for diagnostics, and a busy machine may take its time to stop a device.
BEFORE = ("import driver_common.diagnostics as d, driver_common.program as p; "
          f"d.PERIOD = 0.1; p.STOP_TIME = {DEADLINE}")
# A test run that is killed must leave no node behind that holds a port (prctl(2)).
END_WITH_PARENT = "import ctypes; ctypes.CDLL(None).prctl(1, 15)"
TRANSITIONS = {
    "configure": Transition.TRANSITION_CONFIGURE, "cleanup": Transition.TRANSITION_CLEANUP,
    "activate": Transition.TRANSITION_ACTIVATE, "deactivate": Transition.TRANSITION_DEACTIVATE}


class Process:
    """A program of this package that runs by itself; all it prints is collected.

    Args:
        module: Module whose `main` is the program.
        arguments: Its arguments.
        before: Code to run before.
        within: Command that runs the program elsewhere, such as in a network namespace.
        env: What its environment has beside that of the test.
        forked: Whether it starts without importing; see `Forked`.
    """

    def __init__(self, module, *arguments, before="", within=(), env=None, forked=False):
        self.lines = []
        self._news = threading.Condition()
        code = f"{END_WITH_PARENT}\n{before}\nfrom {module} import main; main()"
        env = {**os.environ, "PYTHONUNBUFFERED": "1", **(env or {})}
        self._process = Forked(code, arguments, env) if forked else subprocess.Popen(
            [*within, sys.executable, "-c", code, *arguments], env=env, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.terminate()  # so that a node tells the others that it leaves
        try:
            self._process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._reader.join()
        self._process.stdout.close()
        self._process.stdin.close()

    def _read(self):
        for line in self._process.stdout:
            with self._news:
                self.lines.append(line.rstrip("\n"))
                self._news.notify_all()

    @property
    def log(self):
        """All that was printed until now."""
        return "\n".join(self.lines)

    @property
    def number(self):
        """Number of the process."""
        return self._process.pid

    def tell(self, line):
        """Write a line to the standard input of the program."""
        print(line, file=self._process.stdin, flush=True)

    def wait_for_line(self, text, start=0):
        """Return the first line with this text, from line number `start` on."""
        with self._news:
            if not self._news.wait_for(lambda: text in "\n".join(self.lines[start:]), DEADLINE):
                pytest.fail(f"{text!r} was not printed:\n{self.log}")
            return next(line for line in self.lines[start:] if text in line)

    def wait(self):
        """Return the exit code once the program has ended by itself."""
        try:
            code = self._process.wait(DEADLINE)
        except subprocess.TimeoutExpired:
            pytest.fail(f"it does not end:\n{self.log}")
        self._reader.join()
        return code

    def suspend(self, condition):
        """Suspend the program until a condition is true."""
        self._process.send_signal(signal.SIGSTOP)
        deadline = time.monotonic() + DEADLINE
        while not condition() and time.monotonic() < deadline:
            time.sleep(0.01)
        self._process.send_signal(signal.SIGCONT)
        assert condition(), "it does not happen"

    def stop(self, number=signal.SIGINT):
        """Send a signal; the program ends well and tells of no error in its code."""
        self._process.send_signal(number)
        assert self.wait() == 0, self.log
        assert "Traceback" not in self.log, self.log
        assert "internal error" not in self.log, self.log


class NodeProcess(Process):
    """A node that runs as its user would run it, but with what `BEFORE` changes.

    It is forked, as far as it runs here.

    Args:
        module: Module whose `main` runs the node.
        parameters: Values for `-p`.
        arguments: More ROS arguments, for example "-r", "__ns:=/left".
        how: As for a Process.
    """

    def __init__(self, module, parameters=None, *arguments, **how):
        for name, value in (parameters or {}).items():
            arguments += "-p", f"{name}:={json.dumps(value)}"
        super().__init__(module, "--ros-args", *arguments, before=BEFORE,
                         forked="within" not in how, **how)


class Status(NamedTuple):
    """One status of the diagnostics, its values as a dictionary."""

    level: int
    message: str
    hardware_id: str
    values: dict[str, str]


class Ros:
    """A ROS node in the test; it does something only while the test waits."""

    def __init__(self):
        self._context = Context()
        rclpy.init(context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        self.node = rclpy.create_node("test", context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._subscriptions = []
        self._statuses = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        # Fast DDS can hang here while another participant leaves; the test is over by then.
        leaving = threading.Thread(target=self._leave, daemon=True)
        leaving.start()
        leaving.join(PATIENCE)

    def _leave(self):
        self._executor.shutdown()
        self.node.destroy_node()
        rclpy.try_shutdown(context=self._context)

    def wait_until(self, condition):
        """Return what the condition gives, once that is true."""
        result = self.wait(condition, DEADLINE)
        assert result, "it does not happen"
        return result

    def wait(self, condition, seconds):
        """Return what the condition gives, once that is true or the time is over."""
        deadline = time.monotonic() + seconds
        while not (result := condition()) and time.monotonic() < deadline:
            self._executor.spin_once(timeout_sec=0.05)
        return result

    def subscribe(self, kind, topic, depth=1000):
        """Return a list which receives every message from now on."""
        messages = []
        self._subscriptions.append(self.node.create_subscription(
            kind, topic, messages.append, QoSProfile(depth=depth)))
        return messages

    def forget(self):
        """End all subscriptions, so that they do not take time in the next test."""
        for subscription in self._subscriptions:
            self.node.destroy_subscription(subscription)
        self._subscriptions.clear()
        self._statuses = None

    def wait_for_status(self, name, condition=lambda status: True):
        """Return the first diagnostics from now on with this name and the condition."""
        if self._statuses is None:
            self._statuses = self.subscribe(DiagnosticArray, "/diagnostics")
        self._statuses.clear()

        def wanted():
            for array in self._statuses:
                for raw in array.status:
                    status = Status(ord(raw.level), raw.message, raw.hardware_id,
                                    {pair.key: pair.value for pair in raw.values})
                    if raw.name == name and condition(status):
                        return status
            return None

        return self.wait_until(wanted)

    def remote(self, name):
        """Return a handle of another node."""
        return RemoteNode(self, name)


class RemoteNode:
    """Another node: its parameters, topics, services and states."""

    def __init__(self, ros, name):
        self.ros = ros
        self.name = name
        self._clients = {}

    def subscribe(self, kind, topic):
        """Return a list which receives every message of a topic of the node."""
        return self.ros.subscribe(kind, f"{self.name}/{topic}")

    def names(self):
        """Return the names of all parameters."""
        return set(self._call(ListParameters, "list_parameters").result.names)

    def get(self, *names):
        """Return the value of a parameter, or a list of several."""
        values = [parameter_value_to_python(value) for value in self._call(
            GetParameters, "get_parameters", names=list(names)).values]
        return values if len(names) > 1 else values[0]

    def describe(self, *names):
        """Return the descriptor of a parameter, or a list of several."""
        descriptors = self._call(
            DescribeParameters, "describe_parameters", names=list(names)).descriptors
        return descriptors if len(names) > 1 else descriptors[0]

    def set(self, name, value):
        """Set a parameter and return the result."""
        return self.set_raw(Parameter(name, value=value).to_parameter_msg())

    def set_raw(self, parameter):
        """Set a parameter, given as a message, and return the result."""
        return self._call(SetParameters, "set_parameters", parameters=[parameter]).results[0]

    def set_atomically(self, values):
        """Set all parameters or none, and return the result."""
        return self._call(SetParametersAtomically, "set_parameters_atomically", parameters=[
            Parameter(name, value=value).to_parameter_msg() for name, value in values.items()
        ]).result

    def trigger(self, service):
        """Call a service without arguments and return its response."""
        return self._call(Trigger, service)

    def state(self):
        """Return the name of the node's state."""
        return self._call(GetState, "get_state").current_state.label

    def change_state(self, transition):
        """Carry out a transition and return whether it succeeded."""
        return self.change_state_by_number(TRANSITIONS[transition])

    def change_state_by_number(self, number):
        """As change_state, with the number of the transition."""
        return self._call(ChangeState, "change_state", transition=Transition(id=number)).success

    def begin_set(self, name, value):
        """Begin to set a parameter and return the future of the response."""
        return self._begin(SetParameters, "set_parameters", parameters=[
            Parameter(name, value=value).to_parameter_msg()])

    def begin_change_of_state(self, transition):
        """Begin a transition and return the future of the response."""
        return self._begin(ChangeState, "change_state",
                           transition=Transition(id=TRANSITIONS[transition]))

    def _call(self, kind, service, **fields):
        future = self._begin(kind, service, **fields)
        self.ros.wait_until(future.done)
        return future.result()

    def _begin(self, kind, service, **fields):
        if service not in self._clients:
            self._clients[service] = self.ros.node.create_client(kind, f"{self.name}/{service}")
            self._meet()
        self.ros.wait_until(self._clients[service].service_is_ready)
        return self._clients[service].call_async(kind.Request(**fields))

    def _meet(self):
        """Wait until the node knows our newest client; before, its response could get lost.

        Clients become known in the order in which they were made, and a question can be repeated.
        """
        client = self.ros.node.create_client(GetParameters, f"{self.name}/get_parameters")
        answers = []

        def ask_again():
            if client.service_is_ready():
                answers.append(client.call_async(GetParameters.Request()))
            return self.ros.wait(lambda: any(answer.done() for answer in answers), 0.5)

        self.ros.wait_until(ask_again)
        self.ros.node.destroy_client(client)
