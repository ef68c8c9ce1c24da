# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Target lists (section 3.3.7): measured targets in SI units, from and to bytes."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

from driver_common.errors import FrameError
from isys_radar_driver.frames import CLIPPING, MAX_TARGETS, Delimiter, Frame

FIXED_LENGTH = 0x80  # flag of table 26


class Resolution(IntEnum):
    """Resolution byte of the request (table 26)."""

    NONE = 0  # the byte is left out; answered with 16 bit
    BITS_16 = 16
    BITS_32 = 32
    BITS_16_FIXED = FIXED_LENGTH | 16
    BITS_32_FIXED = FIXED_LENGTH | 32

    @property
    def bits(self) -> int:
        """Return 16 or 32."""
        return int(self) & ~FIXED_LENGTH or 16

    @property
    def fixed_length(self) -> bool:
        """Whether the list is padded to a fixed number of targets."""
        return bool(self & FIXED_LENGTH)


class Target(NamedTuple):
    """One target: signal in dB (RCS in dBsm with RCS output on), velocity in m/s, range in m,
    angle in rad; velocity and angle with the sign of the wire (errata I20, I21).
    """  # noqa: D205

    signal: float
    velocity: float
    range: float
    angle: float


@dataclass(frozen=True)
class TargetList:
    """Targets of one measurement cycle.

    Attributes:
        output: Number of the output filter, 1 to 3.
        targets: The targets; none where the receiver was clipping.
        clipping: Whether the signal was too strong to be processed.
    """

    output: int
    targets: tuple[Target, ...] = ()
    clipping: bool = False


@dataclass(frozen=True)
class _Format:
    """Wire form of one target (tables 29 and 31): struct format and size of one step."""

    struct: struct.Struct
    steps: Target


_MILLIDEGREE = math.radians(0.001)
_FORMATS = {
    16: _Format(struct.Struct(">Bhhh"), Target(1.0, 0.01, 0.01, 10 * _MILLIDEGREE)),
    32: _Format(struct.Struct(">Hiii"), Target(0.01, 0.001, 1e-6, _MILLIDEGREE)),  # errata I5, I7
}
TARGET_SIZES = {bits: form.struct.size for bits, form in _FORMATS.items()}  # bytes


def _format(bits: int, range_step_16: float) -> _Format:
    form = _FORMATS[bits]
    return form if bits == 32 else _Format(form.struct, form.steps._replace(range=range_step_16))


def decode_target_list(frame: Frame, range_step_16: float = 0.01, bits: int = 0) -> TargetList:
    """Return the target list that a frame carries.

    Args:
        frame: Reply to a target list request; SD3 means 32 bit, SD2 16 bit.
        range_step_16: Range step of a 16-bit list in m, 0.001 for some models (errata I6).
        bits: Bits per value that were asked for; 0 = any.

    Raises:
        FrameError: It has another resolution, or length and number of targets do not fit.
    """
    pdu = frame.pdu
    if len(pdu) < 2:
        raise FrameError(f"target list of {len(pdu)} bytes is too short: {frame}")
    output, count = pdu[0], pdu[1]
    if count == CLIPPING:
        return TargetList(output, clipping=True)
    sent = 32 if frame.delimiter is Delimiter.SD3 else 16
    if bits and sent != bits:
        raise FrameError(f"target list of {sent} bit instead of {bits}: {frame}")
    form = _format(sent, range_step_16)
    size = form.struct.size
    if count > MAX_TARGETS or len(pdu) < 2 + count * size or (len(pdu) - 2) % size:
        raise FrameError(f"target list of {len(pdu)} bytes does not hold {count} targets "
                         f"of {size} bytes: {frame}")
    raw = form.struct.iter_unpack(pdu[2:2 + count * size])
    return TargetList(output, tuple(
        Target._make(value * step for value, step in zip(values, form.steps, strict=True))
        for values in raw))


def encode_target_list(target_list: TargetList, resolution: Resolution,
                       range_step_16: float = 0.01, fixed_targets: int = 0) -> bytes:
    """Return the PDU of a target list, as a device sends it.

    Values beyond the wire's range are limited to it.
    """
    form = _format(resolution.bits, range_step_16)
    count = CLIPPING if target_list.clipping else len(target_list.targets)
    pdu = bytes((target_list.output, count))
    for target in target_list.targets:
        pdu += form.struct.pack(*(
            _limited(value / step, code)
            for value, step, code in zip(target, form.steps, form.struct.format[1:], strict=True)))
    return pdu.ljust(2 + form.struct.size * fixed_targets, b"\0")


def _limited(value: float, code: str) -> int:
    bits = 8 * struct.calcsize(code)
    low, high = (0, (1 << bits) - 1) if code.isupper() else (-1 << bits - 1, (1 << bits - 1) - 1)
    return int(min(max(round(value), low), high))
