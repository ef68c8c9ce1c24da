# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the bus of an ICOtronic sensor tells."""

from __future__ import annotations

from collections.abc import Callable

from driver_common import device_bus
from icotronic_driver.sensor import Sensor


class Listener(device_bus.Listener[Sensor]):
    """What a user of the bus wants to hear; all called in the thread of the bus."""

    def on_stream(self, sensor: Sensor) -> Callable[[int, float, tuple[int, ...]], None]:
        """Return what takes the samples of a stream that begins.

        It is called for each data frame with the time of the first sample in ns, the time between
        two samples in ns, and the raw values, oldest first.
        """
        raise NotImplementedError

    def on_readings(self, sensor: Sensor, name: str) -> None:
        """Tell that one of the sensor's readings is new."""
