# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The demonstration: simulated sensors, their drivers, a recording and a picture of it."""

from __future__ import annotations

import argparse
import contextlib
import importlib.util
import os
import signal
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from driver_common.errors import DriverError
from sensor_tools.ros_domain import claim_domain

if TYPE_CHECKING:
    from sensor_tools.demo.comparison import Comparison
    from sensor_tools.demo.families import Family, Topic
    from sensor_tools.demo.machine import Machine
    from sensor_tools.demo.processes import Processes
    from sensor_tools.demo.recorder import Bag, Recorder

FIRST_MESSAGE_TIME = 120.0  # s until every topic must have had its first message
POLL_TIME = 0.02  # s
TRAVEL_TIME = 5.0  # s that a message may be under way
OUTPUT = Path("demo_output")
PICTURE = "picture.png"
RECORDER, HEARTBEAT = "recorder", "heartbeat"  # programs beside those of the sensors
INSTALL = {
    "matplotlib": "'sudo apt install python3-matplotlib' or 'pip install matplotlib'",
    "rosbags": "'pip install rosbags', in a virtual environment",
}


class Interruption:
    """Whether somebody wants the program to end; a context manager.

    Signals only leave a note, so that nothing is interrupted halfway.

    Attributes:
        signal: Number of the signal that came, or 0.
    """

    def __init__(self) -> None:
        """None came yet."""
        self.signal = 0
        self._before: dict[int, object] = {}

    def __enter__(self) -> Interruption:
        """Take notes from now on."""
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            before = signal.getsignal(number)
            if number != signal.SIGHUP or before is not signal.SIG_IGN:  # else: nohup
                self._before[number] = signal.signal(number, self._note)
        return self

    def __exit__(self, *_: object) -> None:
        """Restore what was before."""
        for number, before in self._before.items():
            signal.signal(number, before)  # type: ignore[arg-type]

    def _note(self, number: int, _: object) -> None:
        self.signal = number


def main(args: Sequence[str] | None = None, families: Sequence[Family] | None = None) -> int:
    """Show the sensors; return 0 if all of them delivered and agree with the truth.

    Args:
        args: The command line, without the program.
        families: The sensors; all that there are if not given.
    """
    options = _parse(args)
    print("Starting; it takes some seconds until the first measurements come.", flush=True)
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    if not os.environ.get("ROS_DOMAIN_ID"):
        os.environ["ROS_DOMAIN_ID"] = str(claim_domain())
    try:
        from sensor_tools.demo import recorder  # noqa: F401  (ROS is there)
        from sensor_tools.demo.families import FAMILIES
    except ImportError as error:
        print(f"error: {error}; is ROS 2 Jazzy sourced? Without it, './dev demo' gets all that "
              "is needed", file=sys.stderr)
        return 1
    try:
        return _demonstrate(options, families or FAMILIES)
    except DriverError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:  # before anything runs, or afterwards
        return 128 + signal.SIGINT
    except BrokenPipeError:  # nobody reads on, as in "demo | head"
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 128 + signal.SIGPIPE


def _parse(args: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="demo", description=(
        "Shows simulated sensors at work: starts them and their drivers, records what the drivers "
        "publish, compares it with the truth and draws it. No hardware is needed."))
    parser.add_argument("--duration", type=float, default=15.0, metavar="S",
                        help="time in s to record (default: 15)")
    parser.add_argument("--bag", type=Path, metavar="DIR",
                        help=f"new directory for the recording (default: {OUTPUT}/DATE-TIME)")
    parser.add_argument("--picture", type=Path, metavar="FILE",
                        help=f"file for the picture (default: {PICTURE} in that directory)")
    options = parser.parse_args(args)
    if not 1.0 <= options.duration <= 86400.0:
        parser.error("--duration must be 1 to 86400 s")
    return options


def _demonstrate(options: argparse.Namespace, families: Sequence[Family]) -> int:
    from sensor_tools.demo.families import Topic
    from sensor_tools.demo.machine import Machine
    from sensor_tools.demo.processes import Processes
    from sensor_tools.demo.recorder import Recorder

    topics = [topic for family in families for topic in family.topics]
    topics.append(Topic("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray",
                        float(len(families))))
    folder: Path = options.bag or _new_folder()
    picture: Path = options.picture or folder / PICTURE
    can_draw = _has("matplotlib", "picture", needed=options.picture is not None)
    if options.picture is not None and not os.access(picture.resolve().parent, os.W_OK):
        raise DriverError(f"cannot write {picture}: no such directory, or no permission")

    with contextlib.ExitStack() as stack:
        interruption = stack.enter_context(Interruption())
        bag = _bag(folder, topics, needed=options.bag is not None)
        if bag is not None:
            stack.enter_context(bag)
        directory = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="demo-")))
        os.environ["ROS_LOG_DIR"] = str(directory)
        processes = stack.enter_context(Processes(directory))
        recorder = stack.enter_context(Recorder(topics, bag))  # which ends before the nodes do
        _start(families, processes)
        _wait_for_first_messages(families, recorder, processes, interruption)
        _record(options.duration, recorder, interruption)
        machine = Machine.of_log(processes.log(HEARTBEAT), (RECORDER, *processes.numbers())[:-1])
        faults = _missing(families, recorder, processes, machine)

    if interruption.signal:
        print("Stopped early.")
    if recorder.elapsed:
        faults += _compare(families, recorder, machine, picture if can_draw else None)
        if bag is not None and any(channel.count for channel in recorder.channels):
            print(f"Bag: {folder}, for example for 'ros2 bag play {folder}'")
        _summarize(recorder)
    for fault in faults if not interruption.signal else ():
        print(f"error: {fault}", file=sys.stderr)
    return 128 + interruption.signal if interruption.signal else int(bool(faults))


def _new_folder() -> Path:
    """Return a path for the recording, in a directory that git does not look into."""
    with contextlib.suppress(OSError):  # it is complained of when the bag is made
        OUTPUT.mkdir(exist_ok=True)
        (OUTPUT / ".gitignore").write_text("*\n", encoding="utf-8")
    return OUTPUT / time.strftime("%Y%m%d-%H%M%S")


def _has(package: str, what: str, *, needed: bool) -> bool:
    """Whether an optional package is there; say so where it is not, raise where it is needed."""
    if importlib.util.find_spec(package) is not None:
        return True
    text = f"no {what}: the Python package {package} is missing; install it with {INSTALL[package]}"
    if needed:
        raise DriverError(text)
    print(text, file=sys.stderr)
    return False


def _bag(folder: Path, topics: Sequence[Topic], *, needed: bool) -> Bag | None:
    from sensor_tools.demo.recorder import Bag

    return Bag(folder, topics) if _has("rosbags", "bag", needed=needed) else None


def _simulator(family: Family) -> str:
    return f"{family.name} simulator"


def _driver(family: Family) -> str:
    return f"{family.name} driver"


def _programs(family: Family) -> tuple[str, str]:
    return _simulator(family), _driver(family)


def _start(families: Sequence[Family], processes: Processes) -> None:
    from sensor_tools.demo.processes import Program, free_port

    for family in families:
        port = free_port()
        processes.start(_simulator(family), family.simulator, port)
        processes.start(_driver(family), family.node, port)
    processes.start(HEARTBEAT, Program("sensor_tools.demo.heartbeat", tuple(
        str(number) for number in (os.getpid(), *processes.numbers().values()))))
    print(f"Started {', '.join(family.name for family in families)}: simulated, with driver. "
          f"ROS_DOMAIN_ID is {os.environ['ROS_DOMAIN_ID']}.", flush=True)


def _wait_for_first_messages(families: Sequence[Family], recorder: Recorder,
                             processes: Processes, interruption: Interruption) -> None:
    """Return when every topic has had a message.

    Raises:
        DriverError: One has had none in time, or a program has ended.
    """
    deadline = time.monotonic() + FIRST_MESSAGE_TIME
    while not interruption.signal:
        recorder.poll()
        silent = {channel.topic.name for channel in recorder.channels if not channel.count}
        if not silent:
            return
        if ended := _ended(processes):
            raise DriverError(ended[0])
        if time.monotonic() > deadline:
            raise DriverError(f"nothing came within {FIRST_MESSAGE_TIME:g} s on "
                              f"{', '.join(sorted(silent))}" + "".join(
                _last_lines(family, processes) for family in families
                if silent & {topic.name for topic in family.topics}))
        time.sleep(POLL_TIME)


def _ended(processes: Processes) -> list[str]:
    return [f"the {name} has ended; its last lines:\n{processes.last_lines(name)}"
            for name in processes.ended()]


def _last_lines(family: Family, processes: Processes) -> str:
    return "".join(f"\n  last lines of the {name}:\n{processes.last_lines(name)}"
                   for name in _programs(family))


def _record(duration: float, recorder: Recorder, interruption: Interruption) -> None:
    from sensor_tools.demo.table import display

    if interruption.signal:
        return
    recorder.start()
    with display() as shown:
        while recorder.elapsed < duration and not interruption.signal:
            time.sleep(min(POLL_TIME, max(0.0, duration - recorder.elapsed)))
            recorder.poll()
            shown.update(recorder.channels, recorder.elapsed, duration)
        recorder.stop()
        _wait_for_what_is_under_way(recorder, interruption)
        shown.update(recorder.channels, recorder.elapsed, duration)


def _wait_for_what_is_under_way(recorder: Recorder, interruption: Interruption) -> None:
    """Go on until every topic has had a message that was measured after the end."""
    deadline = time.monotonic() + TRAVEL_TIME
    while not (all(channel.is_complete for channel in recorder.channels) or interruption.signal
               or time.monotonic() > deadline):
        time.sleep(POLL_TIME)
        recorder.poll()


def _missing(families: Sequence[Family], recorder: Recorder, processes: Processes,
             machine: Machine) -> list[str]:
    """Return what to complain of: programs that have ended, topics with too few messages."""
    from sensor_tools.demo.completeness import count

    faults = _ended(processes)
    end = recorder.began + recorder.elapsed
    excused = windows = 0
    for channel in recorder.channels:
        owners = [family for family in families if channel.topic in family.topics] or families
        stamps = channel.stamps()
        start = recorder.began if len(stamps) == channel.count else float(stamps[0])
        programs = [RECORDER, *(name for family in owners for name in _programs(family))]
        result = count(stamps, channel.topic.rate, start, end, machine.of(programs))
        excused, windows = max(excused, result.busy), result.windows
        if not channel.count or not result.suffices:
            faults.append(f"{channel.topic.name} had {result.came} messages instead of "
                          f"{result.due:.0f}"
                          + "".join(_last_lines(family, processes) for family in owners))
    if excused:
        print(f"The machine was busy in {excused} of {windows} s: what is missing then is not "
              "counted, and stamps may be less certain.")
    return faults


def _compare(families: Sequence[Family], recorder: Recorder, machine: Machine,
             picture: Path | None) -> list[str]:
    """Compare the sensors with the truth and draw them; return what to complain of."""
    faults: list[str] = []
    channels = {channel.topic: channel for channel in recorder.channels}
    compared: list[tuple[Family, Comparison]] = []
    for family in families:
        messages = channels[family.topics[0]].messages()
        if len(messages) < 2:
            continue  # that is complained of elsewhere
        comparison = family.compare(messages, machine.of(_programs(family)))
        compared.append((family, comparison))
        print(f"{family.name}: {comparison}")
        if not comparison.agrees:
            faults.append(f"the measurements of the {family.name} do not agree with the truth")
    if picture is not None and compared:
        faults += _draw(compared, recorder, picture)
    return faults


def _draw(compared: Sequence[tuple[Family, Comparison]], recorder: Recorder,
          picture: Path) -> list[str]:
    from sensor_tools.demo.picture import draw

    counts = {channel.topic: channel.count for channel in recorder.channels}
    try:
        picture.parent.mkdir(parents=True, exist_ok=True)
        draw(
            [(f"{family.name} (simulated): {counts[family.topics[0]]} messages in "
              f"{recorder.elapsed:.1f} s", family.panels, comparison)
             for family, comparison in compared], picture)
    except (OSError, ValueError) as error:  # ValueError: a format that is not known
        return [f"cannot write {picture}: {error}"]
    print(f"Picture: {picture}")
    return []


def _summarize(recorder: Recorder) -> None:
    """Print one line a topic: name, type, count, rate."""
    width = max(len(channel.topic.name) for channel in recorder.channels)
    kind_width = max(len(channel.topic.kind) for channel in recorder.channels)
    for channel in recorder.channels:
        print(f"{channel.topic.name:{width}}  {channel.topic.kind:{kind_width}}  "
              f"{channel.count:7} messages  {channel.count / recorder.elapsed:8.1f} per second")


if __name__ == "__main__":
    sys.exit(main())
