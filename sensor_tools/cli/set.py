"""`sensors set`: other values for the settings of a sensor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import click

from driver_common.errors import SettingError
from driver_common.settings import Setting, Value, suggestion
from sensor_tools.cli.places import Wanted, place_options
from sensor_tools.cli.sensor import session

WORDS: Mapping[str, Value] = {"true": True, "on": True, "yes": True,
                              "false": False, "off": False, "no": False}


@click.command("set")
@click.argument("changes", nargs=-1, required=True, metavar="SETTING=VALUE...")
@place_options()
@click.option("--save", "and_save", is_flag=True, help="Have the sensor keep what it is set to.")
def set_settings(wanted: Wanted, changes: Sequence[str], and_save: bool) -> None:
    """Write settings of a sensor, all or none.

    It shows what the sensor reports then. The sensor keeps them until power-off, unless it is
    told to save them. A measurement that runs is stopped.
    """
    given = dict(map(_split, changes))
    with session(wanted) as one:
        one.connect()
        settings, before = one.device.settings, dict(one.device.values)
        for name, value in one.bus.write(one.device, {
                name: _value(settings, name, text) for name, text in given.items()}).items():
            text = settings[name].text
            click.echo(f"{name}: {text(before[name])} → {text(value)}")
        if and_save:
            click.echo(one.family.save(one.bus, one.device))


def _split(change: str) -> tuple[str, str]:
    name, separator, text = change.partition("=")
    if not separator or not name or not text:
        raise click.UsageError(f"{change!r} is not like output1.range_max=25")
    return name, text


def _value(settings: Mapping[str, Setting], name: str, text: str) -> Value:
    """Return the value that a text stands for; raises SettingError."""
    if name not in settings:
        raise SettingError(f'there is no setting "{name}"{suggestion(name, settings)}')
    setting = settings[name]
    if setting.kind is bool:
        return setting.check(WORDS.get(text.lower(), text))
    if setting.kind in (int, float):
        return setting.check(_number(text))
    return setting.check(text)


def _number(text: str) -> float | str:
    """Return the number that a text is, else the text."""
    try:
        return float(text)
    except ValueError:
        return text
