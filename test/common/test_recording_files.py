# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Recordings as files: whole or not there, a ring of them, and nothing outside of the directory."""

from __future__ import annotations

import os
import re

import pytest

from driver_common import recording_files
from driver_common.errors import DriverError
from driver_common.flight_recorder import Entry, Kind
from driver_common.recording import SERIAL, RecordingText, read_recording
from driver_common.recording_files import RecordingFiles, save

LIMIT = 40_000  # bytes
ENTRIES = [Entry(number, Kind.SENT, bytes(30)) for number in range(50)]


def text():
    return RecordingText(SERIAL, "", 0)


def save_one(files, entries=ENTRIES):
    return save(files, "outage", text(), {}, {}, entries)


def names(directory):
    return sorted(path.name for path in directory.iterdir())


@pytest.fixture
def files(tmp_path):
    return RecordingFiles(tmp_path / "new" / "recordings", "/left/isys_radar", LIMIT)


def test_a_recording_is_written_into_a_directory_that_is_made(files):
    path = save_one(files)
    assert path.parent == files.directory
    assert re.fullmatch(r"left\.isys_radar-\d{8}T\d{12}Z-outage\.log", path.name)
    assert names(files.directory) == [path.name]
    assert read_recording(path).entries == ENTRIES


def test_a_recording_has_its_name_only_when_it_is_whole(files):
    file = files.create("raw")
    file.write(text().head({}, {}))
    assert names(files.directory) == [file.path.name + ".part"]
    file.finish()
    assert names(files.directory) == [file.path.name]


def test_a_recording_that_fails_midway_leaves_nothing(files):
    def failing():
        yield from ENTRIES[:10]
        raise OSError(28, "No space left on device")

    with pytest.raises(DriverError, match=r"cannot write a recording to .*: No space left"):
        save_one(files, failing())
    assert names(files.directory) == []
    assert len(os.listdir("/proc/self/fd")) < 100


def test_failures_leave_no_open_files(files):
    before = set(os.listdir("/proc/self/fd"))
    for _ in range(3):
        files.create("raw").discard()
        save_one(files)
    assert set(os.listdir("/proc/self/fd")) == before


def test_the_oldest_recordings_make_room(files):
    paths = []
    for _ in range(30):
        paths.append(save_one(files).name)
        total = sum(path.stat().st_size for path in files.directory.iterdir())
        assert total <= LIMIT
    kept = names(files.directory)
    assert kept == sorted(paths)[-len(kept):]
    assert 2 < len(kept) < 30


def test_what_a_killed_node_left_makes_room_as_well(files):
    file = files.create("raw")
    file.write("x" * 100 for _ in range(300))
    file._file.flush()
    save_one(files)
    assert names(files.directory) == [path.name for path in files.directory.glob("*-outage.log")]


def test_a_single_recording_says_when_it_is_full(files):
    file = files.create("raw")
    while not file.is_full:
        file.write(["x" * 99 + "\n"])
    assert file.finish().stat().st_size == LIMIT // 4


def test_files_of_others_are_never_deleted(files):
    files.directory.mkdir(parents=True)
    stem = "20260101T000000000000Z-raw.log"
    others = ["notes.txt", "left.isys_radar-notes.log", f"left.isys_radar2-{stem}",
              f"xleft.isys_radar-{stem}", f"right.uc4000-{stem}"]
    for name in others:
        (files.directory / name).write_text("x" * LIMIT)
    for _ in range(20):
        save_one(files)
    assert set(others) <= set(names(files.directory))


@pytest.mark.parametrize(
    "owner", ["../../evil", "/", "..", "a/../../b", "x" * 500, "", "a\0b", "ä"])
def test_no_name_of_a_node_leads_out_of_the_directory(tmp_path, owner):
    directory = tmp_path / "a" / "b"
    path = save_one(RecordingFiles(directory, owner, LIMIT))
    assert path.parent == directory
    assert [found for found in tmp_path.rglob("*") if found.is_file()] == [path]


def test_links_in_the_directory_are_not_followed(files, tmp_path, monkeypatch):
    precious = tmp_path / "precious"
    precious.write_text("x" * LIMIT)
    files.directory.mkdir(parents=True)
    link = files.directory / "left.isys_radar-20200101T000000000000Z-raw.log"
    link.symlink_to(precious)

    real = recording_files.datetime
    monkeypatch.setattr(recording_files, "datetime", type("Fixed", (), {
        "now": staticmethod(lambda _: real.fromisoformat("2026-01-01T00:00:00+00:00"))}))
    part = files.directory / "left.isys_radar-20260101T000000000000Z-outage.log.part"
    part.symlink_to(precious)
    with pytest.raises(DriverError, match="File exists"):
        save_one(files)
    assert precious.read_text() == "x" * LIMIT


@pytest.mark.parametrize(("directory", "fault"), [
    ("file", "File exists|Not a directory"), ("file/below", "Not a directory")])
def test_a_directory_that_cannot_be_is_told_in_words(tmp_path, directory, fault):
    (tmp_path / "file").write_text("")
    with pytest.raises(DriverError, match=f"^cannot write a recording to .*: ({fault}); correct "
                                          "recording_directory, or make room$"):
        save_one(RecordingFiles(tmp_path / directory, "node", LIMIT))
