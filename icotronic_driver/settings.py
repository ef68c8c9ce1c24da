# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The settings of an ICOtronic sensor (STH): one row per setting.

Nothing about a setting is written down anywhere else.
"""

from __future__ import annotations

import struct
from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from driver_common.errors import SettingError
from driver_common.settings import Raw, Setting, Value
from icotronic_driver import commands
from icotronic_driver.commands import (
    ADVERTISEMENT_STEP,
    FIRST_PART,
    NAME_LENGTH,
    SELF,
    IcotronicRecord,
    Part,
)
from icotronic_driver.values import (
    ACQUISITION_TIMES,
    OVERSAMPLING_RATES,
    PRESCALERS,
    REFERENCE_STEP,
    REFERENCE_VOLTAGES,
    AdcConfiguration,
    CalibrationElement,
    decode_text,
    encode_text,
)

RATE_TOLERANCE = 0.005  # by which a sample rate may differ from the wanted one for less noise
RECOMMENDED_PRESCALERS = PRESCALERS[1:]  # the vendor's tool offers no 1 (field note N8)


@dataclass(frozen=True)
class TextSetting(Setting):
    """A setting which is a text in UTF-8, padded with zeros (errata C13)."""

    def encode(self, value: object) -> Raw:
        """Return the bytes of a text.

        Raises:
            SettingError: Not a text, too long, or with a zero.
        """
        return encode_text(str(super(Setting, self).check(value)), struct.calcsize(self.wire))

    def decode(self, raw: Raw) -> Value:
        """Return the text of some bytes."""
        assert isinstance(raw, bytes)
        return decode_text(raw)


class ReferenceVoltage(Setting):
    """The reference voltage: of all codes only some are allowed (section 10.5.1.1.5)."""

    def encode(self, value: object) -> Raw:
        """Return the code of a voltage.

        Raises:
            SettingError: The ADC has no such reference.
        """
        raw = super().encode(value)
        if self.decode(raw) not in REFERENCE_VOLTAGES:
            raise SettingError(f"{self.name} must be one of "
                               f"{', '.join(map(self.text, REFERENCE_VOLTAGES))}, not {value}")
        return raw


ADC = IcotronicRecord(layout=("B", "B", "B", "B"), parts=(
    Part(commands.READ_ADC, commands.WRITE_ADC, b"\x00", b"\x80", 4),))
USED_SENSORS = IcotronicRecord(layout=("B", "B", "B"), parts=(
    Part(commands.READ_USED_SENSORS, commands.WRITE_USED_SENSORS, b"\x00", b"\x80", 3),))
NAME = IcotronicRecord(layout=(f"{NAME_LENGTH}s",), parts=(
    Part(commands.READ_NAME_1, commands.WRITE_NAME_1, bytes((5, SELF)), bytes((3, SELF)),
         FIRST_PART),
    Part(commands.READ_NAME_2, commands.WRITE_NAME_2, bytes((6, SELF)), bytes((4, SELF)),
         NAME_LENGTH - FIRST_PART)))
REDUCED_ENERGY = IcotronicRecord(layout=("I", "H"), byte_order="<", parts=(
    Part(commands.READ_REDUCED_ENERGY, commands.WRITE_REDUCED_ENERGY, bytes((13, SELF)),
         bytes((14, SELF)), 6),))  # errata C11
LOWEST_ENERGY = IcotronicRecord(layout=("I", "H"), byte_order="<", parts=(
    Part(commands.READ_LOWEST_ENERGY, commands.WRITE_LOWEST_ENERGY, bytes((15, SELF)),
         bytes((16, SELF)), 6),))
LED = IcotronicRecord(layout=("B",), parts=(
    Part(commands.READ_LED, commands.WRITE_LED, bytes((0x01, commands.LED_NUMBER)),
         bytes((0x81, commands.LED_NUMBER)), 1),))


def _calibration(element: CalibrationElement, axis: int, *, slope: bool) -> IcotronicRecord:
    read, write = ((commands.READ_CALIBRATION_K, commands.WRITE_CALIBRATION_K) if slope else
                   (commands.READ_CALIBRATION_D, commands.WRITE_CALIBRATION_D))
    return IcotronicRecord(layout=("f",), parts=(
        Part(read, write, bytes((element, axis, 0, 0)), bytes((element, axis, 0x80, 0)), 4),))


def _calibration_rows(name: str, element: CalibrationElement, axis: int, unit: str,
                      what: str) -> tuple[Setting, Setting]:
    """Return the rows of slope and offset: value = slope · raw + offset."""
    return (Setting(f"calibration.{name}.slope", _calibration(element, axis, slope=True), unit=unit,
                    description=f"Size of one ADC step of {what}", section="10.5.3"),
            Setting(f"calibration.{name}.offset", _calibration(element, axis, slope=False),
                    unit=unit, description=f"Value at ADC zero of {what}", section="10.5.4"))


def _energy_rows(name: str, record: IcotronicRecord, until: str) -> tuple[Setting, Setting]:
    return (Setting(f"{name}.sleep_time", record, unit="s", factor=0.001, minimum=0.001,
                    description=f"Time without connection {until}", section="10.2.6"),
            Setting(f"{name}.advertisement_time", record, field=1, unit="s",
                    factor=ADVERTISEMENT_STEP, minimum=ADVERTISEMENT_STEP,
                    description="Time between two advertisements in that energy mode",
                    section="10.2.6"))


ROWS: tuple[Setting, ...] = (
    TextSetting("name", NAME, description="Name of the sensor, up to 8 bytes in UTF-8",
                section="10.2.6"),
    Setting("adc.prescaler", ADC, minimum=PRESCALERS[0], maximum=PRESCALERS[-1], needs_stop=True,
            description="Divider of the ADC's clock", section="10.5.1"),
    Setting("adc.acquisition_time", ADC, field=1, values=ACQUISITION_TIMES, unit="cycles",
            needs_stop=True, description="Clock cycles in which the ADC takes the signal",
            section="10.5.1"),
    Setting("adc.oversampling_rate", ADC, field=2, values=OVERSAMPLING_RATES, needs_stop=True,
            description="Conversions from which the ADC makes one value", section="10.5.1"),
    ReferenceVoltage("adc.reference_voltage", ADC, field=3, unit="V", factor=REFERENCE_STEP,
                     minimum=REFERENCE_VOLTAGES[0], maximum=REFERENCE_VOLTAGES[-1],
                     needs_stop=True, description="Reference voltage of the ADC: "
                     + ", ".join(map(str, REFERENCE_VOLTAGES)), section="10.5.1"),
    *(Setting(f"used_sensor.{axis}", USED_SENSORS, field=index, minimum=1, needs_stop=True,
              description=f"Number of the sensor on channel {axis}", section="10.5.2")
      for index, axis in enumerate("xyz")),
    *(row for index, axis in enumerate("xyz", 1) for row in _calibration_rows(
        f"acceleration_{axis}", CalibrationElement.ACCELERATION, index, "g",
        f"the acceleration in {axis}")),
    *(row for index in (1, 2, 3) for row in _calibration_rows(
        f"temperature{index}", CalibrationElement.TEMPERATURE, index, "°C",
        f"temperature {index}")),
    *(row for index in (1, 2, 3) for row in _calibration_rows(
        f"voltage{index}", CalibrationElement.VOLTAGE, index, "V", f"voltage {index}")),
    *_energy_rows("reduced_energy", REDUCED_ENERGY, "until the reduced energy mode begins"),
    *_energy_rows("lowest_energy", LOWEST_ENERGY,
                  "in the reduced energy mode until the lowest one begins"),
    Setting("led", LED, choices={"enabled": 1, "disabled": 2},
            description="Light-emitting diode of the sensor", section="10.5.6"),
)

SETTINGS: Mapping[str, Setting] = {setting.name: setting for setting in ROWS}


def nearest_adc_configuration(sample_rate: float,
                              reference_voltage: float = 3.3) -> AdcConfiguration:
    """Return the ADC configuration for a wanted sample rate in values/s.

    Of those that come near enough it is the one with the most oversampling, because that has the
    least noise; else the nearest. Where several are equal, the ADC's clock is the fastest, which
    leaves most time to take the signal (field note N8).
    """
    candidates = [AdcConfiguration(prescaler, acquisition, oversampling, reference_voltage)
                  for oversampling in OVERSAMPLING_RATES for acquisition in ACQUISITION_TIMES
                  for prescaler in _prescalers_around(sample_rate, acquisition, oversampling)]

    def deviation(candidate: AdcConfiguration) -> float:
        return abs(candidate.sample_rate - sample_rate)

    near = [one for one in candidates if deviation(one) <= RATE_TOLERANCE * sample_rate]
    most = max((one.oversampling_rate for one in near), default=0)
    return min([one for one in near if one.oversampling_rate == most] or candidates,
               key=lambda one: (deviation(one), -one.oversampling_rate, one.prescaler))


def _prescalers_around(sample_rate: float, acquisition: int, oversampling: int) -> Sequence[int]:
    """Return those with the rates next to the wanted one; the rates fall with the prescaler."""
    below = bisect_left(
        RECOMMENDED_PRESCALERS, -sample_rate,
        key=lambda prescaler: -AdcConfiguration(prescaler, acquisition, oversampling).sample_rate)
    return RECOMMENDED_PRESCALERS[max(0, below - 1):below + 1]
