# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The thread of a bus: it runs the work of others, and opens the bus again for ever."""

from __future__ import annotations

import queue
import threading

import pytest

from driver_common.device_thread import LONGEST_PAUSE, Backoff, DeviceThread
from driver_common.errors import (
    DriverError,
    LinkError,
    NoAnswerError,
    RefusedError,
    StepInterruptedError,
)

DEADLINE = 60.0  # s; far more than anything takes, also on a busy machine
FOREVER = 3600.0  # s


class FakeBus:
    """A bus whose steps wait for the test: each poll takes what `steps` holds."""

    def __init__(self):
        self.steps = queue.SimpleQueue()
        self.failures = []
        self.events = []

    def open(self):
        if self.failures:
            raise self.failures.pop(0)
        self.events.append("open")

    def poll(self):
        self.events.append("poll")
        step = self.steps.get(timeout=DEADLINE)
        if isinstance(step, Exception):
            raise step
        return step

    def close(self):
        self.events.append("close")


class InterruptibleBus(FakeBus):
    """A bus whose present step can be ended."""

    def __init__(self):
        super().__init__()
        self.interrupted = threading.Event()

    def interrupt(self):
        self.interrupted.set()
        self.steps.put(StepInterruptedError("interrupted"))

    def resume(self):
        self.events.append("resume")


@pytest.fixture
def bus():
    return FakeBus()


@pytest.fixture
def start():
    """Start threads, each with a queue of the states that it told."""
    threads = []

    def start_one(bus):
        states = queue.SimpleQueue()
        thread = DeviceThread("bus", bus, states.put)
        threads.append((thread, bus))
        thread.start()
        return thread, states

    yield start_one
    for thread, bus in threads:
        bus.steps.put(FOREVER)
        thread.stop()


def next_state(states):
    return states.get(timeout=DEADLINE)


def opened(bus, states):
    """Let the bus do its first step, and hear that it is open."""
    bus.steps.put(0.0)
    assert next_state(states) is None


def test_pauses_double_up_to_the_longest():
    backoff = Backoff(0.1, 2.0)
    pauses = [backoff.pause() for _ in range(7)]
    assert pauses == pytest.approx([0.1, 0.2, 0.4, 0.8, 1.6, 2.0, 2.0])
    backoff.reset()
    assert backoff.pause() == 0.1


def test_a_shorter_longest_pause_counts_at_once():
    backoff = Backoff(0.1, 10.0)
    for _ in range(7):
        backoff.pause()
    backoff.last = 2.0
    assert backoff.pause() == 2.0


def test_work_runs_in_the_thread_and_gives_its_result(bus, start):
    thread, _ = start(bus)
    bus.steps.put(FOREVER)
    assert thread.call(threading.current_thread) is thread


def test_work_does_not_wait_for_the_pause_of_the_bus(bus, start):
    thread, _ = start(bus)
    bus.steps.put(FOREVER)
    assert thread.call(lambda: 1) == 1
    bus.steps.put(FOREVER)
    assert thread.call(lambda: 2) == 2


def test_work_that_fails_fails_for_its_caller_alone(bus, start):
    thread, states = start(bus)
    opened(bus, states)
    for error in (RefusedError("no"), ZeroDivisionError("oh")):
        def fail(error=error):
            raise error

        bus.steps.put(FOREVER)
        with pytest.raises(type(error), match=str(error)):
            thread.call(fail)
    bus.steps.put(FOREVER)
    assert thread.call(lambda: 5) == 5
    assert states.empty()


def test_work_may_ask_for_more_work(bus, start):
    thread, _ = start(bus)
    bus.steps.put(FOREVER)
    assert thread.call(lambda: thread.call(lambda: 7)) == 7


def test_posted_work_is_done_without_waiting(bus, start):
    thread, _ = start(bus)
    done = threading.Event()
    thread.post(done.set)  # the bus is in the midst of its step
    assert not done.is_set()
    bus.steps.put(FOREVER)
    assert done.wait(DEADLINE)


def test_a_bus_that_is_busy_is_not_waited_for_and_the_work_is_forgotten(bus, start):
    thread, _ = start(bus)
    done = []
    with pytest.raises(NoAnswerError, match=r"busy for more than 0\.05 s"):
        thread.call(lambda: done.append(1), timeout=0.05)
    bus.steps.put(FOREVER)
    assert thread.call(lambda: 2) == 2
    assert done == []


def test_a_bus_that_cannot_be_opened_is_tried_again(bus, start):
    bus.failures = [LinkError("not there"), LinkError("not there")]
    thread, states = start(bus)
    assert [str(next_state(states)) for _ in range(2)] == ["not there", "not there"]
    opened(bus, states)
    bus.steps.put(FOREVER)
    thread.call(lambda: None)
    assert bus.events[:4] == ["close", "close", "open", "poll"]


def test_work_is_done_also_while_the_bus_is_closed(bus, start):
    bus.failures = [LinkError("not there")] * 1000
    thread, states = start(bus)
    next_state(states)
    assert thread.call(lambda: list(bus.events))
    with pytest.raises(NoAnswerError, match="not connected"):
        thread.call(lambda: (_ for _ in ()).throw(NoAnswerError("not connected")))


def test_after_an_error_the_bus_is_closed_and_opened_again(bus, start):
    _, states = start(bus)
    opened(bus, states)
    bus.steps.put(LinkError("unplugged"))
    assert str(next_state(states)) == "unplugged"
    opened(bus, states)
    assert bus.events[:5] == ["open", "poll", "poll", "close", "open"]


def test_a_bus_that_opens_but_does_not_work_is_not_told_as_open(bus, start, monkeypatch):
    pauses, pause = [], Backoff.pause
    monkeypatch.setattr(Backoff, "pause", lambda self: pauses.append(pause(self)) or 0.0)
    for _ in range(3):
        bus.steps.put(LinkError("it is down"))
    _, states = start(bus)
    assert [str(next_state(states)) for _ in range(3)] == ["it is down"] * 3
    opened(bus, states)
    assert pauses == [0.1, 0.2, 0.4]  # it starts anew when the bus works, not when it is open


def test_after_each_step_it_is_said_how_long_nothing_needs_to_be_done(bus):
    pauses = queue.SimpleQueue()
    thread = DeviceThread("bus", bus, lambda error: None, pauses.put)
    for pause in (0.0, 0.01, FOREVER):
        bus.steps.put(pause)
    thread.start()
    assert [pauses.get(timeout=DEADLINE) for _ in range(3)] == [0.0, 0.01, LONGEST_PAUSE]
    thread.stop()


def test_an_error_in_the_code_is_told_with_its_place_and_ends_nothing(bus, start):
    _, states = start(bus)
    opened(bus, states)
    bus.steps.put(ZeroDivisionError("oh"))
    error = next_state(states)
    assert isinstance(error, DriverError)
    assert "internal error, please report it: ZeroDivisionError: oh" in str(error)
    assert "test_device_thread.py:" in str(error)
    opened(bus, states)


def test_stopping_closes_the_bus_and_ends_the_thread(bus, start):
    thread, states = start(bus)
    opened(bus, states)
    bus.steps.put(0.0)
    bus.steps.put(FOREVER)
    thread.stop()
    assert not thread.is_alive()
    assert bus.events[-1] == "close"
    with pytest.raises(NoAnswerError, match="the link is closed"):
        thread.call(lambda: None)


def test_stopping_does_not_wait_for_a_long_pause(bus, start):
    bus.failures = [LinkError("not there")] * 1000
    thread, states = start(bus)
    next_state(states)
    thread.stop()
    assert not thread.is_alive()


def test_users_are_heard_within_a_long_step_where_the_bus_lets_them(start):
    class PatientBus(FakeBus):
        def while_waiting(self, task):
            self.task = task

        def poll(self):
            while True:
                try:
                    return self.steps.get(timeout=0.01)
                except queue.Empty:
                    self.task()

    bus = PatientBus()
    thread, _ = start(bus)
    assert thread.call(lambda: "heard") == "heard"  # though no step has ended


def test_stopping_interrupts_a_step_where_the_bus_can(start):
    bus = InterruptibleBus()
    thread, states = start(bus)
    opened(bus, states)
    thread.stop()
    assert not thread.is_alive()
    assert states.empty()  # the interruption is no error


def test_what_cannot_wait_ends_a_step_without_an_error(start):
    bus = InterruptibleBus()
    thread, states = start(bus)
    opened(bus, states)
    assert thread.call(lambda: bus.events[-1], DEADLINE, interrupt=True) == "resume"
    assert "close" not in bus.events
    assert states.empty()


def test_what_cannot_wait_comes_first_but_lets_the_job_of_another_user_end(start):
    bus = InterruptibleBus()
    thread, states = start(bus)
    opened(bus, states)
    done, answers = [], []

    def job():
        answers.append(thread.ask(lambda: done.append("usual"), DEADLINE))
        answers.append(thread.ask(lambda: done.append("urgent"), DEADLINE, interrupt=True))
        done.append("interrupted" if bus.interrupted.is_set() else "whole")

    bus.steps.put(0.0)
    thread.call(job, DEADLINE)
    bus.steps.put(0.0)
    for answer in answers:
        answer.wait()
    assert done == ["whole", "urgent", "usual"]


def test_stopping_interrupts_the_job_of_a_user_as_well(start):
    bus = InterruptibleBus()
    thread, states = start(bus)
    opened(bus, states)
    begun = threading.Event()

    def job():
        begun.set()
        if not bus.interrupted.wait(DEADLINE):
            raise AssertionError("it was left alone")
        raise StepInterruptedError("interrupted")

    bus.steps.put(0.0)
    answer = thread.ask(job, DEADLINE)
    assert begun.wait(DEADLINE)
    thread.stop()
    with pytest.raises(StepInterruptedError):
        answer.wait()


def test_an_answer_can_be_awaited(bus, start):
    thread, states = start(bus)
    opened(bus, states)
    done = threading.Event()

    async def ask():
        return await thread.ask(lambda: 7, DEADLINE, on_done=done.set)

    coroutine = ask()
    assert coroutine.send(None) is not None  # the bus is in the midst of its step
    bus.steps.put(FOREVER)
    assert done.wait(DEADLINE)
    with pytest.raises(StopIteration) as end:
        coroutine.send(None)
    assert end.value.value == 7


def test_an_answer_that_does_not_come_is_awaited_no_longer(bus, start):
    thread, _ = start(bus)
    done = []

    async def ask():
        return await thread.ask(lambda: done.append(1), timeout=0.0)

    coroutine = ask()
    with pytest.raises(NoAnswerError, match="busy for more than 0 s"):
        list(iter(lambda: coroutine.send(None), None))  # again and again
    bus.steps.put(FOREVER)
    assert thread.call(lambda: 2) == 2
    assert done == []


def test_an_interruption_that_comes_too_late_changes_nothing(start):
    bus = InterruptibleBus()
    thread, states = start(bus)
    opened(bus, states)
    bus.interrupt()
    assert thread.call(lambda: "done", DEADLINE, interrupt=True) == "done"
    assert "close" not in bus.events
    assert states.empty()


def test_a_thread_that_was_never_started_can_be_stopped(bus):
    thread = DeviceThread("bus", bus, lambda error: None)
    thread.stop()
    with pytest.raises(NoAnswerError):
        thread.call(lambda: None)
