# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A node whose parameters are its own options and the settings of the devices on its bus."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Coroutine, Iterator, Mapping, Sequence
from typing import Any, TypeVar, cast

from rcl_interfaces.msg import SetParametersResult
from rclpy.lifecycle import LifecycleNode
from rclpy.parameter import Parameter as RosParameter

from driver_common.device_thread import Answer
from driver_common.errors import DriverError, SettingError
from driver_common.parameters import ParameterStore, answer_sets, refusal
from driver_common.recording import read_recording
from driver_common.replay import recording_path
from driver_common.settings import Option, Setting, Value

T = TypeVar("T")

SENSOR_NAME = re.compile("[a-z][a-z0-9_]*")
SENSORS = Option(
    "sensors", kind=list, default=[], read_only=True,
    description="Names of the sensors on the bus, given at the start; empty = a single one "
                "without a name")


class ParameterNode(LifecycleNode):
    """A lifecycle node with parameters that reach devices.

    Subclasses give the rows, and reach the devices.

    Attributes:
        store: The parameters.
        bus: The session; None while the node is not configured.
    """

    SEVERAL_SENSORS = True  # whether the bus can have more than one
    COMMON_OPTIONS: Sequence[Option] = ()
    BUS_OPTIONS: Sequence[Option] = ()
    SENSOR_OPTIONS: Sequence[Option] = ()
    ALL_SETTINGS: Mapping[str, Setting] = {}

    def __init__(self, name: str) -> None:
        """Declare the options.

        Raises:
            SettingError: One of them has an unacceptable value.
        """
        super().__init__(name)
        self.bus: Any = None
        self.store = ParameterStore(self)
        answer_sets(self, self.set_together)
        self._devices: dict[str, Any] = {}  # by the names of the parameters that are its settings
        self._take_recorded_parameters()
        self._declare_options()

    # --- what a subclass provides ---

    async def call(self, job: Callable[[], Any]) -> Any:
        """Run a job in the thread of the bus; raises DriverError."""
        raise NotImplementedError

    def unreachable(self) -> str:
        """Return why no device can be reached, "" where one may be."""
        raise NotImplementedError

    def add_device_interfaces(self, device: Any) -> None:
        """Create the publishers that depend on what the device is."""

    def check_option(self, name: str, value: Value) -> None:
        """Refuse a live option that the devices cannot carry out; raises SettingError."""

    def apply_options(self) -> None:
        """Hand live options to the bus after a change."""

    # --- options ---

    def _declare_options(self) -> None:
        for option in self.bus_options():
            self._declare_option("", option)
        self._check_sensor_names()
        for sensor in self.sensors:
            for option in self.SENSOR_OPTIONS:
                self._declare_option(self.prefix(sensor), option)
        self._warn_of_unknown_overrides()
        if self.get_parameter("use_sim_time").value:
            self.get_logger().warning("use_sim_time has no effect: stamps are this host's time of "
                                      "the measurement")

    @classmethod
    def bus_options(cls) -> list[Option]:
        """Return the options that do not belong to one sensor."""
        return [*([SENSORS] if cls.SEVERAL_SENSORS else []), *cls.COMMON_OPTIONS, *cls.BUS_OPTIONS]

    def _take_recorded_parameters(self) -> None:
        """Where a recording is to be played: use its parameters, if the user gave no others."""
        path = recording_path(self.store.overrides)
        if path is not None:
            recorded = read_recording(path, head=True).parameters
            self.store.overrides = {**recorded, **self.store.overrides}

    def _check_sensor_names(self) -> None:
        reserved = {option.name for option in self.bus_options()}
        for sensor in self.sensors:
            if sensor and (not SENSOR_NAME.fullmatch(sensor) or sensor in reserved):
                raise SettingError(f'sensors: "{sensor}" cannot be a name, it must be a lower-case '
                                   "word such as front, and no parameter of the node")
        if len(set(self.sensors)) < len(self.sensors):
            raise SettingError("sensors: each name must be there once")

    def _declare_option(self, prefix: str, option: Option) -> None:
        name = prefix + option.name
        default = option.default
        if isinstance(default, str) and "{sensor}" in default:
            default = default.format(sensor=prefix.rstrip(".") or self.get_name())
        try:
            value = option.check(self.store.overrides.get(name, default))
        except SettingError as error:
            raise SettingError(f"{prefix}{error}") from None
        self.store.declare(name, option, value)

    def _warn_of_unknown_overrides(self) -> None:
        """Name overrides that no model of this driver could have."""
        known = [option.name for option in self.bus_options()]
        for sensor in self.sensors:
            known += [self.prefix(sensor) + name for name in (
                *(option.name for option in self.SENSOR_OPTIONS), *self.ALL_SETTINGS)]
        for line in self.store.unknown_overrides("", known, "this driver"):
            self.get_logger().warning(line)

    @property
    def sensors(self) -> list[str]:
        """Names of the sensors, [""] for a single one without a name."""
        names = self.option("sensors") if self.SEVERAL_SENSORS else []
        return list(names) or [""]

    @staticmethod
    def prefix(sensor: str) -> str:
        """Return the prefix of a sensor's parameters."""
        return f"{sensor}." if sensor else ""

    def option(self, name: str, sensor: str = "") -> Any:
        """Return the value of an option."""
        return self.get_parameter(self.prefix(sensor) + name).value

    def wanted_settings(self, sensor: str) -> dict[str, Value]:
        """Return the device settings that the user gave for a sensor."""
        prefix = self.prefix(sensor)
        return {name: self.store.overrides[prefix + name] for name in self.ALL_SETTINGS
                if prefix + name in self.store.overrides}

    def later(self, job: Callable[[], object]) -> None:
        """Run a job in the executor, where parameters may be touched."""
        def guarded() -> None:
            try:
                job()
            except DriverError as error:
                if self.bus is not None:
                    self.log_failure(str(error))
            except Exception as error:  # an exception here would end the node
                self.log_failure(f"internal error, please report it: {error!r}")

        if self.executor is not None:
            self.executor.create_task(guarded)

    def log_failure(self, text: str) -> None:
        """Log an error, but not what fails because the context was shut down meanwhile."""
        if self.context.ok():
            self.get_logger().error(text)

    # --- settings of the devices ---

    def show_settings(self, sensor: str, device: Any) -> None:
        """Declare a device's settings with the values that it reported; from any thread."""
        self.later(lambda: self._show_settings(sensor, device))

    def _show_settings(self, sensor: str, device: Any) -> None:
        if self.bus is None or device not in self.bus.devices:
            return
        # As they are now, because a set may have come since; the bus may be busy for long.
        settings, values = dict(device.settings), dict(device.values)
        if settings.keys() != values.keys():  # it is being read, and will be shown afterwards
            return
        prefix = self.prefix(sensor)
        gone = [name for name, owner in self._devices.items()
                if owner is device and name.removeprefix(prefix) not in settings]
        self.store.undeclare(gone)
        for name in gone:
            del self._devices[name]
        for name, setting in settings.items():
            self.store.declare(prefix + name, setting, values[name])
            self._devices[prefix + name] = device
        self.add_device_interfaces(device)
        lacking = [name for name in self.wanted_settings(sensor) if name not in settings]
        for name in lacking:
            self.get_logger().warning(f"parameter {prefix}{name}: the {device.product} has no such "
                                      "setting; it is ignored")

    def undeclare_settings(self) -> None:
        """Take away the parameters that are settings of devices."""
        self.store.undeclare(self._devices)
        self._devices.clear()

    # --- sets from outside ---

    def set_parameters_atomically(
            self, parameter_list: list[RosParameter]) -> SetParametersResult:
        """Set parameters, see `set_together`, and wait for it; not for callbacks."""
        return _finished(self.set_together(parameter_list))

    def set_parameters(self, parameter_list: list[RosParameter]) -> list[SetParametersResult]:
        """Set parameters one by one."""
        return [self.set_parameters_atomically([parameter]) for parameter in parameter_list]

    async def set_together(self, parameter_list: list[RosParameter]) -> SetParametersResult:
        """Set parameters, all or none; those of a device are written to it and read back."""
        own = [parameter for parameter in parameter_list
               if parameter.name in self.store.rows or not self.has_parameter(parameter.name)]
        if not own:
            return super().set_parameters_atomically([
                parameter for parameter in parameter_list
                if not self.store.is_so_already(parameter)])
        try:
            if len(own) < len(parameter_list):
                raise SettingError("set the parameters of ROS, such as use_sim_time, separately")
            for parameter in own:
                self._check_is_there(parameter.name)
            return self.store.store(await self._apply(self.store.check(own)))
        except DriverError as error:
            return refusal(error)
        except Exception as error:  # an exception here would end the node
            return refusal(DriverError(f"internal error, please report it: {error!r}"))

    async def _apply(self, values: Mapping[str, Value]) -> dict[str, Value]:
        """Write device settings among `values`; return all values as they are then."""
        by_device: dict[Any, dict[str, Value]] = {}
        for name, value in values.items():
            if name in self._devices:
                by_device.setdefault(self._devices[name], {})[name] = value
            else:
                self._check_may_change(name, value)
                self.check_option(name, value)
        result = dict(values)
        done: list[tuple[Any, dict[str, Value]]] = []
        try:
            for device, changes in by_device.items():
                before = {name: self.get_parameter(name).value for name in changes}
                result |= await self._write(device, changes)
                done.append((device, before))
        except DriverError:
            for device, before in reversed(done):
                await self._write(device, before)
            raise
        if len(result) > sum(map(len, by_device.values())):
            self.later(self.apply_options)
        return dict(self._present(result))

    async def _write(self, device: Any, changes: Mapping[str, Value]) -> dict[str, Value]:
        self.bus.require(device)  # now, and not when the bus had its next look for it
        prefix = self.prefix(device.options.name)
        reported = await self.call(lambda: self.bus.write(
            device, {name.removeprefix(prefix): value for name, value in changes.items()}))
        return {prefix + name: value for name, value in reported.items()}

    def _present(self, values: Mapping[str, Value]) -> Iterator[tuple[str, Value]]:
        """Yield what there is to be stored: other sets, or a clean-up, may have come meanwhile."""
        for name, value in values.items():
            device = self._devices.get(name)
            if device is not None:
                yield name, device.values[name.removeprefix(self.prefix(device.options.name))]
            elif name in self.store.rows:
                yield name, value

    def _check_is_there(self, name: str) -> None:
        """Say why a device's setting is no parameter now; raises SettingError."""
        for sensor in self.sensors:
            known = [self.prefix(sensor) + setting for setting in self.ALL_SETTINGS]
            if name in self.store.rows or name not in known:
                continue
            reason: object = self.unreachable()
            for device in self.bus.devices if self.bus is not None else ():
                if device.options.name == sensor and not reason:
                    reason = (f"the {device.product} has no such setting" if device.settings
                              else device.error or "still searching the device")
            raise SettingError(f"{name} cannot be set: {reason}")

    def _check_may_change(self, name: str, value: Value) -> None:
        option = self.store.rows[name]
        if (isinstance(option, Option) and not option.live and self.bus is not None
                and value != self.get_parameter(name).value):
            node = self.get_fully_qualified_name()
            raise SettingError(
                f"{name} cannot change while the node is configured; first run 'ros2 lifecycle "
                f"set {node} deactivate' and 'ros2 lifecycle set {node} cleanup'")


def _finished(coroutine: Coroutine[Answer[Any], None, T]) -> T:
    """Return the result of a coroutine, which awaits nothing but answers of a bus."""
    try:
        while True:
            with contextlib.suppress(Exception):  # which it raises once more, where it belongs
                coroutine.send(None).wait()
    except StopIteration as end:
        return cast(T, end.value)
