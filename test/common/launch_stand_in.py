# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the launch files use of launch and launch_ros, for machines that have neither.

Configurations are kept as launch keeps them: an argument that is declared again keeps its value,
an included file works on those of its includer, Push and Pop save and restore them. What is visited
is visited depth first. `start` returns the nodes that a launch file would start.
"""

import runpy
import sys
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).resolve().parent.parent.parent


class Context:
    def __init__(self, arguments):
        self.launch_configurations = dict(arguments)
        self.stack = []
        self.nodes = []

    def perform(self, what):
        return what.perform(self) if hasattr(what, "perform") else what


class Entity:
    """Anything with arguments; what happens when it is visited is in a subclass."""

    def __init__(self, *arguments, **options):
        self.arguments, self.options = arguments, options

    def visit(self, context):
        return ()


class LaunchDescription(Entity):
    def visit(self, context):
        return self.arguments[0]


class GroupAction(Entity):
    def visit(self, context):
        return [PushLaunchConfigurations(), *self.arguments[0], PopLaunchConfigurations()]


class PushLaunchConfigurations(Entity):
    def visit(self, context):
        context.stack.append(dict(context.launch_configurations))
        return ()


class PopLaunchConfigurations(Entity):
    def visit(self, context):
        context.launch_configurations = context.stack.pop()
        return ()


class DeclareLaunchArgument(Entity):
    def visit(self, context):
        name, = self.arguments
        default = context.perform(self.options["default_value"])
        context.launch_configurations.setdefault(name, default)
        return ()


class IncludeLaunchDescription(Entity):
    def visit(self, context):
        source, = self.arguments
        for name, value in self.options.get("launch_arguments", ()):
            context.launch_configurations[name] = context.perform(value)
        path = context.perform(source.arguments[0])
        return [runpy.run_path(path)["generate_launch_description"]()]


class OpaqueFunction(Entity):
    def visit(self, context):
        return self.options["function"](context)


class Node(Entity):
    def visit(self, context):
        files, values = [], {}
        for each in self.options["parameters"]:
            if isinstance(each, dict):
                values |= {name: value.arguments[0] for name, value in each.items()}
            else:
                files.append(Path(context.perform(each)).name)
        context.nodes.append((self.options["executable"], context.perform(self.options["name"]),
                              context.perform(self.options["namespace"]), files, values))
        return ()


class LaunchConfiguration(Entity):
    def perform(self, context):
        return context.launch_configurations[self.arguments[0]]


class FindPackageShare(Entity):
    def perform(self, context):
        return str(ROOT)


class PathJoinSubstitution(Entity):
    def perform(self, context):
        return str(Path(*map(context.perform, self.arguments[0])))


MODULES = {
    "launch": {"LaunchContext": Context, "LaunchDescription": LaunchDescription},
    "launch.actions": {kind.__name__: kind for kind in (
        DeclareLaunchArgument, GroupAction, IncludeLaunchDescription, OpaqueFunction,
        PopLaunchConfigurations, PushLaunchConfigurations)},
    "launch.launch_description_sources": {"PythonLaunchDescriptionSource": Entity},
    "launch.substitutions": {"LaunchConfiguration": LaunchConfiguration,
                             "PathJoinSubstitution": PathJoinSubstitution},
    "launch_ros": {}, "launch_ros.actions": {"Node": Node},
    "launch_ros.parameter_descriptions": {"ParameterValue": Entity},
    "launch_ros.substitutions": {"FindPackageShare": FindPackageShare}}


def install(monkeypatch):
    """Have imports of launch find this, until the test ends."""
    for name, content in MODULES.items():
        module = ModuleType(name)
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, name, module)
    # Imported anew, and forgotten at the end.
    name = "industrial_sensor_drivers.launch_file"
    monkeypatch.setitem(sys.modules, name, ModuleType("launch_file"))
    del sys.modules[name]


def start(*entities, **arguments):
    """Return executable, name, namespace, parameter files and parameters of each node."""
    context = Context(arguments)
    waiting = list(reversed(entities))
    while waiting:
        waiting += reversed(list(waiting.pop().visit(context) or ()))
    return context.nodes
