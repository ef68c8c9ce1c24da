# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The tables of the EEPROM against the manual's, field by field."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pytest

from bench.examples.icotronic import STH_FIELDS, STU_FIELDS, FieldExample
from driver_common.errors import FrameError, SettingError
from icotronic_driver.eeprom import (
    PAGE_NAMES,
    STH_EEPROM,
    STU_EEPROM,
    Field,
    Status,
    chunks,
    decode_page,
)

TABLES = [pytest.param(STH_EEPROM, STH_FIELDS, id="STH"),
          pytest.param(STU_EEPROM, STU_FIELDS, id="STU")]


@pytest.mark.parametrize(("table", "examples"), TABLES)
def test_fields(table: Mapping[str, Field], examples: list[FieldExample]) -> None:
    assert list(table) == [example.name for example in examples]
    for example in examples:
        field = table[example.name]
        data = bytes.fromhex(example.data)
        assert (field.page, field.offset, field.length, field.read_only, field.default) == (
            example.page, example.offset, example.length, example.read_only, example.default)
        assert field.decode(data) == example.value, example.name
        assert field.encode(example.value) == data, example.name


@pytest.mark.parametrize(("table", "examples"), TABLES)
def test_no_two_fields_share_a_byte(table: Mapping[str, Field],
                                    examples: list[FieldExample]) -> None:
    places = [(field.page, place) for field in table.values()
              for place in range(field.offset, field.offset + field.length)]
    assert len(places) == len(set(places))
    assert {page for page, _ in places} <= set(PAGE_NAMES)
    assert all(place < 256 for _, place in places)


@pytest.mark.parametrize(("table", "examples"), TABLES)
def test_pages(table: Mapping[str, Field], examples: list[FieldExample]) -> None:
    for page in PAGE_NAMES:
        image = bytearray(b"\xff" * 256)
        wanted = {}
        for example in examples:
            if example.page == page:
                image[example.offset:example.offset + example.length] = bytes.fromhex(example.data)
                wanted[example.name] = example.value
        assert decode_page(table, page, bytes(image)) == wanted
    with pytest.raises(FrameError, match="256 bytes, not 255"):
        decode_page(table, 0, bytes(255))


def test_messages_of_a_field_have_four_bytes_at_most() -> None:  # errata C10
    assert list(STH_EEPROM["EEPROM Status"].chunks) == [(0, 1)]
    assert list(STH_EEPROM["STH Name"].chunks) == [(1, 4), (5, 4)]
    assert list(STH_EEPROM["Advertisement Time 2"].chunks) == [(19, 2)]
    assert list(STH_EEPROM["OEM Free Use"].chunks)[-1] == (252, 4)
    assert list(chunks(10, 9)) == [(10, 4), (14, 4), (18, 1)]
    assert list(chunks(0, 0)) == []


def test_status() -> None:  # section 8.2.1.1
    assert Status.of(0xAC) is Status.INITIALIZED
    assert Status.of(0xCA) is Status.LOCKED
    assert {Status.of(byte) for byte in (0x00, 0xFF, 0x13)} == {Status.UNINITIALIZED}


def test_an_empty_eeprom_holds_nothing_that_looks_real() -> None:
    slope = STH_EEPROM["Acceleration X: Slope"].decode(b"\xff" * 4)
    assert slope != slope  # NaN
    assert STH_EEPROM["STH Name"].decode(b"\xff" * 8) == "\ufffd" * 8


def test_a_number_with_more_digits_than_a_float_has() -> None:
    data = bytes.fromhex("36 42 FF FF FF FF FF FF")
    assert STH_EEPROM["GTIN"].encode(STH_EEPROM["GTIN"].decode(data)) == data


def test_text_for_people() -> None:
    assert STH_EEPROM["Sleep Time 1"].text(300.0) == "300 s"
    assert STH_EEPROM["STH Name"].text("Tanja") == "Tanja"
    assert STH_EEPROM["GTIN"].text(42) == "42"
    assert STH_EEPROM["OEM Free Use"].text(b"\x01\xff") == "01 FF"


@pytest.mark.parametrize(("name", "value", "words"), [
    ("STH Name", "Test-STH1", "at most 8 bytes"), ("STH Name", 5, "must be a text"),
    ("GTIN", 1 << 64, "out of range"), ("GTIN", -1, "out of range"),
    ("GTIN", float("nan"), "out of range"), ("GTIN", "1", "must be a number"),
    ("Sleep Time 1", 4294968.0, "0 … 4.29497e[+]06 s"), ("OEM Free Use", b"\0", "64 bytes"),
    ("Acceleration X: Slope", 1e40, "32-bit floating-point"),
])
def test_values_that_do_not_fit(name: str, value: Any, words: str) -> None:
    with pytest.raises(SettingError, match=words):
        STH_EEPROM[name].encode(value)


def test_bytes_of_another_length() -> None:
    with pytest.raises(FrameError, match="GTIN has 8 bytes, not 7"):
        STH_EEPROM["GTIN"].decode(bytes(7))
