# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A program that a signal ends well, at any moment: while modules are imported, at work, stopping.

A thread of its own hears of SIGINT and SIGTERM, so none of them ever interrupts anything. The
first one ends the program, the second one changes nothing, because a launch system and impatient
people send it; the third one forces the end.
"""

from __future__ import annotations

import importlib
import os
import signal
import sys
import threading
from collections.abc import Callable

STOP_TIME = 4.0  # s in which everything must have ended; twice what a stop may take
MIDDLEWARE_TIME = 1.0  # s for what is left once the devices are stopped and the port is closed


class SignalWatch(threading.Thread):
    """Waits for signals, and has the program end in bounded time.

    The middleware can hang when it ends while others in its domain do; then the process ends
    without it, as its devices are stopped by then.
    """

    def __init__(self) -> None:
        """Take all signals from now on; to be called in the main thread."""
        super().__init__(name="signals", daemon=True)
        # Written to by whichever thread gets the signal; the handlers have nothing left to do.
        self._signals, wakeup = os.pipe()
        os.set_blocking(wakeup, False)
        signal.set_wakeup_fd(wakeup, warn_on_full_buffer=False)
        for number in signal.SIGINT, signal.SIGTERM:
            signal.signal(number, lambda *_: None)
        self._stop_devices: Callable[[], None] | None = None
        self._stop_rest: Callable[[], None] | None = None
        self.start()

    def watch(self, stop_devices: Callable[[], None], stop_rest: Callable[[], None]) -> None:
        """Call these two in turn when a signal comes, instead of ending at once.

        Args:
            stop_devices: Leaves the devices stopped and the port closed.
            stop_rest: Has the main thread end.
        """
        self._stop_rest = stop_rest
        self._stop_devices = stop_devices

    def run(self) -> None:
        """Wait for the signals."""
        os.read(self._signals, 1)
        if self._stop_devices is None:
            _end(0)  # nothing was opened yet
        threading.Thread(target=self._stop, daemon=True).start()
        os.read(self._signals, 1)
        os.read(self._signals, 1)
        _end(1)

    def _stop(self) -> None:
        assert self._stop_devices is not None
        assert self._stop_rest is not None
        end_in(STOP_TIME, 1, "error: the devices could not be stopped in time")
        self._stop_devices()
        end_in(MIDDLEWARE_TIME, 0)
        self._stop_rest()


def end_in(seconds: float, code: int, message: str = "") -> None:
    """End the process after some time, whatever it is doing then."""
    timer = threading.Timer(seconds, _end, [code, message])
    timer.daemon = True
    timer.start()


def _end(code: int, message: str = "") -> None:
    if message:
        print(message, file=sys.stderr)
    for stream in sys.stdout, sys.stderr:
        stream.flush()
    os._exit(code)


watch: SignalWatch | None = None


def start(module: str) -> None:
    """Run `main` of a module, which can take a second to import, and end the process.

    The middleware's own end can crash where its threads outlive the interpreter, so it is left out.
    """
    global watch
    watch = SignalWatch()
    code: object = 0
    try:
        importlib.import_module(module).main()
    except SystemExit as end:
        code = end.code or 0
    if isinstance(code, int):
        _end(code)
    _end(1, str(code))
