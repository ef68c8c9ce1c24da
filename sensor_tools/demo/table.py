# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""How the demonstration shows that it runs: a live table on a terminal, plain lines elsewhere."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from rich.console import RenderableType

    from sensor_tools.demo.recorder import Channel

BAR_WIDTH = 40
REFRESH = 0.25  # s


class Display(Protocol):
    """Shows what has been recorded; a context manager."""

    def update(self, channels: Sequence[Channel], elapsed: float, duration: float) -> None:
        """Show counts and rates after `elapsed` of `duration` s; may be called at any rate."""

    def __enter__(self) -> Display:
        """Begin."""

    def __exit__(self, *_: object) -> None:
        """End."""


class Lines:
    """One line per second."""

    def __init__(self) -> None:
        """Nothing has been shown yet."""
        self._next = 1

    def update(self, channels: Sequence[Channel], elapsed: float, duration: float) -> None:
        """Print a line when a second has passed."""
        if elapsed >= self._next:
            self._next = int(elapsed) + 1
            counts = ", ".join(f"{channel.topic.name} {channel.count} "
                               f"({channel.count / elapsed:.1f}/s)" for channel in channels)
            print(f"{elapsed:5.0f} of {duration:g} s: {counts}", flush=True)

    def __enter__(self) -> Lines:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Do nothing."""


class Table:
    """A table with a progress bar that stays in its place; raises ImportError without rich."""

    def __init__(self) -> None:
        """Prepare it."""
        from rich.live import Live

        self._live = Live(auto_refresh=False)
        self._next = 0.0

    def update(self, channels: Sequence[Channel], elapsed: float, duration: float) -> None:
        """Draw it anew, not too often."""
        if elapsed >= self._next or elapsed >= duration:
            self._next = elapsed + REFRESH
            self._live.update(self._drawn(channels, elapsed, duration), refresh=True)

    @staticmethod
    def _drawn(channels: Sequence[Channel], elapsed: float, duration: float) -> RenderableType:
        from rich.columns import Columns
        from rich.console import Group
        from rich.progress_bar import ProgressBar
        from rich.table import Table as RichTable

        table = RichTable("topic", "type")
        for heading in ("messages", "per second", "expected"):
            table.add_column(heading, justify="right")
        for channel in channels:
            topic = channel.topic
            rate = channel.count / elapsed if elapsed else 0.0
            table.add_row(topic.name, topic.kind.rpartition("/")[2], str(channel.count),
                          f"{rate:.1f}", f"{topic.rate:.1f}")
        bar = ProgressBar(total=duration, completed=min(elapsed, duration), width=BAR_WIDTH)
        return Group(table, Columns([bar, f"{elapsed:.0f} of {duration:g} s"]))

    def __enter__(self) -> Table:
        """Take the place on the terminal."""
        self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Leave the last table there."""
        self._live.stop()


def display() -> Display:
    """Return what fits standard output."""
    if sys.stdout.isatty():
        try:
            return Table()
        except ImportError:
            pass  # the lines say the same
    return Lines()
