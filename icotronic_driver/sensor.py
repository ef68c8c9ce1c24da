# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sensor behind the stationary unit: how it is to be used, what is known, what was counted."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Any, NamedTuple, cast

from driver_common.device import Device, DeviceOptions
from driver_common.sample_clock import SampleClock
from icotronic_driver.laws import (
    DEVICE,
    LINEAR,
    PARTS_BY_NAME,
    PARTS_BY_NUMBER,
    VOLTAGE,
    Calibration,
    ChannelOptions,
    Law,
)
from icotronic_driver.settings import SETTINGS
from icotronic_driver.streaming import (
    AXES,
    LOAD_LIMIT,
    LOAD_MAXIMUM,
    StreamDecoder,
    StreamFormat,
    StreamStatistics,
    stream_format,
)
from icotronic_driver.values import (
    AdcConfiguration,
    ErrorStatus,
    NodeStatus,
    OperatingTime,
    PowerCycles,
    Version,
)

NO_MAC = "00:00:00:00:00:00"


class Phase(Enum):
    """Where the sensor is on its way to a stream."""

    SEARCHING = "searching"
    CONNECTING = "connecting"
    GREETING = "greeting"
    CONNECTED = "connected"


class SeenSensor(NamedTuple):
    """A sensor in range of the stationary unit."""

    number: int
    name: str
    mac: str
    rssi: int  # dBm

    @property
    def is_complete(self) -> bool:
        """Whether MAC address and RSSI are known; of a new sensor they are not (field note N3)."""
        return self.mac != NO_MAC and self.rssi != 0

    def __str__(self) -> str:
        """Return all of it for people."""
        return f'"{self.name}" ({self.mac}, number {self.number}, {self.rssi} dBm)'


@dataclass
class Options(DeviceOptions):
    """How the sensor is to be used.

    Attributes:
        sensor_name: The sensor with this name, "" = any.
        sensor_mac: The sensor with this MAC address, "" = any.
        sensor_number: The sensor with this number, -1 = any.
        channels: Which channels are streamed.
        sample_rate: Wanted values/s of each channel; 0 = as the ADC settings say.
        laws: How each channel gets its law.
        status_period: Time in s in which battery, temperature, RSSI and counters are read once; 0 =
            never.
        may_wait: Time in s for which frames may wait for each other; nobody wants each at once.
    """

    sensor_name: str = ""
    sensor_mac: str = ""
    sensor_number: int = -1
    channels: str = "x"
    sample_rate: float = 0.0
    laws: dict[str, ChannelOptions] = field(
        default_factory=lambda: dict.fromkeys(AXES, ChannelOptions()))
    status_period: float = 8.0
    may_wait: float = 0.0


@dataclass(frozen=True)
class UnitIdentity:
    """Product data of a sensor or a stationary unit; None where it does not tell."""

    name: str
    mac: str
    gtin: int | None
    hardware: Version | None
    firmware: Version | None
    release: str | None
    serial_number: str | None
    production_date: str | None


@dataclass
class Readings:
    """What is read now and then; None while it is not known."""

    rssi: int | None = None
    battery_voltage: float | None = None
    temperature: float | None = None
    sth_status: NodeStatus | None = None
    stu_status: NodeStatus | None = None
    sth_errors: ErrorStatus | None = None
    stu_errors: ErrorStatus | None = None
    power_cycles: PowerCycles | None = None
    operating_time: OperatingTime | None = None
    under_voltages: int | None = None
    watchdog_resets: int | None = None

    @property
    def faults(self) -> list[str]:
        """What the status words and error words complain about (sections 10.2.4 and 10.2.5)."""
        units = (("sensor", self.sth_status, self.sth_errors),
                 ("stationary unit", self.stu_status, self.stu_errors))
        found = [(f"the {unit} reports {what}", is_so) for unit, status, errors in units
                 for what, is_so in (
                     ("an error", status and status.error),
                     ("a failed transmission", errors and errors.transmission_failed),
                     ("an overrun of its ADC", errors and errors.adc_overrun))]
        return [text for text, is_so in found if is_so]


class Channel(NamedTuple):
    """A streamed channel: value = slope · raw + offset, an acceleration in m/s².

    Attributes:
        name: Its name: x, y or z.
        law: What the voltage at its sensor means.
        source: Where the law comes from, for people.
        slope: Size of one step of the ADC.
        offset: Value at raw zero.
    """

    name: str
    law: Law
    source: str
    slope: float
    offset: float

    @property
    def unit(self) -> str:
        """Unit in which it is published."""
        return "m/s²" if self.law.is_acceleration else self.law.unit

    def __str__(self) -> str:
        """Return name, law and source for people."""
        return f"{self.name}: {self.law}, by {self.source}"


class Sensor(Device):
    """The sensor behind the stationary unit.

    Attributes:
        options: How it is to be used.
        phase: Where it is on its way to a stream.
        target: The sensor that is connected, or being connected.
        seen: The sensors in range when it was last looked.
        identity: Who it is; None while it is not connected.
        stu_identity: Who the stationary unit is.
        readings: What is read now and then.
        readable: Names of those that it, or the stationary unit, tells.
        channels: The streamed channels.
        law_complaints: What is wrong with their laws.
        decoder: Decodes the stream; None while there is none.
        clock: Gives the samples of the stream their times.
        totals: Statistics of the streams before the present one.
        breaks: Breaks of their clocks.
        time_outs: How often it or the stationary unit did not answer.
    """

    options: Options

    def __init__(self, options: Options) -> None:
        """Begin as an unknown sensor."""
        super().__init__(options)
        self.phase = Phase.SEARCHING
        self.target: SeenSensor | None = None
        self.seen: list[SeenSensor] = []
        self.identity: UnitIdentity | None = None
        self.stu_identity: UnitIdentity | None = None
        self.readings = Readings()
        self.readable: set[str] = set()
        self.channels: list[Channel] = []
        self.law_complaints: list[str] = []
        self.eeprom_calibrations: dict[str, Calibration] = {}
        self.decoder: StreamDecoder | None = None
        self.clock = SampleClock(1.0)
        self.totals = StreamStatistics()
        self.breaks = 0
        self.time_outs = 0

    def __str__(self) -> str:
        """Return what it is called in messages; there is only one."""
        return "the sensor"

    @property
    def is_connected(self) -> bool:
        """Whether it was connected and configured."""
        return self.phase is Phase.CONNECTED

    @property
    def missing(self) -> list[str]:
        """What a connected sensor, or the stationary unit, does not tell."""
        assert self.identity is not None
        assert self.stu_identity is not None
        groups = {name: name.partition(".")[0] for name in SETTINGS}
        offered = {groups[name] for name in self.settings}
        settings = dict.fromkeys(name if group in offered else group
                                 for name, group in groups.items() if name not in self.settings)
        return [*settings, *(name.replace("_", " ") for name, value in (
            *vars(self.identity).items(), *vars(self.readings).items()) if value is None),
            *(f"{name.replace('_', ' ')} of the stationary unit"
              for name, value in vars(self.stu_identity).items() if value is None)]

    def forget(self) -> None:
        """Take note that the sensor is not connected any more."""
        super().forget()
        self.end_stream()
        self.phase = Phase.SEARCHING
        self.identity = None
        self.target = None
        self.seen = []

    @property
    def product(self) -> str:
        """Name of what is connected."""
        return "ICOtronic sensor"

    @property
    def adc(self) -> AdcConfiguration:
        """The ADC configuration that the sensor reported; where it did not, as after a reset."""
        return AdcConfiguration(**{
            name.removeprefix("adc."): cast("Any", value)
            for name, value in self.values.items() if name.startswith("adc.")})

    @property
    def format(self) -> StreamFormat:
        """The format in which the wanted channels are streamed."""
        x, y, z = (axis in self.options.channels for axis in AXES)
        return stream_format((x, y, z))

    @property
    def sample_rate(self) -> float:
        """Samples/s of each channel that the ADC settings give (errata C7)."""
        return self.adc.sample_rate / self.format.channel_count

    @property
    def measured_rate(self) -> float:
        """Samples/s of each channel on the host's clock, 0 while there is no stream."""
        return self.sample_rate / (1 + self.clock.drift) if self.decoder is not None else 0.0

    def bus_load(self, bitrate: float, *, stuffing: bool = True) -> float:
        """Return the share of the bus that the stream takes (section 9.2.10)."""
        return self.format.bus_load(self.adc.sample_rate, bitrate, stuffing=stuffing)

    def overloads(self, bitrate: float) -> bool:
        """Whether the stream takes more of the bus than it ever may."""
        return self.bus_load(bitrate, stuffing=False) > LOAD_MAXIMUM

    def load_warning(self, bitrate: float) -> str:
        """Return what is to be said about the bus load, "" where it is fine."""
        if self.overloads(bitrate):
            return (f"the stream takes {self.bus_load(bitrate, stuffing=False):.0%} of the bus "
                    f"without stuff bits, more than {LOAD_MAXIMUM:.0%}")
        load = self.bus_load(bitrate)
        if load > LOAD_LIMIT:
            return f"the stream takes {load:.0%} of the bus, more than {LOAD_LIMIT:.0%}"
        return ""

    @property
    def statistics(self) -> StreamStatistics:
        """What was counted of all streams since the start."""
        now = self.decoder.statistics if self.decoder is not None else StreamStatistics()
        then = self.totals
        return StreamStatistics(
            then.frames + now.frames, then.lost + now.lost, then.duplicates + now.duplicates,
            then.damaged + now.damaged, then.others + now.others, now.fault or then.fault)

    def end_stream(self) -> None:
        """Keep the statistics of the stream that ended, if there was one."""
        self.totals = self.statistics
        if self.decoder is not None:
            self.breaks += self.clock.breaks
        self.decoder = None

    def choose_laws(self) -> None:
        """Take the law of each streamed channel, and note what is wrong with it."""
        self.law_complaints = []
        self.channels = []
        for axis in self.options.channels:
            law, source, complaint = self._law(axis)
            self.channels.append(Channel(axis, law, source,
                                         *law.factors(self.adc.reference_voltage)))
            if complaint:
                self.law_complaints.append(f"channel {axis}: {complaint}; using {source}")

    def _law(self, axis: str) -> tuple[Law, str, str]:
        """Return the law of a channel, its source, and what is wrong."""
        options = self.options.laws[axis]
        if options.sensor == LINEAR:
            return options.law, "its volts and values", ""
        if options.sensor == DEVICE:
            return self._device_law(axis)
        if options.sensor in PARTS_BY_NAME:
            return PARTS_BY_NAME[options.sensor].law, f"its sensor {options.sensor}", ""
        return self._law_by_number(axis)

    def _law_by_number(self, axis: str) -> tuple[Law, str, str]:
        number = self.values.get(f"used_sensor.{axis}")
        assumed = ", which is assumed" if number is None else ""
        if number is None:
            number = AXES.index(axis) + 1
        assert isinstance(number, int)
        part = PARTS_BY_NUMBER.get(number)
        if part is None:
            return VOLTAGE, "its voltage alone", (
                f"what sensor number {number} measures is not known; set channel.{axis}.sensor")
        return part.law, f"sensor number {number} ({part.text}){assumed}", ""

    def _device_law(self, axis: str) -> tuple[Law, str, str]:
        """Return the law of the device's calibration factors, where they are plausible."""
        own = self._device_calibrations(axis)
        for source, calibration in own:
            if not calibration.fault:
                return calibration.law, source, ""
        faults = "; ".join(f"{source}: {calibration.fault}" for source, calibration in own)
        law, source, _ = self._law_by_number(axis)
        return law, source, f"no plausible calibration ({faults or 'none stored'})"

    def _device_calibrations(self, axis: str) -> list[tuple[str, Calibration]]:
        found = []
        slope, offset = (self.values.get(f"calibration.acceleration_{axis}.{part}")
                         for part in ("slope", "offset"))
        if isinstance(slope, float) and isinstance(offset, float):
            found.append(("the device's factors", Calibration(slope, offset)))
        if axis in self.eeprom_calibrations:
            found.append(("the device's EEPROM", self.eeprom_calibrations[axis]))
        return found
