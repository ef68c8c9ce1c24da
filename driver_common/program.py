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

import faulthandler
import gc
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
        self._stops: tuple[Callable[[], None], Callable[[], None]] | None = None
        self._stopper: threading.Thread | None = None
        self.start()

    def watch(self, stop_devices: Callable[[], None], stop_rest: Callable[[], None]) -> None:
        """Call these two in turn when a signal comes, instead of ending at once.

        Args:
            stop_devices: Leaves the devices stopped and the port closed.
            stop_rest: Has the main thread end.
        """
        self._stops = stop_devices, stop_rest

    def forget(self) -> None:
        """End at once from now on, as nothing is open any more."""
        self._stops = None
        if self._stopper is not None:
            self._stopper.join(MIDDLEWARE_TIME)

    def run(self) -> None:
        """Wait for the signals."""
        os.read(self._signals, 1)
        if not self._begin_stop():
            _end(0)
        os.read(self._signals, 1)
        os.read(self._signals, 1)
        _end(1)

    def _begin_stop(self) -> bool:
        """Begin to stop; return whether anything is open."""
        if self._stops is None:
            return False
        self._stopper = threading.Thread(target=_stop, args=self._stops, daemon=True)
        self._stopper.start()
        return True


def _stop(stop_devices: Callable[[], None], stop_rest: Callable[[], None]) -> None:
    end_in(STOP_TIME, 1, "error: the devices could not be stopped in time")
    stop_devices()
    end_in(MIDDLEWARE_TIME, 0)
    stop_rest()


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

    The end of the interpreter is left out: the middleware's threads can outlive it and crash.
    """
    global watch
    watch = SignalWatch()
    code: object = 0
    try:
        importlib.import_module(module).main()
    except SystemExit as end:
        code = end.code or 0
    watch.forget()
    _release()
    if isinstance(code, int):
        _end(code)
    _end(1, str(code))


def _release() -> None:
    """Have the middleware take away its shared memory: nobody holds the node any more.

    Where it hangs it lets no thread of Python run, so faulthandler's ends the process.
    """
    with open(os.devnull, "w") as nowhere:
        faulthandler.dump_traceback_later(MIDDLEWARE_TIME, exit=True, file=nowhere)
        gc.collect()
        faulthandler.cancel_dump_traceback_later()
