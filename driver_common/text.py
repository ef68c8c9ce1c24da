# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Text from a device: names, versions, serial numbers."""

from __future__ import annotations

REPLACEMENT = "\N{REPLACEMENT CHARACTER}"


def printable_text(data: bytes, encoding: str = "ascii") -> str:
    """Return the text in bytes that are padded with zeros, without anything that steers a terminal.

    What a device calls itself goes to terminals, logs and /diagnostics: whatever is not printable
    (control characters, escapes, line ends, marks of writing direction) is replaced.
    """
    text = data.split(b"\0", 1)[0].decode(encoding, errors="replace")
    return "".join(character if character.isprintable() else REPLACEMENT for character in text)
