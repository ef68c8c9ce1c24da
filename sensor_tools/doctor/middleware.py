# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What can be wrong between ROS nodes: discovery, names, recorders. Needs rclpy."""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import rclpy
import yaml

from driver_common import advice
from sensor_tools.record_qos import NODES
from sensor_tools.search.result import Finding

SUBJECT = "ROS"
DISCOVERY_TIME = 2.0  # s in which all nodes are seen, as a rule
RANGE, ONLY_LOCAL = "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_LOCALHOST_ONLY"
RANGES = {"SUBNET": None, "SYSTEM_DEFAULT": None, "LOCALHOST": advice.DISCOVERY_LOCAL,
          "OFF": advice.DISCOVERY_OFF}
OWN_NAME = "_sensors_doctor"  # hidden from lists of nodes
OVERRIDES = "--qos-profile-overrides-path"
RECORDER_DEPTH = 10  # messages that a recorder keeps of a topic unless it is told otherwise
PROC = Path("/proc")


def examine() -> Iterator[Finding]:
    """Yield what is to be said about the domain in which this process is."""
    yield from examine_discovery(os.environ)
    names, topics = look_around()
    yield Finding(SUBJECT, "domain", f"domain {os.environ.get('ROS_DOMAIN_ID') or 0}: "
                                     f"{len(names)} nodes", is_wrong=False)
    for name, count in sorted(Counter(names).items()):
        if count > 1:
            yield Finding.of(SUBJECT, "names", advice.SAME_NAME, name=name, count=count)
    yield from examine_recorders(topics)


def examine_discovery(environment: Mapping[str, str]) -> Iterator[Finding]:
    """Yield what is to be said about the variables that limit discovery."""
    if environment.get(ONLY_LOCAL, "0") not in ("", "0"):
        yield Finding.of(SUBJECT, "discovery", advice.LOCALHOST_ONLY)
    value = environment.get(RANGE) or "SUBNET"
    what = RANGES.get(value, advice.DISCOVERY_UNKNOWN)
    if what is not None:
        yield Finding.of(SUBJECT, "discovery", what, value=value,
                         is_wrong=what is not advice.DISCOVERY_LOCAL)


def look_around() -> tuple[list[str], list[str]]:
    """Return the full names of the nodes of the domain, and its topics."""
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node(OWN_NAME, context=context, enable_rosout=False,
                             start_parameter_services=False)
    try:
        time.sleep(DISCOVERY_TIME)
        names = [f"{namespace.rstrip('/')}/{name}"
                 for name, namespace in node.get_node_names_and_namespaces() if name != OWN_NAME]
        return names, [name for name, _ in node.get_topic_names_and_types()]
    finally:
        node.destroy_node()
        rclpy.shutdown(context=context)


def examine_recorders(topics: Sequence[str]) -> Iterator[Finding]:
    """Yield the recorders of this machine that keep too few messages of a fast topic."""
    for pid, words in recorders():
        depths = _depths(words)
        for topic, needed in fast_topics(topics).items():
            depth = depths.get(topic, RECORDER_DEPTH)
            if depth < needed and _records(words, topic):
                yield Finding.of(SUBJECT, "recorder", advice.SHALLOW_RECORDER, topic=topic,
                                 process=f"the recorder (pid {pid})", depth=depth, needed=needed)


def fast_topics(topics: Sequence[str]) -> dict[str, int]:
    """Return those topics of our nodes that need a deeper queue than usual, with its depth."""
    depths = {name.removeprefix("~"): depth for node in NODES.values()
              for name, (_, depth) in node.TOPICS.items() if depth > RECORDER_DEPTH}
    return {topic: depth for topic in topics for suffix, depth in depths.items()
            if topic.endswith("/" + suffix.lstrip("/"))}


def recorders() -> Iterator[tuple[int, list[str]]]:
    """Yield number and command line of each 'ros2 bag record' of this machine."""
    for file in PROC.glob("[0-9]*/cmdline"):
        try:
            words = file.read_bytes().decode(errors="replace").split("\0")
        except OSError:  # it ended
            continue
        for place, word in enumerate(words[:-2]):
            if Path(word).name == "ros2" and words[place + 1:place + 3] == ["bag", "record"]:
                yield int(file.parent.name), words[place + 3:]


def _records(words: Sequence[str], topic: str) -> bool:
    everything = {"-a", "--all", "--all-topics", "-e", "--regex"}
    return bool(everything & set(words)) or topic in words


def _depths(words: Sequence[str]) -> dict[str, int]:
    """Return the depths that a recorder was given, by topic."""
    for place, word in enumerate(words):
        name, _, path = word.partition("=")
        if name == OVERRIDES:
            return _depths_in(path or "".join(words[place + 1:place + 2]))
    return {}


def _depths_in(path: str) -> dict[str, int]:
    try:
        content: Any = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
        return {topic: int(profile.get("depth", RECORDER_DEPTH))
                for topic, profile in content.items()}
    except (OSError, yaml.YAMLError, AttributeError, TypeError, ValueError):
        return {}  # the recorder runs in another directory, perhaps
