# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The one thread of a bus: it alone talks to the devices, and it never gives up."""

from __future__ import annotations

import itertools
import queue
import threading
import traceback
from collections.abc import Callable, Generator
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeoutError
from typing import Any, Generic, NamedTuple, Protocol, TypeVar, runtime_checkable

from driver_common import clocks as time
from driver_common.errors import DriverError, NoAnswerError, StepInterruptedError

T = TypeVar("T")

CALL_TIMEOUT = 15.0  # s; longer than any single job
LONGEST_PAUSE = 1.0  # s; then the bus shows that it is alive


class Backoff:
    """Growing pauses between attempts.

    Attributes:
        first: First pause in s.
        last: Longest pause in s.
    """

    def __init__(self, first: float = 0.1, last: float = 2.0) -> None:
        """Start with the first pause."""
        self.first = first
        self.last = last
        self._next = first

    def pause(self) -> float:
        """Return the next pause in s, each time twice the one before."""
        pause = min(self._next, self.last)
        self._next = 2 * pause
        return pause

    def reset(self) -> None:
        """Begin again with the first pause."""
        self._next = self.first


class Bus(Protocol):
    """What a driver's session offers to the thread."""

    def open(self) -> None:
        """Open the link; raises DriverError."""

    def poll(self) -> float:
        """Do one step and return how long in s nothing needs to be done; raises DriverError."""

    def close(self) -> None:
        """Leave the devices stopped and close the link, in whatever state they are."""


@runtime_checkable
class Interruptible(Protocol):
    """A bus whose steps can take long."""

    def interrupt(self) -> None:
        """Have the present step end soon with a StepInterruptedError; called from another thread.

        So does all that is asked of the devices until `resume`.
        """

    def resume(self) -> None:
        """Ask the devices again."""


@runtime_checkable
class Patient(Protocol):
    """A bus which lets others be heard within a long step."""

    def while_waiting(self, task: Callable[[], None]) -> None:
        """Have `task` done now and then within a long step; it cannot have the link."""


class _Job(NamedTuple):
    """What is to be done in the thread; the first of them sorts before all others.

    Attributes:
        order: 0 = at once, 1 = in its turn.
        number: Its turn.
        run: What to do.
        future: Takes the result.
    """

    order: int
    number: int
    run: Callable[[], Any]
    future: Future[Any]


class Answer(Generic[T]):
    """The result of a job in the thread of a bus, for whoever asked for it.

    A coroutine awaits it, and its executor serves others meanwhile; anybody else waits for it.
    Either raises what the job raises, or NoAnswerError where its turn does not come.
    """

    def __init__(self, future: Future[T], timeout: float,
                 on_done: Callable[[], object] = lambda: None) -> None:
        """Begin to wait.

        Args:
            future: Takes the result.
            timeout: Time in s after which it is not waited for any more.
            on_done: Has the coroutine go on; called in the thread of the bus.
        """
        self._future = future
        self._timeout = timeout
        self._end = time.monotonic() + timeout
        future.add_done_callback(lambda _: on_done())

    def wait(self) -> T:
        """Wait for the result and return it."""
        try:
            return self._future.result(self._timeout)
        except FutureTimeoutError:
            raise self._given_up() from None

    def __await__(self) -> Generator[Answer[T], None, T]:
        """Return the result; the executor goes on with it at least as often as it has a timer."""
        while not self._future.done():
            if time.monotonic() > self._end:
                raise self._given_up()
            yield self
        return self._future.result()

    def _given_up(self) -> NoAnswerError:
        self._future.cancel()
        return NoAnswerError(f"the device was busy for more than {self._timeout:g} s; try again")


class DeviceThread(threading.Thread):
    """Opens a bus, polls it, and opens it again after errors, for ever.

    Everything that touches the bus runs here; others hand in their work with `call`.
    """

    def __init__(self, name: str, bus: Bus, on_state: Callable[[DriverError | None], None],
                 on_step: Callable[[float], None] = lambda pause: None) -> None:
        """Prepare the thread.

        Args:
            name: Name of the thread.
            bus: The bus to serve.
            on_state: Called in this thread with None when the link was opened and did a first
                step, or with the error that closed it or kept it closed.
            on_step: Called in this thread after each step, with the time in s until the next one.
        """
        super().__init__(name=name, daemon=True)
        self._bus = bus
        self._on_state = on_state
        self._on_step = on_step
        self._jobs: queue.PriorityQueue[_Job] = queue.PriorityQueue()
        self._numbers = itertools.count()
        self._stopping = False
        self._may_interrupt = True  # not while it takes leave of the devices
        self._serving = False  # a user, whose job ends early only where all ends
        self._interrupting = threading.Lock()
        if isinstance(bus, Patient):
            bus.while_waiting(self._run_between)

    def call(self, job: Callable[[], T], timeout: float = CALL_TIMEOUT, *,
             interrupt: bool = False) -> T:
        """Run `job` in the thread of the bus and return its result, or raise what it raises.

        Args:
            job: What to do.
            timeout: Time in s after which it is not waited for any more.
            interrupt: Whether what is being done now ends for it, where the bus can do that.
        """
        if threading.current_thread() is self:
            return job()
        return self.ask(job, timeout, interrupt=interrupt).wait()

    def ask(self, job: Callable[[], T], timeout: float = CALL_TIMEOUT, *,
            interrupt: bool = False, on_done: Callable[[], object] = lambda: None) -> Answer[T]:
        """Have `job` run in the thread of the bus and return its answer; see `call`, `Answer`."""
        if self._stopping or not self.is_alive():
            raise NoAnswerError("the link is closed")
        return Answer(self._put(job, at_once=interrupt), timeout, on_done)

    def post(self, job: Callable[[], Any]) -> None:
        """Have `job` run in the thread of the bus, without waiting for it."""
        self._put(job)

    def stop(self) -> None:
        """Close the bus, end the thread and wait for it."""
        self._stopping = True
        self._put(lambda: None, at_once=True)
        if self.is_alive():
            self.join()

    def run(self) -> None:
        """Keep the bus open until `stop`."""
        backoff = Backoff()
        while not self._stopping:
            try:
                self._resume()  # an interruption may have come too late
                self._bus.open()
                works = False  # some links fail only when they are used
                while not self._stopping:
                    pause = self._step()
                    if not works:
                        works = True
                        backoff.reset()
                        self._on_state(None)
                    self._on_step(pause)
                    self._run_jobs(pause)
            except DriverError as error:
                if not self._stopping:
                    self._on_state(error)
            except Exception as error:  # a bug must not end the driver
                self._on_state(_internal(error))
            finally:
                with self._interrupting:
                    self._may_interrupt = False
                self._bus.close()
                self._may_interrupt = True
            if not self._stopping:
                self._run_jobs(backoff.pause())
        self._run_jobs(0)

    def _step(self) -> float:
        """Do one step; return the time in s until the next one, 0 where it was interrupted."""
        try:
            return min(self._bus.poll(), LONGEST_PAUSE)
        except StepInterruptedError:
            if self._stopping:
                raise
            self._resume()  # what it was interrupted for may be done already
            return 0.0

    def _put(self, job: Callable[[], T], *, at_once: bool = False) -> Future[T]:
        """Have a job run in this thread, before all others and what is being done now or not."""
        future: Future[T] = Future()
        self._jobs.put(_Job(0 if at_once else 1, next(self._numbers), job, future))
        with self._interrupting:
            if (at_once and self._may_interrupt and (self._stopping or not self._serving)
                    and isinstance(self._bus, Interruptible)):
                self._bus.interrupt()
        return future

    def _resume(self) -> None:
        if not self._stopping and isinstance(self._bus, Interruptible):
            self._bus.resume()

    def _run_between(self) -> None:
        """Run waiting jobs within a long step."""
        self._on_step(0.0)
        self._run_jobs(0)

    def _run_jobs(self, pause: float) -> None:
        """Run waiting jobs; with none waiting, wait up to `pause` s for the first one."""
        try:
            pause = time.waited(pause) if pause > 0 else 0.0
            job = self._jobs.get(timeout=pause) if pause > 0 else self._jobs.get_nowait()
            while True:
                self._run_job(job)
                job = self._jobs.get_nowait()
        except queue.Empty:
            pass

    def _run_job(self, job: _Job) -> None:
        if not job.future.set_running_or_notify_cancel():
            return
        with self._interrupting:
            self._serving = True
            self._resume()  # the step that was interrupted is over
        try:
            job.future.set_result(job.run())
        except Exception as error:  # belongs to the caller
            job.future.set_exception(error)
        self._serving = False


def _internal(error: Exception) -> DriverError:
    where = traceback.extract_tb(error.__traceback__)[-1]
    return DriverError(f"internal error, please report it: {type(error).__name__}: {error} "
                       f"({where.filename}:{where.lineno})")
