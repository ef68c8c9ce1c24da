# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Measuring: sample rate, start and stop, looking after a stream, readings now and then."""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Callable, Iterator, Mapping

from driver_common import clocks as time
from driver_common.errors import (
    DriverError,
    FrameError,
    NoAnswerError,
    RefusedError,
    StepInterruptedError,
)
from driver_common.sample_clock import HostClock, SampleClock
from driver_common.settings import Value, read_settings
from icotronic_driver import commands
from icotronic_driver.access import READINGS, Access, Survey
from icotronic_driver.identifier import STH_1
from icotronic_driver.laws import DEVICE
from icotronic_driver.line import Line
from icotronic_driver.listener import Listener
from icotronic_driver.reception import Reception
from icotronic_driver.sensor import Phase, Sensor
from icotronic_driver.settings import SETTINGS, nearest_adc_configuration
from icotronic_driver.streaming import StreamDecoder

LISTEN_TIME = 0.05  # s that jobs of others wait at most
KEEP_ALIVE = 1.0  # s between checks of a connection without a stream
SILENCE = 1.0  # s without a frame after which the stream is looked after
LAW_SETTINGS = ("calibration.", "adc.reference", "used_sensor.")  # on them laws depend
RATE_TIME = 3.0  # s in which a rate is measured
RATE_FRAMES = 100  # and frames
RATE_DEVIATION = 0.03  # by which it may differ from that of the ADC settings
SHORTEST_PERIOD = 0.5  # s in which all readings can be taken
ON_THE_WAY = 0.05  # s without a frame after which none of a stopped stream will come


class Acquisition:
    """The stream of a connected sensor, and the settings on which it depends."""

    def __init__(self, line: Line, sensor: Sensor, access: Access, listener: Listener,
                 wanted: Callable[[], bool]) -> None:
        """Prepare to measure.

        Args:
            line: The bus on which the sensor streams.
            sensor: The sensor.
            access: Its settings.
            listener: Is told of streams, readings and notes.
            wanted: Says whether the sensor is to measure.
        """
        self._line = line
        self._sensor = sensor
        self._access = access
        self._listener = listener
        self._wanted = wanted
        self._last_frame = 0.0
        self._told_loss = False
        self._counted = 0, 0  # frames that came and that were lost
        self._host_clock = HostClock(line.recorder.read_offset)
        self._reception: Reception | None = None
        self._told_rate = ""
        self._told_pace = False
        self._pace_since = 0.0, 0  # time in s and number of a frame
        self._deviation = 0.0  # of the pace, when it was measured last
        self._next_reading = 0.0
        self._readings = itertools.cycle(READINGS)

    # --- settings ---

    @property
    def follows_sample_rate(self) -> bool:
        """Whether the rate settings of the ADC follow from the option `sample_rate`."""
        options = self._sensor.options
        return bool(options.sample_rate) and options.config_mode != "leave"

    def configure(self) -> None:
        """Make a connected sensor as wanted; raises DriverError."""
        self._apply_sample_rate()
        self._sensor.make_as_wanted(self.write, self._note)
        self._choose_laws()

    def write(self, changes: Mapping[str, Value]) -> dict[str, Value]:
        """Write settings, and return what the sensor reports; raises DriverError."""
        sensor = self._sensor
        with self._stopped_for(changes):
            reported = sensor.write(self._access, changes)
            if any(name.startswith(LAW_SETTINGS) for name in changes):
                self._choose_laws()
        if "name" in changes and sensor.options.sensor_name:
            sensor.options.sensor_name = str(reported["name"])
        return reported

    def _apply_sample_rate(self) -> None:
        """Turn the wanted sample rate into settings of the ADC."""
        sensor = self._sensor
        if not self.follows_sample_rate:
            return
        if "adc.prescaler" not in sensor.settings:
            self._note("sample_rate has no effect: the sensor does not tell how its ADC is set",
                       warning=True)
            return
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

    def _choose_laws(self) -> None:
        """Take the law of each channel; say which, and what is wrong."""
        sensor = self._sensor
        if any(one.sensor == DEVICE for one in sensor.options.laws.values()):
            with contextlib.suppress(RefusedError):
                sensor.eeprom_calibrations = Survey(self._line).eeprom_calibrations()
        before = sensor.channels
        sensor.choose_laws()
        for complaint in sensor.law_complaints:
            self._note(complaint, warning=True)
        if sensor.channels != before:
            self._note(f"channels {'; '.join(map(str, sensor.channels))}")

    def read_again(self) -> None:
        """Read all settings, and take those that changed as wanted; raises DriverError."""
        sensor, before = self._sensor, self._sensor.values
        sensor.read_all(self._access, dict(sensor.settings), self._note)
        changed = {name: value for name, value in sensor.values.items()
                   if value != before.get(name) and value == value}  # NaN is no change
        sensor.options.wanted |= changed
        sensor.unsaved |= changed.keys()
        self._choose_laws()
        if changed and sensor.decoder is not None:
            self.stop()
            self.start_or_stop()
        self._listener.on_values(sensor)

    @contextlib.contextmanager
    def _stopped_for(self, changes: Mapping[str, Value]) -> Iterator[None]:
        """Stop the stream around changes that need it, or that change how it is decoded."""
        streaming = self._sensor.decoder is not None and any(
            name.startswith("calibration.") or SETTINGS[name].needs_stop
            for name in changes if name in SETTINGS)
        if streaming:
            self.stop()
        try:
            yield
        finally:
            if streaming:
                self.start_or_stop()

    # --- the stream ---

    def attend(self) -> None:
        """Receive the stream, or check the connection; read something now and then.

        Raises:
            DriverError: The sensor is lost.
        """
        sensor = self._sensor
        if self._wanted() != (sensor.decoder is not None):
            self.start_or_stop()  # it did not work when it was asked for
        if sensor.decoder is not None:
            self._receive(sensor.decoder)
        else:
            if not self._access.is_connected():
                raise NoAnswerError("the sensor disconnected")
            sensor.due = time.monotonic() + KEEP_ALIVE
        if sensor.options.status_period and time.monotonic() >= self._next_reading:
            self._read_next()

    def restart(self) -> None:
        """Begin the stream anew, after a change of channels, calibration or rate.

        Raises:
            DriverError: The sensor does not answer or refuses.
        """
        if self._sensor.phase is Phase.CONNECTED:
            self.stop()
            self.configure()
            self.start_or_stop()
            self._listener.on_values(self._sensor)

    def start_or_stop(self) -> None:
        """Start or stop the stream, as is wanted; raises DriverError."""
        if not self._wanted():
            self.stop()
        elif self._sensor.decoder is None:
            self._start()
        self._sensor.due = 0.0

    def stop(self) -> None:
        """Stop the stream if there is one; raises DriverError."""
        if self._sensor.decoder is not None:
            self._line.request(commands.STOP_ACCELERATION.request(STH_1))
            self._take_what_is_on_the_way()
            self.end_stream()

    def _start(self) -> None:
        sensor = self._sensor
        form = sensor.format
        sensor.decoder = StreamDecoder(form, form.frame_rate(sensor.adc.sample_rate))
        sensor.clock = SampleClock(sensor.sample_rate, waits=True)
        self._reception = Reception(
            sensor.decoder, sensor.clock, self._host_clock, self._listener.on_stream(sensor),
            kernel_stamps=self._line.interface == "socketcan")
        self._line.on_stream = self._reception.handler()
        self._last_frame, self._told_loss = time.monotonic(), False
        self._counted = 0, 0
        self._line.pauses.watch()
        self._pace_since, self._deviation = (self._last_frame, 0), 0.0
        self._told_pace = False
        try:
            self._line.request(commands.START_ACCELERATION.request(STH_1, form),
                               self._longest_silence / 2)  # the first frame is the answer
        except StepInterruptedError:  # it may have begun; who interrupted stops it
            raise
        except DriverError:
            self.end_stream()
            raise

    def _receive(self, decoder: StreamDecoder) -> None:
        """Receive for a moment; look after a stream that fell silent."""
        self._host_clock.follow()
        self._line.listen(LISTEN_TIME, self._sensor.options.may_wait)
        frames, lost = self._counted
        self._counted = decoder.statistics.frames, decoder.statistics.lost
        self._line.pauses.count_lost(decoder.statistics.lost - lost)
        if decoder.statistics.lost and not self._told_loss:
            self._told_loss = True
            self._note(f"{decoder.statistics.lost} frames were lost on the radio; more are "
                       "counted in the diagnostics only", warning=True)
        now = time.monotonic()
        if decoder.statistics.frames != frames:
            self._last_frame = now
            self._check_pace(decoder)
        elif now - self._last_frame > self._longest_silence:
            self._look_after_stream()
        elif now - self._last_frame > max(LISTEN_TIME, self._usual_silence) and self._reception:
            self._reception.finish()  # what is held waits for frames that may never come

    def _check_pace(self, decoder: StreamDecoder) -> None:
        """Read the ADC settings again where frames come at another pace than these say."""
        (since, first), last = self._pace_since, self._last_frame
        if last - since < RATE_TIME or decoder.number - first < RATE_FRAMES:
            return
        self._pace_since = last, decoder.number
        expected = decoder.format.frame_rate(self._sensor.adc.sample_rate)
        share = (decoder.number - first) / (last - since) / expected
        before, self._deviation = self._deviation, share - 1
        # A busy host makes the pace slow and then fast.
        if min(before, share - 1) > RATE_DEVIATION or max(before, share - 1) < -RATE_DEVIATION:
            self._look_after_pace(share)

    def _look_after_pace(self, share: float) -> None:
        """React to a stream that comes at `share` of its pace."""
        sensor = self._sensor
        before = sensor.adc
        sensor.values |= read_settings(self._access, [
            setting for name, setting in sensor.settings.items() if name.startswith("adc.")])
        if sensor.adc != before:
            self._note("something else changed the ADC settings; starting the stream again",
                       warning=True)
            self.restart()
        elif not self._told_pace:
            self._told_pace = True
            self._note(f"the stream comes at {share * sensor.sample_rate:.4g} samples per second, "
                       f"not at {sensor.sample_rate:.4g} as its ADC settings say", warning=True)

    @property
    def _longest_silence(self) -> float:
        """Time in s without a frame after which something is wrong with the stream."""
        return max(SILENCE, self._usual_silence)

    @property
    def _usual_silence(self) -> float:
        """Time in s of three frames."""
        return 3 / self._sensor.format.frame_rate(self._sensor.adc.sample_rate)

    def _look_after_stream(self) -> None:
        """React to a stream that fell silent: start it again where the sensor is still there."""
        if not self._access.is_connected():
            raise NoAnswerError("the sensor was lost while it streamed")
        self.end_stream()
        self._note("the stream fell silent; starting it again", warning=True)
        self.start_or_stop()

    def end_stream(self) -> None:
        """Take no more of the stream, if there is one, but what was received of it."""
        self._line.on_stream = None
        self._line.pauses.rest()
        if self._reception is not None:
            self._reception.finish()
            self._reception = None
        self._sensor.end_stream()

    def _take_what_is_on_the_way(self) -> None:
        """Receive the last frames of a stopped stream, before the next one could get them."""
        frames, end = -1, time.monotonic() + SILENCE
        while frames != self._sensor.statistics.frames and time.monotonic() < end:
            frames = self._sensor.statistics.frames
            self._line.listen(ON_THE_WAY)

    # --- readings ---

    def _read_next(self) -> None:
        """Read one of the things that are read now and then, of those that the sensor has."""
        sensor = self._sensor
        period = max(SHORTEST_PERIOD, sensor.options.status_period)
        self._next_reading = time.monotonic() + period / len(READINGS)
        reading = next(self._readings)
        if reading.name in sensor.readable:
            try:
                value = self._access.take_reading(sensor, reading)
            except (RefusedError, FrameError, NoAnswerError):
                value = None
            setattr(sensor.readings, reading.name, value)
            if value is not None:
                self._listener.on_readings(sensor, reading.name)

    def _note(self, text: str, *, warning: bool = False) -> None:
        self._listener.on_note(self._sensor, text, warning=warning)
