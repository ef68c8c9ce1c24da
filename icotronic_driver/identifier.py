# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Identifiers and frames of the MyTooliT protocol (sections 9.2.1 to 9.2.5).

Nothing here does I/O. A `Frame` is what one CAN message carries; over other data links it travels
behind a header of 4 bytes.
"""

from __future__ import annotations

from dataclasses import dataclass

from driver_common.errors import FrameError

BROADCAST = 0  # answered by every node
BROADCAST_SILENT = 31  # answered by none
MAX_PAYLOAD, MAX_PAYLOAD_FD = 8, 64
FD_LENGTHS = (0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64)  # by data length code
HEADER_SIZE = 4

_GROUPS = (("STH", 1, 14), ("SPU", 15, 16), ("STU", 17, 30))  # errata C1


def sth(number: int) -> int:
    """Return the node number of a sensor (STH), 1 … 14 (errata C1)."""
    return _node_number("STH", number)


def spu(number: int) -> int:
    """Return the node number of a host (SPU), 1 or 2 (errata C1)."""
    return _node_number("SPU", number)


def stu(number: int) -> int:
    """Return the node number of a stationary unit (STU), 1 … 14 (errata C1)."""
    return _node_number("STU", number)


def _node_number(group: str, number: int) -> int:
    first, last = next((first, last) for name, first, last in _GROUPS if name == group)
    if not 1 <= number <= last - first + 1:
        raise ValueError(f"there is no {group} {number}, only 1 … {last - first + 1}")
    return first + number - 1


def node_name(node: int) -> str:
    """Return for example "STH 1"."""
    for name, first, last in _GROUPS:
        if first <= node <= last:
            return f"{name} {node - first + 1}"
    return {BROADCAST: "broadcast", BROADCAST_SILENT: "broadcast without answer"}[node]


STH_1, SPU_1, STU_1 = sth(1), spu(1), stu(1)  # connected sensor, this host, stationary unit


@dataclass(frozen=True)
class Identifier:
    """What the 29 bits of a CAN identifier say (errata C2).

    Attributes:
        block: Command block, 0 … 63.
        block_command: Command within the block, 0 … 255.
        sender: Node number of the sender, 1 … 30.
        receiver: Node number of the receiver; 0 and 31 are the broadcasts.
        request: Whether it is a request, else an acknowledgement or data.
        error: Whether it reports an error.
    """

    block: int
    block_command: int
    sender: int
    receiver: int
    request: bool = True
    error: bool = False

    def __str__(self) -> str:
        """Return for example "SPU 1 → STH 1, block 0x00, command 0x0B, request"."""
        kind = ("request" if self.request else "acknowledgement") + ", error" * self.error
        return (f"{node_name(self.sender)} → {node_name(self.receiver)}, "
                f"block 0x{self.block:02X}, command 0x{self.block_command:02X}, {kind}")

    @property
    def command(self) -> int:
        """The command field: 16 bits (section 9.2.2)."""
        return self.block << 10 | self.block_command << 2 | self.request << 1 | self.error

    def encode(self) -> int:
        """Return the 29-bit number.

        Raises:
            ValueError: A part does not fit its bits.
        """
        for part, limit in ((self.block, 63), (self.block_command, 255), (self.sender, 31),
                            (self.receiver, 31)):
            if not 0 <= part <= limit:
                raise ValueError(f"{part} does not fit into {limit.bit_length()} bits of an "
                                 f"identifier")
        return self.command << 12 | self.sender << 6 | self.receiver

    @classmethod
    def decode(cls, number: int) -> Identifier:
        """Return what a 29-bit number says.

        Raises:
            FrameError: Not an identifier of this protocol: wrong version, reserved bits set,
                forbidden command or sender.
        """
        if number >> 29:
            raise FrameError(f"0x{number:X} has more than the 29 bits of an identifier")
        if number >> 28:
            raise FrameError(f"identifier 0x{number:08X} has version 1, only 0 is known")
        if number & (1 << 11 | 1 << 5):
            raise FrameError(f"identifier 0x{number:08X} has reserved bits set")
        return cls._from_fields(number >> 12, number >> 6 & 0x1F, number & 0x1F)

    @classmethod
    def _from_fields(cls, command: int, sender: int, receiver: int) -> Identifier:
        if command >> 2 == 0:
            raise FrameError("the command number 0 is forbidden")
        if sender in (BROADCAST, BROADCAST_SILENT):
            raise FrameError(f"a broadcast ({sender}) cannot be the sender of a frame")
        return cls(command >> 10, command >> 2 & 0xFF, sender, receiver,
                   bool(command & 2), bool(command & 1))

    def acknowledgement(self, *, error: bool = False) -> Identifier:
        """Return the identifier of the answer to this request."""
        return Identifier(self.block, self.block_command, self.receiver, self.sender,
                          request=False, error=error)


def receiver_filter(receiver: int) -> tuple[int, int]:
    """Return identifier and mask of a CAN filter that lets the frames for a node through."""
    return receiver, 1 << 28 | 1 << 11 | 1 << 5 | 0x1F  # version and reserved bits must be 0


def padded_length(length: int) -> int:
    """Return the next length which a frame can have; above 8 bytes only CAN-FD has any.

    Raises:
        ValueError: No frame is that long.
    """
    for possible in FD_LENGTHS:
        if possible >= length:
            return possible
    raise ValueError(f"a payload of {length} bytes does not fit a frame, at most "
                     f"{MAX_PAYLOAD_FD} do")


@dataclass(frozen=True)
class Frame:
    """One message: an identifier and up to 8 bytes, with CAN-FD up to 64."""

    identifier: Identifier
    data: bytes = b""

    def __str__(self) -> str:
        """Return identifier and data for people."""
        return f"{self.identifier}: {self.data.hex(' ').upper() or 'no data'}"

    def encode_abstracted(self) -> bytes:
        """Return the frame as other data links carry it: header, then payload (section 9.2.3).

        A payload whose length no data length code says is padded with zeros.
        """
        length = padded_length(len(self.data))
        header = (FD_LENGTHS.index(length) | self.identifier.receiver << 4
                  | self.identifier.sender << 10 | self.identifier.command << 16)
        return header.to_bytes(HEADER_SIZE, "little") + self.data.ljust(length, b"\0")

    @classmethod
    def decode_abstracted(cls, data: bytes) -> list[Frame]:
        """Return the frames which stand in a row in one packet of another data link.

        Raises:
            FrameError: A header is not one, or the packet ends within a frame.
        """
        frames = []
        while data:
            if len(data) < HEADER_SIZE:
                raise FrameError(f"{len(data)} bytes are too few for a header of {HEADER_SIZE}: "
                                 f"{data.hex(' ')}")
            header = int.from_bytes(data[:HEADER_SIZE], "little")
            if header & (1 << 9 | 1 << 15):
                raise FrameError(f"header 0x{header:08X} has reserved bits set")
            end = HEADER_SIZE + FD_LENGTHS[header & 0xF]
            if len(data) < end:
                raise FrameError(f"header 0x{header:08X} announces {end - HEADER_SIZE} bytes, only "
                                 f"{len(data) - HEADER_SIZE} follow")
            identifier = Identifier._from_fields(header >> 16, header >> 10 & 0x1F,
                                                 header >> 4 & 0x1F)
            frames.append(cls(identifier, data[HEADER_SIZE:end]))
            data = data[end:]
        return frames
