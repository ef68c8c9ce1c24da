# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""ROS 2 node of the UC4000: parameters, topics, services and diagnostics around a Uc4000Bus."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from math import pi
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from sensor_msgs.msg import Range, Temperature

from driver_common import diagnostics
from driver_common.device_node import FRAME_ID, TIME_OFFSET, Action, DeviceNode, Topic, run
from driver_common.settings import Option
from msg_conversions.range import (
    NO_ECHO_VALUES,
    TOO_CLOSE_VALUES,
    published_distance,
    to_range,
)
from msg_conversions.temperature import to_temperature
from uc4000_driver.acquisition import OPERATING_TEMPERATURE
from uc4000_driver.commands import MAX_CYCLES, PROFILES, Outcome
from uc4000_driver.line import ECHO_CHOICES
from uc4000_driver.listener import Listener
from uc4000_driver.sensor import FIELD_OF_VIEW, Measurement, Options, Sensor
from uc4000_driver.session import Uc4000Bus
from uc4000_driver.settings import ALL_SETTINGS
from uc4000_driver.telegram import BAUD_RATE, LAST_ADDRESS, error_text

SIMULATED = "sim://"


def _words(*words: str) -> dict[str, int]:
    return {word: index for index, word in enumerate(words)}


class Uc4000Node(DeviceNode, Listener):
    """Driver of one or several UC4000 sensors on a wire."""

    BUS_OPTIONS = (
        Option("serial_port", kind=str, default="",
               description="Device path, pyserial URL such as socket://host:port, sim://UC4000, or "
                           "replay://FILE"),
        Option("local_echo", kind=str, choices=_words(*ECHO_CHOICES), default="auto", live=True,
               description="Whether the line returns what is sent, as a single LIN wire does; "
                           "auto = find out"),
        Option("groups", kind=list, default=[],
               description='Sensors that do not hear each other and may measure at the same time, '
                           'as in ["left right", "front rear"]; sensors in no group measure alone'),
    )
    SENSOR_OPTIONS = (
        Option("address", kind=int, default=0, minimum=0, maximum=LAST_ADDRESS,
               description="Address on the wire; 0 = ask (only one sensor may be connected)"),
        FRAME_ID,
        Option("profile", kind=str, choices=_words(*PROFILES), default="b", live=True,
               description="Measurement profile: a = short range up to 3.5 m, b = middle, c = far, "
                           "user = by burst_periods, gain_db and current_ma"),
        Option("cycles", kind=int, default=1, minimum=1, maximum=MAX_CYCLES, live=True,
               description="Cycles of 50 ms whose average is one measurement"),
        Option("rate", kind=float, default=0.0, minimum=0.0, maximum=20.0, unit="Hz", live=True,
               description="Measurements per second; 0 = as many as the cycles allow"),
        Option("field_of_view", kind=float, default=FIELD_OF_VIEW, minimum=0.0, maximum=pi,
               unit="rad", live=True,
               description="Opening angle of the sound cone; the manual gives no number"),
        Option("no_echo_value", kind=str, choices=_words(*NO_ECHO_VALUES), default="inf",
               live=True, description="What is published where there is no echo, or one from "
                                      "beyond the range; skip = nothing"),
        Option("too_close_value", kind=str, choices=_words(*TOO_CLOSE_VALUES), default="-inf",
               live=True, description="What is published for an echo from the blind zone; "
                                      "skip = nothing"),
        TIME_OFFSET,
        Option("temperature_period", kind=float, default=10.0, minimum=0.0, unit="s", live=True,
               description="Time between two readings of the temperature; 0 = none"),
        Option("new_address", kind=int, default=0, minimum=0, maximum=LAST_ADDRESS, live=True,
               description="Address that the service ~/change_address gives the sensor"),
    )
    ALL_SETTINGS = ALL_SETTINGS
    TOPICS: Mapping[str, Topic] = {"range": Topic(Range), "temperature": Topic(Temperature)}

    def __init__(self) -> None:
        """Declare the parameters; raises SettingError."""
        self._publishers_of: dict[str, dict[str, Any]] = {}
        super().__init__("uc4000")

    # --- set-up ---

    def make_bus(self) -> Uc4000Bus:
        """Return the bus, with a simulator behind it where that was asked for."""
        options = [self._sensor_options(sensor) for sensor in self.sensors]
        port: str = self.option("serial_port")
        if port.startswith(SIMULATED):
            from uc4000_driver.simulator.line import simulated_line

            simulator, _ = simulated_line(
                [option.address for option in options if option.address],
                product=port.removeprefix(SIMULATED))
            simulator.faults.echo = self.option("local_echo") == "on"
            self.simulator = simulator
            port = simulator.start().port
        return Uc4000Bus(port, options, self, local_echo=self.option("local_echo"),
                         groups=self.option("groups"))

    def _sensor_options(self, sensor: str) -> Options:
        options = Options(
            name=sensor, address=self.option("address", sensor),
            wanted=self.wanted_settings(sensor), config_mode=self.option("config_mode"))
        self._set_live(options)
        return options

    def _set_live(self, options: Options) -> None:
        """Hand over the options that may change at run time."""
        options.profile = self.option("profile", options.name)
        options.cycles = self.option("cycles", options.name)
        options.rate = self.option("rate", options.name)
        options.temperature_period = self.option("temperature_period", options.name)

    def apply_options(self) -> None:
        """Hand live options to the bus; they count from the next measurement on."""
        if self.bus is not None and self.thread is not None:
            self.thread.post(partial(self._apply_options, self.bus))

    def _apply_options(self, bus: Uc4000Bus) -> None:
        bus.line.local_echo = self.option("local_echo")
        for sensor in bus.devices:
            before = replace(sensor.options)
            self._set_live(sensor.options)
            if sensor.is_connected and sensor.options != before:
                sensor.due = sensor.temperature_due = 0.0  # not after the period of before

    def make_interfaces(self, sensor: str) -> None:
        """Create the topics of a sensor."""
        self._publishers_of[sensor] = {
            "range": self.add_publisher(sensor, "range"),
            "temperature": self.add_publisher(sensor, "temperature")}

    def services_of(self, sensor: str) -> dict[str, Action]:
        """Return the services of a sensor."""
        return super().services_of(sensor) | {
            "identify": lambda: self._identify(self.device(sensor)),
            "change_address": lambda: self._change_address(self.device(sensor))}

    # --- what the bus reports, in its thread ---

    def describe(self, sensor: Sensor) -> str:
        """Return identity and address."""
        return f"{sensor.identity}, address {sensor.address}"

    def on_measurement(self, sensor: Sensor, measurement: Measurement) -> None:
        """Publish the distance."""
        name, limits = sensor.options.name, measurement.profile.limits
        distance = published_distance(
            measurement.distance.value, limits, self.option("no_echo_value", name),
            self.option("too_close_value", name))
        if distance is not None:
            self._publish(sensor, "range", to_range(
                distance, limits, self.option("field_of_view", name),
                *self._frame_and_stamp(sensor, measurement.stamp)))

    def on_temperature(self, sensor: Sensor, celsius: float, stamp: int) -> None:
        """Publish the temperature."""
        self._publish(sensor, "temperature", to_temperature(
            celsius, *self._frame_and_stamp(sensor, stamp)))

    def _publish(self, sensor: Sensor, topic: str, message: Any) -> None:
        self.while_running(self._publishers_of[sensor.options.name][topic].publish)(message)

    def _frame_and_stamp(self, sensor: Sensor, stamp: int) -> tuple[str, int]:
        name = sensor.options.name
        offset: float = self.option("time_offset", name)
        return self.option("frame_id", name), stamp + round(offset * 1e9)

    # --- services, in the executor ---

    async def _identify(self, sensor: Sensor) -> str:
        await self.call(lambda: self.bus.maintenance.identify(sensor))
        return self.describe(sensor)

    async def _change_address(self, sensor: Sensor) -> str:
        return await self.give_address(
            sensor.options.name, partial(self.bus.maintenance.change_address, sensor))

    # --- diagnostics ---

    def status_of(self, sensor: Sensor) -> DiagnosticStatus:
        """Return identity, link, rate, errors, temperature and differing settings."""
        identity, counts, line = sensor.identity, sensor.statistics, self.bus.line
        values: dict[str, object] = {"port": line.port, "baud rate": BAUD_RATE,
                                     "address": sensor.address}
        if identity is not None:
            values |= {"version": identity.version, "serial number": identity.serial_number,
                       "profile": sensor.options.profile, "rate [Hz]": sensor.rate}
        if sensor.temperature is not None:
            values["temperature [°C]"] = sensor.temperature
        values |= {
            "measurements": counts.outcomes.total(), **{
                f"measurements: {outcome.value}": counts.outcomes[outcome] for outcome in Outcome},
            "time-outs": counts.timeouts, "checksum errors": counts.damaged,
            "damaged requests": counts.damaged_requests,
            **{f"refusals: {error_text(code)}": count
               for code, count in sorted(counts.refusals.items())},
            "refusals": counts.refusals.total(), "connections": sensor.connections,
            "stray bytes": line.stray_bytes,
            "local echo": {None: "unknown", True: "on", False: "off"}[line.echo]}
        group = self.bus.acquisition.group_of(sensor)
        if group is not None:
            values |= {"measurements of its group": group.sets,
                       "failed measurements of its group": group.failures,
                       "failed lately [%]": 100 * group.failing}
        values |= sensor.differences
        hardware_id = f"{sensor.product} {identity.serial_number}" if identity else ""
        return diagnostics.to_status(self.status_name(sensor.options.name), hardware_id,
                                     *self._health(sensor), values)

    def _health(self, sensor: Sensor) -> tuple[bytes, str]:
        """Return level and message of the diagnostics."""
        if sensor.identity is None:
            return diagnostics.ERROR, str(sensor.error or "searching")
        if sensor.error is not None:
            return diagnostics.WARN, str(sensor.error)
        if sensor.misses:
            return diagnostics.WARN, "does not answer"
        if sensor.differing:
            return diagnostics.WARN, f"{len(sensor.differing)} settings are not as wanted"
        low, high = OPERATING_TEMPERATURE
        if sensor.temperature is not None and not low <= sensor.temperature <= high:
            return diagnostics.WARN, (f"{sensor.temperature:g} °C is outside of the operating "
                                      f"range {low} … {high} °C")
        if not self.bus.wants(sensor):
            return diagnostics.OK, "connected, acquisition stopped"
        group = self.bus.acquisition.group_of(sensor)
        if group is not None and group.is_failing:
            alone = ", so they measure one by one" if group.is_paused else ""
            return diagnostics.WARN, (f"{group.failing:.0%} of the measurements together with its "
                                      f"group fail{alone}")
        message = f"{sensor.rate:.1f} measurements per second"
        if len(sensor.arrivals) > 2 and sensor.rate < 0.9 * sensor.options.rate:
            return diagnostics.WARN, f"{message} instead of {sensor.options.rate:g}"
        return diagnostics.OK, message


def main(args: Sequence[str] | None = None) -> None:
    """Run the node."""
    sys.exit(run(Uc4000Node, args))
