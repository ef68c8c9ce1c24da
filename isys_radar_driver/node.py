# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""ROS 2 node of the iSYS radars: parameters, topics, services and diagnostics around a RadarBus."""

from __future__ import annotations

import dataclasses
import math
import sys
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from sensor_msgs.msg import PointCloud2, Range, Temperature
from std_msgs.msg import Bool, Float32MultiArray

from driver_common import diagnostics
from driver_common.device_node import FRAME_ID, TIME_OFFSET, Action, DeviceNode, Topic, run
from driver_common.settings import Option, Value
from isys_radar_driver import commands
from isys_radar_driver.commands import Command, RangeList
from isys_radar_driver.listener import Listener
from isys_radar_driver.models import find_model
from isys_radar_driver.radar import Options, Radar
from isys_radar_driver.session import RadarBus
from isys_radar_driver.settings import ALL_SETTINGS
from isys_radar_driver.targets import TargetList
from msg_conversions.multi_array import to_float32_multi_array
from msg_conversions.point_cloud import to_point_cloud
from msg_conversions.range import (
    NO_ECHO_VALUES,
    TOO_CLOSE_VALUES,
    published_distance,
    to_range,
)
from msg_conversions.temperature import to_temperature

SIMULATED = "sim://"
POSITIVE_VELOCITY = {"approaching": -1, "receding": 1}  # to the sign of ROS (errata I20)
POSITIVE_ANGLE = {"left": 1, "right": -1}  # errata I21
RESOLUTIONS = {"auto": 0, "16": 16, "32": 32}
MODEL_TOPICS = (
    (commands.READ_RANGE_LIST, ("range", "range_list", "temperature")),
    (commands.READ_DSP_TEMPERATURE, ("dsp_temperature", "rfe_temperature")),
    (commands.READ_DIGITAL_OUTPUTS, ("digital_outputs",)),
    (commands.READ_RAW, ("raw_signals",)),
)
RANGE_LIST_LABEL = ", ".join(field.name for field in dataclasses.fields(RangeList))
PWM_STEP = 0.01  # m or m/s, table 35


class ModelOption(Option):
    """The name of a model, of which YAML takes one such as 4001 for a number."""

    def check(self, value: object) -> Value:
        """Return the name; raises SettingError."""
        return super().check(str(value) if type(value) is int else value)


class IsysRadarNode(DeviceNode, Listener):
    """Driver of one or several iSYS radars on a serial line."""

    KIND = Radar.KIND
    BUS_OPTIONS = (
        Option("serial_port", kind=str, default="",
               description="Device path, pyserial URL such as socket://host:port, sim://MODEL, or "
                           "replay://FILE"),
        Option("serial_baud", kind=int, default=0, minimum=0, unit="Bd",
               description="Baud rate; 0 = the default rates of the models, one after the other"),
    )
    SENSOR_OPTIONS = (
        Option("address", kind=int, default=0, minimum=0, maximum=255,
               description="Address on the line; 0 = ask (only one sensor may be connected)"),
        ModelOption("model", kind=str, default="",
               description="The only model that is accepted, such as iSYS-4001; empty = any"),
        FRAME_ID,
        Option("output", kind=int, default=1, minimum=1, maximum=3, live=True,
               description="Output whose filter the target lists have passed"),
        Option("target_list_resolution", kind=str, choices=RESOLUTIONS, default="auto", live=True,
               description="Bits per value of the target lists; auto = the finest that fits the "
                           "cycle at this baud rate, with all radars of the line"),
        TIME_OFFSET,
        Option("positive_velocity", kind=str, default="approaching", live=True,
               choices=POSITIVE_VELOCITY,
               description="What the device means by a positive velocity"),
        Option("positive_angle", kind=str, default="left", live=True,
               choices=POSITIVE_ANGLE,
               description="What the device means by a positive angle"),
        Option("publish_range_list", kind=bool, default=False, live=True,
               description="Read the range list after every target list and publish ~/range, "
                           "~/range_list and ~/temperature (iSYS-6xxx)"),
        Option("field_of_view", kind=float, default=0.0, minimum=0.0, maximum=math.pi, unit="rad",
               live=True, description="Opening angle in ~/range; 0 = along the x axis"),
        Option("no_echo_value", kind=str, choices=dict.fromkeys(NO_ECHO_VALUES, 0),
               default="inf", live=True, description="What ~/range says where nothing is seen "
                                                     "up to its max_range; skip = nothing"),
        Option("too_close_value", kind=str, choices=dict.fromkeys(TOO_CLOSE_VALUES, 0),
               default="-inf", live=True, description="What ~/range says of something nearer "
                                                      "than its min_range; skip = nothing"),
        Option("publish_digital_outputs", kind=bool, default=False, live=True,
               description="Read the digital outputs after every target list and publish them"),
        Option("new_address", kind=int, default=0, minimum=0, maximum=255, live=True,
               description="Address that the service ~/change_address gives the sensor"),
    )
    ALL_SETTINGS = ALL_SETTINGS
    TOPICS: Mapping[str, Topic] = {
        "points": Topic(PointCloud2), "clipping": Topic(Bool), "range": Topic(Range),
        "range_list": Topic(Float32MultiArray), "temperature": Topic(Temperature),
        "dsp_temperature": Topic(Temperature), "rfe_temperature": Topic(Temperature),
        "digital_outputs": Topic(Float32MultiArray), "raw_signals": Topic(Float32MultiArray)}

    def __init__(self) -> None:
        """Declare the parameters; raises SettingError."""
        self._publishers_of: dict[str, dict[str, Any]] = {}
        super().__init__("isys_radar")

    # --- set-up ---

    def make_bus(self) -> RadarBus:
        """Return the bus, with a simulator behind it where that was asked for."""
        options = [self._sensor_options(sensor) for sensor in self.sensors]
        port: str = self.option("serial_port")
        if port.startswith(SIMULATED):
            from isys_radar_driver.simulator.line import simulated_line

            simulator, _ = simulated_line(
                [port.removeprefix(SIMULATED)],
                [option.address for option in options if option.address],
                baud_rate=self.option("serial_baud"))
            self.simulator = simulator
            port = simulator.start().port
        return RadarBus(port, self.option("serial_baud"), options, self)

    def _sensor_options(self, sensor: str) -> Options:
        model = self.option("model", sensor)
        options = Options(
            name=sensor, address=self.option("address", sensor),
            model=find_model(model) if model else None,
            wanted=self.wanted_settings(sensor), config_mode=self.option("config_mode"))
        self._set_live(options)
        return options

    def _set_live(self, options: Options) -> None:
        """Hand over the options that may change at run time."""
        name = options.name
        options.output = self.option("output", name)
        options.resolution = RESOLUTIONS[self.option("target_list_resolution", name)]
        options.read_range_list = self.option("publish_range_list", name)
        options.read_digital_outputs = self.option("publish_digital_outputs", name)

    def check_option(self, name: str, value: Value) -> None:
        """Refuse a resolution that the connected model does not have."""
        for radar in self.bus.devices if self.bus is not None else ():
            if (name == self.prefix(radar.options.name) + "target_list_resolution"
                    and radar.model is not None):
                radar.model.resolutions_of(RESOLUTIONS[str(value)])

    def apply_options(self) -> None:
        """Hand live options to the bus."""
        if self.bus is not None:
            for radar in self.bus.devices:
                self._set_live(radar.options)

    def make_interfaces(self, sensor: str) -> None:
        """Create the topics of a sensor."""
        self._publishers_of[sensor] = {
            name: self.add_publisher(sensor, name) for name in ("points", "clipping")}

    def services_of(self, sensor: str) -> dict[str, Action]:
        """Return the services of a radar."""
        def save(command: Command[None]) -> Action:
            return lambda: self._save(self.device(sensor), command)

        return super().services_of(sensor) | {
            "preview_save": lambda: self._preview_save(self.device(sensor)),
            "save_sensor_settings": save(commands.SAVE_SENSOR_SETTINGS),
            "save_application_settings": save(commands.SAVE_APPLICATION_SETTINGS),
            "save_all_settings": save(commands.SAVE_ALL_SETTINGS),
            "restore_factory_settings":
                lambda: self._restore_factory_settings(self.device(sensor)),
            "set_default_temperature_thresholds":
                lambda: self._set_default_thresholds(self.device(sensor)),
            "change_address": lambda: self._change_address(self.device(sensor)),
            "read_raw_signals": lambda: self._read_raw_signals(self.device(sensor))}

    def add_device_interfaces(self, radar: Radar) -> None:
        """Create the topics that the radar's model can serve."""
        publishers = self._publishers_of[radar.options.name]
        for command, names in MODEL_TOPICS:
            if radar.model is not None and radar.model.supports(command):
                for name in names:
                    if name not in publishers:
                        publishers[name] = self.add_publisher(radar.options.name, name)

    # --- what the bus reports, in its thread ---

    def describe(self, radar: Radar) -> str:
        """Return identity and link."""
        return f"{radar.identity}, address {radar.address}, {self.bus.line.baud_rate} Bd"

    def on_found(self, radar: Radar) -> None:
        """Show the radar's settings as parameters; say once why there will be no points."""
        super().on_found(radar)
        assert radar.model is not None
        if not radar.model.has_target_lists and radar.connections == 1:
            self.on_note(radar, f"the {radar.model.name} does not hand out target lists over its "
                         "serial port, so there are no points; it can be configured here, and its "
                         "targets come from its other interfaces", warning=True)

    def on_target_list(self, radar: Radar, targets: TargetList, stamp: int) -> None:
        """Publish the targets as points; what the model does not measure is NaN, its angle 0."""
        sensor, model = radar.options.name, radar.known_model
        range_sign = 1.0 if model.measures_range else math.nan
        angle_sign = (POSITIVE_ANGLE[self.option("positive_angle", sensor)]
                      if model.measures_angle else 0.0)
        velocity_sign = (POSITIVE_VELOCITY[self.option("positive_velocity", sensor)]
                         if model.measures_velocity else math.nan)
        self._publish(radar, "points", to_point_cloud(
            [(range_sign * target.range, angle_sign * target.angle,
              velocity_sign * target.velocity, target.signal) for target in targets.targets],
            *self._frame_and_stamp(radar, stamp)))
        self._publish(radar, "clipping", Bool(data=targets.clipping))

    def on_range_list(self, radar: Radar, values: RangeList, targets: TargetList,
                      stamp: int) -> None:
        """Publish range, temperature and the rest; without a target the range list says 0 m."""
        sensor, where = radar.options.name, self._frame_and_stamp(radar, stamp)
        limits = 0.0, radar.known_model.range_max
        measured = values.range
        if not targets.targets:
            measured = math.nan if targets.clipping else math.inf  # REP-117: unknown, nothing seen
        distance = published_distance(measured, limits, self.option("no_echo_value", sensor),
                                      self.option("too_close_value", sensor))
        if distance is not None:
            self._publish(radar, "range", to_range(
                distance, limits, self.option("field_of_view", sensor), *where))
        self._publish(radar, "temperature", to_temperature(values.temperature, *where))
        self._publish(radar, "range_list", to_float32_multi_array(
            np.array(dataclasses.astuple(values), np.float32), [RANGE_LIST_LABEL]))
        radar.temperatures["sensor"] = values.temperature

    def on_digital_outputs(self, radar: Radar, values: tuple[int, ...], stamp: int) -> None:
        """Publish the outputs: 0 or 1, and m or m/s where an output is a PWM."""
        scaled = [value * PWM_STEP if radar.values.get(f"output{n}.mode") == "pwm" else value
                  for n, value in enumerate(values, 1)]
        self._publish(radar, "digital_outputs",
                      to_float32_multi_array(np.array(scaled, np.float32), ["output"]))

    def on_temperatures(self, radar: Radar, stamp: int) -> None:
        """Publish the board temperatures."""
        for name, celsius in radar.temperatures.items():
            self._publish(radar, f"{name}_temperature",
                          to_temperature(celsius, *self._frame_and_stamp(radar, stamp)))

    def _publish(self, radar: Radar, topic: str, message: Any) -> None:
        publisher = self._publishers_of[radar.options.name].get(topic)
        if publisher is not None:
            self.while_running(publisher.publish)(message)

    def _frame_and_stamp(self, radar: Radar, stamp: int) -> tuple[str, int]:
        sensor = radar.options.name
        offset: float = self.option("time_offset", sensor)
        return self.option("frame_id", sensor), stamp + round(offset * 1e9)

    # --- services, in the executor ---

    async def _save(self, radar: Radar, command: Command[None]) -> str:
        return str(await self.call(lambda: self._saved(radar, command)))

    def _saved(self, radar: Radar, command: Command[None]) -> str:
        """Save, and return what was saved; in the thread of the bus, which owns the values."""
        names = ", ".join(self.bus.maintenance.save(radar, command))
        assert radar.model is not None
        nothing = "saved" if radar.model.supports(command) else "nothing to save"
        saved = f"saved; changed before: {names}" if names else nothing
        return saved + self._not_savable(radar, command)

    async def _preview_save(self, radar: Radar) -> str:
        return str(await self.call(lambda: self._preview(radar)))

    def _preview(self, radar: Radar) -> str:
        """Return what saving all would change; in the thread of the bus."""
        command = commands.SAVE_ALL_SETTINGS
        stored = self.bus.maintenance.stored_values(radar)

        def text(name: str, value: Value) -> str:
            return radar.settings[name].text(value)

        lines = [f"{name}: {text(name, value)} → {text(name, radar.values[name])}"
                 for name, value in stored.items() if value != radar.values[name]]
        lines += [f"{name}: now {text(name, radar.values[name])}"
                  for name in self.bus.maintenance.unsaved(radar, command) if name not in stored]
        return ("saving would change " + ("; ".join(lines) if lines else "nothing that is known")
                + self._not_savable(radar, command))

    def _not_savable(self, radar: Radar, command: Command[None]) -> str:
        names = ", ".join(self.bus.maintenance.unsaved(radar, command, possible=False))
        product = radar.product
        return f"; the {product} cannot store {names}: lost at power-off" if names else ""

    async def _restore_factory_settings(self, radar: Radar) -> str:
        await self.call(lambda: self.bus.maintenance.restore_factory_settings(radar))
        return "factory settings restored, in RAM and EEPROM"

    async def _set_default_thresholds(self, radar: Radar) -> str:
        thresholds = await self.call(lambda: self.bus.maintenance.set_default_thresholds(radar))
        return "temperature thresholds are " + ", ".join(f"{value:g} °C" for value in thresholds)

    async def _change_address(self, radar: Radar) -> str:
        maintenance = self.bus.maintenance
        return await self.give_address(
            radar.options.name, lambda address: maintenance.change_address(radar, address))

    async def _read_raw_signals(self, radar: Radar) -> str:
        raw = await self.call(lambda: self.bus.maintenance.read_raw_signals(radar))
        self._publish(radar, "raw_signals", to_float32_multi_array(
            raw.samples, ["signal", f"sample, {raw.sample_time:g} s apart"]))
        signals, samples = raw.samples.shape
        return (f"published {signals} signals of {samples} samples ({raw.samples.dtype}), "
                f"{raw.sample_time * 1e6:g} µs apart")

    # --- diagnostics ---

    def status_of(self, radar: Radar) -> DiagnosticStatus:
        """Return identity, link, rate, errors, temperatures and differing settings."""
        identity, counts = radar.identity, radar.statistics
        line = self.bus.line
        values: dict[str, object] = {"port": line.port, "baud rate": line.baud_rate,
                                     "address": radar.address}
        if identity is not None:
            values |= {
                "model": identity.model.name, "serial number": identity.serial_number,
                "device name": identity.device_name, "firmware": identity.firmware,
                "DSP hardware": identity.dsp_hardware, "RFE hardware": identity.rfe_hardware,
                "bootloader": identity.bootloader, "cycle time [s]": radar.cycle_time,
                "rate [Hz]": radar.rate}
        values |= {
            "target lists": counts.target_lists, "lost cycles": counts.lost_cycles,
            "cycles left to others": counts.shared_cycles,
            "clippings": counts.clippings, "implausible lists": counts.implausible_lists,
            "damaged replies": counts.damaged_replies, "time-outs": counts.timeouts,
            "refusals": counts.refusals, "connections": radar.connections,
            "damaged frames": line.parser.damaged_frames,
            "dropped bytes": line.parser.dropped_bytes,
            "stale frames": line.stale_frames,
            "unsaved settings": ", ".join(sorted(radar.unsaved))}
        if radar.cycles is not None:
            values["regular cycles"] = radar.cycles.is_regular
            values |= diagnostics.clock_values(radar.cycles.clock, radar.cycles.breaks)
        values |= {f"{name} temperature [°C]": celsius
                   for name, celsius in radar.temperatures.items()}
        values |= radar.differences
        hardware_id = f"{identity.model.name} {identity.serial_number}" if identity else ""
        return diagnostics.to_status(self.status_name(radar.options.name), hardware_id,
                                     *self._health(radar), values)

    def _health(self, radar: Radar) -> tuple[bytes, str]:
        """Return level and message of the diagnostics."""
        model = radar.model
        if model is None:
            return diagnostics.ERROR, str(radar.error or "searching")
        if radar.misses:
            return diagnostics.WARN, "does not answer"
        if radar.error is not None:
            return diagnostics.WARN, str(radar.error)
        if radar.differing:
            return diagnostics.WARN, f"{len(radar.differing)} settings are not as wanted"
        if not radar.measuring:
            return diagnostics.OK, "connected, acquisition stopped"
        if not model.has_target_lists:
            return diagnostics.OK, "connected; this model sends no target lists over serial"
        if radar.is_overloaded:
            return diagnostics.WARN, "receiver overloaded, no targets"
        return self._health_of_rate(radar)

    def _health_of_rate(self, radar: Radar) -> tuple[bytes, str]:
        message = f"{radar.rate:.1f} target lists per second"
        expected = 1 / radar.cycle_time
        if len(radar.arrivals) < 3 or radar.rate >= 0.9 * expected:
            return diagnostics.OK, message
        if len(self.bus.devices) > 1 and radar.rate >= 0.9 * self.bus.acquisition.least_rate(radar):
            return diagnostics.OK, f"{message}, shared line ({expected:.1f} alone)"
        return diagnostics.WARN, f"{message} instead of {expected:.1f}"


def main(args: Sequence[str] | None = None) -> None:
    """Run the node."""
    sys.exit(run(IsysRadarNode, args))
