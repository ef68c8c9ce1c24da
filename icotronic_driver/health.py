# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the diagnostics of an accelerometer can say, as rows."""

from __future__ import annotations

from driver_common.health import CLOCK_KEYS, COMMON_KEYS, COMMON_STATES, Health, Key, State

_LATELY = "in the last … s"

HEALTH = Health(
    keys=(
        Key("bus", "Interface and channel of the CAN bus"),
        Key("phase", "searching, connecting, greeting (who it is, settings) or connected"),
        Key("sensor: …", "Name, MAC address, versions, … of the STH, as far as it tells"),
        Key("stationary unit: …", "The same of the STU"),
        Key("sample rate asked for [Hz]", "The parameter sample_rate"),
        Key("sample rate [Hz]", "What the ADC's settings give"),
        Key("measured sample rate [Hz]", "What arrives, by the host's clock"),
        Key("bus load [%]", "Of the stream, with the worst case of stuff bits"),
        Key("bus load without stuff bits [%]", "The same without; above 60 % is an error"),
        Key("law of channel …", "What the channel's raw values mean, and by what that is known"),
        Key("rssi [dBm]", "Strength of the radio signal at the STU"),
        Key("battery voltage [V]", "Of the sensor"),
        Key("temperature [°C]", "Of the sensor"),
        Key("sth status", "State of the sensor's firmware (section 10.2.4)"),
        Key("stu status", "State of the stationary unit's firmware"),
        Key("sth errors", "Its error word (section 10.2.5)"),
        Key("stu errors", "That of the stationary unit"),
        Key("power cycles", "How often the sensor was switched on and off in its life"),
        Key("operating time", "In s, since its last reset and in its life"),
        Key("under voltages", "How often the battery was too low"),
        Key("watchdog resets", "How often its firmware hung"),
        Key("frames", "Frames of the stream that arrived"),
        Key("lost frames", "Gaps in the frame counter: on the radio and here"),
        Key("frames lost in pauses of this host", "Those of them that were lost here"),
        Key("pauses of this host", "Steps of the node that took 0.25 s longer than they should"),
        Key("longest pause of this host [s]", "Since the start"),
        Key("duplicate frames", "Frames that came twice; the second one is dropped"),
        Key("damaged frames", "Frames of the stream with a wrong length or content"),
        Key("fault of the last damaged frame", "What was wrong with it"),
        Key("stale frames", "Answers that came too late"),
        Key("foreign frames", "Other traffic on the bus"),
        Key("frames of another host", "Frames by a host with our node number: end one of the two"),
        Key("error frames", "Errors on the CAN bus: wiring, termination, bit rate"),
        Key("time-outs", "Requests without an answer"),
        Key("unsaved settings", "Changed, and not in the EEPROM; see ~/save_all_settings"),
        *CLOCK_KEYS,
        *COMMON_KEYS,
    ),
    states=(
        *COMMON_STATES,
        State("ERROR", "connecting", "A sensor was chosen, and its answer is awaited"),
        State("ERROR", "greeting", "It is connected, and tells who it is and how it is set"),
        State("ERROR", "the stream takes … of the bus without stuff bits, more than …",
              "The manual forbids that (section 9.2.10): fewer channels or a lower rate"),
        State("WARN", "the stream takes … of the bus, more than …",
              "And others use it: fewer channels or a lower rate"),
        State("WARN", "another host on the bus uses our node number (SPU 1); end one of the two",
              "The vendor's tool, or a second node"),
        State("WARN", f"… frames lost on the radio {_LATELY}; bring the sensor nearer",
              "More than 1 %"),
        State("WARN", f"… frames lost because this host was busy or asleep {_LATELY}",
              "The kernel could not keep all that came"),
        State("WARN", f"… error frames {_LATELY}; check wiring, termination and bit rate",
              "Errors on the CAN bus"),
        State("WARN", "two channels are mapped to the same axis; correct axis.x, axis.y and axis.z",
              "Only one of them is published"),
        State("WARN", "channel …: …; using …", "The law that was asked for is not there; the "
                                               "text says which one is used instead"),
        State("WARN", "the … reports …", "Its status or error word (10.2.4, 10.2.5); reset it"),
        State("OK", "… samples per second, … frames lost", "It streams"),
    ))
