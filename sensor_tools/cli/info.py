# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""`sensors info`: who a sensor is."""

from __future__ import annotations

import click

from sensor_tools.cli.output import print_json, print_pairs
from sensor_tools.cli.places import Wanted, place_options
from sensor_tools.cli.sensor import session


@click.command()
@place_options()
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def info(wanted: Wanted, as_json: bool) -> None:
    """Say who a sensor is: model, serial number, versions. Changes nothing."""
    with session(wanted) as one:
        one.look()
        found = one.found
        pairs: dict[str, object] = {
            "family": one.family.title, **one.family.identity(one.device),
            "address": found.address, "place": str(found.place), "rate": found.rate}
        if found.rssi is not None:
            pairs["RSSI [dBm]"] = found.rssi
        pairs["settings"] = len(one.device.settings)
    if as_json:
        print_json(pairs)
    else:
        print_pairs(pairs)
