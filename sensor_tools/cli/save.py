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
