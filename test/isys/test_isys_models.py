# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The iSYS models against the manual's tables 1, 2, 6, 11, 12, 14, 27 and its section 4.3."""

from __future__ import annotations

import pytest

from driver_common.errors import WrongDeviceError
from isys_radar_driver import commands
from isys_radar_driver.commands import Command
from isys_radar_driver.models import BAUD_RATES, MODELS, find_model, model_of_product
from isys_radar_driver.settings import ALL_SETTINGS, settings_of
from isys_radar_driver.targets import Resolution

# Section 4.3: what each model supports, by the numbers of the sections. Where the manual
# restricts a function to one model ("iSYS-6203 only"), it is listed for that one alone.
EVERY_MODEL = "3.3.2 3.3.3.1 3.3.4.1 3.3.4.2 3.3.6.1 3.3.6.2 3.3.6.3 3.3.6.4 3.3.6.5"
ISYS_4001 = EVERY_MODEL + """
    3.3.4.3 3.3.4.5 3.3.4.9 3.3.5.1 3.3.5.2 3.3.5.3 3.3.5.4 3.3.5.5 3.3.5.7 3.3.5.8 3.3.5.9
    3.3.5.10 3.3.5.11 3.3.5.12 3.3.5.13 3.3.5.16 3.3.7 3.3.8 3.3.9.1 3.3.9.2"""
ISYS_6003 = EVERY_MODEL + """
    3.3.4.3 3.3.4.4 3.3.5.2 3.3.5.3 3.3.5.4 3.3.5.5 3.3.5.7 3.3.5.8 3.3.5.11 3.3.5.12 3.3.5.13
    3.3.5.14 3.3.7 3.3.9.1 3.3.9.2 3.3.10 3.3.11"""
SUPPORTED = {
    "iSYS-4001": ISYS_4001 + " I34",  # some firmware has this one
    "iSYS-4002": ISYS_4001,
    "iSYS-4003": ISYS_4001,
    "iSYS-4004": EVERY_MODEL + """
        3.3.4.3 3.3.4.5 3.3.5.1 3.3.5.2 3.3.5.3 3.3.5.4 3.3.5.5 3.3.5.7 3.3.5.8 3.3.5.11 3.3.5.12
        3.3.5.13 3.3.5.16 3.3.7 3.3.8 3.3.9.1 3.3.9.2""",
    "iSYS-4013": EVERY_MODEL + """
        3.3.4.3 3.3.4.5 3.3.5.1 3.3.5.2 3.3.5.3 3.3.5.4 3.3.5.5 3.3.5.8 3.3.5.9 3.3.5.10 3.3.5.11
        3.3.5.12 3.3.5.13 3.3.5.16 3.3.7 3.3.8 3.3.9.1 3.3.9.2""",
    "iSYS-5010": EVERY_MODEL + " 3.3.5.21 3.3.5.22 3.3.5.23 3.3.5.24 3.3.5.25",
    "iSYS-5011": EVERY_MODEL,
    "iSYS-5020": EVERY_MODEL + """
        3.3.3.3 3.3.3.4 3.3.4.8 3.3.5.21 3.3.5.22 3.3.5.23 3.3.5.24 3.3.5.25""",
    "iSYS-5021": EVERY_MODEL + " 3.3.3.3 3.3.3.4 3.3.4.8",
    "iSYS-5110": EVERY_MODEL + " 3.3.4.6 3.3.4.7 3.3.5.26 3.3.5.27 3.3.5.28",
    "iSYS-6003": ISYS_6003,
    # Section 3.3.4.4: these two have the measurement mode too, to be read.
    "iSYS-6004": EVERY_MODEL + """
        3.3.4.3 3.3.4.4 3.3.4.5 3.3.5.2 3.3.5.3 3.3.5.4 3.3.5.5 3.3.5.7 3.3.5.8 3.3.5.11 3.3.5.12
        3.3.5.13 3.3.7 3.3.9.1 3.3.9.2 3.3.10 3.3.11""",
    "iSYS-6005": EVERY_MODEL + """
        3.3.4.3 3.3.4.4 3.3.5.2 3.3.5.3 3.3.5.4 3.3.5.5 3.3.5.7 3.3.5.8 3.3.5.11 3.3.5.12 3.3.5.13
        3.3.7 3.3.9.1 3.3.9.2 3.3.10""",
    "iSYS-6006": ISYS_6003,
    "iSYS-6007": ISYS_6003,
    "iSYS-6203": ISYS_6003 + " 3.3.3.2 3.3.5.15 3.3.5.17 3.3.5.18 3.3.5.19 3.3.5.20",
}

# Tables 1, 2, 6 and 12: address, baud rate, cycle times by measurement mode, time-out in ms.
# The tables leave out the 5011 and 5021, which are taken as the other 5xxx are.
LINK = {
    "iSYS-4001": (128, 115200, {0: 75}, 100),
    "iSYS-4002": (128, 115200, {0: 75}, 100),
    "iSYS-4003": (128, 9600, {0: 300}, 330),
    "iSYS-4004": (128, 115200, {0: 75}, 100),
    "iSYS-4013": (128, 57600, {0: 750}, 825),
    "iSYS-5010": (100, 115200, {0: 100}, 110),
    "iSYS-5011": (100, 115200, {0: 100}, 110),
    "iSYS-5020": (100, 115200, {0: 100}, 110),
    "iSYS-5021": (100, 115200, {0: 100}, 110),
    "iSYS-5110": (100, 115200, {0: 100}, 110),
    "iSYS-6003": (100, 115200, {0: 50, 1: 200}, 220),
    "iSYS-6004": (100, 115200, {1: 1200}, 1400),
    "iSYS-6005": (100, 230400, {0: 50}, 70),
    "iSYS-6006": (100, 230400, {0: 15, 1: 30}, 50),
    "iSYS-6007": (100, 115200, {0: 50, 1: 200}, 220),
    "iSYS-6203": (100, 115200, {0: 50, 1: 200}, 220),
}

# Table 11: channels with old and with new firmware.
CHANNELS = {
    "iSYS-4001": (4, 8), "iSYS-4002": (4, 8), "iSYS-4003": (4, 8), "iSYS-4013": (4, 8),
    "iSYS-4004": (3, 3),
    "iSYS-5010": (2, 2), "iSYS-5011": (2, 2), "iSYS-5020": (2, 2), "iSYS-5021": (2, 2),
    "iSYS-5110": (2, 2),
    "iSYS-6003": (1, 1), "iSYS-6004": (1, 1), "iSYS-6005": (1, 1), "iSYS-6006": (1, 1),
    "iSYS-6007": (1, 1), "iSYS-6203": (1, 1),
}

# Table 14: largest range in m, signal in dB and velocity in m/s; None where there is no such limit.
LARGEST = {
    "iSYS-4001": (150.0, 250.0, 70.0),
    "iSYS-4002": (150.0, 250.0, 70.0),
    "iSYS-4003": (50.0, 250.0, 12.5),
    "iSYS-4004": (35.0, 250.0, None),
    "iSYS-4013": (None, 250.0, 12.5),
    "iSYS-6003": (20.0, 255.0, None),
    "iSYS-6004": (15.0, 255.0, None),
    "iSYS-6005": (20.0, 255.0, None),
    "iSYS-6006": (10.0, 255.0, None),
    "iSYS-6007": (20.0, 255.0, None),
    "iSYS-6203": (20.0, 255.0, None),
}

# The commands of section 3.3, by their sections.
COMMANDS = {
    "READ_DEVICE_NAME": "3.3.2", "START": "3.3.3.1", "STOP": "3.3.3.1",
    "SET_DEFAULT_TEMPERATURE_THRESHOLDS": "3.3.3.2", "READ_DSP_TEMPERATURE": "3.3.3.3",
    "READ_RFE_TEMPERATURE": "3.3.3.4", "READ_ADDRESS": "3.3.4.1",
    "READ_FIRMWARE_VERSION": "3.3.6.1", "READ_DSP_HARDWARE_VERSION": "3.3.6.2",
    "READ_RFE_HARDWARE_VERSION": "3.3.6.3", "READ_PRODUCT_INFORMATION": "3.3.6.4",
    "READ_BOOTLOADER_VERSION": "3.3.6.5", "READ_DIGITAL_OUTPUTS": "3.3.8",
    "RESTORE_FACTORY_SETTINGS": "3.3.9.1", "SAVE_SENSOR_SETTINGS": "3.3.9.2",
    "SAVE_APPLICATION_SETTINGS": "3.3.9.2", "SAVE_ALL_SETTINGS": "3.3.9.2",
    "READ_RAW": "3.3.10", "READ_RANGE_LIST": "3.3.11",
}

# The settings by their sections; # stands for each output, filter or zone.
SETTINGS = {
    "3.3.4.2": "frequency_channel",
    "3.3.4.3": "threshold_minimum_db",
    "3.3.4.4": "measurement_mode",
    "I34": "range_bound",
    "3.3.4.5": "threshold_sensitivity.left_db threshold_sensitivity.right_db",
    "3.3.4.6": "ip.address ip.subnet_mask ip.gateway",
    "3.3.4.7": "ip_destination.address ip_destination.target_list_port ip_destination.record_port",
    "3.3.4.8": "target_list_interface",
    "3.3.4.9": "led",
    "3.3.5.1": "line_filter#.enable line_filter#.frequency line_filter#.offset_db",
    "3.3.5.2": "output#.mode",
    "3.3.5.3": "output#.rising_delay_cycles output#.falling_delay_cycles",
    "3.3.5.4": "output#.drive",
    "3.3.5.5": "output#.contact",
    "3.3.5.6": "output#.angle_min_deg output#.angle_max_deg",
    "3.3.5.7": "output#.range_min output#.range_max",
    "3.3.5.8": "output#.signal_min_db output#.signal_max_db",
    "3.3.5.9": "output#.velocity_min output#.velocity_max",
    "3.3.5.10": "output#.direction",
    "3.3.5.11": "output#.filter_type",
    "3.3.5.12": "output#.filter_signal",
    "3.3.5.13": "output#.alpha_filter_velocity_percent output#.alpha_filter_range_percent",
    "3.3.5.14": "output#.range_min_extended output#.range_max_extended",
    "3.3.5.15": "mounting_offset",
    "3.3.5.16": "amplifier_potentiometer",
    "3.3.5.17": "output1.temperature_threshold_celsius output2.temperature_threshold_celsius",
    "3.3.5.18": "output1.warning_mode output2.warning_mode",
    "3.3.5.19": "output1.temperature_warning_celsius output2.temperature_warning_celsius",
    "3.3.5.20": "output1.range_warning output2.range_warning",
    "3.3.5.21": "moving_target_sensitivity.near_db",
    "3.3.5.22": "moving_target_sensitivity.main_db",
    "3.3.5.23": "moving_target_sensitivity.long_db",
    "3.3.5.24": "rcs_output",
    "3.3.5.25": "target_clustering",
    "3.3.5.26": "stop_bar_zone#.enable",
    "3.3.5.27": "stop_bar_zone#.range_min stop_bar_zone#.range_max",
    "3.3.5.28": "stop_bar_zone#.angle_min_deg stop_bar_zone#.angle_max_deg",
}


def _names(section: str) -> set[str]:
    names = set()
    for name in SETTINGS.get(section, "").split():
        numbers = (1, 2, 3) if name.startswith("output#") else (1, 2)
        names |= {name.replace("#", str(number)) for number in numbers}
    return names


def test_there_are_16_models() -> None:
    assert list(MODELS) == list(SUPPORTED) == list(LINK) == sorted(CHANNELS)
    assert len(MODELS) == 16


@pytest.mark.parametrize("name", SUPPORTED)
def test_a_model_supports_the_sections_of_its_list(name: str) -> None:
    assert MODELS[name].name == name
    assert MODELS[name].sections == set(SUPPORTED[name].split())


@pytest.mark.parametrize("name", SUPPORTED)
def test_a_model_has_the_commands_of_its_sections(name: str) -> None:
    sections = SUPPORTED[name].split()
    assert {command for command in COMMANDS if MODELS[name].supports(getattr(commands, command))
            } == {command for command, section in COMMANDS.items() if section in sections}


def test_all_commands_are_listed_here() -> None:
    assert {name: command.section for name, command in vars(commands).items()
            if isinstance(command, Command)} == COMMANDS
    assert commands.TARGET_LIST_SECTION == "3.3.7"


def test_all_settings_are_in_their_sections() -> None:
    assert {name: setting.section for name, setting in ALL_SETTINGS.items()} == {
        name: section for section in SETTINGS for name in _names(section)}


@pytest.mark.parametrize("name", SUPPORTED)
def test_a_model_has_the_settings_of_its_sections(name: str) -> None:
    expected = {setting for section in SUPPORTED[name].split() for setting in _names(section)}
    assert set(settings_of(MODELS[name])) == expected


@pytest.mark.parametrize("name", SUPPORTED)
def test_what_can_only_be_read(name: str) -> None:
    read_only = {setting.name for setting in settings_of(MODELS[name]).values()
                 if setting.read_only}
    expected = {"measurement_mode"} if name in ("iSYS-6004", "iSYS-6005") else set()
    if name.startswith("iSYS-6"):  # one channel, section 3.3.4.2
        expected |= {"frequency_channel"}
    assert read_only == expected


@pytest.mark.parametrize("name", SUPPORTED)
def test_an_output_is_a_pwm_on_4xxx_only(name: str) -> None:  # table 15
    settings = settings_of(MODELS[name])
    if "output2.mode" in settings:
        assert ("pwm" in settings["output2.mode"].choices) == name.startswith("iSYS-4")


@pytest.mark.parametrize(("name", "link"), LINK.items(), ids=LINK)
def test_address_baud_rate_and_times(
        name: str, link: tuple[int, int, dict[int, int], int]) -> None:
    model = MODELS[name]
    cycle_times = {mode: round(1000 * seconds) for mode, seconds in model.cycle_times.items()}
    assert (model.address, model.baud_rate, cycle_times, round(1000 * model.timeout)) == link


def test_cycle_time_by_measurement_mode() -> None:
    assert [MODELS["iSYS-6006"].cycle_time(mode) for mode in (0, 1)] == [0.015, 0.030]
    # These have one mode, whatever they say it is.
    assert [MODELS["iSYS-4001"].cycle_time(mode) for mode in (0, 1)] == [0.075, 0.075]
    assert [MODELS["iSYS-6004"].cycle_time(mode) for mode in (0, 1)] == [1.2, 1.2]


def test_all_baud_rates_are_tried_the_commonest_first() -> None:
    assert BAUD_RATES[0] == 115200
    assert sorted(BAUD_RATES) == [9600, 57600, 115200, 230400]


@pytest.mark.parametrize(("name", "channels"), CHANNELS.items(), ids=CHANNELS)
def test_frequency_channels_by_firmware(name: str, channels: tuple[int, int]) -> None:
    for firmware, number in zip((1.309, 1.310), channels, strict=True):
        model = MODELS[name].with_firmware(firmware)
        assert model.frequency_channels == number
        assert settings_of(model)["frequency_channel"].limits == (1, number)
    assert MODELS[name].frequency_channels == channels[1]
    assert MODELS[name].with_firmware(0.36).sections == MODELS[name].sections


@pytest.mark.parametrize(("name", "largest"), LARGEST.items(), ids=LARGEST)
def test_largest_limits(name: str, largest: tuple[float | None, ...]) -> None:
    settings = settings_of(MODELS[name])
    for what, maximum in zip(("range{}", "signal{}_db", "velocity{}"), largest, strict=True):
        for end in ("_min", "_max"):
            for output in (1, 2, 3):
                setting = settings.get(f"output{output}." + what.format(end))
                assert (setting and setting.limits) == (
                    None if maximum is None else (0.0, maximum))


@pytest.mark.parametrize("name", ["iSYS-6003", "iSYS-6006", "iSYS-6007", "iSYS-6203"])
def test_the_extended_range_has_the_same_limit(name: str) -> None:
    settings = settings_of(MODELS[name])
    for end in ("min", "max"):
        assert settings[f"output2.range_{end}_extended"].limits == (0.0, LARGEST[name][0])


@pytest.mark.parametrize("name", SUPPORTED)
def test_resolutions_of_target_lists(name: str) -> None:
    model = MODELS[name]
    if name.startswith("iSYS-4"):
        expected = {Resolution.BITS_16, Resolution.BITS_32}
    elif name == "iSYS-6005":
        expected = {Resolution.BITS_32_FIXED}
    elif name.startswith("iSYS-6"):
        expected = {Resolution.BITS_32}
    else:
        expected = set()  # errata I22
    assert set(model.resolutions) == expected
    assert model.has_target_lists == bool(expected) == ("3.3.7" in SUPPORTED[name].split())


def test_resolution_bytes() -> None:  # table 26
    assert [(int(resolution), resolution.bits, resolution.fixed_length)
            for resolution in Resolution] == [
        (0, 16, False), (16, 16, False), (32, 32, False), (0b10010000, 16, True),
        (0b10100000, 32, True)]


def test_range_step_and_raw_signals() -> None:
    assert {name for name, model in MODELS.items() if model.range_step_16 == 0.001} == {
        "iSYS-4004", "iSYS-6003"}  # errata I6
    assert {model.range_step_16 for model in MODELS.values()} == {0.01, 0.001}
    assert {name for name, model in MODELS.items() if model.raw_as_float} == {"iSYS-6004"}


def test_number_of_targets() -> None:  # sections 3.3.4.4 and 3.3.7
    assert MODELS["iSYS-4001"].max_targets == {0: 35}
    assert MODELS["iSYS-6003"].max_targets == {0: 1, 1: 30}
    for model in MODELS.values():
        assert all(1 <= number <= 35 for number in model.max_targets.values())


@pytest.mark.parametrize("name", ["iSYS-4001", "isys-4001", "ISYS-4001", "4001"])
def test_a_model_is_found_by_its_name(name: str) -> None:
    assert find_model(name) is MODELS["iSYS-4001"]


@pytest.mark.parametrize("name", ["iSYS-4005", "isys4001", "", "400", "iSYS"])
def test_an_unknown_model_says_which_are_known(name: str) -> None:
    with pytest.raises(WrongDeviceError) as caught:
        find_model(name)
    text = str(caught.value)
    assert text.startswith(f'"{name}" is not a known iSYS model')
    assert text.endswith(f"(known are {', '.join(SUPPORTED)})")


def test_an_unknown_model_comes_with_a_suggestion() -> None:
    with pytest.raises(WrongDeviceError, match=r'did you mean "iSYS-4013"\?'):
        find_model("iSYS-40013")


@pytest.mark.parametrize("name", SUPPORTED)
def test_product_information_is_the_number_in_the_name(name: str) -> None:  # errata I23
    number = int(name.removeprefix("iSYS-"))
    assert MODELS[name].product_code == number
    assert model_of_product(number) is MODELS[name]


def test_an_unknown_product_is_named() -> None:
    with pytest.raises(WrongDeviceError, match=r"product information 6008 .*known.*iSYS-6007"):
        model_of_product(6008)
