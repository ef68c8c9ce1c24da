# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The flight recorder: what it keeps, what that takes, and its text."""

from __future__ import annotations

import io

import can
import pytest
from operations import calls

from driver_common import flight_recorder
from driver_common.errors import SettingError
from driver_common.flight_recorder import (
    ERROR,
    EXTENDED,
    REMOTE,
    Entry,
    FlightRecorder,
    Frame,
    Kind,
    frame_of,
    pack_frame,
    pack_offset,
    unpack,
)
from driver_common.recording import (
    CAN,
    FORMAT,
    LONGEST_COMMENT,
    SERIAL,
    RecordingText,
    read_recording,
)

SECOND = 10 ** 9
OFFSET = 1_764_098_073_123_456_789  # ns


class Clock:
    """The clock of the recorder."""

    def __init__(self):
        self.now = 1000 * SECOND

    def monotonic_ns(self):
        return self.now

    def time_ns(self):
        return self.now + OFFSET


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(flight_recorder, "time", clock)
    return clock


@pytest.fixture
def recorder(clock):
    return FlightRecorder()


def entries(recorder):
    """Return what is kept, but for the offset at the start."""
    parts, _ = recorder.snapshot()
    return [entry for entry in unpack(parts) if entry.kind is not Kind.OFFSET]


def fill(recorder, clock, seconds, rate=10, size=100):
    for _ in range(int(seconds * rate)):
        clock.now += SECOND // rate
        recorder.add(clock.now, Kind.RECEIVED, bytes(size))


def kept_bytes(recorder):
    parts, _ = recorder.snapshot()
    return sum(map(len, parts))


# --- what is kept ------------------------------------------------------------------------------

def test_what_happened_comes_back_as_it_was(recorder, clock):
    frame = Frame(1.5, 0x14C00DC1 | EXTENDED, b"\x01\x02")
    recorder.add(clock.now + 1, Kind.SENT, b"\x10\xFF")
    recorder.add(clock.now + 2, Kind.NOTHING)
    recorder.add_frame(clock.now + 3, Kind.RECEIVED, *frame)
    recorder.note("found: Ä")
    sent, nothing, received, note = entries(recorder)
    assert sent == (clock.now + 1, Kind.SENT, b"\x10\xFF")
    assert nothing == (clock.now + 2, Kind.NOTHING, b"")
    assert frame_of(received.content) == frame
    assert note.text == "found: Ä"


def test_the_offset_between_the_clocks_is_kept_where_it_changes(recorder):
    recorder.add_offset(OFFSET)
    recorder.add_offset(OFFSET + 5)
    parts, _ = recorder.snapshot()
    assert [entry.offset for entry in unpack(parts)] == [OFFSET, OFFSET + 5]


def test_after_a_host_that_slept_the_newest_is_there(recorder, clock):
    fill(recorder, clock, 5)
    clock.now += 3600 * SECOND
    recorder.add(clock.now, Kind.RECEIVED, b"awake")
    recorder.add(clock.now + 1, Kind.RECEIVED, b"again")
    assert [entry.content for entry in entries(recorder)][-2:] == [b"awake", b"again"]


def test_the_last_minute_is_kept_and_not_much_more(recorder, clock):
    fill(recorder, clock, 200)
    times = [entry.time for entry in entries(recorder)]
    assert clock.now - 63 * SECOND <= times[0] <= clock.now - 60 * SECOND
    assert times[-1] == clock.now


@pytest.mark.parametrize("size", [1, 100, 65_535])
def test_no_traffic_takes_more_than_16_mib(recorder, clock, size):
    per_second = 2 * flight_recorder.MEMORY // 60 // size + 1
    recorder.add(clock.now, Kind.SENT, b"")
    for _ in range(5):
        fill(recorder, clock, 10, min(per_second, 20_000), size)
        recorder.keep_search()
    assert kept_bytes(recorder) <= 16 * 1024 * 1024


def test_how_a_device_was_found_is_kept_for_ever(recorder, clock):
    recorder.add(clock.now, Kind.SENT, b"who are you")
    fill(recorder, clock, 2)
    recorder.keep_search()
    recorder.add(clock.now + 1, Kind.SENT, b"start")
    fill(recorder, clock, 600)
    kept = entries(recorder)
    contents = [entry.content for entry in kept]
    assert b"who are you" in contents
    assert b"start" in contents
    (gap,) = [number for number, entry in enumerate(kept) if entry.kind is Kind.GAP]
    assert kept[gap + 1].time - kept[gap - 1].time > 500 * SECOND
    assert [entry.time for entry in kept] == sorted(entry.time for entry in kept)


def test_devices_that_come_and_go_do_not_fill_the_memory(recorder, clock):
    for _ in range(100):
        fill(recorder, clock, 11, 100, 1000)
        recorder.keep_search()
    fill(recorder, clock, 100)
    (search, _), _ = recorder.snapshot()
    assert 0 < len(search) <= flight_recorder.SEARCH_MEMORY


def test_pieces_one_after_the_other_are_the_whole(recorder, clock):
    since, pieces = 0, []
    for _ in range(30):
        fill(recorder, clock, 0.7)
        parts, since = recorder.snapshot(since, growing=False)
        pieces += unpack(parts)
    parts, since = recorder.snapshot(since)
    pieces += unpack(parts)
    assert [entry for entry in pieces if entry.kind is not Kind.OFFSET] == entries(recorder)


def test_a_piece_that_was_forgotten_before_it_was_asked_for_is_a_gap(recorder, clock):
    fill(recorder, clock, 5)
    _, since = recorder.snapshot(growing=False)
    fill(recorder, clock, 100)
    parts, _ = recorder.snapshot(since)
    assert next(unpack(parts)).kind is Kind.GAP


# --- as text -----------------------------------------------------------------------------------

FACTS = {"node": "/isys_radar", "because": "of\x1b[31m a test\n# end 0"}
PARAMETERS = {"front.address": 7, "sensors": ["front", "rear"], "frame_id": "a b: c"}
SERIAL_ENTRIES = [
    Entry(5 * SECOND + 1, Kind.OFFSET, pack_offset(OFFSET - 3)),
    Entry(5 * SECOND + 2, Kind.OPENED),
    Entry(6 * SECOND, Kind.SENT, bytes.fromhex("10 05 FF")),
    Entry(6 * SECOND + 999_999_999, Kind.RECEIVED, bytes(range(256))),
    Entry(8 * SECOND, Kind.NOTHING),
    Entry(8 * SECOND, Kind.GAP),
    Entry(9 * SECOND, Kind.LOST, b"lost /dev/ttyUSB0: it is gone; is it plugged in?"),
    Entry(9 * SECOND, Kind.NOTE, b"found radar: iSYS-4001"),
]


def frame(time, kind, identifier=0x14C00DC1 | EXTENDED, data=b"\x80\x01", bus_time=1.25):
    return Entry(time, kind, pack_frame(Frame(bus_time, identifier, data)))


CAN_ENTRIES = [
    frame(5 * SECOND + 123, Kind.SENT, bus_time=0.0),
    frame(5 * SECOND + 456, Kind.RECEIVED, bus_time=1764098078.123456),
    frame(5 * SECOND + 457, Kind.RECEIVED, bus_time=1764098078.123456 + 3e-7),  # of a kernel
    frame(5 * SECOND + 457, Kind.RECEIVED, bus_time=12.5),  # since the adapter was plugged in
    Entry(5 * SECOND + 500, Kind.NOTHING),
    frame(6 * SECOND, Kind.RECEIVED, 0x123, b""),
    frame(6 * SECOND, Kind.RECEIVED, 0x14C00DC1 | EXTENDED | REMOTE, b""),
    frame(6 * SECOND, Kind.RECEIVED, ERROR | EXTENDED | 0x40, bytes(8)),
    frame(6 * SECOND, Kind.RECEIVED, bus_time=1700001000.3220038),
    frame(6 * SECOND, Kind.RECEIVED, bus_time=1700001000.5340059),
    *[frame(7 * SECOND + number, Kind.RECEIVED) for number in range(200)],
]


def text_of(link, entries, channel="can0"):
    text = RecordingText(link, channel, OFFSET)
    return "".join([*text.head(FACTS, PARAMETERS), *text.body(entries), *text.end()])


@pytest.fixture
def read(tmp_path):
    def read_text(text):
        path = tmp_path / "recording.log"
        path.write_text(text)
        return read_recording(path)

    return read_text


@pytest.mark.parametrize(("link", "entries"), [(SERIAL, SERIAL_ENTRIES), (CAN, CAN_ENTRIES)])
def test_a_recording_is_read_as_it_was_written(read, link, entries):
    recording = read(text_of(link, entries))
    assert recording.link == link
    assert recording.entries == entries
    assert recording.parameters == PARAMETERS
    assert recording.facts["node"] == "/isys_radar"


def test_the_text_of_a_serial_line_is_as_documented():
    assert text_of(SERIAL, SERIAL_ENTRIES[:3] + SERIAL_ENTRIES[4:5]).splitlines() == [
        "# industrial_sensor_drivers recording, format 1, serial",
        "# base: 1764098073123456789",
        "# node: /isys_radar",
        "# because: of\N{REPLACEMENT CHARACTER}[31m a test\N{REPLACEMENT CHARACTER}# end 0",
        "# parameter front.address: 7",
        '# parameter sensors: ["front", "rear"]',
        '# parameter frame_id: "a b: c"',
        "# (1764098078.123456790) offset 1764098073123456786",
        "# (1764098078.123456791) opened",
        "(1764098079.123456789) > 10 05 FF",
        "# (1764098081.123456789) nothing",
        "# end 4"]


def test_the_frames_of_a_can_bus_are_as_candump_writes_them():
    frames = [line for line in text_of(CAN, CAN_ENTRIES[:8]).splitlines() if line[0] == "("]
    assert frames == [
        "(1764098078.123456) can0 14C00DC1#8001 T",
        "(1764098078.123456) can0 14C00DC1#8001 R",
        "(1764098078.123456) can0 14C00DC1#8001 R",
        "(12.500000) can0 14C00DC1#8001 R",
        "(1.250000) can0 123# R",
        "(1.250000) can0 14C00DC1#R R",
        "(1.250000) can0 20000040#0000000000000000 R"]


def test_python_can_reads_the_frames():
    frames = "".join(line + "\n" for line in text_of(CAN, CAN_ENTRIES).splitlines()
                     if line[0] == "(")
    sent, received, *rest = can.CanutilsLogReader(io.StringIO(frames))
    assert (sent.arbitration_id, sent.is_extended_id, sent.is_rx) == (0x14C00DC1, True, False)
    assert bytes(received.data) == b"\x80\x01"
    assert received.is_rx
    assert len(rest) == len(CAN_ENTRIES) - 3


def test_comments_fit_the_buffer_of_canplayer():
    long = [Entry(1, Kind.NOTE, b"x" * 1000), Entry(1, Kind.NOTE, "→".encode() * 1000),
            *CAN_ENTRIES]
    comments = [line for line in text_of(CAN, long).splitlines() if line[0] != "("]
    assert max(len(line.encode()) for line in comments) <= LONGEST_COMMENT + 20 < 398


def test_a_channel_cannot_break_the_format(read):
    assert read(text_of(CAN, CAN_ENTRIES, "a b\n# c")).entries == CAN_ENTRIES


GOOD = text_of(SERIAL, SERIAL_ENTRIES)


@pytest.mark.parametrize(("text", "fault"), [
    ("", "it is no recording of this package"),
    ("(1.0) can0 123#00 R\n", "it is no recording of this package"),
    (f"{FORMAT}, lin\n", "it is no recording of this package"),
    ("\x7fELF\x00\xff", "it is no recording of this package"),
    (GOOD.rpartition("# end")[0], 'it is cut off, its last line "# end …" is missing'),
    (GOOD[:GOOD.index("> 10 05") + 4], "it is cut off"),
    (GOOD[:GOOD.index("> 10 05") + 3], "line 10 is damaged"),
    (GOOD.replace("10 05 FF", "10 05 F"), "line 10 is damaged"),
    (GOOD.replace("10 05 FF", "10 05 GG"), "line 10 is damaged"),
    (GOOD.replace(" nothing", " anything"), 'line 12 is damaged ("anything" is not known)'),
    (GOOD.replace(") offset 1", ") offset x"), "line 8 is damaged"),
    (GOOD.replace(") offset 1", ") offset 99999999999999999999"),
     "line 8 is damaged (no clock is so far away)"),
    (text_of(CAN, CAN_ENTRIES).replace(" 14C00DC1#8001 T", " 54C00DC1#8001 T"),
     "line 8 is damaged (54C00DC1 is no identifier of 29 bits)"),
    (GOOD.replace("address: 7", "address: {"), "line 5 is damaged"),
    (GOOD.replace("# end 8", "# end 9"), "9 entries should be there, there are 8"),
    (text_of(CAN, CAN_ENTRIES).replace("#8001 T", "#801 T"), "line 8 is damaged"),
    (text_of(CAN, CAN_ENTRIES).replace("# delays ", "# delays 1 "), "delays of"),
])
def test_a_file_that_is_damaged_or_foreign_is_one_clear_error(read, tmp_path, text, fault):
    with pytest.raises(SettingError) as caught:
        read(text)
    assert fault in str(caught.value)
    assert str(caught.value).startswith(f"cannot replay {tmp_path / 'recording.log'}: ")
    assert "\n" not in str(caught.value)


def test_a_recording_that_was_cut_can_be_ended_by_hand(read):
    cut = GOOD.rpartition("# (")[0]
    assert len(read(cut + "# end\n").entries) == len(SERIAL_ENTRIES) - 1


@pytest.mark.parametrize("name", ["missing.log", "."])
def test_a_file_that_cannot_be_read_is_one_clear_error(tmp_path, name):
    with pytest.raises(SettingError, match=r"^cannot replay .*: (No such file|Is a directory)"):
        read_recording(tmp_path / name)


@pytest.mark.parametrize(("link", "entries"), [(SERIAL, SERIAL_ENTRIES), (CAN, CAN_ENTRIES)])
def test_reading_a_recording_costs_as_much_as_it_is_long(read, link, entries):
    short, long = (text_of(link, entries * count) for count in (20, 80))
    assert calls(lambda: read(long)) <= 4.5 * calls(lambda: read(short))
