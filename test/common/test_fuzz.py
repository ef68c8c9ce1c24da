# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""`./dev fuzz`: each of its targets takes some inputs well, and its verdict can fail."""

from __future__ import annotations

import pytest

from bench.fuzz import __main__ as program
from bench.fuzz.campaign import fuzz
from bench.fuzz.targets import TARGETS, Target


def refuse_zeros(data, random):
    assert b"\0" not in data


@pytest.mark.parametrize("target", TARGETS, ids=lambda target: target.name)
def test_a_target_keeps_its_promises(target):
    result = fuzz(target, 300, 60.0, seed=2)
    assert not result.failures


def test_what_fails_is_kept_as_a_small_file(tmp_path):
    result = fuzz(Target("zeros", refuse_zeros, ("01 02 00 03 04",)), 200, 60.0, seed=1)
    assert result.inputs == 200
    assert list(result.failures.values()) == [b"\0"]
    program.keep([result], tmp_path)
    assert (tmp_path / "zeros_1.bin").read_bytes() == b"\0"
    assert "assert b\"\\0\" not in data: 00" in program.table([result])


def test_the_command_says_what_it_did(tmp_path, capsys):
    assert program.main(["--inputs", "10", "--only", "telegrams", "--keep", str(tmp_path)]) == 0
    assert "uc4000 telegrams" in capsys.readouterr().out
    assert not list(tmp_path.iterdir())
