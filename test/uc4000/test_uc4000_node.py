# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The UC4000 node from end to end: a process of its own, a simulated line, and ROS between.

The sensors are in the process of the test, behind a pseudo-terminal: what they did and what the
node published can be compared.
"""

from __future__ import annotations

import math
import re
import time

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from nodes import NodeProcess, Process, Ros
from rcl_interfaces.msg import ParameterType
from sensor_msgs.msg import Range, Temperature

from uc4000_driver.commands import OpCode
from uc4000_driver.simulator.line import simulated_line
from uc4000_driver.telegram import ErrorCode, Reply

UC4000 = "uc4000_driver.program"
DISTANCES = {"left": 1.6, "right": 2.4}
OK, WARN, ERROR = (ord(level) for level in (
    DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR))


def still(distance):
    return lambda now: distance


WELL = {name: still(distance) for name, distance in DISTANCES.items()}


def near(value, wanted):
    return value == pytest.approx(wanted, abs=1e-4)


def seconds(message):
    return message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec


class Heard:
    """The messages of a node's topics that are yet to come."""

    def __init__(self, ros, node="/uc4000"):
        self._ros = ros
        self._node = ros.remote(node)
        self._topics = {}

    def all(self, topic):
        """Return the list of messages of a topic, which grows."""
        if topic not in self._topics:
            kind = Range if topic.endswith("range") else Temperature
            self._topics[topic] = self._node.subscribe(kind, topic)
        return self._topics[topic]

    def next(self, topic="range", where=lambda message: True):
        return self.several(topic, 1, where)[0]

    def several(self, topic, count, where=lambda message: True):
        """Return new messages for which the condition holds."""
        messages = self.all(topic)
        messages.clear()
        return self._ros.wait_until(lambda: (found := list(filter(where, messages)))[count - 1:]
                                    and found[:count])


@pytest.fixture(scope="module")
def ros():
    with Ros() as ros:
        yield ros


@pytest.fixture(scope="module")
def heard(ros):
    return Heard(ros)


@pytest.fixture(scope="module")
def uc4000(ros):
    return ros.remote("/uc4000")


@pytest.fixture(scope="module")
def running(tmp_path_factory):
    """Two sensors, left and right, and the node that measures with them."""
    directory = tmp_path_factory.mktemp("uc4000")
    line, sensors = simulated_line([1, 2], link=str(directory / "port"))
    line.start()
    parameters = directory / "uc4000.yaml"
    parameters.write_text(f"""
/**:
  ros__parameters:
    serial_port: {directory}/port
    sensors: [left, right]
    groups: ["left right"]
    left:
      address: 1
      frame_id: left_sonar
      temperature_period: 0.5
      gain_db: 70
      temperature_compensation: on
    right:
      address: 2
      profile: a
      temperature_period: 0.0
      rate: 5
""")
    with NodeProcess(UC4000, {}, "--params-file", str(parameters)) as process:
        yield process, dict(zip(DISTANCES, sensors, strict=True))
        process.stop()
    line.close()


@pytest.fixture
def simulated(running, heard):
    """The sensors by name; for each test they see what `DISTANCES` says, and are well."""
    _, sensors = running
    for name, sensor in sensors.items():
        if sensor.scene is WELL[name] and not sensor.refuse and not sensor.silent:
            continue
        sensor.scene = WELL[name]
        sensor.refuse.clear()
        sensor.silent = False
        heard.next(f"{name}/range",
                   lambda message, name=name: near(message.range, DISTANCES[name]))
    return sensors


def unusual(message):
    """Whether the message of the left sensor says anything but that all is as usual."""
    return not near(message.range, DISTANCES["left"])


# --- topics ------------------------------------------------------------------------------------

def test_ranges_of_both_sensors(simulated, heard):
    left, right = heard.next("left/range"), heard.next("right/range")
    assert left.header.frame_id == "left_sonar"
    assert right.header.frame_id == "right_link"
    assert near(left.range, 1.6)
    assert near(right.range, 2.4)
    assert left.radiation_type == Range.ULTRASOUND
    assert near(left.field_of_view, 0.26)
    assert near(left.min_range, 0.25)
    assert near(left.max_range, 4.0)
    assert near(right.max_range, 3.5)


def test_stamps_are_the_middle_of_the_measurement(simulated, heard):
    stamps = [seconds(message) for message in heard.several("left/range", 10)]
    offset = time.time() - time.monotonic()
    middles = [sum(times) / 2 + offset for times in simulated["left"].measurements]
    errors = [min((stamp - middle for middle in middles), key=abs) for stamp in stamps]
    assert min(map(abs, errors)) < 0.015  # others came late
    assert stamps == sorted(set(stamps))


def test_a_moving_target_is_where_the_stamp_says(simulated, heard):
    simulated["left"].scene = lambda now: 1.0 + now % 2.0  # 1 m/s, with a jump every 2 s
    errors = [message.range - (1.0 + seconds(message) % 2.0)
              for message in heard.several("left/range", 15)]
    assert min(map(abs, errors)) < 0.02  # others came late


def test_temperatures(simulated, heard):
    simulated["left"].temperature = -7.0
    message = heard.next("left/temperature", lambda message: message.temperature != 21.0)
    simulated["left"].temperature = 21.0
    assert message.temperature == -7.0
    assert message.header.frame_id == "left_sonar"
    assert abs(seconds(message) - time.time()) < 10.0


@pytest.mark.parametrize("truth", [None, 4.1])
@pytest.mark.parametrize(("word", "value"), [
    ("max_range", 4.0), ("nan", math.nan), ("inf", math.inf)])
def test_no_echo_is_published_as_wished(simulated, uc4000, heard, truth, word, value):
    assert uc4000.set("left.no_echo_value", word).successful
    simulated["left"].scene = still(truth)
    assert heard.next("left/range", unusual).range == pytest.approx(value, nan_ok=True)


def test_no_echo_can_be_left_out(simulated, uc4000, heard):
    assert uc4000.set("left.no_echo_value", "skip").successful
    simulated["left"].scene = still(None)
    ranges = heard.all("left/range")
    ranges.clear()
    heard.several("right/range", 3)  # meanwhile left measures as well
    assert not any(map(unusual, ranges))
    simulated["left"].scene = still(3.2)
    assert near(heard.next("left/range", unusual).range, 3.2)
    assert uc4000.set("left.no_echo_value", "inf").successful


@pytest.mark.parametrize(("word", "value"), [("min_range", 0.25), ("-inf", -math.inf)])
def test_an_echo_in_the_blind_zone_is_published_as_wished(simulated, uc4000, heard, word, value):
    assert uc4000.set("left.too_close_value", word).successful
    simulated["left"].scene = still(0.1)
    assert heard.next("left/range", unusual).range == value


def test_a_finite_range_lies_within_the_limits(simulated, uc4000, heard):
    left = simulated["left"]
    left.limits, left.overreach = (0.03, 4.07), 30.0  # it reports all that it hears
    assert uc4000.set("left.profile", "a").successful
    for truth in (0.1, 0.24, 0.256, 3.0, 3.488, 3.504, 3.8, 4.0, 4.06):
        left.scene = still(truth)
        message = heard.several("left/range", 3)[-1]  # the first ones may be older
        expected = truth if 0.25 <= truth <= 3.5 else math.copysign(math.inf, truth - 1.0)
        assert message.range == pytest.approx(expected, abs=0.008)
    left.limits, left.overreach = (0.25, 4.0), 0.0
    assert uc4000.set("left.profile", "b").successful


def test_a_refused_measurement_publishes_nothing(simulated, heard, ros):
    ranges = heard.all("left/range")
    ranges.clear()
    simulated["left"].refuse[OpCode.PROFILE_B] = ErrorCode.SESSION_ERROR
    status = ros.wait_for_status("uc4000: left", lambda status: "cannot measure" in status.message)
    assert status.level == WARN
    assert status.message == "left (address 1) cannot measure: session error (0x06)"
    assert int(status.values["refusals: session error (0x06)"]) >= 1
    assert not any(map(unusual, ranges))


# --- parameters --------------------------------------------------------------------------------

def test_parameters_are_what_the_sensor_reported(simulated, uc4000):
    assert uc4000.get(
        "left.burst_periods", "left.gain_db", "left.current_ma", "left.temperature_compensation",
        "right.gain_db", "right.temperature_compensation", "right.profile", "right.rate") == [
        32, 70.0, 325, "on", 72.0, "unknown", "a", 5.0]


def test_descriptors_tell_what_is_allowed(simulated, uc4000):
    current, gain, compensation, rate = uc4000.describe(
        "left.current_ma", "left.gain_db", "left.temperature_compensation", "left.rate")
    assert current.type == ParameterType.PARAMETER_INTEGER
    assert (current.integer_range[0].from_value, current.integer_range[0].to_value) == (160, 496)
    assert current.additional_constraints.startswith("one of 160, 165, 171, 176")
    assert current.additional_constraints.endswith("485, 491, 496")
    assert "unit mA" in current.description
    assert "manual 5.2.3" in current.description
    assert gain.floating_point_range[0].to_value == 88.0
    assert compensation.additional_constraints == "one of on, off"
    assert "cannot be asked" in compensation.description
    assert "unit Hz" in rate.description


def test_a_setting_is_written_to_the_sensor(simulated, uc4000):
    assert uc4000.set("left.gain_db", 57).successful  # a whole number does for a number
    assert simulated["left"].value("gain_db") == 57.0
    assert uc4000.set_atomically({"left.temperature_compensation": False,
                                  "left.burst_periods": 64}).successful
    assert simulated["left"].value("temperature_compensation") == "off"
    assert uc4000.get("left.gain_db", "left.temperature_compensation", "left.burst_periods") == [
        57.0, "off", 64]


@pytest.mark.parametrize(("name", "value", "reason"), [
    ("left.gain_db", 57.25,
     "gain_db = 57.25 dB lies between two steps, the nearest are 57 dB and 57.5 dB"),
    ("left.current_ma", 170,
     "current_ma = 170 mA lies between two steps, the nearest are 165 mA and 171 mA"),
    ("left.burst_periods", 68, "burst_periods = 68 is out of range, allowed is 4 … 64"),
    ("left.profile", "d", "profile must be one of a, b, c, user, not 'd'"),
    ("left.cycles", 0, "cycles = 0 is out of range, allowed is 1 … 255"),
    ("left.gian_db", 57.0,
     'left.gian_db is not a parameter of this node; did you mean "left.gain_db"?'),
    ("serial_port", "/dev/null",
     "serial_port cannot change while the node is configured; first run 'ros2 lifecycle set "
     "/uc4000 deactivate' and 'ros2 lifecycle set /uc4000 cleanup'"),
])
def test_a_bad_value_is_refused_in_words(simulated, uc4000, name, value, reason):
    result = uc4000.set(name, value)
    assert not result.successful
    assert result.reason == reason


def test_several_are_set_all_or_none(simulated, uc4000):
    before = uc4000.get("left.gain_db", "right.current_ma")
    simulated["right"].refuse[OpCode.CURRENT] = ErrorCode.EEPROM_ERROR
    result = uc4000.set_atomically({"left.gain_db": 80.0, "right.current_ma": 160})
    assert not result.successful
    assert "right (address 2)" in result.reason
    assert "eeprom error (0x08)" in result.reason
    assert uc4000.get("left.gain_db", "right.current_ma") == before
    assert simulated["left"].value("gain_db") == before[0]


def test_another_profile_counts_from_the_next_measurement_on(simulated, uc4000, heard):
    simulated["left"].scene = still(3.84)
    assert uc4000.set("left.profile", "a").successful
    message = heard.next("left/range", lambda message: near(message.max_range, 3.5))
    assert message.range == math.inf
    assert uc4000.set_atomically({
        "left.profile": "user", "left.gain_db": 88.0, "left.burst_periods": 64}).successful
    message = heard.next("left/range", lambda message: near(message.max_range, 4.0))
    assert near(message.range, 3.84)
    assert uc4000.set("left.profile", "b").successful


def test_the_other_live_options(simulated, uc4000, heard):
    assert uc4000.set_atomically({"left.frame_id": "elsewhere", "left.field_of_view": 0.5,
                                  "left.time_offset": -10.0}).successful
    message = heard.next("left/range", lambda message: message.header.frame_id == "elsewhere"
                         and time.time() - seconds(message) > 9.0)
    assert near(message.field_of_view, 0.5)
    assert uc4000.set_atomically({"left.frame_id": "left_sonar",
                                  "left.time_offset": 0.0}).successful


def test_a_wrong_echo_setting_is_named_and_can_be_mended(simulated, uc4000, heard, ros):
    assert uc4000.set("local_echo", "on").successful
    status = ros.wait_for_status("uc4000: left", lambda status: status.level == ERROR)
    assert status.message == ("local_echo is on, but the line does not return what is sent; set "
                              "local_echo to off or auto")
    assert uc4000.set("local_echo", "auto").successful
    heard.next("left/range")


# --- services and diagnostics ------------------------------------------------------------------

def trigger(node, service):
    """Call a service, again while the line is in use: a busy machine measures for long."""
    while "try again" in (response := node.trigger(service)).message:
        pass
    return response


def test_identify(simulated, uc4000):
    response = trigger(uc4000, "right/identify")
    assert response.success
    assert response.message == (f"UC4000 {simulated['right'].serial_number}, HW:V0.1 SW:V1.200, "
                                "address 2")


def test_an_address_is_assigned(simulated, uc4000, heard):
    for address in (5, 1):
        old = simulated["left"].address
        assert uc4000.set("left.new_address", address).successful
        response = trigger(uc4000, "left/change_address")
        assert response.success
        assert response.message == (
            f"the sensor moved from address {old} to {address} and keeps it; put 'left.address: "
            f"{address}' into your parameter file")
        assert simulated["left"].address == address
        assert uc4000.get("left.address", "left.new_address") == [address, 0]
        heard.next("left/range")


@pytest.mark.parametrize(("address", "text"), [
    (0, "set the parameter left.new_address first"),
    (2, "address 2 belongs to another sensor"),
])
def test_an_address_cannot_be_assigned(simulated, uc4000, address, text):
    assert uc4000.set("left.new_address", address).successful
    response = trigger(uc4000, "left/change_address")
    assert not response.success
    assert response.message == text


def test_diagnostics_of_a_sensor_that_is_well(simulated, ros):
    status = ros.wait_for_status("uc4000: left", lambda status: re.fullmatch(
        r"\d+\.\d measurements per second|\d+% of the measurements together .*",  # on a busy host
        status.message))
    assert status.hardware_id == f"UC4000 {simulated['left'].serial_number}"
    assert status.values["version"] == "HW:V0.1 SW:V1.200"
    assert status.values["serial number"] == simulated["left"].serial_number
    assert status.values["address"] == "1"
    assert status.values["profile"] == "b"
    assert status.values["local echo"] == "off"
    assert status.values["temperature [°C]"] == "21"
    assert 0.0 < float(status.values["rate [Hz]"]) < 20.0
    for counter in ("measurements", "measurements: echo", "measurements: no echo",
                    "measurements: echo in the blind zone", "measurements: echo beyond the range",
                    "time-outs", "checksum errors", "refusals", "connections", "stray bytes",
                    "failed measurements of its group"):
        assert int(status.values[counter]) >= 0


def test_diagnostics_of_a_sensor_that_is_silent(simulated, uc4000, heard, ros):
    simulated["right"].silent = True
    status = ros.wait_for_status("uc4000: right", lambda status: status.level == ERROR)
    assert "no answer from right (address 2) on " in status.message
    assert int(status.values["time-outs"]) >= 3
    assert "is not connected: no answer from right" in uc4000.set("right.gain_db", 60.0).reason
    heard.several("left/range", 3)
    simulated["right"].silent = False
    ros.wait_for_status("uc4000: right", lambda status: status.level != ERROR)


def test_diagnostics_of_a_group_that_fails(simulated, uc4000, heard, ros):
    assert uc4000.set("right.rate", 0.0).successful
    right, reply = simulated["right"], simulated["right"].reply

    def refuse(request, now):  # only where the left one measures as well
        if request.op_code == OpCode.PROFILE_A and request.address == right.address and any(
                end > now for _, end in simulated["left"].measurements[-1:]):
            return now, Reply(bytes([ErrorCode.SESSION_ERROR]), acknowledged=False)
        return reply(request, now)

    right.reply = refuse
    status = ros.wait_for_status("uc4000: left", lambda status: "its group" in status.message)
    assert status.level == WARN
    share = float(status.values["failed lately [%]"])
    assert status.message == (f"{share:.0f}% of the measurements together with its group fail"
                              + ", so they measure one by one" * ("one by one" in status.message))
    assert int(status.values["failed measurements of its group"]) >= 2
    heard.several("left/range", 3)
    right.reply = reply
    assert uc4000.set("right.rate", 5.0).successful


def test_a_new_rate_counts_at_once(simulated, uc4000, heard):
    assert uc4000.set("right.rate", 0.02).successful  # a measurement in 50 s
    heard.next("right/range")
    assert uc4000.set("right.rate", 5.0).successful
    heard.several("right/range", 3)


def test_one_sensor_can_be_stopped_and_started(simulated, uc4000, heard, ros):
    assert uc4000.trigger("right/stop_acquisition").success
    ros.wait_for_status("uc4000: right", lambda status: "stopped" in status.message)
    heard.next("left/range")
    assert uc4000.trigger("right/start_acquisition").success
    heard.next("right/range")


# --- life --------------------------------------------------------------------------------------

def test_deactivated_cleaned_up_and_back(simulated, uc4000, heard, ros):
    assert uc4000.change_state("deactivate")
    begun = simulated["left"].measurements[-1]
    status = ros.wait_for_status("uc4000: left", lambda status: "stopped" in status.message)
    assert status.level == OK
    assert simulated["left"].measurements[-1] == begun
    assert uc4000.change_state("cleanup")
    assert "left.gain_db" not in uc4000.names()
    ros.wait_for_status("uc4000: left", lambda status: status.message == "not configured")
    assert uc4000.change_state("configure")
    assert uc4000.change_state("activate")
    heard.next("left/range")
    ros.wait_until(lambda: "left.gain_db" in uc4000.names())
    assert uc4000.get("left.gain_db") == simulated["left"].value("gain_db") == 70.0


def test_the_log_says_what_was_written(running):
    process, _ = running
    process.wait_for_line("left: wrote gain_db: 72 dB → 70 dB, "
                          "temperature_compensation: unknown → on")
    process.wait_for_line("left: connected to UC4000 40000016900001, HW:V0.1 SW:V1.200, address 1")


def test_unplugged_and_plugged_in_again(ros, tmp_path):
    link = str(tmp_path / "port")
    heard = Heard(ros, "/tank")
    with NodeProcess(UC4000, {"serial_port": link, "gain_db": 60}, "-r", "__node:=tank") as process:
        process.wait_for_line(f"cannot open {link}: there is no such port")
        for _ in range(2):
            line, (simulated,) = simulated_line(link=link)
            line.start()
            heard.next()
            assert simulated.value("gain_db") == 60.0
            line.close()
            status = ros.wait_for_status("tank: sensor", lambda status: status.level == ERROR)
            assert f"{link}: " in status.message
        process.stop()


def test_a_simulated_sensor_inside_the_node_and_a_typing_error(ros, tmp_path):
    parameters = tmp_path / "typo.yaml"
    parameters.write_text("/**:\n  ros__parameters:\n    serial_port: sim://UC4000\n"
                          "    gian_db: 60.0\n    local_echo: on\n    no_echo_value: nan\n")
    with NodeProcess(UC4000, {}, "--params-file", str(parameters), "-r", "__node:=tank") as process:
        process.wait_for_line('parameter gian_db: this driver has no such parameter; did you mean '
                              '"gain_db"?')
        assert Heard(ros, "/tank").next().header.frame_id == "tank_link"
        process.stop()


def test_users_are_answered_within_a_long_measurement(ros, tmp_path):
    line, (simulated,) = simulated_line(link=str(tmp_path / "port"))
    line.start()
    tank = ros.remote("/tank")
    parameters = {"serial_port": str(tmp_path / "port"), "cycles": 255}
    with NodeProcess(UC4000, parameters, "-r", "__node:=tank") as process:
        ros.wait_for_status("tank: sensor", lambda status: status.level == OK)
        ros.wait_until(lambda: simulated.measurements)
        reason = tank.set("gain_db", 60.0).reason
        assert re.fullmatch(r"the line is in use for up to \d+\.\d s more \(address 7: measure\); "
                            "try again then, or set cycles to less", reason)
        assert "the line is in use for up to " in tank.trigger("identify").message
        assert tank.set("cycles", 1).successful  # for the next one
        ros.wait_for_status("tank: sensor", lambda status: status.level == OK)
        tank.change_state("deactivate")
        (_, end), = simulated.measurements
        assert time.monotonic() < end  # all that took less time than the measurement
        process.stop()
    line.close()


def test_an_end_within_a_long_measurement(tmp_path):
    line, (sensor,) = simulated_line(link=str(tmp_path / "port"))
    line.start()
    with NodeProcess(UC4000, {"serial_port": str(tmp_path / "port"), "cycles": 255}) as process:
        process.wait_for_line("connected to UC4000")
        process.stop()
        assert all(time.monotonic() < end for _, end in sensor.measurements)  # after 12.75 s
    line.close()


def test_an_error_in_the_code_of_the_diagnostics_does_not_end_the_node(ros):
    before = ("from uc4000_driver.node import Uc4000Node\n"
              "Uc4000Node.status_of = lambda self, sensor: 1 / 0")
    arguments = "--ros-args", "-p", "serial_port:=sim://UC4000", "-r", "__node:=tank"
    with Process(UC4000, *arguments, before=before):
        status = ros.wait_for_status("tank: sensor", lambda status: "report it" in status.message)
        assert status.message.startswith("internal error, please report it: ZeroDivisionError")
        Heard(ros, "/tank").several("range", 3)


@pytest.mark.parametrize(("parameters", "text"), [
    ({"serial_port": "sim://UC400"}, "there is no simulated UC400; use sim://UC4000"),
    ({"profile": "d"}, "error: profile must be one of a, b, c, user, not 'd'"),
    ({"sensors": ["left", "right"]},
     "left.address must be given, 1 … 7: only a single sensor can be asked for it"),
    ({"sensors": ["left"], "groups": ["left rihgt"]}, 'groups: there is no sensor "rihgt"'),
])
def test_what_cannot_start_says_why(parameters, text):
    with NodeProcess(UC4000, {"serial_port": "sim://UC4000", **parameters}) as process:
        assert process.wait() == 1
        assert text in process.log
        assert "Traceback" not in process.log
