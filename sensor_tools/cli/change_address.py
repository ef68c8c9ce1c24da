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
