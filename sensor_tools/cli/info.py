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
