# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""From the frames of a stream to samples with their times: the hot path."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from driver_common.sample_clock import HostClock, SampleClock
from icotronic_driver.line import StreamHandler
from icotronic_driver.ordering import Frame, FrameOrder
from icotronic_driver.streaming import COUNTER_TURN, StreamDecoder

CORRECTION = 1 / 256  # of the time between two samples, by which the host's clock may correct it

AT_ONCE = 4  # frames that are handed over when one comes, while some are held

Publish = Callable[[int, float, tuple[int, ...]], None]


class Reception:
    """Puts the frames of a stream in order, decodes them, and gives their samples a time.

    What comes before the clock has settled is held until then: so the first samples of a stream
    have as good a time as all others.
    """

    def __init__(self, decoder: StreamDecoder, clock: SampleClock, host_clock: HostClock,
                 publish: Publish, *, kernel_stamps: bool) -> None:
        """Begin a stream.

        Args:
            decoder: Decodes its frames.
            clock: Gives its samples their times; one that waits.
            host_clock: The time of day.
            publish: Takes the time of a frame's first sample and from one to the next in ns, and
                the raw values.
            kernel_stamps: Whether the bus times are those of this host's kernel.
        """
        self._decoder, self._clock, self._host_clock = decoder, clock, host_clock
        self._publish = publish
        self._kernel_stamps = kernel_stamps
        self._order = FrameOrder(decoder)
        self._unsettled: list[tuple[int, tuple[int, ...]]] = []  # what waits for a good time
        self._held: deque[tuple[int, float, tuple[int, ...]]] = deque()  # and for its turn
        self._correction = int(clock.nominal_period * CORRECTION)

    def handler(self) -> StreamHandler:
        """Return what takes each frame: payload, bus time in s, arrival in monotonic ns."""
        order, take = self._order, self._take

        def handle(data: bytearray, bus_time: float, now: int) -> None:
            if len(data) > 1 and data[1] == order.expected:
                order.expected = (order.expected + 1) % COUNTER_TURN
                take(data, bus_time, now)
            else:
                for frame in order.sort(Frame(data, bus_time, now)):
                    take(*frame)

        return handle

    def finish(self) -> None:
        """Hand over what is held, because nothing more may come."""
        for frame in self._order.rest():
            self._take(*frame)
        self._clock.settle()
        self._stamp()
        self._release(len(self._held))

    def _take(self, data: bytes | bytearray, bus_time: float, now: int) -> None:
        values = self._decoder.decode_frame(bus_time, data, now)
        if values is None:
            return
        clock, host_clock = self._clock, self._host_clock
        data_sets = self._decoder.format.data_sets
        number = self._decoder.number * data_sets
        clock.update(number + data_sets - 1,
                     host_clock.when(bus_time, now) if self._kernel_stamps else now)
        if host_clock.rest:
            host_clock.slew(self._correction)
        if clock.settled and not self._held and not self._unsettled:
            self._publish(clock.time_of(number) + host_clock.offset, clock.period, values)
            return
        self._unsettled.append((number, values))
        if clock.settled:
            self._stamp()
            self._release(AT_ONCE)

    def _stamp(self) -> None:
        """Give what waited its time, before the clock turns to what comes next."""
        clock, offset = self._clock, self._host_clock.offset
        self._held += [(clock.time_of(number) + offset, clock.period_at(number), values)
                       for number, values in self._unsettled]
        self._unsettled.clear()

    def _release(self, most: int) -> None:
        """Hand over what is held, but no more frames than a subscriber's queue has room for."""
        for _ in range(min(most, len(self._held))):
            self._publish(*self._held.popleft())
