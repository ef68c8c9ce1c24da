# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The settings of the UC4000: one row per setting (manual section 5.2, table A1).

Nothing about a setting is written down anywhere else. Burst, gain and current shape the user
profile; the profiles A, B and C are fixed.
"""

from __future__ import annotations

from collections.abc import Mapping

from driver_common.settings import Setting
from uc4000_driver.commands import OpCode, Uc4000Record

BURST_PERIODS = tuple(range(4, 65, 4))
GAIN_DB = tuple(56.5 + 0.5 * code for code in range(64))
CURRENT_MA = (  # rounded irregularly in table A1 (errata U6), sixteen codes to a line
    160, 165, 171, 176, 181, 186, 192, 197, 203, 208, 213, 219, 224, 229, 235, 240,
    245, 251, 256, 261, 267, 272, 277, 283, 288, 293, 299, 304, 309, 315, 320, 325,
    331, 336, 341, 347, 352, 357, 363, 368, 373, 379, 384, 389, 395, 400, 405, 411,
    416, 421, 427, 432, 437, 443, 448, 453, 459, 464, 469, 475, 480, 485, 491, 496,
)

BURST = Uc4000Record("number of burst periods", OpCode.BURST, "5.2.1")
GAIN = Uc4000Record("amplifier gain", OpCode.GAIN, "5.2.2")
CURRENT = Uc4000Record("transducer current", OpCode.CURRENT, "5.2.3")
COMPENSATION = Uc4000Record("temperature compensation", OpCode.TEMPERATURE_COMPENSATION, "5.2.3.3",
                            write_only=True)

SETTINGS = (
    Setting("burst_periods", BURST, values=BURST_PERIODS, section="5.2.1",
            description="Length of the sound burst of the user profile, in periods"),
    Setting("gain_db", GAIN, values=GAIN_DB, unit="dB", section="5.2.2",
            description="Amplifier gain of the user profile"),
    Setting("current_ma", CURRENT, values=CURRENT_MA, unit="mA", section="5.2.3",
            description="Drive current of the transducer in the user profile"),
    Setting("temperature_compensation", COMPENSATION, choices={"on": 0xFF, "off": 0x00},
            section="5.2.3.3",
            description="Correct distances by the measured temperature; the sensor cannot be "
                        "asked for it, so this is what it last acknowledged, or unknown"),
)

ALL_SETTINGS: Mapping[str, Setting] = {setting.name: setting for setting in SETTINGS}
