# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the diagnostics can say, explained: rows from which the documents are made.

A test holds the rows of the drivers against what running nodes publish.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import NamedTuple

GAP = "…"  # stands for what changes


class Key(NamedTuple):
    """A key of a status, with gaps; and what its value means."""

    text: str
    meaning: str


class State(NamedTuple):
    """A level and a message of a status, with gaps; and what that means."""

    level: str
    text: str
    meaning: str


class Health(NamedTuple):
    """All that the diagnostics of a driver can say of one sensor."""

    keys: tuple[Key, ...]
    states: tuple[State, ...]


def pattern(text: str) -> str:
    """Return a regular expression for a text with gaps."""
    return ".+".join(map(re.escape, text.split(GAP)))


def unexplained(texts: Iterable[str], rows: Iterable[Key | State], joint: str = "") -> set[str]:
    """Return the texts that no row explains; where there is a joint, also several rows in one."""
    one = "|".join(pattern(row.text) for row in rows)
    several = f"(?:{one})(?:{re.escape(joint)}(?:{one}))*" if joint else one
    return {text for text in texts if not re.fullmatch(several, text)}


LINE_KEYS = (
    Key("port", "The serial port that is open"),
    Key("baud rate", "Of the port, in Bd"),
    Key("address", "Of the sensor; 0 while it is not known"),
)
COMMON_KEYS = (
    Key("connections", "How often the sensor was found: 1 after the start, more where it was lost"),
    Key("… differs", "A setting that is not as wanted, with both values; see config_mode"),
    Key("last recording", "The newest file of the raw traffic that this node wrote"),
)
CLOCK_KEYS = (
    Key("drift of the clock [ppm]", "By how much the sensor's clock is faster than the host's"),
    Key("jitter of the arrivals [ms]", "How irregularly data arrive; it is not in the stamps"),
    Key("spread of the path delays [ms]", "How much longer some took than the quickest ones"),
    Key("uncertainty of the stamps [ms]", "How well the clock knows, without the constant delay"),
    Key("breaks of the clock", "Stamps that did not continue the line before: a pause of the "
                               "sensor, a host that slept, a clock that was set"),
)
COMMON_STATES = (
    State("STALE", "not configured", "The node is up and waits for the transition configure"),
    State("ERROR", "the bus has been busy for … s without an end; nothing is known of the device "
                   "meanwhile", "A driver of the operating system hangs, or the process was "
                                "suspended"),
    State("ERROR", "internal error, please report it: …", "A mistake in this package; attach a "
                                                          "recording to the report"),
    State("ERROR", "searching", "The sensor is looked for; why it was not found follows"),
    State("ERROR", "…", "Not connected; the text says what is wrong, see the failure table"),
    State("WARN", "… settings are not as wanted", "The keys '… differs' say which: the device "
                                                  "refused them, or config_mode is check"),
    State("OK", "connected, acquisition stopped", "By ~/stop_acquisition, or the node is inactive"),
)
