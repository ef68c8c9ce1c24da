# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Sessions with devices that answer as a script says, in pretended time.

Whatever they do, only the drivers' own errors leave `poll`, each step ends in bounded time,
nothing is published that no device measured, and once they behave again they are found again.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from random import Random
from types import ModuleType
from typing import Any, NamedTuple, Protocol
from unittest.mock import patch

from bench.fuzz.pretended import PretendedClock
from bench.fuzz.script import KINDS, Kind, Script
from driver_common import clocks
from driver_common.clocks import SECOND
from driver_common.errors import DriverError
from driver_common.settings import Value

PLAY_TIME = 20.0  # s for a script, at most
RECOVERY_TIME = 120.0  # s until all is well again behind it
LONGEST_STEP = 60.0  # s
OFTEN = 0.05  # of the steps after which a user writes something
ENOUGH = 3  # measurements that tell that all is well


class _Bus(Protocol):
    """What is played with: a `DeviceBus` that ends."""

    devices: list[Any]

    def open(self) -> None: ...
    def poll(self) -> float: ...
    def write(self, device: Any, changes: Mapping[str, Value]) -> object: ...
    def close(self) -> None: ...


class Act(NamedTuple):
    """What is played.

    Attributes:
        late: Whether the script begins when measurements come, and not at the first answer.
        changes: Settings that a user writes meanwhile.
        value: Returns the value of a setting that the simulated device behind a device has.
        uncertain: Kinds after which the driver may hold other values than the device.
    """

    late: bool
    changes: Mapping[str, Value]
    value: Callable[[Any, str], Value]
    uncertain: Collection[Kind]


class Play:
    """A bus that is polled as its thread would do it."""

    def __init__(self, bus: _Bus, clock: PretendedClock) -> None:
        """Open a bus."""
        self._bus, self._clock = bus, clock
        bus.open()

    def act(self, act: Act, script: Script, heard: list[Any], random: Random) -> None:
        """Have the devices do what the script says, and assert that all is well again then."""
        devices = self._bus.devices
        script.waits = act.late
        self.until(lambda: not act.late or len(heard) >= ENOUGH, PLAY_TIME)
        script.waits = False
        end = self._clock.now + PLAY_TIME * SECOND
        while not script.is_over and self._clock.now < end:
            self._step()
            if random.random() < OFTEN:  # a user changes something
                with contextlib.suppress(DriverError):
                    self._bus.write(random.choice(devices), act.changes)
        script.end()
        begin = len(heard)
        well = self.until(lambda: len(heard) >= begin + ENOUGH * len(devices) and all(
            device.is_connected and device.error is None for device in devices), RECOVERY_TIME)
        assert well, [(str(device), device.error) for device in devices]
        if not any(script.done[kind] for kind in act.uncertain):
            for device in devices:
                for name, value in device.values.items():
                    assert value in ("unknown", act.value(device, name)), name
        self._bus.close()

    def until(self, condition: Callable[[], bool], seconds: float) -> bool:
        """Poll until a condition holds; return False where it does not within some s."""
        end = self._clock.now + int(seconds * SECOND)
        while not condition():
            if self._clock.now > end:
                return False
            self._step()
        return True

    def _step(self) -> None:
        before, pause = self._clock.now, 0.1
        try:
            pause = self._bus.poll()
        except DriverError:
            self._bus.close()
            self._bus.open()
        assert self._clock.now - before < LONGEST_STEP * SECOND
        clocks.sleep(min(pause, 1.0))


def in_order(some: Iterable[object], all_: Iterable[object]) -> bool:
    """Whether some things are among all, in their order, and none of them twice."""
    rest = iter(all_)
    return all(one in rest for one in some)


@contextlib.contextmanager
def linked(lines: ModuleType, kind: str, link: object, recorder: object) -> Iterator[None]:
    """Have a driver's module of lines open this link, "serial" or "can", and record so."""
    with patch.object(lines, f"open_{kind}", lambda *_: link), patch.object(
            lines, f"{kind}_recorder", lambda *_: recorder):
        yield


def _scripts() -> list[bytes]:
    """Return a script for each kind of misbehaviour: from the beginning, and while it measures."""
    scripts = []
    for number, _ in enumerate(KINDS):
        for argument in (0, 20, 255):
            once = bytes((number, argument))
            scripts += [b"\0" + once, b"\0" + 6 * once, b"\0\0\x0a" + once,
                        b"\xff" + once, b"\xff" + 4 * (once + b"\0\5")]
    return scripts


SCRIPTS = _scripts()
