# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Telegrams of the UC4000 as literals, each with its meaning in real units.

Table A1 and the values of CHECK are the manual's; the other telegrams were put together from its
chapters 4 and 5 by hand. A command is named as in `uc4000_driver.commands`, with its arguments;
"read" and "write" have a setting.

Pure data: nothing here comes from the code under test.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple


class Request(NamedTuple):
    """A command to the sensor with an address, 0 for all."""

    command: str
    address: int
    telegram: str


class Reply(NamedTuple):
    """What a sensor answers to a command, and what it says; a distance in m with its outcome."""

    command: str
    telegram: str
    result: Any


class Refusal(NamedTuple):
    """What a sensor says when it refuses (section 4.6.2)."""

    telegram: str
    code: int
    text: str


class Stored(NamedTuple):
    """A value of table A1: the request to sensor 7 to store it, and the reply."""

    setting: str
    value: float
    request: bytes
    reply: bytes


VERSION = bytes.fromhex("48 57 3A 56 30 2E 31 20 53 57 3A 56 31 2E 30 30 30 00 E7")
SERIAL_NUMBER = bytes.fromhex("34 30 30 30 30 30 31 36 39 30 30 30 30 31 D7")

# Table A1: value, request to sensor 7 to store it, reply. The third byte is the code.
BURST_PERIODS = """
    4  A7 23 00 57  00 C5
    8  A7 23 01 46  01 D4
   12  A7 23 02 76  02 E4
   16  A7 23 03 67  03 F5
   20  A7 23 04 45  04 D7
   24  A7 23 05 54  05 C6
   28  A7 23 06 64  06 F6
   32  A7 23 07 75  07 E7
   36  A7 23 08 75  08 E7
   40  A7 23 09 64  09 F6
   44  A7 23 0A 54  0A C6
   48  A7 23 0B 45  0B D7
   52  A7 23 0C 67  0C F5
   56  A7 23 0D 76  0D E4
   60  A7 23 0E 46  0E D4
   64  A7 23 0F 57  0F C5
"""
GAIN_DB = """
 56.5  A7 22 00 46  00 C5
   57  A7 22 01 57  01 D4
 57.5  A7 22 02 67  02 E4
   58  A7 22 03 76  03 F5
 58.5  A7 22 04 54  04 D7
   59  A7 22 05 45  05 C6
 59.5  A7 22 06 75  06 F6
   60  A7 22 07 64  07 E7
 60.5  A7 22 08 64  08 E7
   61  A7 22 09 75  09 F6
 61.5  A7 22 0A 45  0A C6
   62  A7 22 0B 54  0B D7
 62.5  A7 22 0C 76  0C F5
   63  A7 22 0D 67  0D E4
 63.5  A7 22 0E 57  0E D4
   64  A7 22 0F 46  0F C5
 64.5  A7 22 10 52  10 D1
   65  A7 22 11 43  11 C0
 65.5  A7 22 12 73  12 F0
   66  A7 22 13 62  13 E1
 66.5  A7 22 14 40  14 C3
   67  A7 22 15 51  15 D2
 67.5  A7 22 16 61  16 E2
   68  A7 22 17 70  17 F3
 68.5  A7 22 18 70  18 F3
   69  A7 22 19 61  19 E2
 69.5  A7 22 1A 51  1A D2
   70  A7 22 1B 40  1B C3
 70.5  A7 22 1C 62  1C E1
   71  A7 22 1D 73  1D F0
 71.5  A7 22 1E 43  1E C0
   72  A7 22 1F 52  1F D1
 72.5  A7 22 20 62  20 E1
   73  A7 22 21 73  21 F0
 73.5  A7 22 22 43  22 C0
   74  A7 22 23 52  23 D1
 74.5  A7 22 24 70  24 F3
   75  A7 22 25 61  25 E2
 75.5  A7 22 26 51  26 D2
   76  A7 22 27 40  27 C3
 76.5  A7 22 28 40  28 C3
   77  A7 22 29 51  29 D2
 77.5  A7 22 2A 61  2A E2
   78  A7 22 2B 70  2B F3
 78.5  A7 22 2C 52  2C D1
   79  A7 22 2D 43  2D C0
 79.5  A7 22 2E 73  2E F0
   80  A7 22 2F 62  2F E1
 80.5  A7 22 30 76  30 F5
   81  A7 22 31 67  31 E4
 81.5  A7 22 32 57  32 D4
   82  A7 22 33 46  33 C5
 82.5  A7 22 34 64  34 E7
   83  A7 22 35 75  35 F6
 83.5  A7 22 36 45  36 C6
   84  A7 22 37 54  37 D7
 84.5  A7 22 38 54  38 D7
   85  A7 22 39 45  39 C6
 85.5  A7 22 3A 75  3A F6
   86  A7 22 3B 64  3B E7
 86.5  A7 22 3C 46  3C C5
   87  A7 22 3D 57  3D D4
 87.5  A7 22 3E 67  3E E4
   88  A7 22 3F 76  3F F5
"""
CURRENT_MA = """
  160  A7 21 00 76  00 C5
  165  A7 21 01 67  01 D4
  171  A7 21 02 57  02 E4
  176  A7 21 03 46  03 F5
  181  A7 21 04 64  04 D7
  186  A7 21 05 75  05 C6
  192  A7 21 06 45  06 F6
  197  A7 21 07 54  07 E7
  203  A7 21 08 54  08 E7
  208  A7 21 09 45  09 F6
  213  A7 21 0A 75  0A C6
  219  A7 21 0B 64  0B D7
  224  A7 21 0C 46  0C F5
  229  A7 21 0D 57  0D E4
  235  A7 21 0E 67  0E D4
  240  A7 21 0F 76  0F C5
  245  A7 21 10 62  10 D1
  251  A7 21 11 73  11 C0
  256  A7 21 12 43  12 F0
  261  A7 21 13 52  13 E1
  267  A7 21 14 70  14 C3
  272  A7 21 15 61  15 D2
  277  A7 21 16 51  16 E2
  283  A7 21 17 40  17 F3
  288  A7 21 18 40  18 F3
  293  A7 21 19 51  19 E2
  299  A7 21 1A 61  1A D2
  304  A7 21 1B 70  1B C3
  309  A7 21 1C 52  1C E1
  315  A7 21 1D 43  1D F0
  320  A7 21 1E 73  1E C0
  325  A7 21 1F 62  1F D1
  331  A7 21 20 52  20 E1
  336  A7 21 21 43  21 F0
  341  A7 21 22 73  22 C0
  347  A7 21 23 62  23 D1
  352  A7 21 24 40  24 F3
  357  A7 21 25 51  25 E2
  363  A7 21 26 61  26 D2
  368  A7 21 27 70  27 C3
  373  A7 21 28 70  28 C3
  379  A7 21 29 61  29 D2
  384  A7 21 2A 51  2A E2
  389  A7 21 2B 40  2B F3
  395  A7 21 2C 62  2C D1
  400  A7 21 2D 73  2D C0
  405  A7 21 2E 43  2E F0
  411  A7 21 2F 52  2F E1
  416  A7 21 30 46  30 F5
  421  A7 21 31 57  31 E4
  427  A7 21 32 67  32 D4
  432  A7 21 33 76  33 C5
  437  A7 21 34 54  34 E7
  443  A7 21 35 45  35 F6
  448  A7 21 36 75  36 C6
  453  A7 21 37 64  37 D7
  459  A7 21 38 64  38 D7
  464  A7 21 39 75  39 C6
  469  A7 21 3A 45  3A F6
  475  A7 21 3B 54  3B E7
  480  A7 21 3C 76  3C C5
  485  A7 21 3D 67  3D D4
  491  A7 21 3E 57  3E E4
  496  A7 21 3F 46  3F F5
"""


def _rows(name: str, table: str) -> list[Stored]:
    rows = []
    for line in table.strip().splitlines():
        value, *telegrams = line.split()
        numbers = bytes.fromhex("".join(telegrams))
        rows.append(Stored(name, float(value), numbers[:4], numbers[4:]))
    return rows


TABLE_A1 = [*_rows("burst_periods", BURST_PERIODS), *_rows("gain_db", GAIN_DB),
            *_rows("current_ma", CURRENT_MA)]

REQUESTS = (
    Request("ASK_ADDRESS", 0, "A8 00 00 43"),
    Request("READ_TEMPERATURE", 7, "AF FF FF 61"),
    Request("measure a 1", 7, "AF FE FE 61"),
    Request("measure b 2", 7, "AF FD FD 61"),
    Request("measure c 3", 7, "AF FC FC 61"),
    Request("measure user 10", 7, "AF 37 F5 70"),
    Request("measure a 255", 7, "AF FE 00 70"),
    Request("READ_ADDRESS", 1, "A9 35 FF 61"),
    Request("write_address 1", 7, "A7 35 01 61"),
    Request("write_address 7", 0, "A0 35 07 70"),
    Request("READ_VERSION", 2, "AA 34 FF 40"),
    Request("READ_SERIAL_NUMBER", 3, "AB 33 FF 73"),
    Request("read burst_periods", 7, "AF 23 FF 75"),
    Request("read gain_db", 7, "AF 22 FF 64"),
    Request("read current_ma", 7, "AF 21 FF 54"),
    Request("write temperature_compensation 255", 7, "A7 0A FF 40"),
    Request("write temperature_compensation 0", 7, "A7 0A 00 40"),
)

REPLIES = (
    Reply("measure b 1", "23 D1", (0.56, "ECHO")),
    Reply("measure b 1", "10 D1", (0.256, "ECHO")),
    Reply("measure b 1", "FA C6", (4.0, "ECHO")),
    Reply("measure b 1", "00 C5", (math.inf, "NO_ECHO")),
    Reply("measure b 1", "01 D4", (-math.inf, "TOO_CLOSE")),
    Reply("measure b 1", "FF C5", (math.inf, "TOO_FAR")),
    Reply("measure b 1", "02 E4", (-math.inf, "TOO_CLOSE")),  # 0.032 m
    Reply("measure b 1", "0F C5", (-math.inf, "TOO_CLOSE")),  # 0.240 m
    Reply("measure b 1", "FB D7", (math.inf, "TOO_FAR")),  # 4.016 m
    Reply("measure b 1", "FE D4", (math.inf, "TOO_FAR")),
    Reply("measure a 1", "DA E2", (3.488, "ECHO")),
    Reply("measure a 1", "DB F3", (math.inf, "TOO_FAR")),  # 3.504 m, profile a ends at 3.5 m
    Reply("measure a 1", "F0 C5", (math.inf, "TOO_FAR")),
    Reply("READ_TEMPERATURE", "15 D2", 21),
    Reply("READ_TEMPERATURE", "E7 F3", -25),
    Reply("READ_TEMPERATURE", "7F ED", 127),
    Reply("READ_TEMPERATURE", "80 ED", -128),
    Reply("READ_ADDRESS", "07 E7", 7),
    Reply("ASK_ADDRESS", "03 F5", 3),
    Reply("write_address 3", "03 F5", 3),
    Reply("READ_VERSION", VERSION.hex(), "HW:V0.1 SW:V1.000"),
    Reply("READ_VERSION", "48 57 3A 56 31 2E 30 20 53 57 3A 54 56 31 2E 30 00 00 F9",
          "HW:V1.0 SW:TV1.0"),  # a test version
    Reply("READ_SERIAL_NUMBER", SERIAL_NUMBER.hex(), "40000016900001"),
)

REFUSALS = (
    Refusal("01 7C", 0x01, "checksum error (0x01)"),
    Refusal("02 4C", 0x02, "telegram timeout (0x02)"),
    Refusal("03 5D", 0x03, "telegram underflow (0x03)"),
    Refusal("04 7F", 0x04, "telegram overflow (0x04)"),
    Refusal("05 6E", 0x05, "parameter error (0x05)"),
    Refusal("06 5E", 0x06, "session error (0x06)"),
    Refusal("07 4F", 0x07, "transmission error (0x07)"),
    Refusal("08 4F", 0x08, "eeprom error (0x08)"),
    Refusal("09 5E", 0x09, "op code error (0x09)"),
    Refusal("0A 6E", 0x0A, "object is read only (0x0A)"),
    Refusal("0B 7F", 0x0B, "temperature error (0x0B)"),
    Refusal("0C 5D", 0x0C, "error that the manual does not explain (0x0C)"),
    Refusal("0D 4C", 0x0D, "error that the manual does not explain (0x0D)"),
    Refusal("FF 6D", 0xFF, "no error (0xFF)"),
    Refusal("42 54", 0x42, "error that the manual does not explain (0x42)"),
)
