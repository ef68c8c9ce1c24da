# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""`sensors change-address`: another address for a sensor on a line with several."""

from __future__ import annotations

import click

from sensor_tools.cli.places import Wanted, place_options
from sensor_tools.cli.sensor import session


@click.command("change-address")
@click.argument("new_address", type=click.IntRange(1, 255))
@place_options()
def change_address(wanted: Wanted, new_address: int) -> None:
    """Give a sensor another address, for good.

    The address must be free, and the sensor must answer there.
    """
    with session(wanted) as one:
        one.connect()
        one.family.change_address(one.bus, one.device, new_address)
        click.echo(f"the sensor moved from address {one.found.address} to {one.device.address} "
                   "and keeps it")
