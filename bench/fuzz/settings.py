# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What is fuzzed of settings and options: the rows of all drivers, and raw values of a device."""

from __future__ import annotations

import contextlib
import struct
from functools import cache
from random import Random
from typing import Any

from bench.fuzz.target import Target, from_hex
from driver_common.errors import SettingError
from driver_common.settings import UNKNOWN, Raw, Setting


def check_raws(setting: Setting, raw: Raw) -> None:
    """Make sure that what a device reports is shown, and is the same when it is written again."""
    value = setting.decode(raw)
    assert isinstance(setting.text(value), str)
    if value != UNKNOWN and not isinstance(value, bool):  # all but zero means true
        with contextlib.suppress(SettingError):  # devices may report what nobody can set
            assert setting.encode(value) == raw, (setting.name, value)


@cache
def _rows() -> list[Any]:
    from sensor_tools.document import DRIVERS  # it brings ROS, which no other target needs

    return [row for driver in DRIVERS
            for row in (*driver.options, *(variant for name in driver.node.ALL_SETTINGS
                                           for variant in driver.variants(name).values()))]


def _values(data: bytes) -> list[object]:
    """Return what an input can mean as the value of a parameter."""
    number = int.from_bytes(data[:9], "little", signed=True)
    real = struct.unpack("<d", data[:8].ljust(8, b"\0"))[0]
    text = data.decode("utf-8", "surrogateescape")
    return [number, number % 1000, real, float(number % 512) / 8, text, bool(number % 2), [real],
            [real, 0.5], [text, "front"], [], None, data]


def _check_rows(data: bytes, random: Random) -> None:
    row = random.choice(_rows())
    for value in _values(data):
        with contextlib.suppress(SettingError):
            checked = row.check(value)
            assert row.check(checked) == checked, (row.name, value)
            assert isinstance(row.text(checked), str)


TARGETS = (
    Target("parameters", _check_rows, [
        *from_hex(("000000000000F03F", "000000000000F07F", "000000000000F87F", "FF" * 9)),
        *(text.encode() for text in ("/dev/ttyS", "front", "on", "192.168.60.20", "highest",
                                     "replay://x", "08:6B:D7:01:DE:81"))]),
)
