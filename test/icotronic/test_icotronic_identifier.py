# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Identifiers, node numbers and the header of other data links, against hand-made numbers."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from driver_common.errors import FrameError
from icotronic_driver.identifier import (
    BROADCAST,
    BROADCAST_SILENT,
    SPU_1,
    STH_1,
    STU_1,
    Frame,
    Identifier,
    node_name,
    padded_length,
    receiver_filter,
    spu,
    sth,
    stu,
)

IDENTIFIERS = [
    #           version  block   command   A E R sender R receiver
    (0b0_000100_00000000_0_0_0_00001_0_01111,  # streaming data, errata C2
     Identifier(0x04, 0x00, STH_1, SPU_1, request=False)),
    (0x0100004F, Identifier(0x04, 0x00, STH_1, SPU_1, request=False)),
    (0b0_000000_00001011_1_0_0_01111_0_10001, Identifier(0x00, 0x0B, SPU_1, STU_1)),
    (0b0_000000_00001011_0_1_0_10001_0_01111,
     Identifier(0x00, 0x0B, STU_1, SPU_1, request=False, error=True)),
    (0b0_111101_00100000_1_0_0_10000_0_00000, Identifier(0x3D, 0x20, spu(2), BROADCAST)),
    (0b0_111111_11111111_1_1_0_11110_0_11111,
     Identifier(0x3F, 0xFF, stu(14), BROADCAST_SILENT, error=True)),
]


@pytest.mark.parametrize(("number", "identifier"), IDENTIFIERS)
def test_identifier_both_ways(number: int, identifier: Identifier) -> None:
    assert identifier.encode() == number
    assert Identifier.decode(number) == identifier


@given(st.builds(Identifier, st.integers(0, 63), st.integers(1, 255), st.integers(1, 30),
                 st.integers(0, 31), st.booleans(), st.booleans()))
def test_every_identifier_survives(identifier: Identifier) -> None:
    assert Identifier.decode(identifier.encode()) == identifier


@pytest.mark.parametrize(("number", "words"), [
    (0x1100004F, "version 1"), (0x0100084F, "reserved"), (0x0100006F, "reserved"),
    (0x20000000, "29 bits"), (0x0000_004F, "command number 0"), (0x0000_204F, "command number 0"),
    (0x0100_000F, "broadcast"), (0x0100_07CF, "broadcast"),
])
def test_what_is_no_identifier(number: int, words: str) -> None:
    with pytest.raises(FrameError, match=words):
        Identifier.decode(number)


@pytest.mark.parametrize("identifier", [
    Identifier(64, 0, 1, 2), Identifier(0, 256, 1, 2), Identifier(0, 1, 32, 2),
    Identifier(0, 1, 1, -1)])
def test_parts_that_do_not_fit(identifier: Identifier) -> None:
    with pytest.raises(ValueError, match="does not fit"):
        identifier.encode()


def test_acknowledgement_goes_back() -> None:
    request = Identifier(0x3D, 0x01, SPU_1, STU_1)
    assert request.acknowledgement() == Identifier(0x3D, 0x01, STU_1, SPU_1, request=False)
    assert request.acknowledgement(error=True).encode() == 0xF405_44F


def test_node_numbers() -> None:  # errata C1
    assert (sth(1), sth(14), spu(1), spu(2), stu(1), stu(14)) == (1, 14, 15, 16, 17, 30)
    names = {0: "broadcast", 1: "STH 1", 14: "STH 14", 15: "SPU 1", 16: "SPU 2", 17: "STU 1",
             30: "STU 14", 31: "broadcast without answer"}
    assert {node: node_name(node) for node in names} == names
    for wrong in (lambda: sth(0), lambda: sth(15), lambda: spu(3), lambda: stu(15)):
        with pytest.raises(ValueError, match="there is no"):
            wrong()


def test_text_for_people() -> None:
    frame = Frame(Identifier(0, 0x0B, SPU_1, STU_1), b"\x01\x00")
    assert str(frame) == "SPU 1 → STU 1, block 0x00, command 0x0B, request: 01 00"
    answer = Frame(frame.identifier.acknowledgement(error=True))
    assert str(answer) == ("STU 1 → SPU 1, block 0x00, command 0x0B, acknowledgement, error: "
                           "no data")


def test_filter_takes_the_frames_for_a_node_only() -> None:
    wanted, mask = receiver_filter(SPU_1)
    assert all((number & mask == wanted) == (number & 0x1F == 15 and number < 1 << 28)
               for number, _ in IDENTIFIERS)
    for foreign in (0x1100004F, 0x0100084F, 0x0100006F, 0x01000050):
        assert foreign & mask != wanted


ABSTRACTED = [
    # Bits from 0: length code 4, receiver 5, R 1, sender 5, R 1, command 16; lowest byte first.
    ("F8 04 00 10 A2 00 01 80 02 80 03 80",  # 0x1000_04F8: streaming data, STH 1 → SPU 1, 8 bytes
     Frame(Identifier(0x04, 0x00, STH_1, SPU_1, request=False),
           bytes.fromhex("A2 00 01 80 02 80 03 80"))),
    ("10 3D 06 00",  # 0x0006_3D10: reset, SPU 1 → STU 1, no payload
     Frame(Identifier(0x00, 0x01, SPU_1, STU_1))),
    ("F9 04 00 10" + " 11" * 12,  # code 9 is 12 bytes
     Frame(Identifier(0x04, 0x00, STH_1, SPU_1, request=False), b"\x11" * 12)),
    ("FF 04 00 10" + " 22" * 64,  # code 15 is 64 bytes
     Frame(Identifier(0x04, 0x00, STH_1, SPU_1, request=False), b"\x22" * 64)),
]


@pytest.mark.parametrize(("packet", "frame"), ABSTRACTED)
def test_header_of_other_data_links(packet: str, frame: Frame) -> None:  # section 9.2.3
    assert frame.encode_abstracted() == bytes.fromhex(packet)
    assert Frame.decode_abstracted(bytes.fromhex(packet)) == [frame]


def test_messages_stand_in_a_row() -> None:
    packet = bytes.fromhex("".join(text for text, _ in ABSTRACTED))
    assert Frame.decode_abstracted(packet) == [frame for _, frame in ABSTRACTED]
    assert Frame.decode_abstracted(b"") == []


@pytest.mark.parametrize(("packet", "words"), [
    ("F8 04 00", "too few"), ("F8 04 00 10 01 02", "announces 8 bytes, only 2"),
    ("F8 06 00 10" + " 00" * 8, "reserved"), ("F8 84 00 10" + " 00" * 8, "reserved"),
    ("10 00 06 00", "broadcast"), ("10 3D 00 00", "command number 0"),
])
def test_damaged_packets(packet: str, words: str) -> None:
    with pytest.raises(FrameError, match=words):
        Frame.decode_abstracted(bytes.fromhex(packet))


def test_lengths_are_those_of_can_fd() -> None:
    lengths = {0: 0, 8: 8, 9: 12, 13: 16, 17: 20, 21: 24, 25: 32, 33: 48, 49: 64, 62: 64, 64: 64}
    assert {length: padded_length(length) for length in lengths} == lengths
    short = Frame(Identifier(0x04, 0x00, STH_1, SPU_1, request=False), b"\x33" * 9)
    assert short.encode_abstracted()[4:] == b"\x33" * 9 + bytes(3)
    with pytest.raises(ValueError, match="at most 64"):
        padded_length(65)
