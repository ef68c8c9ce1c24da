# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A command as a row of a table, and the request that is made of it (section 10)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass, field
from typing import Generic, ParamSpec, TypeVar

from driver_common.errors import FrameError, RefusedError, SettingError
from icotronic_driver.identifier import MAX_PAYLOAD, SPU_1, Frame, Identifier, node_name

P = ParamSpec("P")
T = TypeVar("T")
Result = TypeVar("Result")

ERRORS = {0: "specific error", 1: "not available", 2: "general error", 3: "write not allowed",
          4: "unsupported format", 5: "wrong key or magic number",
          6: "no super frame inside a super frame", 7: "EEPROM defect"}  # section 10.9


@dataclass(frozen=True)
class Request(Generic[T]):
    """A request on its way.

    Attributes:
        name: What it asks for, in words.
        frame: What is to be sent.
        mask: Which bits of the request's first bytes the acknowledgement repeats.
        decode: Turns the acknowledgement's payload into the result; raises FrameError.
        reasons: Numbers of specific errors in words.
    """

    name: str
    frame: Frame
    mask: bytes
    decode: Callable[[bytes], T]
    reasons: Mapping[int, str] = field(default_factory=dict)

    @property
    def writes(self) -> bool:
        """Whether it changes a setting."""
        return self.name.startswith("write ")

    @property
    def acknowledgement_id(self) -> int:
        """CAN identifier of the acknowledgement."""
        return self.frame.identifier.acknowledgement().encode()

    @property
    def error_id(self) -> int:
        """CAN identifier of the error acknowledgement."""
        return self.frame.identifier.acknowledgement(error=True).encode()

    def is_answered_by(self, can_id: int, data: bytes | bytearray) -> bool:
        """Whether a frame is the answer: by its identifier, and by what it repeats (errata C5)."""
        if can_id == self.error_id:
            return True
        return can_id == self.acknowledgement_id and all(
            (sent ^ received) & mask == 0
            for sent, received, mask in zip(self.frame.data, data, self.mask, strict=False))

    def result(self, can_id: int, data: bytes | bytearray) -> T:
        """Return what the answer says.

        Raises:
            RefusedError: It is an error acknowledgement; the text says which error.
            FrameError: Its length or content is wrong.
        """
        if can_id == self.error_id:
            raise RefusedError(f"{node_name(self.frame.identifier.receiver)} cannot {self.name}: "
                               f"{self._error(bytes(data))}")
        try:
            return self.decode(bytes(data))
        except FrameError as error:
            raise FrameError(f"{self.name}: {error}") from None

    def _error(self, data: bytes) -> str:
        """Return the error in words (errata C12)."""
        if len(data) > 1 and data[1] in self.reasons:
            return f"{self.reasons[data[1]]} (error {data.hex(' ').upper()})"
        if not data:
            return "error without a number"
        return f"{ERRORS.get(data[0], f'unknown error {data[0]}')} (error {data.hex(' ').upper()})"


@dataclass(frozen=True, eq=False)  # a row is itself only, so it can be hashed
class Command(Generic[P, T]):
    """A command: how it is asked, and how the answer is understood.

    Attributes:
        name: What it does, in words.
        block: Command block.
        block_command: Command within the block.
        encode: Turns the arguments into the request's payload; raises SettingError.
        decode: Turns the acknowledgement's payload into the result; raises FrameError.
        mask: Which bits of the request's first bytes the acknowledgement repeats.
        reasons: Numbers of specific errors in words.
        section: Section of the manual.
    """

    name: str
    block: int
    block_command: int
    encode: Callable[P, bytes]
    decode: Callable[[bytes], T]
    _: KW_ONLY
    mask: bytes = b""
    reasons: Mapping[int, str] = field(default_factory=dict)
    section: str

    def request(self, receiver: int, *args: P.args, **kwargs: P.kwargs) -> Request[T]:
        """Return the request of this host to a node."""
        return self.with_payload(receiver, self.encode(*args, **kwargs), self.decode)

    def with_payload(self, receiver: int, payload: bytes,
                     decode: Callable[[bytes], Result]) -> Request[Result]:
        """Return a request with this payload, whose answer is understood by `decode`.

        Raises:
            SettingError: The payload does not fit into a frame.
        """
        if len(payload) > MAX_PAYLOAD:
            raise SettingError(f"cannot {self.name}: {len(payload)} bytes do not fit into a frame, "
                               f"at most {MAX_PAYLOAD} do")
        identifier = Identifier(self.block, self.block_command, SPU_1, receiver)
        return Request(self.name, Frame(identifier, payload), self.mask, decode, self.reasons)
