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
is visited depth first. `start` returns the nodes that a launch file would start, `launch` all that
it does: nodes, processes, the transitions that it asks for, and what it does when one is told.
"""

import runpy
import shlex
import subprocess
import sys
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).resolve().parent.parent.parent


class Context:
    def __init__(self, arguments):
        self.launch_configurations = dict(arguments)
        self.stack = []
        self.nodes = []
        self.commands = []
        self.requests = []
        self.handlers = []

    def perform(self, what):
        if isinstance(what, list):
            return "".join(map(self.perform, what))
        return what.perform(self) if hasattr(what, "perform") else what

    def visit(self, *entities):
        waiting = list(reversed(entities))
        while waiting:
            waiting += reversed(list(waiting.pop().visit(self) or ()))

    def tell(self, node, start_state, goal_state):
        """Handle the transition of a node, as told by its transition_event."""
        for handler in self.handlers:
            wanted = handler.options
            if (wanted["target_lifecycle_node"] is node and wanted["start_state"] == start_state
                    and wanted["goal_state"] == goal_state):
                self.visit(*wanted["entities"])


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
        if name not in context.launch_configurations:  # without a default it must be given
            context.launch_configurations[name] = context.perform(self.options["default_value"])
        value = context.launch_configurations[name]
        assert value in self.options.get("choices", [value])
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
                values |= {name: context.perform(value) for name, value in each.items()}
            else:
                files.append(Path(context.perform(each)).name)
        name, namespace = (context.perform(self.options.get(key)) for key in ("name", "namespace"))
        context.nodes.append((self.options["executable"], name, namespace, files, values))
        return ()


class LifecycleNode(Node):
    """Listens for what it is asked before it starts, so it must be visited before the request."""

    def visit(self, context):
        context.lifecycle_node = self
        return super().visit(context)


class RegisterEventHandler(Entity):
    def visit(self, context):
        context.handlers += self.arguments
        return ()


class EmitEvent(Entity):
    """The event is a ChangeState; the node that it is for must be there."""

    def visit(self, context):
        event = self.options["event"].options
        assert event["lifecycle_node_matcher"](context.lifecycle_node)
        context.requests.append(event["transition_id"])
        return ()


def matches_action(node):
    return lambda action: action is node


class ExecuteProcess(Entity):
    def visit(self, context):
        context.commands.append([context.perform(word) for word in self.options["cmd"]])
        return ()


class ParameterValue(Entity):
    def perform(self, context):
        value = context.perform(self.arguments[0])
        assert isinstance(value, self.options["value_type"])
        return value


class Command(Entity):
    def perform(self, context):
        return subprocess.check_output(shlex.split(context.perform(self.arguments[0])), text=True)


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
        DeclareLaunchArgument, EmitEvent, ExecuteProcess, GroupAction, IncludeLaunchDescription,
        OpaqueFunction, PopLaunchConfigurations, PushLaunchConfigurations, RegisterEventHandler)},
    "launch.events": {"matches_action": matches_action},
    "launch.launch_description_sources": {"PythonLaunchDescriptionSource": Entity},
    "launch.substitutions": {"Command": Command, "LaunchConfiguration": LaunchConfiguration,
                             "PathJoinSubstitution": PathJoinSubstitution},
    "launch_ros": {}, "launch_ros.actions": {"LifecycleNode": LifecycleNode, "Node": Node},
    "launch_ros.event_handlers": {"OnStateTransition": Entity},
    "launch_ros.events": {}, "launch_ros.events.lifecycle": {"ChangeState": Entity},
    "launch_ros.parameter_descriptions": {"ParameterValue": ParameterValue},
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


def launch(*entities, **arguments):
    """Return the context in which the entities were visited."""
    context = Context(arguments)
    context.visit(*entities)
    return context


def start(*entities, **arguments):
    """Return executable, name, namespace, parameter files and parameters of each node."""
    return launch(*entities, **arguments).nodes
