# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The error tree of all drivers.

Every error that a user can meet is a `DriverError`; its text names the thing and the next step,
so that a node can log it as it is.
"""


STEP_INTERRUPTED = "interrupted, as the driver is to stop; try again"


class DriverError(Exception):
    """Base of all errors that a driver raises on purpose."""


class LinkError(DriverError):
    """The link itself failed: no such port, no permission, in use, unplugged, server gone."""


class StepInterruptedError(LinkError):
    """A step of the bus ended early, because a user wants something that cannot wait."""


class NoAnswerError(DriverError):
    """A request stayed without an answer within its time-out."""


class FrameError(DriverError):
    """A frame has a wrong checksum, length or content."""


class RefusedError(DriverError):
    """The device answered that it cannot carry out the request."""


class WrongDeviceError(DriverError):
    """Another device answered than the one asked for, or one that is not known."""


class SettingError(DriverError, ValueError):
    """A value or a name of a setting is not acceptable; the device was not touched."""
