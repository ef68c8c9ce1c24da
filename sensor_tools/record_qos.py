# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Writes what makes 'ros2 bag record' keep enough messages while it is busy, for any node names.

    record_qos > my_qos.yaml                                    # the nodes' own names
    record_qos /press/spindle=icotronic /cart/radars=isys_radar:front,rear > my_qos.yaml
    ros2 bag record … --qos-profile-overrides-path my_qos.yaml

The recorder's file knows whole topic names only, hence one line for each topic of each node.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from driver_common.device_node import DeviceNode
from icotronic_driver.node import IcotronicNode
from isys_radar_driver.node import IsysRadarNode
from uc4000_driver.node import Uc4000Node

NODES: Mapping[str, type[DeviceNode]] = {
    "isys_radar": IsysRadarNode, "icotronic": IcotronicNode, "uc4000": Uc4000Node}
LEAST_DEPTH = 100  # messages; some seconds of any topic but that of single samples
HEADING = """\
# Made by 'ros2 run industrial_sensor_drivers record_qos', which also takes other names of nodes.
# Use it with 'ros2 bag record … --qos-profile-overrides-path FILE': the recorder keeps 10 messages
# of a topic while it is busy, which is one millisecond of imu/data_raw.
"""


class NamedNode(NamedTuple):
    """A node as it was started: its full name, its kind, and the names of its sensors."""

    name: str
    kind: str
    sensors: tuple[str, ...] = ("",)

    @classmethod
    def parse(cls, text: str) -> NamedNode:
        """Return the node of such a text as "/cart/radars=isys_radar:front,rear".

        Raises:
            ValueError: It is another one.
        """
        name, _, kind = text.partition("=")
        kind, _, sensors = kind.partition(":")
        if not name or kind not in NODES:
            raise ValueError(f"{text!r} is not like /press/spindle=icotronic; nodes are "
                             f"{', '.join(NODES)}")
        return cls("/" + name.strip("/"), kind, tuple(sensors.split(",")))

    def topics(self) -> Iterator[tuple[str, int]]:
        """Yield each topic that the node can have, with the messages to keep of it."""
        for sensor in self.sensors:
            for topic, (_, depth) in NODES[self.kind].TOPICS.items():
                name = DeviceNode.topic(sensor, topic).replace("~", self.name, 1)
                yield name, max(depth, LEAST_DEPTH)


USUAL = tuple(NamedNode(f"/{kind}", kind) for kind in NODES)


def profiles(nodes: Iterable[NamedNode]) -> str:
    """Return the file for all topics of some nodes."""
    topics = [topic for node in nodes for topic in node.topics()]
    return HEADING + "".join(
        f"{topic}: {{history: keep_last, depth: {depth}, reliability: reliable, "
        "durability: volatile}\n" for topic, depth in (*topics, ("/diagnostics", LEAST_DEPTH)))


def main(args: Sequence[str] | None = None) -> None:
    """Print the file."""
    introduction, _, rest = (__doc__ or "").partition("\n")
    parser = argparse.ArgumentParser(
        prog="record_qos", description=introduction, epilog=rest,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("node", nargs="*", metavar="NAME=KIND[:SENSOR,…]",
                        help=f"full name of a node, its kind ({', '.join(NODES)}) and the names of "
                             "its sensors")
    options = parser.parse_args(args)
    try:
        nodes = [NamedNode.parse(text) for text in options.node]
    except ValueError as error:
        parser.error(str(error))
    print(profiles(nodes or USUAL), end="")


if __name__ == "__main__":
    main()
