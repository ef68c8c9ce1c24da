# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Record all topics of the drivers and lose nothing.

What is recorded is what the file of QoS profiles names; `record_qos` writes it for other nodes.
"""

from pathlib import Path

import yaml
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction
from launch.substitutions import LaunchConfiguration

from industrial_sensor_drivers.launch_file import shared

CACHE = 256 * 1024 * 1024  # bytes: more than half a minute of all drivers, for a disk that is busy
TIME_TO_WRITE = "60"  # s, for what is in there at the end


def record(context):
    """Return the recorder."""
    qos_file, topics, output = (LaunchConfiguration(name).perform(context)
                                for name in ("qos_file", "topics", "output"))
    names = topics.split() or list(yaml.safe_load(Path(qos_file).read_text(encoding="utf-8")))
    return [ExecuteProcess(
        cmd=["ros2", "bag", "record", "--storage", "mcap", "--max-cache-size", str(CACHE),
             "--qos-profile-overrides-path", qos_file, *(["--output", output] if output else []),
             "--topics", *names],
        output="screen", sigterm_timeout=TIME_TO_WRITE, sigkill_timeout=TIME_TO_WRITE)]


def generate_launch_description():
    """Describe the recorder and its arguments."""
    return LaunchDescription([
        DeclareLaunchArgument("output", default_value="",
                              description="New directory for the bag; empty = named by the time."),
        DeclareLaunchArgument("topics", default_value="",
                              description="With spaces between; empty = those of qos_file."),
        DeclareLaunchArgument("qos_file", default_value=shared("config", "record_qos.yaml"),
                              description="QoS profiles of the topics, made by record_qos."),
        OpaqueFunction(function=record),
    ])
