# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The radar node as its user meets it: a process, simulated radars on a real pseudo-terminal."""

from __future__ import annotations

import contextlib
import json
import math
import signal
import time
from types import SimpleNamespace

import numpy as np
import pytest
from isys_master import FAST_LINE, Lab
from nodes import NodeProcess, Ros
from sensor_msgs.msg import PointCloud2, Range, Temperature
from std_msgs.msg import Bool, Float32MultiArray

from driver_common import diagnostics
from isys_radar_driver.commands import READ_APPLICATION, Location
from isys_radar_driver.frames import READ_TARGET_LIST
from isys_radar_driver.listener import Listener
from isys_radar_driver.models import find_model
from isys_radar_driver.node import IsysRadarNode
from isys_radar_driver.radar import Identity, Options, Radar
from isys_radar_driver.session import RadarBus
from isys_radar_driver.targets import Target

MODULE = "isys_radar_driver.program"
NAME = "/isys_radar"
FIELDS = ("x", "y", "z", "intensity", "range", "azimuth", "elevation", "radial_velocity")
TARGET = Target(signal=42.5, velocity=3.0, range=10.0, angle=math.radians(30.0))
OK, WARN, ERROR, STALE = range(4)


class Station:
    """A node, the line with the radar that it serves, and who talks to the node."""

    def __init__(self, ros, name, process, line, radar):
        self.ros = ros
        self.remote = ros.remote(name)
        self.process = process
        self.line = line
        self.radar = radar


@pytest.fixture
def ros():
    with Ros() as ros:
        yield ros


@pytest.fixture
def lab():
    with Lab() as lab:
        yield lab


@pytest.fixture
def station(ros, lab, launch):
    """Start a radar and a node that has found it."""
    def start(model="iSYS-4001", parameters=None, *arguments):
        line, radar = lab.start(model, baud_rate=FAST_LINE)
        process = launch({"serial_port": line.port, "serial_baud": FAST_LINE,
                          **(parameters or {})}, *arguments)
        process.wait_for_line("connected to")
        return Station(ros, NAME, process, line, radar)

    return start


@pytest.fixture(scope="module")
def running():
    """A station that many tests share; each leaves it measuring."""
    with Lab() as lab, Ros() as ros:
        line, radar = lab.start("iSYS-4001", baud_rate=FAST_LINE)
        parameters = {"serial_port": line.port, "serial_baud": FAST_LINE}
        with NodeProcess(MODULE, parameters, "-r", "__node:=shared") as process:
            process.wait_for_line("connected to")
            yield Station(ros, "/shared", process, line, radar)
            process.stop()


@pytest.fixture
def shared(running):
    """The shared station, with factory settings; a busy machine may have to find it again."""
    running.ros.wait_until(lambda: running.remote.trigger("restore_factory_settings").success)
    yield running
    running.ros.forget()


def points_of(cloud):
    """Return the points of a cloud, each as a dictionary."""
    assert tuple(field.name for field in cloud.fields) == FIELDS
    values = np.frombuffer(cloud.data, "<f4").reshape(cloud.width, len(FIELDS))
    return [dict(zip(FIELDS, map(float, point), strict=True)) for point in values]


def stamp_of(message):
    return message.header.stamp.sec + message.header.stamp.nanosec * 1e-9


def wait_for_points(remote, condition=lambda cloud: cloud.width):
    """Return the first cloud from now on that meets a condition."""
    clouds = remote.subscribe(PointCloud2, "points")
    return remote.ros.wait_until(lambda: next(filter(condition, clouds), None))


# --- parameters are the device -----------------------------------------------------------------

@pytest.fixture(scope="module")
def of_each_kind():
    """Return a function that gives the station of a model; they are kept for the module."""
    with contextlib.ExitStack() as stack:
        lab, stations = stack.enter_context(Lab()), {}

        def get(model):
            if model not in stations:
                ros = stack.enter_context(Ros())
                line, radar = lab.start(model, baud_rate=FAST_LINE)
                name = model.replace("-", "_")
                process = stack.enter_context(NodeProcess(
                    MODULE, {"serial_port": line.port, "serial_baud": FAST_LINE},
                    "-r", f"__node:={name}"))
                process.wait_for_line("connected to")
                stations[model] = Station(ros, f"/{name}", process, line, radar)
                settings = radar.settings.keys()
                ros.wait_until(lambda: settings <= stations[model].remote.names())
            return stations[model]

        yield get
        for station in stations.values():
            station.process.stop()


@pytest.mark.parametrize("model", ["iSYS-4001", "iSYS-5110", "iSYS-6005"])
def test_the_parameters_are_those_of_the_model_with_what_it_reported(of_each_kind, model):
    here = of_each_kind(model)
    settings = here.radar.settings
    options = {option.name for option in (*IsysRadarNode.bus_options(),
                                          *IsysRadarNode.SENSOR_OPTIONS)}
    of_ros = ("qos_overrides.", "use_sim_time", "start_type_description_service")
    assert {name for name in here.remote.names() if not name.startswith(of_ros)
            } == settings.keys() | options
    values = dict(zip(settings, here.remote.get(*settings), strict=True))
    assert values == {name: here.radar.value(name) for name in settings}


@pytest.mark.parametrize("model", ["iSYS-4001", "iSYS-5110", "iSYS-6005"])
def test_descriptors_say_what_the_rows_say(of_each_kind, model):
    here = of_each_kind(model)
    settings = here.radar.settings
    for setting, descriptor in zip(settings.values(), here.remote.describe(*settings),
                                   strict=True):
        assert descriptor.description.startswith(setting.description)
        assert f"manual {setting.section}" in descriptor.description
        assert not setting.unit or f"unit {setting.unit}" in descriptor.description
        assert descriptor.read_only == setting.read_only
        ranges = [*descriptor.floating_point_range, *descriptor.integer_range]
        if setting.choices:
            assert descriptor.additional_constraints == "one of " + ", ".join(setting.choices)
        elif setting.kind in (int, float):
            assert [(ranges[0].from_value, ranges[0].to_value)] == [setting.limits]
        else:
            assert not ranges


def test_a_parameter_is_written_to_the_radar(shared):
    assert shared.remote.set("output1.range_max", 20.0).successful
    assert shared.radar.value("output1.range_max") == 20.0
    assert shared.remote.get("output1.range_max") == 20.0


def test_a_whole_number_does_for_a_number(shared):
    assert shared.remote.set("output1.range_max", 20).successful
    assert shared.remote.get("output1.range_max") == 20.0


def test_a_value_is_rounded_to_what_the_radar_holds(shared):
    assert shared.remote.set("output1.range_max", 12.34).successful
    assert shared.remote.get("output1.range_max") == 12.3
    assert shared.radar.value("output1.range_max") == 12.3


def test_a_setting_that_needs_the_acquisition_stopped_is_set_while_it_runs(shared):
    assert shared.remote.set("frequency_channel", 4).successful
    assert shared.radar.value("frequency_channel") == 4
    assert shared.radar.measuring
    wait_for_points(shared.remote)


@pytest.mark.parametrize(("name", "value", "words"), [
    ("output1.range_max", 150.1, "output1.range_max = 150.1 m is out of range, "
                                 "allowed is 0 … 150 m"),
    ("output1.range_max", math.nan, "must be a finite number"),
    ("output1.range_max", "far", "must be a number, not 'far'"),
    ("output1.range_max", True, "must be a number, not True"),
    ("frequency_channel", 9, "allowed is 1 … 8"),
    ("frequency_channel", 1.5, "must be a whole number, not 1.5"),
    ("output1.direction", "approching", 'not \'approching\'; did you mean "approaching"?'),
    ("output1.range_mx", 1.0, 'output1.range_mx is not a parameter of this node; '
                              'did you mean "output1.range_max"?'),
    ("line_filter1.enable", "yes", "must be true or false"),
    ("output", 4, "output = 4 is out of range, allowed is 1 … 3"),
    ("serial_port", "/dev/ttyUSB7", "cannot change while the node is configured"),
    ("address", 3, "cannot change while the node is configured"),
])
def test_a_refused_set_says_why_and_changes_nothing(shared, name, value, words):
    before = dict(shared.radar.ram)
    result = shared.remote.set(name, value)
    assert not result.successful
    assert words in result.reason
    assert shared.radar.ram == before


def test_the_refusal_of_the_radar_is_told(shared):
    shared.remote.set("output1.range_max", 10.0)
    result = shared.remote.set("output1.range_min", 20.0)
    assert not result.successful
    assert "output1.range_min = 20 m: address 128 answers with failure (0xFD)" in result.reason
    assert shared.remote.get("output1.range_min") == 0.0


def test_a_parameter_cannot_be_deleted(shared):
    result = shared.remote.set("output1.range_max", None)
    assert not result.successful
    assert "output1.range_max must be a number" in result.reason


def test_a_setting_that_can_only_be_read_is_not_set(of_each_kind):
    result = of_each_kind("iSYS-6005").remote.set("measurement_mode", "fast")
    assert not result.successful
    assert "measurement_mode can be read only" in result.reason


def test_several_parameters_are_set_together(shared):
    values = {"output1.range_min": 60.0, "output1.range_max": 70.0, "frequency_channel": 2,
              "output": 1}
    shared.remote.set("output1.range_max", 50.0)  # the new minimum lies above
    assert shared.remote.set_atomically(values).successful
    assert shared.remote.get(*values) == list(values.values())
    assert shared.radar.value("output1.range_min") == 60.0


@pytest.mark.parametrize("bad", [
    {"output1.range_min": 99.0}, {"output1.range_maxi": 1.0}, {"frequency_channel": 99},
    {"address": 7}, {"use_sim_time": True}])
def test_of_several_parameters_none_is_set_where_one_is_refused(shared, bad):
    before = dict(shared.radar.ram)
    result = shared.remote.set_atomically({"output1.range_max": 50.0, "output": 2, **bad})
    assert not result.successful
    assert result.reason
    assert shared.radar.ram == before
    assert shared.remote.get("output", "use_sim_time") == [1, False]


def test_overrides_are_written_and_told(station):
    here = station(parameters={"output1.range_max": 42, "output2.direction": "receding",
                               "frequency_channel": 5})
    line = here.process.wait_for_line("wrote ")
    assert "output1.range_max: 150 m → 42 m" in line
    assert "frequency_channel: 1 → 5" in line
    assert "output2.direction: both → receding" in line
    assert here.radar.value("output1.range_max") == 42.0
    here.ros.wait_until(lambda: "output1.range_max" in here.remote.names())
    assert here.remote.get("output1.range_max", "frequency_channel") == [42.0, 5]
    here.process.stop()
    assert not here.radar.measuring


def test_a_set_while_the_radar_is_found_again_is_not_forgotten(shared):
    reading = []
    reply = shared.radar.reply

    def noting(request, now):
        reading.append(request.function_code)
        return reply(request, now)

    shared.radar.power_cycle()
    shared.radar.reply = noting
    shared.line.faults.delay = 0.005
    shared.ros.wait_until(lambda: reading.count(READ_APPLICATION) > 5)  # in the midst of it
    assert shared.remote.set("output1.range_max", 77.0).successful
    shared.line.faults.delay = 0.0
    shared.radar.reply = reply
    wait_for_points(shared.remote)
    assert shared.radar.value("output1.range_max") == 77.0
    assert shared.remote.get("output1.range_max") == 77.0


def test_after_a_power_cycle_the_values_that_were_set_are_set_again(shared):
    shared.remote.set("output1.range_max", 33.0)
    shared.radar.power_cycle()
    shared.ros.wait_until(lambda: shared.radar.value("output1.range_max") == 33.0)
    shared.ros.wait_until(lambda: shared.radar.measuring)
    assert shared.remote.get("output1.range_max") == 33.0


# --- what the user gets wrong ------------------------------------------------------------------

def parameter_file(directory, text):
    path = directory / "parameters.yaml"
    path.write_text(text)
    return ["--params-file", str(path)]


def test_a_typing_error_in_a_parameter_file_is_named(station, tmp_path):
    here = station("iSYS-4001", None, *parameter_file(tmp_path, """
isys_radar:
  ros__parameters:
    output1:
      range_mx: 20.0
    serial_prot: /dev/ttyUSB0
"""))
    assert 'did you mean "output1.range_max"?' in here.process.wait_for_line("output1.range_mx")
    assert 'did you mean "serial_port"?' in here.process.wait_for_line("serial_prot")
    here.process.stop()


def test_an_override_that_the_model_lacks_is_named(station):
    here = station("iSYS-5010", {"output1.range_max": 20.0})
    line = here.process.wait_for_line("output1.range_max")
    assert "the iSYS-5010 has no such setting; it is ignored" in line


def test_overrides_that_are_not_possible_are_named_and_the_rest_works(station):
    here = station(parameters={"output1.range_max": 999.0, "output2.range_max": "far",
                               "frequency_channel": 3})
    here.process.wait_for_line("output1.range_max = 999 m is out of range, allowed is 0 … 150 m")
    here.process.wait_for_line("output2.range_max must be a number, not 'far'")
    assert here.radar.value("frequency_channel") == 3
    status = here.ros.wait_for_status("isys_radar: radar", lambda status: (
        status.message == "2 settings are not as wanted"))
    assert status.level == WARN
    assert status.values["output2.range_max differs"] == "wanted far, reported 150.0"


@pytest.mark.parametrize(("parameters", "words"), [
    ({"serial_baud": "fast"}, "serial_baud must be a whole number, not 'fast'"),
    ({"address": 300}, "address = 300 is out of range, allowed is 0 … 255"),
    ({"config_mode": "pull"}, "config_mode must be one of push, check, leave, not 'pull'"),
    ({"target_list_resolution": 24}, "target_list_resolution must be one of auto, 16, 32"),
    ({"sensors": ["front left"]}, '"front left" cannot be a name'),
    ({"sensors": ["front", "front"]}, "each name must be there once"),
    ({"sensors": ["front"], "front.output": 0}, "front.output = 0 is out of range"),
    ({"serial_port": "sim://iSYS-4711"}, '"iSYS-4711" is not a known iSYS model'),
    ({"serial_port": "sim://iSYS-4001", "model": "4711"}, '"4711" is not a known iSYS model'),
    ({"qos_overrides./isys_radar/points.publisher.reliability": "sometimes"}, "`sometimes`"),
    ({"qos_overrides./isys_radar/points.publisher.depth": "many"},
     "qos_overrides./isys_radar/points.publisher"),
], ids=lambda value: next(iter(value)) if isinstance(value, dict) else "")
def test_a_bad_option_ends_the_start_with_one_line(launch, parameters, words):
    process = launch({"serial_port": "sim://iSYS-4001", **parameters})
    assert process.wait() == 1
    (line,) = process.lines
    assert words in line


@pytest.mark.parametrize(("arguments", "words"), [
    (["--params-file", "/does/not/exist.yaml"], "/does/not/exist.yaml"),
    (["-p", "serial_port"], "serial_port"),
    (["-p", "serial_port:=[1, 'a']"], "serial_port")])
def test_bad_arguments_end_the_start_with_one_line(launch, arguments, words):
    process = launch(None, *arguments)
    assert process.wait() == 1
    *of_rcl, line = process.lines
    assert len(of_rcl) <= 1
    assert words in line


def test_a_parameter_file_that_is_no_yaml_ends_the_start_with_one_line(launch, tmp_path):
    process = launch(None, *parameter_file(tmp_path, "isys_radar: [\n  serial_port: {"))
    assert process.wait() == 1
    assert "parameters.yaml" in process.lines[-1]
    assert len(process.lines) == 2


@pytest.mark.parametrize(("port", "words"), [
    ("", "serial_port is not set; give a device path"),
    ("/dev/ttyMissing", "cannot open /dev/ttyMissing: there is no such port"),
    ("/dev/null", "cannot open /dev/null: that is no serial port"),
    ("/", "cannot open /: that is no serial port"),
    ("socket://127.0.0.1:1", "cannot open socket://127.0.0.1:1: nothing listens there"),
    ("sucket://127.0.0.1:1", "cannot open sucket://127.0.0.1:1: "),
])
def test_a_port_that_cannot_be_opened_is_named_and_waited_for(launch, port, words):
    process = launch({"serial_port": port})
    assert process.wait_for_line(words).endswith("(waiting for it)")
    process.stop()


def test_a_port_that_another_program_uses_is_taken_when_it_is_free(station, launch):
    here = station()
    second = launch({"serial_port": here.line.port, "serial_baud": FAST_LINE},
                    "-r", "__node:=second")
    line = second.wait_for_line("cannot open")
    assert f"cannot open {here.line.port}: it is in use by python" in line
    here.process.stop()
    second.wait_for_line("connected to iSYS-4001")
    second.stop()


def test_a_wrong_address_is_named_with_the_right_one(lab, launch):
    line, _ = lab.start("iSYS-4001", addresses=[17])
    process = launch({"serial_port": line.port, "address": 5})
    assert "a sensor answers at address 17 and 115200 Bd" in process.wait_for_line("no answer")
    process.stop()


def test_another_model_than_expected_is_named(lab, launch):
    line, _ = lab.start("iSYS-4004")
    process = launch({"serial_port": line.port, "model": "iSYS-4001"})
    process.wait_for_line("expected an iSYS-4001, but an iSYS-4004 answers at address 128")
    process.stop()


def test_without_a_radar_everything_says_so(shared):
    shared.radar.silent = True
    status = shared.ros.wait_for_status(
        "shared: radar", lambda status: "check power" in status.message)
    assert status.level == ERROR
    assert "model" not in status.values
    result = shared.remote.set("output1.range_max", 1.0)
    assert not result.successful
    assert "is not connected" in result.reason
    for service in ("start_acquisition", "stop_acquisition", "save_all_settings", "preview_save",
                    "restore_factory_settings", "read_raw_signals"):
        response = shared.remote.trigger(service)
        assert not response.success
        assert "is not connected" in response.message
    shared.radar.silent = False
    wait_for_points(shared.remote)


def test_a_setting_of_a_radar_that_was_never_there_says_so(ros, launch):
    process = launch({"serial_port": "/dev/ttyMissing"})
    process.wait_for_line("there is no such port")
    result = ros.remote(NAME).set("output1.range_max", 1.0)
    assert not result.successful
    assert "/dev/ttyMissing" in result.reason
    status = ros.wait_for_status("isys_radar: radar", lambda status: status.level == ERROR)
    assert "/dev/ttyMissing" in status.message
    assert process.log.count("/dev/ttyMissing") == 1  # however often it was tried


def test_a_resolution_that_the_model_lacks_is_refused(of_each_kind):
    here = of_each_kind("iSYS-6005")
    wait_for_points(here.remote)
    result = here.remote.set("target_list_resolution", "16")
    assert not result.successful
    assert "iSYS-6005 has no target lists of 16 bit" in result.reason
    wait_for_points(here.remote)


# --- topics ------------------------------------------------------------------------------------

def test_points_are_what_was_in_front_of_the_radar(shared):
    before = time.time()
    cloud = wait_for_points(shared.remote, lambda cloud: stamp_of(cloud) > before)
    assert [(field.offset, field.datatype, field.count) for field in cloud.fields] == [
        (4 * index, 7, 1) for index in range(8)]
    assert (cloud.height, cloud.width, cloud.point_step, cloud.row_step) == (1, 3, 32, 96)
    assert (cloud.is_dense, cloud.is_bigendian, len(cloud.data)) == (True, False, 96)
    assert cloud.header.frame_id == "shared_link"
    assert stamp_of(cloud) < time.time()
    for point, target in zip(points_of(cloud), shared.radar.scene(stamp_of(cloud)), strict=True):
        assert point["range"] == pytest.approx(target.range, abs=3.0)  # it moves up to 6 m/s
        assert point["x"] == pytest.approx(point["range"] * math.cos(point["azimuth"]), abs=1e-4)
        assert point["y"] == pytest.approx(point["range"] * math.sin(point["azimuth"]), abs=1e-4)
        assert (point["z"], point["elevation"]) == (0.0, 0.0)


@pytest.mark.parametrize(("conventions", "angle_sign", "velocity_sign"), [
    ({}, 1, -1), ({"positive_angle": "right"}, -1, -1), ({"positive_velocity": "receding"}, 1, 1)])
def test_sign_conventions(shared, conventions, angle_sign, velocity_sign):
    scene, shared.radar.scene = shared.radar.scene, lambda now: [TARGET]
    for name, value in conventions.items():
        assert shared.remote.set(name, value).successful
    (point,) = points_of(wait_for_points(shared.remote, lambda cloud: cloud.width == 1))
    azimuth = angle_sign * math.radians(30.0)
    assert point == pytest.approx({
        "x": 10.0 * math.cos(azimuth), "y": 10.0 * math.sin(azimuth), "z": 0.0,
        "intensity": 42.5, "range": 10.0, "azimuth": azimuth, "elevation": 0.0,
        "radial_velocity": velocity_sign * 3.0}, abs=1e-4)
    shared.radar.scene = scene
    shared.remote.set_atomically({"positive_angle": "left", "positive_velocity": "approaching"})


def test_a_clipping_receiver_gives_an_empty_cloud(shared):
    shared.radar.clipping = True
    cloud = wait_for_points(shared.remote, lambda cloud: cloud.width == 0)
    assert (len(cloud.data), cloud.row_step, cloud.height) == (0, 0, 1)
    assert tuple(field.name for field in cloud.fields) == FIELDS
    status = shared.ros.wait_for_status(
        "shared: radar", lambda status: "overloaded" in status.message)
    assert (status.level, status.message) == (WARN, "receiver overloaded, no targets")
    assert int(status.values["clippings"]) > 0
    clipping = shared.remote.subscribe(Bool, "clipping")
    shared.ros.wait_until(lambda: clipping and clipping[-1].data)
    shared.radar.clipping = False
    shared.ros.wait_until(lambda: not clipping[-1].data)
    shared.ros.wait_for_status("shared: radar", lambda status: status.level == OK)


@pytest.mark.parametrize(("model", "unknown", "is_dense"), [
    ("iSYS-4013", {"x", "y", "z", "range"}, False), ("iSYS-6005", {"radial_velocity"}, True)])
def test_what_a_model_does_not_measure_is_not_a_number(of_each_kind, model, unknown, is_dense):
    here = of_each_kind(model)
    here.radar.scene = lambda now: [Target(40.0, 1.0, 5.0, math.radians(1.0))]  # a placeholder
    cloud = wait_for_points(here.remote, lambda cloud: cloud.width == 1)
    (point,) = points_of(cloud)
    assert {name for name, value in point.items() if math.isnan(value)} == unknown
    assert (point["azimuth"], point["elevation"]) == (0.0, 0.0)
    assert cloud.is_dense == is_dense


def test_every_cycle_is_published_or_counted_as_lost(shared):
    clouds = shared.remote.subscribe(PointCloud2, "points")
    shared.ros.wait_until(lambda: len(clouds) >= 12)
    stamps = [stamp_of(cloud) for cloud in clouds]
    assert stamps == sorted(stamps)
    missed = round((stamps[-1] - stamps[0]) / 0.075) - (len(stamps) - 1)
    status = shared.ros.wait_for_status("shared: radar")
    assert missed <= int(status.values["lost cycles"]) + 1


def test_options_that_may_change_at_run_time_work_at_once(shared):
    scene, shared.radar.scene = shared.radar.scene, lambda now: [TARGET]
    assert shared.remote.set_atomically({
        "frame_id": "bumper", "time_offset": -10.0, "target_list_resolution": "16",
        "output": 2}).successful
    shared.remote.set("output2.range_max", 9.0)
    cloud = wait_for_points(shared.remote, lambda cloud: cloud.width == 0)
    assert cloud.header.frame_id == "bumper"
    assert time.time() - stamp_of(cloud) > 9.0
    shared.remote.set("output2.range_max", 11.0)
    cloud = wait_for_points(shared.remote)
    assert points_of(cloud)[0]["intensity"] == 42.0  # 16-bit lists have whole dB
    shared.remote.set_atomically({"frame_id": "shared_link", "time_offset": 0.0,
                                  "target_list_resolution": "auto", "output": 1})
    shared.radar.scene = scene


def test_digital_outputs_are_published_where_asked_for(shared):
    scene, shared.radar.scene = shared.radar.scene, lambda now: [TARGET]
    outputs = shared.remote.subscribe(Float32MultiArray, "digital_outputs")
    shared.remote.set_atomically({"output2.mode": "pwm", "output3.mode": "digital",
                                  "output3.range_max": 5.0, "publish_digital_outputs": True})
    shared.ros.wait_until(lambda: outputs and list(outputs[-1].data) == [1.0, 10.0, 0.0])
    assert [(part.label, part.size, part.stride) for part in outputs[-1].layout.dim] == [
        ("output", 3, 3)]
    shared.remote.set("publish_digital_outputs", False)
    shared.radar.scene = scene


def test_range_and_temperature_are_published_where_asked_for(station):
    here = station("iSYS-6203", {"publish_range_list": True, "frame_id": "mast"})
    here.radar.scene = lambda now: [Target(40.0, 0.0, 7.123456, 0.0)]
    here.radar.temperature = 12.34
    ranges = here.remote.subscribe(Range, "range")
    temperatures = here.remote.subscribe(Temperature, "temperature")
    lists = here.remote.subscribe(Float32MultiArray, "range_list")
    here.ros.wait_until(lambda: ranges and ranges[-1].range == pytest.approx(7.123456)
                   and temperatures and temperatures[-1].temperature == pytest.approx(12.34))
    assert (ranges[-1].min_range, ranges[-1].max_range) == (0.0, 20.0)
    assert ranges[-1].header.frame_id == temperatures[-1].header.frame_id == "mast"
    assert abs(stamp_of(ranges[-1]) - stamp_of(temperatures[-1])) < 1.0
    here.ros.wait_until(lambda: lists)
    assert lists[-1].layout.dim[0].label == (
        "range, amplitude, temperature, standard_deviation, variance, minimum, maximum")
    assert list(lists[-1].data) == pytest.approx([7.123456, 40.0, 12.34, 0.0, 0.0, 0.0, 0.0])


def test_a_range_without_a_target_is_infinite_and_unknown_while_clipping(station):
    here = station("iSYS-6203", {"publish_range_list": True})
    here.radar.scene = lambda now: []
    ranges = here.remote.subscribe(Range, "range")
    here.ros.wait_until(lambda: ranges and ranges[-1].range == math.inf)
    assert here.remote.set_atomically({"no_echo_value": "max_range", "field_of_view": 0.2,
                                       "too_close_value": "min_range"}).successful
    here.ros.wait_until(lambda: ranges[-1].range == 20.0)
    assert ranges[-1].field_of_view == pytest.approx(0.2)
    here.radar.clipping = True
    here.ros.wait_until(lambda: math.isnan(ranges[-1].range))


def test_raw_signals_are_published_on_request(station):
    here = station("iSYS-6003")
    signals = here.remote.subscribe(Float32MultiArray, "raw_signals")
    here.ros.wait_until(lambda: here.radar.measuring)
    response = here.remote.trigger("read_raw_signals")
    assert response.success, response.message
    assert response.message == "published 4 signals of 512 samples (int16), 25 µs apart"
    (message,) = here.ros.wait_until(lambda: signals)
    assert [(part.label, part.size) for part in message.layout.dim] == [
        ("signal", 4), ("sample, 2.5e-05 s apart", 512)]
    samples = np.array(message.data).reshape(4, 512)
    truth = 8000.0 * np.sin(2 * np.pi * 500.0 * np.arange(512) * 25e-6)
    assert np.abs(samples[0] - truth).max() <= 1.0


def test_a_model_without_target_lists_says_so_and_gives_its_temperatures(station):
    here = station("iSYS-5020")
    here.process.wait_for_line("the iSYS-5020 does not hand out target lists over its serial port")
    here.radar.temperature = 30.0
    boards = [here.remote.subscribe(Temperature, f"{board}_temperature") for board in
              ("dsp", "rfe")]
    here.ros.wait_until(lambda: all(boards))
    assert boards[0][-1].temperature == pytest.approx(boards[1][-1].temperature + 3.0)
    status = here.ros.wait_for_status("isys_radar: radar", lambda status: status.level == OK)
    assert status.message == "connected; this model sends no target lists over serial"
    assert status.values["rfe temperature [°C]"]
    assert here.process.log.count("does not hand out") == 1
    here.process.stop()


# --- services ----------------------------------------------------------------------------------

def test_the_acquisition_can_be_stopped_and_started(shared):
    response = shared.remote.trigger("stop_acquisition")
    assert (response.success, response.message) == (True, "acquisition stopped")
    assert not shared.radar.measuring
    status = shared.ros.wait_for_status(
        "shared: radar", lambda status: "stopped" in status.message)
    assert (status.level, status.message) == (OK, "connected, acquisition stopped")
    assert shared.remote.trigger("start_acquisition").success
    assert shared.radar.measuring
    wait_for_points(shared.remote)


def test_saving_is_previewed_and_keeps_the_settings(shared):
    shared.remote.trigger("save_all_settings")
    shared.remote.set_atomically({"output1.range_max": 44.0, "frequency_channel": 6})
    preview = shared.remote.trigger("preview_save")
    assert preview.success
    assert "output1.range_max: now 44 m" in preview.message
    assert shared.radar.value("output1.range_max", Location.EEPROM) == 150.0
    response = shared.remote.trigger("save_application_settings")
    assert response.message == "saved; changed before: output1.range_max"
    assert shared.radar.value("output1.range_max", Location.EEPROM) == 44.0
    assert shared.radar.value("frequency_channel", Location.EEPROM) == 1
    assert shared.remote.trigger("save_sensor_settings").success
    assert shared.radar.value("frequency_channel", Location.EEPROM) == 6
    assert "nothing" in shared.remote.trigger("preview_save").message


def test_factory_settings_are_restored_and_shown(shared):
    shared.remote.set("output1.range_max", 44.0)
    shared.remote.trigger("save_all_settings")
    assert shared.remote.trigger("restore_factory_settings").success
    assert shared.radar.value("output1.range_max", Location.EEPROM) == 150.0
    shared.ros.wait_until(lambda: shared.remote.get("output1.range_max") == 150.0)
    assert shared.radar.measuring


def test_the_preview_shows_what_the_eeprom_holds_where_that_can_be_read(station):
    here = station("iSYS-6203", {"output2.range_warning": 1.5})
    here.process.wait_for_line("wrote")
    response = here.remote.trigger("preview_save")
    assert response.message == "saving would change output2.range_warning: 0 m → 1.5 m"


def test_default_temperature_thresholds_are_shown(station):
    name = "output1.temperature_threshold_celsius"
    here = station("iSYS-6203", {name: 30.0})
    here.ros.wait_until(lambda: name in here.remote.names())
    assert here.remote.get(name) == 30.0
    response = here.remote.trigger("set_default_temperature_thresholds")
    assert response.success
    assert response.message == "temperature thresholds are 55 °C, 60 °C, 0 °C"
    here.ros.wait_until(lambda: here.remote.get(name) == 55.0)


def test_a_model_without_a_command_to_save_keeps_what_it_can(station):
    here = station("iSYS-5010", {"frequency_channel": 2, "rcs_output": True})
    here.process.wait_for_line("wrote")
    cannot = "; the iSYS-5010 cannot store frequency_channel: lost at power-off"
    response = here.remote.trigger("preview_save")
    assert response.message == "saving would change rcs_output: False → True" + cannot
    response = here.remote.trigger("save_all_settings")
    assert response.message == "saved; changed before: rcs_output" + cannot
    assert here.radar.value("rcs_output", Location.EEPROM) is True
    response = here.remote.trigger("preview_save")
    assert response.message == "saving would change nothing that is known" + cannot
    response = here.remote.trigger("save_application_settings")
    assert response.message == "nothing to save"
    response = here.remote.trigger("save_sensor_settings")
    assert not response.success
    assert "iSYS-5010 cannot save the sensor settings" in response.message


@pytest.mark.parametrize(("service", "words"), [
    ("set_default_temperature_thresholds", "iSYS-4001 cannot set the default temperature"),
    ("read_raw_signals", "iSYS-4001 cannot read the raw signals"),
    ("change_address", "set the parameter new_address first")])
def test_a_service_that_cannot_be_done_says_why(shared, service, words):
    response = shared.remote.trigger(service)
    assert not response.success
    assert words in response.message


def test_the_refusal_of_a_service_is_told(shared):
    shared.radar.refuse.add(0xDF)
    response = shared.remote.trigger("save_all_settings")
    shared.radar.refuse.clear()
    assert not response.success
    assert "cannot save the sensor and application settings: address 128 answers with failure" in (
        response.message)


def test_the_address_is_changed_on_purpose_and_followed(station):
    here = station()
    here.ros.wait_until(lambda: here.radar.measuring)
    assert here.remote.set("new_address", 42).successful
    assert here.radar.address == 128
    response = here.remote.trigger("change_address")
    assert response.success
    assert "from address 128 to 42" in response.message
    assert "'address: 42'" in response.message
    assert here.radar.address == 42
    assert here.remote.get("address", "new_address") == [42, 0]
    wait_for_points(here.remote)
    here.process.stop()


# --- diagnostics -------------------------------------------------------------------------------

def test_diagnostics_come_once_a_second():
    assert diagnostics.PERIOD == 1.0


def test_diagnostics_of_a_healthy_radar(shared):
    status = shared.ros.wait_for_status(
        "shared: radar", lambda status: status.level == OK
        and status.message.endswith("target lists per second"))
    assert status.hardware_id == "iSYS-4001 000001"
    values = status.values
    assert values["port"] == shared.line.port
    assert {name: values[name] for name in (
        "baud rate", "address", "model", "serial number", "device name", "firmware",
        "DSP hardware", "RFE hardware", "bootloader", "cycle time [s]")} == {
        "baud rate": str(FAST_LINE), "address": str(shared.radar.address), "model": "iSYS-4001",
        "serial number": "000001", "device name": "iSYS-4001 000001", "firmware": "1.310",
        "DSP hardware": "1.1", "RFE hardware": "1.2", "bootloader": "1.0000",
        "cycle time [s]": "0.075"}
    assert 0.0 <= float(values["rate [Hz]"]) < 15.0
    for name in ("target lists", "lost cycles", "clippings", "time-outs", "refusals",
                 "connections", "damaged frames", "dropped bytes", "stale frames"):
        assert int(values[name]) >= 0
    again = shared.ros.wait_for_status("shared: radar")
    assert int(again.values["target lists"]) >= int(values["target lists"])


def test_a_refusal_to_measure_is_in_the_diagnostics_until_it_is_over(shared):
    shared.radar.refuse.add(READ_TARGET_LIST)
    status = shared.ros.wait_for_status(
        "shared: radar", lambda status: "no target list" in status.message)
    assert status.level == WARN
    assert "of output 1 in 32 bit, change output or target_list_resolution" in status.message
    assert status.values["model"] == "iSYS-4001"
    shared.radar.refuse.clear()
    shared.ros.wait_for_status("shared: radar", lambda status: status.level == OK)


@pytest.mark.parametrize(("rate", "level", "message"), [
    (13.0, OK, "13.0 target lists per second"),
    (6.6, OK, "6.6 target lists per second, shared line (13.3 alone)"),
    (3.0, WARN, "3.0 target lists per second instead of 13.3")])
def test_the_rate_on_a_shared_line_is_compared_with_what_it_can_carry(
        monkeypatch, rate, level, message):
    monkeypatch.setattr(Radar, "rate", rate)
    bus = RadarBus("", 0, [Options("front", address=10), Options("rear", address=11)], Listener())
    for radar in bus.devices:
        radar.identity = Identity(find_model("4001"), "", None, None, None, None)
        radar.measuring = True
        radar.arrivals.extend(range(9))
    node = SimpleNamespace(bus=bus)
    assert IsysRadarNode._health_of_rate(node, bus.devices[0]) == (bytes((level,)), message)


def test_settings_that_differ_are_in_the_diagnostics(station):
    here = station(parameters={"config_mode": "check", "output1.range_max": 42.0})
    here.process.wait_for_line("output1.range_max is 150 m, not 42 m")
    status = here.ros.wait_for_status("isys_radar: radar", lambda status: (
        status.message == "1 settings are not as wanted"))
    assert status.level == WARN
    assert status.values["output1.range_max differs"] == "wanted 42.0, reported 150.0"
    assert here.radar.value("output1.range_max") == 150.0
    assert here.remote.set("output1.range_max", 42.0).successful
    status = here.ros.wait_for_status("isys_radar: radar", lambda status: status.level == OK)
    assert "output1.range_max differs" not in status.values


def test_bytes_and_frames_that_are_wrong_are_counted(shared):
    shared.line.faults.corrupt = shared.line.faults.noise = 0.5
    shared.ros.wait_for_status("shared: radar", lambda status: (
        int(status.values["damaged frames"]) > 0 and int(status.values["dropped bytes"]) > 0))
    shared.line.faults.corrupt = shared.line.faults.noise = 0.0


# --- life --------------------------------------------------------------------------------------

def test_the_life_of_a_node_that_does_not_start_by_itself(ros, lab, launch):
    line, simulated = lab.start("iSYS-4001", baud_rate=FAST_LINE)
    process = launch({"serial_port": line.port, "serial_baud": FAST_LINE, "autostart": False})
    radar = ros.remote(NAME)
    clouds = radar.subscribe(PointCloud2, "points")
    settings = simulated.settings.keys()
    for _ in range(2):
        assert radar.state() == "unconfigured"
        status = ros.wait_for_status("isys_radar: radar")
        assert (status.level, status.message) == (STALE, "not configured")
        assert not settings & radar.names()
        assert radar.change_state("configure")
        ros.wait_until(lambda: settings <= radar.names())
        assert radar.state() == "inactive"
        assert not simulated.measuring
        assert not radar.trigger("start_acquisition").success
        assert radar.change_state("activate")
        clouds.clear()
        ros.wait_until(lambda: clouds)
        assert radar.change_state("deactivate")
        assert not simulated.measuring
        assert radar.change_state("cleanup")
        assert not settings & radar.names()
        assert radar.set("serial_port", line.port).successful  # nobody uses it now
    process.stop()


def test_a_node_that_is_configured_cannot_be_configured_again(station):
    here = station()
    assert here.remote.state() == "active"
    assert not here.remote.change_state("configure")
    assert here.remote.state() == "active"
    wait_for_points(here.remote)
    here.process.stop()


def test_the_port_can_be_given_after_the_start(ros, lab, launch):
    line, _ = lab.start("iSYS-4001", baud_rate=FAST_LINE)
    process = launch({"autostart": False, "serial_baud": FAST_LINE})
    radar = ros.remote(NAME)
    assert radar.set("serial_port", line.port).successful
    assert radar.change_state("configure")
    process.wait_for_line("connected to iSYS-4001")
    process.stop()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_leaves_the_radar_stopped(station, number):
    here = station()
    here.ros.wait_until(lambda: here.radar.measuring)
    here.process.stop(number)
    assert not here.radar.measuring


def test_a_signal_ends_a_node_that_still_searches(lab, launch):
    line, radar = lab.start("iSYS-4001")
    radar.silent = True
    process = launch({"serial_port": line.port, "address": 128})
    process.wait_for_line("no answer at address 128")
    process.stop(signal.SIGTERM)


def test_a_radar_that_is_unplugged_is_waited_for_and_found_again(ros, lab, launch, tmp_path):
    link = str(tmp_path / "radar")
    line, _ = lab.start("iSYS-4001", link=link, baud_rate=FAST_LINE)
    process = launch({"serial_port": link, "serial_baud": FAST_LINE, "output1.range_max": 42.0})
    radar = ros.remote(NAME)
    wait_for_points(radar)
    line.close()
    process.wait_for_line("(waiting for it)")
    status = ros.wait_for_status("isys_radar: radar", lambda status: status.level == ERROR)
    assert link in status.message
    result = radar.set("output1.range_max", 1.0)
    assert not result.successful
    assert link in result.reason
    lines = len(process.lines)
    _, again = lab.start("iSYS-4001", link=link, baud_rate=FAST_LINE)
    process.wait_for_line("connected to iSYS-4001", lines)
    process.wait_for_line("wrote output1.range_max: 150 m → 42 m", lines)
    assert again.value("output1.range_max") == 42.0
    wait_for_points(radar)
    process.stop()
    assert not again.measuring


def test_a_radar_can_be_simulated_in_the_node(ros, launch):
    process = launch({"serial_port": "sim://iSYS-6006"})
    radar = ros.remote(NAME)
    wait_for_points(radar)
    assert radar.get("measurement_mode") == "multi_target"
    process.stop()


@pytest.mark.parametrize("model", [4001, "4001", "isys-4001"])
def test_a_model_may_be_given_as_a_number(launch, model):
    process = launch({"serial_port": "sim://4001", "model": model})
    process.wait_for_line("connected to iSYS-4001")
    process.stop()


def test_a_radar_can_be_reached_over_tcp(ros, lab, launch):
    line, simulated = lab.start("iSYS-4001", listen="127.0.0.1:0")
    process = launch({"serial_port": line.port})
    wait_for_points(ros.remote(NAME))
    process.stop()
    assert not simulated.measuring


def test_several_sensors_have_topics_parameters_and_diagnostics_of_their_own(ros, lab, launch):
    line, front, rear = lab.start("iSYS-4001", "iSYS-6203", addresses=[10, 11],
                                  baud_rate=FAST_LINE)
    front.scene = lambda now: [Target(40.0, 1.0, 10.0, 0.0)]
    rear.scene = lambda now: [Target(40.0, 0.0, 15.0, 0.0)]
    process = launch({"serial_port": line.port, "serial_baud": FAST_LINE,
                      "sensors": ["front", "rear"], "front.address": 10, "rear.address": 11,
                      "rear.frame_id": "tail", "rear.output1.range_max": 17.0})
    radar = ros.remote(NAME)
    clouds = {name: radar.subscribe(PointCloud2, f"{name}/points") for name in ("front", "rear")}
    ros.wait_until(lambda: all(clouds.values()))
    assert clouds["front"][0].header.frame_id == "front_link"
    assert clouds["rear"][0].header.frame_id == "tail"
    assert points_of(clouds["front"][0])[0]["range"] == 10.0
    assert points_of(clouds["rear"][0])[0]["range"] == 15.0
    names = ros.wait_until(lambda: {
        "front.line_filter1.enable", "rear.mounting_offset"} <= radar.names() and radar.names())
    assert "rear.line_filter1.enable" not in names
    assert "output1.range_max" not in names
    assert radar.set_atomically({"front.output1.range_max": 12.0,
                                 "rear.output1.range_max": 13.0}).successful
    assert (front.value("output1.range_max"), rear.value("output1.range_max")) == (12.0, 13.0)
    result = radar.set_atomically({"front.output1.range_max": 14.0,
                                   "rear.output1.range_min": 19.0})
    assert not result.successful
    assert front.value("output1.range_max") == 12.0
    assert radar.trigger("front/stop_acquisition").success
    assert not front.measuring
    assert rear.measuring
    for name, model in (("front", "iSYS-4001"), ("rear", "iSYS-6203")):
        assert ros.wait_for_status(f"isys_radar: {name}").hardware_id.startswith(model)
    process.stop()
    assert not rear.measuring


def test_several_sensors_need_an_address_each(launch):
    for parameters in ({"front.address": 10}, {"front.address": 10, "rear.address": 10}):
        process = launch({"serial_port": "sim://iSYS-4001", "sensors": ["front", "rear"],
                          **parameters})
        assert process.wait() == 1
        (line,) = process.lines
        assert "rear.address" in line


def test_names_follow_a_namespace_and_remapping(ros, lab, launch):
    line, _ = lab.start("iSYS-4001", baud_rate=FAST_LINE)
    process = launch({"serial_port": line.port, "serial_baud": FAST_LINE},
                     "-r", "__ns:=/car", "-r", "__node:=nose", "-r", "~/points:=/car/cloud")
    clouds = ros.subscribe(PointCloud2, "/car/cloud")
    ros.wait_until(lambda: clouds)
    assert clouds[0].header.frame_id == "nose_link"
    assert ros.remote("/car/nose").get("output1.mode") == "digital"
    assert ros.wait_for_status("car/nose: radar").hardware_id == "iSYS-4001 000001"
    process.stop()


def test_the_qos_of_a_topic_can_be_overridden(station):
    here = station(parameters={
        "qos_overrides./isys_radar/points.publisher.reliability": "best_effort",
        "qos_overrides./isys_radar/points.publisher.depth": 3})
    (publisher,) = here.ros.wait_until(
        lambda: here.ros.node.get_publishers_info_by_topic("/isys_radar/points"))
    assert publisher.qos_profile.reliability.name == "BEST_EFFORT"
    here.process.stop()


def test_a_node_started_with_the_parameters_it_had_has_nothing_to_tell(
        station, launch, tmp_path):
    here = station("iSYS-6203", {"output1.range_max": 12.0})
    here.process.wait_for_line("wrote")
    here.ros.wait_until(lambda: "mounting_offset" in here.remote.names())
    names = list(here.remote.names())
    values = {name: list(value) if name == "sensors" else value  # an empty list
              for name, value in zip(names, here.remote.get(*names), strict=True)}
    here.process.stop()
    process = launch(None, *parameter_file(
        tmp_path, json.dumps({"isys_radar": {"ros__parameters": values}})))
    process.wait_for_line("connected to")
    here.ros.wait_until(lambda: here.radar.measuring)
    process.stop()
    of_the_link = ("connected to", "(waiting for it)")  # a busy machine may be too late
    assert not [line for line in process.lines if not any(map(line.__contains__, of_the_link))]


def test_parameters_can_be_given_as_in_the_example_file(station, tmp_path):
    values = {"output1": {"range_max": 33}, "frequency_channel": 2, "led": "disabled"}
    here = station("iSYS-4001", None, *parameter_file(
        tmp_path, json.dumps({"/**": {"ros__parameters": values}})))
    here.process.wait_for_line("wrote ")
    assert here.radar.value("output1.range_max") == 33.0
    assert here.radar.value("led") == "disabled"
