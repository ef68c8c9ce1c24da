# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""`sensors doctor`: what is wrong, and what to do about it."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator

import click

from sensor_tools.cli.output import print_findings, print_json, progress_bar
from sensor_tools.cli.places import Wanted, place_options
from sensor_tools.doctor import can_bus, serial_port
from sensor_tools.search.place import Place, SerialPlace, all_places
from sensor_tools.search.result import Finding, Progress


@click.command()
@place_options()
@click.option("--json", "as_json", is_flag=True, help="Print JSON, for an issue.")
@click.option("--ros/--no-ros", default=None, help="Look at ROS as well, or not (default: where "
                                                   "it is there and no port is named).")
def doctor(wanted: Wanted, as_json: bool, ros: bool | None) -> int:
    """Find out what is wrong; read-only.

    It looks at everything that is there, or at one port or bus. What is named (--family,
    --address, --baud, --name …) must be so. Ends with 0 if nothing is wrong.
    """
    places = [wanted.place] if wanted.place else all_places()
    if ros is None:
        ros = not wanted.place and importlib.util.find_spec("rclpy") is not None
    with progress_bar() as progress:
        findings = [finding for place in places for finding in _examine(place, wanted, progress)]
        if not places:
            findings.append(Finding("this machine", "ports", "it has no serial port and no CAN "
                                    "channel", "plug the adapter in, or name a URL with --port"))
        if ros:
            findings += _examine_ros(progress)
    wrong = sum(finding.is_wrong for finding in findings)
    if as_json:
        print_json({"wrong": wrong, "findings": [vars(finding) for finding in findings]})
    else:
        print_findings(findings)
        click.echo(f"\n{wrong} thing{'s are' if wrong != 1 else ' is'} wrong" if wrong
                   else "\nnothing is wrong")
    return 1 if wrong else 0


def _examine(place: Place, wanted: Wanted, progress: Progress) -> Iterator[Finding]:
    if isinstance(place, SerialPlace):
        return serial_port.examine(place, wanted, progress)
    return can_bus.examine(place, wanted, progress)


def _examine_ros(progress: Progress) -> list[Finding]:
    from sensor_tools.doctor import middleware  # only where ROS is

    progress.expect(1)
    progress.step("ROS: looking for nodes")
    return list(middleware.examine())
