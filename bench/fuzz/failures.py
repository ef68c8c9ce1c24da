# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What failed: kept as a small file of text, and read again."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

from driver_common.errors import SettingError


@dataclass(frozen=True)
class Failure:
    """An input that breaks a promise.

    Attributes:
        target: Name of the target.
        fault: What was raised, and where.
        data: The input.
        choices: What the random choices of the check follow from.
    """

    target: str
    fault: str
    data: bytes
    choices: int

    def __str__(self) -> str:
        """Return fault and input for people."""
        return f"{self.fault}: {self.data.hex(' ').upper() or 'nothing'}"


def keep(failures: Iterable[Failure], directory: Path) -> list[Path]:
    """Write each failure into a file of its own, and return the files."""
    paths = []
    for failure in failures:
        directory.mkdir(parents=True, exist_ok=True)
        name, number = failure.target.replace(" ", "_"), 1
        while (path := directory / f"{name}_{number}.json").exists():
            number += 1
        text = json.dumps({**asdict(failure), "data": failure.data.hex(" ").upper()}, indent=1)
        path.write_text(text + "\n", encoding="utf-8")
        paths.append(path)
    return paths


def read_failure(path: Path) -> Failure:
    """Return what a file keeps; raises SettingError."""
    try:
        fields = json.loads(path.read_text(encoding="utf-8"))
        return Failure(**{**fields, "data": bytes.fromhex(fields["data"])})
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise SettingError(f"{path} keeps no failure of ./dev fuzz: {error}") from None
