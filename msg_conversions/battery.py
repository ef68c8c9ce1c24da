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
