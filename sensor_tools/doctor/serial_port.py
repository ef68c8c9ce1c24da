# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What can be wrong with a serial port and with what is connected to it."""

from __future__ import annotations

import contextlib
import dataclasses
import time
from collections.abc import Iterator
from pathlib import Path

from driver_common import advice
from driver_common.errors import LinkError
from driver_common.serial_link import SerialLink
from sensor_tools.cli.places import Wanted
from sensor_tools.families import FAMILIES, SERIAL, search
from sensor_tools.search.place import SerialPlace
from sensor_tools.search.result import Finding, Found, Progress

LISTEN_RATE = 115200  # Bd
LISTEN_TIME = 0.3  # s
TTYS = Path("/sys/class/tty")
LONGEST_LATENCY = 1  # ms


def examine(place: SerialPlace, wanted: Wanted, progress: Progress) -> Iterator[Finding]:
    """Yield what is to be said about a port; what is wrong comes with what to do."""
    progress.expect(1)
    progress.step(f"{place.port}: listening")
    try:
        yield from _examine_line(place)
        yield from _examine_sensors(place, wanted, progress)
    except LinkError as error:
        yield Finding.of_error(place, error)


def _examine_line(place: SerialPlace) -> Iterator[Finding]:
    """Yield what can be known without a question."""
    link = SerialLink(place.port, place.baud_rate or LISTEN_RATE)
    try:
        yield Finding(str(place), "link", "opens, and no other program uses it", is_wrong=False)
        yield from _examine_latency(place, link)
        heard, end = 0, time.monotonic() + LISTEN_TIME
        while (remaining := end - time.monotonic()) > 0:
            heard += len(link.read(remaining))
        if heard:
            yield Finding.of(place, "silence", advice.NOISE, count=heard, seconds=LISTEN_TIME)
    finally:
        link.close()


def _examine_latency(place: SerialPlace, link: SerialLink) -> Iterator[Finding]:
    """Yield how long the adapter's driver holds bytes back, after low latency was asked for."""
    device = TTYS / Path(place.port).resolve().name / "device"
    file = device / "latency_timer"
    if not device.exists():  # a pseudo-terminal, or a port elsewhere
        return
    with contextlib.suppress(OSError, ValueError):
        milliseconds = int(file.read_text())
        if milliseconds > LONGEST_LATENCY:
            yield Finding.of(place, "latency", advice.SLOW_ADAPTER, milliseconds=milliseconds,
                             file=file)
        return
    if not link.has_low_latency:
        yield Finding.of(place, "latency", advice.NO_LOW_LATENCY, is_wrong=False)


def _examine_sensors(place: SerialPlace, wanted: Wanted, progress: Progress) -> Iterator[Finding]:
    """Yield who answers, and whether it is who should."""
    anywhere = dataclasses.replace(place, baud_rate=0)
    families = [FAMILIES[name] for name in sorted(SERIAL, key=lambda name: name != wanted.family)]
    results = search(anywhere, families, progress)
    findings = [one for one in results if isinstance(one, Finding)]
    yield from findings
    found = [one for one in results if isinstance(one, Found)]
    if found:
        yield from _compare(place, wanted, found)
    elif not any(finding.is_wrong for finding in findings):
        yield Finding.of(place, "answers", advice.SILENCE_BEHIND_ECHO if findings
                         else advice.NOTHING_ANSWERS)


def _compare(place: SerialPlace, wanted: Wanted, found: list[Found]) -> Iterator[Finding]:
    """Yield how the sensors that answer differ from the one that should."""
    family = FAMILIES[found[0].family]
    addresses = ", ".join(one.address for one in found)
    rates = sorted({one.rate for one in found})
    if wanted.family and wanted.family != family.name:
        yield Finding.of(place, "family", advice.ANOTHER_FAMILY, model=found[0].model,
                         family=FAMILIES[wanted.family].title, node=family.node)
    elif wanted.address and str(wanted.address) not in (one.address for one in found):
        what = advice.SEVERAL if len(found) > 1 else advice.ANOTHER_ADDRESS
        yield Finding.of(place, "address", what, address=addresses, addresses=addresses, rate="",
                         parameters=" address")
    elif place.baud_rate and place.baud_rate not in rates:
        yield Finding.of(place, "baud rate", advice.ANOTHER_RATE, rate=rates[0],
                         wanted=place.baud_rate)
    else:
        for one in found:
            yield Finding(str(place), "answers", f"{one}, {one.rate} Bd, serial number "
                          f"{one.serial_number}", is_wrong=False)
