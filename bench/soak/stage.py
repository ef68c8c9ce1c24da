# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""All drivers at once: they run, what they publish is received and judged, and they end."""

from __future__ import annotations

import contextlib
import os
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import Log
from rclpy.serialization import deserialize_message

from bench.measure import Failure, Process
from bench.soak.client import Client, Clients
from bench.soak.lane import SORTS, Lane, Sort
from bench.soak.watch import LEVELS, Line, Status
from sensor_tools.demo.families import Topic, seconds_of
from sensor_tools.demo.machine import Machine
from sensor_tools.demo.recorder import Channel, Recorder

POLL_TIME = 0.02  # s
START_TIME = 60.0  # s in which each driver must publish something
SETTLE_TIME = 5.0  # s that the streams' clocks get in the beginning
LAST_TIME = 45.0  # s in which all must be OK in the end: some warnings are about the last 30 s
WINDOW = 5.0  # s whose values are judged together, so much later
LATE = 1.0  # s that a machine may be late with its notes
NOTES = 200  # lines of its heartbeat; it says something every 0.25 s
HEARTBEAT = "sensor_tools.demo.heartbeat:main"
SHARED = (Topic("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", 1.0),
          Topic("/rosout", "rcl_interfaces/msg/Log", 1.0))


def sorts_with(word: str) -> list[Sort]:
    """Return what has faults with a word in their name."""
    return [sort for sort in SORTS if sort.faults(word)]


class Stage:
    """The drivers with their simulators, and all that looks at them; a context manager.

    Attributes:
        lanes: One for each driver.
    """

    def __init__(self, sorts: Sequence[Sort], directory: Path) -> None:
        """Prepare; nothing runs yet."""
        self.lanes: list[Lane] = []
        self._sorts, self._directory = sorts, directory
        self._news = threading.Condition()
        self._stack = contextlib.ExitStack()
        self._pending: dict[str, list[bytes]] = {sort.topic.name: [] for sort in sorts}
        self._notes: list[str] = []
        self._programs: list[str] = []
        self._window_began = 0.0
        self._ended = threading.Event()

    def __enter__(self) -> Stage:
        """Start all; raises Failure."""
        try:
            self._recorder = self._stack.enter_context(
                Recorder([*(sort.topic for sort in self._sorts), *SHARED], None))
            clients = self._stack.enter_context(Clients())
            self._started = time.time()
            for sort in self._sorts:
                self.lanes.append(self._stack.enter_context(
                    Lane(sort, self._directory, self._news, self._started)))
                self.lanes[-1].client = Client(clients, sort.node)
            numbers = {name: number for lane in self.lanes
                       for name, number in lane.processes.items()}
            self._programs = ["soak", *numbers]
            self._heartbeat = self._stack.enter_context(
                Process(HEARTBEAT, os.getpid(), *numbers.values()))
        except BaseException:
            self._stack.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        """End all."""
        self._stack.close()

    def run(self, seconds: float, word: str, seed: int) -> None:
        """Have faults come for a time, then wait until all is well; raises Failure."""
        self._await_first_data()
        for lane in self.lanes:
            assert lane.client is not None
            lane.client.meet()
        self._settle()
        end = time.monotonic() + seconds
        threads = [threading.Thread(target=self._run_lane, args=(lane, word, seed, end))
                   for lane in self.lanes]
        judge = threading.Thread(target=self._run_judge)
        for thread in (*threads, judge):
            thread.start()
        try:
            while any(thread.is_alive() for thread in threads):
                self._poll()
            self._await_all_well()
        finally:
            self._ended.set()
            judge.join()
        self._judge(time.time())

    def _run_lane(self, lane: Lane, word: str, seed: int, end: float) -> None:
        try:
            lane.run(lane.sort.faults(word), seed,
                     lambda: self._ended.is_set() or time.monotonic() > end)
        except (Failure, OSError) as error:
            lane.program.trouble.append(str(error))

    def _await_first_data(self) -> None:
        self._recorder.start()
        end = time.monotonic() + START_TIME
        while not all(lane.watch.received for lane in self.lanes):
            self._poll()
            for lane in self.lanes:
                if time.monotonic() > end and not lane.watch.received:
                    raise lane.node.failure("published nothing")

    def _settle(self) -> None:
        """Let the streams settle, on a machine that was busy with starting them."""
        end = time.monotonic() + SETTLE_TIME
        while time.monotonic() < end:
            self._poll()
        for messages in self._pending.values():
            messages.clear()

    def _await_all_well(self) -> None:
        end = time.monotonic() + LAST_TIME
        while time.monotonic() < end and any(lane.watch.level() for lane in self.lanes):
            self._poll()
        for lane in self.lanes:
            if lane.watch.level():
                last = lane.watch.statuses[-1].message if lane.watch.statuses else "nothing"
                lane.program.trouble.append(
                    f"in the end its diagnostics say {LEVELS[lane.watch.level()]}: {last}")
        for lane in self.lanes:
            lane.note_usage()

    # --- what comes ---

    def _poll(self) -> None:
        """Take what has come, and tell the lanes."""
        time.sleep(POLL_TIME)
        self._recorder.poll()
        with self._news:
            for channel in self._recorder.channels:
                self._take(channel)
            self._news.notify_all()

    def _take(self, channel: Channel) -> None:
        messages = list(channel.kept)
        channel.kept.clear()
        if channel.topic.name in self._pending:
            self._pending[channel.topic.name] += messages
            for lane in self.lanes:
                if lane.sort.topic == channel.topic:
                    lane.watch.add_stamps([Channel.stamp_of(data) for data in messages])
        elif channel.topic == SHARED[0]:
            for data in messages:
                self._take_diagnostics(deserialize_message(data, DiagnosticArray))
        else:
            for data in messages:
                self._take_log(deserialize_message(data, Log))

    def _take_diagnostics(self, array: Any) -> None:
        for status in array.status:
            for lane in self.lanes:
                if status.name.startswith(f"{lane.sort.node.lstrip('/')}: "):
                    lane.watch.add_status(Status(
                        seconds_of(array), ord(status.level), status.message,
                        {pair.key: pair.value for pair in status.values}))

    def _take_log(self, line: Any) -> None:
        moment = line.stamp.sec + 1e-9 * line.stamp.nanosec
        for lane in self.lanes:
            if line.name == lane.sort.node.strip("/").replace("/", "."):
                lane.watch.log.append(Line(moment, line.msg))

    # --- whether it is true ---

    def _run_judge(self) -> None:
        """Judge the values of some seconds at a time, beside what receives them."""
        self._window_began = time.time()
        while not self._ended.wait(WINDOW):
            self._judge(time.time() - LATE)

    def _judge(self, until: float) -> None:
        """Judge all values that were measured until a moment."""
        machine = self._machine()
        for lane in self.lanes:
            with self._news:
                pending = self._pending[lane.sort.topic.name]
                count = sum(1 for data in pending if Channel.stamp_of(data) < until)
                messages, self._pending[lane.sort.topic.name] = pending[:count], pending[count:]
            wrong = None if len(messages) < 2 else lane.sort.judge(
                messages, machine.of(lane.processes), lane.lag(self._window_began))
            if wrong is not None:
                lane.note_wrong(wrong)
        self._window_began = until

    def _machine(self) -> Machine:
        """Return what the machine did until now."""
        self._notes = [*self._notes, *self._heartbeat.said()][-NOTES:]
        return Machine.of_lines(self._notes, self._programs)
