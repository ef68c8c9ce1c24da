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
