# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What is fuzzed of the ICOtronic system: identifiers, answers, the stream, EEPROM, requests."""

from __future__ import annotations

import contextlib
import itertools
import warnings
from random import Random

from bench.examples.icotronic import EXAMPLES, SETTINGS, STH, STH_FIELDS, STREAMING, STU, STU_FIELDS
from bench.fuzz.settings import check_raws
from bench.fuzz.target import Target, check_text, from_hex
from driver_common.errors import FrameError, RefusedError, SettingError
from driver_common.sample_clock import HostClock, SampleClock
from icotronic_driver.commands import COMMANDS, IcotronicRecord, parse_request
from icotronic_driver.eeprom import STH_EEPROM, STU_EEPROM, decode_page
from icotronic_driver.identifier import Frame, Identifier
from icotronic_driver.ordering import Frame as StreamFrame
from icotronic_driver.ordering import FrameOrder
from icotronic_driver.reception import Reception
from icotronic_driver.settings import SETTINGS as ALL_SETTINGS
from icotronic_driver.settings import TextSetting
from icotronic_driver.streaming import StreamDecoder, StreamFormat, decode_single

RECORDS = [*dict.fromkeys(setting.record for setting in ALL_SETTINGS.values())]
FRAME_RATE = 3000.0  # frames per s
LONGEST_DATA = 62  # bytes of values in a frame
ANSWERS = from_hex([*(example.answer for example in EXAMPLES),
                    *(answer for example in SETTINGS for _, answer, _ in example.exchanges)])
IDENTIFIERS = [number.to_bytes(4, "big") for example in EXAMPLES
               for number in (example.request_id, example.answer_id)]
STREAMS = from_hex([
    *(example.answer for example in STREAMING if len(example.answer) > len("E6 00")),
    "E6 00" + " 01 02 03" * 20 + " 00 00",  # CAN-FD
    # frames of sections 10.3.2 and 10.3.3, one behind the other
    "A2 00 01 80 02 80 03 80 A2 01 04 80 05 80 06 80 A2 02 07 80 08 80 09 80",
    "B9 FE 01 80 02 80 03 80 B9 FF 01 80 02 80 03 80 B9 00 01 80 02 80 03 80",
    "A2 00 01 80 02 80 03 80 A2 02 07 80 08 80 09 80 A2 01 04 80 05 80 06 80",
    "A2 07 01 80 02 80 03 80 A2 07 01 80 02 80 03 80 A2 08 01 80 02 80 03 80",
    "E1 10 01 02 03 01 02 03 E1 11 01 02 03 01 02 03"])


def _check_identifiers(data: bytes, random: Random) -> None:
    with contextlib.suppress(FrameError):
        number = int.from_bytes(data[:4], "big")
        identifier = Identifier.decode(number)
        assert identifier.encode() == number
        assert str(identifier)
    with contextlib.suppress(FrameError):
        frames = Frame.decode_abstracted(data)
        assert b"".join(frame.encode_abstracted() for frame in frames) == data


def _check_answers(data: bytes, random: Random) -> None:
    data = data[:8]
    for command in COMMANDS.values():
        with contextlib.suppress(FrameError):
            check_text(command.decode(data))
    record = random.choice(RECORDS)
    assert isinstance(record, IcotronicRecord)
    results = []
    for request in record.read_requests(STH):
        with contextlib.suppress(RefusedError):
            request.result(request.error_id, data)
        with contextlib.suppress(FrameError):
            results.append(request.result(request.acknowledgement_id, data))
    if sum(map(len, results)) == record.size:
        raws = record.decode_answers(results)
        assert len(record.write_requests(STH, raws)) == len(results)
        for setting in ALL_SETTINGS.values():
            if setting.record == record and not isinstance(setting, TextSetting):
                check_raws(setting, raws[setting.field])
            elif setting.record == record:
                check_text(setting.decode(raws[setting.field]))


def _frames(data: bytes, random: Random) -> tuple[StreamFormat, list[tuple[float, bytes]]] | None:
    """Return an input as a stream: its form, and its frames with times in s."""
    form = StreamFormat.decode(data[0] if data else 0x81)
    if not 0 < form.values_per_frame * form.value_size <= LONGEST_DATA:
        return None
    size, time, frames = form.frame_length, 0.0, []
    for start in range(0, len(data), size):
        time += random.choice((0.0, 0.0003, 0.0003, 0.1, 1.0))
        frames.append((time, data[start:start + size]))
    return form, frames


def _check_stream(data: bytes, random: Random) -> None:
    stream = _frames(data, random)
    if stream is None:
        return
    form, frames = stream
    at_once, one_by_one = StreamDecoder(form, FRAME_RATE), StreamDecoder(form, FRAME_RATE)
    half = len(frames) // 2
    for some in (frames[:half], frames[half:]):
        batch = at_once.decode(some)
        singles = [values for arrival, frame in some
                   if (values := one_by_one.decode_frame(arrival, frame)) is not None]
        assert [tuple(row.ravel().tolist()) for row in batch.values] == singles
        assert all(0 <= value <= form.full_scale for values in singles for value in values)
        assert (batch.numbers[1:] > batch.numbers[:-1]).all()
    assert at_once.statistics == one_by_one.statistics
    assert min(at_once.statistics.lost, at_once.statistics.duplicates) >= 0
    with contextlib.suppress(FrameError):
        decode_single(form, data[:8])


def _check_ordering(data: bytes, random: Random) -> None:
    stream = _frames(data, random)
    if stream is None:
        return
    form, frames = stream
    order, sorted_ = FrameOrder(StreamDecoder(form, FRAME_RATE)), []
    for time, frame in frames:
        sorted_ += order.sort(StreamFrame(frame, time, int(time * 1e9)))
    sorted_ += order.rest()
    assert not order.rest()
    arrived = [frame for _, frame in frames]
    for one in sorted_:
        arrived.remove(bytes(one.data))  # none is invented, and none comes twice


def _check_reception(data: bytes, random: Random) -> None:
    stream = _frames(data, random)
    if stream is None:
        return
    form, frames = stream
    decoder, stamps = StreamDecoder(form, FRAME_RATE), []

    def take(stamp: int, period: float, values: tuple[int, ...]) -> None:
        assert len(values) == form.values_per_frame
        assert period > 0
        stamps.append(stamp)

    clock = SampleClock(FRAME_RATE * form.data_sets, waits=True)
    reception = Reception(decoder, clock, HostClock(lambda: 10 ** 18), take,
                          kernel_stamps=random.random() < 0.5)
    handle = reception.handler()
    for time, frame in frames:
        handle(bytearray(frame), time, int(time * 1e9) + random.randrange(1000))
    reception.finish()
    assert len(stamps) == decoder.statistics.frames
    assert all(before < after for before, after in itertools.pairwise(stamps))


def _check_eeprom(data: bytes, random: Random) -> None:
    image = data.ljust(256, b"\xff")[:256]
    page = random.choice((0, 4, 5, 8))
    for fields in (STH_EEPROM, STU_EEPROM):
        for name, value in decode_page(fields, page, image).items():
            check_text(value)
            assert fields[name].text(value).isprintable()
            with contextlib.suppress(SettingError):
                encoded = fields[name].encode(value)
                assert len(encoded) == fields[name].length
                again = fields[name].decode(encoded)
                assert again == value or value != value, (name, value)
    with contextlib.suppress(FrameError):
        decode_page(STH_EEPROM, page, data)


def _check_requests(data: bytes, random: Random) -> None:
    with contextlib.suppress(SettingError), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Python's, of escapes that it does not know
        request = parse_request(data.decode("utf-8", "surrogateescape"), random.choice((STH, STU)))
        assert len(request.frame.data) <= 64
        assert Identifier.decode(request.frame.identifier.encode()) == request.frame.identifier


TARGETS = (
    Target("icotronic identifiers", _check_identifiers, [
        *IDENTIFIERS, *from_hex(("C1 05 03 00 01 02 03",))]),
    Target("icotronic answers", _check_answers, ANSWERS),
    Target("icotronic stream", _check_stream, STREAMS),
    Target("icotronic ordering", _check_ordering, STREAMS),
    Target("icotronic reception", _check_reception, STREAMS),
    Target("icotronic eeprom", _check_eeprom, [
        *from_hex(field.data for field in STH_FIELDS + STU_FIELDS), bytes(256), b"\xff" * 256]),
    Target("icotronic requests", _check_requests, [text.encode() for text in (
        "read_state", "write_state 2", "test_signal 2 7 b'\\x01'", "read_eeprom 4 0 4",
        "write_adc 2 8 64 3.3", "connect_mac '08:6B:D7:01:DE:81'", "read_acceleration",
        "write_name_1 255 b'Test-S'", "write_reduced_energy 200.0 2.0",
        "start_acceleration (True, False, False) 3")]),
)
