# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the diagnostics of a radar can say, as rows."""

from __future__ import annotations

from driver_common.health import (
    CLOCK_KEYS,
    COMMON_KEYS,
    COMMON_STATES,
    LINE_KEYS,
    Health,
    Key,
    State,
)

HEALTH = Health(
    keys=(
        *LINE_KEYS,
        Key("model", "Such as iSYS-4001"),
        Key("serial number", "As the radar reports it"),
        Key("device name", "As the radar reports it"),
        Key("firmware", "Its version"),
        Key("DSP hardware", "Version of the board that computes"),
        Key("RFE hardware", "Version of the board with the antenna"),
        Key("bootloader", "Its version, where the radar tells"),
        Key("cycle time [s]", "Time of one measurement in the present measurement mode"),
        Key("rate [Hz]", "Target lists per second, over the last seconds"),
        Key("target lists", "Lists that came and were published"),
        Key("lost cycles", "Cycles of which no list came: a bad line, or a busy host"),
        Key("cycles left to others", "Cycles that ended while the line served another radar"),
        Key("clippings", "Lists without targets because the receiver was overloaded"),
        Key("implausible lists", "Lists with a right checksum that cannot be true; dropped"),
        Key("damaged replies", "Answers that arrived damaged"),
        Key("time-outs", "Answers that did not come in time"),
        Key("refusals", "Requests that the radar answered with failure (0xFD)"),
        Key("damaged frames", "Pieces of the line's traffic that looked like frames and were not"),
        Key("dropped bytes", "Bytes between frames that belong to none"),
        Key("stale frames", "Good frames that came too late, or that nobody asked for"),
        Key("unsaved settings", "What a power-off would undo: changed, and not saved since"),
        Key("regular cycles", "Whether the stamps follow the pace of the cycles, without jitter"),
        *CLOCK_KEYS,
        Key("… temperature [°C]", "Of the boards (dsp, rfe; 5020, 5021) or of the sensor (6xxx, "
                                  "with the range list)"),
        *COMMON_KEYS,
    ),
    states=(
        *COMMON_STATES,
        State("WARN", "does not answer", "It answered before; if that goes on it is looked for"),
        State("WARN", "…", "The text says what is wrong, see the failure table"),
        State("WARN", "receiver overloaded, no targets", "Most lists of the last seconds were "
                                                         "clipped: turn the radar away from what "
                                                         "reflects so much"),
        State("WARN", "… target lists per second instead of …", "Less than nine tenths of what "
                                                                "the cycle time allows"),
        State("OK", "… target lists per second", "It measures"),
        State("OK", "… target lists per second, shared line (… alone)", "It measures as often as "
                                                                        "the line can carry"),
        State("OK", "connected; this model sends no target lists over serial", "The 5xxx"),
    ))
