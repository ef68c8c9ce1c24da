# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What all devices have in common."""

import pytest

from driver_common import device
from driver_common.device import RATE_WINDOW, rate_of


@pytest.mark.parametrize(("arrivals", "now", "rate"), [
    ([], 10.0, 0.0),
    ([1.0], 1.1, 0.0),
    ([1.0, 1.1, 1.2, 1.3], 1.3, 10.0),
    ([1.0, 1.1, 1.2, 1.3], 1.45, 10.0),  # one that is late
    ([1.0, 1.1, 1.2, 1.3], 1.6, 5.0),  # silence
    ([1.0, 1.1, 1.2, 1.3], 4.0, 1.0),
    ([1.0, 1.1, 1.2, 1.3], 1.4 + RATE_WINDOW, 0.0),
])
def test_the_rate_of_what_comes_no_more_falls(monkeypatch, arrivals, now, rate):
    monkeypatch.setattr(device.time, "monotonic", lambda: now)
    assert rate_of(arrivals) == pytest.approx(rate)
