# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Looking for UC4000 sensors on a wire, read-only."""

from __future__ import annotations

from collections.abc import Iterator

from driver_common import advice
from driver_common.errors import FrameError, NoAnswerError, RefusedError
from sensor_tools.search.place import SerialPlace
from sensor_tools.search.result import Finding, Found, Progress, Result
from uc4000_driver import commands
from uc4000_driver.line import LateReplyError, Line
from uc4000_driver.sensor import PRODUCT
from uc4000_driver.telegram import BAUD_RATE, FIRST_ADDRESS, LAST_ADDRESS

FAMILY = "uc4000"
ADDRESSES = range(FIRST_ADDRESS, LAST_ADDRESS + 1)
ATTEMPTS, SILENCES = 5, 3


def search(place: SerialPlace, progress: Progress) -> Iterator[Result]:
    """Yield the sensors on a port, and what is wrong there; raises LinkError."""
    if place.baud_rate not in (0, BAUD_RATE):
        return
    progress.expect(len(ADDRESSES))
    line = Line(place.port)
    line.open()
    try:
        results: list[Result] = []
        for address in ADDRESSES:
            progress.step(f"{place.port}: UC4000 at address {address}")
            results += _at(place, line, address)
        if len(results) == len(ADDRESSES) and all(isinstance(one, Finding) for one in results):
            results = [Finding.of(place, "answers", advice.GARBAGE, family=PRODUCT)]
        yield from results
        if line.echo:
            yield Finding.of(place, "echo", advice.ECHO, is_wrong=False)
    finally:
        line.close()


def _at(place: SerialPlace, line: Line, address: int) -> Iterator[Result]:
    """Yield the sensor at an address, or what is wrong with it; raises LinkError."""
    who, silences = f"address {address}", 0
    damaged = late = None
    for _ in range(ATTEMPTS):
        try:
            line.ask(address, commands.READ_ADDRESS, who)
            version = line.ask(address, commands.READ_VERSION, who).value
            number = line.ask(address, commands.READ_SERIAL_NUMBER, who).value
        except NoAnswerError:
            silences += 1
            if silences == SILENCES:
                break
        except LateReplyError as error:
            late = error
        except (FrameError, RefusedError) as error:
            damaged = error
        else:
            if version.startswith("HW"):
                yield Found(FAMILY, place, PRODUCT, str(address), BAUD_RATE, serial_number=number,
                            firmware=version, parameters={"address": address})
            else:
                yield Finding(str(place), who, f"a device says that its version is {version!r}",
                              "connect the right one")
            return
    if damaged:
        yield Finding.of(place, who, advice.SAME_ADDRESS, address=address)
    elif late:
        yield Finding(str(place), who, str(late), advice.POOR_LINE.remedy)
