# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""`sensors get`: what a sensor is set to."""

from __future__ import annotations

from collections.abc import Sequence

import click

from sensor_tools.cli.output import print_json, print_table
from sensor_tools.cli.places import Wanted, place_options
from sensor_tools.cli.sensor import session
from sensor_tools.cli.values import row_of


@click.command()
@click.argument("names", nargs=-1, metavar="[SETTING]...")
@place_options()
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def get(wanted: Wanted, names: Sequence[str], as_json: bool) -> None:
    """Read settings of a sensor, all of them or those named. Changes nothing.

    The names are those of the parameters of its node.
    """
    with session(wanted) as one:
        one.look()
        settings, values = one.device.settings, one.device.values
    chosen = [row_of(settings, name).name for name in names] or list(settings)
    if as_json:
        print_json({name: values[name] for name in chosen})
        return
    print_table(("SETTING", "VALUE", "ALLOWED", "MEANING"), (
        (name, settings[name].text(values[name]),
         "read only" if settings[name].read_only else settings[name].range_text(),
         settings[name].description) for name in chosen))
