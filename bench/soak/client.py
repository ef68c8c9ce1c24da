# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A client of the nodes: parameters and transitions."""

from __future__ import annotations

import threading
import time
from typing import Any

import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter

from bench.measure import Failure

ANSWER_TIME = 10.0  # s in which any request must be answered
MEET_TIME = 60.0  # s until node and client must have found each other
TRANSITIONS = {
    "configure": Transition.TRANSITION_CONFIGURE, "cleanup": Transition.TRANSITION_CLEANUP,
    "activate": Transition.TRANSITION_ACTIVATE, "deactivate": Transition.TRANSITION_DEACTIVATE}


class Clients:
    """The ROS node in this process through which all clients talk; a context manager."""

    def __init__(self) -> None:
        """Create it; rclpy has been initialised."""
        self.node = rclpy.create_node("soak", enable_rosout=False)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._executor.spin, daemon=True)

    def __enter__(self) -> Clients:
        """Serve it."""
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """End."""
        self._executor.shutdown(timeout_sec=5.0)
        self.node.destroy_node()


class Client:
    """A client of one node."""

    def __init__(self, clients: Clients, node: str) -> None:
        """Prepare the services; `meet` must be called before others are."""
        self._node = node
        self._services = {kind: clients.node.create_client(kind, f"{node}/{name}")
                          for kind, name in ((SetParametersAtomically, "set_parameters_atomically"),
                                             (ChangeState, "change_state"),
                                             (GetState, "get_state"))}

    def meet(self) -> None:
        """Wait until the node answers; before, an answer can get lost. Raises Failure."""
        end = time.monotonic() + MEET_TIME
        while time.monotonic() < end:
            if all(service.service_is_ready() for service in self._services.values()):
                try:
                    self._call(GetState, 1.0)
                except Failure:
                    continue
                return
            time.sleep(0.05)
        raise Failure(f"{self._node} does not answer")

    def set(self, name: str, value: Any) -> str:
        """Set a parameter; return why it is refused, "" if it is not. Raises Failure."""
        parameter = Parameter(name, value=value).to_parameter_msg()
        result = self._call(SetParametersAtomically, parameters=[parameter]).result
        return "" if result.successful else result.reason or "without a reason"

    def change(self, transition: str) -> str:
        """Carry out a transition; return why it is refused, "" if it is not. Raises Failure."""
        wanted = Transition(id=TRANSITIONS[transition])
        return "" if self._call(ChangeState, transition=wanted).success else "refused"

    def _call(self, kind: Any, timeout: float = ANSWER_TIME, **fields: Any) -> Any:
        done = threading.Event()
        future = self._services[kind].call_async(kind.Request(**fields))
        future.add_done_callback(lambda _: done.set())
        if not done.wait(timeout):
            future.cancel()
            raise Failure(f"{self._node} does not answer {kind.__name__} within {timeout:g} s")
        return future.result()
