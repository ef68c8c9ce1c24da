# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the bus of the ultrasonic sensors tells."""

from __future__ import annotations

from driver_common import device_bus
from uc4000_driver.sensor import Measurement, Sensor


class Listener(device_bus.Listener[Sensor]):
    """What a user of the bus wants to hear; all called in the thread of the bus."""

    def on_measurement(self, sensor: Sensor, measurement: Measurement) -> None:
        """Take a measurement."""

    def on_temperature(self, sensor: Sensor, celsius: float, stamp: int) -> None:
        """Take a temperature; `stamp` is the host's time in ns when it was asked for."""
