# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Headers: frame and time of measurement."""

from __future__ import annotations

from builtin_interfaces.msg import Time
from std_msgs.msg import Header


def to_header(frame_id: str, stamp: int) -> Header:
    """Return a header.

    Args:
        frame_id: Frame of the data.
        stamp: Time of measurement in ns since the epoch.
    """
    seconds, nanoseconds = divmod(stamp, 1_000_000_000)
    return Header(stamp=Time(sec=seconds, nanosec=nanoseconds), frame_id=frame_id)
