# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""ROS 2 node of the ICOtronic sensors: parameters, topics, services and diagnostics."""

from __future__ import annotations

import sys
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from enum import Enum
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from diagnostic_msgs.msg import DiagnosticStatus
from sensor_msgs.msg import BatteryState, Imu, PointCloud2, Temperature
from std_msgs.msg import Float64, Float64MultiArray

from driver_common import clocks as time
from driver_common import diagnostics
from driver_common.device_node import FRAME_ID, TIME_OFFSET, Action, DeviceNode, Topic, run
from driver_common.recording import CAN
from driver_common.settings import Option, Value
from icotronic_driver.commands import parse_request
from icotronic_driver.eeprom import PAGE_NAMES, Field, FieldValue
from icotronic_driver.gathering import Consumer, Conversion, Gatherer, Samples, Stream
from icotronic_driver.identifier import STH_1, STU_1
from icotronic_driver.laws import (
    AUTO,
    CELSIUS,
    DEVICE,
    LINEAR,
    PARTS_BY_NAME,
    VOLTAGE,
    ChannelOptions,
    Law,
)
from icotronic_driver.line import Line
from icotronic_driver.listener import Listener
from icotronic_driver.maintenance import STORED
from icotronic_driver.sensor import Channel, Options, Phase, Sensor, UnitIdentity
from icotronic_driver.session import IcotronicBus
from icotronic_driver.settings import SETTINGS
from icotronic_driver.streaming import AXES
from icotronic_driver.values import CLOCK, decode_mac, encode_mac
from icotronic_driver.vibration import COLUMNS, Vibration
from msg_conversions.battery import to_battery_state
from msg_conversions.float64 import serialised_float64
from msg_conversions.imu import ImuTemplate, variances_of
from msg_conversions.imu_batch import ImuBatchTemplate
from msg_conversions.multi_array import to_float64_multi_array
from msg_conversions.temperature import TemperatureTemplate, to_temperature

SIMULATED = "sim"
CHANNELS = {channels: code for code, channels in enumerate(
    ("x", "y", "z", "xy", "xz", "yz", "xyz"))}
SIGNED_AXES = {sign + axis: code for code, (sign, axis) in enumerate(
    (sign, axis) for sign in ("", "-") for axis in AXES)}
STREAM_OPTIONS = ("channels", *(f"axis.{axis}" for axis in AXES), "sample_rate", "batch_period",
                  "vibration_period",
                  *(f"channel.{axis}.{part}" for axis in AXES
                    for part in ("sensor", "volts", "values", "unit")),
                  "linear_acceleration_stddev", "time_offset")
LAWS = {word: code for code, word in enumerate((AUTO, DEVICE, LINEAR, *PARTS_BY_NAME))}
READING_UNITS = {"rssi": " [dBm]", "battery_voltage": " [V]", "temperature": " [°C]"}
COLLISION = "two channels are mapped to the same axis; correct axis.x, axis.y and axis.z"
RECEIVERS = {"sth": STH_1, "stu": STU_1}
RECENT_TIME = 30.0  # s that count for whether all is well
LOSS_LIMIT = 0.01  # share of the frames that may be lost without a warning
QUEUE_DEPTH = 2000  # samples that a publisher keeps for slow subscribers, 0.2 s at the usual rate
LEAST_QUEUE = 500  # samples, 50 ms
RECORDER = "rosbag2_recorder"  # name of the node of 'ros2 bag record'
BATCH_DEPTH = 100  # batches, 2 s
GATHERING_TIME = 0.016  # s for which frames wait for each other where nobody wants each at once


class IcotronicNode(DeviceNode, Listener):
    """Driver of one ICOtronic sensor behind a stationary unit on CAN."""

    SEVERAL_SENSORS = False
    LINK = CAN
    BUS_OPTIONS = (
        Option("can_interface", kind=str, default="socketcan",
               description="Interface of python-can, such as socketcan or socketcand; sim = a "
                           "simulated sensor; replay = a recording"),
        Option("can_channel", kind=str, default="can0",
               description="Channel of the interface; the file of a recording"),
        Option("can_bitrate", kind=int, default=1_000_000, minimum=1, unit="bit/s",
               description="Bit rate of the bus"),
        Option("can_options", kind=list, default=[],
               description='Further options of the interface, such as "host=127.0.0.1"'),
    )
    SENSOR_OPTIONS = (
        Option("sensor_name", kind=str, default="", description="The sensor with this name"),
        Option("sensor_mac", kind=str, default="", pattern="(?i)|([0-9a-f]{2}[:-]){5}[0-9a-f]{2}",
               description="The sensor with this MAC address, such as 08:6B:D7:01:DE:81"),
        Option("sensor_number", kind=int, default=-1, minimum=-1, maximum=254,
               description="The sensor with this number at the stationary unit; -1 = any"),
        replace(FRAME_ID, default="imu_link", live=False),
        Option("channels", kind=str, choices=CHANNELS, default="x", live=True,
               description="Which channels are streamed; they share the rate of the ADC"),
        *(Option(f"axis.{axis}", kind=str, choices=SIGNED_AXES, default=axis, live=True,
                 description=f"Axis of the frame along which channel {axis} measures")
          for axis in AXES),
        Option("sample_rate", kind=float, default=0.0, minimum=0.0, maximum=CLOCK / 28, unit="Hz",
               live=True, description="Samples per second of each channel; the nearest ADC "
                                      "configuration is taken; 0 = as the adc parameters say"),
        *(option for axis in AXES for option in (
            Option(f"channel.{axis}.sensor", kind=str, choices=LAWS, default=AUTO, live=True,
                   description=f"What channel {axis} measures, which says what its voltage means: "
                               "auto = by used_sensor, device = by the device's calibration "
                               "factors, linear = by volts and values, or a sensor"),
            Option(f"channel.{axis}.volts", kind=list, is_pair=True, unit="V",
                   default=list(VOLTAGE.volts), live=True,
                   description=f"Two voltages of the linear law of channel {axis}"),
            Option(f"channel.{axis}.values", kind=list, is_pair=True,
                   default=list(VOLTAGE.values), live=True,
                   description="What is measured at these voltages"),
            Option(f"channel.{axis}.unit", kind=str, default=VOLTAGE.unit, live=True,
                   description="Unit of these values; g and m/s² are accelerations, °C is a "
                               "temperature"))),
        Option("linear_acceleration_stddev", kind=float, default=0.0, minimum=0.0, maximum=1e6,
               unit="m/s²", live=True,
               description="Standard deviation of the acceleration, for the covariance; 0 = "
                           "unknown"),
        Option("publish_samples", kind=bool, default=True,
               description="Publish each sample as a message of its own, on imu/data_raw"),
        Option("batch_period", kind=float, default=0.02, minimum=0.0, maximum=1.0, unit="s",
               live=True, description="Time whose samples are one message on imu/batch; 0 = off"),
        Option("vibration_period", kind=float, default=0.0, minimum=0.0, maximum=10.0, unit="s",
               live=True, description="Time whose samples make one message on vibration; 0 = off"),
        Option("status_period", kind=float, default=8.0, minimum=0.0, maximum=3600.0, unit="s",
               live=True, description="Time in which battery, temperature, RSSI, states and "
                                      "counters are read once, 0.5 s at least; 0 = never, so that "
                                      "nothing disturbs the stream"),
        Option("command", kind=str, default="read_state", live=True,
               description="What the service ~/execute_command asks: the name of a command and "
                           "its arguments, such as write_state 2"),
        Option("command_receiver", kind=str, choices=RECEIVERS, default="sth", live=True,
               description="Who is asked: the sensor (sth) or the stationary unit (stu)"),
        TIME_OFFSET,
    )
    ALL_SETTINGS = SETTINGS
    TOPICS: Mapping[str, Topic] = {
        "imu/batch": Topic(PointCloud2, BATCH_DEPTH), "imu/data_raw": Topic(Imu, QUEUE_DEPTH),
        "vibration": Topic(Float64MultiArray), "battery": Topic(BatteryState),
        "temperature": Topic(Temperature),
        **{f"channel_{axis}/temperature": Topic(Temperature, QUEUE_DEPTH) for axis in AXES},
        **{f"channel_{axis}/value": Topic(Float64, QUEUE_DEPTH) for axis in AXES}}

    def __init__(self) -> None:
        """Declare the parameters; raises SettingError."""
        self._stream_options: list[Any] = []
        self._topics: dict[str, Any] = {}
        self._stream = Stream((), 0)
        self._told_queues: set[str] = set()
        self._told_load = ""
        self._history: deque[_Counts] = deque()
        super().__init__("icotronic")

    # --- set-up ---

    def make_bus(self) -> IcotronicBus:
        """Return the bus, with a simulator behind it where that was asked for."""
        interface, channel = self.option("can_interface"), self.option("can_channel")
        options: list[str] = self.option("can_options")
        if interface == SIMULATED:
            from icotronic_driver.simulator.line import simulated_network

            self.simulator = simulator = simulated_network().start()
            interface = "socketcand"
            options = [f"host={simulator.host}", f"port={simulator.port}"]
        mac = self.option("sensor_mac")
        sensor = Options(
            sensor_name=self.option("sensor_name"), sensor_mac=mac and decode_mac(encode_mac(mac)),
            sensor_number=self.option("sensor_number"),
            wanted=self.wanted_settings(""), config_mode=self.option("config_mode"))
        self._set_live(sensor)
        self._stream_options = self._read_stream_options()
        self._stream = Stream((), 0)
        return IcotronicBus(Line(interface, channel, self.option("can_bitrate"), options),
                            sensor, self)

    def _set_live(self, options: Options) -> None:
        """Hand over the options that may change at run time."""
        options.channels = self.option("channels")
        options.sample_rate = self.option("sample_rate")
        options.laws = {axis: self._channel_options(axis) for axis in AXES}
        options.status_period = self.option("status_period")

    def _channel_options(self, axis: str, **changes: Any) -> ChannelOptions:
        """Return how a channel gets its law, with some of its options changed.

        Raises:
            SettingError: Volts and values are no law.
        """
        given = {part: changes.get(part, self.option(f"channel.{axis}.{part}"))
                 for part in ("sensor", "volts", "values", "unit")}
        return ChannelOptions(given["sensor"], Law(tuple(given["volts"]), tuple(given["values"]),
                                                   given["unit"]))

    def check_option(self, name: str, value: Value) -> None:
        """Refuse volts and values that are no law; raises SettingError."""
        group, _, rest = name.partition(".")
        axis, _, part = rest.partition(".")
        if group == "channel":
            self._channel_options(axis, **{part: value})

    def apply_options(self) -> None:
        """Hand live options to the bus; the stream begins anew with those that it depends on."""
        if self.bus is not None and self.thread is not None:
            self.thread.post(partial(self._apply_options, self.bus))

    def _apply_options(self, bus: IcotronicBus) -> None:
        self._set_live(bus.sensor.options)
        before, self._stream_options = self._stream_options, self._read_stream_options()
        if self._stream_options != before:
            bus.acquisition.restart()

    def _read_stream_options(self) -> list[Any]:
        return [self.option(name) for name in STREAM_OPTIONS]

    def make_interfaces(self, sensor: str) -> None:
        """Create the topics."""
        self._topics = {
            "batch": self.add_publisher(sensor, "imu/batch"),
            "vibration": self.add_publisher(sensor, "vibration"),
            "battery_voltage": self.add_publisher(sensor, "battery"),
            "temperature": self.add_publisher(sensor, "temperature"),
            **{name: self.add_publisher(sensor, name)
               for name in self.TOPICS if name.startswith("channel_")}}
        if self.option("publish_samples"):
            self._topics["imu"] = self.add_publisher(sensor, "imu/data_raw")

    def services_of(self, sensor: str) -> dict[str, Action]:
        """Return the services of the sensor and the stationary unit."""
        return super().services_of(sensor) | {
            "scan": self._scan,
            "reconnect": self._reconnect,
            "reset_sth": partial(self._reset, STH_1),
            "reset_stu": partial(self._reset, STU_1),
            "read_eeprom": partial(self._read_eeprom, STH_1),
            "read_stu_eeprom": partial(self._read_eeprom, STU_1),
            "measure_calibration": self._measure,
            "execute_command": self._execute_command,
            "preview_save": self._preview_save,
            "save_all_settings": self._save}

    def channel(self) -> str:
        """Return the name of the CAN channel."""
        return str(self.option("can_channel"))

    def link_facts(self) -> dict[str, str]:
        """Return the interface, whose times differ."""
        return {"interface": self.bus.line.interface}

    # --- what the bus reports, in its thread ---

    def describe(self, sensor: Sensor) -> str:
        """Return identity, calibration and rate."""
        assert sensor.identity is not None
        return (
            f'"{sensor.identity.name}" ({sensor.identity.mac}), firmware '
            f"{sensor.identity.firmware or 'not told'}; channel{'s' * (len(sensor.channels) > 1)} "
            f"{'; '.join(map(str, sensor.channels))}; "
            f"{sensor.sample_rate:.6g} samples per second")

    def on_found(self, sensor: Sensor) -> None:
        """Show the sensor's settings as parameters; say what its stream does to the bus."""
        super().on_found(sensor)
        warning = sensor.load_warning(self.option("can_bitrate"))
        if warning and warning != self._told_load:
            self.on_note(sensor, warning, warning=True)
        self._told_load = warning

    def on_stream(self, sensor: Sensor) -> Callable[[int, float, tuple[int, ...]], None]:
        """Return what publishes the samples of a stream that begins: the hot path."""
        axes = self._axes(sensor)
        if _collide(axes):
            self.on_note(sensor, COLLISION, warning=True)
        conversion = Conversion([partial(_linear, channel) for channel in sensor.channels], axes)
        self._stream.finish()
        self._stream = Stream((*self._consumers(sensor, conversion), *self._others(sensor)),
                              round(self.option("time_offset") * 1e9))
        return self.while_running(self._stream.take)

    def _others(self, sensor: Sensor) -> Iterator[Consumer]:
        """Yield those who take what is no acceleration."""
        temperature = TemperatureTemplate(self.option("frame_id"))
        for number, channel in enumerate(sensor.channels):
            topic = self._topics.get(_topic_of(channel))
            if topic is not None:
                serialise = (temperature.serialised if channel.law.unit == CELSIUS else
                             lambda stamp, value: serialised_float64(value))
                yield Consumer(topic.get_subscription_count, partial(
                    _publish_channel, topic.handle.publish_raw, serialise, channel,
                    slice(number, None, len(sensor.channels))))

    def _consumers(self, sensor: Sensor, conversion: Conversion) -> Iterator[Consumer]:
        """Yield those who take the accelerations of a stream."""
        if not conversion.tables:
            return
        frame_id = self.option("frame_id")
        if "imu" in self._topics:
            template = ImuTemplate(variances_of(
                conversion.tables, self.option("linear_acceleration_stddev")), frame_id)
            topic = self._topics["imu"]
            # publish() itself costs twice as much, because it looks at what it was given.
            yield Consumer(topic.get_subscription_count, _publisher(
                template.serialised, topic.handle.publish_raw, conversion))
        batch, batches = ImuBatchTemplate(frame_id), self._topics["batch"]
        vibration, summaries = Vibration(sensor.sample_rate, conversion.tables), (
            self._topics["vibration"])
        labels = ",".join(AXES[axis] for axis in sorted(conversion.tables)), ",".join(COLUMNS)

        def publish_batch(samples: Samples) -> None:
            batches.publish(batch.serialised(samples.stamps, samples.accelerations))

        def publish_vibration(samples: Samples) -> None:
            summaries.publish(to_float64_multi_array(vibration.summary(samples), labels))

        for period, publish, topic in (
                (self.option("batch_period"), publish_batch, batches),
                (self.option("vibration_period"), publish_vibration, summaries)):
            if period:
                gatherer = Gatherer(period, conversion, publish)
                yield Consumer(topic.get_subscription_count, gatherer.take, gatherer)

    def on_step(self, pause: float) -> None:
        """Look who listens to the stream, and hand over what waits for too long."""
        super().on_step(pause)
        self.while_running(self._look_who_listens)()

    def _look_who_listens(self) -> None:
        sensor: Sensor = self.bus.sensor
        if sensor.decoder is None:
            self._stream.finish()
        at_once = self._stream.look(time.time_ns())
        sensor.options.may_wait = 0.0 if at_once else GATHERING_TIME

    def _publish_diagnostics(self) -> None:
        super()._publish_diagnostics()
        self._warn_of_small_queues()

    def _warn_of_small_queues(self) -> None:
        """Say once of each subscriber that it will lose single samples, where that can be seen."""
        topic = self._topics.get("imu")
        if self.bus is None or topic is None or not topic.get_subscription_count():
            return
        for subscriber in self.get_subscriptions_info_by_topic(topic.topic_name):
            name = subscriber.node_name
            complaint = queue_complaint(name, subscriber.qos_profile.depth)
            if complaint and name not in self._told_queues:
                self._told_queues.add(name)
                self.get_logger().warning(
                    f"{name} subscribes to {topic.topic_name} {complaint}; use imu/batch, or see "
                    "config/record_qos.yaml")

    def _axes(self, sensor: Sensor) -> list[int | None]:
        """Return the signed axis of each channel, None where it measures no acceleration."""
        return [SIGNED_AXES[self.option(f"axis.{channel.name}")]
                if channel.law.is_acceleration else None for channel in sensor.channels]

    def on_readings(self, sensor: Sensor, name: str) -> None:
        """Publish a reading that has a topic."""
        value = getattr(sensor.readings, name)
        convert = {"battery_voltage": to_battery_state, "temperature": to_temperature}.get(name)
        if convert is not None:
            self.while_running(self._topics[name].publish)(
                convert(value, self.option("frame_id"), self.bus.line.arrival_time))

    # --- services, in the executor ---

    async def _scan(self) -> str:
        seen = await self.call(lambda: self.bus.maintenance.scan())
        note = ("; a connected sensor hides the others"
                if self.bus.sensor.phase is not Phase.SEARCHING else "")
        return f"{len(seen)} in range: {'; '.join(map(str, seen)) or 'none'}{note}"

    async def _reconnect(self) -> str:
        await self.call(lambda: self.bus.maintenance.reconnect())
        return "disconnected; searching again"

    async def _reset(self, node: int) -> str:
        await self.call(lambda: self.bus.maintenance.reset(node))
        return "reset; the sensor will be connected again"

    async def _read_eeprom(self, node: int) -> str:
        fields = await self.call(lambda: self.bus.maintenance.read_eeprom(node))
        lines = []
        for page, name in PAGE_NAMES.items():
            content = [f"  {field.name}: {field.text(value)}"
                       for field, value in fields.items() if field.page == page]
            if content:
                lines += [f"{name} (page {page})", *content]
        return "\n".join(lines)

    async def _measure(self) -> str:
        results = await self.call(lambda: self.bus.maintenance.measure())
        return "; ".join(f"{name}: {value:g}" for name, value in results.items())

    async def _execute_command(self) -> str:
        text, receiver = self.option("command"), RECEIVERS[self.option("command_receiver")]
        request = parse_request(text, receiver)
        result = await self.call(lambda: self.bus.maintenance.execute(request))
        return f"{request.name}: {_in_words(result)}"

    async def _preview_save(self) -> str:
        changes = await self.call(lambda: self.bus.maintenance.unsaved())
        return f"saving would change {_changes(changes)}"

    async def _save(self) -> str:
        changes = await self.call(lambda: self.bus.maintenance.save())
        return (f"saved {_changes(changes)} in the sensor's EEPROM" if changes
                else "the sensor's EEPROM holds all of it already")

    # --- diagnostics ---

    def status_of(self, sensor: Sensor) -> DiagnosticStatus:
        """Return identity, link, rate, losses, calibration, readings and differing settings."""
        counts, line, pauses = sensor.statistics, self.bus.line, self.bus.line.pauses
        values: dict[str, object] = {"bus": line.name, "phase": sensor.phase.value}
        for title, identity in (("sensor", sensor.identity), ("stationary unit",
                                                              sensor.stu_identity)):
            if identity is not None:
                values |= _identity(title, identity)
        if sensor.phase is Phase.CONNECTED:
            bitrate = self.option("can_bitrate")
            values |= {"sample rate asked for [Hz]": self.option("sample_rate") or "by the ADC",
                       "sample rate [Hz]": sensor.sample_rate,
                       "measured sample rate [Hz]": sensor.measured_rate,
                       "bus load [%]": 100 * sensor.bus_load(bitrate),
                       "bus load without stuff bits [%]":
                       100 * sensor.bus_load(bitrate, stuffing=False)}
            values |= {f"law of channel {channel.name}":
                       f"{channel.law}, by {channel.source}; "
                       f"{channel.slope:.6g} · raw {channel.offset:+.6g} {channel.unit}"
                       for channel in sensor.channels}
        values |= {f"{name.replace('_', ' ')}{READING_UNITS.get(name, '')}": _in_words(value)
                   for name, value in vars(sensor.readings).items() if value is not None}
        values |= {
            "frames": counts.frames, "lost frames": counts.lost,
            "frames lost in pauses of this host": pauses.lost,
            "pauses of this host": pauses.count,
            "longest pause of this host [s]": pauses.longest,
            "duplicate frames": counts.duplicates, "damaged frames": counts.damaged,
            "fault of the last damaged frame": counts.fault,
            "stale frames": line.counts.stale, "foreign frames": line.counts.foreign,
            "frames of another host": line.counts.other_host, "error frames": line.counts.errors,
            "connections": sensor.connections, "time-outs": sensor.time_outs,
            "unsaved settings": ", ".join(sorted(sensor.unsaved & STORED.keys()))}
        values |= sensor.differences
        if sensor.decoder is not None:
            values |= diagnostics.clock_values(sensor.clock, sensor.breaks)
        identity = sensor.identity
        return diagnostics.to_status(self.status_name(sensor.options.name),
                                     f"{identity.name} {identity.mac}" if identity else "",
                                     *self._health(sensor), values)

    def _health(self, sensor: Sensor) -> tuple[bytes, str]:
        """Return level and message of the diagnostics."""
        if sensor.phase is not Phase.CONNECTED:
            return diagnostics.ERROR, str(sensor.error or sensor.phase.value)
        complaints = self._complaints(sensor)
        if complaints:
            complaints += ["acquisition stopped"] if sensor.decoder is None else []
            overload = sensor.overloads(self.option("can_bitrate"))
            return (diagnostics.ERROR if overload else diagnostics.WARN), "; ".join(complaints)
        if sensor.decoder is None:
            return diagnostics.OK, "connected, acquisition stopped"
        return diagnostics.OK, (f"{sensor.measured_rate:.6g} samples per second, "
                                f"{sensor.statistics.lost} frames lost")

    def _complaints(self, sensor: Sensor) -> list[str]:
        """Return what is wrong with a connected sensor."""
        recent = self._recent_counts(sensor)
        found = {
            "another host on the bus uses our node number (SPU 1); end one of the two":
                recent.other_host,
            f"{recent.lost} frames lost on the radio in the last {RECENT_TIME:g} s; bring the "
            "sensor nearer": recent.lost > LOSS_LIMIT * recent.frames and not recent.other_host,
            f"{recent.lost_here} frames lost because this host was busy or asleep in the last "
            f"{RECENT_TIME:g} s": recent.lost_here,
            f"{recent.errors} error frames in the last {RECENT_TIME:g} s; check wiring, "
            "termination and bit rate": recent.errors,
            f"{len(sensor.differing)} settings are not as wanted": sensor.differing,
            COLLISION: _collide(self._axes(sensor)),
            **dict.fromkeys(sensor.law_complaints, True),
            **dict.fromkeys(sensor.readings.faults, True),
            sensor.load_warning(self.option("can_bitrate")):
                recent.foreign or sensor.overloads(self.option("can_bitrate"))}
        return [text for text, is_so in found.items() if text and is_so]

    def _recent_counts(self, sensor: Sensor) -> _Counts:
        """Return what was counted in the last `RECENT_TIME` s."""
        counts, line = sensor.statistics, self.bus.line.counts
        here = self.bus.line.pauses.lost
        now = _Counts(time.monotonic(), counts.frames, counts.lost - here, here, line.foreign,
                      line.other_host, line.errors)
        self._history.append(now)
        while now.time - self._history[0].time > RECENT_TIME:
            self._history.popleft()
        first = self._history[0]
        return _Counts._make(after - before for before, after in zip(first, now, strict=True))


class _Counts(NamedTuple):
    """What was counted until a time in s; frames lost on the way, and in pauses of this host."""

    time: float
    frames: int
    lost: int
    lost_here: int
    foreign: int
    other_host: int
    errors: int


def _linear(channel: Channel, raw: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return m/s² of raw values of a channel."""
    return channel.slope * raw + channel.offset


def _publisher(serialise: Callable[[int, float, float, float], bytes],
               publish: Callable[[bytes], None],
               conversion: Conversion) -> Callable[[int, int, tuple[int, ...]], None]:
    """Return what publishes the samples of a frame one by one: the hot path."""
    (x, x_table), (y, y_table), (z, z_table) = conversion.columns()
    channels = conversion.channels

    def publish_samples(stamp: int, step: int, values: tuple[int, ...]) -> None:
        for first in range(0, len(values), channels):
            publish(serialise(stamp, x_table[values[first + x]], y_table[values[first + y]],
                              z_table[values[first + z]]))
            stamp += step

    return publish_samples


def queue_complaint(subscriber: str, depth: int) -> str:
    """Return what is wrong with a subscriber's queue for single samples, "" where nothing is known.

    Args:
        subscriber: Name of its node.
        depth: Messages that it keeps; 0 = the middleware does not tell, as Fast DDS.
    """
    if 0 < depth < LEAST_QUEUE:
        return f"with a queue of {depth} messages, which is too small for this stream"
    if not depth and subscriber.startswith(RECORDER):
        return "and loses samples if it has the usual queue of 10 messages"
    return ""


def _topic_of(channel: Channel) -> str:
    """Return the topic of a channel that measures no acceleration, "" of another."""
    if channel.law.is_acceleration:
        return ""
    return f"channel_{channel.name}/{'temperature' if channel.law.unit == CELSIUS else 'value'}"


def _publish_channel(publish: Callable[[bytes], None], serialise: Callable[[int, float], bytes],
                     channel: Channel, places: slice, stamp: int, step: int,
                     values: tuple[int, ...]) -> None:
    """Publish the samples of one channel in a frame."""
    for raw in values[places]:
        publish(serialise(stamp, channel.slope * raw + channel.offset))
        stamp += step


def _collide(axes: Sequence[int | None]) -> bool:
    used = [axis % 3 for axis in axes if axis is not None]
    return len(set(used)) < len(used)


def _identity(title: str, identity: UnitIdentity) -> dict[str, object]:
    return {f"{title}: {name.replace('_', ' ')}": value for name, value in vars(identity).items()
            if value not in (None, "")}


def _in_words(value: object) -> object:
    """Return a status or a pair of counters for people, any other value as it is."""
    fields = value._asdict() if hasattr(value, "_asdict") else getattr(value, "__dict__", None)
    if not fields or isinstance(value, Enum):
        return value
    return ", ".join(f"{name.replace('_', ' ')}: {part.name.lower()}" if isinstance(part, Enum)
                     else f"{name.replace('_', ' ')}: {part}"
                     for name, part in fields.items() if part is not None)


def _changes(changes: Mapping[Field, tuple[FieldValue, FieldValue]]) -> str:
    return "; ".join(f"{field.name}: {field.text(stored)} → {field.text(new)}"
                     for field, (stored, new) in changes.items()) or "nothing"


def main(args: Sequence[str] | None = None) -> None:
    """Run the node."""
    sys.exit(run(IcotronicNode, args))
