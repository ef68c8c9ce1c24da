# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Messages of the MyTooliT protocol as literals, each with its meaning in real units.

The manual prints no whole message but the layout of every one; these were put together from its
sections 9.2 and 10 by hand. An identifier is written in two groups: command field (16 bits) and
sender with receiver (12 bits): 3C1 = host to sensor, 3D1 = host to stationary unit, 04F and 44F =
back.

Pure data: nothing here comes from the code under test.
"""

from __future__ import annotations

from typing import Any, NamedTuple

STH, STU = 1, 17
SELF = 0xFF


class Example(NamedTuple):
    """A command and its acknowledgement.

    Attributes:
        section: Section of the manual.
        command: Name in `icotronic_driver.commands`, with an index where there are several.
        node: Node number of the receiver.
        arguments: What is asked.
        request_id: Identifier of the request.
        request: Payload of the request.
        answer_id: Identifier of the acknowledgement.
        answer: Payload of the acknowledgement.
        result: What the acknowledgement says.
    """

    section: str
    command: str
    node: int
    arguments: tuple[Any, ...]
    request_id: int
    request: str
    answer_id: int
    answer: str
    result: Any


NOTHING = "00 00 00 00 00 00 00 00"  # errata C3

SYSTEM = [
    Example("10.2.2", "RESET", STH, (), 0x0006_3C1, "", 0x0004_04F, "", None),
    Example("10.2.2", "RESET", STU, (), 0x0006_3D1, "", 0x0004_44F, "", None),
    Example("10.2.3", "READ_STATE", STU, (), 0x000A_3D1, "00", 0x0008_44F, "25", (2, 5)),
    Example("10.2.3", "READ_STATE", STH, (), 0x000A_3C1, "00", 0x0008_04F, "16", (1, 6)),
    Example("10.2.3", "WRITE_STATE", STH, (2,), 0x000A_3C1, "82", 0x0008_04F, "A2", (2, 2)),
    Example("10.2.3", "WRITE_STATE", STU, (5, 2), 0x000A_3D1, "A5", 0x0008_44F, "A5", (2, 5)),
    Example("10.2.4", "READ_STH_STATUS", STH, (), 0x0016_3C1, NOTHING,
            0x0014_04F, "0A 00 00 00 00 00 00 00", (False, 5, None, None, None)),
    Example("10.2.4", "READ_STH_STATUS", STH, (), 0x0016_3C1, NOTHING,
            0x0014_04F, "03 00 00 00 00 00 00 00", (True, 1, None, None, None)),
    Example("10.2.4", "READ_STU_STATUS", STU, (), 0x0016_3D1, NOTHING,
            0x0014_44F, "6A 00 00 00 00 00 00 00", (False, 5, False, True, True)),
    Example("10.2.4", "READ_STU_STATUS", STU, (), 0x0016_3D1, NOTHING,
            0x0014_44F, "35 00 00 00 00 00 00 00", (True, 2, True, True, False)),
    Example("10.2.5", "READ_STH_ERRORS", STH, (), 0x001A_3C1, NOTHING,
            0x0018_04F, "02 00 00 00 00 00 00 00", (False, True)),
    Example("10.2.5", "READ_STU_ERRORS", STU, (), 0x001A_3D1, NOTHING,
            0x0018_44F, "01 00 00 00 00 00 00 00", (True, None)),
]

BLUETOOTH = [
    Example("10.2.6", "ACTIVATE_BLUETOOTH", STU, (), 0x002E_3D1, "01 00 00 00 00 00 00 00",
            0x002C_44F, "01 00 00 00 00 00 00 00", None),
    Example("10.2.6", "COUNT_DEVICES", STU, (), 0x002E_3D1, "02 00 00 00 00 00 00 00",
            0x002C_44F, "02 00 31 32 00 00 00 00", 12),
    Example("10.2.6", "WRITE_NAME_1", STH, (SELF, b"Test-S"), 0x002E_3C1, "03 FF 54 65 73 74 2D 53",
            0x002C_04F, "03 FF 54 65 73 74 2D 53", None),
    Example("10.2.6", "WRITE_NAME_2", STH, (SELF, b"TH"), 0x002E_3C1, "04 FF 54 48 00 00 00 00",
            0x002C_04F, "04 00 54 48 00 00 00 00", None),
    Example("10.2.6", "READ_NAME_1", STU, (3,), 0x002E_3D1, "05 03 00 00 00 00 00 00",
            0x002C_44F, "05 03 43 47 76 58 41 64", b"CGvXAd"),
    Example("10.2.6", "READ_NAME_2", STU, (3,), 0x002E_3D1, "06 03 00 00 00 00 00 00",
            0x002C_44F, "06 03 36 42 00 00 00 00", b"6B"),
    Example("10.2.6", "CONNECT_NUMBER", STU, (1,), 0x002E_3D1, "07 01 00 00 00 00 00 00",
            0x002C_44F, "07 01 01 00 00 00 00 00", True),
    Example("10.2.6", "CONNECT_NUMBER", STU, (1,), 0x002E_3D1, "07 01 00 00 00 00 00 00",
            0x002C_44F, "07 01 00 00 00 00 00 00", False),
    Example("10.2.6", "CHECK_CONNECTED", STU, (), 0x002E_3D1, "08 00 00 00 00 00 00 00",
            0x002C_44F, "08 00 01 00 00 00 00 00", True),
    Example("10.2.6", "DEACTIVATE_BLUETOOTH", STU, (), 0x002E_3D1, "09 00 00 00 00 00 00 00",
            0x002C_44F, "09 00 00 00 00 00 00 00", None),
    Example("10.2.6", "READ_SEND_COUNTER", STU, (), 0x002E_3D1, "0A 00 00 00 00 00 00 00",
            0x002C_44F, "0A 00 00 00 00 01 02 03", 66051),
    Example("10.2.6", "READ_RECEIVE_COUNTER", STU, (), 0x002E_3D1, "0B 00 00 00 00 00 00 00",
            0x002C_44F, "0B 00 00 00 00 00 01 00", 256),
    Example("10.2.6", "READ_RSSI", STU, (0,), 0x002E_3D1, "0C 00 00 00 00 00 00 00",
            0x002C_44F, "0C 00 C6 00 00 00 00 00", -58),
    Example("10.2.6", "READ_RSSI", STH, (SELF,), 0x002E_3C1, "0C FF 00 00 00 00 00 00",
            0x002C_04F, "0C FF B0 00 00 00 00 00", -80),
    Example("10.2.6", "READ_REDUCED_ENERGY", STH, (), 0x002E_3C1, "0D FF 00 00 00 00 00 00",
            0x002C_04F, "0D FF E0 93 04 00 D0 07", (300.0, 1.25)),  # errata C11
    Example("10.2.6", "WRITE_REDUCED_ENERGY", STH, (200.0, 2.0), 0x002E_3C1,
            "0E FF 40 0D 03 00 80 0C", 0x002C_04F, "0D 00 40 0D 03 00 80 0C", (200.0, 2.0)),
    Example("10.2.6", "READ_LOWEST_ENERGY", STH, (), 0x002E_3C1, "0F FF 00 00 00 00 00 00",
            0x002C_04F, "0F FF 00 14 73 0F A0 0F", (259200.0, 2.5)),
    Example("10.2.6", "WRITE_LOWEST_ENERGY", STH, (259200.0, 2.5), 0x002E_3C1,
            "10 FF 00 14 73 0F A0 0F", 0x002C_04F, "0F 00 00 14 73 0F A0 0F", (259200.0, 2.5)),
    Example("10.2.6", "READ_MAC", STU, (0,), 0x002E_3D1, "11 00 00 00 00 00 00 00",
            0x002C_44F, "11 01 81 DE 01 D7 6B 08", "08:6B:D7:01:DE:81"),
    Example("10.2.6", "READ_MAC", STH, (SELF,), 0x002E_3C1, "11 FF 00 00 00 00 00 00",
            0x002C_04F, "11 00 81 DE 01 D7 6B 08", "08:6B:D7:01:DE:81"),
    Example("10.2.6", "CONNECT_MAC", STU, ("08:6b:d7:01:de:81",), 0x002E_3D1,
            "12 00 81 DE 01 D7 6B 08", 0x002C_44F, "12 00 81 DE 01 D7 6B 08", "08:6B:D7:01:DE:81"),
    Example("10.2.6", "CONNECT_MAC", STU, ("08-6B-D7-01-DE-81",), 0x002E_3D1,
            "12 00 81 DE 01 D7 6B 08", 0x002C_44F, "12 00 00 00 00 00 00 00", "00:00:00:00:00:00"),
]

X, XY, XZ, YZ, XYZ = (True, False, False), (True, True, False), (True, False, True), (
    False, True, True), (True, True, True)

STREAMING = [  # arguments are those of the format: channels, data sets, bytes a value
    Example("10.3.2", "START_ACCELERATION", STH, (X, 3), 0x1002_3C1, "A2",
            0x1000_04F, "A2 00 01 80 02 80 03 80", None),
    Example("10.3.2", "START_ACCELERATION", STH, (XYZ, 1), 0x1002_3C1, "B9",
            0x1000_04F, "B9 FF 01 80 02 80 03 80", None),
    Example("10.3.2", "START_ACCELERATION", STH, (XZ, 1), 0x1002_3C1, "A9",
            0x1000_04F, "A9 07 01 80 02 80", None),
    Example("10.3.2", "START_ACCELERATION", STH, (X, 20, 3), 0x1002_3C1, "E6",
            0x1000_04F, "E6 00", None),
    Example("10.3.2", "STOP_ACCELERATION", STH, (), 0x1002_3C1, "80", 0x1000_04F, "80", None),
    Example("10.3.3", "START_VOLTAGE", STH, (X, 1), 0x1082_3C1, "A1", 0x1080_04F, "A1 00 F8 2A",
            None),
    Example("10.3.3", "STOP_VOLTAGE", STH, (), 0x1082_3C1, "80", 0x1080_04F, "80", None),
    Example("10.3.2", "read_acceleration", STH, (X, 1), 0x1002_3C1, "21",  # the manual's first
            0x1000_04F, "21 00 34 12", (0x1234,)),
    Example("10.3.2", "read_acceleration", STH, (YZ, 1), 0x1002_3C1, "19",  # and second example
            0x1000_04F, "19 05 34 12 78 56", (0x1234, 0x5678)),
    Example("10.3.2", "read_acceleration", STH, (XYZ, 1), 0x1002_3C1, "39",
            0x1000_04F, "39 FF 01 80 FF 7F 00 00", (0x8001, 0x7FFF, 0)),
    Example("10.3.2", "read_acceleration", STH, (X, 1, 3), 0x1002_3C1, "61",
            0x1000_04F, "61 00 56 34 12", (0x123456,)),
    Example("10.3.3", "read_voltage", STH, (X, 1), 0x1082_3C1, "21", 0x1080_04F, "21 00 F8 2A",
            (11000,)),
    Example("10.3.3", "read_voltage", STH, (XY, 1), 0x1082_3C1, "31",
            0x1080_04F, "31 01 F8 2A 00 80", (11000, 32768)),
]

STATISTICS = [
    Example("10.4.1", "READ_POWER_CYCLES", STH, (), 0x2002_3C1, NOTHING,
            0x2000_04F, "00 00 01 02 00 00 00 03", (258, 3)),
    Example("10.4.2", "READ_OPERATING_TIME", STU, (), 0x2006_3D1, NOTHING,
            0x2004_44F, "00 00 0E 10 00 01 51 80", (3600, 86400)),
    Example("10.4.3", "READ_UNDER_VOLTAGES", STH, (), 0x200A_3C1, NOTHING,
            0x2008_04F, "00 00 00 07", 7),
    Example("10.4.3", "READ_UNDER_VOLTAGES", STH, (), 0x200A_3C1, NOTHING,
            0x2008_04F, "00 00 01 00 00 00 00 00", 256),
    Example("10.4.4", "READ_WATCHDOG_RESETS", STH, (), 0x200E_3C1, NOTHING,
            0x200C_04F, "00 00 00 02 00 00 00 00", 2),
    Example("10.4.5", "READ_PRODUCTION_DATE", STU, (), 0x2012_3D1, NOTHING,
            0x2010_44F, "32 30 32 31 31 30 30 35", "2021-10-05"),
    Example("10.4.5", "READ_PRODUCTION_DATE", STH, (), 0x2012_3C1, NOTHING,
            0x2010_04F, "61 62 63 00 00 00 00 00", "abc"),
]

ACCELERATION, TEMPERATURE, VOLTAGE = 0, 1, 32

CONFIGURATION = [  # ADC: prescaler, acquisition time, oversampling rate, reference voltage
    Example("10.5.1", "READ_ADC", STH, (), 0xA002_3C1, NOTHING,
            0xA000_04F, "00 02 04 06 42 00 00 00", (2, 8, 64, 3.3)),  # section 10.5.1.1.6
    Example("10.5.1", "READ_ADC", STH, (), 0xA002_3C1, NOTHING,
            0xA000_04F, "00 01 00 0A 19 00 00 00", (1, 1, 1024, 1.25)),
    Example("10.5.1", "WRITE_ADC", STH, (2, 8, 64, 3.3), 0xA002_3C1, "80 02 04 06 42 00 00 00",
            0xA000_04F, "80 02 04 06 42 00 00 00", (2, 8, 64, 3.3)),
    Example("10.5.1", "WRITE_ADC", STH, (127, 256, 4096, 6.6), 0xA002_3C1,
            "80 7F 09 0C 84 00 00 00", 0xA000_04F, "80 7F 09 0C 84 00 00 00",
            (127, 256, 4096, 6.6)),
    Example("10.5.1", "WRITE_ADC", STH, (1, 4, 1, 5.0), 0xA002_3C1, "80 01 03 00 64 00 00 00",
            0xA000_04F, "80 01 03 00 64 00 00 00", (1, 4, 1, 5.0)),
    Example("10.5.2", "READ_USED_SENSORS", STH, (), 0xA006_3C1, NOTHING,
            0xA004_04F, "00 01 02 03 00 00 00 00", (1, 2, 3)),
    Example("10.5.2", "WRITE_USED_SENSORS", STH, (4, 0, 5), 0xA006_3C1, "80 04 00 05 00 00 00 00",
            0xA004_04F, "80 04 02 05 00 00 00 00", (4, 2, 5)),
    Example("10.5.3", "READ_CALIBRATION_K", STH, (ACCELERATION, 1), 0xA182_3C1,
            "00 01 00 00 00 00 00 00", 0xA180_04F, "00 01 00 00 3F C0 00 00", 1.5),
    Example("10.5.3", "WRITE_CALIBRATION_K", STH, (VOLTAGE, 2, 0.5), 0xA182_3C1,
            "20 02 80 00 3F 00 00 00", 0xA180_04F, "20 02 00 00 3F 00 00 00", 0.5),
    Example("10.5.4", "READ_CALIBRATION_D", STH, (TEMPERATURE, 3), 0xA186_3C1,
            "01 03 00 00 00 00 00 00", 0xA184_04F, "01 03 00 00 C2 C8 00 00", -100.0),
    Example("10.5.4", "WRITE_CALIBRATION_D", STH, (ACCELERATION, 3, -100.0), 0xA186_3C1,
            "00 03 80 00 C2 C8 00 00", 0xA184_04F, "00 03 00 00 C2 C8 00 00", -100.0),
    Example("10.5.5", "MEASURE", STH, (ACCELERATION, 1, 3.3), 0xA18A_3C1,
            "E0 00 01 42 00 00 00 00", 0xA188_04F, "E0 00 01 42 34 80 00 00", 0x8034),
    Example("10.5.5", "MEASURE", STH, (ACCELERATION, 2, 3.3, 1), 0xA18A_3C1,
            "A0 00 02 42 00 00 00 00", 0xA188_04F, "A0 00 02 42 00 00 00 00", 0),
    Example("10.5.5", "MEASURE", STH, (97, 1, 6.6, 2), 0xA18A_3C1,
            "C0 61 01 84 00 00 00 00", 0xA188_04F, "C0 61 01 84 00 00 00 00", 0),
    Example("10.5.5", "READ_MEASUREMENT", STH, (ACCELERATION, 1), 0xA18A_3C1,
            "60 00 01 42 00 00 00 00", 0xA188_04F, "60 00 01 42 34 80 00 00", 0x8034),
    Example("10.5.5", "READ_TEMPERATURE", STH, (), 0xA18A_3C1, "E0 01 01 19 00 00 00 00",
            0xA188_04F, "E0 01 01 19 5F 5D 00 00", 23.903),
    Example("10.5.5", "READ_TEMPERATURE", STH, (), 0xA18A_3C1, "E0 01 01 19 00 00 00 00",
            0xA188_04F, "E0 01 01 19 0C FE FF FF", -0.5),
    Example("10.5.6", "READ_LED", STH, (), 0xA302_3C1, "01 01 00 00 00 00 00 00",
            0xA300_04F, "01 01 01 00 00 00 00 00", True),
    Example("10.5.6", "WRITE_LED", STH, (False,), 0xA302_3C1, "81 01 02 00 00 00 00 00",
            0xA300_04F, "81 01 02 00 00 00 00 00", False),
    Example("10.5.6", "WRITE_LED", STH, (True, 7), 0xA302_3C1, "81 07 01 00 00 00 00 00",
            0xA300_04F, "81 07 01 00 00 00 00 00", True),
]

EEPROM = [
    Example("10.6.1", "READ_EEPROM", STU, (4, 24, 4), 0xF402_3D1, "04 18 04 00 00 00 00 00",
            0xF400_44F, "04 18 04 00 56 61 6C 65", b"Vale"),
    Example("10.6.1", "READ_EEPROM", STH, (0, 0, 1), 0xF402_3C1, "00 00 01 00 00 00 00 00",
            0xF400_04F, "00 00 01 00 AC 00 00 00", b"\xac"),
    Example("10.6.2", "WRITE_EEPROM", STH, (8, 252, b"\x01\x02\x03\x04"), 0xF406_3C1,
            "08 FC 04 00 01 02 03 04", 0xF404_04F, "08 FC 04 00 01 02 03 04", b"\x01\x02\x03\x04"),
    Example("10.6.2", "WRITE_EEPROM", STH, (0, 13, b"\xd0\x07"), 0xF406_3C1,
            "00 0D 02 00 D0 07 00 00", 0xF404_04F, "00 0D 02 00 D0 07 00 00", b"\xd0\x07"),
    Example("10.6.3", "READ_EEPROM_WRITES", STU, (), 0xF482_3D1, NOTHING,
            0xF480_44F, "FF FF FF FF 0A 01 00 00", 266),
]

PRODUCT_DATA = [
    Example("10.7.1", "READ_GTIN", STU, (), 0xF802_3D1, NOTHING,
            0xF800_44F, "15 CD 5B 07 00 00 00 00", 123456789),
    Example("10.7.2", "READ_HARDWARE_VERSION", STH, (), 0xF806_3C1, NOTHING,
            0xF804_04F, "00 00 00 00 00 01 04 00", (1, 4, 0)),
    Example("10.7.3", "READ_FIRMWARE_VERSION", STH, (), 0xF80A_3C1, NOTHING,
            0xF808_04F, "FF FF FF FF FF 02 01 0A", (2, 1, 10)),
    Example("10.7.4", "READ_RELEASE_NAME", STH, (), 0xF80E_3C1, NOTHING,
            0xF80C_04F, "54 61 6E 6A 61 00 FF FF", "Tanja"),
    Example("10.7.4", "READ_RELEASE_NAME", STU, (), 0xF80E_3D1, NOTHING,
            0xF80C_44F, "41 42 43 44 45 46 47 48", "ABCDEFGH"),
    *(Example("10.7.5", f"READ_SERIAL_NUMBER[{index}]", STH, (), request, NOTHING, answer,
              "53 2D 34 32 00 00 00 00", b"S-42\0\0\0\0")
      for index, (request, answer) in enumerate((
          (0xF812_3C1, 0xF810_04F), (0xF816_3C1, 0xF814_04F), (0xF81A_3C1, 0xF818_04F),
          (0xF81E_3C1, 0xF81C_04F)))),
    *(Example("10.7.6", f"READ_PRODUCT_NAME[{index}]", STU, (), request, NOTHING, answer,
              "C3 84 20 31 32 33 34 35", b"\xc3\x84 12345")
      for index, (request, answer) in enumerate((
          (0xF822_3D1, 0xF820_44F), (0xF826_3D1, 0xF824_44F), (0xF82A_3D1, 0xF828_44F),
          (0xF82E_3D1, 0xF82C_44F), (0xF832_3D1, 0xF830_44F), (0xF836_3D1, 0xF834_44F),
          (0xF83A_3D1, 0xF838_44F), (0xF83E_3D1, 0xF83C_44F), (0xF842_3D1, 0xF840_44F),
          (0xF846_3D1, 0xF844_44F), (0xF84A_3D1, 0xF848_44F), (0xF84E_3D1, 0xF84C_44F),
          (0xF852_3D1, 0xF850_44F), (0xF856_3D1, 0xF854_44F), (0xF85A_3D1, 0xF858_44F),
          (0xF85E_3D1, 0xF85C_44F)))),
    *(Example("10.7.7", f"READ_OEM_DATA[{index}]", STH, (), request, NOTHING, answer,
              "00 01 02 03 FC FD FE FF", b"\x00\x01\x02\x03\xfc\xfd\xfe\xff")
      for index, (request, answer) in enumerate((
          (0xF862_3C1, 0xF860_04F), (0xF866_3C1, 0xF864_04F), (0xF86A_3C1, 0xF868_04F),
          (0xF86E_3C1, 0xF86C_04F), (0xF872_3C1, 0xF870_04F), (0xF876_3C1, 0xF874_04F),
          (0xF87A_3C1, 0xF878_04F), (0xF87E_3C1, 0xF87C_04F)))),
    Example("10.7.8", "READ_TOOL_RFID", STH, (), 0xFA02_3C1, NOTHING,
            0xFA00_04F, "01 02 03", b"\x01\x02\x03"),
]

TEST = [
    Example("10.8.1", "TEST_SIGNAL", STH, (2, 7, b"\x01\x02"), 0xFC06_3C1,
            "02 07 01 02 00 00 00 00", 0xFC04_04F, "02 07 00 01 02 03 04 05",
            (2, 7, b"\x01\x02\x03\x04\x05")),
]

EXAMPLES = [*SYSTEM, *BLUETOOTH, *STREAMING, *STATISTICS, *CONFIGURATION, *EEPROM, *PRODUCT_DATA,
            *TEST]

# Numbers of section 10.9 with the words that an error must hold.
ERRORS = {"00": "specific error", "01": "not available", "02": "general error",
          "03": "write not allowed", "04": "unsupported format", "05": "wrong key or magic number",
          "06": "no super frame inside a super frame", "C8": "unknown error 200"}


class SettingExample(NamedTuple):
    """Settings of one record: all values, what is read, and what is written.

    Attributes:
        values: Value of each setting, in the order of the wire.
        exchanges: For each part: reading request, its answer, writing request.
        command_id: First group of the requests' identifiers.
    """

    values: dict[str, Any]
    exchanges: list[tuple[str, str, str]]
    command_id: int


def _factor(command_id: int, name: str, head: str, value: float, data: str) -> SettingExample:
    return SettingExample({name: value}, [(f"{head} 00 00 00 00 00 00", f"{head} 00 00 {data}",
                                           f"{head} 80 00 {data}")], command_id)


SETTINGS = [
    SettingExample({"name": "Halleß1"}, [  # the border between the parts cuts the ß
        ("05 FF 00 00 00 00 00 00", "05 FF 48 61 6C 6C 65 C3", "03 FF 48 61 6C 6C 65 C3"),
        ("06 FF 00 00 00 00 00 00", "06 FF 9F 31 00 00 00 00", "04 FF 9F 31 00 00 00 00")],
        0x002E),
    SettingExample({"adc.prescaler": 2, "adc.acquisition_time": 8, "adc.oversampling_rate": 64,
                    "adc.reference_voltage": 3.3},
                   [(NOTHING, "00 02 04 06 42 00 00 00", "80 02 04 06 42 00 00 00")], 0xA002),
    SettingExample({"used_sensor.x": 1, "used_sensor.y": 2, "used_sensor.z": 255},
                   [(NOTHING, "00 01 02 FF 00 00 00 00", "80 01 02 FF 00 00 00 00")], 0xA006),
    _factor(0xA182, "calibration.acceleration_x.slope", "00 01", 0.003, "3B 44 9B A6"),
    _factor(0xA186, "calibration.acceleration_x.offset", "00 01", -100.0, "C2 C8 00 00"),
    _factor(0xA182, "calibration.acceleration_y.slope", "00 02", 1.5, "3F C0 00 00"),
    _factor(0xA186, "calibration.acceleration_y.offset", "00 02", -2.0, "C0 00 00 00"),
    _factor(0xA182, "calibration.acceleration_z.slope", "00 03", 0.5, "3F 00 00 00"),
    _factor(0xA186, "calibration.acceleration_z.offset", "00 03", 1.0, "3F 80 00 00"),
    _factor(0xA182, "calibration.temperature1.slope", "01 01", 1.0, "3F 80 00 00"),
    _factor(0xA186, "calibration.temperature1.offset", "01 01", -273.15, "C3 88 93 33"),
    _factor(0xA182, "calibration.temperature2.slope", "01 02", 2.0, "40 00 00 00"),
    _factor(0xA186, "calibration.temperature2.offset", "01 02", 0.0, "00 00 00 00"),
    _factor(0xA182, "calibration.temperature3.slope", "01 03", 4.0, "40 80 00 00"),
    _factor(0xA186, "calibration.temperature3.offset", "01 03", -1.0, "BF 80 00 00"),
    _factor(0xA182, "calibration.voltage1.slope", "20 01", 0.25, "3E 80 00 00"),
    _factor(0xA186, "calibration.voltage1.offset", "20 01", 8.0, "41 00 00 00"),
    _factor(0xA182, "calibration.voltage2.slope", "20 02", 0.1, "3D CC CC CD"),
    _factor(0xA186, "calibration.voltage2.offset", "20 02", 3.0, "40 40 00 00"),
    _factor(0xA182, "calibration.voltage3.slope", "20 03", -0.5, "BF 00 00 00"),
    _factor(0xA186, "calibration.voltage3.offset", "20 03", 100.0, "42 C8 00 00"),
    SettingExample({"reduced_energy.sleep_time": 300.0, "reduced_energy.advertisement_time": 1.25},
                   [("0D FF 00 00 00 00 00 00", "0D FF E0 93 04 00 D0 07",
                     "0E FF E0 93 04 00 D0 07")], 0x002E),
    SettingExample({"lowest_energy.sleep_time": 259200.0, "lowest_energy.advertisement_time": 2.5},
                   [("0F FF 00 00 00 00 00 00", "0F FF 00 14 73 0F A0 0F",
                     "10 FF 00 14 73 0F A0 0F")], 0x002E),
    SettingExample({"led": "disabled"}, [
        ("01 01 00 00 00 00 00 00", "01 01 02 00 00 00 00 00", "81 01 02 00 00 00 00 00")],
        0xA302),
]


class FieldExample(NamedTuple):
    """A field of the EEPROM: where it is, some bytes, and what they mean."""

    name: str
    page: int
    offset: int
    length: int
    read_only: bool
    data: str
    value: Any
    default: Any


def _page_0(name: str, default: str) -> list[FieldExample]:
    return [
        FieldExample("EEPROM Status", 0, 0, 1, True, "AC", 0xAC, 0xAC),
        FieldExample(name, 0, 1, 8, False, "43 47 76 58 41 64 36 42", "CGvXAd6B", default),
        FieldExample("Sleep Time 1", 0, 9, 4, False, "E0 93 04 00", 300.0, 300.0),
        FieldExample("Advertisement Time 1", 0, 13, 2, False, "D0 07", 1.25, 1.25),
        FieldExample("Sleep Time 2", 0, 15, 4, False, "00 14 73 0F", 259200.0, 259200.0),
        FieldExample("Advertisement Time 2", 0, 19, 2, False, "A0 0F", 2.5, 2.5),
    ]


def _page_4(release: str, *, read_only: bool) -> list[FieldExample]:
    return [
        FieldExample("GTIN", 4, 0, 8, True, "15 CD 5B 07 00 00 00 00", 123456789, 0),
        FieldExample("Hardware Version: Major", 4, 13, 1, read_only, "01", 1, None),
        FieldExample("Hardware Version: Minor", 4, 14, 1, read_only, "04", 4, None),
        FieldExample("Hardware Version: Patch", 4, 15, 1, read_only, "00", 0, None),
        FieldExample("Firmware Version: Major", 4, 21, 1, read_only, "02", 2, None),
        FieldExample("Firmware Version: Minor", 4, 22, 1, read_only, "01", 1, None),
        FieldExample("Firmware Version: Patch", 4, 23, 1, read_only, "0A", 10, None),
        FieldExample("Release Name", 4, 24, 8, read_only, "54 61 6E 6A 61 00 00 00", "Tanja",
                     release),
        FieldExample("Serial Number", 4, 32, 32, True, "53 2D 34 32" + " 00" * 28, "S-42", "0"),
        FieldExample("Product Name", 4, 64, 128, True, "C3 84" + " 00" * 126, "Ä", "0"),
        FieldExample("OEM Free Use", 4, 192, 64, True, "01 02" + " 00" * 62,
                     b"\x01\x02" + bytes(62), bytes(64)),
    ]


def _page_5(*, read_only: bool) -> list[FieldExample]:
    return [
        FieldExample("Power On Cycles", 5, 0, 4, True, "01 02 00 00", 513, 0),
        FieldExample("Power Off Cycles", 5, 4, 4, True, "03 00 00 00", 3, 0),
        FieldExample("Operating Time", 5, 8, 4, True, "10 0E 00 00", 3600, 0),
        FieldExample("Under Voltage Counter", 5, 12, 4, True, "04 00 00 00", 4, 0),
        FieldExample("Watchdog Reset Counter", 5, 16, 4, True, "05 00 00 00", 5, 0),
        FieldExample("Production Date: Year", 5, 20, 4, read_only, "32 30 32 31", "2021", None),
        FieldExample("Production Date: Month", 5, 24, 2, read_only, "31 30", "10", None),
        FieldExample("Production Date: Day", 5, 26, 2, read_only, "30 35", "05", None),
        FieldExample("Batch Number", 5, 28, 4, True, "39 05 00 00", 1337, None),
    ]


def _slope_and_offset(name: str, offset: int) -> list[FieldExample]:
    return [FieldExample(f"{name}: Slope", 8, offset, 4, False, "00 00 C0 3F", 1.5, None),
            FieldExample(f"{name}: Offset", 8, offset + 4, 4, False, "00 00 C8 C2", -100.0, None)]


STH_FIELDS = [
    *_page_0("STH Name", "Tanja"), *_page_4("Tanja", read_only=False), *_page_5(read_only=False),
    *_slope_and_offset("Acceleration X", 0), *_slope_and_offset("Acceleration Y", 8),
    *_slope_and_offset("Acceleration Z", 16), *_slope_and_offset("Voltage Battery", 24),
    *_slope_and_offset("Voltage 2", 32), *_slope_and_offset("Voltage 3", 40),
    *_slope_and_offset("Internal Temperature", 48), *_slope_and_offset("Temperature 2", 56),
    *_slope_and_offset("Temperature 3", 64),
]
STU_FIELDS = [
    *_page_0("STU Name", "Valerie"), *_page_4("Valerie", read_only=True), *_page_5(read_only=True),
]
