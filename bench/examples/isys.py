# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Frames of the iSYS serial protocol as literals, each with its meaning in real units.

`EXAMPLES` are all example frames that the manual (revision 23) prints in full, in its order: 177.
172 of them are right as printed. Mended are figure 45 (errata I1), figure 81 (errata I2),
figures 6 and 8, which lost a zero byte that the checksum does not miss (errata I3), and figure
137, whose checksum is printed with the letter O.

`HAND_TYPED` are frames that follow from the manual's tables and text, where it shows no frame.
Their bytes were typed from there and summed up without the code under test.

Pure data: nothing here comes from the code under test. Names of settings are those of the ROS
parameters, values are in their units. The errata are listed in docs/protocol_notes.md.
"""

from __future__ import annotations

from typing import Any, NamedTuple

RAM, EEPROM = 0, 1


class Request(NamedTuple):
    """The master asks for a command, named as in `isys_radar_driver.commands`."""

    address: int
    command: str


class Result(NamedTuple):
    """A sensor answers a command with a result."""

    address: int
    command: str
    result: Any


class Read(NamedTuple):
    """The master asks for the settings of one record."""

    address: int
    settings: tuple[str, ...]
    location: int | None = None


class Values(NamedTuple):
    """A sensor answers that question; `location` is the one that was asked for."""

    address: int
    values: dict[str, Any]
    location: int | None = None


class Write(NamedTuple):
    """The master writes the settings of one record."""

    address: int
    values: dict[str, Any]
    location: int | None = None


class Acknowledge(NamedTuple):
    """A sensor has done what was asked."""

    address: int
    function_code: int


class Failure(NamedTuple):
    """A sensor cannot do what was asked."""

    address: int


class ChangeAddress(NamedTuple):
    """The master gives a sensor another address."""

    address: int
    new_address: int


class TargetListRequest(NamedTuple):
    """The master asks for a target list; resolution 0 leaves the byte out."""

    address: int
    output: int
    resolution: int


class Targets(NamedTuple):
    """A target list: signal in dB, velocity in m/s, range in m, angle in degrees.

    `targets` is None where the receiver was clipping.
    """

    address: int
    output: int
    resolution: int
    targets: tuple[tuple[float, float, float, float], ...] | None


class SD1(NamedTuple):
    """A frame without data."""

    destination: int
    source: int
    function_code: int


class Misprinted(NamedTuple):
    """A request that the manual shows, but which is not the one that it describes."""

    address: int
    function_code: int
    pdu: str


Meaning = (Request | Result | Read | Values | Write | Acknowledge | Failure | ChangeAddress
           | TargetListRequest | Targets | SD1 | Misprinted)


class Example(NamedTuple):
    """One frame: where the manual has it, its bytes and what they mean."""

    where: str
    frame: str
    meaning: Meaning


IP_20 = {"ip.address": "192.168.60.20", "ip.subnet_mask": "255.255.255.0",
         "ip.gateway": "192.168.60.1"}
IP_DESTINATION_30 = {"ip_destination.address": "192.168.60.30",
                     "ip_destination.target_list_port": 2050,
                     "ip_destination.record_port": 2048}
LINE_FILTER1_50_HZ = {"line_filter1.enable": True, "line_filter1.frequency": 50,
                      "line_filter1.offset_db": 5.0}
LINE_FILTER2_60_HZ = {"line_filter2.enable": True, "line_filter2.frequency": 60,
                      "line_filter2.offset_db": 12.5}
LINE_FILTER2_LIMIT = {"line_filter2.enable": False, "line_filter2.frequency": 50000,
                      "line_filter2.offset_db": 1000.0}
THRESHOLDS_50_45 = {"output1.temperature_threshold_celsius": 50.0,
                    "output2.temperature_threshold_celsius": 45.0}
THRESHOLDS_LIMITS = {"output1.temperature_threshold_celsius": -20.0,
                     "output2.temperature_threshold_celsius": 100.0}
ZONE1_RANGE = {"stop_bar_zone1.range_min": 20.0, "stop_bar_zone1.range_max": 50.0}
ZONE2_RANGE = {"stop_bar_zone2.range_min": 20.0, "stop_bar_zone2.range_max": 50.0}
ZONE1_ANGLE = {"stop_bar_zone1.angle_min_deg": 20.0, "stop_bar_zone1.angle_max_deg": 35.5}
ZONE2_ANGLE = {"stop_bar_zone2.angle_min_deg": -20.0, "stop_bar_zone2.angle_max_deg": 20.0}

EXAMPLES = (
    Example("figure 1", "68 03 03 68 80 01 D0 51 16", Request(128, "READ_DEVICE_NAME")),
    Example("figure 3", "68 03 03 68 64 01 D0 35 16", Request(100, "READ_DEVICE_NAME")),
    Example("figure 5", "68 05 05 68 80 01 DA 01 20 7C 16",
            TargetListRequest(128, output=1, resolution=32)),
    # The manual prints one zero byte less in the velocity (errata I3).
    Example("figure 6", "A2 01 80 DA 01 01 0E D3 00 00 00 00 00 2B CB 75 00 00 03 E8 94 16",
            Targets(128, output=1, resolution=32, targets=((37.95, 0.0, 2.870133, 1.0),))),
    Example("figure 7", "68 05 05 68 64 01 DA 01 20 60 16",
            TargetListRequest(100, output=1, resolution=32)),
    # Here too a zero byte of the velocity is lost (errata I3).
    Example("figure 8", "A2 01 64 DA 01 01 22 02 00 00 00 00 00 2A FC BB 00 00 03 E8 31 16",
            Targets(100, output=1, resolution=32, targets=((87.06, 0.0, 2.817211, 1.0),))),
    Example("figure 12", "68 03 03 68 80 01 D0 51 16", Request(128, "READ_DEVICE_NAME")),
    Example("figure 14", "68 05 05 68 80 01 D1 00 00 52 16", Request(128, "START")),
    Example("figure 15", "68 03 03 68 01 80 D1 52 16", Acknowledge(128, 0xD1)),
    Example("figure 16", "68 05 05 68 80 01 D1 00 01 53 16", Request(128, "STOP")),
    Example("figure 17", "68 03 03 68 01 80 D1 52 16", Acknowledge(128, 0xD1)),
    Example("figure 18", "68 05 05 68 64 01 D1 01 33 6A 16",
            Request(100, "SET_DEFAULT_TEMPERATURE_THRESHOLDS")),
    Example("figure 19", "68 09 09 68 01 64 D1 15 7C 17 70 00 00 4E 16",
            Result(100, "SET_DEFAULT_TEMPERATURE_THRESHOLDS", (55.0, 60.0, 0.0))),
    # The manual's heading and table say sub-function 0x010A (errata I12).
    Example("figure 22", "68 05 05 68 64 01 D1 01 34 6B 16", Misprinted(100, 0xD1, "01 34")),
    # Four bytes, of which the first two are the temperature (errata I12).
    Example("figure 23", "68 07 07 68 01 64 D1 13 06 07 49 9F 16",
            Result(100, "READ_RFE_TEMPERATURE", 48.70)),
    Example("figure 24", "68 07 07 68 80 01 D3 00 01 00 81 D6 16", ChangeAddress(128, 129)),
    Example("figure 25", "68 03 03 68 01 81 D3 55 16", Acknowledge(129, 0xD3)),
    Example("figure 26", "68 05 05 68 00 01 D2 00 01 D4 16", Request(0, "READ_ADDRESS")),
    Example("figure 27", "68 05 05 68 01 80 D2 00 80 D3 16", Result(128, "READ_ADDRESS", 128)),
    Example("figure 29", "68 03 03 68 01 80 D3 54 16", Acknowledge(128, 0xD3)),
    Example("figure 30", "68 05 05 68 80 01 D2 00 04 57 16", Read(128, ("frequency_channel",))),
    Example("figure 31", "68 05 05 68 01 80 D2 00 01 54 16", Values(128, {"frequency_channel": 1})),
    Example("figure 33", "68 07 07 68 80 01 D3 00 0B 00 64 c3 16",
            Write(128, {"threshold_minimum_db": 10.0})),
    Example("figure 34", "68 03 03 68 01 80 D3 54 16", Acknowledge(128, 0xD3)),
    Example("figure 35", "68 05 05 68 80 01 D2 00 0B 5E 16", Read(128, ("threshold_minimum_db",))),
    Example("figure 36", "68 05 05 68 01 80 D2 00 64 B7 16",
            Values(128, {"threshold_minimum_db": 10.0})),
    Example("figure 38", "68 03 03 68 01 64 D3 38 16", Acknowledge(100, 0xD3)),
    Example("figure 39", "68 05 05 68 64 01 D2 00 10 47 16", Read(100, ("measurement_mode",))),
    Example("figure 40", "68 05 05 68 01 64 D2 00 00 37 16",
            Values(100, {"measurement_mode": "fast"})),
    Example("figure 41", "68 07 07 68 80 01 D3 00 16 00 64 CE 16",
            Write(128, {"threshold_sensitivity.left_db": 10.0})),
    Example("figure 42", "68 03 03 68 01 80 D3 54 16", Acknowledge(128, 0xD3)),
    Example("figure 43", "68 05 05 68 80 01 D2 00 16 69 16",
            Read(128, ("threshold_sensitivity.left_db",))),
    Example("figure 44", "68 05 05 68 01 80 D2 00 64 B7 16",
            Values(128, {"threshold_sensitivity.left_db": 10.0})),
    # The manual's leading bytes are garbled (errata I1).
    Example("figure 45", "68 12 12 68 64 01 D3 00 29 00 C0 A8 3C 14 FF FF FF 00 C0 A8 3C 01 BB 16",
            Write(100, IP_20, RAM)),
    Example("figure 46", "68 03 03 68 01 64 D3 38 16", Acknowledge(100, 0xD3)),
    Example("figure 47", "68 06 06 68 64 01 D2 00 29 00 60 16", Read(100, tuple(IP_20), RAM)),
    # The ports are 16-bit numbers (errata I13).
    Example("figure 49", "68 0E 0E 68 64 01 D3 00 2A 00 C0 A8 3C 1E 08 02 08 00 36 16",
            Write(100, IP_DESTINATION_30, RAM)),
    Example("figure 50", "68 03 03 68 01 64 D3 38 16", Acknowledge(100, 0xD3)),
    Example("figure 51", "68 06 06 68 64 01 D2 00 2A 00 61 16",
            Read(100, tuple(IP_DESTINATION_30), RAM)),
    Example("figure 53", "68 07 07 68 64 01 D3 00 2C 01 01 66 16",
            Write(100, {"target_list_interface": "spi"}, EEPROM)),
    Example("figure 54", "68 03 03 68 01 64 D3 38 16", Acknowledge(100, 0xD3)),
    # Only the value, without the location (errata I14).
    Example("figure 56", "68 04 04 68 01 64 D2 01 38 16",
            Values(100, {"target_list_interface": "spi"}, EEPROM)),
    Example("figure 59", "68 05 05 68 80 01 D2 00 2D 80 16", Read(128, ("led",))),
    Example("figure 60", "68 04 04 68 01 80 D2 02 55 16", Values(128, {"led": "no_blinking"})),
    Example("figure 61", "68 0B 0B 68 80 01 D5 00 00 00 01 00 32 00 32 BB 16",
            Write(128, LINE_FILTER1_50_HZ)),
    Example("figure 62", "68 03 03 68 01 80 D5 56 16", Acknowledge(128, 0xD5)),
    Example("figure 63", "68 05 05 68 80 01 D4 00 00 55 16", Read(128, tuple(LINE_FILTER1_50_HZ))),
    Example("section 3.3.5.1", "68 09 09 68 01 80 D4 00 01 00 32 00 32 BA 16",
            Values(128, LINE_FILTER1_50_HZ)),
    Example("figure 64", "68 07 07 68 80 01 D5 01 00 00 01 58 16",
            Write(128, {"output1.mode": "digital"})),
    Example("figure 65", "68 03 03 68 01 80 D5 56 16", Acknowledge(128, 0xD5)),
    Example("figure 66", "68 05 05 68 80 01 D4 01 00 56 16", Read(128, ("output1.mode",))),
    Example("figure 67", "68 05 05 68 01 80 D4 00 01 56 16",
            Values(128, {"output1.mode": "digital"})),
    Example("figure 68", "68 07 07 68 80 01 D5 01 01 00 0A 62 16",
            Write(128, {"output1.rising_delay_cycles": 10})),
    Example("figure 69", "68 03 03 68 01 80 D5 56 16", Acknowledge(128, 0xD5)),
    # The manual's caption repeats that of figure 66.
    Example("figure 70", "68 05 05 68 80 01 D4 01 01 57 16",
            Read(128, ("output1.rising_delay_cycles",))),
    Example("figure 71", "68 05 05 68 01 80 D4 00 0A 5F 16",
            Values(128, {"output1.rising_delay_cycles": 10})),
    Example("figure 72", "68 07 07 68 80 01 D5 01 04 00 02 5D 16",
            Write(128, {"output1.drive": "totem_pole"})),
    Example("figure 73", "68 03 03 68 01 80 D5 56 16", Acknowledge(128, 0xD5)),
    Example("figure 74", "68 05 05 68 80 01 D4 01 04 5A 16", Read(128, ("output1.drive",))),
    Example("figure 75", "68 05 05 68 01 80 D4 00 02 57 16",
            Values(128, {"output1.drive": "totem_pole"})),
    Example("figure 76", "68 07 07 68 80 01 D5 01 05 00 01 5D 16",
            Write(128, {"output1.contact": "normally_closed"})),
    Example("figure 77", "68 03 03 68 01 80 D5 56 16", Acknowledge(128, 0xD5)),
    Example("figure 78", "68 05 05 68 80 01 D4 01 05 5B 16", Read(128, ("output1.contact",))),
    Example("figure 79", "68 05 05 68 01 80 D4 00 01 56 16",
            Values(128, {"output1.contact": "normally_closed"})),
    Example("figure 80", "68 07 07 68 80 01 D5 01 06 FF 9C F8 16",
            Write(128, {"output1.angle_min_deg": -10.0})),
    # The manual prints function code 05 (errata I2).
    Example("figure 81", "68 07 07 68 80 01 D5 01 07 00 64 C2 16",
            Write(128, {"output1.angle_max_deg": 10.0})),
    Example("figure 82", "68 03 03 68 01 80 D5 56 16", Acknowledge(128, 0xD5)),
    Example("figure 83", "68 05 05 68 80 01 D4 01 06 5c 16", Read(128, ("output1.angle_min_deg",))),
    # The manual's caption says -10 degrees (errata I9).
    Example("figure 84", "68 05 05 68 01 80 D4 FF 9D F1 16",
            Values(128, {"output1.angle_min_deg": -9.9})),
    Example("figure 85", "68 05 05 68 80 01 D4 01 07 5D 16", Read(128, ("output1.angle_max_deg",))),
    Example("figure 86", "68 05 05 68 01 80 D4 00 64 B9 16",
            Values(128, {"output1.angle_max_deg": 10.0})),
    Example("figure 87", "68 07 07 68 80 01 D5 01 08 00 0A 69 16",
            Write(128, {"output1.range_min": 1.0})),
    Example("figure 88", "68 07 07 68 80 01 D5 01 09 00 64 C4 16",
            Write(128, {"output1.range_max": 10.0})),
    Example("figure 89", "68 03 03 68 01 80 D5 56 16", Acknowledge(128, 0xD5)),
    Example("figure 90", "68 05 05 68 80 01 D4 01 08 5E 16", Read(128, ("output1.range_min",))),
    Example("figure 91", "68 05 05 68 01 80 D4 00 0A 5F 16",
            Values(128, {"output1.range_min": 1.0})),
    Example("figure 92", "68 05 05 68 80 01 D4 01 09 5F 16", Read(128, ("output1.range_max",))),
    # The manual's caption says 10 m, which would be 00 64 as in figure 88.
    Example("figure 93", "68 05 05 68 01 80 D4 03 E8 40 16",
            Values(128, {"output1.range_max": 100.0})),
    Example("figure 94", "68 07 07 68 80 01 D5 01 0A 00 C8 29 16",
            Write(128, {"output1.signal_min_db": 20.0})),
    Example("figure 95", "68 07 07 68 80 01 D5 01 0B 03 E8 4D 16",
            Write(128, {"output1.signal_max_db": 100.0})),
    Example("figure 96", "68 03 03 68 01 80 D5 56 16", Acknowledge(128, 0xD5)),
    # The manual's caption says the smallest signal, which is sub-function 0x010A (errata I10).
    Example("figure 97", "68 05 05 68 80 01 D4 01 0B 61 16", Read(128, ("output1.signal_max_db",))),
    Example("figure 98", "68 05 05 68 01 80 D4 00 C8 1D 16",
            Values(128, {"output1.signal_min_db": 20.0})),
    Example("figure 99", "68 05 05 68 80 01 D4 01 0B 61 16", Read(128, ("output1.signal_max_db",))),
    Example("figure 100", "68 05 05 68 01 80 D4 03 E8 40 16",
            Values(128, {"output1.signal_max_db": 100.0})),
    Example("figure 101", "68 07 07 68 80 01 D5 01 0C 00 28 8B 16",
            Write(128, {"output1.velocity_min": 4.0})),
    Example("figure 102", "68 07 07 68 80 01 D5 01 0D 00 64 C8 16",
            Write(128, {"output1.velocity_max": 10.0})),
    Example("figure 103", "68 03 03 68 01 80 D5 56 16", Acknowledge(128, 0xD5)),
    Example("figure 104", "68 05 05 68 80 01 D4 01 0C 62 16", Read(128, ("output1.velocity_min",))),
    Example("figure 105", "68 05 05 68 01 80 D4 00 28 7D 16",
            Values(128, {"output1.velocity_min": 4.0})),
    # The manual's caption says the largest velocity, which is sub-function 0x010D (errata I10).
    Example("figure 106", "68 05 05 68 80 01 D4 01 0C 62 16", Read(128, ("output1.velocity_min",))),
    Example("figure 107", "68 05 05 68 01 80 D4 00 64 B9 16",
            Values(128, {"output1.velocity_max": 10.0})),
    Example("figure 108", "68 07 07 68 80 01 D5 01 0E 00 01 66 16",
            Write(128, {"output1.direction": "approaching"})),
    Example("figure 109", "68 03 03 68 01 80 D5 56 16", Acknowledge(128, 0xD5)),
    Example("figure 110", "68 05 05 68 80 01 D4 01 0E 64 16", Read(128, ("output1.direction",))),
    Example("figure 111", "68 05 05 68 01 80 D4 00 01 56 16",
            Values(128, {"output1.direction": "approaching"})),
    Example("figure 112", "68 07 07 68 80 01 D5 01 15 00 03 6F 16",
            Write(128, {"output1.filter_type": "min"})),
    Example("figure 113", "68 03 03 68 01 80 D5 56 16", Acknowledge(128, 0xD5)),
    Example("figure 114", "68 05 05 68 80 01 D4 01 15 6B 16", Read(128, ("output1.filter_type",))),
    Example("figure 115", "68 05 05 68 01 80 D4 00 03 58 16",
            Values(128, {"output1.filter_type": "min"})),
    Example("figure 116", "68 07 07 68 80 01 D5 01 16 00 02 6F 16",
            Write(128, {"output1.filter_signal": "range"})),
    Example("figure 117", "68 03 03 68 01 80 D5 56 16", Acknowledge(128, 0xD5)),
    Example("figure 118", "68 05 05 68 80 01 D4 01 16 6C 16",
            Read(128, ("output1.filter_signal",))),
    Example("figure 119", "68 05 05 68 01 80 D4 00 02 57 16",
            Values(128, {"output1.filter_signal": "range"})),
    Example("figure 120", "68 07 07 68 80 01 D5 01 17 00 32 A0 16",
            Write(128, {"output1.alpha_filter_velocity_percent": 50})),
    Example("figure 121", "68 07 07 68 80 01 D5 01 18 00 32 A1 16",
            Write(128, {"output1.alpha_filter_range_percent": 50})),
    Example("figure 122", "68 03 03 68 01 80 D5 56 16", Acknowledge(128, 0xD5)),
    Example("figure 123", "68 05 05 68 80 01 D4 01 17 6D 16",
            Read(128, ("output1.alpha_filter_velocity_percent",))),
    Example("figure 124", "68 05 05 68 01 80 D4 00 32 87 16",
            Values(128, {"output1.alpha_filter_velocity_percent": 50})),
    Example("figure 125", "68 05 05 68 80 01 D4 01 18 6E 16",
            Read(128, ("output1.alpha_filter_range_percent",))),
    Example("figure 126", "68 05 05 68 01 80 D4 00 32 87 16",
            Values(128, {"output1.alpha_filter_range_percent": 50})),
    Example("figure 127", "68 07 07 68 64 01 D5 01 19 00 65 B9 16",
            Write(100, {"output1.range_min_extended": 1.01})),
    Example("figure 128", "68 07 07 68 64 01 D5 01 1A 03 E9 41 16",
            Write(100, {"output1.range_max_extended": 10.01})),
    Example("figure 129", "68 03 03 68 01 64 D5 3A 16", Acknowledge(100, 0xD5)),
    Example("figure 130", "68 05 05 68 64 01 D4 01 19 53 16",
            Read(100, ("output1.range_min_extended",))),
    Example("figure 131", "68 05 05 68 01 64 D4 00 65 9E 16",
            Values(100, {"output1.range_min_extended": 1.01})),
    Example("figure 132", "68 05 05 68 64 01 D4 01 1A 54 16",
            Read(100, ("output1.range_max_extended",))),
    Example("figure 133", "68 05 05 68 01 64 D4 03 E9 25 16",
            Values(100, {"output1.range_max_extended": 10.01})),
    Example("figure 134", "68 09 09 68 64 01 D5 05 06 00 00 04 D2 1B 16",
            Write(100, {"mounting_offset": 1.234})),
    Example("figure 135", "68 03 03 68 01 64 D5 3A 16", Acknowledge(100, 0xD5)),
    Example("figure 136", "68 05 05 68 64 01 D4 05 06 44 16", Read(100, ("mounting_offset",))),
    # The manual prints the letters OF for the checksum.
    Example("figure 137", "68 07 07 68 01 64 D4 00 00 04 D2 0F 16",
            Values(100, {"mounting_offset": 1.234})),
    Example("figure 138", "68 07 07 68 80 01 D5 06 80 00 32 0E 16",
            Write(128, {"amplifier_potentiometer": 50})),
    Example("figure 139", "68 03 03 68 01 80 D5 56 16", Acknowledge(128, 0xD5)),
    Example("figure 140", "68 05 05 68 80 01 D4 06 80 DB 16",
            Read(128, ("amplifier_potentiometer",))),
    Example("figure 141", "68 05 05 68 01 80 D4 00 32 87 16",
            Values(128, {"amplifier_potentiometer": 50})),
    Example("figure 142", "68 0c 0c 68 64 01 D5 07 07 01 13 88 11 94 00 00 89 16",
            Write(100, THRESHOLDS_50_45, EEPROM)),
    Example("figure 143", "68 03 03 68 01 64 D5 3A 16", Acknowledge(100, 0xD5)),
    Example("figure 144", "68 06 06 68 64 01 D4 07 07 01 48 16",
            Read(100, tuple(THRESHOLDS_50_45), EEPROM)),
    Example("figure 145", "68 0A 0A 68 01 64 D4 01 13 88 11 94 00 00 7A 16",
            Values(100, THRESHOLDS_50_45, EEPROM)),
    # The manual's captions call 1 "range", its text says that 1 is temperature (errata I11).
    Example("figure 146", "68 08 08 68 64 01 D5 07 09 01 01 01 4D 16",
            Write(100, {"output1.warning_mode": "temperature"}, EEPROM)),
    Example("figure 147", "68 03 03 68 01 64 D5 3A 16", Acknowledge(100, 0xD5)),
    Example("figure 148", "68 07 07 68 64 01 D4 07 09 01 01 4B 16",
            Read(100, ("output1.warning_mode",), EEPROM)),
    Example("figure 149", "68 06 06 68 01 64 D4 01 01 01 3C 16",
            Values(100, {"output1.warning_mode": "temperature"}, EEPROM)),
    Example("figure 150", "68 09 09 68 64 01 D5 07 0A 01 01 13 88 E8 16",
            Write(100, {"output1.temperature_warning_celsius": 50.0}, EEPROM)),
    Example("figure 151", "68 03 03 68 01 64 D5 3A 16", Acknowledge(100, 0xD5)),
    Example("figure 152", "68 07 07 68 64 01 D4 07 0A 00 01 4B 16",
            Read(100, ("output1.temperature_warning_celsius",), RAM)),
    Example("figure 153", "68 07 07 68 01 64 D4 00 01 13 88 D5 16",
            Values(100, {"output1.temperature_warning_celsius": 50.0}, RAM)),
    Example("figure 154", "68 0B 0B 68 64 01 D5 07 0B 01 01 00 00 30 39 B7 16",
            Write(100, {"output1.range_warning": 1.2345}, EEPROM)),
    Example("figure 155", "68 03 03 68 01 64 D5 3A 16", Acknowledge(100, 0xD5)),
    Example("figure 156", "68 07 07 68 64 01 D4 07 0B 00 01 4C 16",
            Read(100, ("output1.range_warning",), RAM)),
    Example("figure 157", "68 09 09 68 01 64 D4 00 01 00 00 30 39 A3 16",
            Values(100, {"output1.range_warning": 1.2345}, RAM)),
    Example("figure 158", "68 08 08 68 64 01 D5 08 28 00 00 19 83 16",
            Write(100, {"moving_target_sensitivity.near_db": 2.5}, RAM)),
    Example("figure 159", "68 03 03 68 01 64 D5 3A 16", Acknowledge(100, 0xD5)),
    Example("figure 160", "68 06 06 68 64 01 D4 08 28 00 69 16",
            Read(100, ("moving_target_sensitivity.near_db",), RAM)),
    # From here on the replies hold the value only (errata I14).
    Example("figure 161", "68 05 05 68 01 64 D4 00 19 52 16",
            Values(100, {"moving_target_sensitivity.near_db": 2.5}, RAM)),
    Example("figure 162", "68 08 08 68 64 01 D5 08 29 00 00 24 8F 16",
            Write(100, {"moving_target_sensitivity.main_db": 3.6}, RAM)),
    Example("figure 163", "68 03 03 68 01 64 D5 3A 16", Acknowledge(100, 0xD5)),
    Example("figure 164", "68 06 06 68 64 01 D4 08 29 00 6A 16",
            Read(100, ("moving_target_sensitivity.main_db",), RAM)),
    Example("figure 165", "68 05 05 68 01 64 D4 00 24 5D 16",
            Values(100, {"moving_target_sensitivity.main_db": 3.6}, RAM)),
    Example("figure 166", "68 08 08 68 64 01 D5 08 2A 00 00 23 8F 16",
            Write(100, {"moving_target_sensitivity.long_db": 3.5}, RAM)),
    Example("figure 167", "68 03 03 68 01 64 D5 3A 16", Acknowledge(100, 0xD5)),
    Example("figure 168", "68 06 06 68 64 01 D4 08 2A 00 6B 16",
            Read(100, ("moving_target_sensitivity.long_db",), RAM)),
    Example("figure 169", "68 05 05 68 01 64 D4 00 23 5C 16",
            Values(100, {"moving_target_sensitivity.long_db": 3.5}, RAM)),
    Example("figure 171", "68 03 03 68 01 64 D5 3A 16", Acknowledge(100, 0xD5)),
    Example("figure 172", "68 06 06 68 64 01 D4 08 53 00 94 16", Read(100, ("rcs_output",), RAM)),
    Example("figure 173", "68 04 04 68 01 64 D4 01 3A 16", Values(100, {"rcs_output": True}, RAM)),
    Example("figure 175", "68 03 03 68 01 64 D5 3A 16", Acknowledge(100, 0xD5)),
    Example("figure 178", "68 05 05 68 80 01 D6 01 01 59 16",
            Request(128, "READ_FIRMWARE_VERSION")),
    Example("figure 179", "68 09 09 68 01 80 D6 00 01 00 03 01 35 91 16",
            Result(128, "READ_FIRMWARE_VERSION", "1.309")),
    Example("figure 180", "68 05 05 68 64 01 D6 01 02 3E 16",
            Request(100, "READ_DSP_HARDWARE_VERSION")),
    Example("figure 181", "68 09 09 68 01 64 D6 00 01 00 01 00 01 3E 16",
            Result(100, "READ_DSP_HARDWARE_VERSION", "1.1")),
    Example("figure 182", "68 05 05 68 64 01 D6 01 03 3F 16",
            Request(100, "READ_RFE_HARDWARE_VERSION")),
    Example("figure 183", "68 09 09 68 01 64 D6 00 01 00 01 00 02 3F 16",
            Result(100, "READ_RFE_HARDWARE_VERSION", "1.2")),
    Example("figure 186", "68 05 05 68 64 01 D6 02 20 5D 16",
            Request(100, "READ_BOOTLOADER_VERSION")),
    Example("section 3.3.7.3", "68 04 04 68 80 01 DA 01 5C 16",
            TargetListRequest(128, output=1, resolution=0)),
    Example("section 3.3.7.3", "68 05 05 68 80 01 DA 01 10 6C 16",
            TargetListRequest(128, output=1, resolution=16)),
    Example("section 3.3.7.3", "68 05 05 68 80 01 DA 01 20 7C 16",
            TargetListRequest(128, output=1, resolution=32)),
    Example("figure 188", "A2 01 80 DA 01 01 0E D3 00 00 00 00 00 2B CB 75 00 00 03 E8 94 16",
            Targets(128, output=1, resolution=32, targets=((37.95, 0.0, 2.870133, 1.0),))),
    Example("figure 189", "68 03 03 68 80 01 DB 5C 16", Request(128, "READ_DIGITAL_OUTPUTS")),
    Example("figure 190", "68 03 03 68 01 80 DF 60 16", Acknowledge(128, 0xDF)),
    Example("figure 191", "68 04 04 68 80 01 DF 01 61 16",
            Request(128, "RESTORE_FACTORY_SETTINGS")),
    Example("figure 192", "68 04 04 68 80 01 DF 02 62 16", Request(128, "SAVE_SENSOR_SETTINGS")),
    Example("figure 193", "68 04 04 68 80 01 DF 03 63 16",
            Request(128, "SAVE_APPLICATION_SETTINGS")),
    Example("figure 194", "68 04 04 68 80 01 DF 04 64 16", Request(128, "SAVE_ALL_SETTINGS")),
    Example("figure 198", "68 03 03 68 80 01 E1 62 16", Request(128, "READ_RANGE_LIST")),
    Example("figure 200", "68 03 03 68 01 80 FD 7E 16", Failure(128)),
)

HAND_TYPED = (
    # Table 7, the worked example of the checksum.
    Example("table 7", "68 05 05 68 01 80 D2 00 80 D3 16", Result(128, "READ_ADDRESS", 128)),
    # Frames without data (table 3).
    Example("table 3", "10 80 01 D0 51 16", SD1(destination=128, source=1, function_code=0xD0)),
    Example("table 3", "10 01 80 D1 52 16", SD1(destination=1, source=128, function_code=0xD1)),
    # Commands without a complete frame in the manual.
    Example("section 3.3.2",
            "68 13 13 68 01 80 D0 69 53 59 53 2D 34 30 30 31 20 31 32 33 34 35 00 CA 16",
            Result(128, "READ_DEVICE_NAME", "iSYS-4001 12345")),
    Example("figure 20", "68 05 05 68 64 01 D1 01 09 40 16", Request(100, "READ_DSP_TEMPERATURE")),
    # The manual's caption prints 0x13CE, which is 50.70; its text says 5059.
    Example("figure 21", "68 05 05 68 01 64 D1 13 C3 0C 16",
            Result(100, "READ_DSP_TEMPERATURE", 50.59)),
    Example("table 9", "68 05 05 68 64 01 D1 01 0A 41 16", Request(100, "READ_RFE_TEMPERATURE")),
    Example("section 3.3.3.4", "68 05 05 68 01 64 D1 13 06 4F 16",
            Result(100, "READ_RFE_TEMPERATURE", 48.70)),
    Example("section 3.3.3.4", "68 05 05 68 01 64 D1 FD F3 26 16",
            Result(100, "READ_RFE_TEMPERATURE", -5.25)),
    Example("figure 184", "68 05 05 68 64 01 D6 01 04 40 16",
            Request(100, "READ_PRODUCT_INFORMATION")),
    Example("figure 185", "68 05 05 68 01 64 D6 13 92 E0 16",
            Result(100, "READ_PRODUCT_INFORMATION", 5010)),
    Example("figure 187", "68 09 09 68 01 64 D6 00 01 00 04 00 00 40 16",
            Result(100, "READ_BOOTLOADER_VERSION", "1.0000")),
    Example("section 3.3.6.5", "68 09 09 68 01 64 D6 FF FF 00 05 FF FF 3C 16",
            Result(100, "READ_BOOTLOADER_VERSION", "none")),
    Example("table 24", "68 05 05 68 80 01 D6 02 20 79 16",
            Request(128, "READ_BOOTLOADER_VERSION")),
    # Low, high, and -3.05 m/s on a PWM output.
    Example("table 34", "68 09 09 68 01 80 DB 00 00 00 01 FE CF 2A 16",
            Result(128, "READ_DIGITAL_OUTPUTS", (0, 1, -305))),
    Example("figure 195", "68 03 03 68 80 01 E0 61 16", Request(128, "READ_RAW")),
    Example("table 38",
            "68 1B 1B 68 01 80 E1 00 2B CB 75 0E D3 FD F3 00 00 00 7B 00 00 00 0F 00 2B CA F0 "
            "00 2B CC 1C 20 16",
            Result(128, "READ_RANGE_LIST", {
                "range": 2.870133, "amplitude": 37.95, "temperature": -5.25,
                "standard_deviation": 0.000123, "variance": 0.000015,
                "minimum": 2.87, "maximum": 2.8703})),
    Example("figure 200", "68 03 03 68 01 64 FD 62 16", Failure(100)),
    # Target lists.
    Example("section 3.3.7", "68 05 05 68 64 01 DA 03 90 D2 16",
            TargetListRequest(100, output=3, resolution=144)),
    Example("section 3.3.7", "68 05 05 68 64 01 DA 02 A0 E1 16",
            TargetListRequest(100, output=2, resolution=160)),
    Example("table 32", "68 0C 0C 68 01 80 DA 01 01 26 00 00 01 1F 00 64 07 16",
            Targets(128, output=1, resolution=16, targets=((38.0, 0.0, 2.87, 1.0),))),
    # 16 bit, limits of table 29.
    Example("table 29",
            "68 13 13 68 01 80 DA 02 02 FF 7F FF 7F FF 7F FF 00 80 00 80 00 80 00 58 16",
            Targets(128, output=2, resolution=16, targets=(
                (255.0, 327.67, 327.67, 327.67), (0.0, -327.68, -327.68, -327.68)))),
    Example("section 3.3.7.1", "68 05 05 68 01 80 DA 03 FF 5D 16",
            Targets(128, output=3, resolution=16, targets=None)),
    Example("section 3.3.7.1", "68 05 05 68 01 80 DA 01 00 5C 16",
            Targets(128, output=1, resolution=16, targets=())),
    # 32 bit, limits of table 31.
    Example("table 31",
            "A2 01 64 DA 02 02 FF FF 7F FF FF FF 7F FF FF FF 7F FF FF FF 00 00 80 00 00 00 80 "
            "00 00 00 80 00 00 00 35 16",
            Targets(100, output=2, resolution=32, targets=(
                (655.35, 2147483.647, 2147.483647, 2147483.647),
                (0.0, -2147483.648, -2147.483648, -2147483.648)))),
    Example("section 3.3.7.2", "A2 01 64 DA 01 FF 3F 16",
            Targets(100, output=1, resolution=32, targets=None)),
    Example("section 3.3.7.2", "A2 01 64 DA 01 00 40 16",
            Targets(100, output=1, resolution=32, targets=())),
    # A fixed length of five targets: 4 x 14 zero bytes follow.
    Example("table 33",
            "A2 01 80 DA 01 01 0E D3 00 00 00 00 00 2B CB 75 00 00 03 E8 00 00 00 00 00 00 00 "
            "00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 "
            "00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 94 16",
            Targets(128, output=1, resolution=160, targets=((37.95, 0.0, 2.870133, 1.0),))),
    # Two signals of 16 samples of 2 bytes, interleaved: 0, 1, 2 ... and 0, -1, -2 ...; 10 µs.
    Example("table 37",
            "A2 01 80 E0 02 01 02 00 00 00 0A 00 00 00 00 00 01 FF FF 00 02 FF FE 00 03 FF FD "
            "00 04 FF FC 00 05 FF FB 00 06 FF FA 00 07 FF F9 00 08 FF F8 00 09 FF F7 00 0A FF "
            "F6 00 0B FF F5 00 0C FF F4 00 0D FF F3 00 0E FF F2 00 0F FF F1 61 16",
            Result(128, "READ_RAW", {
                "sample_time": 10e-6,
                "samples": ((0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15),
                            (0, -1, -2, -3, -4, -5, -6, -7, -8, -9, -10, -11, -12, -13, -14,
                             -15))})),
    # One signal of 16 samples of 4 bytes, as the iSYS-6004 sends them; 65.536 ms.
    Example("table 37",
            "A2 01 64 E0 01 01 04 00 01 00 00 00 00 00 00 3F 00 00 00 3F 80 00 00 3F C0 00 00 "
            "40 00 00 00 40 20 00 00 40 40 00 00 40 60 00 00 40 80 00 00 40 90 00 00 40 A0 00 "
            "00 40 B0 00 00 40 C0 00 00 40 D0 00 00 40 E0 00 00 BF 80 00 00 D8 16",
            Result(100, "READ_RAW", {
                "sample_time": 0.065536,
                "samples": ((0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 5.5, 6.0, 6.5,
                             7.0, -1.0),)})),
    # Sensor settings (table 10).
    Example("table 11", "68 07 07 68 80 01 D3 00 04 00 02 5A 16",
            Write(128, {"frequency_channel": 2})),
    Example("figure 28", "68 07 07 68 80 01 D3 00 04 00 01 59 16",
            Write(128, {"frequency_channel": 1})),
    Example("section 3.3.4.3", "68 07 07 68 80 01 D3 00 0B FE D4 31 16",
            Write(128, {"threshold_minimum_db": -30.0})),
    Example("figure 37", "68 07 07 68 64 01 D3 00 10 00 00 48 16",
            Write(100, {"measurement_mode": "fast"})),
    Example("table 12", "68 07 07 68 64 01 D3 00 10 00 01 49 16",
            Write(100, {"measurement_mode": "multi_target"})),
    Example("table 12", "68 05 05 68 01 64 D2 00 01 38 16",
            Values(100, {"measurement_mode": "multi_target"})),
    # The range bound, which the manual does not have (field note N13).
    Example("I34", "68 05 05 68 80 01 D2 00 10 63 16", Read(128, ("range_bound",))),
    Example("I34", "68 05 05 68 01 80 D2 00 01 54 16", Values(128, {"range_bound": "150_m"})),
    Example("I34", "68 07 07 68 80 01 D3 00 10 00 01 65 16",
            Write(128, {"range_bound": "150_m"})),
    Example("table 10", "68 05 05 68 80 01 D2 00 17 6A 16",
            Read(128, ("threshold_sensitivity.right_db",))),
    Example("table 10", "68 05 05 68 01 80 D2 FF 9C EE 16",
            Values(128, {"threshold_sensitivity.right_db": -10.0})),
    Example("table 10", "68 07 07 68 80 01 D3 00 17 01 2C 98 16",
            Write(128, {"threshold_sensitivity.right_db": 30.0})),
    # The two forms of a reply that the manual does not show (errata I25).
    Example("figure 48", "68 0F 0F 68 01 64 D2 C0 A8 3C 14 FF FF FF 00 C0 A8 3C 01 91 16",
            Values(100, IP_20, RAM)),
    Example("figure 48", "68 10 10 68 01 64 D2 00 C0 A8 3C 14 FF FF FF 00 C0 A8 3C 01 91 16",
            Values(100, IP_20, RAM)),
    Example("figure 52", "68 0B 0B 68 01 64 D2 C0 A8 3C 1E 08 02 08 00 0B 16",
            Values(100, IP_DESTINATION_30, RAM)),
    Example("figure 52", "68 0C 0C 68 01 64 D2 00 C0 A8 3C 1E 08 02 08 00 0B 16",
            Values(100, IP_DESTINATION_30, RAM)),
    Example("section 3.3.4.7", "68 0C 0C 68 01 64 D2 01 C0 A8 3C 1E 08 02 08 00 0C 16",
            Values(100, IP_DESTINATION_30, EEPROM)),
    Example("figure 55", "68 06 06 68 64 01 D2 00 2C 01 64 16",
            Read(100, ("target_list_interface",), EEPROM)),
    Example("section 3.3.4.8", "68 06 06 68 64 01 D2 00 2C 00 63 16",
            Read(100, ("target_list_interface",), RAM)),
    Example("section 3.3.4.8", "68 04 04 68 01 64 D2 00 37 16",
            Values(100, {"target_list_interface": "disabled"}, RAM)),
    Example("section 3.3.4.8", "68 07 07 68 64 01 D3 00 2C 00 02 66 16",
            Write(100, {"target_list_interface": "ethernet"}, RAM)),
    Example("figure 57", "68 06 06 68 80 01 D3 00 2D 02 83 16", Write(128, {"led": "no_blinking"})),
    Example("section 3.3.4.9", "68 06 06 68 80 01 D3 00 2D 00 81 16",
            Write(128, {"led": "disabled"})),
    Example("section 3.3.4.9", "68 04 04 68 01 80 D2 01 54 16", Values(128, {"led": "enabled"})),
    # Application settings (table 13).
    Example("table 13", "68 05 05 68 80 01 D4 00 01 56 16", Read(128, tuple(LINE_FILTER2_60_HZ))),
    Example("table 13", "68 09 09 68 01 80 D4 00 00 C3 50 27 10 9F 16",
            Values(128, LINE_FILTER2_LIMIT)),
    Example("table 13", "68 0B 0B 68 80 01 D5 00 01 00 01 00 3C 00 7D 11 16",
            Write(128, LINE_FILTER2_60_HZ)),
    Example("table 15", "68 05 05 68 80 01 D4 02 00 57 16", Read(128, ("output2.mode",))),
    Example("table 15", "68 05 05 68 01 80 D4 00 00 55 16",
            Values(128, {"output2.mode": "disabled"})),
    Example("table 15", "68 07 07 68 80 01 D5 03 00 00 02 5B 16",
            Write(128, {"output3.mode": "pwm"})),
    Example("section 3.3.5.3", "68 05 05 68 80 01 D4 01 02 58 16",
            Read(128, ("output1.falling_delay_cycles",))),
    Example("section 3.3.5.3", "68 05 05 68 01 80 D4 FF FF 53 16",
            Values(128, {"output1.falling_delay_cycles": 65535})),
    Example("section 3.3.5.3", "68 07 07 68 80 01 D5 01 02 00 05 5E 16",
            Write(128, {"output1.falling_delay_cycles": 5})),
    Example("section 3.3.5.3", "68 07 07 68 80 01 D5 02 01 FF FF 57 16",
            Write(128, {"output2.rising_delay_cycles": 65535})),
    Example("table 16", "68 05 05 68 80 01 D4 03 04 5C 16", Read(128, ("output3.drive",))),
    Example("table 16", "68 05 05 68 01 80 D4 00 01 56 16",
            Values(128, {"output3.drive": "active_high"})),
    Example("table 16", "68 07 07 68 80 01 D5 02 04 00 00 5C 16",
            Write(128, {"output2.drive": "active_low"})),
    Example("section 3.3.5.5", "68 07 07 68 80 01 D5 03 05 00 00 5E 16",
            Write(128, {"output3.contact": "normally_open"})),
    Example("section 3.3.5.6", "68 07 07 68 80 01 D5 02 06 FE 0C 68 16",
            Write(128, {"output2.angle_min_deg": -50.0})),
    Example("section 3.3.5.7", "68 05 05 68 64 01 D4 03 09 45 16",
            Read(100, ("output3.range_max",))),
    Example("section 3.3.5.7", "68 05 05 68 01 64 D4 00 C8 01 16",
            Values(100, {"output3.range_max": 20.0})),
    Example("section 3.3.5.7", "68 07 07 68 64 01 D5 03 09 00 33 79 16",
            Write(100, {"output3.range_max": 5.1})),
    # Signal min and velocity max, of which the manual shows another request (errata I10).
    Example("section 3.3.5.8", "68 05 05 68 80 01 D4 01 0A 60 16",
            Read(128, ("output1.signal_min_db",))),
    Example("section 3.3.5.8", "68 07 07 68 80 01 D5 02 0B 09 F6 62 16",
            Write(128, {"output2.signal_max_db": 255.0})),
    Example("section 3.3.5.9", "68 05 05 68 80 01 D4 01 0D 63 16",
            Read(128, ("output1.velocity_max",))),
    Example("section 3.3.5.9", "68 07 07 68 80 01 D5 03 0D 02 BC 24 16",
            Write(128, {"output3.velocity_max": 70.0})),
    Example("table 17", "68 07 07 68 80 01 D5 02 0E 00 02 68 16",
            Write(128, {"output2.direction": "receding"})),
    Example("table 17", "68 05 05 68 01 80 D4 00 03 58 16",
            Values(128, {"output3.direction": "both"})),
    Example("table 18", "68 07 07 68 80 01 D5 02 15 00 00 6D 16",
            Write(128, {"output2.filter_type": "highest_amplitude"})),
    Example("table 18", "68 07 07 68 80 01 D5 03 15 00 01 6F 16",
            Write(128, {"output3.filter_type": "mean"})),
    Example("table 18", "68 07 07 68 80 01 D5 01 15 00 02 6E 16",
            Write(128, {"output1.filter_type": "median"})),
    Example("table 18", "68 05 05 68 01 80 D4 00 04 59 16",
            Values(128, {"output2.filter_type": "max"})),
    Example("table 19", "68 07 07 68 80 01 D5 02 16 00 00 6E 16",
            Write(128, {"output2.filter_signal": "disabled"})),
    Example("table 19", "68 05 05 68 01 80 D4 00 01 56 16",
            Values(128, {"output3.filter_signal": "velocity"})),
    Example("section 3.3.5.13", "68 07 07 68 80 01 D5 03 17 00 00 70 16",
            Write(128, {"output3.alpha_filter_velocity_percent": 0})),
    Example("section 3.3.5.13", "68 07 07 68 80 01 D5 02 18 00 64 D4 16",
            Write(128, {"output2.alpha_filter_range_percent": 100})),
    Example("section 3.3.5.14", "68 05 05 68 64 01 D4 02 1A 55 16",
            Read(100, ("output2.range_max_extended",))),
    Example("section 3.3.5.14", "68 07 07 68 64 01 D5 03 19 07 D0 2D 16",
            Write(100, {"output3.range_min_extended": 20.0})),
    Example("table 20", "68 0C 0C 68 64 01 D5 07 07 00 F8 30 27 10 00 00 A7 16",
            Write(100, THRESHOLDS_LIMITS, RAM)),
    Example("table 20", "68 0A 0A 68 01 64 D4 00 F8 30 27 10 00 00 98 16",
            Values(100, THRESHOLDS_LIMITS, RAM)),
    Example("section 3.3.5.18", "68 08 08 68 64 01 D5 07 09 00 02 02 4E 16",
            Write(100, {"output2.warning_mode": "range"}, RAM)),
    Example("section 3.3.5.18", "68 07 07 68 64 01 D4 07 09 00 02 4B 16",
            Read(100, ("output2.warning_mode",), RAM)),
    Example("section 3.3.5.18", "68 06 06 68 01 64 D4 00 02 02 3D 16",
            Values(100, {"output2.warning_mode": "range"}, RAM)),
    Example("section 3.3.5.19", "68 09 09 68 64 01 D5 07 0A 00 02 FF 38 84 16",
            Write(100, {"output2.temperature_warning_celsius": -2.0}, RAM)),
    Example("section 3.3.5.19", "68 07 07 68 01 64 D4 01 02 FF 38 73 16",
            Values(100, {"output2.temperature_warning_celsius": -2.0}, EEPROM)),
    Example("section 3.3.5.20", "68 07 07 68 64 01 D4 07 0B 01 02 4E 16",
            Read(100, ("output2.range_warning",), EEPROM)),
    Example("section 3.3.5.20", "68 0B 0B 68 64 01 D5 07 0B 00 02 FF FF FF FF 4A 16",
            Write(100, {"output2.range_warning": 429496.7295}, RAM)),
    Example("section 3.3.5.21", "68 08 08 68 64 01 D5 08 28 01 FF E7 51 16",
            Write(100, {"moving_target_sensitivity.near_db": -2.5}, EEPROM)),
    Example("figure 170", "68 07 07 68 64 01 D5 08 53 00 01 96 16",
            Write(100, {"rcs_output": True}, RAM)),
    Example("section 3.3.5.24", "68 04 04 68 01 64 D4 00 39 16",
            Values(100, {"rcs_output": False}, RAM)),
    Example("figure 174", "68 07 07 68 64 01 D5 08 80 00 01 C3 16",
            Write(100, {"target_clustering": True}, RAM)),
    Example("figure 176", "68 06 06 68 64 01 D4 08 80 00 C1 16",
            Read(100, ("target_clustering",), RAM)),
    Example("figure 177", "68 04 04 68 01 64 D4 01 3A 16",
            Values(100, {"target_clustering": True}, RAM)),
    # The replies for the stop bar zones are not shown in the manual: both forms (errata I14, I15).
    Example("table 21", "68 07 07 68 64 01 D4 08 A0 00 00 E1 16",
            Read(100, ("stop_bar_zone1.enable",), RAM)),
    Example("table 21", "68 04 04 68 01 64 D4 01 3A 16",
            Values(100, {"stop_bar_zone1.enable": True}, RAM)),
    Example("table 21", "68 06 06 68 01 64 D4 01 00 01 3B 16",
            Values(100, {"stop_bar_zone1.enable": True}, EEPROM)),
    Example("table 21", "68 08 08 68 64 01 D5 08 A0 00 00 01 E3 16",
            Write(100, {"stop_bar_zone1.enable": True}, RAM)),
    Example("table 21", "68 08 08 68 64 01 D5 08 A0 01 01 00 E4 16",
            Write(100, {"stop_bar_zone2.enable": False}, EEPROM)),
    Example("table 22", "68 07 07 68 64 01 D4 08 A1 00 00 E2 16",
            Read(100, tuple(ZONE1_RANGE), RAM)),
    Example("table 22", "68 07 07 68 01 64 D4 00 14 00 32 7F 16", Values(100, ZONE1_RANGE, RAM)),
    Example("table 22", "68 09 09 68 01 64 D4 00 00 00 14 00 32 7F 16",
            Values(100, ZONE1_RANGE, RAM)),
    Example("table 22", "68 0B 0B 68 64 01 D5 08 A1 00 00 00 14 00 32 29 16",
            Write(100, ZONE1_RANGE, RAM)),
    Example("table 22", "68 07 07 68 64 01 D4 08 A1 01 01 E4 16",
            Read(100, tuple(ZONE2_RANGE), EEPROM)),
    Example("table 22", "68 09 09 68 01 64 D4 01 01 00 14 00 32 81 16",
            Values(100, ZONE2_RANGE, EEPROM)),
    Example("table 23", "68 07 07 68 64 01 D4 08 A2 00 00 E3 16",
            Read(100, tuple(ZONE1_ANGLE), RAM)),
    Example("table 23", "68 07 07 68 01 64 D4 00 C8 01 63 65 16", Values(100, ZONE1_ANGLE, RAM)),
    Example("table 23", "68 09 09 68 01 64 D4 00 00 00 C8 01 63 65 16",
            Values(100, ZONE1_ANGLE, RAM)),
    Example("table 23", "68 0B 0B 68 64 01 D5 08 A2 00 00 00 C8 01 63 10 16",
            Write(100, ZONE1_ANGLE, RAM)),
    Example("table 23", "68 0B 0B 68 64 01 D5 08 A2 01 01 FF 38 00 C8 E5 16",
            Write(100, ZONE2_ANGLE, EEPROM)),
)
