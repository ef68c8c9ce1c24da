# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Programs that start without importing: each is forked from a process that has done it once.

Importing takes a node a second of computing, and hundreds of tests start one.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
from multiprocessing.connection import Connection

IMPORTED = ("isys_radar_driver.node", "icotronic_driver.node", "uc4000_driver.node")

_context = multiprocessing.get_context("forkserver")
_context.set_forkserver_preload(list(IMPORTED))


class Forked:
    """A running program; it looks like a subprocess.Popen with pipes, as far as tests need.

    Args:
        code: What it does.
        arguments: Its arguments.
        env: Its environment.
    """

    def __init__(self, code, arguments, env):
        theirs_in, ours_out = os.pipe()
        ours_in, theirs_out = os.pipe()
        with (Connection(theirs_in, writable=False) as reader,
              Connection(theirs_out, readable=False) as writer):
            self._process = _context.Process(
                target=_run, args=(code, arguments, env, reader, writer), daemon=True)
            self._process.start()
        self.pid = self._process.pid
        self.stdin, self.stdout = os.fdopen(ours_out, "w"), os.fdopen(ours_in)

    def send_signal(self, number):
        """Send a signal, unless it has ended."""
        if self._process.is_alive():
            os.kill(self.pid, number)

    def terminate(self):
        """Have it end."""
        self.send_signal(signal.SIGTERM)

    def kill(self):
        """End it."""
        self.send_signal(signal.SIGKILL)

    def wait(self, timeout=None):
        """Return its exit code; raises TimeoutExpired."""
        self._process.join(timeout)
        if self._process.exitcode is None:
            raise subprocess.TimeoutExpired(self._process.name, timeout)
        return self._process.exitcode


def _run(code, arguments, env, reader, writer):
    os.environ.clear()
    os.environ.update(env)
    os.dup2(reader.fileno(), 0)
    for number in 1, 2:
        os.dup2(writer.fileno(), number)
    reader.close()
    writer.close()
    sys.stdin = os.fdopen(0, closefd=False)
    sys.stdout = os.fdopen(1, "w", buffering=1, closefd=False)
    sys.stderr = os.fdopen(2, "w", buffering=1, closefd=False)
    sys.argv = ["-c", *arguments]
    exec(code, {"__name__": "__main__"})
