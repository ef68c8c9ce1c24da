"""The conversation with a sensor behind a stationary unit: find, connect, configure, stream.

The stationary unit (STU) sits on the bus, the sensor (STH) behind its radio. All of `IcotronicBus`
runs in one thread (see `driver_common.device_thread`).
"""

from __future__ import annotations

import contextlib
import itertools
import math
import re
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any, TypeVar

from driver_common import device_bus
from driver_common.device_bus import DeviceBus
from driver_common.errors import (
    DriverError,
    FrameError,
    NoAnswerError,
    RefusedError,
    SettingError,
    WrongDeviceError,
)
from driver_common.sample_clock import HostClock, SampleClock
from driver_common.settings import Raw, Record, Value
from icotronic_driver import commands, eeprom
from icotronic_driver.commands import SELF, IcotronicRecord, decode_name
from icotronic_driver.eeprom import STH_EEPROM, STU_EEPROM, Field, FieldValue, Status
from icotronic_driver.identifier import STH_1, STU_1
from icotronic_driver.line import Line, StreamHandler
from icotronic_driver.request import Command, Request
from icotronic_driver.sensor import Options, Phase, Readings, SeenSensor, Sensor, UnitIdentity
from icotronic_driver.settings import SETTINGS, nearest_adc_configuration
from icotronic_driver.streaming import AXES, Calibration, StreamDecoder, supply_voltage
from icotronic_driver.values import CalibrationElement, decode_text

T = TypeVar("T")

LISTEN_TIME = 0.05  # s that jobs of others wait at most
CONNECT_RETRY = 3.0  # s until the connect is asked for again (errata C4)
CONNECT_TIMEOUT = 12.0  # s until another search
CONNECT_POLL = 0.1  # s
SETTLE_TIME = 0.6  # s in which the same sensors must be in range before one is taken
PATIENCE = 3.0  # s until a sensor that only advertises now and then must have been seen
KEEP_ALIVE = 1.0  # s between checks of a connection without a stream
SILENCE = 1.0  # s without a frame after which the stream is looked after
DISCONNECT_TIMEOUT = 0.3  # s
RATE_SETTINGS = frozenset({"adc.prescaler", "adc.acquisition_time", "adc.oversampling_rate"})
OTHER_HOST_TIME = 1.0  # s in which another host with the same connection lets itself be heard
ON_THE_WAY = 0.05  # s without a frame after which none of a stopped stream will come


class Listener(device_bus.Listener[Sensor]):
    """What a user of the bus wants to hear; all called in the thread of the bus."""

    def on_stream(self, sensor: Sensor) -> Callable[[int, float, tuple[int, ...]], None]:
        """Return what takes the samples of a stream that begins.

        It is called for each data frame with the time of the first sample in ns, the time between
        two samples in ns, and the raw values, oldest first.
        """
        raise NotImplementedError

    def on_readings(self, sensor: Sensor, name: str) -> None:
        """Tell that one of the sensor's readings is new."""


class IcotronicBus(DeviceBus[Sensor]):
    """A stationary unit on a CAN bus, and one sensor behind it.

    Attributes:
        line: The CAN bus.
        sensor: The sensor, the only one of `devices`.
    """

    _listener: Listener

    def __init__(self, line: Line, options: Options, listener: Listener) -> None:
        """Prepare the bus; nothing is opened."""
        self.line = line
        self.sensor = Sensor(options)
        super().__init__([self.sensor], listener)
        self._connect_until = self._connect_again = 0.0
        self._settled_since = 0.0
        self._searching_since = 0.0
        self._last_frame = 0.0
        self._host_clock = HostClock()
        self._told_rate = ""
        self._told_buffer = False
        self._next_reading = 0.0
        self._readings = itertools.cycle(_READINGS)

    # --- what the thread of the bus calls ---

    def close(self) -> None:
        """Leave the sensor stopped and disconnected, and close the bus."""
        if self.line.is_open:
            with contextlib.suppress(DriverError):
                self._disconnect()
        self.line.on_stream = None
        self.sensor.forget()
        self.line.close()

    # --- what a user calls, through the thread ---

    def write(self, sensor: Sensor, changes: Mapping[str, Value]) -> dict[str, Value]:
        """Write settings, all or none, and return what the sensor reports; raises DriverError."""
        self._require(self.sensor)
        given = RATE_SETTINGS.intersection(changes)
        if given and self._follows_sample_rate:
            raise SettingError(f"{min(given)} follows from sample_rate; set sample_rate to 0 first")
        return self._write(sensor, changes)

    @property
    def _follows_sample_rate(self) -> bool:
        options = self.sensor.options
        return bool(options.sample_rate) and options.config_mode != "leave"

    def _write(self, sensor: Sensor, changes: Mapping[str, Value]) -> dict[str, Value]:
        with self._stopped_for(changes):
            reported = sensor.write(_Access(self.line), changes)
            if any(name.startswith(("calibration.", "adc.reference")) for name in changes):
                self._choose_calibrations()
        if "name" in changes and sensor.options.sensor_name:
            sensor.options.sensor_name = str(reported["name"])
        return reported

    def restart_stream(self) -> None:
        """Begin the stream anew, after a change of channels, calibration or rate."""
        if self.sensor.phase is Phase.CONNECTED:
            self._stop()
            self._apply_sample_rate()
            self.sensor.make_as_wanted(self._write_wanted, self._note)
            self._choose_calibrations()
            self._start_or_stop(self.sensor)
            self._listener.on_values(self.sensor)

    def scan(self) -> list[SeenSensor]:
        """Return the sensors in range; a connected one hides the others."""
        if self.sensor.phase is Phase.SEARCHING:
            self._look_around()
        elif self.sensor.target is not None:
            return [self.sensor.target]
        return self.sensor.seen

    def reconnect(self) -> None:
        """Disconnect, and search again."""
        self._disconnect()
        self._lose(self.sensor, DriverError("reconnecting, as asked for"))
        self.sensor.due = 0.0

    def reset(self, node: int) -> None:
        """Reset the sensor or the stationary unit; the connection comes back by itself."""
        if node == STH_1:
            self._require(self.sensor)
        self.line.request(commands.RESET.request(node))
        self._lose(self.sensor, DriverError("reset, as asked for"))

    def execute(self, request: Request[T]) -> T:
        """Carry out any request, and read what it may have changed; raises DriverError."""
        if request.frame.identifier.receiver == STH_1:
            self._require(self.sensor)
        result = self.line.request(request)
        if request.writes and self.sensor.is_connected:
            self._read_again()
        return result

    def _read_again(self) -> None:
        """Read all settings, and take those that changed as wanted."""
        sensor, before = self.sensor, self.sensor.values
        sensor.read_all(_Access(self.line), SETTINGS, self._note)
        changed = {name: value for name, value in sensor.values.items()
                   if value != before.get(name) and value == value}  # NaN is no change
        sensor.options.wanted |= changed
        sensor.unsaved |= changed.keys()
        self._choose_calibrations()
        if changed and sensor.decoder is not None:
            self._stop()
            self._start_or_stop(sensor)
        self._listener.on_values(sensor)

    def measure(self) -> dict[str, float]:
        """Make a calibration measurement of everything; return the results by name."""
        self._require(self.sensor)
        results: dict[str, float] = {}
        for element, dimension in _MEASUREMENTS:
            name = f"{element.name.lower()} {dimension}"
            with contextlib.suppress(RefusedError):
                results[name] = self.line.request(
                    commands.MEASURE.request(STH_1, element, dimension))
        with contextlib.suppress(RefusedError):
            results["temperature [°C]"] = self.line.request(
                commands.READ_TEMPERATURE.request(STH_1))
        return results

    def read_eeprom(self, node: int) -> dict[Field, FieldValue]:
        """Return all fields of the EEPROM of the sensor or the stationary unit."""
        if node == STH_1:
            self._require(self.sensor)
        fields = STH_EEPROM if node == STH_1 else STU_EEPROM
        return {field: self._read_field(node, field) for field in fields.values()}

    def unsaved(self) -> dict[Field, tuple[FieldValue, FieldValue]]:
        """Return the EEPROM fields that a save would change: (stored, new).

        These are only settings that were changed: what the sensor works with otherwise need not be
        what its EEPROM is to keep.
        """
        self._require(self.sensor)
        changes: dict[Field, tuple[FieldValue, FieldValue]] = {}
        for name, field in STORED.items():
            if name in self.sensor.unsaved and name in self.sensor.values:
                new = self.sensor.values[name]
                assert isinstance(new, (int, float, str))
                stored = self._read_field(STH_1, field)
                if field.encode(new) != _raw(field, stored):
                    changes[field] = (stored, new)
        return changes

    def save(self) -> dict[Field, tuple[FieldValue, FieldValue]]:
        """Write what differs into the EEPROM, read it back, and return what was changed.

        Raises:
            DriverError: A field was not saved; the text says which, and which were before it.
        """
        changes = self.unsaved()
        saved: list[str] = []
        for field, (_, new) in changes.items():
            try:
                self._save_field(field, new)
            except DriverError as error:
                raise type(error)(f"{field.name} was not saved: {error} (saved before: "
                                  f"{', '.join(saved) or 'nothing'})") from error
            saved.append(field.name)
        self.sensor.unsaved -= set(STORED)
        return changes

    def _save_field(self, field: Field, value: FieldValue) -> None:
        if field.name.endswith("Slope") and not value:
            raise SettingError("a slope of 0 would make every measurement the same")
        self._write_field(field, value)
        stored = self._read_field(STH_1, field)
        if _raw(field, stored) != field.encode(value):
            raise RefusedError(f"the EEPROM took {field.text(value)} but holds "
                               f"{field.text(stored)}; it may be locked")

    # --- searching and connecting (errata C4) ---

    def _open_link(self) -> None:
        self.line.open()
        warning = self.line.buffer_warning
        if warning and not self._told_buffer:
            self._note(warning, warning=True)
            self._told_buffer = True
        self._searching_since = time.monotonic()

    def _find(self, sensor: Sensor) -> None:
        if sensor.phase is Phase.SEARCHING:
            self._search()
        else:
            self._await_connection()

    def _search(self) -> None:
        """Look for the wanted sensor, and ask the stationary unit to connect it."""
        try:
            self._give_up_old_connection()
            self._look_around()
        except DriverError:
            self._searching_since = math.inf
            raise
        self._searching_since = min(self._searching_since, time.monotonic())
        target = self._choose()
        if target is None:
            return
        self.sensor.target = target
        self.sensor.phase = Phase.CONNECTING
        self._connect_until = time.monotonic() + CONNECT_TIMEOUT
        self._connect_again = 0.0

    def _give_up_old_connection(self) -> None:
        """Release what a host that was killed, or a sensor that was reset, left connected.

        Raises:
            WrongDeviceError: Another host is at work with it.
        """
        if self.line.request(commands.CHECK_CONNECTED.request(STU_1)):
            before = self.line.counts.other_host
            self.line.listen(OTHER_HOST_TIME)
            if self.line.counts.other_host != before:
                raise WrongDeviceError("another host on the bus works with this stationary unit; "
                                       "end one of the two")
            self._note("releasing a connection that was left over")
            self.line.request(commands.DEACTIVATE_BLUETOOTH.request(STU_1))

    def _look_around(self) -> None:
        """Ask the stationary unit which sensors are in range."""
        self.line.request(commands.ACTIVATE_BLUETOOTH.request(STU_1))
        seen = []
        for number in range(self.line.request(commands.COUNT_DEVICES.request(STU_1))):
            name = decode_name(*(self.line.request(part.request(STU_1, number))
                                 for part in (commands.READ_NAME_1, commands.READ_NAME_2)))
            mac = self.line.request(commands.READ_MAC.request(STU_1, number))
            rssi = self.line.request(commands.READ_RSSI.request(STU_1, number))
            seen.append(SeenSensor(number, name, mac, rssi))
        if [one.mac for one in seen] != [one.mac for one in self.sensor.seen]:
            self._settled_since = time.monotonic()
        self.sensor.seen = seen

    def _choose(self) -> SeenSensor | None:
        """Return the wanted sensor; None where more may still come into range.

        Raises:
            NoAnswerError: The wanted sensor is not in range.
            WrongDeviceError: Several are in range, and none was named.
        """
        options, seen = self.sensor.options, self.sensor.seen
        wanted = [one for one in seen
                  if (not options.sensor_name or one.name == options.sensor_name)
                  and (not options.sensor_mac or one.mac == options.sensor_mac)
                  and options.sensor_number in (-1, one.number)]
        named = options.sensor_name or options.sensor_mac or options.sensor_number >= 0
        now = time.monotonic()
        if ((not wanted and now - self._searching_since < PATIENCE)
                or (wanted and not named and now - self._settled_since < SETTLE_TIME)):
            self.sensor.due = now + CONNECT_POLL
            return None
        if not wanted:
            in_range = "; ".join(map(str, seen)) or "none"
            raise NoAnswerError(
                f"the sensor{_described(options)} is not in range of the stationary unit (in "
                f"range: {in_range}); wake it up, bring it nearer or correct the parameter"
                if named else "no sensor is in range of the stationary unit; wake it up or bring "
                              "it nearer")
        if len(wanted) > 1:
            raise WrongDeviceError(
                f"{len(wanted)} sensors are in range: {'; '.join(map(str, wanted))}; say which one "
                "with the parameter sensor_name, sensor_mac or sensor_number")
        return wanted[0]

    def _await_connection(self) -> None:
        """Ask for the connection, again every few seconds, until it is there."""
        assert self.sensor.target is not None
        now = time.monotonic()
        if self._connect_again and self.line.request(commands.CHECK_CONNECTED.request(STU_1)):
            self._greet()
        elif now > self._connect_until:
            raise NoAnswerError(f"the sensor {self.sensor.target} does not connect; bring it "
                                "nearer, or check its battery")
        else:
            if now >= self._connect_again:
                self.line.request(commands.CONNECT_MAC.request(STU_1, self.sensor.target.mac))
                self._connect_again = now + CONNECT_RETRY
            self.sensor.due = now + CONNECT_POLL

    def _greet(self) -> None:
        """Identify and configure the sensor that was connected."""
        sensor = self.sensor
        sensor.stu_identity = self._identify(STU_1)
        sensor.identity = self._identify(STH_1)
        sensor.readings = Readings()
        self._check_eeprom()
        sensor.read_all(_Access(self.line), SETTINGS, self._note)
        sensor.eeprom_calibrations = self._eeprom_calibrations()
        sensor.phase = Phase.CONNECTED
        self._apply_sample_rate()
        sensor.make_as_wanted(self._write_wanted, self._note)
        self._choose_calibrations()
        self._note_found(sensor)
        self._start_or_stop(sensor)

    def _identify(self, node: int) -> UnitIdentity:
        def ask(command: Command[[], T]) -> T | None:
            with contextlib.suppress(RefusedError, FrameError):
                return self.line.request(command.request(node))
            return None

        name = decode_name(*(self.line.request(part.request(node, SELF))
                             for part in (commands.READ_NAME_1, commands.READ_NAME_2)))
        serial = [ask(part) for part in commands.READ_SERIAL_NUMBER]
        return UnitIdentity(
            name, self.line.request(commands.READ_MAC.request(node, SELF)),
            ask(commands.READ_GTIN), ask(commands.READ_HARDWARE_VERSION),
            ask(commands.READ_FIRMWARE_VERSION), ask(commands.READ_RELEASE_NAME),
            decode_text(b"".join(part or b"" for part in serial)),
            ask(commands.READ_PRODUCTION_DATE))

    def _check_eeprom(self) -> None:
        """Say when the sensor's EEPROM will not keep what it holds (section 8.3.1.1.1)."""
        byte = self._read_field(STH_1, STH_EEPROM["EEPROM Status"])
        assert isinstance(byte, int)
        if Status.of(byte) is Status.UNINITIALIZED:
            self._note(f"the sensor's EEPROM is not initialised (0x{byte:02X}): at its "
                                   "next reset it takes default values", warning=True)

    def _eeprom_calibrations(self) -> dict[str, Calibration]:
        calibrations = {}
        for axis in AXES:
            pair = [self._read_field(STH_1, STH_EEPROM[f"Acceleration {axis.upper()}: {part}"])
                    for part in ("Slope", "Offset")]
            calibrations[axis] = Calibration(*map(float, pair))
        return calibrations

    def _apply_sample_rate(self) -> None:
        """Turn the wanted sample rate into settings of the ADC."""
        sensor = self.sensor
        if self._follows_sample_rate:
            total = sensor.options.sample_rate * sensor.format.channel_count
            adc = nearest_adc_configuration(total, sensor.adc.reference_voltage)
            sensor.options.wanted |= {
                "adc.prescaler": adc.prescaler, "adc.acquisition_time": adc.acquisition_time,
                "adc.oversampling_rate": adc.oversampling_rate}
            text = (f"sample_rate {sensor.options.sample_rate:g}/s: nearest is "
                    f"{adc.sample_rate / sensor.format.channel_count:.6g}/s with prescaler "
                    f"{adc.prescaler}, acquisition time {adc.acquisition_time} and oversampling "
                    f"rate {adc.oversampling_rate}")
            if text != self._told_rate:
                self._note(text)
            self._told_rate = text

    def _write_wanted(self, changes: Mapping[str, Value]) -> object:
        return self._write(self.sensor, changes)

    def _choose_calibrations(self) -> None:
        for complaint in self.sensor.choose_calibrations():
            self._note(complaint, warning=True)

    # --- streaming ---

    def _attend(self, sensor: Sensor) -> None:
        """Receive the stream, or check the connection; read something now and then."""
        if self.wants(sensor) != (sensor.decoder is not None):
            self._start_or_stop(sensor)  # it did not work when it was asked for
        if sensor.decoder is not None:
            frames = sensor.decoder.statistics.frames
            self._host_clock.follow()
            self.line.listen(LISTEN_TIME)
            if sensor.decoder.statistics.frames != frames:
                self._last_frame = time.monotonic()
            elif time.monotonic() - self._last_frame > self._longest_silence:
                self._look_after_stream()
        else:
            if not self.line.request(commands.CHECK_CONNECTED.request(STU_1)):
                raise NoAnswerError("the sensor disconnected")
            sensor.due = time.monotonic() + KEEP_ALIVE
        if time.monotonic() >= self._next_reading:
            self._read_next()

    @property
    def _longest_silence(self) -> float:
        """Time in s without a frame after which something is wrong with the stream."""
        return max(SILENCE, 3 / self.sensor.format.frame_rate(self.sensor.adc.sample_rate))

    def _start_or_stop(self, sensor: Sensor) -> None:
        if not self.wants(sensor):
            self._stop()
        elif sensor.decoder is None:
            self._start()
        sensor.due = 0.0

    def _start(self) -> None:
        sensor = self.sensor
        form = sensor.format
        sensor.decoder = StreamDecoder(form, form.frame_rate(sensor.adc.sample_rate))
        sensor.clock = SampleClock(sensor.sample_rate)
        self.line.on_stream = self._stream_handler(sensor)
        self._last_frame = time.monotonic()
        try:
            self.line.request(commands.START_ACCELERATION.request(STH_1, form),
                              self._longest_silence / 2)  # the first frame is the answer
        except DriverError:
            self._end_stream()
            raise

    def _stream_handler(self, sensor: Sensor) -> StreamHandler:
        """Return what is done with each frame of the stream: the hot path."""
        decoder, clock, host_clock = sensor.decoder, sensor.clock, self._host_clock
        assert decoder is not None
        decode, data_sets, update = decoder.decode_frame, decoder.format.data_sets, clock.update
        publish = self._listener.on_stream(sensor)
        lost = 0

        def handle(data: bytearray, bus_time: float, now: int) -> None:
            nonlocal lost
            values = decode(bus_time, data, now)  # frames that waited for us were not late
            if values is None:
                return
            number = decoder.number * data_sets
            update(number + data_sets - 1, now)
            publish(clock.time_of(number) + host_clock.offset, clock.period, values)
            if decoder.statistics.lost != lost:
                if not lost:
                    self._note(f"{decoder.statistics.lost} frames were lost on the "
                                           "radio; more are counted in the diagnostics only",
                                           warning=True)
                lost = decoder.statistics.lost

        return handle

    def _stop(self) -> None:
        if self.sensor.decoder is not None:
            self.line.request(commands.STOP_ACCELERATION.request(STH_1))
            self._take_what_is_on_the_way()
            self._end_stream()

    def _end_stream(self) -> None:
        self.line.on_stream = None
        self.sensor.end_stream()

    def _take_what_is_on_the_way(self) -> None:
        """Receive the last frames of a stopped stream, before the next one could get them."""
        frames, end = -1, time.monotonic() + SILENCE
        while frames != self.sensor.statistics.frames and time.monotonic() < end:
            frames = self.sensor.statistics.frames
            self.line.listen(ON_THE_WAY)

    @contextlib.contextmanager
    def _stopped_for(self, changes: Mapping[str, Value]) -> Iterator[None]:
        """Stop the stream around changes that need it, or that change how it is decoded."""
        streaming = self.sensor.decoder is not None and any(
            name.startswith("calibration.") or SETTINGS[name].needs_stop
            for name in changes if name in SETTINGS)
        if streaming:
            self._stop()
        try:
            yield
        finally:
            if streaming:
                self._start_or_stop(self.sensor)

    def _look_after_stream(self) -> None:
        """React to a stream that fell silent: start it again where the sensor is still there."""
        if not self.line.request(commands.CHECK_CONNECTED.request(STU_1)):
            raise NoAnswerError("the sensor was lost while it streamed")
        self._end_stream()
        self._note("the stream fell silent; starting it again", warning=True)
        self._start_or_stop(self.sensor)

    # --- losing ---

    def _lose(self, sensor: Sensor, error: DriverError) -> None:
        """Note that the sensor is not there; look for it more and more rarely."""
        if sensor.phase is not Phase.SEARCHING:
            self._searching_since = time.monotonic()
        sensor.time_outs += isinstance(error, NoAnswerError)
        self.line.on_stream = None
        super()._lose(sensor, error)

    def _gist(self, error: DriverError | None) -> str:
        """Return an error without what changes at every look."""
        return re.sub(r"-?\d+ dBm", "", str(error))

    def _disconnect(self) -> None:
        """Stop the stream and release the sensor, so that it can sleep."""
        if self.sensor.phase is Phase.CONNECTED:
            with contextlib.suppress(NoAnswerError, RefusedError, FrameError):
                self._stop()
        if self.sensor.phase is not Phase.SEARCHING:
            self.line.request(commands.DEACTIVATE_BLUETOOTH.request(STU_1), DISCONNECT_TIMEOUT)

    # --- requests ---

    def _note(self, text: str, *, warning: bool = False) -> None:
        self._listener.on_note(self.sensor, text, warning=warning)

    def _read_next(self) -> None:
        """Read one of the things that are read now and then; what is refused is left out."""
        period = self.sensor.options.status_period
        self._next_reading = time.monotonic() + period / len(_READINGS)
        name, make_request, convert = next(self._readings)
        try:
            value = convert(self.sensor, self.line.request(make_request()))
        except (RefusedError, FrameError, NoAnswerError):
            value = None
        setattr(self.sensor.readings, name, value)
        if value is not None:
            self._listener.on_readings(self.sensor, name)

    def _read_field(self, node: int, field: Field) -> FieldValue:
        return field.decode(b"".join(
            self.line.request(commands.READ_EEPROM.request(node, field.page, offset, length))
            for offset, length in field.chunks))

    def _write_field(self, field: Field, value: FieldValue) -> None:
        data = field.encode(value)
        for offset, length in field.chunks:
            start = offset - field.offset
            self.line.request(commands.WRITE_EEPROM.request(
                STH_1, field.page, offset, data[start:start + length]))


def _raw(field: Field, value: FieldValue) -> bytes:
    """Return the bytes of a value that was read, also of a number that cannot be written."""
    try:
        return field.encode(value)
    except SettingError:
        return b""


def _described(options: Options) -> str:
    parts = [f' "{options.sensor_name}"'] if options.sensor_name else []
    parts += [f" {options.sensor_mac}"] if options.sensor_mac else []
    parts += [f" number {options.sensor_number}"] if options.sensor_number >= 0 else []
    return "".join(parts)


class _Access:
    """The records of the sensor, for `read_settings` and `write_settings`."""

    def __init__(self, line: Line) -> None:
        self._line = line

    def read_record(self, record: Record) -> tuple[Raw, ...]:
        """Return the raw fields of a record."""
        assert isinstance(record, IcotronicRecord)
        return record.decode_answers([self._line.request(request)
                                      for request in record.read_requests(STH_1)])

    def write_record(self, record: Record, values: tuple[Raw, ...]) -> None:
        """Write all fields of a record."""
        assert isinstance(record, IcotronicRecord)
        for request in record.write_requests(STH_1, values):
            self._line.request(request)


def _as_it_is(sensor: Sensor, value: T) -> T:
    return value


def _battery_voltage(sensor: Sensor, values: tuple[int, ...]) -> float:
    return supply_voltage(values[0], sensor.adc.reference_voltage)


# What is read now and then: name in Readings, request, conversion.
_READINGS: tuple[tuple[str, Callable[[], Request[Any]], Callable[[Sensor, Any], Any]], ...] = (
    ("rssi", lambda: commands.READ_RSSI.request(STH_1, SELF), _as_it_is),
    ("battery_voltage", lambda: commands.read_voltage(STH_1), _battery_voltage),
    ("temperature", lambda: commands.READ_TEMPERATURE.request(STH_1), _as_it_is),
    ("sth_status", lambda: commands.READ_STH_STATUS.request(STH_1), _as_it_is),
    ("stu_status", lambda: commands.READ_STU_STATUS.request(STU_1), _as_it_is),
    ("sth_errors", lambda: commands.READ_STH_ERRORS.request(STH_1), _as_it_is),
    ("stu_errors", lambda: commands.READ_STU_ERRORS.request(STU_1), _as_it_is),
    ("power_cycles", lambda: commands.READ_POWER_CYCLES.request(STH_1), _as_it_is),
    ("operating_time", lambda: commands.READ_OPERATING_TIME.request(STH_1), _as_it_is),
    ("under_voltages", lambda: commands.READ_UNDER_VOLTAGES.request(STH_1), _as_it_is),
    ("watchdog_resets", lambda: commands.READ_WATCHDOG_RESETS.request(STH_1), _as_it_is),
)

_MEASUREMENTS = tuple(
    (element, dimension) for element, dimensions in (
        (CalibrationElement.ACCELERATION, (1, 2, 3)), (CalibrationElement.VOLTAGE, (1, 2, 3)),
        (CalibrationElement.GROUND, (1,)), (CalibrationElement.SUPPLY, (1,)),
        (CalibrationElement.REGULATED_POWER, (1,)), (CalibrationElement.AMPLIFIER_OUTPUT, (1,)))
    for dimension in dimensions)

# Settings that the EEPROM can keep, and the field that keeps them.
STORED: Mapping[str, Field] = {
    "name": STH_EEPROM["STH Name"],
    "reduced_energy.sleep_time": STH_EEPROM["Sleep Time 1"],
    "reduced_energy.advertisement_time": STH_EEPROM["Advertisement Time 1"],
    "lowest_energy.sleep_time": STH_EEPROM["Sleep Time 2"],
    "lowest_energy.advertisement_time": STH_EEPROM["Advertisement Time 2"],
    **{f"calibration.{setting}.{part.lower()}": STH_EEPROM[f"{stored}: {part}"]
       for setting, stored in zip(
           ("acceleration_x", "acceleration_y", "acceleration_z", "voltage1", "voltage2",
            "voltage3", "temperature1", "temperature2", "temperature3"), eeprom.CALIBRATED,
           strict=True)
       for part in ("Slope", "Offset")},
}
