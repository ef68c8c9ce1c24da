# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Finding a radar, making it as it is wanted, and noticing that it is not so any more."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from driver_common import advice
from driver_common import clocks as time
from driver_common.device import Note
from driver_common.errors import (
    DriverError,
    FrameError,
    NoAnswerError,
    RefusedError,
    WrongDeviceError,
)
from isys_radar_driver import commands
from isys_radar_driver.access import ATTEMPTS, Access
from isys_radar_driver.acquisition import Acquisition
from isys_radar_driver.commands import Location
from isys_radar_driver.frames import BROADCAST
from isys_radar_driver.listener import Listener
from isys_radar_driver.models import BAUD_RATES, RANGE_BOUND, model_of_product
from isys_radar_driver.radar import Identity, Radar
from isys_radar_driver.settings import record_of, settings_of

BOARD_TEMPERATURES = {"dsp": commands.READ_DSP_TEMPERATURE, "rfe": commands.READ_RFE_TEMPERATURE}
EXPLAIN_AFTER = 3.0  # s without a radar after which it is worth the time to look for the reason
KEEP_ALIVE = 1.0  # s between requests to a radar that is not measuring
CHECK_PERIOD = 5.0  # s between checks for a reset while it measures
CHECKED_TIME = 0.5  # s that a check holds on a line that often damages requests
CHECK_TIME = 0.020  # s that a check may take beside its bytes, with a slow adapter
CHECK_SIZE = 40  # bytes of request and reply
SOCKET = "socket://"  # a port that takes any baud rate, as the line is somewhere else


class Connection:
    """The life of the radars on a line, from the first request to the last."""

    def __init__(self, access: Access, radars: Sequence[Radar], acquisition: Acquisition,
                 listener: Listener, baud_rate: int) -> None:
        """Connect radars that share a line.

        Args:
            access: Requests to a radar.
            radars: All radars on the line.
            acquisition: Starts and stops a radar.
            listener: Told of settings and temperatures that were read, and of resets.
            baud_rate: In Bd; 0 = try the default rates of the models.
        """
        self._baud_rate = baud_rate
        self._access = access
        self._line = access.line
        self._radars = radars
        self._acquisition = acquisition
        self._listener = listener

    # --- find ---

    def baud_candidates(self, radar: Radar) -> tuple[int, ...]:
        """Return the baud rates at which a radar may answer, the likeliest first."""
        if self._baud_rate:
            return (self._baud_rate,)
        if self._line.is_open and any(other.is_connected for other in self._radars):
            return (self._line.link.baud_rate,)
        if radar.options.model is not None:
            return (radar.options.model.baud_rate,)
        if self._guesses_baud_rate:
            return (radar.baud_rate or BAUD_RATES[0],)
        return tuple(dict.fromkeys((radar.baud_rate or BAUD_RATES[0], *BAUD_RATES)))

    @property
    def _guesses_baud_rate(self) -> bool:
        """Whether the port takes any baud rate, so that an answer does not show the right one."""
        return (not self._baud_rate and self._line.port.startswith(SOCKET)
                and not any(radar.is_connected for radar in self._radars))

    def find(self, radar: Radar) -> None:
        """Find the radar at one of the possible baud rates, identify and configure it.

        One that was lost measures on first, with its settings looked at behind that.
        """
        identity = self._search(radar)
        if identity is radar.known:
            radar.identity = identity
            radar.measuring = None
            radar.unchecked = [*radar.settings]
            radar.misses = 1  # so that a setting is looked at before its first list
            self._acquisition.start_or_stop(radar)
            return
        expected = radar.options.model
        if expected is not None and identity.model.name != expected.name:
            raise WrongDeviceError(f"expected an {expected.name}, but an {identity.model.name} "
                                   f"answers at address {radar.address}; connect the right one or "
                                   "change the parameter model")
        identity.model.resolutions_of(radar.options.resolution)
        if self._guesses_baud_rate:
            self._line.link.baud_rate = identity.model.baud_rate
        radar.identity = identity
        radar.values = {}  # it may be another one
        radar.baud_rate = self._line.link.baud_rate
        self._configure(radar)

    def _search(self, radar: Radar) -> Identity:
        """Return who answers; raises DriverError where nobody does."""
        failure: DriverError = NoAnswerError("no answer")
        for baud_rate in self.baud_candidates(radar):
            self._line.link.baud_rate = baud_rate
            try:
                if radar.address == BROADCAST:
                    radar.address = self._ask_address()
                return self._identify(radar)
            except (NoAnswerError, FrameError) as error:
                failure = error
                radar.address = radar.options.address  # it may have another one by now
        raise failure

    def _ask_address(self) -> int:
        """Ask for the address by broadcast; one sensor on the line may answer (3.3.4.1)."""
        frames = self._line.broadcast(commands.READ_ADDRESS.request(BROADCAST))
        addresses = sorted({frame.source for frame in frames})
        if len(addresses) > 1:
            raise WrongDeviceError(advice.SEVERAL.text(addresses=", ".join(map(str, addresses))))
        if not addresses:
            raise NoAnswerError(f"no sensor answers on {self._line.port} at "
                                f"{self._line.link.baud_rate} Bd")
        return addresses[0]

    def _identify(self, radar: Radar) -> Identity:
        access = self._access
        attempts = 1 if radar.known is None else ATTEMPTS
        device_name, _ = access.timed(radar, commands.READ_DEVICE_NAME, attempts=attempts)
        if radar.known is not None and device_name == radar.known.device_name:
            return radar.known
        model = model_of_product(access.execute(radar, commands.READ_PRODUCT_INFORMATION))
        firmware = access.execute(radar, commands.READ_FIRMWARE_VERSION)
        return Identity(model.with_firmware(firmware.number), device_name, firmware, *(
            access.optional(radar, command) for command in (
                commands.READ_DSP_HARDWARE_VERSION, commands.READ_RFE_HARDWARE_VERSION,
                commands.READ_BOOTLOADER_VERSION)))

    def explained(self, radar: Radar, error: DriverError) -> DriverError:
        """Add to "no answer" what could be found out about the reason."""
        if not isinstance(error, (NoAnswerError, FrameError)) or len(self._radars) > 1:
            return error
        if time.monotonic() < radar.well + EXPLAIN_AFTER:
            return error  # it may be back sooner than all that was asked
        hint = self._other_sensor(radar)
        where = f"at address {radar.options.address} " if radar.options.address else ""
        rates = " or ".join(str(rate) for rate in self.baud_candidates(radar))
        return NoAnswerError(f"no answer {where}on {self._line.port} at {rates} Bd{hint}")

    def _other_sensor(self, radar: Radar) -> str:
        """Look for a sensor at other addresses and baud rates."""
        link, parser = self._line.link, self._line.parser
        configured = link.baud_rate
        damaged = parser.damaged_frames + parser.dropped_bytes
        try:
            for baud_rate in dict.fromkeys((*self.baud_candidates(radar), *BAUD_RATES)):
                link.baud_rate = baud_rate
                frames = self._line.broadcast(commands.READ_ADDRESS.request(BROADCAST))
                if frames and baud_rate in self.baud_candidates(radar) and (
                        radar.options.address in (BROADCAST, frames[0].source)):
                    return f"; {advice.POOR_LINE.text()}"
                if frames:
                    return ", but " + advice.ANOTHER_ADDRESS.text(
                        address=frames[0].source, rate=f" and {baud_rate} Bd",
                        parameters="s address and serial_baud")
        finally:
            link.baud_rate = configured
        if parser.damaged_frames + parser.dropped_bytes > damaged:
            return f"; {advice.GARBAGE.text(family='iSYS')}"
        return f"; {advice.SILENCE_RS485.text()}"

    # --- configure ---

    def _configure(self, radar: Radar) -> None:
        """Read all settings, make them as wanted, and start if that is wanted.

        Where that fails the radar is not connected, as nobody knows what it holds.
        """
        identity, radar.known = radar.identity, None
        radar.unchecked.clear()
        try:
            radar.measuring = None  # it may have been left running
            self._acquisition.stop(radar)
            self.read_all(radar)
            radar.make_as_wanted(lambda changes: self._acquisition.write(radar, changes),
                                 self._note_of(radar))
            self._acquisition.start_or_stop(radar)
        except DriverError:
            radar.identity = None
            raise
        radar.known = identity

    def configure_again(self, radar: Radar, reason: str) -> None:
        """React to a radar that seems to have been reset without notice; raises DriverError."""
        self._listener.on_note(radar, f"{reason}; configuring it again", warning=True)
        self._configure(radar)
        self._listener.on_values(radar)

    def read_all(self, radar: Radar) -> None:
        """Read all settings that its model has; raises DriverError."""
        settings = settings_of(radar.known_model)
        for name, setting in [*settings.items()]:
            if setting.section == RANGE_BOUND:  # which no manual promises
                try:
                    self._access.read_record(radar, record_of(setting), Location.RAM, attempts=1)
                except (RefusedError, NoAnswerError):
                    del settings[name]
        radar.read_all(self._access.records(radar), settings, self._note_of(radar))

    def _note_of(self, radar: Radar) -> Note:
        return partial(self._listener.on_note, radar)

    # --- look after ---

    def keep_alive(self, radar: Radar) -> None:
        """Check that a radar without target lists is there and as it was; read temperatures."""
        radar.due = time.monotonic() + KEEP_ALIVE
        self._access.execute(radar, commands.READ_DEVICE_NAME)
        self.check_reset(radar)
        if not radar.known_model.supports(commands.READ_DSP_TEMPERATURE):
            return
        stamp = 0
        for name, command in BOARD_TEMPERATURES.items():
            if name not in radar.absent:
                try:
                    radar.temperatures[name], stamp = self._access.timed(radar, command, attempts=1)
                except (RefusedError, NoAnswerError):  # this one lacks it
                    radar.absent.add(name)
        if stamp:
            self._listener.on_temperatures(radar, stamp)

    def is_check_due(self, radar: Radar) -> bool:
        """Whether to look for a reset: after a silence, and now and then if it costs no cycle."""
        if radar.refused or radar.unchecked:
            return True
        if radar.misses:
            return not self._line.in_doubt or time.monotonic() > radar.checked + CHECKED_TIME
        return time.monotonic() > radar.check_due and self._acquisition.has_time_for(
            radar, self._line.link.seconds(CHECK_SIZE) + CHECK_TIME)

    def check_reset(self, radar: Radar) -> None:
        """Configure a radar again that lost a setting which is not in its EEPROM."""
        name = self._next_to_check(radar)
        if not name:
            return
        radar.check_due = time.monotonic() + CHECK_PERIOD
        setting = radar.settings[name]
        raws = self._access.read_record(radar, record_of(setting), Location.RAM)
        radar.checked = time.monotonic()
        reported = setting.decode(raws[setting.field])
        if reported != radar.values[name]:
            self.configure_again(radar, f"{name} is {setting.text(reported)}, it was "
                                        f"{setting.text(radar.values[name])}")

    def _next_to_check(self, radar: Radar) -> str:
        """Return the next setting to look at, "" where there is none; what can be lost is first."""
        names = sorted(radar.unsaved or radar.options.wanted.keys() & radar.settings.keys())
        radar.checks += bool(names)
        if names and (radar.misses or not radar.unchecked):
            return names[radar.checks % len(names)]
        return radar.unchecked.pop() if radar.unchecked else ""
