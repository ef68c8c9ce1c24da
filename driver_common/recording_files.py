# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Recordings as files: a ring of them in a directory, none half written, none outside of it."""

from __future__ import annotations

import contextlib
import os
import re
import time
from collections.abc import Iterable, Iterator, Mapping
from datetime import datetime, timezone
from pathlib import Path
from typing import TextIO

from driver_common.errors import DriverError
from driver_common.flight_recorder import Entry
from driver_common.recording import RecordingText

PART = ".part"  # in the name of a file that is still written
FINISHED_SHARE, FILE_SHARE = 2, 4  # of the disk space: a half for finished files, a quarter for one
LINES, PAUSE = 500, 0.001  # lines that are written at once; s in which the bus has the processor


class RecordingFiles:
    """The recordings of one node in a directory.

    Args:
        directory: Where they are; it is created.
        owner: Name of the node; whatever it is, it names no other directory.
        limit: Bytes that all of them may take.

    Raises:
        DriverError: From every method, with what is wrong and what to do.
    """

    def __init__(self, directory: Path, owner: str, limit: int) -> None:
        """Prepare; nothing is created."""
        self.directory = directory
        self.limit = limit
        self._owner = re.sub("[^A-Za-z0-9_]+", ".", owner).strip(".")[:100] or "node"
        self._pattern = re.compile(
            re.escape(self._owner) + rf"-\d{{8}}T\d{{12}}Z-[a-z]+\.log({re.escape(PART)})?")

    def create(self, reason: str) -> RecordingFile:
        """Begin a recording, after the oldest ones were deleted where they take too much.

        Args:
            reason: A lower-case word for its name.
        """
        with _errors_in_words(self.directory):
            self.directory.mkdir(parents=True, exist_ok=True)
            where = os.open(self.directory, os.O_RDONLY | os.O_DIRECTORY)
            try:
                self._make_room(where)
            except OSError:
                os.close(where)
                raise
            return RecordingFile(self.directory, where, self._owner, reason,
                                 self.limit // FILE_SHARE)

    def _make_room(self, where: int) -> None:
        sizes = {name: os.stat(name, dir_fd=where, follow_symlinks=False).st_size
                 for name in sorted(os.listdir(where), key=_age) if self._pattern.fullmatch(name)}
        total = sum(sizes.values())
        for name, size in sizes.items():
            if total <= self.limit // FINISHED_SHARE:
                return
            with contextlib.suppress(FileNotFoundError):
                os.unlink(name, dir_fd=where)
            total -= size


class RecordingFile:
    """A recording that is written; it has its name only when it is whole.

    Attributes:
        path: Where it is when it is whole.
        is_full: Whether it has the size that a single one may have.
    """

    def __init__(self, directory: Path, where: int, owner: str, reason: str, limit: int) -> None:
        """Create it in the directory that is open as `where`."""
        self._where = where
        self._limit = limit
        self._size = 0
        self._name = f"{owner}-{datetime.now(timezone.utc):%Y%m%dT%H%M%S%f}Z-{reason}.log"
        self.path = directory / self._name
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
        try:
            descriptor = os.open(self._name + PART, flags, 0o644, dir_fd=where)
        except OSError:
            os.close(where)
            raise
        self._file: TextIO = os.fdopen(descriptor, "w", encoding="utf-8")

    @property
    def is_full(self) -> bool:
        """Whether it has the size that a single one may have."""
        return self._size >= self._limit

    def write(self, lines: Iterable[str]) -> None:
        """Write lines, as far as there is room; the bus gets the processor now and then."""
        with _errors_in_words(self.path.parent):
            for number, line in enumerate(lines):
                self._file.write(line)
                self._size += len(line)
                if number % LINES == LINES - 1:
                    time.sleep(PAUSE)

    def finish(self) -> Path:
        """Give it its name; it is on the disk then."""
        with _errors_in_words(self.path.parent):
            self._file.flush()
            os.fsync(self._file.fileno())
            self._file.close()
            os.rename(self._name + PART, self._name, src_dir_fd=self._where, dst_dir_fd=self._where)
            os.fsync(self._where)
        os.close(self._where)
        return self.path

    def discard(self) -> None:
        """Delete it, instead of finishing it."""
        with contextlib.suppress(OSError):
            os.unlink(self._name + PART, dir_fd=self._where)
        with contextlib.suppress(OSError):  # what is buffered may not fit the disk
            self._file.close()
        os.close(self._where)


def save(files: RecordingFiles, reason: str, text: RecordingText, facts: Mapping[str, str],
         parameters: Mapping[str, object], entries: Iterable[Entry]) -> Path:
    """Write a whole recording; raises DriverError, and then there is none."""
    file = files.create(reason)
    try:
        file.write(text.head(facts, parameters))
        file.write(text.body(entries))
        file.write(text.end())
        return file.finish()
    except BaseException:
        file.discard()
        raise


def _age(name: str) -> str:
    """Return what sorts names of one owner by age."""
    return name.partition("-")[2]


@contextlib.contextmanager
def _errors_in_words(directory: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise DriverError(f"cannot write a recording to {directory}: {error.strerror}; correct "
                          "recording_directory, or make room") from error
