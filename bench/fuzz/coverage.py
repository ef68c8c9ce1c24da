# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What inputs reach: the branches of the drivers' code, as Python counts them (since 3.12).

A branch costs something until it went both ways, and then nothing.
"""

from __future__ import annotations

import sys
from pathlib import Path
from types import CodeType

_ROOT = Path(__file__).parents[2]
_WATCHED = tuple(f"{_ROOT / name}/" for name in (
    "driver_common", "icotronic_driver", "isys_radar_driver", "uc4000_driver"))
_TOOL = 4  # none of those that Python has a name for


class Coverage:
    """Counts the branches that were taken while it is entered.

    Attributes:
        branches: How many there are, each way of them; 0 where this Python cannot tell.
    """

    def __init__(self) -> None:
        """Begin with none."""
        self.branches = 0
        self._ends: dict[tuple[int, int], int] = {}  # where each branch went first
        self._codes: list[CodeType] = []  # so that no other one gets their identity

    if sys.version_info >= (3, 12):

        def __enter__(self) -> Coverage:
            """Begin to count."""
            monitoring = sys.monitoring
            monitoring.use_tool_id(_TOOL, "fuzz")
            monitoring.register_callback(_TOOL, monitoring.events.BRANCH, self._take)
            monitoring.set_events(_TOOL, monitoring.events.BRANCH)
            monitoring.restart_events()
            return self

        def __exit__(self, *_: object) -> None:
            """End."""
            sys.monitoring.set_events(_TOOL, 0)
            sys.monitoring.free_tool_id(_TOOL)

        def _take(self, code: CodeType, place: int, end: int) -> object:
            first = self._ends.get((id(code), place))
            if first == end:
                return None
            if first is None:
                if not code.co_filename.startswith(_WATCHED):
                    return sys.monitoring.DISABLE
                self._codes.append(code)
                self._ends[id(code), place] = end
                self.branches += 1
                return None
            self.branches += 1
            return sys.monitoring.DISABLE

    else:

        def __enter__(self) -> Coverage:
            """Count nothing."""
            return self

        def __exit__(self, *_: object) -> None:
            """End."""
