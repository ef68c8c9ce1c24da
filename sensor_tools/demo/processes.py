# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Processes of the demonstration: each in a group of its own, none of them outlives it."""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import socket
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

STOP_TIME = 5.0  # s that a process may take to end
TAIL = 10  # lines of a log that are worth showing
_ROOT = Path(__file__).resolve().parent.parent.parent
_SET_PARENT_DEATH_SIGNAL = 1  # prctl(2)
_CODE = ("from sensor_tools.demo.processes import end_with_parent; end_with_parent({parent}); "
         "from {module} import main; main()")


@dataclass(frozen=True)
class Program:
    """`main` of a module with its arguments.

    "{directory}" in an argument stands for a directory that the programs of a demonstration share
    and that vanishes with them, "{port}" for a free TCP port, the same for a whole family.
    """

    module: str
    arguments: tuple[str, ...] = ()


def end_with_parent(parent: int) -> None:
    """Have this process terminated when its parent ends, however that comes; Linux only."""
    with contextlib.suppress(AttributeError, OSError):
        ctypes.CDLL(None).prctl(_SET_PARENT_DEATH_SIGNAL, signal.SIGTERM)
    if os.getppid() != parent:
        sys.exit(0)


def free_port() -> int:
    """Return a TCP port of this machine that nobody uses."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])


class Processes:
    """Running programs; a context manager that ends them.

    Args:
        directory: Where their output goes.
    """

    def __init__(self, directory: Path) -> None:
        """Nothing runs yet."""
        self._directory = directory
        self._running: dict[str, subprocess.Popen[bytes]] = {}

    def start(self, name: str, program: Program, port: int = 0) -> None:
        """Start a program.

        Args:
            name: Its name here.
            program: What to run.
            port: The TCP port for its arguments.
        """
        path = os.pathsep.join(filter(None, (str(_ROOT), os.environ.get("PYTHONPATH"))))
        arguments = [argument.format(directory=self._directory, port=port)
                     for argument in program.arguments]
        code = _CODE.format(parent=os.getpid(), module=program.module)
        with self.log(name).open("wb") as log:
            self._running[name] = subprocess.Popen(
                [sys.executable, "-c", code, *arguments], stdin=subprocess.DEVNULL, stdout=log,
                stderr=subprocess.STDOUT, start_new_session=True,
                env={**os.environ, "PYTHONPATH": path, "PYTHONUNBUFFERED": "1",
                     "RCUTILS_COLORIZED_OUTPUT": "0"})

    def log(self, name: str) -> Path:
        """Return the file with all that a program printed."""
        return self._directory / f"{name.replace('/', '_')}.log"

    def numbers(self) -> dict[str, int]:
        """Return the process number of each program, by its name."""
        return {name: process.pid for name, process in self._running.items()}

    def ended(self) -> list[str]:
        """Return the names of those that run no more."""
        return [name for name, process in self._running.items() if process.poll() is not None]

    def last_lines(self, name: str) -> str:
        """Return the end of what a program printed, indented."""
        lines = self.log(name).read_text(errors="replace").splitlines()[-TAIL:]
        return "\n".join(f"    {line}" for line in lines or ["(it printed nothing)"])

    def __enter__(self) -> Processes:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """End all, the last one first: a driver before its simulator."""
        for process in reversed(self._running.values()):
            with contextlib.suppress(ProcessLookupError):
                process.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(STOP_TIME)
            with contextlib.suppress(ProcessLookupError):  # it, or what it has started
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
