# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Texts of the command line as values of settings and options."""

from __future__ import annotations

from collections.abc import Mapping

from driver_common.errors import SettingError
from driver_common.settings import Parameter, Value, suggestion

WORDS: Mapping[str, Value] = {"true": True, "on": True, "yes": True,
                              "false": False, "off": False, "no": False}


def row_of(rows: Mapping[str, Parameter], name: str) -> Parameter:
    """Return the row with a name; raises SettingError where there is none."""
    if name not in rows:
        raise SettingError(f'there is no setting "{name}"{suggestion(name, rows)}')
    return rows[name]


def value_of(rows: Mapping[str, Parameter], name: str, text: str) -> Value:
    """Return the value that a text stands for; raises SettingError."""
    row = row_of(rows, name)
    if row.kind is bool:
        return row.check(WORDS.get(text.lower(), text))
    return row.check(_number(text) if row.kind in (int, float) else text)


def _number(text: str) -> float | str:
    """Return the number that a text is, else the text."""
    try:
        return float(text)
    except ValueError:
        return text
