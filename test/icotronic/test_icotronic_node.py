# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The ICOtronic node as its user meets it: a process, a simulated system on a socketcand server.

The sensors are in the process of the test: what they measured and what the node published can be
compared.
"""

from __future__ import annotations

import math
import signal
import struct
import time

import can
import numpy as np
import pytest
import rclpy
from nodes import NodeProcess, Ros
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import BatteryState, Imu, PointCloud2, Temperature
from std_msgs.msg import Float64, Float64MultiArray

from driver_common.simulator.bus import CanFrame
from icotronic_driver import commands
from icotronic_driver.identifier import STU_1
from icotronic_driver.laws import STANDARD_GRAVITY
from icotronic_driver.line import STREAM_ID
from icotronic_driver.node import IcotronicNode, queue_complaint
from icotronic_driver.settings import SETTINGS
from icotronic_driver.simulator.line import SimulatedIcotronic, simulated_network
from icotronic_driver.values import AdcConfiguration
from msg_conversions.imu_batch import from_imu_batch
from sensor_tools import convert_imu
from sensor_tools.bags import NEEDED, Record, has_library, read_bag, write_bag

DEADLINE = 60.0  # s; far more than anything takes, also on a busy machine
MODULE, NAME, STATUS = "icotronic_driver.program", "/icotronic", "icotronic: sensor"
SLOW = "/slow"  # name of the node that runs through many tests
SLOW_ADC = AdcConfiguration(oversampling_rate=512)  # a busy machine can follow it
OK, WARN, ERROR, STALE = range(4)
STEP = 0.2 * STANDARD_GRAVITY  # m/s²; far more than the ADC's
OPTIONS = {option.name for option in (*IcotronicNode.bus_options(), *IcotronicNode.SENSOR_OPTIONS)}


def at(server, **parameters):
    """Return the parameters with which the node finds a server, and the sensor behind it."""
    return {"can_interface": "socketcand", "can_channel": "can0", "sensor_name": "Test-STH",
            "can_options": [f"host={server.host}", f"port={server.port}"], **parameters}


def constant(*accelerations):
    """Return a vibration that is none: these accelerations in g, always."""
    return lambda times: np.tile(np.array(accelerations, float), (len(times), 1))


def vector(imu):
    return [imu.linear_acceleration.x, imu.linear_acceleration.y, imu.linear_acceleration.z]


def close_to(*accelerations):
    """Return accelerations in g as they come in m/s², with the precision of the ADC."""
    return pytest.approx([STANDARD_GRAVITY * each for each in accelerations], abs=STEP)


class Samples:
    """A subscriber that keeps up with every rate: it takes bytes, without an executor.

    A busy machine may hold it up for longer than the publisher's queue lasts. The middleware
    numbers what is published, so a test can judge the node by the numbers and the machine by
    nothing.
    """

    def __init__(self, ros, kind=Imu, topic=f"{NAME}/imu/data_raw"):
        self._node = rclpy.create_node("recorder", context=ros.node.context)
        self._kind, self._topic = kind, topic
        self._subscription = self._node.create_subscription(
            kind, topic, lambda message: None, QoSProfile(depth=50_000), raw=True)
        self.messages = []
        self.numbers = []

    def close(self):
        self._node.destroy_node()

    @property
    def published(self):
        """How many messages were published until the last one that came."""
        return self.numbers[-1] if self.numbers else 0

    @property
    def indices(self):
        """Which of the published messages came, from 0."""
        return np.array(self.numbers) - 1

    def is_matched(self):
        return self._node.count_publishers(self._topic) > 0

    def take(self):
        """Take all that has come."""
        with self._subscription.handle:
            while (taken := self._subscription.handle.take_message(
                    self._kind, True)) is not None:
                self.messages.append(taken[0])
                self.numbers.append(taken[1]["publication_sequence_number"])

    def until(self, count):
        """Take messages until that many were published."""
        deadline = time.monotonic() + DEADLINE
        while self.published < count:
            assert time.monotonic() < deadline, f"{self.published} of {count} messages came"
            self.take()
            time.sleep(0.002)

    def table(self):
        """Return stamps in ns, and accelerations."""
        stamps = [seconds * 1_000_000_000 + nanoseconds for seconds, nanoseconds in (
            struct.unpack_from("<iI", message, 4) for message in self.messages)]
        accelerations = [struct.unpack_from("<ddd", message, len(message) - 12 * 8)
                         for message in self.messages]
        return np.array(stamps), np.array(accelerations)


@pytest.fixture(scope="module")
def ros():
    with Ros() as ros:
        yield ros


@pytest.fixture
def start():
    """Start simulated networks with slow sensors; they end with the test."""
    servers = []

    def start_one(*names):
        server = simulated_network(names or ("Test-STH",))
        for sensor in server.network.sensors:
            sensor.adc = SLOW_ADC
        servers.append(server.start())
        return server

    yield start_one
    for server in servers:
        server.close()


# --- a node that runs through many tests -------------------------------------------------------

class Station:
    """A node and the system that it serves."""

    def __init__(self, ros, process, server, name=NAME):
        self.ros = ros
        self.process = process
        self.server = server
        self.network = server.network
        self.sensor = server.network.sensors[0]
        self.remote = ros.remote(name)

    def wait_for_status(self, condition):
        return self.ros.wait_for_status(f"{self.remote.name[1:]}: sensor", condition)

    def wait_for_imu(self, condition):
        """Return the first sample from now on that fulfils the condition."""
        imus = []
        subscription = self.ros.node.create_subscription(
            Imu, f"{self.remote.name}/imu/data_raw", imus.append, 1)
        try:
            def wanted():
                found = next(filter(condition, imus), None)
                imus.clear()
                return found

            return self.ros.wait_until(wanted)
        finally:
            self.ros.node.destroy_subscription(subscription)

    def wait_for_acceleration(self, *accelerations):
        return self.wait_for_imu(lambda imu: vector(imu) == close_to(*accelerations))

    def set(self, **values):
        """Set parameters, which the node must accept."""
        result = self.remote.set_atomically({
            name.replace("__", "."): value for name, value in values.items()})
        assert result.successful, result.reason

    def wait_for_parameter(self, name, value):
        self.ros.wait_until(lambda: self.remote.get(name) == value)


BEGINNING = {
    "channels": "x", "axis.x": "x", "axis.y": "y", "axis.z": "z", "channel.x.sensor": "auto",
    "channel.x.unit": "V", "sample_rate": 500.0, "linear_acceleration_stddev": 0.0,
    "time_offset": 0.0, "vibration_period": 0.0, "used_sensor.x": 1}


@pytest.fixture(scope="module")
def running(ros):
    """A node at a slow sensor, so that the test keeps up with it."""
    server = simulated_network(("Test-STH",)).start()
    server.network.sensors[0].vibration = constant(10.0, -20.0, 30.0)
    with NodeProcess(MODULE, at(server, sample_rate=500, status_period=0.5),
                     "-r", f"__node:={SLOW[1:]}") as process:
        process.wait_for_line("connected to")
        yield Station(ros, process, server, SLOW)
        process.stop()
        assert "internal error" not in process.log
    server.close()


@pytest.fixture
def station(running):
    """The node as it was at the beginning, streaming."""
    yield running
    before = running.remote.get(*BEGINNING)
    if before != list(BEGINNING.values()):
        assert running.remote.set_atomically(BEGINNING).successful
        running.wait_for_acceleration(10.0, 0.0, 0.0)


def test_a_sample_is_an_imu_with_an_acceleration_and_nothing_else(station):
    imu = station.wait_for_acceleration(10.0, 0.0, 0.0)
    assert imu.header.frame_id == "imu_link"
    assert abs(imu.header.stamp.sec - time.time()) < DEADLINE
    assert imu.orientation_covariance[0] == imu.angular_velocity_covariance[0] == -1.0
    assert list(imu.linear_acceleration_covariance) == [0.0] * 9
    assert imu.linear_acceleration.y == imu.linear_acceleration.z == 0.0
    assert vector(imu)[0] > 0


def test_topics_have_the_types_that_are_documented(station):
    topics = dict(station.ros.node.get_topic_names_and_types())
    assert topics[f"{SLOW}/imu/data_raw"] == ["sensor_msgs/msg/Imu"]
    assert topics[f"{SLOW}/battery"] == ["sensor_msgs/msg/BatteryState"]
    assert topics[f"{SLOW}/temperature"] == ["sensor_msgs/msg/Temperature"]
    (info,) = station.ros.node.get_publishers_info_by_topic(f"{SLOW}/imu/data_raw")
    assert info.qos_profile.reliability == ReliabilityPolicy.RELIABLE


def test_the_battery_is_published(station):
    station.sensor.battery = 3.25
    battery = station.remote.subscribe(BatteryState, "battery")
    station.ros.wait_until(
        lambda: any(message.voltage == pytest.approx(3.25, abs=0.001) for message in battery))
    assert battery[-1].present
    assert math.isnan(battery[-1].current)


def test_the_temperature_is_published(station):
    station.sensor.temperature = -7.5
    temperatures = station.remote.subscribe(Temperature, "temperature")
    station.ros.wait_until(
        lambda: any(message.temperature == -7.5 for message in temperatures))
    assert temperatures[-1].header.frame_id == "imu_link"


def test_parameters_are_what_the_sensor_reported(station):
    names = {name for name in station.remote.names()
             if not name.startswith(("qos_overrides", "use_sim_time", "start_type"))}
    assert names == OPTIONS | SETTINGS.keys()
    adc = station.sensor.adc
    assert station.remote.get("adc.prescaler", "adc.acquisition_time", "adc.oversampling_rate",
                              "adc.reference_voltage") == [
        adc.prescaler, adc.acquisition_time, adc.oversampling_rate, 3.3]
    assert adc.sample_rate == pytest.approx(500.0, rel=0.01)
    assert station.remote.get("name", "led", "used_sensor.z", "lowest_energy.sleep_time") == [
        "Test-STH", "enabled", 3, 259200.0]
    assert station.remote.get("calibration.acceleration_x.offset") == -125.0


def test_a_parameter_describes_itself(station):
    descriptor = station.remote.describe("adc.prescaler")
    (limits,) = descriptor.integer_range
    assert (limits.from_value, limits.to_value) == (1, 127)
    assert descriptor.description == "Divider of the ADC's clock; manual 10.5.1"
    assert station.remote.describe("led").additional_constraints == "one of enabled, disabled"


def test_a_setting_is_written_to_the_sensor_and_rounded_to_what_it_holds(station):
    assert station.remote.set("reduced_energy.advertisement_time", 1.0003).successful
    assert station.remote.get("reduced_energy.advertisement_time") == 1.0
    assert station.sensor.eeprom["Advertisement Time 1"] == 1.0
    assert station.remote.set("reduced_energy.advertisement_time", 2).successful
    assert station.sensor.eeprom["Advertisement Time 1"] == 2.0


@pytest.mark.parametrize(("name", "value", "reason"), [
    ("used_sensor.x", 11, "used_sensor.x = 11: STH 1 cannot write the used sensors: not available"),
    ("adc.acquisition_time", 5, "lies between two steps, the nearest are 4 cycles and 8 cycles"),
    ("adc.prescaler", 200, "allowed is 1 … 127"), ("led", "blue", "one of enabled, disabled"),
    ("name", "much too long", "at most 8 bytes in UTF-8"),
    ("adc.prescaler", "fast", "must be a whole number"),
    ("channels", "xw", "channels must be one of x, y, z, xy, xz, yz, xyz, not 'xw'"),
    ("sample_rate", 1e9, "out of range"), ("axis.x", "+x", "must be one of"),
    ("frame_id", "other", "cannot change while the node is configured"),
    ("can_channel", "can1", "cannot change while the node is configured"),
    ("adc.prescale", 3, 'did you mean "adc.prescaler"?')])
def test_what_cannot_be_set_is_refused_with_the_reason(station, name, value, reason):
    before = station.remote.get("adc.prescaler", "used_sensor.x", "led", "name", "channels")
    result = station.remote.set(name, value)
    assert not result.successful
    assert reason in result.reason
    assert station.remote.get("adc.prescaler", "used_sensor.x", "led", "name",
                              "channels") == before


def test_several_parameters_are_set_all_or_none(station):
    result = station.remote.set_atomically({"led": "disabled", "used_sensor.y": 11})
    assert not result.successful
    assert "used_sensor.y = 11" in result.reason
    assert station.remote.get("led") == "enabled"
    assert station.sensor.led
    assert station.remote.set_atomically({"led": "disabled", "used_sensor.y": 3}).successful
    assert (station.sensor.led, station.sensor.used_sensors) == (False, (1, 3, 3))
    assert station.remote.set_atomically({"led": "enabled", "used_sensor.y": 2}).successful


def test_channels_take_effect_at_once(station):
    station.set(channels="xyz")
    imu = station.wait_for_acceleration(10.0, -20.0, 30.0)
    assert list(imu.linear_acceleration_covariance) == [0.0] * 9
    station.set(channels="z")
    imu = station.wait_for_acceleration(0.0, 0.0, 30.0)
    assert list(imu.linear_acceleration_covariance) == [0.0] * 9


def test_channels_are_mapped_to_axes_with_signs(station):
    station.set(axis__x="-y", axis__y="z", axis__z="-x", channels="xyz")
    station.wait_for_acceleration(-30.0, -10.0, -20.0)
    station.set(channels="xz", linear_acceleration_stddev=0.5)
    imu = station.wait_for_acceleration(-30.0, -10.0, 0.0)
    assert list(imu.linear_acceleration_covariance) == [0.25, 0, 0, 0, 0.25, 0, 0, 0, 1e6]


def test_the_vibration_of_a_period_is_published_on_request(station):
    messages = station.remote.subscribe(Float64MultiArray, "vibration")
    station.set(channels="xz", vibration_period=0.2)
    message = station.ros.wait_until(lambda: next(iter(messages), None))
    axes, columns = message.layout.dim
    assert (axes.label, axes.size, axes.stride) == ("x,z", 2, 10)
    assert (columns.label, columns.size) == ("mean,rms,peak,crest_factor,velocity_rms", 5)
    assert message.data[0::5].tolist() == close_to(10.0, 30.0)
    assert message.data[1::5].tolist() == pytest.approx([0.0, 0.0], abs=1e-6)


def test_two_channels_on_one_axis_are_an_error_in_the_log(station):
    line = len(station.process.lines)
    station.set(channels="xy", axis__y="x")
    station.process.wait_for_line("two channels are mapped to the same axis", line)


def test_a_law_of_its_own_takes_effect_at_once(station):
    station.set(channel__x__sensor="linear", channel__x__unit="g", channel__x__volts=[0.0, 3.3],
                channel__x__values=[-25.0, 25.0])
    station.wait_for_acceleration(2.0, 0.0, 0.0)  # 1.782 V
    result = station.remote.set("channel.x.volts", [1.0, 1.0])
    assert not result.successful
    assert "a law needs two different volts and values" in result.reason


def test_what_is_no_acceleration_is_published_as_what_it_is(station):
    station.sensor.temperature = 31.0
    temperatures = station.remote.subscribe(Temperature, "channel_x/temperature")
    values = station.remote.subscribe(Float64, "channel_x/value")
    imus = station.remote.subscribe(Imu, "imu/data_raw")
    station.set(used_sensor__x=5)
    station.ros.wait_until(lambda: temperatures)
    assert temperatures[-1].temperature == pytest.approx(31.0, abs=0.02)
    assert temperatures[-1].header.frame_id == "imu_link"
    assert abs(temperatures[-1].header.stamp.sec - time.time()) < DEADLINE
    since = temperatures[0].header.stamp  # what was measured before may still be on its way
    station.set(used_sensor__x=6)
    station.ros.wait_until(lambda: values)
    assert values[-1].data == pytest.approx(0.3, abs=1e-4)
    assert not [stamp for stamp in (imu.header.stamp for imu in imus)
                if (stamp.sec, stamp.nanosec) >= (since.sec, since.nanosec)]
    status = station.wait_for_status(lambda status: "photodiode" in status.values.get(
        "law of channel x", ""))
    assert status.values["law of channel x"].startswith("0 … 3.3 V = 0 … 1, by sensor number 6")
    station.set(used_sensor__x=1)


def test_a_new_calibration_factor_takes_effect_at_once(station):
    slope = station.remote.get("calibration.acceleration_x.slope")
    station.set(channel__x__sensor="device", calibration__acceleration_x__offset=-115.0)
    station.wait_for_acceleration(20.0, 0.0, 0.0)
    station.set(calibration__acceleration_x__offset=-125.0)
    assert station.remote.get("calibration.acceleration_x.slope") == slope


def test_the_sample_rate_takes_effect_at_once_and_its_parameters_follow(station):
    line = len(station.process.lines)
    station.set(sample_rate=250)
    station.process.wait_for_line("sample_rate 250/s: nearest is 2", line)
    station.ros.wait_until(
        lambda: station.sensor.adc.sample_rate == pytest.approx(250.0, rel=0.01))
    station.wait_for_parameter("adc.oversampling_rate", station.sensor.adc.oversampling_rate)
    station.wait_for_parameter("adc.prescaler", station.sensor.adc.prescaler)


def test_the_time_offset_is_added_to_the_stamps(station):
    station.set(time_offset=-5.0)
    imu = station.wait_for_imu(lambda imu: imu.header.stamp.sec < time.time() - 4.0)
    assert imu.header.stamp.sec == pytest.approx(time.time() - 5.0, abs=3.0)


def test_diagnostics_tell_identity_link_rate_and_readings(station):
    status = station.wait_for_status(
        lambda status: "battery voltage [V]" in status.values
        and "samples per second, 0 frames lost" in status.message
        and float(status.values["sample rate [Hz]"]) == pytest.approx(500.0, rel=0.01))
    assert status.level == OK
    assert status.hardware_id == "Test-STH 08:6B:D7:01:DE:81"
    values = status.values
    assert values["bus"].startswith("socketcand can0")
    assert values["phase"] == "connected"
    assert (values["sensor: firmware"], values["stationary unit: name"]) == ("2.1.10", "Valerie")
    assert values["sensor: production date"] == "2021-10-05"
    assert float(values["measured sample rate [Hz]"]) == pytest.approx(500.0, rel=0.02)
    assert float(values["sample rate asked for [Hz]"]) == 500.0
    assert 0 < float(values["bus load without stuff bits [%]"]) < float(
        values["bus load [%]"]) < 5
    assert values["law of channel x"].startswith(
        "0.33 … 2.97 V = -100 … 100 g, by sensor number 1 (ADXL1001, x); 0.0374")
    assert (values["rssi [dBm]"], values["lost frames"]) == ("-52", "0")
    assert int(values["frames"]) > 0


def test_the_acquisition_can_be_stopped_and_started(station):
    assert station.remote.trigger("stop_acquisition").message == "acquisition stopped"
    assert not station.sensor.streams
    status = station.wait_for_status(lambda status: "stopped" in status.message)
    assert (status.level, status.message) == (OK, "connected, acquisition stopped")
    assert station.remote.trigger("start_acquisition").success
    station.wait_for_acceleration(10.0, 0.0, 0.0)


def test_a_scan_tells_which_sensors_are_in_range(station):
    response = station.remote.trigger("scan")
    assert response.success
    assert response.message == ('1 in range: "Test-STH" (08:6B:D7:01:DE:81, number 0, -52 dBm); a '
                                "connected sensor hides the others")


def test_the_eeproms_can_be_read_as_text(station):
    text = station.remote.trigger("read_eeprom").message
    for line in ("System Configuration (page 0)", "  EEPROM Status: 172", "  STH Name: Test-STH",
                 "Calibration (page 8)", "  Acceleration X: Offset: -125",
                 "  Sleep Time 1: 300 s"):
        assert line in text.splitlines()
    assert "  STU Name: Valerie" in station.remote.trigger("read_stu_eeprom").message


def test_a_calibration_measurement_is_told(station):
    station.sensor.temperature = 21.5
    response = station.remote.trigger("measure_calibration")
    assert response.success
    assert "temperature [°C]: 21.5" in response.message
    assert "supply 1: 65535" in response.message


def test_saving_writes_what_the_preview_showed(station):
    nothing = station.remote.trigger("preview_save")
    assert (nothing.success, nothing.message) == (True, "saving would change nothing")
    assert station.remote.set("reduced_energy.sleep_time", 120.0).successful
    station.sensor.eeprom["Sleep Time 1"] = 77.0  # a firmware that keeps it in its RAM only
    change = "Sleep Time 1: 77 s → 120 s"
    assert station.remote.trigger("preview_save").message == f"saving would change {change}"
    assert station.sensor.eeprom["Sleep Time 1"] == 77.0
    saved = station.remote.trigger("save_all_settings")
    assert (saved.success, saved.message) == (True, f"saved {change} in the sensor's EEPROM")
    assert station.sensor.eeprom["Sleep Time 1"] == 120.0


def test_a_service_that_the_sensor_refuses_says_why(station):
    assert station.remote.set("reduced_energy.sleep_time", 130.0).successful
    station.sensor.eeprom["Sleep Time 1"] = 77.0
    station.sensor.refuse.add((commands.EEPROM, 0x01))
    response = station.remote.trigger("save_all_settings")
    station.sensor.refuse.clear()
    station.sensor.eeprom["Sleep Time 1"] = 130.0
    assert not response.success
    assert "Sleep Time 1 was not saved: STH 1 cannot write the EEPROM" in response.message


@pytest.mark.parametrize(("command", "receiver", "success", "message"), [
    ("read_state", "sth", True, "read the state: location: application, state: operating"),
    ("write_state 9", "sth", False, "write_state takes (state: 'NetworkState'"),
    ("write_eeprom 5 200 b'\\x01 \\x02'", "sth", True, "write the EEPROM: b'\\x01 \\x02'"),
    ("read_voltage", "sth", True, "read single voltages: ("),
    ("write_name_1 255 b'abcdefghi'", "sth", False,
     "write_name_1 takes (device: 'int', part: 'bytes') -> 'bytes', not 255 b'abcdefghi': cannot "
     "write the first part of the name: 11 bytes do not fit into a frame, at most 8 do"),
    ("read_release_name", "stu", True, "read the release name: Valerie"),
    ("read_eeprom 0 0 1", "sth", True, "read the EEPROM: b'\\xac'"),
    ("raed_state", "sth", False, 'there is no command "raed_state"; did you mean "read_state"?'),
    ("write_state", "sth", False, "write_state takes (state: 'NetworkState'"),
])
def test_any_command_can_be_asked_by_name(station, command, receiver, success, message):
    streams = station.network.streamed
    assert station.remote.set("command_receiver", receiver).successful
    assert station.remote.set("command", command).successful
    response = station.remote.trigger("execute_command")
    assert (response.success, response.message[:len(message)]) == (success, message)
    assert station.network.streamed >= streams  # and it streams on


def test_what_a_command_changes_is_seen_in_the_parameters(station):
    station.remote.set("command_receiver", "sth")
    for command, led in (("write_led False", "disabled"), ("write_led True", "enabled")):
        station.remote.set("command", command)
        assert station.remote.trigger("execute_command").success
        station.ros.wait_until(lambda led=led: station.remote.get("led") == led)


def test_the_rate_of_the_adc_follows_from_the_sample_rate(station):
    result = station.remote.set("adc.prescaler", 3)
    assert not result.successful
    assert result.reason == ("adc.prescaler follows from sample_rate; set sample_rate to 0 first")


@pytest.mark.parametrize("service", ["reconnect", "reset_sth", "reset_stu"])
def test_after_a_service_that_disconnects_the_stream_comes_back(station, service):
    line = len(station.process.lines)
    response = station.remote.trigger(service)
    assert response.success, response.message
    station.process.wait_for_line('connected to "Test-STH"', line)
    station.wait_for_acceleration(10.0, 0.0, 0.0)


def test_losses_are_told_in_log_and_diagnostics(station):
    line = len(station.process.lines)
    station.network.faults.loss = 0.3
    status = station.wait_for_status(lambda status: (
        "frames lost on the radio in the last 30 s; bring the sensor nearer" in status.message))
    assert status.level == WARN
    assert int(status.values["lost frames"]) > 0
    station.process.wait_for_line("were lost on the radio", line)
    station.network.faults.loss = 0.0


def test_a_suspended_node_tells_that_it_was_this_host_and_loses_nothing(station):
    before = station.wait_for_status(lambda status: "pauses of this host" in status.values).values
    streamed = station.network.streamed
    station.process.suspend(lambda: station.network.streamed > streamed + 200)  # 1.2 s of them
    status = station.wait_for_status(lambda status: int(status.values["pauses of this host"])
                                     > int(before["pauses of this host"]))
    assert float(status.values["longest pause of this host [s]"]) > 0.25
    assert status.values["frames lost in pauses of this host"] == "0"


def test_damaged_frames_are_told_in_the_diagnostics(station):
    station.network.send(CanFrame(STREAM_ID, bytes.fromhex("A2 00 01")))
    status = station.wait_for_status(
        lambda status: status.values.get("damaged frames") == "1")
    assert status.values["fault of the last damaged frame"].startswith("data frame of 3 bytes")


def test_another_host_is_told_in_the_diagnostics(station):
    other = can.Bus(interface="socketcand", channel="can0", host=station.server.host,
                    port=station.server.port, ignore_config=True)
    request = commands.READ_RSSI.request(STU_1, commands.SELF).frame
    other.send(can.Message(arbitration_id=request.identifier.encode(), data=request.data,
                           is_extended_id=True))
    status = station.wait_for_status(lambda status: "another host" in status.message)
    assert status.level == WARN
    assert "uses our node number (SPU 1); end one of the two" in status.message
    other.shutdown()


# --- every sample ------------------------------------------------------------------------------

@pytest.fixture
def samples(ros):
    recorder = Samples(ros)
    yield recorder
    recorder.close()


def test_every_sample_arrives_with_its_value_and_its_time(ros, start, launch, samples):
    server = start()
    simulated = server.network.sensors[0]
    process = launch(at(server, autostart=False))
    node = ros.remote(NAME)
    assert node.change_state("configure")
    process.wait_for_line("connected to")
    ros.wait_until(samples.is_matched)
    assert node.change_state("activate")
    samples.until(round(3.8 * SLOW_ADC.sample_rate))
    times = simulated.sample_times(0, 100_000)
    assert node.change_state("deactivate")
    frames = server.network.streamed
    samples.until(3 * frames)
    samples.take()
    process.stop()

    assert samples.published == 3 * frames
    stamps, accelerations = samples.table()
    times = times[samples.indices]
    truth = simulated.vibration(times) * STANDARD_GRAVITY
    truth[:, 1:] = 0.0
    assert np.abs(accelerations - truth).max() < STEP
    assert np.diff(stamps).min() > 0
    assert deserialize_message(samples.messages[-1], Imu).header.frame_id == "imu_link"
    settled = times > times[0] + 3.2
    assert np.abs(stamps * 1e-9 - times)[settled].min() < 5e-3  # all of them: test_sample_clock
    steps = np.diff(stamps[settled]) / np.diff(samples.indices[settled]) * 1e-9
    assert np.median(steps) * SLOW_ADC.sample_rate == pytest.approx(1.0, rel=0.02)


@pytest.fixture
def batches(ros):
    recorder = Samples(ros, PointCloud2, f"{NAME}/imu/batch")
    yield recorder
    recorder.close()


@pytest.mark.skipif(not has_library(), reason=NEEDED)
def test_a_batch_holds_exactly_the_samples_that_are_published_one_by_one(
        ros, start, launch, samples, batches, tmp_path):
    server = start()
    process = launch(at(server, autostart=False, channels="xz", linear_acceleration_stddev=0.5,
                        sample_rate=1000.0, **{"axis.z": "-y"}))
    node = ros.remote(NAME)
    assert node.change_state("configure")
    process.wait_for_line("connected to")
    ros.wait_until(lambda: samples.is_matched() and batches.is_matched())
    server.network.faults.loss = 0.03
    assert node.change_state("activate")
    samples.until(1000)  # no more than the publisher keeps, so none gets lost
    assert node.change_state("deactivate")
    status = ros.wait_for_status(
        STATUS, lambda status: int(status.values.get("frames", -1)) == server.network.streamed)
    assert int(status.values["lost frames"]) > 0
    samples.until(int(status.values["frames"]))
    stamps, accelerations = samples.table()

    def in_batches():
        batches.take()
        clouds = [deserialize_message(message, PointCloud2) for message in batches.messages]
        return clouds if sum(cloud.width for cloud in clouds) == len(stamps) else None

    clouds = ros.wait_until(in_batches)
    parts = [from_imu_batch(cloud) for cloud in clouds]
    assert np.concatenate([part for part, _ in parts]).tolist() == stamps.tolist()
    np.testing.assert_array_equal(np.concatenate([part for _, part in parts]), accelerations)
    assert {cloud.header.frame_id for cloud in clouds} == {"imu_link"}
    periods = [part // 20_000_000 for part, _ in parts]
    assert all(len(set(period)) == 1 for period in periods)
    assert len({period[0] for period in periods}) == len(periods)
    process.stop()
    recorded = {"samples": [Record(f"{NAME}/imu/data_raw", "sensor_msgs/msg/Imu", data, stamp)
                            for data, stamp in zip(samples.messages, stamps.tolist(), strict=True)],
                "batch": [Record(f"{NAME}/imu/batch", "sensor_msgs/msg/PointCloud2", data,
                                 int(part[-1]))
                          for data, (part, _) in zip(batches.messages, parts, strict=True)]}
    for kind, records in recorded.items():
        with write_bag(tmp_path / kind) as write:
            for record in records:
                write(record)
    for source, target in (("samples", "batch"), ("batch", "samples")):
        convert_imu.main([str(tmp_path / source), str(tmp_path / f"{target} again"), "--to", target,
                          "--stddev", "0.5"])
        assert list(read_bag(tmp_path / f"{target} again")) == recorded[target]


@pytest.mark.parametrize(("name", "depth", "complaint"), [
    ("listener", 10, "with a queue of 10 messages, which is too small"), ("listener", 2000, ""),
    ("listener", 0, ""), ("rosbag2_recorder", 2000, ""), ("rosbag2_recorder", 0, "loses samples")])
def test_a_small_queue_is_seen_where_the_middleware_shows_it(name, depth, complaint):
    assert complaint in queue_complaint(name, depth)
    assert bool(complaint) == bool(queue_complaint(name, depth))


def test_a_recorder_of_single_samples_is_warned_once(station):
    line = len(station.process.lines)
    recorder = rclpy.create_node("rosbag2_recorder", context=station.ros.node.context)
    recorder.create_subscription(Imu, f"{SLOW}/imu/data_raw", lambda message: None, 10)
    warning = f"rosbag2_recorder subscribes to {SLOW}/imu/data_raw and loses samples if"
    assert "use imu/batch" in station.process.wait_for_line(warning, line)
    station.wait_for_status(lambda status: True)
    station.wait_for_status(lambda status: True)
    assert station.process.log.count(warning) == 1
    recorder.destroy_node()


def test_with_batches_alone_no_sample_gets_lost(ros, start, launch, batches):
    server = start()
    process = launch(at(server, autostart=False, publish_samples=False, batch_period=0.1))
    node = ros.remote(NAME)
    assert node.change_state("configure")
    process.wait_for_line("connected to")
    ros.wait_until(batches.is_matched)
    assert f"{NAME}/imu/data_raw" not in dict(ros.node.get_topic_names_and_types())
    assert node.change_state("activate")
    batches.until(10)
    assert node.change_state("deactivate")
    status = ros.wait_for_status(
        STATUS, lambda status: int(status.values.get("frames", -1)) == server.network.streamed)

    def stamps():
        batches.take()
        return np.concatenate([from_imu_batch(deserialize_message(message, PointCloud2))[0]
                               for message in batches.messages])

    ros.wait_until(lambda: len(stamps()) == 3 * int(status.values["frames"]))
    assert np.diff(stamps()).min() > 0
    assert status.values["lost frames"] == "0"
    process.stop()


def test_stamps_increase_and_no_sample_is_invented_on_a_bad_radio(ros, start, launch, samples):
    server = start()
    process = launch(at(server, autostart=False))
    node = ros.remote(NAME)
    assert node.change_state("configure")
    process.wait_for_line("connected to")
    ros.wait_until(samples.is_matched)
    faults = server.network.faults
    faults.loss, faults.loss_run, faults.duplicate, faults.jitter = 0.005, 10, 0.02, 0.01
    assert node.change_state("activate")
    samples.until(3000)
    assert node.change_state("deactivate")
    status = ros.wait_for_status(STATUS, lambda status: (
        int(status.values["frames"]) + int(status.values["duplicate frames"])
        == server.network.streamed))
    frames = int(status.values["frames"])
    samples.until(3 * frames)
    samples.take()
    assert samples.published == 3 * frames
    assert np.diff(samples.table()[0]).min() > 0
    process.stop()


# --- life of the node --------------------------------------------------------------------------

@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_streaming_ends_the_node_and_leaves_the_sensor_alone(
        start, launch, number):
    server = start()
    process = launch(at(server))
    process.wait_for_line("connected to")
    wait_until(lambda: server.network.streamed > 100)
    process.stop(number)
    assert not server.network.sensors[0].streams
    assert server.network.stu.connected is None


def wait_until(condition):
    deadline = time.monotonic() + DEADLINE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.005)


def test_the_states_of_the_lifecycle_are_those_of_the_sensor(ros, start, launch):
    server = start()
    simulated = server.network.sensors[0]
    process = launch(at(server, autostart=False,
                        **{"adc.oversampling_rate": 1024}))
    node = ros.remote(NAME)
    assert node.state() == "unconfigured"
    ros.wait_for_status(STATUS, lambda status: status.message == "not configured")
    assert node.names() & SETTINGS.keys() == set()

    for _ in range(2):
        line = len(process.lines)
        assert node.change_state("configure")
        process.wait_for_line("connected to", line)
        ros.wait_until(lambda: "adc.prescaler" in node.names())
        assert simulated.adc.oversampling_rate == 1024
        assert not simulated.streams
        response = node.trigger("start_acquisition")
        assert not response.success
        assert "activate it first" in response.message

        assert node.change_state("activate")
        ros.wait_until(lambda: simulated.streams)
        assert node.change_state("deactivate")
        assert not simulated.streams
        assert server.network.stu.connected is simulated
        assert node.change_state("activate")
        ros.wait_until(lambda: simulated.streams)
        assert node.change_state("deactivate")

        assert node.change_state("cleanup")
        assert server.network.stu.connected is None
        ros.wait_until(lambda: not node.names() & SETTINGS.keys())
        assert "the node is not configured" in node.trigger("scan").message
        assert node.set("frame_id", "spindle").successful
    process.stop()


def test_a_simulated_sensor_comes_with_the_node(ros, launch, samples):
    process = launch({"can_interface": "sim", "channels": "xyz", "sample_rate": 200.0,
                      "sensor_mac": "08-6b-d7-01-de-81"})
    process.wait_for_line(
        'connected to "Test-STH" (08:6B:D7:01:DE:81), firmware 2.1.10; channels '
        "x: 0.33 … 2.97 V = -100 … 100 g, by sensor number 1 (ADXL1001, x); "
        "y: 0.1 … 1.7 V = -40 … 40 g, by sensor number 2 (ADXL358C, y); z: ")
    ros.wait_until(samples.is_matched)
    samples.until(100)
    _, accelerations = samples.table()
    assert np.median(accelerations[:, 2]) == pytest.approx(STANDARD_GRAVITY, abs=STEP)
    node = ros.remote(NAME)
    assert node.change_state("deactivate")
    assert node.change_state("cleanup")
    assert node.change_state("configure")
    process.wait_for_line("connected to", len(process.lines) - 1)
    process.stop()


def test_wanted_settings_are_written_and_what_is_unknown_is_named(ros, start, launch):
    server = start()
    process = launch(at(server, led="disabled", speed=5, **{
        "adc.prescaler": 5, "used_sensor.x": 11, "adc.prescale": 4}))
    process.wait_for_line("connected to")
    process.wait_for_line("wrote led: enabled → disabled, adc.prescaler: 2 → 5"
                          if "wrote led" in process.log else
                          "wrote adc.prescaler: 2 → 5")
    process.wait_for_line("used_sensor.x = 11: STH 1 cannot write the used sensors: not available")
    process.wait_for_line("parameter speed: this driver has no such parameter")
    process.wait_for_line('no such parameter; did you mean "adc.prescaler"?')
    assert (server.network.sensors[0].adc.prescaler, server.network.sensors[0].led) == (5, False)
    status = ros.wait_for_status(STATUS, lambda status: "used_sensor.x differs" in status.values)
    assert status.level == WARN
    assert "1 settings are not as wanted" in status.message
    assert status.values["used_sensor.x differs"] == "wanted 11, reported 1"
    process.stop()


def test_the_load_of_a_slow_bus_is_an_error_in_the_diagnostics(ros, start, launch):
    server = start()
    process = launch(at(server, can_bitrate=62_500))
    process.wait_for_line("the stream takes 83% of the bus without stuff bits, more than 60%")
    status = ros.wait_for_status(STATUS, lambda status: "83% of the bus" in status.message)
    assert status.level == ERROR
    process.stop()


def test_a_healthy_sensor_is_ok_with_all_defaults(ros, start, launch):
    server = start()
    process = launch(at(server, can_bitrate=125_000))
    process.wait_for_line("of the bus, more than 40%")
    status = ros.wait_for_status(STATUS, lambda status: "0 frames lost" in status.message)
    assert status.level == OK
    server.network.faults.foreign = 100.0  # another program on the bus
    status = ros.wait_for_status(STATUS, lambda status: status.level == WARN)
    assert "of the bus, more than 40%" in status.message
    process.stop()


def test_an_odd_calibration_in_the_sensor_is_shown_told_and_not_used(ros, start, launch):
    server = start()
    simulated = server.network.sensors[0]
    simulated.eeprom["Acceleration X: Slope"] = math.nan
    simulated.vibration = constant(40.0, 0.0, 0.0)
    process = launch(at(server, sample_rate=200.0, **{"channel.x.sensor": "device"}))
    process.wait_for_line("channel x: no plausible calibration (the device's factors: slope nan and"
                          " offset -125 are not numbers")
    process.wait_for_line("connected to")
    station = Station(ros, process, server)
    station.wait_for_acceleration(40.0, 0.0, 0.0)
    status = ros.wait_for_status(STATUS, lambda status: status.level == WARN)
    assert status.message.startswith("channel x: no plausible calibration (the device's factors: ")
    ros.wait_until(lambda: "name" in station.remote.names())
    assert math.isnan(station.remote.get("calibration.acceleration_x.slope"))
    station.set(calibration__acceleration_x__slope=250 / 65535)
    station.wait_for_acceleration(40.0, 0.0, 0.0)
    ros.wait_for_status(STATUS, lambda status: status.level == OK)
    process.stop()


# --- what goes wrong ---------------------------------------------------------------------------

def test_a_sensor_that_goes_and_comes_is_told_and_streams_again(ros, start, launch):
    server = start()
    simulated = server.network.sensors[0]
    simulated.vibration = constant(10.0, 0.0, 0.0)
    process = launch(at(server, sample_rate=500.0))
    process.wait_for_line("connected to")
    station = Station(ros, process, server)
    station.wait_for_acceleration(10.0, 0.0, 0.0)
    station.set(led="disabled")
    line = len(process.lines)
    simulated.in_range = False
    process.wait_for_line("the sensor was lost while it streamed (waiting for it)", line)
    status = ros.wait_for_status(STATUS, lambda status: "was lost" in status.message)
    assert status.level == ERROR
    response = station.remote.trigger("measure_calibration")
    assert not response.success
    assert "the sensor is not connected: " in response.message
    result = station.remote.set("led", "enabled")
    assert not result.successful
    assert "the sensor is not connected: " in result.reason
    server.network.power_loss(simulated)
    simulated.in_range = True
    process.wait_for_line("connected to", line)
    station.wait_for_acceleration(10.0, 0.0, 0.0)
    assert not simulated.led  # as it was set
    process.stop()


def test_several_sensors_in_range_are_listed(ros, start, launch):
    server = start("Spindle", "Tool-7")
    process = launch(at(server, sensor_name=""))
    process.wait_for_line('2 sensors are in range: "Spindle" (08:6B:D7:01:DE:81, number 0, '
                          '-52 dBm); "Tool-7" (08:6B:D7:01:DE:82, number 1, -52 dBm); say which '
                          "one with the parameter sensor_name, sensor_mac or sensor_number "
                          "(waiting for it)")
    status = ros.wait_for_status(STATUS, lambda status: "2 sensors" in status.message)
    assert (status.level, status.values["connections"]) == (ERROR, "0")
    response = ros.remote(NAME).trigger("scan")
    assert response.message.startswith('2 in range: "Spindle"')
    process.stop()
    assert process.log.count("2 sensors are in range: ") == 1


def test_a_server_that_goes_and_comes_back_is_waited_for(ros, start, launch):
    server = start()
    network = server.network
    process = launch(at(server))
    process.wait_for_line("connected to")
    wait_until(lambda: network.streamed > 100)
    server.close()
    process.wait_for_line("nothing listens there; check host and port in can_options (waiting")
    status = ros.wait_for_status(STATUS, lambda status: "nothing listens" in status.message)
    assert status.level == ERROR
    response = ros.remote(NAME).trigger("scan")
    assert (response.success, response.message) == (False, "socketcand can0 is not open")
    line = len(process.lines)
    again = SimulatedIcotronic(network, f"{server.host}:{server.port}", "").start()
    try:
        process.wait_for_line("the link is open again", line)
        process.wait_for_line("connected to", line)
        streamed = network.streamed
        wait_until(lambda: network.streamed > streamed + 100)
        process.stop()
    finally:
        again.close()
    assert process.log.count("nothing listens there") == 1


def test_a_bus_that_is_not_there_is_told_once_and_waited_for(launch):
    cases = [(launch(parameters), words) for parameters, words in (
        ({"can_interface": "soketcan"}, "python-can has no such interface; did you mean"),
        ({"can_interface": "socketcan", "can_channel": "can_not"},
         "cannot open socketcan can_not: "),
        ({"can_interface": "socketcand"}, "socketcand needs can_options such as"),
        ({"can_interface": "socketcand", "can_options": ["host=127.0.0.1", "port=1"]},
         "nothing listens there; check host and port in can_options"))]
    for process, words in cases:
        assert "(waiting for it)" in process.wait_for_line(words)
    for process, words in cases:
        process.stop()
        assert process.log.count(words) == 1


def test_a_wrong_parameter_ends_the_start_with_the_reason(launch):
    cases = [(launch({"can_interface": "sim", **parameters}), words) for parameters, words in (
        ({"can_interface": "socketcand", "can_options": ["host"]},
         "can_options must be like \"host=127.0.0.1\", not 'host'"),
        ({"can_options": "host=1"}, "can_options must be a list of words"),
        ({"channels": "w"}, "channels must be one of x, y, z, xy, xz, yz, xyz, not 'w'"),
        ({"sample_rate": -5.0}, "sample_rate = -5 Hz is out of range, allowed is 0 … "),
        ({"axis.y": "-w"}, "axis.y must be one of"),
        ({"sensor_mac": "hello"}, "sensor_mac cannot be 'hello': The sensor with this MAC address"),
        ({"config_mode": "pull"}, "config_mode must be one of push, check, leave"),
        ({"can_bitrate": "fast"}, "can_bitrate must be a whole number"))]
    for process, words in cases:
        assert process.wait() == 1
        assert words in process.log
        assert "Traceback" not in process.log


def test_a_configuration_that_fails_can_be_corrected(ros, start, launch):
    server = start()
    process = launch(at(server, autostart=False, can_options=["wrong"]))
    node = ros.remote(NAME)
    assert node.state() == "unconfigured"
    assert not node.change_state("configure")
    process.wait_for_line("can_options must be like")
    assert node.set("can_options", at(server)["can_options"]).successful
    assert node.change_state("configure")
    process.wait_for_line("connected to")
    assert server.network.sensors[0].adc == SLOW_ADC
    process.stop()
