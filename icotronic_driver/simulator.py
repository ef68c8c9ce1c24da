"""A simulated ICOtronic system: a stationary unit (STU) and sensors (STH) behind it, real bytes.

`SimulatedNetwork` is sans-I/O; see `driver_common.simulated_bus` for the wire. The truth of what
the sensors measure is the function `vibration`.
"""

from __future__ import annotations

import heapq
import itertools
import math
import random
import struct
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from driver_common.errors import DriverError, FrameError, WrongDeviceError
from driver_common.simulated_bus import CanFrame, SimulatedBus
from icotronic_driver.commands import (
    ACQUISITION_TIMES,
    CONFIGURATION,
    EEPROM,
    EEPROM_CHUNK,
    OVERSAMPLING_RATES,
    PRODUCT_DATA,
    REFERENCE_VOLTAGES,
    SELF,
    STATISTICS,
    STREAMING,
    SYSTEM,
    TEMPERATURE_REFERENCE,
    TEST,
    AdcConfiguration,
    CalibrationElement,
    CalibrationMethod,
    CodeLocation,
    NetworkState,
    decode_mac,
    encode_mac,
)
from icotronic_driver.eeprom import (
    CALIBRATION,
    PAGE_SIZE,
    STH_EEPROM,
    STU_EEPROM,
    Field,
    FieldValue,
    Status,
)
from icotronic_driver.eeprom import PRODUCT_DATA as PRODUCT_PAGE
from icotronic_driver.eeprom import STATISTICS as STATISTICS_PAGE
from icotronic_driver.identifier import (
    BROADCAST,
    BROADCAST_SILENT,
    MAX_PAYLOAD,
    MAX_PAYLOAD_FD,
    SPU_1,
    STH_1,
    STU_1,
    Identifier,
)
from icotronic_driver.streaming import SUPPLY_DIVIDER, Calibration, StreamFormat

STU_DELAY, STH_DELAY = 0.001, 0.004  # s until the answer; the sensor's goes over the radio
BOOT_TIME = 0.2  # s without answers after a reset
STARTUP_TIME = 0.1  # s after it in which a node says it starts up
ADVERTISEMENT = 0.02  # s between two advertisements before any energy mode begins
CONNECT_TIME = 0.03  # s from the request until the connection stands
SUPERVISION_TIME = 0.5  # s after which a broken connection is noticed
SENSOR_RANGE = 100.0  # g; the sensor's ± limit
SENSOR_SUPPLY = 3.3  # V; an acceleration sensor gives half of it at zero
SELF_TEST = 0.1  # V by which the self test deflects it
SWEEP_TIME = 10.0  # s in which the sine sweeps up and down
SWEEP_FREQUENCIES = (20.0, 500.0)  # Hz
IMPACT_INTERVAL, IMPACT_FREQUENCY, IMPACT_DECAY = 2.0, 400.0, 0.01  # s, Hz, s
FIRST_MAC = "08:6B:D7:01:DE:81"

NOT_AVAILABLE, GENERAL_ERROR, WRITE_NOT_ALLOWED, UNSUPPORTED_FORMAT = 1, 2, 3, 4  # section 10.9

_CALIBRATION_OFFSETS: dict[int, int] = {
    CalibrationElement.ACCELERATION: 0, CalibrationElement.VOLTAGE: 24,
    CalibrationElement.TEMPERATURE: 48}  # in the page of section 8.2.1.4

Times = npt.NDArray[np.float64]


def vibration(times: Times) -> npt.NDArray[np.float64]:
    """Return the truth: acceleration in x, y and z in g at times in s since the epoch.

    A sine that sweeps in x and, smaller and a quarter turn later, in y; an impact every two
    seconds in y and z; gravity in z.

    Args:
        times: Any number of times.

    Returns:
        Shape (times, 3).
    """
    low, high = SWEEP_FREQUENCIES
    turn = 2 * math.pi * (times % SWEEP_TIME) / SWEEP_TIME
    # The frequency goes from low to high and back like a cosine; this is its integral.
    phase = SWEEP_TIME * ((low + high) / 2 * turn - (high - low) / 2 * np.sin(turn))
    since = times % IMPACT_INTERVAL
    impact = np.exp(-since / IMPACT_DECAY) * np.sin(2 * math.pi * IMPACT_FREQUENCY * since)
    return np.column_stack((5.0 * np.sin(phase), 2.0 * np.cos(phase) + 30.0 * impact,
                            1.0 + 10.0 * impact))


Vibration = Callable[[Times], npt.NDArray[np.float64]]


class Refusal(Exception):  # noqa: N818
    """The node answers with an error acknowledgement."""

    def __init__(self, number: int, *details: int) -> None:
        """Take the number of section 10.9 and the bytes behind it."""
        self.payload = bytes((number, *details)).ljust(8, b"\0")


@dataclass
class Faults:
    """How the system misbehaves; may be changed at any time.

    Attributes:
        loss: Probability that a radio frame with measured values is lost.
        loss_run: How many are lost in a row.
        duplicate: Probability that such a frame comes twice.
        jitter: Time in s by which such a frame comes late, at most.
        burst: Time in s for which such frames are held back, to come all at once.
        answer_loss: Probability that an answer of a sensor is lost.
        refused_connects: How many of the next attempts to connect fail.
        foreign: Frames per s on the bus that belong to something else.
        silent: Whether nothing gets through.
    """

    loss: float = 0.0
    loss_run: int = 1
    duplicate: float = 0.0
    jitter: float = 0.0
    burst: float = 0.0
    answer_loss: float = 0.0
    refused_connects: int = 0
    foreign: float = 0.0
    silent: bool = False
    random: random.Random = field(default_factory=lambda: random.Random(1))

    @property
    def spare_stream(self) -> bool:
        """Whether frames with measured values get through as they are."""
        return not (self.loss or self.duplicate or self.jitter or self.burst)


class SimulatedEeprom:
    """Pages of 256 bytes with fields in them.

    Attributes:
        fields: The fields, by name.
        writes: Write requests since the first power-on.
    """

    def __init__(self, fields: dict[str, Field]) -> None:
        """Fill it with the defaults."""
        self.fields = fields
        self.writes = 0
        self._pages: dict[int, bytearray] = {}
        for each in fields.values():
            if each.default is not None:
                self[each.name] = each.default

    def __getitem__(self, name: str) -> FieldValue:
        """Return the value of a field."""
        each = self.fields[name]
        return each.decode(self.read(each.page, each.offset, each.length))

    def __setitem__(self, name: str, value: FieldValue) -> None:
        """Change a field, behind the protocol's back."""
        each = self.fields[name]
        self._store(each.page, each.offset, each.encode(value))

    def number(self, name: str) -> int:
        """Return the value of a field that is a whole number."""
        value = self[name]
        assert isinstance(value, int)
        return value

    def read(self, page: int, offset: int, length: int) -> bytes:
        """Return bytes of a page."""
        return bytes(self._page(page)[offset:offset + length])

    def write(self, page: int, offset: int, content: bytes) -> None:
        """Write as the protocol does; raises Refusal where the EEPROM is locked."""
        end = offset + len(content)
        if Status.of(self.number("EEPROM Status")) is Status.LOCKED and any(
                each.read_only and each.page == page
                and each.offset < end and offset < each.offset + each.length
                for each in self.fields.values()):
            raise Refusal(WRITE_NOT_ALLOWED)
        self.writes += 1
        self._store(page, offset, content)

    def initialize(self) -> None:
        """Store the defaults of the first page, as a reset does where they never were."""
        if Status.of(self.number("EEPROM Status")) is Status.UNINITIALIZED:
            for each in self.fields.values():
                if each.page == 0 and each.default is not None:
                    self[each.name] = each.default

    def _page(self, page: int) -> bytearray:
        return self._pages.setdefault(page, bytearray(PAGE_SIZE))

    def _store(self, page: int, offset: int, content: bytes) -> None:
        self._page(page)[offset:offset + len(content)] = content


Handler = Callable[[bytes, float], bytes | None]


class SimulatedNode:
    """What sensors and stationary units have in common, without I/O.

    Attributes:
        number: Node number.
        mac: MAC address.
        eeprom: Its EEPROM.
        state: Its network state, as far as it was set.
        refuse: Commands, as (block, block command), which it refuses although it could.
    """

    def __init__(self, number: int, mac: str, fields: dict[str, Field], name_field: str) -> None:
        """Power it on for the first time."""
        self.number = number
        self.mac = mac
        self.eeprom = SimulatedEeprom(fields)
        self.refuse: set[tuple[int, int]] = set()
        self._name_field = name_field
        self._host = SPU_1
        self._handlers: dict[tuple[int, int], Handler] = {
            (SYSTEM, 0x01): self._reset, (SYSTEM, 0x02): self._state_command,
            (SYSTEM, 0x05): self._node_status, (SYSTEM, 0x06): self._error_status,
            (SYSTEM, 0x0B): self._bluetooth,
            (STATISTICS, 0x00): self._power_cycles, (STATISTICS, 0x01): self._operating_time,
            (STATISTICS, 0x02): lambda _, now: self._counter("Under Voltage Counter"),
            (STATISTICS, 0x03): lambda _, now: self._counter("Watchdog Reset Counter"),
            (STATISTICS, 0x04): lambda _, now: self.eeprom.read(STATISTICS_PAGE, 20, 8),
            (EEPROM, 0x00): self._read_eeprom, (EEPROM, 0x01): self._write_eeprom,
            (EEPROM, 0x20): lambda _, now: struct.pack("<II", 0, self.eeprom.writes),
            (TEST, 0x01): lambda payload, now: payload,
        }
        for part in range(PAGE_SIZE // 8):  # the page of section 8.2.1.2 in pieces of 8 bytes
            self._handlers[PRODUCT_DATA, part] = self._product_data(part)
        self._fill_product_data()
        self.boot(time.monotonic() - BOOT_TIME - STARTUP_TIME)

    @property
    def name(self) -> str:
        """Name under which it advertises."""
        return str(self.eeprom[self._name_field])

    @name.setter
    def name(self, name: str) -> None:
        self.eeprom[self._name_field] = name

    def boot(self, now: float) -> None:
        """Lose the RAM and begin anew; a reset counts as power-on (section 8.2.1.3.1)."""
        self.state = NetworkState.OPERATING
        self.booted = now
        self.eeprom.initialize()
        self.eeprom["Power On Cycles"] = self.eeprom.number("Power On Cycles") + 1

    def is_up(self, now: float) -> bool:
        """Whether it has booted."""
        return now >= self.booted + BOOT_TIME

    def answer(self, request: Identifier, payload: bytes, now: float,
               ) -> tuple[bool, bytes] | None:
        """Return whether the answer is an error, and its payload; None where there is none."""
        command = request.block, request.block_command
        handler = self._handlers.get(command)
        self._host = request.sender
        try:
            if handler is None or command in self.refuse:
                raise Refusal(NOT_AVAILABLE)
            answer = handler(payload.ljust(8, b"\0"), now)
        except Refusal as refusal:
            return True, refusal.payload
        return None if answer is None else (False, answer)

    def _fill_product_data(self) -> None:
        versions = {"Hardware Version": (1, 4, 0), "Firmware Version": (2, 1, 10)}
        for name, version in versions.items():
            for part, value in zip(("Major", "Minor", "Patch"), version, strict=True):
                self.eeprom[f"{name}: {part}"] = value
        for name, text in (("Year", "2021"), ("Month", "10"), ("Day", "05")):
            self.eeprom[f"Production Date: {name}"] = text
        self.eeprom["Batch Number"] = 1

    def _product_data(self, part: int) -> Handler:
        return lambda payload, now: self.eeprom.read(PRODUCT_PAGE, 8 * part, 8)

    def _reset(self, payload: bytes, now: float) -> bytes:
        self.boot(now)
        return b""

    def _state_command(self, payload: bytes, now: float) -> bytes:
        location, state = payload[0] >> 4 & 3, NetworkState(payload[0] & 7)
        if payload[0] & 0x80:
            if location == CodeLocation.BOOTLOADER:
                raise Refusal(0, 2)  # wrong subscriber
            if state not in (NetworkState.STANDBY, NetworkState.OPERATING,
                             NetworkState.NO_CHANGE):
                raise Refusal(0, 1)  # set state not available
            if state is not NetworkState.NO_CHANGE:
                self.state = state
        return bytes((payload[0] & 0x80 | CodeLocation.APPLICATION << 4
                      | self._network_state(now),))

    def _network_state(self, now: float) -> NetworkState:
        starting = now < self.booted + BOOT_TIME + STARTUP_TIME
        return NetworkState.STARTUP if starting else self.state

    def _node_status(self, payload: bytes, now: float) -> bytes:
        word = self._network_state(now) << 1 | self._status_bits()
        if any(payload[4:]):
            raise Refusal(1, 0, 0, *struct.pack("<I", word), 0)  # using the mask is not allowed
        return struct.pack("<II", word, 0)

    def _error_status(self, payload: bytes, now: float) -> bytes:
        if any(payload[4:]):
            raise Refusal(1)
        return bytes(8)

    def _status_bits(self) -> int:
        return 0

    def _bluetooth(self, payload: bytes, now: float) -> bytes:
        raise NotImplementedError

    def _name_part(self, subcommand: int) -> bytes:
        text = self.eeprom.read(0, 1, 8)
        return (text[:6] if subcommand == 5 else text[6:]).ljust(6, b"\0")

    def _write_name_part(self, subcommand: int, payload: bytes) -> None:
        if subcommand == 3:  # the second part becomes empty, section 10.2.6
            self.eeprom.write(0, 1, payload[2:8] + bytes(2))
        else:
            self.eeprom.write(0, 7, payload[2:4])

    def _energy(self, subcommand: int, payload: bytes) -> bytes:
        """Read or write the times of an energy mode; zeros are a read (section 10.2.6)."""
        offset = 9 if subcommand in (13, 14) else 15
        if subcommand in (14, 16) and any(payload[2:8]):
            self.eeprom.write(0, offset, payload[2:8])
        return self.eeprom.read(0, offset, 6)

    def _counter(self, name: str) -> bytes:
        return struct.pack(">II", self.eeprom.number(name), 0)

    def _power_cycles(self, payload: bytes, now: float) -> bytes:
        return struct.pack(">II", self.eeprom.number("Power On Cycles"),
                           self.eeprom.number("Power Off Cycles"))

    def _operating_time(self, payload: bytes, now: float) -> bytes:
        since_reset = max(0, int(now - self.booted))
        return struct.pack(">II", since_reset, self.eeprom.number("Operating Time") + since_reset)

    def _read_eeprom(self, payload: bytes, now: float) -> bytes:
        page, offset, length = self._area(payload)
        content = self.eeprom.read(page, offset, length)
        return payload[:3] + b"\0" + content.ljust(EEPROM_CHUNK, b"\0")

    def _write_eeprom(self, payload: bytes, now: float) -> bytes:
        page, offset, length = self._area(payload)
        self.eeprom.write(page, offset, payload[4:4 + length])
        return payload

    def _area(self, payload: bytes) -> tuple[int, int, int]:
        page, offset, length = payload[:3]
        if not 1 <= length <= EEPROM_CHUNK or offset + length > PAGE_SIZE:
            raise Refusal(UNSUPPORTED_FORMAT)
        return page, offset, length


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


class SimulatedSth(SimulatedNode):
    """A sensor, without I/O.

    Attributes:
        vibration: Truth of what it measures; can be replaced.
        noise: Standard deviation of its noise in g.
        battery: Voltage of its battery in V.
        temperature: Its temperature in °C.
        rssi: How strong its radio signal is, in dBm.
        in_range: Whether radio frames get through.
        adc: Its ADC configuration.
        used_sensors: Numbers of the sensors on its three channels.
        led: Whether its LED is on.
        clock_error: By which fraction its clock runs fast.
        can_fd: Whether it sends frames of up to 64 bytes.
        connected: Whether it has a connection to the stationary unit.
    """

    SENSOR_COUNT = 5  # x, y, z, temperature, piezo

    def __init__(self, name: str, mac: str = FIRST_MAC, *, calibrated: bool = True,
                 can_fd: bool = False) -> None:
        """Power it on for the first time; without calibration its factors are 0 (errata C9)."""
        self.can_fd = can_fd
        self.vibration: Vibration = vibration
        self.noise = 0.0
        self.battery = 3.71
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
            calibration = Calibration.of_range(SENSOR_RANGE)
            for axis in "XYZ":
                self.eeprom[f"Acceleration {axis}: Slope"] = calibration.slope
                self.eeprom[f"Acceleration {axis}: Offset"] = calibration.offset
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
        self.used_sensors = (1, 2, 3)
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
        zero = SENSOR_SUPPLY / 2
        measured = zero + self.vibration(times) * (zero / SENSOR_RANGE)
        columns = []
        for channel, sensor in enumerate(self.used_sensors, 1):
            if sensor <= 3:
                columns.append(measured[:, sensor - 1] + SELF_TEST * (channel in self.self_test))
            else:  # a temperature sensor and a piezo element at rest
                columns.append(np.full(len(times), SENSOR_SUPPLY * {4: 0.16, 5: 0.58}[sensor]))
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
            if max(payload[1:4]) > self.SENSOR_COUNT:
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
        if payload[0] & 0x7F != 1 or payload[1] != 0:
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
                voltages += self._random.normal(
                    0, self.noise * SENSOR_SUPPLY / 2 / SENSOR_RANGE, voltages.shape)
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


class SimulatedStu(SimulatedNode):
    """The stationary unit: it finds sensors, connects to one and passes its frames on.

    Attributes:
        sensors: The sensors around it.
        faults: How the system misbehaves.
        active: Whether Bluetooth is activated.
        found: The sensors that it has found; the index is the device number.
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
        self.found: list[SimulatedSth] = []
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
        self.radio_sent = self.radio_received = 0
        self._deactivate(now)

    def update(self, now: float) -> None:
        """Find sensors, finish connecting, and notice a broken connection."""
        if self.active and self.connected is None:
            self.found = [sensor for sensor in self.found if self._hears(sensor, now)]
            self.found += [sensor for sensor in self.sensors
                           if sensor not in self.found and self._hears(sensor, now)
                           and max(self._scanning_since, sensor.advertises_since)
                           + sensor.advertisement_interval(now) <= now]
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
        self.found = []
        self._asked = False
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
        return self.found[number] if self.active and number < len(self.found) else None

    def _activate(self, payload: bytes, now: float) -> bytes:
        if not self.active:
            self.active = True
            self._scanning_since = now
        return b""

    def _count(self, payload: bytes, now: float) -> bytes:
        self._asked = True
        return str(len(self.found)).encode()

    def _write_name(self, payload: bytes, now: float) -> bytes:
        self._write_name_part(payload[0], payload)
        return payload[2:]

    def _read_name(self, payload: bytes, now: float) -> bytes:
        node = self if payload[1] == SELF else self._device(payload[1])
        return node._name_part(payload[0]) if node else b""

    def _connect_number(self, payload: bytes, now: float) -> bytes:
        return bytes((self._connect(self._device(payload[1]), now),))

    def _connect_mac(self, payload: bytes, now: float) -> bytes:
        """Answer with the address once, when the connection stands, else with zeros."""
        wanted = payload[7:1:-1]
        if self.connected is not None:
            confirm, self._confirm_mac = self._confirm_mac, False
            return encode_mac(self.connected.mac)[::-1] if confirm else b""
        sensor = next((one for one in self.found if encode_mac(one.mac) == wanted), None)
        self._confirm_mac = self._connect(sensor, now)
        return b""

    def _connect(self, sensor: SimulatedSth | None, now: float) -> bool:
        """Begin to connect; whether a sensor was found and the unit is searching."""
        if not (self.active and self._asked) or sensor is None or self.connected is not None:
            return False  # asking for the devices first is required, section 10.2.6
        if self.faults.refused_connects > 0:
            self.faults.refused_connects -= 1
        elif self._connecting is None:
            self._connecting = sensor, now + CONNECT_TIME
        return True

    def _check_connected(self, payload: bytes, now: float) -> bytes:
        return bytes((self.connected is not None,))

    def _deactivate_command(self, payload: bytes, now: float) -> bytes:
        self._deactivate(now)
        return b""

    def _rssi(self, payload: bytes, now: float) -> bytes:
        sensor = self.connected if payload[1] == SELF else self._device(payload[1])
        return struct.pack("b", sensor.rssi if sensor else 0)

    def _read_mac(self, payload: bytes, now: float) -> bytes:
        node = self if payload[1] == SELF else self._device(payload[1])
        return encode_mac(node.mac)[::-1] if node else b""

    def _energy_times(self, payload: bytes, now: float) -> bytes:
        return self._energy(payload[0], payload)

    def _send_counter(self, payload: bytes, now: float) -> bytes:
        return self.radio_sent.to_bytes(6, "big")

    def _receive_counter(self, payload: bytes, now: float) -> bytes:
        return self.radio_received.to_bytes(6, "big")



_FOREIGN = (  # what else can be on a bus: standard frames, other versions, hosts and nodes
    CanFrame(0x04F, bytes.fromhex("A2 00 01 02 03 04 05 06"), extended=False),
    CanFrame(0x1100004F, bytes.fromhex("A2 00 01 02 03 04 05 06")),
    CanFrame(0x0100086F, bytes.fromhex("A2 00 01 02 03 04 05 06")),
    CanFrame(0x01000150, bytes.fromhex("A2 00 01 02 03 04 05 06")),
    CanFrame(0x18FEF100, bytes.fromhex("FF FF FF")),
    CanFrame(0x123, b"", extended=False),
)


class SimulatedNetwork:
    """Everything on the CAN bus, without I/O: a stationary unit and sensors around it.

    Attributes:
        sensors: The sensors.
        stu: The stationary unit.
        faults: How the system misbehaves.
        streamed: Data frames that were sent, duplicates among them.
        lost: Data frames that were lost on the radio.
        lock: To be held while several things are changed together.
    """

    def __init__(self, sensors: Sequence[SimulatedSth]) -> None:
        """Connect a stationary unit to the bus, with sensors around it."""
        self.sensors = list(sensors)
        self.faults = Faults()
        self.stu = SimulatedStu(self.sensors, self.faults)
        self.streamed = 0
        self.lost = 0
        self.lock = threading.RLock()
        self._answers: list[tuple[float, int, CanFrame]] = []
        self._order = itertools.count()
        self._on_air: deque[tuple[float, CanFrame]] = deque()
        self._last_arrival = 0.0
        self._losing = 0
        self._foreign = itertools.cycle(_FOREIGN)
        self._next_foreign = 0.0

    # --- for tests and people ---

    def sensor(self, name: str) -> SimulatedSth:
        """Return the sensor with this name.

        Raises:
            WrongDeviceError: There is none.
        """
        for sensor in self.sensors:
            if sensor.name == name:
                return sensor
        raise WrongDeviceError(f'there is no simulated sensor "{name}", only '
                               f"{', '.join(one.name for one in self.sensors)}")

    def power_loss(self, node: SimulatedNode, now: float | None = None) -> None:
        """Take the power from a node and give it back."""
        with self.lock:
            for counter in ("Power Off Cycles", "Under Voltage Counter"):
                node.eeprom[counter] = node.eeprom.number(counter) + 1
            node.boot(time.monotonic() if now is None else now)

    def send(self, frame: CanFrame, due: float | None = None) -> None:
        """Put any frame on the bus."""
        with self.lock:
            heapq.heappush(self._answers, (time.monotonic() if due is None else due,
                                           next(self._order), frame))

    # --- the device side of the bus ---

    def receive(self, frame: CanFrame, now: float) -> None:
        """Take a frame; what is not a request to a node here is ignored."""
        with self.lock:
            self._advance(now)
            if self.faults.silent or not frame.extended or frame.error:
                return
            try:
                request = Identifier.decode(frame.can_id)
            except FrameError:
                return
            if request.request:
                for node, delay in list(self._receivers(request.receiver, now)):
                    self._ask(node, request, frame.data, now, delay)

    def _receivers(self, receiver: int, now: float) -> Iterator[tuple[SimulatedNode, float]]:
        """Yield the nodes which hear a request, each with the time that its answer takes."""
        broadcast = receiver in (BROADCAST, BROADCAST_SILENT)
        if not self.stu.is_up(now):
            return
        sensor = self.stu.connected
        if (receiver == STH_1 or broadcast) and sensor is not None:
            self.stu.radio_sent += 1
            if sensor.connected and sensor.in_range and sensor.is_up(now):
                yield sensor, STH_DELAY
        if receiver == STU_1 or broadcast:
            yield self.stu, STU_DELAY

    def _ask(self, node: SimulatedNode, request: Identifier, payload: bytes, now: float,
             delay: float) -> None:
        answer = node.answer(request, payload, now)
        if answer is None or request.receiver == BROADCAST_SILENT:
            return
        if node is not self.stu:
            self.stu.radio_received += 1
            if self.faults.random.random() < self.faults.answer_loss:
                return
        error, data = answer
        identifier = Identifier(request.block, request.block_command, node.number,
                                request.sender, request=False, error=error)
        self.send(CanFrame(identifier.encode(), data), now + delay)

    def poll(self, now: float) -> list[tuple[float, CanFrame]]:
        """Return the frames that are due, in order."""
        with self.lock:
            self._advance(now)
            due: list[tuple[float, CanFrame]] = []
            while self._on_air and self._on_air[0][0] <= now:
                due.append(self._on_air.popleft())
            streamed = len(due)
            while self._answers and self._answers[0][0] <= now:
                when, _, frame = heapq.heappop(self._answers)
                due.append((when, frame))
            if self.faults.foreign and now >= self._next_foreign:
                due.append((now, next(self._foreign)))
                self._next_foreign = now + 1 / self.faults.foreign
            if self.faults.silent:
                return []
            self.streamed += streamed
            if len(due) > streamed > 0:
                due.sort(key=lambda item: item[0])
            return due

    def next_due(self, now: float) -> float | None:
        """Return when something is to be sent."""
        with self.lock:
            times = [self._answers[0][0]] if self._answers else []
            if self._on_air:
                times.append(self._on_air[0][0])
            if self.faults.foreign:
                times.append(self._next_foreign)
            if self.stu.connected is not None:
                times.append(self.stu.connected.next_frame())
            first = min(times, default=math.inf)
            return None if first == math.inf else first

    def _advance(self, now: float) -> None:
        """Bring everything to the present: frames that were measured, and connections."""
        sensor = self.stu.connected
        if sensor is not None and sensor.streams:
            frames = sensor.poll(now)
            if frames:
                self._transmit(sensor, frames)
        self.stu.update(now)

    def _transmit(self, sensor: SimulatedSth, frames: list[tuple[float, int, bytes]]) -> None:
        """Send data frames over the radio, where some are lost or come late."""
        if not sensor.in_range:
            self.lost += len(frames)
            return
        self.stu.radio_received += len(frames)
        if self.faults.spare_stream and not self._losing and not self._on_air:
            self._on_air.extend((due, CanFrame(can_id, data)) for due, can_id, data in frames)
            return
        for due, can_id, data in frames:
            self._transmit_badly(due, CanFrame(can_id, data))

    def _transmit_badly(self, due: float, frame: CanFrame) -> None:
        faults = self.faults
        if self._losing == 0 and faults.random.random() < faults.loss:
            self._losing = faults.loss_run
        if self._losing > 0:
            self._losing -= 1
            self.lost += 1
            return
        due += faults.random.uniform(0, faults.jitter)
        if faults.burst:
            due = math.ceil(due / faults.burst) * faults.burst
        self._last_arrival = max(due, self._last_arrival)  # the radio keeps the order
        for _ in range(1 + (faults.random.random() < faults.duplicate)):
            self._on_air.append((self._last_arrival, frame))


class SimulatedIcotronic(SimulatedBus):
    """The network on a socketcand server.

    Attributes:
        network: What is connected to the bus.
    """

    def __init__(self, network: SimulatedNetwork, listen: str, channel: str) -> None:
        """Open the server; `start` serves it."""
        super().__init__(network, listen, channel)
        self.network = network

    def start(self) -> SimulatedIcotronic:
        """Serve the bus in a thread."""
        super().start()
        return self


def simulated_network(names: Sequence[str] = ("Test-STH",), *, listen: str = "127.0.0.1:0",
                      channel: str = "", calibrated: bool = True,
                      can_fd: bool = False) -> SimulatedIcotronic:
    """Return a server with a stationary unit and one sensor per name around it, not yet started.

    Args:
        names: Names of the sensors; their MAC addresses count up from `FIRST_MAC`.
        listen: "host:port" of the server; port 0 takes a free one.
        channel: The only channel of the bus; "" = any.
        calibrated: Whether the sensors' EEPROM holds calibration factors.
        can_fd: Whether the bus carries frames of up to 64 bytes.

    Raises:
        DriverError: A name is too long, or the TCP port cannot be made.
    """
    if not names:
        raise DriverError("at least one sensor needs a name")
    first = int.from_bytes(encode_mac(FIRST_MAC), "big")
    sensors = [SimulatedSth(name, decode_mac((first + index).to_bytes(6, "big")),
                            calibrated=calibrated, can_fd=can_fd)
               for index, name in enumerate(names)]
    return SimulatedIcotronic(SimulatedNetwork(sensors), listen, channel)
