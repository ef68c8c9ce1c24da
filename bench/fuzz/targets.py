# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""All targets."""

from __future__ import annotations

from bench.fuzz import (
    icotronic,
    icotronic_session,
    isys,
    isys_session,
    parameters,
    recordings,
    settings,
    uc4000,
    uc4000_session,
)
from bench.fuzz.campaign import Result, fuzz
from bench.fuzz.target import Target

TARGETS: tuple[Target, ...] = tuple(target for module in (
    isys, icotronic, uc4000, settings, recordings, isys_session, icotronic_session, uc4000_session,
    parameters) for target in module.TARGETS)


def fuzz_named(name: str, inputs: int, seconds: float, seed: int) -> Result:
    """Feed the target with this name; for other processes, which take no functions."""
    return fuzz(next(target for target in TARGETS if target.name == name), inputs, seconds, seed)
