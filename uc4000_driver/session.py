"""The conversation with the sensors on one wire: find, configure, measure in turn.

All of `Uc4000Bus` runs in one thread (see `driver_common.device_thread`), but for `interrupt`.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

from driver_common import device_bus
from driver_common.device_bus import DeviceBus
from driver_common.device_thread import Backoff
from driver_common.errors import (
    DriverError,
    FrameError,
    LinkError,
    NoAnswerError,
    RefusedError,
    SettingError,
    WrongDeviceError,
)
from driver_common.settings import UNKNOWN, Raw, Record, Value, suggestion
from uc4000_driver import commands
from uc4000_driver.commands import Command, Distance, Profile, Uc4000Record
from uc4000_driver.line import Line, TelegramRefusedError, most_together
from uc4000_driver.sensor import PRODUCT, Identity, Measurement, Options, Sensor
from uc4000_driver.settings import ALL_SETTINGS
from uc4000_driver.telegram import CAST, FIRST_ADDRESS, LAST_ADDRESS

T = TypeVar("T")

ATTEMPTS = 2
KEEP_ALIVE = 1.0  # s between requests to a sensor that is not measuring
OPERATING_TEMPERATURE = (-25, 70)  # °C, section 2.1


class Listener(device_bus.Listener[Sensor]):
    """What a user of the bus wants to hear; all called in the thread of the bus."""

    def on_measurement(self, sensor: Sensor, measurement: Measurement) -> None:
        """Take a measurement."""

    def on_temperature(self, sensor: Sensor, celsius: float, stamp: int) -> None:
        """Take a temperature; `stamp` is the host's time in ns when it was asked for."""


@dataclass
class Group:
    """Sensors that do not hear each other and may measure together.

    Attributes:
        names: Names of the sensors.
        failures: Number of measurements together that had to be repeated one by one.
        due: Monotonic time in s until which they measure one by one.
        backoff: Pauses after failures.
    """

    names: frozenset[str]
    failures: int = 0
    due: float = 0.0
    backoff: Backoff = field(default_factory=lambda: Backoff(first=1.0, last=60.0))


def make_groups(texts: Iterable[str], names: Sequence[str]) -> list[Group]:
    """Return groups from texts such as "left right".

    Raises:
        SettingError: A sensor is not known, or in two groups.
    """
    groups: list[Group] = []
    for text in texts:
        members = frozenset(text.replace(",", " ").split())
        for name in sorted(members):
            if name not in names:
                raise SettingError(f'groups: there is no sensor "{name}"{suggestion(name, names)}')
            if any(name in group.names for group in groups):
                raise SettingError(f"groups: {name} is in two groups")
        groups.append(Group(members))
    return groups


class Uc4000Bus(DeviceBus[Sensor]):
    """Several sensors on one wire, or one.

    Attributes:
        line: The wire.
        groups: Those that may measure together.
    """

    _listener: Listener

    def __init__(self, port: str, sensors: Iterable[Options], listener: Listener, *,
                 local_echo: str = "auto", groups: Iterable[str] = ()) -> None:
        """Prepare the bus; nothing is opened.

        Args:
            port: Device path or pyserial URL.
            sensors: How each sensor is to be used.
            listener: Told of everything that happens.
            local_echo: Whether the line returns our own bytes: "auto", "on" or "off".
            groups: Names of sensors that may measure together, such as "left right".

        Raises:
            SettingError: Addresses or groups do not fit.
        """
        super().__init__(map(Sensor, sensors), listener)
        self.line = Line(port, local_echo)
        self._check_addresses()
        self.groups = make_groups(groups, [sensor.options.name for sensor in self.devices])

    def _check_addresses(self) -> None:
        addresses = [sensor.options.address for sensor in self.devices]
        for options in (sensor.options for sensor in self.devices):
            if len(addresses) > 1 and options.address == CAST:
                raise SettingError(f"{options.name}.address must be given, {FIRST_ADDRESS} … "
                                   f"{LAST_ADDRESS}: only a single sensor can be asked for it")
            if addresses.count(options.address) > 1:
                raise SettingError(f"{options.name}.address = {options.address} belongs to two "
                                   "sensors; each needs its own")

    # --- what the thread of the bus calls ---

    def close(self) -> None:
        """Close the port; a sensor measures only when asked, so there is nothing to stop."""
        for sensor in self.devices:
            sensor.forget()
        self.line.close()

    def interrupt(self) -> None:
        """Have the present step end soon; called from another thread."""
        self.line.interrupt()

    # --- what a user calls, through the thread ---

    def write(self, sensor: Sensor, changes: Mapping[str, Value]) -> dict[str, Value]:
        """Write settings, all or none, and return what the sensor reports.

        Raises:
            DriverError: Not connected, a bad value, a refusal or no answer.
        """
        self._require(sensor)
        return sensor.write(_Access(self, sensor), changes)

    def identify(self, sensor: Sensor) -> Identity:
        """Ask the sensor who it is; raises DriverError."""
        self._require(sensor)
        sensor.identity = self._identify(sensor)
        return sensor.identity

    def assign_address(self, sensor: Sensor, address: int) -> None:
        """Give the sensor another address, for good, and follow it.

        Raises:
            SettingError: The address is not allowed or taken.
            DriverError: The sensor refused, or does not answer at the new address.
        """
        self._require(sensor)
        command = commands.write_address(address)
        if address == sensor.address:
            raise SettingError(f"the sensor has address {address} already")
        if any(other is not sensor and other.options.address == address
               for other in self.devices) or self._answers_at(address):
            raise SettingError(f"address {address} belongs to another sensor")
        with contextlib.suppress(NoAnswerError, FrameError):  # what counts is where it answers
            self._execute(sensor, command)
        old, sensor.address = sensor.address, address
        try:
            self._check_address(sensor)
        except DriverError:
            sensor.address = old
            raise
        sensor.options.address = address

    # --- life of a sensor ---

    def _open_link(self) -> None:
        self.line.open()

    def _attend(self, sensor: Sensor) -> None:
        """Measure, or look whether the sensor is there."""
        try:
            if sensor.misses:
                self._look_again(sensor)
            if self.wants(sensor):
                if sensor.wants_temperature:
                    self._read_temperature(sensor)
                self._measure_with_others(sensor)
            else:
                self._check_address(sensor)
                sensor.due = time.monotonic() + KEEP_ALIVE
            self._note_well(sensor)
        except RefusedError as error:
            self._note_refusal(sensor, error)
        except (NoAnswerError, FrameError) as error:
            self._note_miss(sensor, error)

    def _start_or_stop(self, sensor: Sensor) -> None:
        """Begin or end to count the rate; a sensor measures only when asked."""
        sensor.arrivals.clear()

    def _note_refusal(self, sensor: Sensor, error: RefusedError) -> None:
        """Ask a sensor that refuses ever more rarely."""
        if str(sensor.error) != str(error):
            self._listener.on_note(sensor, f"{error}; it is asked again", warning=True)
        sensor.error = error
        sensor.due = time.monotonic() + self._pause(sensor)

    def _find(self, sensor: Sensor) -> None:
        """Find the sensor, identify and configure it."""
        if sensor.options.address == CAST:
            sensor.address = self._ask_address()
        self._check_address(sensor, attempts=1)
        sensor.identity = self._identify(sensor)
        try:
            self._read_all(sensor)
            self._make_as_wanted(sensor)
        except DriverError:
            sensor.identity = None
            raise
        sensor.due = sensor.temperature_due = 0.0
        self._note_found(sensor)

    def _identify(self, sensor: Sensor) -> Identity:
        version = self._execute(sensor, commands.READ_VERSION)
        if not version.startswith("HW"):
            raise WrongDeviceError(f"{sensor} says that its version is {version!r}, which is not "
                                   f"that of a {PRODUCT}; connect the right device")
        return Identity(version, self._execute(sensor, commands.READ_SERIAL_NUMBER))

    def _check_address(self, sensor: Sensor, attempts: int = ATTEMPTS) -> None:
        """Ask the sensor for its address."""
        address, _ = self._timed(sensor, commands.READ_ADDRESS, attempts)
        if address != sensor.address:
            raise FrameError(f"{sensor} says that its address is {address}")

    def _look_again(self, sensor: Sensor) -> None:
        """Look after a silence whether the sensor is as it was: it may have lost its settings."""
        self._check_address(sensor, attempts=1)
        settings, before = sensor.settings, sensor.values
        try:
            self._read_all(sensor)
        except DriverError:
            sensor.settings, sensor.values = settings, before
            raise
        if sensor.values != before:
            sensor.acknowledged.clear()  # it must be taken for lost as well
            self._read_all(sensor)
            self._make_as_wanted(sensor)
            self._listener.on_values(sensor)

    def _read_all(self, sensor: Sensor) -> None:
        sensor.read_all(_Access(self, sensor), ALL_SETTINGS, self._note_of(sensor))

    def _make_as_wanted(self, sensor: Sensor) -> None:
        for name, value in sensor.values.items():
            if value == UNKNOWN:
                self._listener.on_note(sensor, f"the code that it reports for {name} is not in "
                                       "table A1 of the manual", warning=True)
        sensor.make_as_wanted(lambda changes: self.write(sensor, changes), self._note_of(sensor))

    # --- measuring ---

    def _read_temperature(self, sensor: Sensor) -> None:
        sensor.temperature_due = time.monotonic() + sensor.options.temperature_period
        try:
            celsius, stamp = self._timed(sensor, commands.READ_TEMPERATURE)
        except RefusedError as error:  # the distance can be measured all the same
            self._listener.on_note(sensor, str(error), warning=True)
            return
        low, high = OPERATING_TEMPERATURE
        if not low <= celsius <= high and celsius != sensor.temperature:
            self._listener.on_note(sensor, f"reports {celsius} °C, but is made for {low} … {high} "
                                   "°C: too hot, too cold or defective", warning=True)
        sensor.temperature = float(celsius)
        self._listener.on_temperature(sensor, sensor.temperature, stamp)

    def _measure_with_others(self, sensor: Sensor) -> None:
        """Measure with a sensor, and with those of its group that are due as well."""
        group = next((group for group in self.groups if sensor.options.name in group.names), None)
        together = self._together_with(sensor, group) if group else []
        if group is None or len(together) < 2:
            self._measure(sensor)
            return
        try:
            self._measure_together(together)
            group.backoff.reset()
        except LinkError:
            raise
        except DriverError as error:
            group.failures += 1
            group.due = time.monotonic() + group.backoff.pause()
            self._listener.on_note(sensor, f"cannot measure together with its group ({error}), "
                                   "for a while alone")
            self._measure(sensor)

    def _together_with(self, sensor: Sensor, group: Group) -> list[Sensor]:
        """Return the sensors that can measure together now."""
        now = time.monotonic()
        if now < group.due or sensor.misses:
            return [sensor]
        others = [other for other in self.devices
                  if other is not sensor and other.options.name in group.names
                  and other.is_connected and not other.misses and not other.error
                  and self.wants(other)
                  and other.due <= now and not other.wants_temperature
                  and other.options.cycles == sensor.options.cycles]
        others.sort(key=lambda other: other.served)
        return [sensor, *others][:most_together(sensor.options.cycles)]

    def _measure(self, sensor: Sensor) -> None:
        sensor.plan_next()
        profile, cycles = sensor.profile, sensor.options.cycles
        distance, sent = self._timed(sensor, commands.measure(profile, cycles), attempts=1)
        self._report(sensor, distance, profile, sent)

    def _measure_together(self, sensors: Sequence[Sensor]) -> None:
        profiles = [sensor.profile for sensor in sensors]
        results = self.line.ask_together(
            [(sensor.address, commands.measure(profile, sensor.options.cycles))
             for sensor, profile in zip(sensors, profiles, strict=True)],
            ", ".join(map(str, sensors)))
        for sensor, profile, (distance, sent) in zip(  # those not asked have their turn next
                sensors, profiles, results, strict=False):
            sensor.served = time.monotonic()
            sensor.plan_next()
            self._report(sensor, distance, profile, sent)

    def _report(self, sensor: Sensor, distance: Distance, profile: Profile, sent: int) -> None:
        sensor.count(distance.outcome)
        half = round(sensor.options.cycles * commands.CYCLE_TIME / 2 * 1e9)
        self._listener.on_measurement(sensor, Measurement(distance, profile, sent + half))

    # --- requests ---

    def _ask_address(self) -> int:
        """Ask for the address by cast; one sensor on the wire may answer (section 5.1.6.3)."""
        try:
            address = self.line.ask(CAST, commands.ASK_ADDRESS, "any sensor")[0]
        except FrameError:
            found = self._answering(range(FIRST_ADDRESS, LAST_ADDRESS + 1))
            if len(found) < 2:
                raise
        else:  # the wire carries a 1 only where all send one: others may hide behind the answer
            found = self._answering(other for other in range(address + 1, LAST_ADDRESS + 1)
                                    if other & address == address)
            if not found:
                return address
            found = [*self._answering([address]), *found]
        raise WrongDeviceError(
            f"several sensors answer ({', '.join(map(str, found))}); say which one with the "
            "parameter address, or name all of them with the parameter sensors") from None

    def _answering(self, addresses: Iterable[int]) -> list[int]:
        return [address for address in addresses if self._answers_at(address, attempts=1)]

    def _answers_at(self, address: int, attempts: int = ATTEMPTS) -> bool:
        """Whether something answers there."""
        for _ in range(attempts):
            try:
                self.line.ask(address, commands.READ_ADDRESS, f"address {address}")
            except NoAnswerError:
                continue
            except (FrameError, RefusedError):
                pass
            return True
        return False

    def _explained(self, sensor: Sensor, error: DriverError) -> DriverError:
        """Add to "no answer" what could be found out about the reason."""
        if not isinstance(error, NoAnswerError):
            return error
        hint = "; check power, wiring and the address"
        if self.line.echo:
            hint = ("; the line returns what is sent, so it is right up to there: check the "
                    "sensor's power and wiring, and the address")
        if len(self.devices) == 1 and sensor.options.address != CAST:
            try:
                hint = (f", but a sensor answers at address {self._ask_address()}; correct the "
                        "parameter address")
            except WrongDeviceError as several:
                hint = f", but {several}"
            except (NoAnswerError, FrameError, RefusedError):
                pass
        return NoAnswerError(f"{error}{hint}")

    def _execute(self, sensor: Sensor, command: Command[T]) -> T:
        return self._timed(sensor, command)[0]

    def _timed(self, sensor: Sensor, command: Command[T],
               attempts: int = ATTEMPTS) -> tuple[T, int]:
        """Ask a sensor, again where the transmission fails; see `Line.ask`."""
        for _ in range(attempts - 1):
            try:
                return self._ask(sensor, command)
            except TelegramRefusedError as error:
                if not error.is_transmission:
                    raise
            except (NoAnswerError, FrameError):
                pass
        return self._ask(sensor, command)

    def _ask(self, sensor: Sensor, command: Command[T]) -> tuple[T, int]:
        """Ask a sensor once, and count what goes wrong."""
        try:
            return self.line.ask(sensor.address, command, str(sensor))
        except TelegramRefusedError as error:
            sensor.statistics.refusals[error.code] += 1
            raise
        except NoAnswerError:
            sensor.statistics.timeouts += 1
            raise
        except FrameError as error:
            sensor.statistics.damaged += 1
            raise FrameError(f"{error}; interference, or two sensors have address "
                             f"{sensor.address}") from None

    # --- settings ---

    def read_record(self, sensor: Sensor, record: Uc4000Record) -> tuple[Raw, ...]:
        """Return what a record holds; where it cannot be read, what was acknowledged."""
        if record.write_only:
            return (sensor.acknowledged.get(record.name, UNKNOWN),)
        return (self._execute(sensor, record.read()),)

    def write_record(self, sensor: Sensor, record: Uc4000Record, values: tuple[Raw, ...]) -> None:
        """Write a record; raises RefusedError where the sensor stores something else."""
        sensor.acknowledged.pop(record.name, None)
        if values == (UNKNOWN,):
            return  # nobody knows what was there before
        command = record.write(values)
        stored = self._execute(sensor, command)
        if record.write_only:  # its reply is not shown in the manual
            sensor.acknowledged[record.name] = values[0]
        elif stored != values[0]:
            raise RefusedError(f"{sensor} cannot {command.name}: it stored code {stored} instead "
                               f"of {values[0]!r}")


class _Access:
    """The records of one sensor, for `read_settings` and `write_settings`."""

    def __init__(self, bus: Uc4000Bus, sensor: Sensor) -> None:
        self._bus = bus
        self._sensor = sensor

    def read_record(self, record: Record) -> tuple[Raw, ...]:
        """Return the raw fields of a record."""
        assert isinstance(record, Uc4000Record)
        return self._bus.read_record(self._sensor, record)

    def write_record(self, record: Record, values: tuple[Raw, ...]) -> None:
        """Write all fields of a record."""
        assert isinstance(record, Uc4000Record)
        self._bus.write_record(self._sensor, record, values)
