# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""`./dev fuzz`: each of its targets takes some inputs well, and its verdict can fail."""

from __future__ import annotations

import json
import sys

import pytest

from bench.fuzz import __main__ as program
from bench.fuzz import icotronic, isys, uc4000
from bench.fuzz.campaign import fuzz
from bench.fuzz.failures import keep, read_failure
from bench.fuzz.target import Target
from bench.fuzz.targets import TARGETS
from icotronic_driver.streaming import StreamFormat
from isys_radar_driver.frames import FrameParser
from uc4000_driver.telegram import Request, decoded

SLOW = "session", "replays"
SERVICES = "parameter services"  # in a process of its own, because of the middleware


def refuse_zeros(data, random):
    assert b"\0" not in data


@pytest.fixture
def planted(monkeypatch):
    """A target with a bug, the only one that the command has."""
    target = Target("zeros", refuse_zeros, [bytes.fromhex("01 02 03 04")])
    monkeypatch.setattr(program, "TARGETS", [target])
    return target


@pytest.mark.parametrize("target", [one for one in TARGETS if one.name != SERVICES],
                         ids=lambda target: target.name)
def test_a_target_keeps_its_promises(target):
    inputs = 10 if target.name.endswith(SLOW) else len(target.seeds) + 100
    result = fuzz(target, inputs, 60.0, seed=2)
    assert result.inputs == inputs
    assert target.seeds
    assert not result.failures


def test_what_fails_is_made_small_kept_and_tried_again(planted, tmp_path, capsys):
    result = fuzz(planted, 1000, 60.0, seed=1)
    assert result.inputs == 1000
    (failure,) = result.failures
    assert failure.data == b"\0"
    fault = "AssertionError in test_fuzz.py, refuse_zeros: assert b\"\\0\" not in data"
    assert f"{fault}: 00" in program.table([result])
    assert json.loads(program.as_json([result]))[0]["failures"][0]["data"] == "00"
    first, second = keep([failure, failure], tmp_path)
    assert read_failure(first) == read_failure(second) == failure
    assert program.main([str(first)]) == 1
    assert fault in capsys.readouterr().out
    first.write_text(first.read_text().replace('"00"', '"01"'))
    assert program.main([str(first)]) == 0
    assert program.main([str(first), str(second)]) == 1


@pytest.mark.parametrize(("content", "words"), [
    ("", "keeps no failure"), ("[]", "keeps no failure"), ('{"data": "0"}', "keeps no failure"),
    ('{"target": "x", "fault": "", "data": "", "choices": 1}', "no target")])
def test_a_file_that_keeps_no_failure(tmp_path, content, words):
    path = tmp_path / "failure.json"
    path.write_text(content)
    with pytest.raises(SystemExit, match=words):
        program.main([str(path)])


def test_seeds_are_what_a_target_takes():
    for seed in isys.FRAMES + isys.RAW_SIGNALS:
        assert [*FrameParser().feed(seed)] or [*FrameParser(0).feed(seed)], seed.hex()
    assert all(decoded(seed) for seed in uc4000.ANSWERS)
    assert all(Request.decode(seed) for seed in uc4000.ASKED)
    assert all(StreamFormat.decode(seed[0]).frame_length <= len(seed)
               for seed in icotronic.STREAMS)


def test_the_parameter_services_keep_their_promises(tmp_path, capsys):
    assert program.main(["--inputs", "40", "--only", SERVICES, "--keep", str(tmp_path)]) == 0
    assert " 40 " in capsys.readouterr().out


@pytest.mark.skipif(sys.version_info < (3, 12), reason="this Python does not tell what is reached")
def test_an_input_that_reaches_something_new_becomes_an_example():
    result = fuzz(Target("frames", lambda data, random: list(FrameParser().feed(data)), [b"\0"]),
                  3000, 60.0, seed=1)
    assert result.seeds == 1
    assert 3 < result.grown <= result.branches


def test_the_command_says_what_it_did(tmp_path, capsys):
    path = tmp_path / "table.json"
    assert program.main(["--inputs", "400", "--only", "telegrams", "--keep", str(tmp_path),
                         "--json", str(path)]) == 0
    assert "uc4000 telegrams" in capsys.readouterr().out
    assert [row["inputs"] for row in json.loads(path.read_text())] == [400]
    assert list(tmp_path.iterdir()) == [path]
