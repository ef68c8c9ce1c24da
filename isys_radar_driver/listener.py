# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the bus of the radars tells."""

from __future__ import annotations

from driver_common import device_bus
from isys_radar_driver.commands import RangeList
from isys_radar_driver.radar import Radar
from isys_radar_driver.targets import TargetList


class Listener(device_bus.Listener[Radar]):
    """What a user of the bus wants to hear; all called in the thread of the bus."""

    def on_target_list(self, radar: Radar, targets: TargetList, stamp: int) -> None:
        """Take a target list; `stamp` is the host's time in ns when the reply began."""

    def on_digital_outputs(self, radar: Radar, values: tuple[int, ...], stamp: int) -> None:
        """Take the state of the digital outputs."""

    def on_range_list(self, radar: Radar, values: RangeList, targets: TargetList,
                      stamp: int) -> None:
        """Take a range list, and the target list that came before it."""

    def on_temperatures(self, radar: Radar, stamp: int) -> None:
        """Tell that the board temperatures of a radar were read."""
