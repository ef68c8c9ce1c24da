# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A simulated sensor (STH): it measures the vibration and answers the commands, without I/O."""

from __future__ import annotations

import itertools
import math
import struct
import time

import numpy as np
import numpy.typing as npt

from icotronic_driver.commands import CONFIGURATION, LED_NUMBER, STREAMING, TEMPERATURE_REFERENCE
from icotronic_driver.eeprom import CALIBRATION, STH_EEPROM
from icotronic_driver.identifier import MAX_PAYLOAD, MAX_PAYLOAD_FD, STH_1, Identifier
from icotronic_driver.laws import PARTS_BY_NUMBER, STANDARD_GRAVITY, Law
from icotronic_driver.simulator.scene import Times, Vibration, vibration
from icotronic_driver.simulator.unit import (
    BOOT_TIME,
    NOT_AVAILABLE,
    UNSUPPORTED_FORMAT,
    Refusal,
    SimulatedNode,
)
from icotronic_driver.streaming import SUPPLY_DIVIDER, StreamFormat
from icotronic_driver.values import (
    ACQUISITION_TIMES,
    OVERSAMPLING_RATES,
    REFERENCE_VOLTAGES,
    AdcConfiguration,
    CalibrationElement,
    CalibrationMethod,
    NetworkState,
    encode_mac,
)

ADVERTISEMENT = 0.02  # s between two advertisements before any energy mode begins
SENSOR_SUPPLY = 3.3  # V
ACCELERATION_AXES = {1: 0, 2: 1, 3: 2, 4: 0}  # by the number of the sensor (field note N7)
USED_SENSORS = (1, 2, 3)  # after a reset
SELF_TEST = 0.1  # V by which the self test deflects it
FIRST_MAC = "08:6B:D7:01:DE:81"

_CALIBRATION_OFFSETS: dict[int, int] = {
    CalibrationElement.ACCELERATION: 0, CalibrationElement.VOLTAGE: 24,
    CalibrationElement.TEMPERATURE: 48}  # in the page of section 8.2.1.4


class _Stream:
    """A stream of measured values with exact timing.

    Value number n is measured at `start + n / rate`; a frame is sent when its last one is.
    """

    def __init__(self, identifier: Identifier, format: StreamFormat, rate: float,
                 start: float) -> None:
        self.can_id = identifier.encode()
        self.format = format
        self.counter = 0
        self.begin(start, rate)

    def begin(self, start: float, rate: float) -> None:
        """Continue at another rate; tuples per s."""
        self.start, self.rate = start, rate
        self.sent = 0  # frames since the start

    def times(self, first: int, count: int) -> Times:
        """Return when values are measured."""
        return self.start + np.arange(first, first + count) / self.rate

    def due(self, frame: int) -> float:
        """Return when a frame is sent."""
        return self.start + ((frame + 1) * self.format.data_sets - 1) / self.rate

    def count_due(self, now: float) -> int:
        """Return how many frames are to be sent by now."""
        done = math.floor(((now - self.start) * self.rate + 1) / self.format.data_sets)
        return max(0, done - self.sent)


def _volts_per_unit(law: Law) -> float:
    return (law.volts[1] - law.volts[0]) / (law.values[1] - law.values[0])


class SimulatedSth(SimulatedNode):
    """A sensor, without I/O.

    Attributes:
        vibration: Truth of what it measures; can be replaced.
        noise: Standard deviation of its noise in g.
        battery: Voltage of its battery in V.
        light: What its photodiode sees, 0 … 1.
        backpacks: What its three backpacks measure, 0 … 1 each.
        temperature: Its temperature in °C.
        rssi: How strong its radio signal is, in dBm.
        in_range: Whether radio frames get through.
        adc: Its ADC configuration.
        first_sensors: Numbers of the sensors on its three channels after a reset.
        used_sensors: Those at present.
        led: Whether its LED is on.
        clock_error: By which fraction its clock runs fast.
        can_fd: Whether it sends frames of up to 64 bytes.
        connected: Whether it has a connection to the stationary unit.
    """

    def __init__(self, name: str, mac: str = FIRST_MAC, *, calibrated: bool = True,
                 can_fd: bool = False) -> None:
        """Power it on for the first time; without calibration its factors are 0 (errata C9)."""
        self.can_fd = can_fd
        self.vibration: Vibration = vibration
        self.noise = 0.0
        self.battery = 3.71
        self.light = 0.3
        self.backpacks = (0.25, 0.5, 0.75)
        self.first_sensors = USED_SENSORS
        self.temperature = 24.5
        self.rssi = -52
        self.in_range = True
        self.clock_error = 0.0
        self.streams: dict[int, _Stream] = {}  # by block command
        super().__init__(STH_1, mac, dict(STH_EEPROM), "STH Name")
        self.name = name
        self.advertises_since = self.booted
        self._singles = 0
        self._random = np.random.default_rng(1)
        self._wall_offset = time.time() - time.monotonic()
        if calibrated:
            for axis, number in zip("XYZ", USED_SENSORS, strict=True):
                slope, offset = PARTS_BY_NUMBER[number].law.factors(SENSOR_SUPPLY)
                self.eeprom[f"Acceleration {axis}: Slope"] = slope / STANDARD_GRAVITY
                self.eeprom[f"Acceleration {axis}: Offset"] = offset / STANDARD_GRAVITY
        self._handlers.update({
            (STREAMING, 0x00): lambda payload, now: self._stream(0x00, payload[0], now),
            (STREAMING, 0x20): lambda payload, now: self._stream(0x20, payload[0], now),
            (CONFIGURATION, 0x00): self._adc_command,
            (CONFIGURATION, 0x01): self._used_sensors_command,
            (CONFIGURATION, 0x60): lambda payload, now: self._calibration(0, payload),
            (CONFIGURATION, 0x61): lambda payload, now: self._calibration(4, payload),
            (CONFIGURATION, 0x62): self._measurement, (CONFIGURATION, 0xC0): self._led_command,
        })

    # --- for tests and people ---

    def boot(self, now: float) -> None:
        """Lose the RAM, the connection and the streams."""
        super().boot(now)
        self.adc = AdcConfiguration()  # section 10.5.1.1.6
        self.used_sensors = self.first_sensors
        self.led = True
        self.connected = False
        self.self_test: set[int] = set()
        self.streams.clear()
        self.advertises_since = now + BOOT_TIME
        self._result = bytes(4)

    def raw_values(self, times: Times) -> npt.NDArray[np.uint16]:
        """Return what the ADC makes of the truth, shape (times, 3 channels), without noise."""
        return self._quantized(self.voltages(times), 0xFFFF).astype(np.uint16)

    def voltages(self, times: Times) -> npt.NDArray[np.float64]:
        """Return the voltages of the sensors on the three channels."""
        accelerations = self.vibration(times)
        others = {5: self.temperature, 6: self.light, 10: self.battery,
                  **dict(zip((7, 8, 9), self.backpacks, strict=True))}
        columns = []
        for channel, number in enumerate(self.used_sensors, 1):
            values = (accelerations[:, ACCELERATION_AXES[number]] if number in ACCELERATION_AXES
                      else np.full(len(times), others[number]))
            law = PARTS_BY_NUMBER[number].law
            columns.append(law.volts[0] + (values - law.values[0]) * _volts_per_unit(law)
                           + SELF_TEST * (channel in self.self_test))
        return np.column_stack(columns)

    def sample_times(self, first: int, count: int, block_command: int = 0x00) -> Times:
        """Return when values of the running stream are measured, in s since the epoch."""
        stream = self.streams[block_command]
        return stream.times(first, count) + self._wall_offset

    def advertisement_interval(self, now: float) -> float:
        """Return the s between two advertisements; long ones in the energy modes."""
        idle = now - self.advertises_since
        first, second = (float(self.eeprom[f"Sleep Time {n}"]) for n in (1, 2))
        if idle < first and self.state is not NetworkState.STANDBY:
            return ADVERTISEMENT
        return float(self.eeprom[f"Advertisement Time {1 if idle < first + second else 2}"])

    # --- protocol ---

    def disconnect(self, now: float) -> None:
        """Stop measuring and advertise again."""
        self.connected = False
        self.streams.clear()
        self.advertises_since = now

    def _bluetooth(self, payload: bytes, now: float) -> bytes:
        """Answer for itself, whatever the device number is (section 10.2.6)."""
        subcommand, number = payload[:2]
        if subcommand in (3, 4):
            self._write_name_part(subcommand, payload)
            return bytes((subcommand, 0 if subcommand == 4 else number)) + payload[2:]  # errata C5
        if subcommand in (5, 6):
            return payload[:2] + self._name_part(subcommand)
        if subcommand == 12:
            return payload[:2] + struct.pack("b5x", self.rssi)
        if subcommand in (13, 14, 15, 16):
            head = payload[:2] if subcommand in (13, 15) else bytes((subcommand - 1, 0))  # C5
            return head + self._energy(subcommand, payload)
        if subcommand == 17:
            return bytes((subcommand, 0)) + encode_mac(self.mac)[::-1]  # errata C5
        raise Refusal(NOT_AVAILABLE)

    def _adc_command(self, payload: bytes, now: float) -> bytes:
        if payload[0] & 0x80:
            prescaler, acquisition, oversampling, reference = payload[1:5]
            if (not 1 <= prescaler <= 127 or acquisition >= len(ACQUISITION_TIMES)
                    or oversampling >= len(OVERSAMPLING_RATES)
                    or reference / 20 not in REFERENCE_VOLTAGES):
                raise Refusal(UNSUPPORTED_FORMAT)
            self.adc = AdcConfiguration.decode(payload[1:5])
            for stream in self.streams.values():
                stream.begin(now, self._tuple_rate(stream.format))
        return payload[:1] + self.adc.encode() + bytes(3)

    def _used_sensors_command(self, payload: bytes, now: float) -> bytes:
        if payload[0] & 0x80:
            if not set(payload[1:4]) <= {0, *PARTS_BY_NUMBER}:
                raise Refusal(NOT_AVAILABLE)
            x, y, z = (new or old for new, old in zip(payload[1:4], self.used_sensors,
                                                      strict=True))  # section 10.5.2.1
            self.used_sensors = (x, y, z)
        return bytes((payload[0] & 0x80, *self.used_sensors)) + bytes(4)

    def _calibration(self, offset: int, payload: bytes) -> bytes:
        """Read or write slope (offset 0) or offset (4) in the EEPROM's page of section 8.2.1.4."""
        element, axis = payload[:2]
        if element not in _CALIBRATION_OFFSETS or not 1 <= axis <= 3:
            raise Refusal(NOT_AVAILABLE)
        place = _CALIBRATION_OFFSETS[element] + 8 * (axis - 1) + offset
        if payload[2] & 0x80:
            self.eeprom.write(CALIBRATION, place, payload[7:3:-1])  # big endian on the wire
        return payload[:2] + bytes(2) + self.eeprom.read(CALIBRATION, place, 4)[::-1]

    def _measurement(self, payload: bytes, now: float) -> bytes:
        """Do a calibration measurement, or repeat the result of the last one."""
        if payload[0] & 0x80:
            method = CalibrationMethod(payload[0] >> 5 & 3)
            element, dimension, reference = payload[1], payload[2], payload[3] / 20
            if method is CalibrationMethod.ACTIVATE:
                self.self_test.add(dimension)
            elif method is CalibrationMethod.DEACTIVATE:
                self.self_test.discard(dimension)
            elif method is CalibrationMethod.MEASURE:
                self._result = self._measured(element, dimension, reference, now)
        return payload[:4] + self._result

    def _measured(self, element: int, dimension: int, reference: float, now: float) -> bytes:
        if not 1 <= dimension <= 3 or reference not in REFERENCE_VOLTAGES:
            raise Refusal(UNSUPPORTED_FORMAT)
        if element == CalibrationElement.TEMPERATURE and reference == TEMPERATURE_REFERENCE:
            return struct.pack("<i", round(self.temperature * 1000))
        voltages = {
            CalibrationElement.ACCELERATION: self._voltages_now(now)[dimension - 1],
            CalibrationElement.TEMPERATURE: 0.7 + 0.002 * self.temperature,
            CalibrationElement.VOLTAGE: self._supplies()[dimension - 1],
            CalibrationElement.GROUND: 0.0, CalibrationElement.SUPPLY: SENSOR_SUPPLY,
            CalibrationElement.REGULATED_POWER: 1.85, CalibrationElement.AMPLIFIER_OUTPUT: 1.65}
        if element not in voltages:
            raise Refusal(NOT_AVAILABLE)
        voltage = voltages[CalibrationElement(element)]
        return struct.pack("<I", min(0xFFFF, max(0, round(voltage / reference * 0xFFFF))))

    def _led_command(self, payload: bytes, now: float) -> bytes:
        if payload[0] & 0x7F != 1 or payload[1] != LED_NUMBER:
            raise Refusal(NOT_AVAILABLE)
        if payload[0] & 0x80:
            if payload[2] not in (1, 2):
                raise Refusal(UNSUPPORTED_FORMAT)
            self.led = payload[2] == 1
        return payload[:2] + bytes((1 if self.led else 2,)) + bytes(5)

    # --- measured values ---

    def _stream(self, block_command: int, code: int, now: float) -> bytes | None:
        """Start or stop a stream, or answer a single request (section 10.3)."""
        format = StreamFormat.decode(code)
        running = self.streams.get(block_command)
        if format.data_sets == 0:
            self.streams.pop(block_command, None)
            return bytes((code,))  # errata C6
        size = 2 + format.values_per_frame * format.value_size
        if format.channel_count == 0 or size > (MAX_PAYLOAD_FD if self.can_fd else MAX_PAYLOAD):
            raise Refusal(UNSUPPORTED_FORMAT)
        if not format.stream:
            self._singles = (self._singles + 1) & 0xFF
            times = now - np.arange(format.data_sets)[::-1] / self._tuple_rate(format)
            head = np.array([[code, self._singles]], np.uint8)
            return self._frames(block_command, format, times, head)[0]
        if running is None or running.format != format:
            identifier = Identifier(STREAMING, block_command, STH_1, self._host, request=False)
            self.streams[block_command] = _Stream(identifier, format, self._tuple_rate(format),
                                                  now)
        return None  # the first data frame is the acknowledgement (errata C6)

    def _tuple_rate(self, format: StreamFormat) -> float:
        """Return the data sets per s: the active channels share the ADC (errata C7)."""
        return self.adc.sample_rate * (1 + self.clock_error) / format.channel_count

    def next_frame(self) -> float:
        """Return when the next data frame of any stream is due; inf without streams."""
        return min((stream.due(stream.sent) for stream in self.streams.values()),
                   default=math.inf)

    def poll(self, now: float) -> list[tuple[float, int, bytes]]:
        """Return time, identifier and payload of the data frames that are due."""
        frames: list[tuple[float, int, bytes]] = []
        for block_command, stream in self.streams.items():
            count = stream.count_due(now)
            if count:
                sets = stream.format.data_sets
                first = stream.sent * sets
                times = stream.times(first, count * sets)
                head = np.empty((count, 2), np.uint8)
                head[:, 0] = stream.format.encode()
                head[:, 1] = np.arange(stream.counter, stream.counter + count)
                payloads = self._frames(block_command, stream.format, times, head)
                dues = times[sets - 1::sets].tolist()
                frames += zip(dues, itertools.repeat(stream.can_id), payloads, strict=False)
                stream.sent += count
                stream.counter = (stream.counter + count) & 0xFF
        if len(self.streams) > 1:
            frames.sort()
        return frames

    def _frames(self, block_command: int, format: StreamFormat, times: Times,
                head: npt.NDArray[np.uint8]) -> list[bytes]:
        """Return payloads: format and counter in front of the values at some monotonic times."""
        if block_command == 0x00:
            voltages = self.voltages(times + self._wall_offset)
            if self.noise:
                voltages += self._random.normal(0, self.noise, voltages.shape) * [
                    _volts_per_unit(PARTS_BY_NUMBER[number].law) * (number in ACCELERATION_AXES)
                    for number in self.used_sensors]
        else:
            voltages = np.tile(np.array(self._supplies()), (len(times), 1))
        active = np.array(format.channels)
        raw = self._quantized(voltages[:, active], format.full_scale).astype("<u4", order="C")
        count, size = len(head), format.frame_length
        table = np.zeros((count, size), np.uint8)
        table[:, :2] = head
        values = raw.reshape(count, -1).view(np.uint8).reshape(count, -1, 4)
        end = 2 + format.values_per_frame * format.value_size
        table[:, 2:end] = values[:, :, :format.value_size].reshape(count, -1)
        data = table.tobytes()
        return [data[start:start + size] for start in range(0, len(data), size)]

    def _quantized(self, voltages: npt.NDArray[np.float64],
                   full_scale: int) -> npt.NDArray[np.float64]:
        raw = np.rint(voltages * (full_scale / self.adc.reference_voltage))
        return np.clip(raw, 0, full_scale)

    def _voltages_now(self, now: float) -> list[float]:
        return list(self.voltages(np.array([now + self._wall_offset]))[0])

    def _supplies(self) -> tuple[float, float, float]:
        """Return voltage 1 behind its divider (errata C8), and voltages 2 and 3."""
        return self.battery / SUPPLY_DIVIDER, SENSOR_SUPPLY / 2, 0.0
