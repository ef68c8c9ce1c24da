# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""`sensors set`: other values for the settings of a sensor."""

from __future__ import annotations

from collections.abc import Sequence

import click

from sensor_tools.cli.places import Wanted, place_options, split_assignment
from sensor_tools.cli.sensor import session
from sensor_tools.cli.values import value_of


@click.command("set")
@click.argument("changes", nargs=-1, required=True, metavar="SETTING=VALUE...")
@place_options()
@click.option("--save", "and_save", is_flag=True, help="Have the sensor keep what it is set to.")
def set_settings(wanted: Wanted, changes: Sequence[str], and_save: bool) -> None:
    """Write settings of a sensor, all or none.

    It shows what the sensor reports then. The sensor keeps them until power-off, unless it is
    told to save them. A measurement that runs is stopped.
    """
    given = dict(map(split_assignment, changes))
    with session(wanted) as one:
        one.connect()
        settings, before = one.device.settings, dict(one.device.values)
        for name, value in one.bus.write(one.device, {
                name: value_of(settings, name, text) for name, text in given.items()}).items():
            text = settings[name].text
            click.echo(f"{name}: {text(before[name])} → {text(value)}")
        if and_save:
            click.echo(one.family.save(one.bus, one.device))
