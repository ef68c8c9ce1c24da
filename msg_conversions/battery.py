# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Supply voltages as sensor_msgs/BatteryState."""

from __future__ import annotations

import math

from sensor_msgs.msg import BatteryState

from msg_conversions.header import to_header


def to_battery_state(voltage: float, frame_id: str, stamp: int) -> BatteryState:
    """Return the state of a battery of which only the voltage is known; the rest is NaN.

    Args:
        voltage: In V.
        frame_id: Frame of the sensor.
        stamp: Time of measurement in ns since the epoch.
    """
    unknown = math.nan
    return BatteryState(
        header=to_header(frame_id, stamp), voltage=voltage, temperature=unknown, current=unknown,
        charge=unknown, capacity=unknown, design_capacity=unknown, percentage=unknown,
        power_supply_status=BatteryState.POWER_SUPPLY_STATUS_DISCHARGING,
        power_supply_health=BatteryState.POWER_SUPPLY_HEALTH_UNKNOWN,
        power_supply_technology=BatteryState.POWER_SUPPLY_TECHNOLOGY_UNKNOWN, present=True)
