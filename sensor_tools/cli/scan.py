# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""`sensors scan`: which sensors are there, and what a node needs to find them again."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from driver_common.errors import LinkError
from sensor_tools.cli.output import print_findings, print_json, print_table, progress_bar
from sensor_tools.cli.places import Wanted, place_options
from sensor_tools.families import families_of, search
from sensor_tools.node_files import write_files
from sensor_tools.search.place import Place, all_places
from sensor_tools.search.result import Finding, Found, Progress, Result

COLUMNS = ("FAMILY", "MODEL", "NAME", "SERIAL NUMBER", "FIRMWARE", "PLACE", "ADDRESS", "RATE",
           "RSSI")


@click.command()
@place_options(one_sensor=False)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@click.option("--files", type=click.Path(file_okay=False, path_type=Path), metavar="DIR",
              help="Write parameter files and a udev rule for what was found.")
def scan(wanted: Wanted, as_json: bool, files: Path | None) -> int:
    """Look for sensors; read-only.

    It asks all serial ports and CAN buses, or the one that is named, at all baud rates and
    addresses. Ends with 0 if a sensor was found.
    """
    places = [wanted.place] if wanted.place else all_places()
    with progress_bar() as progress:
        results = [result for place in places
                   for result in _search(place, wanted.family, progress)]
    found = [one for one in results if isinstance(one, Found)]
    findings = [one for one in results if isinstance(one, Finding)]
    if as_json:
        print_json({"sensors": [_as_json(one) for one in found],
                    "findings": [vars(one) for one in findings]})
    else:
        _print(places, found, findings)
    if files:
        for line in write_files(files, found):
            click.echo(line, err=as_json)
    return 0 if any(one.is_sensor for one in found) else 1


def _search(place: Place, family: str, progress: Progress) -> list[Result]:
    """Return what is at a place, and be it that it cannot be opened."""
    try:
        return search(place, families_of(place, family), progress)
    except LinkError as error:
        return [Finding.of_error(place, error)]


def _print(places: Sequence[Place], found: Sequence[Found], findings: Sequence[Finding]) -> None:
    if found:
        print_table(COLUMNS, (
            (one.family, one.model, one.name, one.serial_number, one.firmware, one.place,
             one.address, one.rate, "" if one.rssi is None else f"{one.rssi} dBm")
            for one in found))
    else:
        click.echo("no sensor answers on " + (", ".join(map(str, places)) or
                                              "this machine, which has no port for one"))
    if findings:
        click.echo()
        print_findings(findings)


def _as_json(found: Found) -> dict[str, object]:
    return {**vars(found), "place": str(found.place),
            "parameters": {**found.place.parameters, **found.parameters}}
