# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A recording in the place of a port or a bus: what came then comes again, at the same times.

Each read gets what the read in its place got, each write is what the node wrote then. So the driver
does the same, and time is what it was. Where it does something else, because its parameters or its
version are others, the replay goes on where it fits again: a request that was not made about then
gets the answer that it got at all other times, or none, but never one to something else.
"""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path

from driver_common import clocks
from driver_common.clocks import SECOND, ReplayClock
from driver_common.errors import LinkError, SettingError
from driver_common.flight_recorder import EXTENDED, Entry, FlightRecorder, Kind, frame_of
from driver_common.recording import CAN, Recording, read_recording

SCHEME = "replay://"
INTERFACE = "replay"  # of a CAN bus; the channel is the file
LATE = SECOND  # ns by which something may come later than it is waited for
PATIENCE = 2 * SECOND  # ns for which a request may be later than it was, or earlier
HOLD = SECOND // 5  # ns for which frames are held back for one that is later
PROCESSING = SECOND // 50  # ns that may lie between what came and a request that follows from it

_TIMELESS = (Kind.OFFSET, Kind.CLOCK, Kind.NOTE)


def recording_path(parameters: Mapping[str, object]) -> Path | None:
    """Return the recording that parameters of a node name, None where they name none."""
    port = str(parameters.get("serial_port", ""))
    if port.startswith(SCHEME):
        return Path(port.removeprefix(SCHEME)).expanduser()
    if parameters.get("can_interface") == INTERFACE:
        return Path(str(parameters.get("can_channel", ""))).expanduser()
    return None


class Replay(FlightRecorder):
    """Plays a recording; in the place of what records the link.

    Attributes:
        recording: What is played.
        clock: The time in it.
        arrived: Time in ns of what was read or written last.
        differs: The first request that was not made then, as text; "" while there is none.
    """

    def __init__(self, path: Path, link: str) -> None:
        """Read a recording.

        Raises:
            SettingError: It cannot be read, is damaged, or is not of such a link.
        """
        super().__init__()
        self.path = path
        self.recording: Recording = read_recording(path)
        if self.recording.link != link:
            raise SettingError(f"cannot replay {path}: it is of a {self.recording.link} link, not "
                               f"of a {link} one")
        self.arrived = 0
        self.differs = ""
        self._entries = entries = self.recording.entries
        self._is_can = link == CAN
        self._next = 0
        self._opened = False
        self._sent: set[int] = set()  # places of requests that were made earlier than then
        self._owed: list[Entry] = []  # requests that are later than then
        self._silent = False  # until the next request: nothing but what is borrowed comes
        self._borrowed: deque[Entry] = deque()
        self.clock = ReplayClock(entries[0].time if entries else 0, 0)
        first = next((entry for entry in entries if entry.kind is Kind.OFFSET), None)
        self.offset = self.clock.offset = first.offset if first else 0

    # --- for the links ---

    def open(self) -> None:
        """Go to where the link was opened next; raises LinkError at the end."""
        places = (number for number in range(self._next, len(self._entries)))
        place = next((number for number in places if self._entries[number].kind is Kind.OPENED),
                     None)
        begun = not self._opened and any(entry.kind <= Kind.RECEIVED
                                         for entry in self._entries[:place])
        if place is None and self._opened:
            self._next = len(self._entries)
        if self._next == len(self._entries):
            raise self._ended()
        clocks.use(self.clock)
        self._opened, self._silent = True, False
        self._owed.clear()
        if not begun and place is not None:
            self._skip_to(place + 1)
            self.clock.jump(self._entries[place].time)
        self.arrived = self.clock.now

    def close(self) -> None:
        """Live in the host's time again."""
        clocks.use(None)

    def receive(self, timeout: float) -> Entry | None:
        """Return what came next, None where nothing came for so many s.

        Raises:
            LinkError: The link was lost then, or the recording has ended.
        """
        if self.clock.now > self._entries[-1].time + LATE:
            raise self._ended()
        end = self.clock.now + int(max(timeout, 0.0) * SECOND)
        while not self._silent:
            entry = self._look()
            if entry.kind is Kind.LOST:
                self._take(entry)
                raise LinkError(entry.text)
            if entry.kind is Kind.SENT:
                if self._holds(entry):
                    break
            elif entry.kind is Kind.RECEIVED:
                if entry.time > end + LATE:
                    break
                self._take(entry)
                return entry
            elif entry.time + SECOND // 1000 < end:  # it looked more often then
                self._next += 1
            else:
                self._take(entry)
                return None
        return self._borrow(end)

    def send(self, content: bytes) -> None:
        """Take a request."""
        self._silent = False
        self._owed = [entry for entry in self._owed
                      if entry.time > self.clock.now - PATIENCE]
        for number, entry in enumerate(self._owed):
            if entry.content == content:
                del self._owed[number]
                return
        place = self._place_of(content)
        if place is None:
            self._note_difference(content)
        elif self._is_can and any(entry.kind is Kind.RECEIVED
                                  for entry in self._entries[self._next:place]):
            self._sent.add(place)
        else:
            self._skip_to(place)
            self._take(self._entries[place])

    def _place_of(self, content: bytes) -> int | None:
        """Return where a request was made about now, None where it was not."""
        latest = self.clock.now + PATIENCE
        for place in range(self._next, len(self._entries)):
            entry = self._entries[place]
            if entry.kind is Kind.GAP:
                latest = entry.time + PATIENCE
            elif entry.time > latest:
                break
            if entry.kind is Kind.SENT and entry.content == content and place not in self._sent:
                return place
        return None

    def _note_difference(self, content: bytes) -> None:
        """Take note of a request that was not made then.

        Where it always got the same answer, that one will do, at once; what was measured at
        another time will not.
        """
        if not self.differs and self._next < len(self._entries):
            identifier, data = frame_of(content)[1:] if self._is_can else (0, content)
            what = f"{identifier & ~EXTENDED:08X}#" if self._is_can else ""
            self.differs = what + data.hex().upper()
        if self._is_can:  # its frames come all the time
            return
        self._silent = True
        self._borrowed.clear()
        if content in self._answers:
            self._borrowed += [entry._replace(time=self.clock.now)
                               for entry in self._answers[content]]

    @cached_property
    def _answers(self) -> Mapping[bytes, Sequence[Entry]]:
        """Requests that always got the same answer, each with what came."""
        answers: dict[bytes, list[list[Entry]]] = defaultdict(list)
        answer: list[Entry] = []
        for entry in self._entries:
            if entry.kind is Kind.RECEIVED:
                answer.append(entry)
            elif entry.kind in (Kind.SENT, Kind.LOST, Kind.GAP):
                answer = []
            if entry.kind is Kind.SENT:
                answers[entry.content].append(answer)
        given = {content: [answer for answer in some if answer]
                 for content, some in answers.items()}
        return {content: some[0] for content, some in given.items()
                if len({b"".join(entry.content for entry in answer) for answer in some}) == 1}

    def _borrow(self, end: int) -> Entry | None:
        """Return what belongs to the answer of another time, None where nothing does until then."""
        entry = None
        if self._silent and self._borrowed and self._borrowed[0].time <= end:
            entry = self._borrowed.popleft()
        self.clock.pass_until(entry.time if entry else end)
        self.arrived = self.clock.now
        return entry

    def _holds(self, entry: Entry) -> bool:
        """Whether nothing comes before the request is made that was made then."""
        if self._next not in self._sent:
            if entry.time + (HOLD if self._is_can else PATIENCE) > self.clock.now:
                return True
            if self._is_can:
                self._owed.append(entry)
            else:
                self._skip_answer()
        self._next += 1
        return False

    def _skip_answer(self) -> None:
        """Go before the next thing that does not belong to a request that is not made."""
        while (self._next + 1 < len(self._entries) and self._entries[self._next + 1].kind
               not in (Kind.SENT, Kind.LOST, Kind.OPENED, Kind.GAP)):
            self._next += 1
            self._note_offset(self._entries[self._next])

    # --- what is not read or written ---

    def read_offset(self) -> int:
        """Return the offset between the clocks, as it was read at this place."""
        self._skip_notes()
        if self._next < len(self._entries) and self._entries[self._next].kind is Kind.OFFSET:
            self._pass(self._entries[self._next])
        return self.offset

    def now(self) -> int:
        """Return the time, as it was read at this place."""
        self._skip_notes()
        if self._next < len(self._entries) and self._entries[self._next].kind is Kind.CLOCK:
            entry = self._entries[self._next]
            self._next += 1
            self.clock.hurry(entry.time)
            return entry.time
        return self.clock.now

    def add(self, now: int, kind: Kind, content: bytes = b"") -> None:
        """Do nothing: it is recorded already."""

    def add_offset(self, offset: int) -> None:
        """Do nothing: it is recorded already."""

    # --- places ---

    def _look(self) -> Entry:
        """Return the next entry that is something in itself; raises LinkError at the end."""
        while self._next < len(self._entries):
            entry = self._entries[self._next]
            if entry.kind is Kind.GAP:
                self.clock.jump(entry.time)
            elif entry.kind not in (*_TIMELESS, Kind.OPENED):
                return entry
            self._pass(entry)
        raise self._ended()

    def _pass(self, entry: Entry) -> None:
        self._next += 1
        self._note_offset(entry)

    def _note_offset(self, entry: Entry) -> None:
        if entry.kind is Kind.OFFSET:
            self.offset = self.clock.offset = entry.offset

    def _skip_notes(self) -> None:
        while (self._next < len(self._entries)
               and self._entries[self._next].kind is Kind.NOTE):
            self._next += 1

    def _skip_to(self, place: int) -> None:
        while self._next < place:
            self._pass(self._entries[self._next])
        if place and self._entries[place - 1].time > self.clock.now + LATE:
            self.clock.jump(self._entries[place - 1].time)

    def _take(self, entry: Entry) -> None:
        """Go on behind the next entry, in its time; where a request follows, in that one's."""
        self._next += 1
        self.clock.pass_until(entry.time)
        self.arrived = entry.time
        if self._next < len(self._entries):
            after = self._entries[self._next]
            if after.kind is Kind.SENT and after.time < self.clock.now + PROCESSING:
                self.clock.hurry(after.time)

    def _ended(self) -> LinkError:
        return LinkError(f"the recording {self.path} has ended")
