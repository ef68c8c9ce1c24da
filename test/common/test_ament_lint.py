# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""ROS's linters, as `colcon test` runs those that are installed; ruff does more."""

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent
FILES = [str(path) for folder in ROOT.iterdir() if folder.name[0] != "."
         for path in ([folder] if folder.suffix == ".py" else sorted(folder.glob("**/*.py")))
         if folder.name not in ("build", "install", "log")]


def test_ament_copyright_finds_nothing():
    linter = pytest.importorskip("ament_copyright.main", reason="comes with a sourced ROS only")
    assert linter.main(argv=[*FILES, str(ROOT / "LICENSE"), str(ROOT / "CONTRIBUTING.md")]) == 0


def test_ament_flake8_finds_nothing():
    linter = pytest.importorskip("ament_flake8.main", reason="comes with a sourced ROS only")
    code, errors = linter.main_with_errors(
        argv=["--config", str(ROOT / "setup.cfg"), *FILES])
    assert (code, errors) == (0, [])
