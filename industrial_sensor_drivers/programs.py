# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The programs of setup.py, each with the packages that belong to it.

Some names of ours are common ones. Python takes whatever comes first on PYTHONPATH, so it would
run the `driver_common` of another workspace, in silence or with an error that helps nobody.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Sequence
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from types import ModuleType

OWN = ("driver_common", "icotronic_driver", "isys_radar_driver", "msg_conversions",
       "sensor_tools", "uc4000_driver")
HERE = str(Path(__file__).parent.parent)


class OwnPackages:
    """Finds ours beside this one, before anything looks along the path."""

    @staticmethod
    def find_spec(name: str, path: Sequence[str] | None = None,
                  target: ModuleType | None = None) -> ModuleSpec | None:
        """Return where a package of ours is; other names are left to others."""
        return PathFinder.find_spec(name, [HERE]) if name in OWN else None


def _program(module: str, function: str = "main", *arguments: str) -> Callable[[], object]:
    """Return what imports a module and calls a function of it."""
    def run() -> object:
        sys.meta_path.insert(0, OwnPackages)
        return getattr(importlib.import_module(module), function)(*arguments)

    return run


def _node(name: str) -> Callable[[], object]:
    """Return what runs a node, or tells how to where that is asked."""
    def run() -> object:
        own = sys.argv[1:sys.argv.index("--ros-args")] if "--ros-args" in sys.argv else sys.argv
        program = (_program("sensor_tools.document", "print_help", name)
                   if {"-h", "--help"} & {*own} else _program(f"{name}_driver.program"))
        return program()

    return run


convert_imu = _program("sensor_tools.convert_imu")
demo = _program("sensor_tools.demo.program")
doctor = _program("sensor_tools.cli.program", "doctor_main")
icotronic_node = _node("icotronic")
isys_radar_node = _node("isys_radar")
radar_scan = _program("sensor_tools.radar_scan")
record_qos = _program("sensor_tools.record_qos")
sensors = _program("sensor_tools.cli.program")
simulate = _program("sensor_tools.simulate")
uc4000_node = _node("uc4000")
