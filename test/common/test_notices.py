# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The notice on top of every file, by the rules of ament_copyright, which `colcon test` runs."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent
HOLDER = re.compile(r"^# Copyright (\d{4}(?:-\d{4})?) industrial_sensor_drivers maintainers$", re.M)
# ament_copyright wants the whole text, in whatever lines; it takes no SPDX identifier.
LICENSE = (
    'Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file '
    "except in compliance with the License. You may obtain a copy of the License at "
    "http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in "
    'writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT '
    "WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the "
    "specific language governing permissions and limitations under the License."
)


def has_notice(text):
    """Say whether the first comment block holds a copyright and the licence's text."""
    block = re.match(r"(?:#!.*\n)?\n*((?:#.*\n)+)", text)
    if not block or not HOLDER.search(block[1]):
        return False
    words = " ".join(line.lstrip("# ") for line in block[1].splitlines())
    return LICENSE in " ".join(words.split())


def source_files():
    """Return the files of the checkout that ament_copyright looks at, with new ones."""
    hidden = re.compile(r"^[._]|^(build|install|log)$")
    names = (path.relative_to(ROOT) for path in ROOT.rglob("*.py"))
    return [name for name in names if not any(hidden.match(part) for part in name.parts[:-1])]


def test_every_file_carries_the_notice():
    without = [str(name) for name in source_files()
               if (text := (ROOT / name).read_text(encoding="utf-8")) and not has_notice(text)]
    assert without == [], "copy the first seven lines of any other file into these"


NOTICE = "".join((ROOT / "setup.py").read_text(encoding="utf-8").partition("\n\n")[:2])


@pytest.mark.parametrize(
    "text",
    [
        '"""A file with a docstring only."""\n',
        "import os\n" + NOTICE,
        NOTICE.replace("2026 ", ""),
        NOTICE.replace("WITHOUT", "WITH"),
        NOTICE.split("\n")[0] + "\n# SPDX-License-Identifier: Apache-2.0\n",
    ],
)
def test_a_file_without_would_be_noticed(text):
    assert has_notice("#!/usr/bin/env python3\n" + NOTICE)
    assert not has_notice(text)
