"""The conversation with the radars on one serial line: find, configure, measure.

One request at a time, each with its time-out; several radars take turns. All of `RadarBus` runs in
one thread (see `driver_common.device_thread`).
"""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TypeVar

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
from driver_common.settings import Raw, Record, Setting, Value, read_settings
from isys_radar_driver import commands
from isys_radar_driver.commands import Command, IsysRecord, Location, RangeList, RawSignals
from isys_radar_driver.frames import BROADCAST, FIRST_ADDRESS, LAST_ADDRESS, Frame
from isys_radar_driver.line import LATENCY, REPLY_TIMEOUT, Line
from isys_radar_driver.models import BAUD_RATES, Model, model_of_product
from isys_radar_driver.radar import Identity, Options, Radar
from isys_radar_driver.settings import is_application_setting, record_of, settings_of
from isys_radar_driver.targets import Resolution, TargetList, decode_target_list

T = TypeVar("T")

EEPROM_TIMEOUT = 1.0  # s, writing the EEPROM takes its time
RAW_TIMEOUT = 3.0  # s until the first byte of raw signals
ATTEMPTS = 2
KEEP_ALIVE = 1.0  # s between requests to a radar that is not measuring
CHECK_PERIOD = 5.0  # s between checks for a reset while it measures
CHECK_TIME = 0.020  # s that a check may take beside its bytes, with a slow adapter
CHECK_SIZE = 40  # bytes of request and reply
REALIGN_PERIOD = 30.0  # s between restarts of a radar that is out of its turn
SOCKET = "socket://"  # a port that takes any baud rate, as the line is somewhere else


class Listener(device_bus.Listener[Radar]):
    """What a user of the bus wants to hear; all called in the thread of the bus."""

    def on_target_list(self, radar: Radar, targets: TargetList, stamp: int) -> None:
        """Take a target list; `stamp` is the host's time in ns when the reply began."""

    def on_digital_outputs(self, radar: Radar, values: tuple[int, ...], stamp: int) -> None:
        """Take the state of the digital outputs."""

    def on_range_list(self, radar: Radar, values: RangeList, targets: TargetList,
                      stamp: int) -> None:
        """Take a range list, and the target list that came before it."""

    def on_temperatures(self, radar: Radar, stamp: int) -> None:
        """Tell that the board temperatures of a radar were read."""


class RadarBus(DeviceBus[Radar]):
    """Several radars on one serial line, or one.

    Attributes:
        line: The serial line.
    """

    _listener: Listener

    def __init__(self, port: str, baud_rate: int, radars: Iterable[Options],
                 listener: Listener) -> None:
        """Prepare the bus; nothing is opened.

        Args:
            port: Device path or pyserial URL.
            baud_rate: In Bd; 0 = try the default rates of the models.
            radars: How each radar is to be used.
            listener: Told of everything that happens.

        Raises:
            SettingError: Of several radars, one has no address of its own.
        """
        super().__init__(map(Radar, radars), listener)
        self.line = Line(port)
        self._check_addresses()
        self._baud_rate = baud_rate

    def _check_addresses(self) -> None:
        owners: dict[int, str] = {}
        for radar in self.devices:
            name, address = radar.options.name, radar.options.address
            if len(self.devices) > 1 and address == BROADCAST:
                raise SettingError(f"{name}.address must be given, as there are several sensors")
            if address in owners:
                raise SettingError(f"{name}.address is {address}, but that is the address of "
                                   f"{owners[address]}")
            owners[address] = name

    # --- what the thread of the bus calls ---

    def close(self) -> None:
        """Leave the radars stopped and close the port."""
        if not self.line.is_open:
            return
        for radar in self.devices:
            if radar.is_connected:
                with contextlib.suppress(DriverError):
                    self._stop(radar)
                radar.forget()
        self.line.close()

    # --- what a user calls, through the thread ---

    def write(self, radar: Radar, changes: Mapping[str, Value]) -> dict[str, Value]:
        """Write settings, all or none, and return what the radar reports.

        Raises:
            DriverError: Not connected, a bad value, a refusal or no answer.
        """
        self._require(radar)
        try:
            return self._write(radar, changes)
        except (NoAnswerError, FrameError) as error:  # so what it holds now is not known
            self._lose(radar, error)
            raise

    def execute(self, radar: Radar, command: Command[T]) -> T:
        """Carry out a command that the model has; raises DriverError."""
        self._require_support(radar, command)
        return self._execute(radar, command)

    def read_raw_signals(self, radar: Radar) -> RawSignals:
        """Read the raw signals of one measurement; needs the acquisition to run."""
        self._require_support(radar, commands.READ_RAW)
        if not radar.measuring:
            raise SettingError("raw signals need the acquisition to run; start it first")
        radar.forget_lists()  # the cycle is expanded on purpose (section 3.3.10)
        return self._execute(radar, commands.READ_RAW, RAW_TIMEOUT)

    def save(self, radar: Radar, command: Command[None]) -> list[str]:
        """Save settings in the EEPROM; return the names of those changed since the last time."""
        if self._model(radar).supports(command):
            self._execute(radar, command)
            saved = self.unsaved(radar, command)
        else:
            saved = self._save_records(radar, command)
        radar.unsaved -= set(saved)
        return saved

    def unsaved(self, radar: Radar, command: Command[None], *, possible: bool = True) -> list[str]:
        """Return the settings that this driver changed and that a save would keep, or would not."""
        return sorted(name for name in radar.unsaved
                      if _covers(command, radar.settings[name])
                      and self._can_save(radar, command, radar.settings[name]) == possible)

    def stored_values(self, radar: Radar) -> dict[str, Value]:
        """Return what the EEPROM holds, for the settings that can be read from there."""
        self._require(radar)
        return read_settings(_Access(self, radar, Location.EEPROM), (
            setting for setting in radar.settings.values() if record_of(setting).has_location))

    def _can_save(self, radar: Radar, command: Command[None], setting: Setting) -> bool:
        return self._model(radar).supports(command) or record_of(setting).has_location

    def _save_records(self, radar: Radar, command: Command[None]) -> list[str]:
        """Write each record that has a location to the EEPROM, where that holds something else.

        Models without the commands to save have no other way (sections 3.3.4.6, 3.3.5.21 …).
        """
        covered = [setting for setting in radar.settings.values()
                   if _covers(command, setting) and record_of(setting).has_location]
        if not covered:
            self._require_support(radar, command)
        now, stored = ({record: self.read_record(radar, record, location)
                        for record in dict.fromkeys(map(record_of, covered))}
                       for location in (Location.RAM, Location.EEPROM))
        differing = {setting.name: record_of(setting) for setting in covered
                     if now[record_of(setting)][setting.field]
                     != stored[record_of(setting)][setting.field]}
        with self._stopped_for(radar, differing):
            for record in dict.fromkeys(differing.values()):
                self._save_record(radar, record, now[record])
        return sorted({setting.name for setting in covered} & radar.unsaved | differing.keys())

    def _save_record(self, radar: Radar, record: IsysRecord, values: tuple[Raw, ...]) -> None:
        names = ", ".join(setting.name for setting in radar.settings.values()
                          if setting.record == record)
        try:
            self.write_record(radar, record, values, Location.EEPROM)
        except RefusedError as error:
            raise RefusedError(f"cannot save {names}: {error}") from error
        if self.read_record(radar, record, Location.EEPROM) != values:
            raise RefusedError(f"the device took {names} but did not store it")

    def set_default_thresholds(self, radar: Radar) -> tuple[float, ...]:
        """Set the default temperature thresholds in the RAM, and read what they are then."""
        thresholds = self.execute(radar, commands.SET_DEFAULT_TEMPERATURE_THRESHOLDS)
        radar.take_over(read_settings(_Access(self, radar), (
            setting for setting in radar.settings.values()
            if setting.section == commands.TEMPERATURE_THRESHOLDS_SECTION)))
        self._listener.on_values(radar)
        return thresholds

    def restore_factory_settings(self, radar: Radar) -> None:
        """Restore the factory settings, and read everything again."""
        command = commands.RESTORE_FACTORY_SETTINGS
        model = self._require_support(radar, command)
        self._stop(radar)
        try:
            self._exchange(radar, command.request(radar.address), _acknowledged, EEPROM_TIMEOUT,
                           sources=(radar.address, model.address))
            radar.options.wanted.clear()
            radar.differing.clear()
            radar.unsaved.clear()
            try:
                self._execute(radar, commands.READ_DEVICE_NAME)
            except NoAnswerError:  # the address may have been restored as well
                radar.address = model.address
                radar.options.address = radar.options.address and model.address
            self._read_all(radar)
        finally:
            self._start_or_stop(radar)
        self._listener.on_values(radar)

    def change_address(self, radar: Radar, address: int) -> None:
        """Give the radar another address, for good, and follow it (errata I17).

        Raises:
            SettingError: The address is not allowed or taken.
            DriverError: The radar refused or did not answer from the new address.
        """
        self._require(radar)
        if not FIRST_ADDRESS <= address <= LAST_ADDRESS:
            raise SettingError(f"address {address} is out of range, "
                               f"allowed is {FIRST_ADDRESS} … {LAST_ADDRESS}")
        if any(other is not radar and other.address == address for other in self.devices):
            raise SettingError(f"address {address} belongs to another radar of this driver")
        if address != radar.address and self._answers_at(radar, address):
            raise SettingError(f"address {address} belongs to another device on the line")
        request = commands.change_address(radar.address, address)
        try:
            self._exchange(radar, request, lambda frame: None, REPLY_TIMEOUT + EEPROM_TIMEOUT,
                           sources=(address, radar.address))
        except NoAnswerError:  # of the request, or only of its acknowledge
            if not self._answers_at(radar, address):
                raise
        radar.address = address
        radar.options.address = address

    # --- life of a radar ---

    def _open_link(self) -> None:
        self.line.open(self._baud_candidates(self.devices[0])[0])

    def _attend(self, radar: Radar) -> None:
        """Measure, or look whether the radar is there."""
        try:
            if radar.measuring != self.wants(radar):
                self._start_or_stop(radar)  # it did not work when it was asked for
            if radar.sends_lists:
                if self._is_check_due(radar):
                    self._check_reset(radar)
                self._measure(radar)
            else:
                self._keep_alive(radar)
            radar.refused = 0
            self._note_well(radar)
        except (RefusedError, NoAnswerError, FrameError) as error:
            if not radar.is_connected:  # it could not be configured again
                raise
            if isinstance(error, RefusedError):
                self._note_refusal(radar, error)
            else:
                radar.statistics.timeouts += 1
                self._note_miss(radar, error)

    def _find(self, radar: Radar) -> None:
        """Find the radar at one of the possible baud rates, identify and configure it."""
        link = self.line.link
        failure: DriverError = NoAnswerError("no answer")
        for baud_rate in self._baud_candidates(radar):
            link.baud_rate = baud_rate
            try:
                if radar.options.address == BROADCAST:
                    radar.address = self._ask_address(radar)
                identity = self._identify(radar)
                break
            except (NoAnswerError, FrameError) as error:
                failure = error
        else:
            raise failure
        expected = radar.options.model
        if expected is not None and identity.model.name != expected.name:
            raise WrongDeviceError(f"expected an {expected.name}, but an {identity.model.name} "
                                   f"answers at address {radar.address}; connect the right one or "
                                   "change the parameter model")
        identity.model.resolutions_of(radar.options.resolution)
        if self._guesses_baud_rate:
            link.baud_rate = identity.model.baud_rate
        radar.identity = identity
        self._configure(radar)
        self._note_found(radar)

    def _configure_again(self, radar: Radar, reason: str) -> None:
        """React to a radar that seems to have been reset without notice."""
        self._listener.on_note(radar, f"{reason}; configuring it again", warning=True)
        self._configure(radar)
        self._listener.on_values(radar)

    def _configure(self, radar: Radar) -> None:
        """Read all settings, make them as wanted, and start if that is wanted.

        Where that fails the radar is not connected, as nobody knows what it holds.
        """
        try:
            radar.measuring = None  # it may have been left running
            self._stop(radar)
            self._read_all(radar)
            radar.make_as_wanted(lambda changes: self._write(radar, changes), self._note_of(radar))
            self._start_or_stop(radar)
        except DriverError:
            radar.identity = None
            raise

    def _note_refusal(self, radar: Radar, error: RefusedError) -> None:
        """Configure a radar again that refuses; if it refuses then, ask it ever more rarely."""
        radar.refused += 1
        if radar.refused == 1:
            self._configure_again(radar, "it refuses to measure, as after a reset")
            return
        if str(radar.error) != str(error):
            self._listener.on_note(radar, f"{error}; it is asked again", warning=True)
        radar.error = error
        radar.measuring = None  # so that it is started again
        radar.due = time.monotonic() + self._pause(radar)

    def _write(self, radar: Radar, changes: Mapping[str, Value]) -> dict[str, Value]:
        with self._stopped_for(radar, changes):
            return radar.write(_Access(self, radar), changes)

    def _start_or_stop(self, radar: Radar) -> None:
        if not self.wants(radar):
            self._stop(radar)
        elif not radar.measuring:
            self._start(radar)
        radar.due = 0.0

    def _start(self, radar: Radar) -> None:
        """Start; a radar that refuses may measure already (section 3.3.12): it is stopped first."""
        radar.measuring = None
        try:
            self._start_in_turn(radar)
        except RefusedError:
            self._stop(radar)
            self._start_in_turn(radar)
        radar.measuring = True

    def _start_in_turn(self, radar: Radar) -> None:
        """Start so that the cycles of the radars on the line end one after the other.

        Each answers at the end of its cycle. Where those come together, a radar's cycle passes
        while the line waits for another one.
        """
        turn = self._turn_of(radar)
        if turn is not None:
            time.sleep((turn - time.monotonic()) % radar.cycle_time)
        self._execute(radar, commands.START)
        radar.forget_lists()
        radar.cycle_end = radar.aligned = time.monotonic()

    def _turn_of(self, radar: Radar) -> float | None:
        """Return when one of its cycles should end; None where there is no radar like it."""
        other = next((other for other in self.devices if other is not radar and other.sends_lists
                      and other.cycle_time == radar.cycle_time), None)
        if other is None:
            return None
        places = self.devices.index(radar) - self.devices.index(other)
        return other.cycle_end + places * self._share_of_cycle(radar)

    def _stop(self, radar: Radar) -> None:
        """Stop; one of which nobody knows whether it measures may refuse that if it does not."""
        before, radar.measuring = radar.measuring, None
        if before is not False:
            try:
                self._execute(radar, commands.STOP)
            except RefusedError:  # "not in the right measurement mode" (section 3.3.12)
                if before:
                    raise
            radar.forget_lists()
        radar.measuring = False

    @contextlib.contextmanager
    def _stopped_for(self, radar: Radar, changes: Iterable[str]) -> Iterator[None]:
        """Stop the acquisition around changes that need it."""
        needed = radar.measuring is not False and any(
            radar.settings[name].needs_stop for name in changes if name in radar.settings)
        if needed:
            self._stop(radar)
        try:
            yield
        finally:
            if needed:
                with contextlib.suppress(RefusedError):  # it is told again in its next turn
                    self._start_or_stop(radar)

    # --- measuring ---

    def _measure(self, radar: Radar) -> None:
        """Read one target list, and what else was asked for."""
        model = self._model(radar)
        resolution = self._resolution(radar)
        timeout = (max(model.timeout, 1.1 * radar.cycle_time) + LATENCY
                   + self.line.link.seconds(radar.list_size(Resolution.BITS_32)))
        targets, stamp = self._read_target_list(radar, resolution, timeout)
        begin = time.monotonic() - (time.time_ns() - stamp) * 1e-9
        missed = radar.count_list(begin, clipping=targets.clipping, shared=len(self.devices) > 1)
        self._listener.on_target_list(radar, targets, stamp)
        if radar.options.read_range_list and model.supports(commands.READ_RANGE_LIST):
            range_list, stamp = self._timed(radar, commands.READ_RANGE_LIST, timeout)
            self._listener.on_range_list(radar, range_list, targets, stamp)
        if radar.options.read_digital_outputs and model.supports(commands.READ_DIGITAL_OUTPUTS):
            outputs, stamp = self._timed(radar, commands.READ_DIGITAL_OUTPUTS, timeout)
            self._listener.on_digital_outputs(radar, outputs, stamp)
        if missed:
            self._align(radar)

    def _read_target_list(self, radar: Radar, resolution: Resolution,
                          timeout: float) -> tuple[TargetList, int]:
        model, parser, output = self._model(radar), self.line.parser, radar.options.output
        parser.fixed_targets = radar.fixed_targets if resolution.fixed_length else None
        try:
            targets, stamp = self._exchange(
                radar, commands.read_target_list(radar.address, output, resolution),
                lambda frame: decode_target_list(frame, model.range_step_16), timeout, attempts=1)
        except RefusedError as error:
            raise RefusedError(
                f"no target list of output {output} in {resolution.bits} bit, change output or "
                f"target_list_resolution: {error}") from None
        radar.fixed_targets = parser.fixed_targets or 0
        return targets, stamp

    def _align(self, radar: Radar) -> None:
        """Start a radar again that is out of its turn, as the clocks of radars drift apart."""
        turn, share = self._turn_of(radar), self._share_of_cycle(radar)
        if (turn is None or time.monotonic() < radar.aligned + REALIGN_PERIOD
                or self._list_seconds(radar) > share):
            return
        if abs(math.remainder(radar.cycle_end - turn, radar.cycle_time)) > share / 4:
            self._stop(radar)
            self._start(radar)

    def _resolution(self, radar: Radar) -> Resolution:
        return radar.resolution(self.line.link.baud_rate, len(self.devices))

    def _list_seconds(self, radar: Radar) -> float:
        """Return how long the longest target list takes on the line."""
        return self.line.link.seconds(radar.list_size(self._resolution(radar)))

    def _share_of_cycle(self, radar: Radar) -> float:
        """Return how long the line may serve a radar in a cycle, so that each gets its own."""
        return radar.cycle_time / len(self.devices)

    def least_rate(self, radar: Radar) -> float:
        """Return the target lists per second which a radar gets whatever the others do.

        In the worst case the cycles end together, and each radar waits for a cycle of every other.
        """
        waiting = sum(other.cycle_time for other in self.devices
                      if other.sends_lists and other is not radar)
        return 1 / (radar.cycle_time + waiting)

    def _is_check_due(self, radar: Radar) -> bool:
        """Whether to look for a reset: after a silence, and now and then if it costs no cycle."""
        if radar.misses or radar.refused:
            return True
        seconds = self._list_seconds(radar) + self.line.link.seconds(CHECK_SIZE) + CHECK_TIME
        return time.monotonic() > radar.check_due and seconds < self._share_of_cycle(radar)

    def _keep_alive(self, radar: Radar) -> None:
        """Check that a radar without target lists is there and as it was; read temperatures."""
        radar.due = time.monotonic() + KEEP_ALIVE
        self._execute(radar, commands.READ_ADDRESS)
        self._check_reset(radar)
        if not self._model(radar).supports(commands.READ_DSP_TEMPERATURE):
            return
        temperatures = {"dsp": commands.READ_DSP_TEMPERATURE, "rfe": commands.READ_RFE_TEMPERATURE}
        stamp = 0
        for name, command in temperatures.items():
            with contextlib.suppress(RefusedError):  # this one lacks it
                radar.temperatures[name], stamp = self._timed(radar, command)
        self._listener.on_temperatures(radar, stamp)

    def _check_reset(self, radar: Radar) -> None:
        """Configure a radar again that lost a setting which is not in its EEPROM."""
        names = sorted(radar.unsaved or radar.options.wanted.keys() & radar.settings.keys())
        if not names:
            return
        radar.checks += 1
        radar.check_due = time.monotonic() + CHECK_PERIOD
        name = names[radar.checks % len(names)]
        setting = radar.settings[name]
        raws = self.read_record(radar, record_of(setting), Location.RAM, attempts=1)
        reported = setting.decode(raws[setting.field])
        if reported != radar.values[name]:
            self._configure_again(radar, f"{name} is {setting.text(reported)}, it was "
                                         f"{setting.text(radar.values[name])}")

    # --- requests ---

    def _model(self, radar: Radar) -> Model:
        """Return the model of a radar; raises NoAnswerError where it is not connected."""
        self._require(radar)
        assert radar.model is not None
        return radar.model

    def _require_support(self, radar: Radar, command: Command[T]) -> Model:
        model = self._model(radar)
        if not model.supports(command):
            raise SettingError(f"{model.name} cannot {command.name}")
        return model

    def _baud_candidates(self, radar: Radar) -> tuple[int, ...]:
        if self._baud_rate:
            return (self._baud_rate,)
        if self.line.is_open and any(other.is_connected for other in self.devices):
            return (self.line.link.baud_rate,)
        if radar.options.model is not None:
            return (radar.options.model.baud_rate,)
        return BAUD_RATES[:1] if self._guesses_baud_rate else BAUD_RATES

    @property
    def _guesses_baud_rate(self) -> bool:
        """Whether the port takes any baud rate, so that an answer does not show the right one."""
        return (not self._baud_rate and self.line.port.startswith(SOCKET)
                and not any(radar.is_connected for radar in self.devices))

    def _answers_at(self, radar: Radar, address: int) -> bool:
        try:
            self._exchange(radar, commands.READ_DEVICE_NAME.request(address), lambda frame: None,
                           REPLY_TIMEOUT)
        except NoAnswerError:
            return False
        return True

    def _ask_address(self, radar: Radar) -> int:
        """Ask for the address by broadcast; one sensor on the line may answer (3.3.4.1)."""
        frames = self.line.broadcast(commands.READ_ADDRESS.request(BROADCAST))
        addresses = sorted({frame.source for frame in frames})
        if len(addresses) > 1:
            raise WrongDeviceError(
                f"several sensors answer ({', '.join(map(str, addresses))}); say which one with "
                "the parameter address, or name all of them with the parameter sensors")
        if not addresses:
            raise NoAnswerError(f"no sensor answers on {self.line.port} at "
                                f"{self.line.link.baud_rate} Bd")
        return addresses[0]

    def _explained(self, radar: Radar, error: DriverError) -> DriverError:
        """Add to "no answer" what could be found out about the reason."""
        if not isinstance(error, (NoAnswerError, FrameError)) or len(self.devices) > 1:
            return error
        hint = self._other_sensor(radar)
        where = f"at address {radar.options.address} " if radar.options.address else ""
        rates = " or ".join(str(rate) for rate in self._baud_candidates(radar))
        return NoAnswerError(f"no answer {where}on {self.line.port} at {rates} Bd{hint}")

    def _other_sensor(self, radar: Radar) -> str:
        """Look for a sensor at other addresses and baud rates."""
        link, parser = self.line.link, self.line.parser
        configured = link.baud_rate
        damaged = parser.damaged_frames + parser.dropped_bytes
        try:
            for baud_rate in dict.fromkeys((*self._baud_candidates(radar), *BAUD_RATES)):
                link.baud_rate = baud_rate
                frames = self.line.broadcast(commands.READ_ADDRESS.request(BROADCAST))
                if frames and baud_rate in self._baud_candidates(radar) and (
                        radar.options.address in (BROADCAST, frames[0].source)):
                    return ("; it answers only some requests: check the wiring (termination, "
                            "length, ground)")
                if frames:
                    return (f", but a sensor answers at address {frames[0].source} and "
                            f"{baud_rate} Bd; correct the parameters address and serial_baud")
        finally:
            link.baud_rate = configured
        if parser.damaged_frames + parser.dropped_bytes > damaged:
            return ("; bytes arrive that are no iSYS frames: several sensors answer at once (give "
                    "the parameter address), or something else talks on this line")
        return "; check power, wiring (RS-485: A and B swapped?) and the address"

    def _identify(self, radar: Radar) -> Identity:
        device_name, _ = self._timed(radar, commands.READ_DEVICE_NAME, attempts=1)
        model = model_of_product(self._execute(radar, commands.READ_PRODUCT_INFORMATION))
        firmware = self._execute(radar, commands.READ_FIRMWARE_VERSION)
        return Identity(model.with_firmware(firmware.number), device_name, firmware, *(
            self._if_supported(radar, command) for command in (
                commands.READ_DSP_HARDWARE_VERSION, commands.READ_RFE_HARDWARE_VERSION,
                commands.READ_BOOTLOADER_VERSION)))

    def _if_supported(self, radar: Radar, command: Command[T]) -> T | None:
        """Return the result, or None where older firmware refuses (section 3.3.6.5)."""
        try:
            return self._execute(radar, command)
        except RefusedError:
            return None

    def _read_all(self, radar: Radar) -> None:
        radar.read_all(_Access(self, radar), settings_of(self._model(radar)),
                       self._note_of(radar))

    def _execute(self, radar: Radar, command: Command[T], timeout: float = 0.0) -> T:
        return self._timed(radar, command, timeout)[0]

    def _timed(self, radar: Radar, command: Command[T], timeout: float = 0.0,
               attempts: int = ATTEMPTS) -> tuple[T, int]:
        if not timeout:
            writes_eeprom = command.function_code == commands.SAVE_ALL_SETTINGS.function_code
            timeout = EEPROM_TIMEOUT if writes_eeprom else REPLY_TIMEOUT
        try:
            return self._exchange(radar, command.request(radar.address),
                                  lambda frame: command.decode(frame.pdu), timeout,
                                  attempts=attempts)
        except RefusedError as error:
            raise RefusedError(f"cannot {command.name}: {error}") from None

    def read_record(self, radar: Radar, record: IsysRecord, location: Location,
                    attempts: int = ATTEMPTS) -> tuple[Raw, ...]:
        """Return the raw fields of a settings record."""
        return self._exchange(radar, record.read_request(radar.address, location),
                              lambda frame: record.decode_reply(frame.pdu, location),
                              REPLY_TIMEOUT, attempts=attempts)[0]

    def write_record(self, radar: Radar, record: IsysRecord, values: tuple[Raw, ...],
                     location: Location = Location.RAM) -> None:
        """Write the raw fields of a settings record; with EEPROM, to the RAM as well."""
        self._exchange(radar, record.write_request(radar.address, values, location),
                       _acknowledged, REPLY_TIMEOUT + EEPROM_TIMEOUT)

    def _exchange(self, radar: Radar, request: Frame, decode: Callable[[Frame], T], timeout: float,
                  sources: tuple[int, ...] = (), attempts: int = ATTEMPTS) -> tuple[T, int]:
        """Exchange a request with a radar, see `Line.exchange`."""
        try:
            return self.line.exchange(request, decode, timeout, sources=sources,
                                      attempts=attempts)
        except RefusedError:
            radar.statistics.refusals += 1
            raise


def _acknowledged(frame: Frame) -> None:
    if frame.pdu:
        raise FrameError(f"acknowledge carries {len(frame.pdu)} bytes: {frame}")


def _covers(command: Command[None], setting: Setting) -> bool:
    """Whether a command to save keeps a setting."""
    return (command is commands.SAVE_ALL_SETTINGS or is_application_setting(setting)
            == (command is commands.SAVE_APPLICATION_SETTINGS))


class _Access:
    """The records of one radar, for `read_settings` and `write_settings`."""

    def __init__(self, bus: RadarBus, radar: Radar, location: Location = Location.RAM) -> None:
        self._bus = bus
        self._radar = radar
        self._location = location

    def read_record(self, record: Record) -> tuple[Raw, ...]:
        """Return the raw fields of a record."""
        assert isinstance(record, IsysRecord)
        return self._bus.read_record(self._radar, record, self._location)

    def write_record(self, record: Record, values: tuple[Raw, ...]) -> None:
        """Write all fields of a record."""
        assert isinstance(record, IsysRecord)
        self._bus.write_record(self._radar, record, values, self._location)
