# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""`sensors save`: have a sensor keep what it is set to."""

from __future__ import annotations

import click

from sensor_tools.cli.places import Wanted, place_options
from sensor_tools.cli.sensor import session


@click.command()
@place_options()
def save(wanted: Wanted) -> None:
    """Have a sensor keep its settings over power-off.

    It writes them to its EEPROM. An ICOtronic sensor saves only what is changed in the same run:
    'sensors set --save'.
    """
    with session(wanted) as one:
        one.connect()
        click.echo(one.family.save(one.bus, one.device))
