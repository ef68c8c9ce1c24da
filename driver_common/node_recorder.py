# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The recordings of a node: on request, at the first error of an outage, or all the time."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import sys
import time
from collections.abc import Callable, Mapping
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from driver_common import recording_files
from driver_common.errors import DriverError
from driver_common.flight_recorder import DURATION, FlightRecorder, unpack
from driver_common.parameter_node import ParameterNode
from driver_common.recording import RecordingText
from driver_common.recording_files import RecordingFile, RecordingFiles
from driver_common.replay import Replay
from driver_common.settings import Option, Value

PACKAGE = "industrial_sensor_drivers"
LIBRARIES = ("pyserial", "python-can", "numpy")
MIB = 1024 * 1024
PERIOD = 1.0  # s between two looks at what is new, where all is recorded

OPTIONS = (
    Option("recording_directory", kind=str, default="", live=True,
           description="Where the raw traffic of the last minute is written when an outage begins; "
                       "empty = only when the service ~/save_recording asks for it, to "
                       "~/.ros/recordings"),
    Option("recording_limit", kind=int, default=1024, minimum=200, maximum=1024 * 1024, unit="MiB",
           live=True, description="Disk space for the recordings of this node; the oldest are "
                                  "deleted"),
    Option("replay_rate", kind=float, default=1.0, minimum=0.0, maximum=1000.0,
           description="How much faster than it was a recording is played; 0 = as fast as can be"),
    Option("record_raw", kind=bool, default=False, live=True,
           description="Write all raw traffic, not only the last minute of it"),
)
OWN = frozenset(option.name for option in OPTIONS)  # which say nothing about the devices
LINKS = ("serial_port", "can_interface", "can_channel", "can_options", "autostart")


class NodeRecorder:
    """Writes the recordings of a node; in the executor, where nothing else is said.

    Attributes:
        last: Where the newest recording is; None where there is none.
    """

    def __init__(self, node: ParameterNode, link: str, channel: Callable[[], str],
                 link_facts: Callable[[], Mapping[str, str]]) -> None:
        """Prepare; nothing is written.

        Args:
            node: Whose traffic it is.
            link: What the recordings are of, SERIAL or CAN.
            channel: Returns the name of the bus, "" where it has none.
            link_facts: Returns what a recording says of the link.
        """
        self._node = node
        self._link = link
        self._channel = channel
        self._link_facts = link_facts
        self.last: Path | None = None
        self._found: dict[str, str] = {}  # what was found, by sensor
        self._in_outage = False
        self._saved = -DURATION  # monotonic time in s of the last outage that was written
        self._raw: RecordingFile | None = None
        self._raw_text: RecordingText | None = None
        self._raw_until = 0
        self._told = ""

    # --- replay ---

    @property
    def replay(self) -> Replay | None:
        """The recording that is played in the place of the link."""
        recorder = self._recorder
        return recorder if isinstance(recorder, Replay) else None

    def begin_replay(self) -> None:
        """Say what is played, where a recording is."""
        if (replay := self.replay) is None:
            return
        replay.clock.rate = self._node.option("replay_rate")
        self._told = ""
        facts = replay.recording.facts
        self._node.get_logger().info(
            f"playing {replay.path} of {facts.get('node', '?')}, written "
            f"{facts.get('written', '?')} because of: {facts.get('because', '?')}")

    def look_at_replay(self) -> None:
        """Say once where a replay does something else; in the thread of the bus."""
        replay = self.replay
        if replay is not None and replay.differs and not self._told:
            self._told = (f"this node asks {replay.differs}, which was not asked "
                          "then, because of other parameters or another version: from here on what "
                          "it publishes may differ")
            self._node.get_logger().warning(self._told)

    # --- in the thread of the bus ---

    def note_found(self, device: Any, description: str) -> None:
        """Take note that a device was found: a replay needs how."""
        self._in_outage = False
        self._found[device.options.name] = description
        self._recorder.note(f"found {device.title}: {description}")
        self._recorder.keep_search()

    def note_link_works(self) -> None:
        """Take note that an outage of the link is over."""
        self._in_outage = False

    def note_error(self, text: str) -> None:
        """Take note of an error; the first one of an outage is worth a recording.

        What comes within a minute after another recording is seldom news, and can be asked for.
        """
        self._recorder.note(text)
        now = time.monotonic()
        news = not self._in_outage and now - self._saved > DURATION
        self._in_outage = True
        if news and self._found and not self.replay and self._node.option("recording_directory"):
            self._saved = now
            parts, _ = self._recorder.snapshot()
            self._node.later(lambda: self._log(self._save("outage", text, parts)))

    def diagnostics(self) -> dict[str, object]:
        """Return what the diagnostics say of it."""
        return {"last recording": self.last} if self.last else {}

    # --- in the executor ---

    async def save(self) -> str:
        """Write the last minute, and return where it is; raises DriverError."""
        if self._node.bus is None:
            raise DriverError("there is nothing to save: the node is not configured")
        if self.replay is not None:
            raise DriverError(f"this is {self.replay.path}, copy that")
        parts, _ = self._recorder.snapshot()
        return f"saved {self._save('request', 'save_recording', parts)}"

    def write_raw(self) -> None:
        """Write what is new where all is recorded, or end that."""
        if self._node.bus is None or self.replay or not self._node.option("record_raw"):
            self.finish_raw()
            return
        try:
            self._continue_raw()
            self._told = ""
        except DriverError as error:
            if self._raw is not None:
                self._raw.discard()
                self._raw = None
            if str(error) != self._told:
                self._node.get_logger().error(str(error))
            self._told = str(error)

    def finish_raw(self) -> None:
        """End the recording of all, if there is one; never raises."""
        if self._raw is None or self._raw_text is None:
            return
        file, self._raw = self._raw, None
        try:
            parts, _ = self._recorder.snapshot(self._raw_until)
            file.write(self._raw_text.body(unpack(parts)))
            file.write(self._raw_text.end())
            self.last = file.finish()
        except DriverError as error:
            file.discard()
            self._node.get_logger().error(str(error))

    def _continue_raw(self) -> None:
        if self._raw is not None and self._raw.is_full:
            self.finish_raw()
        if self._raw is None or self._raw_text is None:
            self._raw_text, self._raw_until = self._text(), 0
            self._raw = self._files().create("raw")
            self._raw.write(self._raw_text.head(self._facts("record_raw"), self._parameters()))
        parts, self._raw_until = self._recorder.snapshot(self._raw_until, growing=False)
        self._raw.write(self._raw_text.body(unpack(parts)))

    def _save(self, reason: str, text: str, parts: list[bytes]) -> Path:
        self.last = recording_files.save(self._files(), reason, self._text(), self._facts(text),
                                         self._parameters(), unpack(parts))
        return self.last

    def _log(self, path: Path) -> None:
        self._node.get_logger().info(f"what led to this outage is in {path}")

    # --- what stands in it ---

    @property
    def _recorder(self) -> FlightRecorder:
        recorder: FlightRecorder = self._node.bus.line.recorder
        return recorder

    def _files(self) -> RecordingFiles:
        given = self._node.option("recording_directory")
        home = Path(os.environ.get("ROS_HOME") or Path.home() / ".ros")
        directory = Path(given).expanduser() if given else home / "recordings"
        return RecordingFiles(directory.absolute(), self._node.get_fully_qualified_name(),
                              self._node.option("recording_limit") * MIB)

    def _text(self) -> RecordingText:
        return RecordingText(self._link, self._channel(), self._recorder.offset)

    def _facts(self, reason: str) -> dict[str, str]:
        """Return who recorded what and why."""
        return {
            "node": self._node.get_fully_qualified_name(),
            "written": f"{datetime.now(timezone.utc):%Y-%m-%dT%H:%M:%SZ}", "because": reason,
            "versions": f"{PACKAGE} {_version(PACKAGE)}, Python {platform.python_version()}, "
                        + ", ".join(f"{name} {_version(name)}" for name in LIBRARIES)
                        + f", {platform.system()} {platform.release()}",
            **self._link_facts(),
            **{f"device {sensor}".rstrip(): text for sensor, text in self._found.items()},
            **self._settings()}

    def _settings(self) -> dict[str, str]:
        """Return the settings as the devices reported them last."""
        return {f"setting {name}": row.text(self._node.get_parameter(name).value)
                for name, row in self._node.store.rows.items() if not isinstance(row, Option)}

    def _parameters(self) -> dict[str, Value]:
        """Return the parameters that are not the defaults, but for those of the link."""
        given: Mapping[str, Any] = self._node.store.overrides
        rows = self._node.store.rows
        options = {name: self._node.get_parameter(name).value for name, row in rows.items()
                   if isinstance(row, Option) and name not in (*OWN, *LINKS)}
        default = {name: row.default for name, row in rows.items() if isinstance(row, Option)}
        settings = {name: value for name, value in given.items()
                    if name not in options and name not in (*OWN, *LINKS)}
        return {name: value for name, value in options.items() if value != default[name]} | settings


def _version(package: str) -> str:
    module = sys.modules.get({"pyserial": "serial", "python-can": "can"}.get(package, package))
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return str(getattr(module, "__version__", "not installed as a package"))
