# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Looking for iSYS radars on a serial port, read-only: none is stopped, started or changed.

A broadcast finds a single radar at once. Where several answer it together, what arrives is damaged:
then every address is asked, one after the other. A late answer still counts, as it tells its
address.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from driver_common import advice
from driver_common.errors import DriverError, LinkError, WrongDeviceError
from isys_radar_driver import commands
from isys_radar_driver.access import Access
from isys_radar_driver.frames import (
    BROADCAST,
    FIRST_ADDRESS,
    LAST_ADDRESS,
    MASTER,
    FrameParser,
)
from isys_radar_driver.line import Line
from isys_radar_driver.models import BAUD_RATES, MODELS, model_of_product
from isys_radar_driver.radar import Identity, Options, Radar
from sensor_tools.search.place import SerialPlace
from sensor_tools.search.result import Finding, Found, Progress, Result

FAMILY = "isys"
ADDRESSES = range(FIRST_ADDRESS, LAST_ADDRESS + 1)
DEFAULT_ADDRESSES = tuple(dict.fromkeys(model.address for model in MODELS.values()))
ANSWER_TIME = 0.025  # s in which a device begins to answer, as a rule
ANSWER_SIZE = 24  # bytes of question and answer
LAST_ANSWER_TIME = 0.1  # s for those that are late
SWEEP_STEPS = 16  # in the progress bar
DAMAGE = 4  # bytes; less is a glitch
SOCKET = "socket://"


def search(place: SerialPlace, progress: Progress,
           addresses: Sequence[int] = ADDRESSES) -> Iterator[Result]:
    """Yield the radars on a port, and what is wrong there; raises LinkError.

    Args:
        place: The port.
        progress: Told how far the search is.
        addresses: Those that are asked one by one where several radars answer at once.
    """
    rates = (place.baud_rate,) if place.baud_rate else BAUD_RATES
    if place.port.startswith(SOCKET):
        rates = rates[:1]  # the line is somewhere else, and has the rate that it has
    progress.expect(len(rates))
    line = Line(place.port)
    line.open(rates[0])
    garbage = echo = False
    try:
        for rate in rates:
            progress.step(f"{place.port}: iSYS at {rate} Bd")
            line.link.baud_rate = rate
            heard = _ask_all(line)
            found, echo = heard.addresses, echo or heard.echo
            garbage = garbage or heard.is_unclear
            if heard.is_unclear and addresses:
                found = _sweep(line, addresses, progress) or found
                addresses = ()  # once is enough: only at the right rate does anybody answer
            for address in sorted(found):
                yield _identified(place, line, address)
            if found:
                garbage = False
                break
    finally:
        line.close()
    if echo:
        yield Finding.of(place, "echo", advice.ECHO, is_wrong=False)
    if garbage:
        yield Finding.of(place, "answers", advice.GARBAGE, family="iSYS")


def identify(line: Line, address: int) -> Identity:
    """Return who a radar says it is, without its hardware; raises DriverError."""
    access, radar = Access(line), Radar(Options(address=address))
    name = access.execute(radar, commands.READ_DEVICE_NAME)
    product = access.execute(radar, commands.READ_PRODUCT_INFORMATION)
    firmware = access.execute(radar, commands.READ_FIRMWARE_VERSION)
    return Identity(model_of_product(product).with_firmware(firmware.number), name, firmware,
                    None, None, None)


def _identified(place: SerialPlace, line: Line, address: int) -> Result:
    """Return the radar at an address, or what is wrong with it; raises LinkError."""
    check, damage = f"address {address}", _damage(line)
    try:
        identity = identify(line, address)
    except LinkError:
        raise
    except WrongDeviceError as error:
        return Finding(str(place), check, str(error),
                       advice.SAME_ADDRESS.filled(address=address).remedy)
    except DriverError as error:
        if _damage(line) - damage >= DAMAGE:
            return Finding.of(place, check, advice.SAME_ADDRESS, address=address)
        return Finding(str(place), check, str(error), advice.POOR_LINE.remedy)
    return Found(FAMILY, place, identity.model.name, str(address), line.link.baud_rate,
                 serial_number=identity.serial_number, firmware=str(identity.firmware),
                 parameters={"address": address, "serial_baud": line.link.baud_rate})


def _damage(line: Line) -> int:
    """Return how much arrived so far that makes no sense, about in bytes."""
    return line.parser.damaged_frames + line.parser.dropped_bytes


class Heard(NamedTuple):
    """What came back to a question.

    Attributes:
        addresses: Whose answers came.
        damage: Bytes that make no sense, about.
        echo: Whether the question itself came back.
    """

    addresses: set[int]
    damage: int
    echo: bool

    @property
    def is_unclear(self) -> bool:
        """Whether more sensors may be there than those whose answers came."""
        return self.damage >= DAMAGE or len(self.addresses) > 1


def _ask_all(line: Line) -> Heard:
    """Ask by broadcast, and without any answer at the usual addresses; raises LinkError."""
    for address in (BROADCAST, BROADCAST, *DEFAULT_ADDRESSES):
        heard = _ask(line, address, LAST_ANSWER_TIME)
        if heard.addresses or heard.damage:
            break
    return heard


def _sweep(line: Line, addresses: Sequence[int], progress: Progress) -> set[int]:
    """Return those of the addresses that answer; raises LinkError."""
    found: set[int] = set()
    progress.expect(SWEEP_STEPS)
    share = len(addresses) / SWEEP_STEPS
    for number, address in enumerate(addresses):
        if number % share < 1:
            progress.step(f"{line.port}: iSYS at {line.baud_rate} Bd, address {address}")
        found |= _ask(line, address, ANSWER_TIME).addresses
    return found


def _ask(line: Line, address: int, seconds: float) -> Heard:
    """Ask for the address and take all that comes in so many s after the bytes' own time.

    Of answers to a single address, the first is the last.
    """
    link, parser, request = line.link, FrameParser(), commands.READ_ADDRESS.request(address)
    found: set[int] = set()
    echo = False
    late = {frame.source for frame in parser.feed(link.read(0)) if frame.destination == MASTER}
    link.write(request.encode())
    end = time.monotonic() + seconds + link.seconds(ANSWER_SIZE)
    while (remaining := end - time.monotonic()) > 0 and (address == BROADCAST or not found):
        for frame in parser.feed(link.read(remaining)):
            if frame.destination == MASTER:
                found.add(frame.source)
            echo = echo or frame == request
    list(parser.flush())
    return Heard(found | late, parser.damaged_frames + parser.dropped_bytes, echo)
