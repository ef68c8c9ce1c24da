# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A simulated stationary unit (STU): it finds sensors and connects one of them, without I/O."""

from __future__ import annotations

import math
import random
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from icotronic_driver.commands import SELF
from icotronic_driver.eeprom import STU_EEPROM
from icotronic_driver.identifier import STU_1
from icotronic_driver.simulator.sth import SimulatedSth
from icotronic_driver.simulator.unit import NOT_AVAILABLE, Refusal, SimulatedNode
from icotronic_driver.values import encode_mac

CONNECT_TIME = 0.03  # s from the request until the connection stands
SUPERVISION_TIME = 0.5  # s after which a broken connection is noticed


@dataclass
class Faults:
    """How the system misbehaves; may be changed at any time.

    Attributes:
        loss: Probability that a radio frame with measured values is lost.
        loss_run: How many are lost in a row.
        duplicate: Probability that such a frame comes twice.
        swap: Probability that such a frame comes after the one behind it.
        damage: Probability that its counter is damaged.
        jitter: Time in s by which such a frame comes late, at most.
        burst: Time in s for which such frames are held back, to come all at once.
        answer_loss: Probability that an answer of a sensor is lost.
        answer_delay: Time in s that an answer of a sensor takes beyond the usual.
        refused_connects: How many of the next attempts to connect fail.
        connect_time: Time in s that a connection takes beyond the shortest.
        newness: Time in s in which a sensor that was just found tells neither its MAC address nor
            its RSSI nor all of its name (field note N3).
        foreign: Frames per s on the bus that belong to something else.
        errors: Error frames per s on the bus.
        padding: Whether answers to requests for single values have 8 bytes (field note N9).
        silent: Whether nothing gets through.
    """

    loss: float = 0.0
    loss_run: int = 1
    duplicate: float = 0.0
    swap: float = 0.0
    damage: float = 0.0
    jitter: float = 0.0
    burst: float = 0.0
    answer_loss: float = 0.0
    answer_delay: float = 0.0
    refused_connects: int = 0
    connect_time: float = 0.0
    newness: float = 0.0
    foreign: float = 0.0
    errors: float = 0.0
    padding: bool = False
    silent: bool = False
    random: random.Random = field(default_factory=lambda: random.Random(1))

    @property
    def spare_stream(self) -> bool:
        """Whether frames with measured values get through as they are."""
        return not (self.loss or self.duplicate or self.swap or self.damage or self.jitter
                    or self.burst)


class SimulatedStu(SimulatedNode):
    """The stationary unit: it finds sensors, connects to one and passes its frames on.

    Attributes:
        sensors: The sensors around it.
        faults: How the system misbehaves.
        active: Whether Bluetooth is activated.
        found: The sensors that it has found, and when; the index is the device number.
        connected: The sensor to which it has a connection.
        radio_sent: Frames that it sent to sensors.
        radio_received: Frames that it received from them.
    """

    def __init__(self, sensors: Sequence[SimulatedSth], faults: Faults,
                 mac: str = "08:6B:D7:01:0B:5C") -> None:
        """Power it on for the first time."""
        self.sensors = sensors
        self.faults = faults
        self.connected: SimulatedSth | None = None
        self.found: dict[SimulatedSth, float] = {}
        self._known: list[SimulatedSth] = []  # from an earlier activation (field note N4)
        self._connecting: tuple[SimulatedSth, float] | None = None
        self._subcommands: dict[int, Callable[[bytes, float], bytes]] = {
            1: self._activate, 2: self._count, 3: self._write_name, 4: self._write_name,
            5: self._read_name, 6: self._read_name, 7: self._connect_number,
            8: self._check_connected, 9: self._deactivate_command, 10: self._send_counter,
            11: self._receive_counter, 12: self._rssi, 13: self._energy_times,
            14: self._energy_times, 15: self._energy_times, 16: self._energy_times,
            17: self._read_mac, 18: self._connect_mac}
        super().__init__(STU_1, mac, dict(STU_EEPROM), "STU Name")

    def boot(self, now: float) -> None:
        """Lose the RAM and the connection."""
        super().boot(now)
        self._known = []
        self.radio_sent = self.radio_received = 0
        self._deactivate(now)

    def update(self, now: float) -> None:
        """Find sensors, finish connecting, and notice a broken connection."""
        if self.active and self.connected is None:
            self.found = {sensor: since for sensor, since in self.found.items()
                          if self._hears(sensor, now)}
            self.found |= {sensor: now for sensor in self.sensors
                           if sensor not in self.found and self._hears(sensor, now)
                           and max(self._scanning_since, sensor.advertises_since)
                           + sensor.advertisement_interval(now) <= now}
            self._known = list(self.found) or self._known
        if self._connecting is not None and now >= self._connecting[1]:
            sensor = self._connecting[0]
            self._connecting = None
            if self._hears(sensor, now):
                sensor.connected = True
                self.connected = sensor
        self._supervise(now)

    def _supervise(self, now: float) -> None:
        sensor = self.connected
        if sensor is None or (sensor.connected and sensor.in_range):
            self._broken_since = math.inf
            return
        self._broken_since = min(self._broken_since, now)
        if now >= self._broken_since + SUPERVISION_TIME:
            self._disconnect(now)

    @staticmethod
    def _hears(sensor: SimulatedSth, now: float) -> bool:
        return sensor.in_range and sensor.is_up(now)

    def _disconnect(self, now: float) -> None:
        if self.connected is not None and self.connected.connected:
            self.connected.disconnect(now)
        self.connected = None
        self._scanning_since = now

    def _deactivate(self, now: float) -> None:
        self._disconnect(now)
        self.active = False
        self.found = {}
        self._connecting = None
        self._broken_since = math.inf
        self._confirm_mac = False

    def _status_bits(self) -> int:
        return self.active << 4 | 1 << 5 | (self.connected is not None) << 6

    def _bluetooth(self, payload: bytes, now: float) -> bytes:
        subcommand, number = payload[:2]
        handler = self._subcommands.get(subcommand)
        if handler is None:
            raise Refusal(NOT_AVAILABLE)
        head = bytes((subcommand, 0 if subcommand in (4, 17) else number))  # errata C5
        return head + handler(payload, now).ljust(6, b"\0")

    def _device(self, number: int) -> SimulatedSth | None:
        """Return a device by its number, also one that an earlier activation showed."""
        devices = list(self.found) or self._known
        return devices[number] if self.active and number < len(devices) else None

    def _is_new(self, sensor: SimulatedNode, now: float) -> bool:
        return (isinstance(sensor, SimulatedSth) and self.connected is None
                and now < self.found.get(sensor, -math.inf) + self.faults.newness)

    def _activate(self, payload: bytes, now: float) -> bytes:
        if not self.active:
            self.active = True
            self._scanning_since = now
        return b""

    def _count(self, payload: bytes, now: float) -> bytes:
        return str(len(self.found)).encode()

    def _write_name(self, payload: bytes, now: float) -> bytes:
        self._write_name_part(payload[0], payload)
        return payload[2:]

    def _read_name(self, payload: bytes, now: float) -> bytes:
        node = self if payload[1] == SELF else self._device(payload[1])
        if node is None or (payload[0] == 6 and self._is_new(node, now)):
            return b""  # of a new sensor only the first part is there
        return node._name_part(payload[0])

    def _connect_number(self, payload: bytes, now: float) -> bytes:
        return bytes((self._connect(self._device(payload[1]), now),))

    def _connect_mac(self, payload: bytes, now: float) -> bytes:
        """Answer with the address once, when the connection stands, else with zeros."""
        wanted = payload[7:1:-1]
        if self.connected is not None:
            confirm, self._confirm_mac = self._confirm_mac, False
            return encode_mac(self.connected.mac)[::-1] if confirm else b""
        sensor = next((one for one in (*self.found, *self._known)
                       if encode_mac(one.mac) == wanted), None)
        self._confirm_mac = self._connect(sensor, now)
        return b""

    def _connect(self, sensor: SimulatedSth | None, now: float) -> bool:
        """Begin to connect; whether the sensor is known and the unit is searching."""
        if not self.active or sensor is None or self.connected is not None:
            return False
        if self.faults.refused_connects > 0:
            self.faults.refused_connects -= 1
        elif self._connecting is None:
            self._connecting = sensor, now + CONNECT_TIME + self.faults.connect_time
        return True

    def _check_connected(self, payload: bytes, now: float) -> bytes:
        return bytes((self.connected is not None,))

    def _deactivate_command(self, payload: bytes, now: float) -> bytes:
        self._deactivate(now)
        return b""

    def _rssi(self, payload: bytes, now: float) -> bytes:
        sensor = self.connected if payload[1] == SELF else self._device(payload[1])
        return struct.pack("b", 0 if sensor is None or self._is_new(sensor, now) else sensor.rssi)

    def _read_mac(self, payload: bytes, now: float) -> bytes:
        node = self if payload[1] == SELF else self._device(payload[1])
        return b"" if node is None or self._is_new(node, now) else encode_mac(node.mac)[::-1]

    def _energy_times(self, payload: bytes, now: float) -> bytes:
        return self._energy(payload[0], payload)

    def _send_counter(self, payload: bytes, now: float) -> bytes:
        return self.radio_sent.to_bytes(6, "big")

    def _receive_counter(self, payload: bytes, now: float) -> bytes:
        return self.radio_received.to_bytes(6, "big")
