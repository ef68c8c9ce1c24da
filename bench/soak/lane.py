# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A driver, its simulator, and one fault after the other."""

from __future__ import annotations

import contextlib
import json
import os
import random
import signal
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bench.measure import Failure, Process
from bench.soak.client import TRANSITIONS, Client
from bench.soak.faults import FAULTS, Fault
from bench.soak.report import Event, Program, Usage
from bench.soak.truth import Judge, Wrong, judge_accelerations, judge_clouds, judge_ranges
from bench.soak.watch import LEVELS, Watch
from icotronic_driver.values import AdcConfiguration
from isys_radar_driver.models import FAST
from sensor_tools.demo.families import RADAR, Topic

NOTICE_TIME = 6.0  # s after its end in which a fault can be noticed yet
PATIENCE = 30.0  # s until a driver that does not recover is given up
CALM = 0.5  # s between two faults
NEWS = 0.9  # s after which the diagnostics tell what happened until now
STOP_TIME = 10.0  # s in which a node must end
PAGE = os.sysconf("SC_PAGE_SIZE")


@dataclass(frozen=True)
class Sort:
    """What is run of a driver.

    Attributes:
        driver: Its name among the simulators, and in FAULTS.
        transport: Over which the two talk.
        simulator: Arguments of the simulator.
        module: The module of the node.
        parameters: Its parameters; {port} is where the simulator is found.
        node: Name of the node, with its namespace.
        topic: What is received.
        published: The counter of the diagnostics that tells what it published.
        counters: Counters that explain missing samples.
        samples: How many samples one of the counters' counts is.
        judge: Says which of the values are wrong.
    """

    driver: str
    transport: str
    simulator: tuple[str, ...]
    module: str
    parameters: tuple[str, ...]
    node: str
    topic: Topic
    published: str
    counters: tuple[str, ...]
    samples: int
    judge: Judge

    @property
    def name(self) -> str:
        """Driver and transport."""
        return f"{self.driver} {self.transport}"

    def faults(self, word: str = "") -> list[Fault]:
        """Return what can happen to it; a word picks those whose "DRIVER/FAULT" contains it."""
        return [fault for fault in FAULTS[self.driver] if word in f"{self.name}/{fault.name}"
                and fault.transport in ("", self.transport)]


def _serial(driver: str, transport: str, simulator: tuple[str, ...], node: str, topic: str,
            kind: str, rate: float, published: str, counters: tuple[str, ...], judge: Judge,
            *parameters: str) -> Sort:
    where = ("--link", "{directory}/" + driver) if transport == "pty" else (
        "--listen", "127.0.0.1:0")
    return Sort(driver, transport, (driver, *simulator, *where), f"{node}_driver.node:main",
                ("serial_port:={port}", *parameters), f"/{transport}/{node}",
                Topic(f"/{transport}/{node}/{topic}", kind, rate), published, counters, 1, judge)


_RADAR = ("isys_radar", "points", "sensor_msgs/msg/PointCloud2", 1 / RADAR.cycle_time(FAST),
          "target lists", ("lost cycles", "implausible lists", "cycles left to others"),
          judge_clouds)
_ULTRASONIC = ("uc4000", "range", "sensor_msgs/msg/Range", 15.0, "measurements",
               ("time-outs", "checksum errors", "refusals", "damaged requests"), judge_ranges,
               "rate:=15.0")
SORTS = (
    *(_serial("isys", transport, ("--model", RADAR.name), *_RADAR) for transport in ("pty", "tcp")),
    *(_serial("uc4000", transport, (), *_ULTRASONIC) for transport in ("pty", "tcp")),
    Sort("icotronic", "tcp", ("icotronic", "--listen", "127.0.0.1:0"), "icotronic_driver.node:main",
         ("can_interface:=socketcand", "can_options:=[host=127.0.0.1, port={port}]"),
         "/tcp/icotronic",
         Topic("/tcp/icotronic/imu/data_raw", "sensor_msgs/msg/Imu",
               AdcConfiguration().sample_rate),
         "frames", ("lost frames",), 3, judge_accelerations),
)


class Lane:
    """A running driver with its simulator; a context manager.

    Attributes:
        sort: What runs.
        watch: What came of it.
        events: The faults until now.
        program: What the node used, and how it ended.
    """

    def __init__(self, sort: Sort, directory: Path, news: threading.Condition,
                 started: float) -> None:
        """Start the simulator and the node.

        Args:
            sort: What to run.
            directory: For links to pseudo-terminals.
            news: Notified whenever something came.
            started: When the soak began, in s since the epoch.
        """
        self.sort, self.watch = sort, Watch(sort.topic.rate, sort.published)
        self.events: list[Event] = []
        self.program = Program(sort.name)
        self._news, self._started = news, started
        self._reader: Process | None = None
        self._simulator = Process("sensor_tools.simulate", *(
            argument.format(directory=directory) for argument in sort.simulator))
        place = self._simulator.line().partition(": ")[0]
        port = place.rpartition(":")[2] if sort.driver == "icotronic" else place
        parameters = (part for parameter in sort.parameters
                      for part in ("-p", parameter.format(port=port)))
        self.node = Process(sort.module, "--ros-args", "-r", f"__ns:=/{sort.transport}",
                            *parameters)
        self.client: Client | None = None

    def __enter__(self) -> Lane:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the node and note how it ended, then the simulator."""
        for process in (self.node, self._simulator):
            with contextlib.suppress(ProcessLookupError):
                process.send_signal(signal.SIGCONT)
        if self._reader is not None:
            self._reader.__exit__()
        if self.node.is_running():
            self.node.send_signal(signal.SIGINT)
        self.program.code = self.node.wait(STOP_TIME)
        self.program.received = self.watch.received
        self.program.published = round(self.sort.samples * self.watch.published)
        self.program.trouble += [line for line in self.node.complaints()
                                 if "Traceback" in line or "internal error" in line]
        self.node.__exit__()
        self._simulator.__exit__()

    @property
    def processes(self) -> dict[str, int]:
        """The numbers of the processes, by their names."""
        return {f"{self.sort.name} {what}": process.number for what, process in (
            ("driver", self.node), ("simulator", self._simulator))}

    # --- one fault after the other ---

    def run(self, faults: Sequence[Fault], seed: int, is_over: Callable[[], bool]) -> None:
        """Have the faults come, in an order that follows from the seed, until it is over."""
        chance = random.Random(f"{seed} {self.sort.name}")
        while not is_over():
            for fault in chance.sample(faults, len(faults)):
                if is_over():
                    return
                self._undergo(fault, chance.uniform(*fault.lasts))
                if not self.node.is_running():
                    self.program.trouble.append(f"ended during {fault.name}")
                    return

    def _undergo(self, fault: Fault, lasts: float) -> None:
        """Have a fault come and go, and note what becomes of it."""
        self._await_calm()
        before, begin = dict(self.watch.values), time.time()
        event = Event.of(self.sort.name, fault, begin - self._started)
        self.events.append(event)
        try:
            self._carry_out(fault.inject, event)
            time.sleep(lasts)
        finally:
            self._carry_out(fault.remove, event)
        end = time.time()
        since = self._wait(lambda: self.watch.whole_since(end), PATIENCE)
        event.recovery = None if since is None else since - end
        well = time.time()
        event.end = well - self._started
        self._wait(lambda: self.watch.statuses[-1].time > well + NEWS, PATIENCE)
        self._wait(lambda: self._notice(event, fault, begin, before) or not fault.notices,
                   NOTICE_TIME)
        event.said = self.watch.said(begin)
        self._count(event, before, begin, max(end, since or time.time()))
        print(f"{time.time() - self._started:5.0f} s  {self.sort.name}: {fault.name}; "
              + "; ".join((f"noticed by {event.noticed}" if event.noticed else "not told",
                           "no recovery" if since is None else f"well after {since - end:.2f} s",
                           *event.trouble)), flush=True)

    def _await_calm(self) -> None:
        """Wait until nothing of the last fault is left, and note what the node uses."""
        time.sleep(CALM)
        calm = self._wait(lambda: self.watch.level() < LEVELS.index("ERROR"), PATIENCE)
        if calm:
            self.note_usage()
        else:
            last = self.watch.statuses[-1].message if self.watch.statuses else "nothing"
            self.program.trouble.append(
                f"the diagnostics stay bad at {time.time() - self._started:.0f} s: {last}")

    def note_usage(self) -> None:
        """Note what the node uses now."""
        self.program.usage.append(usage(self.node.number, time.time() - self._started))

    def lag(self, begin: float) -> float:
        """Return by how much data that were measured since a moment may have come late."""
        return max((event.lag for event in self.events
                    if self._started + event.end > begin), default=0.0)

    def note_wrong(self, wrong: Wrong) -> None:
        """Note wrong values; the last fault before them is to blame."""
        moment = wrong.time - self._started
        text = f"wrong values from {moment:.1f} s on: {wrong.example}"
        event = next((event for event in reversed(self.events) if event.begin < moment), None)
        if event is not None:
            event.wrong += wrong.values
        (self.program if event is None else event).trouble.append(text)
        print(f"{moment:5.0f} s  {self.sort.name}: {text}", flush=True)

    def _notice(self, event: Event, fault: Fault, begin: float, before: Mapping[str, str]) -> bool:
        times = {notice: moment for notice in fault.notices
                 if (moment := self.watch.noticed(notice, begin, before)) is not None}
        event.noticed = min(times, key=times.__getitem__, default="")
        return bool(times)

    def _count(self, event: Event, before: Mapping[str, str], begin: float, end: float) -> None:
        """Count what was lost in a time, and what the diagnostics tell of that."""
        with self._news:
            due = self.watch.rate * (end - begin)
            event.lost = max(0, round(due - self.watch.came(begin, end)))
            told = self.sort.samples * sum(
                self.watch.grown(key, before) for key in self.sort.counters)
            told += self.watch.rate * self.watch.outages(begin, end) if event.noticed else 0.0
            event.explained = min(event.lost, round(told))

    def _wait(self, condition: Callable[[], Any], seconds: float) -> Any:
        with self._news:
            return self._news.wait_for(condition, seconds)

    # --- steps ---

    def _carry_out(self, steps: Sequence[str], event: Event) -> None:
        for step in steps:
            who, _, what = step.partition(" ")
            try:
                STEPS[who](self, what)
            except Failure as failure:
                event.trouble.append(f"{step}: {failure}")

    def _tell_simulator(self, command: str) -> None:
        self._simulator.tell(command)
        answer = self._simulator.line()
        if answer != f"done: {command}":
            raise Failure(answer)

    def _signal(self, what: str, *processes: Process) -> None:
        for process in processes:
            process.send_signal(SIGNALS[what])

    def _read(self, what: str) -> None:
        if what == "start":
            self._reader = Process("bench.listener", self.sort.topic.name)
            self._reader.line()
            return
        assert self._reader is not None
        if what == "suspend":
            self._reader.send_signal(signal.SIGSTOP)
        else:
            self._reader.send_signal(signal.SIGCONT)
            self._reader.__exit__()
            self._reader = None

    def _ask(self, what: str) -> None:
        """Have a client set a parameter or change the state; "refuses" expects a refusal."""
        assert self.client is not None
        refused = what.startswith("refuses ")
        what = what.removeprefix("refuses ").removeprefix("set ")
        if what in TRANSITIONS:
            reason = self.client.change(what)
        else:
            name, _, text = what.partition("=")
            reason = self.client.set(name, value_of(text))
        if bool(reason) != refused:
            raise Failure(reason or "was not refused")


SIGNALS = {"suspend": signal.SIGSTOP, "continue": signal.SIGCONT}
STEPS: Mapping[str, Callable[[Lane, str], None]] = {
    "sim": Lane._tell_simulator, "reader": Lane._read, "client": Lane._ask,
    "node": lambda lane, what: lane._signal(what, lane.node),
    "machine": lambda lane, what: lane._signal(what, lane.node, lane._simulator)}


def value_of(text: str) -> Any:
    """Return the value of a parameter: as JSON, or a bare word."""
    try:
        return json.loads(text)
    except ValueError:
        return text


def usage(number: int, moment: float) -> Usage:
    """Return what a process has at a moment."""
    process = Path(f"/proc/{number}")
    resident = int((process / "statm").read_text().split()[1]) * PAGE / 1e6
    return Usage(moment, resident, len(os.listdir(process / "fd")),
                 len(os.listdir(process / "task")))
