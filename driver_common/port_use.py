# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Who uses a serial port, and who may: from what the kernel tells in /proc and /dev."""

from __future__ import annotations

import contextlib
import grp
import os
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

PROC = Path("/proc")


class Process(NamedTuple):
    """A process.

    Attributes:
        pid: Its number.
        name: What it is called, "" where that is hidden.
    """

    pid: int
    name: str

    def __str__(self) -> str:
        """Return both for people."""
        return f"{self.name or 'a process'} (pid {self.pid})"


def holders(port: str) -> list[Process]:
    """Return the processes other than this one that have a port locked, else those that opened it.

    Open files of other users are hidden to all but root; locks are not.
    """
    try:
        status = os.stat(port)
    except OSError:
        return []
    own = {os.getpid()}
    pids = {*_with_lock(status)} - own or {*_with_file(status)} - own
    return [Process(pid, _name(pid)) for pid in sorted(pids)]


def holders_text(port: str) -> str:
    """Return who holds a port, in words."""
    return (" and ".join(map(str, holders(port)))
            or f"another program ('sudo fuser -v {port}' names it)")


def group_of(port: str) -> str:
    """Return the group that a port belongs to, dialout where that cannot be known."""
    with contextlib.suppress(OSError, KeyError):
        status = os.stat(port)
        if status.st_gid and status.st_mode & 0o060:
            return grp.getgrgid(status.st_gid).gr_name
    return "dialout"


def _with_file(status: os.stat_result) -> Iterator[int]:
    """Yield processes that have opened a file, as far as they are not hidden."""
    for directory in PROC.glob("[0-9]*/fd"):
        with contextlib.suppress(OSError):
            for name in os.listdir(directory):
                with contextlib.suppress(OSError):
                    if os.path.samestat(os.stat(directory / name), status):
                        yield int(directory.parent.name)
                        break


def _with_lock(status: os.stat_result) -> Iterator[int]:
    """Yield processes that hold a lock on a file (proc_locks(5))."""
    device = f"{os.major(status.st_dev):02x}:{os.minor(status.st_dev):02x}:{status.st_ino}"
    with contextlib.suppress(OSError):
        for line in (PROC / "locks").read_text().splitlines():
            fields = line.split()
            if "->" not in fields and len(fields) > 5 and fields[5] == device:
                with contextlib.suppress(ValueError):
                    if int(fields[4]) > 0:  # -1: a lock of an open file without an owner
                        yield int(fields[4])


def _name(pid: int) -> str:
    """Return the name of a process: its program, or the script that it runs."""
    with contextlib.suppress(OSError):
        words = (PROC / str(pid) / "cmdline").read_bytes().decode(errors="replace").split("\0")
        names = [Path(word).name for word in words if word]
        if len(names) > 2 and names[0].startswith("python") and names[1] == "-m":
            return names[2]
        if len(names) > 1 and names[0].startswith("python") and not names[1].startswith("-"):
            return names[1]
        if names:
            return names[0]
    with contextlib.suppress(OSError):
        return (PROC / str(pid) / "comm").read_text().strip()
    return ""
