# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Rows as ROS parameters: descriptors, overrides, and sets that reach the device."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterable, Mapping
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter

from driver_common.errors import DriverError, SettingError
from driver_common.settings import Parameter, Setting, Value, suggestion

SetTogether = Callable[[list[RosParameter]], Awaitable[SetParametersResult]]

_TYPES = {bool: RosParameter.Type.BOOL, int: RosParameter.Type.INTEGER,
          float: RosParameter.Type.DOUBLE, str: RosParameter.Type.STRING,
          list: RosParameter.Type.STRING_ARRAY}


def to_parameter(name: str, row: Parameter, value: Value) -> RosParameter:
    """Return a ROS parameter of the row's type."""
    return RosParameter(name, _type_of(row), value)


def _type_of(row: Parameter) -> RosParameter.Type:
    return RosParameter.Type.DOUBLE_ARRAY if row.is_pair else _TYPES[row.kind]


def to_descriptor(row: Parameter, value: Value) -> ParameterDescriptor:
    """Return the descriptor of a row; its range includes `value`, whatever the device reports."""
    details = [row.description]
    if isinstance(row, Setting) and row.section:
        details.append(f"manual {row.section}")
    if row.unit:
        details.append(f"unit {row.unit}")
    descriptor = ParameterDescriptor(description="; ".join(details), read_only=row.read_only)
    if row.choices is not None:
        descriptor.additional_constraints = "one of " + ", ".join(row.choices)
    elif isinstance(row, Setting) and row.values:
        descriptor.additional_constraints = "one of " + ", ".join(f"{step:g}"
                                                                  for step in row.values)
    elif isinstance(row, Setting) and row.kind is float and row.factor != 1:
        descriptor.additional_constraints = f"rounded to steps of {row.factor:g} {row.unit}"
    low, high = row.limits
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return descriptor
    if low is not None and high is not None:
        low, high = min(low, value), max(high, value)
        if row.kind is int:
            descriptor.integer_range = [IntegerRange(from_value=int(low), to_value=int(high),
                                                     step=1)]
        else:
            descriptor.floating_point_range = [FloatingPointRange(
                from_value=float(low), to_value=float(high), step=0.0)]
    return descriptor


class ParameterStore:
    """The parameters of a node: their rows, and the values that the user asked for.

    Attributes:
        overrides: What the user gave on the command line or in a YAML file, by name.
        rows: The declared rows by full parameter name.
    """

    def __init__(self, node: Node) -> None:
        """Take the overrides."""
        self._node = node
        self.rows: dict[str, Parameter] = {}
        self.overrides: dict[str, Any] = {}
        # Not declared by rclpy itself, which fails on an empty list as in "sensors: []".
        for name, parameter in node._parameter_overrides.items():
            if parameter.value is not None and not name.startswith(
                    ("qos_overrides.", "use_sim_time", "start_type_description")):
                self.overrides[name] = parameter.value

    def declare(self, name: str, row: Parameter, value: Value) -> None:
        """Declare a parameter, or set the value of one that is declared already."""
        if name in self.rows:
            if self.rows[name].kind is row.kind:
                self.rows[name] = row
                self.store({name: value})
                return
            self.undeclare([name])
        # By type first: rclpy takes an empty list for one of bytes.
        self._node.declare_parameter(name, _type_of(row), to_descriptor(row, value),
                                     ignore_override=True)
        self.rows[name] = row
        self.store({name: value})

    def undeclare(self, names: Iterable[str]) -> None:
        """Take parameters away."""
        for name in list(names):
            self._node.describe_parameter(name).read_only = False
            self._node.undeclare_parameter(name)
            del self.rows[name]

    def store(self, values: Mapping[str, Value]) -> SetParametersResult:
        """Set values as they are, also of read-only parameters; nothing is sent to a device."""
        for name, value in values.items():
            row = self.rows[name]
            wider = to_descriptor(row, value)
            descriptor = self._node.describe_parameter(name)
            descriptor.read_only = False
            descriptor.floating_point_range = wider.floating_point_range
            descriptor.integer_range = wider.integer_range
        result = Node.set_parameters_atomically(self._node, [
            to_parameter(name, self.rows[name], value) for name, value in values.items()])
        for name in values:
            self._node.describe_parameter(name).read_only = self.rows[name].read_only
        return result

    def check(self, parameters: Iterable[RosParameter]) -> dict[str, Value]:
        """Return the values that a set would give, without those that change nothing.

        So what was read from a node can be given back to it as a whole, with all that can be read
        only and all that the device did not tell.

        Raises:
            SettingError: A name is not known, or a value is not acceptable.
        """
        values = {}
        for parameter in parameters:
            name = parameter.name
            row = self.rows.get(name)
            if row is None:
                raise SettingError(f"{name} is not a parameter of this node"
                                   f"{suggestion(name, self.rows)}")
            present = self._node.get_parameter(name).value
            try:
                if row.read_only:
                    raise SettingError(f"{name} can be read only")
                values[name] = row.check(parameter.value)
            except SettingError:
                if not row.is_same(parameter.value, present):
                    raise
        return values

    def is_so_already(self, parameter: RosParameter) -> bool:
        """Whether a parameter of ROS that can be read only has this value."""
        name = parameter.name
        return bool(self._node.describe_parameter(name).read_only
                    and self._node.get_parameter(name).value == parameter.value)

    def unknown_overrides(self, prefix: str, known: Iterable[str], owner: str) -> list[str]:
        """Return a line for each override that begins with `prefix` and is not in `known`."""
        names = [prefix + name for name in known]
        return [f"parameter {name}: {owner} has no such parameter{suggestion(name, names)}"
                for name in self.overrides if name.startswith(prefix) and name not in names]


def answer_sets(node: Node, set_together: SetTogether) -> None:
    """Have the services of a node set parameters with `set_together`, which may take its time.

    The executor serves others meanwhile. Values of a type that ROS has not are refused; rclpy ends
    the node.
    """
    async def set_atomically(parameters: Iterable[ParameterMessage]) -> SetParametersResult:
        fault = next(filter(None, map(_unknown_type, parameters)), None)
        if fault is not None:
            return refusal(fault)
        return await set_together([RosParameter.from_parameter_msg(parameter)
                                   for parameter in parameters])

    async def set_each(request: SetParameters.Request,
                       response: SetParameters.Response) -> SetParameters.Response:
        for parameter in request.parameters:
            response.results.append(await set_atomically([parameter]))
        return response

    async def set_all(request: SetParametersAtomically.Request,
                      response: SetParametersAtomically.Response
                      ) -> SetParametersAtomically.Response:
        response.result = await set_atomically(request.parameters)
        return response

    handlers = {SetParameters: set_each, SetParametersAtomically: set_all}
    group = ReentrantCallbackGroup()
    for service in node.services:
        if service.srv_type in handlers:
            service.callback = handlers[service.srv_type]
            service.callback_group = group
            group.add_entity(service)


def _unknown_type(parameter: ParameterMessage) -> SettingError | None:
    try:
        RosParameter.Type(parameter.value.type)
    except ValueError:
        return SettingError(f"{parameter.name} has a value of type {parameter.value.type}, which "
                            "ROS does not have")
    return None


def refusal(error: DriverError) -> SetParametersResult:
    """Return the result of a set that failed."""
    return SetParametersResult(successful=False, reason=str(error))
