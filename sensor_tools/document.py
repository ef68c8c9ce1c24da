# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Writes what follows from the tables of the drivers: parameter files, settings, diagnostics.

`python -m sensor_tools.document` rewrites config/ and docs/, with `--check` it only says whether
they are up to date.
"""

from __future__ import annotations

import argparse
import itertools
import json
import re
import sys
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from driver_common.device_node import DeviceNode
from driver_common.health import Health
from driver_common.settings import Option, Parameter, Setting, Value
from icotronic_driver.health import HEALTH as ICOTRONIC_HEALTH
from icotronic_driver.node import IcotronicNode
from icotronic_driver.settings import SETTINGS
from isys_radar_driver.health import HEALTH as ISYS_HEALTH
from isys_radar_driver.models import MODELS
from isys_radar_driver.node import IsysRadarNode
from isys_radar_driver.settings import settings_of
from sensor_tools import record_qos
from uc4000_driver.health import HEALTH as UC4000_HEALTH
from uc4000_driver.node import Uc4000Node
from uc4000_driver.settings import ALL_SETTINGS as UC4000_SETTINGS

ROOT = Path(__file__).resolve().parent.parent
SEVERAL = (" With `sensors: [front, rear]` those of the driver that belong to a sensor, and all of "
           "the device, come once per sensor, as in `front.address`.")
WIDTH = 98  # of comments in a parameter file
TYPES = {bool: "true or false", int: "integer", float: "float", str: "text", list: "list of words"}


@dataclass(frozen=True)
class Driver:
    """A driver to document.

    Attributes:
        name: Name of its node.
        title: What it drives.
        node: The class of its node, which has the options.
        models: The settings of each model.
        examples: Values to show where the default, or the first possible value, is of no use.
        page: How the names of its documents begin.
        health: What its diagnostics say.
        keeping: Whether a device keeps what is written to it.
    """

    name: str
    title: str
    node: type[DeviceNode]
    models: Mapping[str, Mapping[str, Setting]]
    examples: Mapping[str, Value]
    page: str
    health: Health
    keeping: str = "it is not stored there for good"

    @property
    def options(self) -> tuple[Option, ...]:
        """The parameters of the driver itself."""
        return (*self.node.bus_options(), *self.node.SENSOR_OPTIONS)

    def default(self, option: Option) -> Value:
        """Return what an option is where the user gives nothing."""
        if isinstance(option.default, str):
            return option.default.format(sensor=self.name)
        return option.default

    def variants(self, name: str) -> dict[str, Setting]:
        """Return a setting as each model has it."""
        return {model: settings[name] for model, settings in self.models.items()
                if name in settings}


DRIVERS = (
    Driver("isys_radar", "InnoSenT iSYS radars", IsysRadarNode,
           {model.name: settings_of(model) for model in MODELS.values()},
           {"serial_port": "/dev/serial/by-id/YOUR_ADAPTER", "ip.address": "192.168.60.20",
            "ip.subnet_mask": "255.255.255.0", "ip.gateway": "192.168.60.1",
            "ip_destination.address": "192.168.60.30"}, "isys", ISYS_HEALTH),
    Driver("icotronic", "ICOtronic wireless accelerometers", IcotronicNode,
           {"STH": SETTINGS}, {"can_channel": "can0", "name": "Spindle"},
           "icotronic", ICOTRONIC_HEALTH),
    Driver("uc4000", "Pepperl+Fuchs UC4000 ultrasonic sensors", Uc4000Node,
           {"UC4000": UC4000_SETTINGS}, {"serial_port": "/dev/serial/by-id/YOUR_ADAPTER"}, "uc4000",
           UC4000_HEALTH, keeping="the sensor itself stores it for good"),
)


# --- parameter files ---

def parameter_file(driver: Driver) -> str:
    """Return a commented parameter file for one sensor."""
    names = [option.name for option in driver.options]
    lines = [
        *_comment(f"Parameters of {driver.name}_node for one sensor ({driver.title})."),
        *_comment("Made by 'python -m sensor_tools.document': copy it rather than edit it. Use it "
                  f"with 'ros2 launch industrial_sensor_drivers {driver.name}.launch.py "
                  "params_file:=FILE'."),
        "", "/**:", "  ros__parameters:",
        "    # ---- The driver: the values shown are the defaults, but for "
        f"{' and '.join(name for name in names if name in driver.examples)} ----"]
    for option in driver.options:
        value = driver.examples.get(option.name, driver.default(option))
        lines += ["", *_comment(_explained(option, [option]), 4),
                  # ROS does not read empty lists
                  f"    {'# ' if value == [] else ''}{option.name}: {_yaml(value)}"]
    lines += [
        "", "", "    # ---- The device ----",
        *_comment("What is not given stays as it is in the device. What is given is written to it "
                  f"at every start, unless config_mode says otherwise; {driver.keeping}. The "
                  "values shown are examples.", 4)]
    for name in _by_group(name for name in driver.node.ALL_SETTINGS if driver.variants(name)):
        variants = driver.variants(name)
        setting = next(iter(variants.values()))
        lines += ["", *_comment(_explained(setting, variants.values()), 4),
                  f"    # {name}: {_yaml(driver.examples.get(name, example(variants.values())))}"]
    return "\n".join(lines) + "\n"


def _comment(text: str, indent: int = 0) -> list[str]:
    start = " " * indent + "# "
    return textwrap.wrap(text, WIDTH, initial_indent=start, subsequent_indent=start,
                         break_on_hyphens=False)


def _explained(row: Parameter, variants: Iterable[Parameter]) -> str:
    """Return description, range, step and section in one line."""
    ranges = {variant.limits: _range(variant) for variant in variants}
    widest = ranges[max(ranges, key=lambda limits: limits[1] or 0)].replace("`", "")
    what = "one of " if row.choices is not None else ""
    step = f" in steps of {_step(row)} {row.unit}".rstrip() if _step(row) else ""
    values = "only " + _values(row) if _values(row) else ""
    less = " (less on some models)" if len(ranges) > 1 else ""
    section = f"manual {row.section}" if isinstance(row, Setting) else ""
    return "; ".join(filter(None, (
        row.description, f"{what}{widest} {row.unit}".strip() + less + step, values, section)))


def _step(row: Parameter) -> str:
    """Return the step of a float or of allowed values, "" where there is none."""
    if isinstance(row, Setting) and row.values:
        steps = {above - below for below, above in itertools.pairwise(row.values)}
        return f"{steps.pop():g}" if len(steps) == 1 else ""
    fine = isinstance(row, Setting) and row.kind is float and row.factor != 1
    return f"{row.factor:g}" if fine else ""  # type: ignore[attr-defined]


def _values(row: Parameter) -> str:
    """Return the allowed values where they have no common step."""
    if not isinstance(row, Setting) or not row.values or _step(row):
        return ""
    return ", ".join(map("{:g}".format, row.values))


def _by_group(names: Iterable[str]) -> list[str]:
    """Return names in their order, but those of a group (before the dot) together."""
    groups: dict[str, list[str]] = {}
    for name in names:
        groups.setdefault(name.rpartition(".")[0], []).append(name)
    return [name for group in groups.values() for name in group]


def example(variants: Iterable[Setting]) -> Value:
    """Return a value that all variants of a setting may have."""
    setting, *others = variants
    if setting.choices is not None:
        return next(iter(setting.choices))
    if setting.kind is str:
        return "192.168.0.1"
    low, _ = setting.limits
    if "_max" in setting.name and setting.maximum is not None:
        low = min(variant.limits[1] or 0 for variant in (setting, *others))
    return setting.check(setting.kind(max(low or 0, 0)))


def _yaml(value: Value) -> str:
    """Return a value that YAML 1.1 takes for the same type: words are quoted."""
    return json.dumps(value, ensure_ascii=False)


# --- lists of settings ---

def table(driver: Driver) -> str:
    """Return the list of all parameters as Markdown."""
    return "\n".join([
        f"# Parameters of {driver.name}_node", "",
        "<!-- Made by 'python -m sensor_tools.document' from the tables in the code. -->", "",
        f"For {driver.title}." + SEVERAL * driver.node.SEVERAL_SENSORS, "",
        "## The driver", "",
        *_markdown(("Name", "Type", "Unit", "Range", "Default", "Description"),
                   _option_rows(driver)), "",
        "## The device", "",
        "Which of them there are depends on the model. They have no defaults here: what is not "
        "given stays as it is in the device. A float is rounded to the step.", "",
        *_markdown(("Name", "Type", "Unit", "Range", "Step", "Models", "Manual", "Description"),
                   _setting_rows(driver)), ""])


def _option_rows(driver: Driver) -> Iterator[list[str]]:
    for option in driver.options:
        default = driver.default(option)
        kind = "two floats" if option.is_pair else TYPES[option.kind]
        yield [f"`{option.name}`", kind, option.unit, _range(option), f"`{_yaml(default)}`",
               option.description]


def _setting_rows(driver: Driver) -> Iterator[list[str]]:
    """Yield a row per setting; one for those that differ by a number only."""
    alike: dict[tuple[str, ...], list[tuple[str, list[str]]]] = {}
    for name, setting in driver.node.ALL_SETTINGS.items():
        variants = driver.variants(name)
        ranges = _ranges_of_models(variants or {"": setting}, driver)
        row = [f"`{name}`", TYPES[setting.kind], setting.unit, ranges,
               _step(setting) or _values(setting), _models(variants, driver),
               setting.section, _description(setting, variants, driver)]
        found = re.search(r"(?<=[a-z])\d", name)
        number = found[0] if found else ""
        key = [re.sub(rf"(?<=[a-z ]){number}\b", "N", text) for text in row] if number else row
        alike.setdefault(tuple(key), []).append((number, row))
    for (name, *rest), rows in alike.items():
        if len(rows) == 1:
            yield rows[0][1]
        else:
            yield [f"{name}, N = {', '.join(number for number, _ in rows)}", *rest]


def _ranges_of_models(variants: Mapping[str, Setting], driver: Driver) -> str:
    """Return the range; where it depends on the model, with the models."""
    ranges: dict[str, list[str]] = {}
    for model, setting in variants.items():
        ranges.setdefault(_range(setting), []).append(model)
    if len(ranges) == 1:
        return next(iter(ranges))
    return "; ".join(f"{text} ({_models(models, driver)})" for text, models in ranges.items())


def _description(setting: Setting, variants: Mapping[str, Setting], driver: Driver) -> str:
    """Return the description, and how the setting can be written."""
    text = setting.description
    read_only = [model for model, variant in variants.items() if variant.read_only]
    if read_only:
        text += f"; can only be read on {_models(read_only, driver)}"
    if setting.needs_stop:
        text += "; the driver stops the acquisition to write it"
    return text


def _range(row: Parameter) -> str:
    """Return the range without its unit."""
    if row.choices is not None:
        return ", ".join(f"`{word}`" for word in row.choices)
    low, high = row.limits
    if high is None:
        return "" if low is None else f"at least {low:.10g}"
    return f"{'…' if low is None else f'{low:.10g} …'} {high:.10g}"


def _models(models: Iterable[str], driver: Driver) -> str:
    """Return the names of models, their common beginning once."""
    names = list(models)
    if not names:
        return "none by the manual"
    if names == list(driver.models):
        return "all"
    family = names[0].partition("-")[0] + "-"
    return ", ".join([names[0], *(name.removeprefix(family) for name in names[1:])])


def _markdown(heading: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    return [f"| {' | '.join(cells)} |" for cells in (heading, ["---"] * len(heading), *rows)]


# --- diagnostics ---

def diagnostics(driver: Driver) -> str:
    """Return what the diagnostics of a driver say as Markdown."""
    several = " one for each sensor," * driver.node.SEVERAL_SENSORS
    return "\n".join([
        f"# Diagnostics of {driver.name}_node", "",
        "<!-- Made by 'python -m sensor_tools.document' from the tables in the code. -->", "",
        f"Once a second the node publishes a status on `/diagnostics`,{several} named "
        "`namespace/node: sensor`. `…` stands for what changes.", "",
        "## Levels and messages", "",
        *_markdown(("Level", "Message", "Meaning"),
                   ((state.level, f"`{state.text}`", state.meaning)
                    for state in driver.health.states)), "",
        "## Keys", "",
        "Counters count since the start of the node. A key is missing while there is nothing to "
        "say.", "",
        *_markdown(("Key", "Meaning"),
                   ((f"`{key.text}`", key.meaning) for key in driver.health.keys)), ""])


# --- help ---

def help_text(driver: Driver) -> str:
    """Return how to run a node, what it publishes, and its parameters."""
    topics = {f"~/{name}": topic.kind for name, topic in driver.node.TOPICS.items()}
    width = max(map(len, topics))
    return "\n".join([
        f"usage: ros2 run industrial_sensor_drivers {driver.name}_node [--ros-args "
        "[-p NAME:=VALUE] ... [--params-file FILE] [-r FROM:=TO] ...]", "",
        f"Driver of {driver.title}. It publishes, beside /diagnostics:", "",
        *(f"  {name:{width}}  {kind.__module__.partition('.')[0]}/msg/{kind.__name__}"
          for name, kind in topics.items()), "",
        "Its parameters follow, as a file for --params-file.", "", parameter_file(driver)])


def print_help(name: str) -> int:
    """Print the help of a node; return the exit code."""
    print(help_text(next(driver for driver in DRIVERS if driver.name == name)), end="")
    return 0


# --- files ---

def documents() -> dict[Path, str]:
    """Return all files with what they should hold."""
    files = {}
    for driver in DRIVERS:
        files[ROOT / "config" / f"{driver.name}.yaml"] = parameter_file(driver)
        files[ROOT / "docs" / f"{driver.page}_settings.md"] = table(driver)
        files[ROOT / "docs" / f"{driver.page}_diagnostics.md"] = diagnostics(driver)
    files[ROOT / "config" / "record_qos.yaml"] = record_qos.profiles(record_qos.USUAL)
    return files


def main(args: Sequence[str] | None = None) -> int:
    """Write the files, or check them; return 1 if one is stale."""
    parser = argparse.ArgumentParser(prog="document", description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing")
    check = parser.parse_args(args).check
    stale = [path for path, text in documents().items()
             if not path.is_file() or path.read_text(encoding="utf-8") != text]
    for path in stale:
        print(f"{path.relative_to(ROOT)} {'is stale' if check else 'written'}")
        if not check:
            path.write_text(documents()[path], encoding="utf-8")
    if check and stale:
        print("Run 'python -m sensor_tools.document'.")
    return int(check and bool(stale))


if __name__ == "__main__":
    sys.exit(main())
