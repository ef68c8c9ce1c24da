# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the diagnostics of an ultrasonic sensor can say, as rows."""

from __future__ import annotations

from driver_common.health import COMMON_KEYS, COMMON_STATES, LINE_KEYS, Health, Key, State

HEALTH = Health(
    keys=(
        *LINE_KEYS,
        Key("version", "Hardware and software, as the sensor reports them"),
        Key("serial number", "As the sensor reports it"),
        Key("profile", "The profile it measures with"),
        Key("rate [Hz]", "Measurements per second, over the last 5 s"),
        Key("temperature [°C]", "As last read, see temperature_period"),
        Key("measurements", "Replies with a result"),
        Key("measurements: echo", "A distance"),
        Key("measurements: no echo", "Nothing was in range"),
        Key("measurements: echo in the blind zone", "Something is nearer than 0.25 m"),
        Key("measurements: echo beyond the range", "Something is farther than the profile sees"),
        Key("time-outs", "Replies that did not come in time"),
        Key("checksum errors", "Replies that arrived damaged"),
        Key("damaged requests", "Requests of which the sensor says that they arrived damaged"),
        Key("refusals: …", "Error replies with this code"),
        Key("refusals", "All error replies"),
        Key("stray bytes", "Bytes on the line that belong to no reply"),
        Key("local echo", "Whether the line returns what is sent: on, off, or not known yet"),
        Key("measurements of its group", "Sets of measurements that the sensor's group made"),
        Key("failed measurements of its group", "Sets that were thrown away, because a reply was "
                                                "missing, damaged or late"),
        Key("failed lately [%]", "Share of such sets lately; from 10 % on there is a warning"),
        *COMMON_KEYS,
    ),
    states=(
        *COMMON_STATES,
        State("WARN", "does not answer", "It answered before; if that goes on it is looked for"),
        State("WARN", "…", "The text says what is wrong, see the failure table"),
        State("WARN", "… °C is outside of the operating range … … … °C", "Too hot, too cold, or "
                                                                         "a broken thermometer"),
        State("WARN", "… of the measurements together with its group fail", "Its group hears each "
                                                                            "other, or replies "
                                                                            "come late"),
        State("WARN", "… of the measurements together with its group fail, so they measure one by "
                      "one", "The same; the group is tried again later"),
        State("WARN", "… measurements per second instead of …", "The rate cannot be reached: too "
                                                                "many cycles or sensors"),
        State("OK", "… measurements per second", "It measures"),
    ))
