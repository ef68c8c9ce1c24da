# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Where sensors can be: serial ports and CAN channels, and which of them are there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from serial.tools import list_ports

from driver_common.settings import Value

BY_ID = Path("/dev/serial/by-id")
NETWORK = Path("/sys/class/net")
CAN_HARDWARE = "280"  # type of a CAN channel in /sys/class/net, ARPHRD_CAN of Linux


@dataclass(frozen=True)
class SerialPlace:
    """A serial port.

    Attributes:
        port: Device path or URL.
        baud_rate: The only rate to try in Bd; 0 = all that are possible.
    """

    port: str
    baud_rate: int = 0

    def __str__(self) -> str:
        """Return the path under which the port stays when others are plugged in."""
        return by_id(self.port)

    @property
    def parameters(self) -> Mapping[str, Value]:
        """The parameters of a node that name it."""
        return {"serial_port": str(self)}


@dataclass(frozen=True)
class CanPlace:
    """A CAN channel.

    Attributes:
        channel: The channel, such as can0.
        interface: Interface of python-can.
        bitrate: In bit/s.
        options: Further options of the interface, each "name=value".
    """

    channel: str = "can0"
    interface: str = "socketcan"
    bitrate: int = 1_000_000
    options: tuple[str, ...] = ()

    def __str__(self) -> str:
        """Return interface and channel."""
        return f"{self.interface} {self.channel}"

    @property
    def parameters(self) -> Mapping[str, Value]:
        """The parameters of a node that name it."""
        given: dict[str, Value] = {"can_interface": self.interface, "can_channel": self.channel,
                                   "can_bitrate": self.bitrate}
        return given | ({"can_options": list(self.options)} if self.options else {})


Place: TypeAlias = SerialPlace | CanPlace


def all_places() -> list[Place]:
    """Return the serial ports and CAN channels of this machine."""
    ports = sorted(info.device for info in list_ports.comports())
    return [*map(SerialPlace, ports), *map(CanPlace, can_channels())]


def can_channels() -> list[str]:
    """Return the CAN channels that the kernel has."""
    return sorted(path.parent.name for path in NETWORK.glob("*/type")
                  if path.read_text().strip() == CAN_HARDWARE)


def by_id(port: str) -> str:
    """Return the name of a port in /dev/serial/by-id, the port itself where it has none."""
    device = Path(port).resolve()
    return next((str(link) for link in sorted(BY_ID.glob("*")) if link.resolve() == device), port)
