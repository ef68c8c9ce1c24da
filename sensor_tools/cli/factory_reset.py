# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""`sensors factory-reset`: what a sensor had when it was new."""

from __future__ import annotations

import click

from sensor_tools.cli.places import Wanted, place_options
from sensor_tools.cli.sensor import session


@click.command("factory-reset")
@place_options()
@click.option("--yes", is_flag=True, help="Do not ask.")
def factory_reset(wanted: Wanted, yes: bool) -> None:
    """Restore the factory settings of a sensor, for good."""
    with session(wanted) as one:
        one.connect()
        if not yes:
            click.confirm(f"{one.found}: overwrite all of its settings?", abort=True)
        before = dict(one.device.values)
        one.family.factory_reset(one.bus, one.device)
        for name, value in one.device.values.items():
            if value != before.get(name):
                text = one.device.settings[name].text
                click.echo(f"{name}: {text(before[name])} → {text(value)}")
        click.echo(f"factory settings restored; the sensor has address {one.device.address}")
