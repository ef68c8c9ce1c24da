# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The settings of the iSYS radars: one row per setting (tables 10, 13 to 23).

Rows with `{n}` in the name stand for one setting per output, line filter or stop bar zone. Nothing
about a setting is written down anywhere else.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping
from dataclasses import KW_ONLY, dataclass

from driver_common.settings import Setting
from isys_radar_driver.commands import READ_APPLICATION, READ_SENSOR, IsysRecord
from isys_radar_driver.models import RANGE_BOUND, Model

RecordOf = Callable[[int], IsysRecord]


def _sensor(sub_function: int, *layout: str, has_location: bool = False,
            stored_at_once: bool = False) -> RecordOf:
    return lambda _: IsysRecord(READ_SENSOR, sub_function, layout=layout,
                                has_location=has_location, stored_at_once=stored_at_once)


def _application(sub_function: int, *layout: str, has_location: bool = False) -> RecordOf:
    return lambda _: IsysRecord(READ_APPLICATION, sub_function, layout=layout,
                                has_location=has_location)


def _output(sub_function: int, code: str) -> RecordOf:
    return lambda n: IsysRecord(READ_APPLICATION, n << 8 | sub_function, layout=(code,))


def _line_filter() -> RecordOf:
    return lambda n: IsysRecord(READ_APPLICATION, n - 1, layout=("H", "H", "H"))


def _warning(sub_function: int, code: str) -> RecordOf:
    return lambda n: IsysRecord(READ_APPLICATION, sub_function, layout=(code,),
                                has_location=True, selector=bytes((n,)))


def _zone(sub_function: int, *layout: str) -> RecordOf:
    return lambda n: IsysRecord(READ_APPLICATION, sub_function, layout=layout,
                                has_location=True, selector=bytes((n - 1,)))


@dataclass(frozen=True)
class Row:
    """One row of the table.

    Attributes:
        name: Parameter name; "{n}" is the number of the instance.
        record: Gives the record of instance n.
        section: Section of the manual.
        description: One line for people.
        instances: Numbers for which the row stands.
        limit: Attribute of the model that holds the largest value.
        read_only_for: Models on which the setting can only be read.
        choices_lacking: Choices that models do not have: word to the beginning of their names.
        view_of: Name of another row that shows the same boundary, more coarsely (N15).
        more: What else the `Setting` gets.
    """

    name: str
    record: RecordOf
    section: str
    description: str
    _: KW_ONLY
    instances: tuple[int, ...] = (1,)
    limit: str = ""
    read_only_for: tuple[str, ...] = ()
    choices_lacking: Mapping[str, str] = dataclasses.field(default_factory=dict)
    view_of: str = ""
    more: Mapping[str, object] = dataclasses.field(default_factory=dict)

    def settings(self, model: Model | None) -> list[Setting]:
        """Return the settings of this row; with a model, with the model's limits."""
        more = dict(self.more)
        if model is not None:
            if self.limit:
                more["maximum"] = getattr(model, self.limit)
            if self.choices_lacking:
                more["choices"] = {word: code for word, code in self.choices.items()
                                   if not model.name.startswith(
                                       self.choices_lacking.get(word, "nothing"))}
            only_value = self.limit and more.get("minimum") == more["maximum"]
            more["read_only"] = bool(only_value) or model.name in self.read_only_for
        return [Setting(self.name.format(n=n), self.record(n), section=self.section,
                        description=self.description.format(n=n), **more)  # type: ignore[arg-type]
                for n in self.instances]

    @property
    def choices(self) -> Mapping[str, int]:
        """Its choices on any model."""
        choices = self.more.get("choices", {})
        assert isinstance(choices, dict)
        return choices


OUTPUTS = (1, 2, 3)
PAIR = (1, 2)
_FLAG = {"kind": bool}
_DB = {"unit": "dB", "factor": 0.1}
_THRESHOLD = {**_DB, "minimum": -30.0, "maximum": 30.0}
_METRES = {"unit": "m", "factor": 0.1, "minimum": 0.0}
_CENTIMETRES = {"unit": "m", "factor": 0.01, "minimum": 0.0}
_VELOCITY = {"unit": "m/s", "factor": 0.1, "minimum": 0.0}
_DEGREES = {"unit": "deg", "factor": 0.1}
_CELSIUS = {"unit": "°C", "factor": 0.01}
_BOARD_CELSIUS = {**_CELSIUS, "minimum": -20.0, "maximum": 100.0}
_STOPPED = {"needs_stop": True}


def _choices(*words: str, first: int = 0) -> dict[str, object]:
    return {"choices": {word: code for code, word in enumerate(words, first)}}


ROWS = (
    Row("frequency_channel", _sensor(0x0004, "H"), "3.3.4.2", "Frequency channel",
        limit="frequency_channels", more={"minimum": 1, **_STOPPED}),
    Row("threshold_minimum_db", _sensor(0x000B, "h"), "3.3.4.3",
        "Smallest value of the detection threshold", more=_THRESHOLD),
    Row("measurement_mode", _sensor(0x0010, "H"), "3.3.4.4",
        "Fast with a single target, or slower with many",
        read_only_for=("iSYS-6004", "iSYS-6005"),
        more={**_choices("fast", "multi_target"), **_STOPPED}),
    Row("range_bound", _sensor(0x0010, "H"), RANGE_BOUND,
        "Largest range that is measured, where the firmware can choose",
        more={**_choices("50_m", "150_m"), **_STOPPED}),
    Row("threshold_sensitivity.left_db", _sensor(0x0016, "h"), "3.3.4.5",
        "Threshold sensitivity of the left FFT side", more=_THRESHOLD),
    Row("threshold_sensitivity.right_db", _sensor(0x0017, "h"), "3.3.4.5",
        "Threshold sensitivity of the right FFT side", more=_THRESHOLD),
    Row("ip.address", _sensor(0x0029, "4s", "4s", "4s", has_location=True), "3.3.4.6",
        "IP address of the sensor", more=_STOPPED),
    Row("ip.subnet_mask", _sensor(0x0029, "4s", "4s", "4s", has_location=True), "3.3.4.6",
        "Subnet mask of the sensor", more={"field": 1, **_STOPPED}),
    Row("ip.gateway", _sensor(0x0029, "4s", "4s", "4s", has_location=True), "3.3.4.6",
        "Gateway of the sensor", more={"field": 2, **_STOPPED}),
    Row("ip_destination.address", _sensor(0x002A, "4s", "H", "H", has_location=True), "3.3.4.7",
        "IP address to which the sensor sends", more=_STOPPED),  # errata I13
    Row("ip_destination.target_list_port", _sensor(0x002A, "4s", "H", "H", has_location=True),
        "3.3.4.7", "Port to which the sensor sends target lists", more={"field": 1, **_STOPPED}),
    Row("ip_destination.record_port", _sensor(0x002A, "4s", "H", "H", has_location=True),
        "3.3.4.7", "Port to which the sensor sends records", more={"field": 2, **_STOPPED}),
    Row("target_list_interface", _sensor(0x002C, "B", has_location=True), "3.3.4.8",
        "Interface on which the sensor sends target lists",
        more=_choices("disabled", "spi", "ethernet")),
    Row("led", _sensor(0x002D, "B", stored_at_once=True), "3.3.4.9",
        "Light-emitting diode; the device stores a change at once",
        more=_choices("disabled", "enabled", "no_blinking")),
    Row("line_filter{n}.enable", _line_filter(), "3.3.5.1",
        "Suppress a frequency of the supply voltage (filter {n})", instances=PAIR, more=_FLAG),
    Row("line_filter{n}.frequency", _line_filter(), "3.3.5.1", "Frequency to suppress (filter {n})",
        instances=PAIR, more={"field": 1, "unit": "Hz", "maximum": 50000}),
    Row("line_filter{n}.offset_db", _line_filter(), "3.3.5.1",
        "Rise of the threshold around that frequency (filter {n})", instances=PAIR,
        more={"field": 2, "maximum": 1000.0, **_DB}),
    Row("output{n}.mode", _output(0x00, "H"), "3.3.5.2", "What digital output {n} shows",
        instances=OUTPUTS, choices_lacking={"pwm": "iSYS-6"},
        more=_choices("disabled", "digital", "pwm")),
    Row("output{n}.rising_delay_cycles", _output(0x01, "H"), "3.3.5.3",
        "Cycles in which a target must be seen before it is reported (output {n})",
        instances=OUTPUTS),
    Row("output{n}.falling_delay_cycles", _output(0x02, "H"), "3.3.5.3",
        "Cycles after which a target that is not seen is forgotten (output {n})",
        instances=OUTPUTS),
    Row("output{n}.drive", _output(0x04, "H"), "3.3.5.4", "How digital output {n} drives its pin",
        instances=OUTPUTS, more=_choices("active_low", "active_high", "totem_pole")),
    Row("output{n}.contact", _output(0x05, "H"), "3.3.5.5",
        "State of digital output {n} without a target",
        instances=OUTPUTS, more=_choices("normally_open", "normally_closed")),
    Row("output{n}.angle_min_deg", _output(0x06, "h"), "3.3.5.6",
        "Smallest angle of the detection area (output {n})", instances=OUTPUTS, more=_DEGREES),
    Row("output{n}.angle_max_deg", _output(0x07, "h"), "3.3.5.6",
        "Largest angle of the detection area (output {n})", instances=OUTPUTS, more=_DEGREES),
    Row("output{n}.range_min", _output(0x08, "h"), "3.3.5.7",
        "Smallest range of the detection area (output {n})", instances=OUTPUTS,
        limit="range_max", more=_METRES),
    Row("output{n}.range_max", _output(0x09, "h"), "3.3.5.7",
        "Largest range of the detection area (output {n})", instances=OUTPUTS,
        limit="range_max", more=_METRES),
    Row("output{n}.signal_min_db", _output(0x0A, "h"), "3.3.5.8",
        "Smallest signal of a reported target (output {n})", instances=OUTPUTS,
        limit="signal_max", more={"minimum": 0.0, **_DB}),
    Row("output{n}.signal_max_db", _output(0x0B, "h"), "3.3.5.8",
        "Largest signal of a reported target (output {n})", instances=OUTPUTS,
        limit="signal_max", more={"minimum": 0.0, **_DB}),
    Row("output{n}.velocity_min", _output(0x0C, "h"), "3.3.5.9",
        "Smallest speed of a reported target (output {n})", instances=OUTPUTS,
        limit="velocity_max", more=_VELOCITY),
    Row("output{n}.velocity_max", _output(0x0D, "h"), "3.3.5.9",
        "Largest speed of a reported target (output {n})", instances=OUTPUTS,
        limit="velocity_max", more=_VELOCITY),
    Row("output{n}.direction", _output(0x0E, "h"), "3.3.5.10",
        "Direction of motion of a reported target (output {n})", instances=OUTPUTS,
        more=_choices("approaching", "receding", "both", first=1)),
    Row("output{n}.filter_type", _output(0x15, "H"), "3.3.5.11",
        "Which target the single target filter picks (output {n})", instances=OUTPUTS,
        more=_choices("highest_amplitude", "mean", "median", "min", "max")),
    Row("output{n}.filter_signal", _output(0x16, "H"), "3.3.5.12",
        "What the single target filter looks at; disabled = all targets (output {n})",
        instances=OUTPUTS, more=_choices("disabled", "velocity", "range")),
    Row("output{n}.alpha_filter_velocity_percent", _output(0x17, "H"), "3.3.5.13",
        "Weight of a new velocity, 100 = no smoothing (output {n})", instances=OUTPUTS,
        more={"unit": "%", "minimum": 0, "maximum": 100}),
    Row("output{n}.alpha_filter_range_percent", _output(0x18, "H"), "3.3.5.13",
        "Weight of a new range, 100 = no smoothing (output {n})", instances=OUTPUTS,
        more={"unit": "%", "minimum": 1, "maximum": 100}),
    Row("output{n}.range_min_extended", _output(0x19, "h"), "3.3.5.14",
        "Smallest range of the detection area in fine steps (output {n})", instances=OUTPUTS,
        limit="range_max", view_of="output{n}.range_min", more=_CENTIMETRES),
    Row("output{n}.range_max_extended", _output(0x1A, "h"), "3.3.5.14",
        "Largest range of the detection area in fine steps (output {n})", instances=OUTPUTS,
        limit="range_max", view_of="output{n}.range_max", more=_CENTIMETRES),
    Row("mounting_offset", _application(0x0506, "I"), "3.3.5.15",
        "Distance that is subtracted from every range", more={"unit": "m", "factor": 0.001}),
    Row("amplifier_potentiometer", _application(0x0680, "H"), "3.3.5.16",
        "Step of the amplifier's potentiometer", more={"minimum": 0, "maximum": 255}),
    Row("output1.temperature_threshold_celsius",
        _application(0x0707, "h", "h", "h", has_location=True), "3.3.5.17",
        "Temperature above which output 1 warns", more=_BOARD_CELSIUS),
    Row("output2.temperature_threshold_celsius",
        _application(0x0707, "h", "h", "h", has_location=True), "3.3.5.17",
        "Temperature above which output 2 gives an alarm", more={"field": 1, **_BOARD_CELSIUS}),
    Row("output{n}.warning_mode", _warning(0x0709, "B"), "3.3.5.18",
        "What output {n} warns of", instances=PAIR,
        more=_choices("temperature", "range", first=1)),  # errata I11
    Row("output{n}.temperature_warning_celsius", _warning(0x070A, "h"), "3.3.5.19",
        "Temperature at which output {n} warns", instances=PAIR,
        view_of="output{n}.temperature_threshold_celsius", more=_CELSIUS),
    Row("output{n}.range_warning", _warning(0x070B, "I"), "3.3.5.20",
        "Range at which output {n} warns", instances=PAIR, more={"unit": "m", "factor": 0.0001}),
    Row("moving_target_sensitivity.near_db", _application(0x0828, "h", has_location=True),
        "3.3.5.21", "Threshold sensitivity for moving targets up to 2.7 m", more=_DB),
    Row("moving_target_sensitivity.main_db", _application(0x0829, "h", has_location=True),
        "3.3.5.22", "Threshold sensitivity for moving targets from 2.7 m to 40.7 m", more=_DB),
    Row("moving_target_sensitivity.long_db", _application(0x082A, "h", has_location=True),
        "3.3.5.23", "Threshold sensitivity for moving targets above 40.7 m", more=_DB),
    Row("rcs_output", _application(0x0853, "B", has_location=True), "3.3.5.24",
        "Report the radar cross-section instead of the signal", more=_FLAG),
    Row("target_clustering", _application(0x0880, "B", has_location=True), "3.3.5.25",
        "Join detections that belong together", more=_FLAG),
    Row("stop_bar_zone{n}.enable", _zone(0x08A0, "B"), "3.3.5.26", "Watch stop bar zone {n}",
        instances=PAIR, more=_FLAG),
    Row("stop_bar_zone{n}.range_min", _zone(0x08A1, "h", "h"), "3.3.5.27",
        "Smallest range of stop bar zone {n}", instances=PAIR,
        more={"unit": "m", "factor": 1.0}),  # errata I15
    Row("stop_bar_zone{n}.range_max", _zone(0x08A1, "h", "h"), "3.3.5.27",
        "Largest range of stop bar zone {n}", instances=PAIR,
        more={"unit": "m", "factor": 1.0, "field": 1}),
    Row("stop_bar_zone{n}.angle_min_deg", _zone(0x08A2, "h", "h"), "3.3.5.28",
        "Smallest angle of stop bar zone {n}", instances=PAIR, more=_DEGREES),
    Row("stop_bar_zone{n}.angle_max_deg", _zone(0x08A2, "h", "h"), "3.3.5.28",
        "Largest angle of stop bar zone {n}", instances=PAIR, more={"field": 1, **_DEGREES}),
)

ALL_SETTINGS: Mapping[str, Setting] = {
    setting.name: setting for row in ROWS for setting in row.settings(None)}

_COARSER = {row.name.format(n=n): row.view_of.format(n=n)
            for row in ROWS if row.view_of for n in row.instances}
OTHER_VIEW: Mapping[str, str] = _COARSER | {
    coarser: name for name, coarser in _COARSER.items()}  # of one boundary, by name

_THRESHOLDS = (0x000B, 0x0016, 0x0017)  # application settings all the same (errata I16)


def settings_of(model: Model) -> dict[str, Setting]:
    """Return the settings that a model has, by name, with the model's limits."""
    return {setting.name: setting for row in ROWS if row.section in model.sections
            for setting in row.settings(model)}


def coarser_first(names: Iterable[str]) -> list[str]:
    """Return names of settings with the finer view of a boundary behind the other, so it counts."""
    return sorted(names, key=lambda name: name in _COARSER)


def record_of(setting: Setting) -> IsysRecord:
    """Return where a setting lives."""
    assert isinstance(setting.record, IsysRecord)
    return setting.record


def is_application_setting(setting: Setting) -> bool:
    """Whether "save application settings" stores it, rather than "save sensor settings"."""
    record = record_of(setting)
    return record.function_code == READ_APPLICATION or record.sub_function in _THRESHOLDS
