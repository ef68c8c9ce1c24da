# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Measuring: start and stop, several radars in turn, one measurement after the other."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

from driver_common import clocks as time
from driver_common.errors import FrameError, RefusedError
from driver_common.host_pauses import NOTEWORTHY
from driver_common.settings import Value
from isys_radar_driver import commands
from isys_radar_driver.access import Access
from isys_radar_driver.frames import READ_TARGET_LIST, Frame
from isys_radar_driver.line import LATENCY
from isys_radar_driver.listener import Listener
from isys_radar_driver.plausibility import MEMORY_CYCLES, SHORT_MEMORY
from isys_radar_driver.radar import Radar
from isys_radar_driver.targets import Resolution, TargetList, decode_target_list

NEWS_TIME = 1.0  # s after a list; later the next one is taken if it is possible at all
REALIGN_PERIOD = 30.0  # s between restarts of a radar that is out of its turn


class Acquisition:
    """The measuring of the radars on a line."""

    def __init__(self, access: Access, radars: Sequence[Radar], wants: Callable[[Radar], bool],
                 listener: Listener) -> None:
        """Measure with radars that share a line.

        Args:
            access: Requests to a radar.
            radars: All radars on the line.
            wants: Whether a radar is to measure.
            listener: Told of every measurement.
        """
        self._access = access
        self._radars = radars
        self._wants = wants
        self._listener = listener

    # --- start and stop ---

    def start_or_stop(self, radar: Radar) -> None:
        """Have a radar measure, or not, as it is wanted; raises DriverError."""
        if not self._wants(radar):
            self.stop(radar)
        elif not radar.measuring:
            self._start(radar)
        radar.due = 0.0

    def _start(self, radar: Radar) -> None:
        """Start; a radar that refuses may measure already (section 3.3.12): it is stopped first."""
        radar.measuring = None
        try:
            self._start_in_turn(radar)
        except RefusedError:
            self.stop(radar)
            self._start_in_turn(radar)
        radar.measuring = True

    def _start_in_turn(self, radar: Radar) -> None:
        """Start so that the cycles of the radars on the line end one after the other.

        Each answers at the end of its cycle. Where those come together, a radar's cycle passes
        while the line waits for another one.
        """
        turn = self._turn_of(radar)
        if turn is not None:
            time.sleep((turn - time.monotonic()) % radar.cycle_time)
        self._access.execute(radar, commands.START)
        radar.forget_lists()
        radar.cycle_end = radar.aligned = time.monotonic()

    def stop(self, radar: Radar) -> None:
        """Stop; one of which nobody knows whether it measures may refuse that if it does not."""
        before, radar.measuring = radar.measuring, None
        if before is not False:
            try:
                self._access.execute(radar, commands.STOP)
            except RefusedError:  # "not in the right measurement mode" (section 3.3.12)
                if before:
                    raise
            radar.forget_lists()
        radar.measuring = False

    def write(self, radar: Radar, changes: Mapping[str, Value]) -> dict[str, Value]:
        """Write settings, stopped where that is needed; see `Device.write`."""
        with self.stopped_for(radar, changes):
            return radar.write(self._access.records(radar), changes)

    @contextlib.contextmanager
    def stopped_for(self, radar: Radar, changes: Iterable[str]) -> Iterator[None]:
        """Stop the acquisition around changes that need it."""
        needed = radar.measuring is not False and any(
            radar.settings[name].needs_stop for name in changes if name in radar.settings)
        if needed:
            self.stop(radar)
        try:
            yield
        finally:
            if needed:
                with contextlib.suppress(RefusedError):  # it is told again in its next turn
                    self.start_or_stop(radar)

    # --- measure ---

    def measure(self, radar: Radar) -> None:
        """Read one target list, and what else was asked for; raises DriverError."""
        model, options, listener = radar.known_model, radar.options, self._listener
        resolution = self.resolution(radar)
        timeout = max(model.timeout, 1.1 * radar.cycle_time) + LATENCY
        targets, stamp = self._read_target_list(radar, resolution, timeout)
        begin = _monotonic(stamp)
        if self._is_timeless():
            return
        if self._objection(radar, targets, begin):
            radar.statistics.implausible_lists += 1
            return
        missed = radar.count_list(begin, clipping=targets.clipping, shared=len(self._radars) > 1)
        listener.on_target_list(radar, targets, radar.time_in_cycle(
            stamp, self._access.line.recorder.offset))
        if options.read_range_list and model.supports(commands.READ_RANGE_LIST):
            range_list, stamp = self._access.timed(radar, commands.READ_RANGE_LIST, timeout)
            if self._is_timeless():
                return
            if radar.limits().allow_range(range_list.range):
                listener.on_range_list(radar, range_list, targets, stamp)
            else:
                radar.statistics.implausible_lists += 1
        if options.read_digital_outputs and model.supports(commands.READ_DIGITAL_OUTPUTS):
            outputs, stamp = self._access.timed(radar, commands.READ_DIGITAL_OUTPUTS, timeout)
            if not self._is_timeless():
                listener.on_digital_outputs(radar, outputs, stamp)
        if missed:
            self._align(radar)

    def _is_timeless(self) -> bool:
        """Whether nobody knows when the last reply came, because this host slept meanwhile."""
        return self._access.line.overdue > NOTEWORTHY

    def _read_target_list(self, radar: Radar, resolution: Resolution,
                          timeout: float) -> tuple[TargetList, int]:
        range_step, output = radar.known_model.range_step_16, radar.options.output
        line = self._access.line
        line.parser.fixed_targets = radar.fixed_targets if resolution.fixed_length else None

        def decode(frame: Frame) -> TargetList:
            return decode_target_list(frame, range_step, resolution.bits)

        try:
            targets, stamp = self._access.exchange(
                radar, commands.read_target_list(radar.address, output, resolution), decode,
                timeout, attempts=1, damaged_attempts=1)
        except RefusedError as error:
            raise RefusedError(
                f"no target list of output {output} in {resolution.bits} bit, change output or "
                f"target_list_resolution: {error}") from None
        except FrameError:
            damaged = line.parser.damaged_frame
            with contextlib.suppress(FrameError):
                if damaged is not None and damaged.function_code == READ_TARGET_LIST:
                    begin = _monotonic(line.reply_began)
                    radar.continuity.follow(decode(damaged), begin,
                                            begin - MEMORY_CYCLES * radar.cycle_time, whole=False)
            raise
        radar.fixed_targets = line.parser.fixed_targets or 0
        return targets, stamp

    def _objection(self, radar: Radar, targets: TargetList, begin: float) -> str:
        """Return why a list that began at a monotonic time in s cannot be true, or ""."""
        line = self._access.line
        objection = radar.limits(own=line.in_doubt).objection(targets)
        if radar.limits().objection(targets):  # what only its own filters object to is no damage
            line.damaged = time.monotonic()
        memory = MEMORY_CYCLES if line.in_doubt else SHORT_MEMORY
        jump = radar.continuity.follow(targets, begin, begin - memory * radar.cycle_time)
        has_news = bool(radar.arrivals) and begin < radar.arrivals[-1] + NEWS_TIME
        return objection or (jump if line.in_doubt and has_news else "")

    def resolution(self, radar: Radar) -> Resolution:
        """Return the resolution of the target lists; raises SettingError."""
        return radar.resolution(self._access.line.link.baud_rate, len(self._radars))

    # --- turns ---

    def _turn_of(self, radar: Radar) -> float | None:
        """Return when one of its cycles should end; None where there is no radar like it."""
        other = next((other for other in self._radars if other is not radar and other.sends_lists
                      and other.cycle_time == radar.cycle_time), None)
        if other is None:
            return None
        places = self._radars.index(radar) - self._radars.index(other)
        return other.cycle_end + places * self._share_of_cycle(radar)

    def _align(self, radar: Radar) -> None:
        """Start a radar again that is out of its turn, as the clocks of radars drift apart."""
        turn, share = self._turn_of(radar), self._share_of_cycle(radar)
        if (turn is None or time.monotonic() < radar.aligned + REALIGN_PERIOD
                or self._list_seconds(radar) > share):
            return
        if abs(math.remainder(radar.cycle_end - turn, radar.cycle_time)) > share / 4:
            self.stop(radar)
            self._start(radar)

    def has_time_for(self, radar: Radar, seconds: float) -> bool:
        """Whether something else can be done on the line without costing a cycle."""
        return self._list_seconds(radar) + seconds < self._share_of_cycle(radar)

    def _list_seconds(self, radar: Radar) -> float:
        """Return how long the longest target list takes on the line."""
        return self._access.line.link.seconds(radar.list_size(self.resolution(radar)))

    def _share_of_cycle(self, radar: Radar) -> float:
        """Return how long the line may serve a radar in a cycle, so that each gets its own."""
        return radar.cycle_time / len(self._radars)

    def least_rate(self, radar: Radar) -> float:
        """Return the target lists per second which a radar gets whatever the others do.

        In the worst case the cycles end together, and each radar waits for a cycle of every other.
        """
        waiting = sum(other.cycle_time for other in self._radars
                      if other.sends_lists and other is not radar)
        return 1 / (radar.cycle_time + waiting)


def _monotonic(stamp: int) -> float:
    """Return the monotonic time in s of a host's time in ns."""
    return time.monotonic() - (time.time_ns() - stamp) * 1e-9
