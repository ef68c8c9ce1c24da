# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Messages as bytes that depend on nothing but the message.

`rclpy.serialization` leaves what lies between the fields as it was in memory. So two equal messages
differ, which matters where bytes are compared or made from each other.
"""

from __future__ import annotations

import re
import struct
from typing import Any

ENCAPSULATION = b"\0\1\0\0"  # CDR, little endian; alignment counts from behind it
WORD = 4  # bytes

_FORMATS = {"boolean": "?", "uint8": "B", "int8": "b", "uint16": "H", "int16": "h", "uint32": "I",
            "int32": "i", "uint64": "Q", "int64": "q", "float": "f", "double": "d"}
_SEVERAL = re.compile(r"(sequence<)?(?P<kind>[^,\[]+?)(?(1)(, \d+)?>|\[\d+\])")


def serialise(message: Any) -> bytes:
    """Return a message as `serialize_message` does, with zeros between the fields.

    It is filled up to whole words, because the middleware would do that.
    """
    data = bytearray(ENCAPSULATION)
    _append_message(data, message)
    return bytes(data + bytes(-len(data) % WORD))


def _append_message(data: bytearray, message: Any) -> None:
    for name, kind in message.get_fields_and_field_types().items():
        _append(data, getattr(message, name), kind)


def _append(data: bytearray, value: Any, kind: str) -> None:
    several = _SEVERAL.fullmatch(kind)
    if kind in _FORMATS:
        _append_number(data, value, _FORMATS[kind])
    elif kind.startswith("string"):
        text = value.encode() + b"\0"
        _append_number(data, len(text), "I")
        data += text
    elif several:
        if kind.startswith("sequence"):
            _append_number(data, len(value), "I")
        for item in value:
            _append(data, item, several["kind"])
    else:
        _append_message(data, value)


def _append_number(data: bytearray, value: float, format: str) -> None:
    data += bytes(-(len(data) - len(ENCAPSULATION)) % struct.calcsize(format))
    data += struct.pack("<" + format, value)
