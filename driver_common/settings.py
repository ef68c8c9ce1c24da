# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Settings as data: one row per device setting, and what follows from it.

A `Parameter` says what a value may be. A `Setting` adds where the value lives in the device and
how it is written on the wire; an `Option` adds a default, for parameters of the driver itself.
Reading and writing settings through any device is done here, once for all drivers.
"""

from __future__ import annotations

import bisect
import contextlib
import difflib
import ipaddress
import math
import re
import struct
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from typing import Protocol, TypeAlias

from driver_common.errors import DriverError, RefusedError, SettingError

Value: TypeAlias = bool | int | float | str | list[str] | list[float]
Raw: TypeAlias = int | float | bytes

UNKNOWN = -1  # raw value that a device cannot tell; value of a code that is not in a table
_YAML_WORDS = {True: ("on", "y"), False: ("off", "n")}  # which YAML 1.1 reads as true and false


@dataclass(frozen=True)
class Parameter:
    """What a value may be.

    Attributes:
        name: Parameter name, snake_case, dots between groups.
        kind: `bool`, `int`, `float`, `str` or `list` (a list of names).
        unit: Unit of the value, "" where it has none.
        minimum: Smallest allowed value, or None.
        maximum: Largest allowed value, or None.
        choices: Allowed words, each with its code on the wire; None for free values.
        pattern: What a free text must match, as a regular expression; "" for any text.
        is_pair: Whether a list has two numbers instead of names.
        read_only: Whether the value can be read only.
        description: One line for people.
    """

    name: str
    _: KW_ONLY
    kind: type = float
    unit: str = ""
    minimum: float | None = None
    maximum: float | None = None
    choices: Mapping[str, int] | None = None
    pattern: str = ""
    is_pair: bool = False
    read_only: bool = False
    description: str = ""

    @property
    def limits(self) -> tuple[float | None, float | None]:
        """Smallest and largest allowed value; None where there is no limit."""
        return self.minimum, self.maximum

    def check(self, value: object) -> Value:
        """Return `value` in the parameter's own type.

        Raises:
            SettingError: Wrong type, unknown choice or out of range; the text says what is allowed.
        """
        if self.kind is float and isinstance(value, int) and not isinstance(value, bool):
            value = float(value)
        if self.kind is int and isinstance(value, float) and value.is_integer():
            value = int(value)
        if self.kind is str:
            value = self._as_text(value)
        if self.is_pair:
            return self._as_pair(value)
        if self.kind is list and isinstance(value, Sequence) and not isinstance(value, str):
            if all(isinstance(item, str) for item in value):
                return list(value)
            raise SettingError(f"{self.name} must be a list of words, not {value!r}")
        if type(value) is not self.kind:
            raise SettingError(f"{self.name} must be {self._kind_in_words()}, not {value!r}")
        if self.choices is not None and value not in self.choices:
            close = suggestion(str(value), self.choices)
            raise SettingError(f"{self.name} must be one of {', '.join(self.choices)}, "
                               f"not {value!r}{close}")
        if isinstance(value, str) and self.pattern and not re.fullmatch(self.pattern, value):
            raise SettingError(f"{self.name} cannot be {value!r}: {self.description}")
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            self._check_limits(value)
        assert isinstance(value, (bool, int, float, str))
        return value

    def _as_pair(self, value: object) -> list[float]:
        pair = list(value) if isinstance(value, Sequence) else []
        if len(pair) != 2 or not all(type(one) in (int, float) and math.isfinite(one)
                                     for one in pair):
            raise SettingError(f"{self.name} must be {self._kind_in_words()}, not {value!r}")
        return [float(one) for one in pair]

    def _as_text(self, value: object) -> object:
        """Return the text that YAML took for another type: on, y, 16, inf, a name of digits."""
        if isinstance(value, bool):
            return next((word for word in _YAML_WORDS[value] if word in (self.choices or ())),
                        value)
        if isinstance(value, (int, float)) and (self.choices is None or str(value) in self.choices):
            return str(value)
        return value

    def is_same(self, value: object, other: object) -> bool:
        """Whether two values say the same, also that the device did not tell it."""
        both_nan = str(value) == str(other) == "nan"  # a text where ros2 param load gave it
        return value == other or both_nan

    def _check_limits(self, value: float) -> None:
        minimum, maximum = self.limits
        if not math.isfinite(value):
            raise SettingError(f"{self.name} must be a finite number, not {value}")
        if (minimum is not None and value < minimum) or (maximum is not None and value > maximum):
            raise SettingError(f"{self.name} = {self.text(value)} is out of range, "
                               f"allowed is {self.range_text()}")

    def text(self, value: Value) -> str:
        """Return the value with its unit."""
        shown = f"{value:.10g}" if isinstance(value, float) else str(value)
        return f"{shown} {self.unit}".rstrip()

    def range_text(self) -> str:
        """Return the allowed range in words, "" where there is none."""
        if self.choices is not None:
            return ", ".join(self.choices)
        minimum, maximum = self.limits
        if minimum is None and maximum is None:
            return ""
        if maximum is None:
            text = f"at least {minimum:.10g}"
        elif minimum is None:
            text = f"at most {maximum:.10g}"
        else:
            text = f"{minimum:.10g} … {maximum:.10g}"
        return f"{text} {self.unit}".rstrip()

    def _kind_in_words(self) -> str:
        if self.choices is not None:
            return "one of " + ", ".join(self.choices)
        if self.is_pair:
            return "two numbers"
        return {bool: "true or false", int: "a whole number", float: "a number", str: "a text",
                list: "a list of words"}[self.kind]


@dataclass(frozen=True)
class Option(Parameter):
    """A parameter of the driver itself.

    Attributes:
        default: Its value where the user gives none.
        live: Whether it may change while the node is configured.
    """

    _: KW_ONLY
    default: Value = ""
    live: bool = False


@dataclass(frozen=True)
class Record:
    """Values which the device reads and writes as one; drivers add the wire address.

    Attributes:
        layout: One `struct` code per field ("H", "4s", …).
        byte_order: "<" or ">".
    """

    _: KW_ONLY
    layout: tuple[str, ...]
    byte_order: str = ">"

    @property
    def _format(self) -> str:
        return self.byte_order + "".join(self.layout)

    @property
    def size(self) -> int:
        """Length of the record's data in bytes."""
        return struct.calcsize(self._format)

    def pack(self, values: Sequence[Raw]) -> bytes:
        """Return the record's data bytes."""
        return struct.pack(self._format, *values)

    def unpack(self, data: bytes) -> tuple[Raw, ...]:
        """Return the record's fields; `data` has exactly `size` bytes."""
        return struct.unpack(self._format, data)


@dataclass(frozen=True)
class Setting(Parameter):
    """One setting of a device: the row from which everything else follows.

    The value in the parameter's unit is `raw * factor + offset`, or `values[raw]`.

    Attributes:
        record: Where the value lives in the device.
        field: Index of the value in the record.
        factor: Size of one raw step in `unit`.
        offset: Value of raw zero in `unit`.
        values: The only allowed values, rising, in the order of their codes 0, 1, …; empty where
            factor and offset say what a code means.
        needs_stop: Whether the device accepts a write only while it does not measure.
        section: Section of the device's manual.
    """

    record: Record
    _: KW_ONLY
    field: int = 0
    factor: float = 1
    offset: float = 0
    values: tuple[float, ...] = ()
    needs_stop: bool = False
    section: str = ""

    def __post_init__(self) -> None:
        """Take the kind from the row where it is not given."""
        if self.choices is not None or self.wire.endswith("s"):
            object.__setattr__(self, "kind", str)
        elif (self.kind is float and self.wire not in "fd"
              and all(isinstance(number, int)
                      for number in self.values or (self.factor, self.offset))):
            object.__setattr__(self, "kind", int)

    @property
    def wire(self) -> str:
        """`struct` code of the value on the wire."""
        return self.record.layout[self.field]

    @property
    def limits(self) -> tuple[float | None, float | None]:
        """Smallest and largest allowed value: the manual's, else those of the wire type."""
        if self.values:
            return self.values[0], self.values[-1]
        if self.kind not in (int, float) or self.wire in "fd":
            return self.minimum, self.maximum
        bits = 8 * struct.calcsize("=" + self.wire)
        low, high = (0, 2**bits - 1) if self.wire.isupper() else (-(2 ** (bits - 1)),
                                                                   2 ** (bits - 1) - 1)
        smallest, largest = self.decode(low), self.decode(high)
        assert isinstance(smallest, (int, float))
        assert isinstance(largest, (int, float))
        return (smallest if self.minimum is None else self.minimum,
                largest if self.maximum is None else self.maximum)

    def check(self, value: object) -> Value:
        """Return the value that the device can hold and that is nearest to `value`.

        Raises:
            SettingError: Wrong type, unknown choice or out of range.
        """
        return self.decode(self.encode(value))

    def encode(self, value: object) -> Raw:
        """Return the raw value, rounded to the device's resolution.

        Raises:
            SettingError: Wrong type, unknown choice, out of range, or between two of `values`.
        """
        checked = super().check(value)
        if self.choices is not None:
            return self.choices[str(checked)]
        if isinstance(checked, str):
            try:
                return ipaddress.IPv4Address(checked).packed
            except ValueError:
                raise SettingError(f"{self.name} must be an IPv4 address such as 192.168.60.20, "
                                   f"not {checked!r}") from None
        assert isinstance(checked, (bool, int, float))
        if self.values:
            return self._code(checked)
        raw = (checked - self.offset) / self.factor
        if self.wire not in "fd":
            return round(raw)
        try:
            return float(struct.unpack("<" + self.wire, struct.pack("<" + self.wire, raw))[0])
        except OverflowError:
            raise SettingError(f"{self.name} = {self.text(checked)} is out of range, it must fit "
                               f"a 32-bit floating-point number") from None

    def _code(self, value: float) -> int:
        code = bisect.bisect_left(self.values, value)
        if self.values[code] != value:
            below, above = (self.text(self.values[index]) for index in (code - 1, code))
            raise SettingError(f"{self.name} = {self.text(value)} lies between two steps, "
                               f"the nearest are {below} and {above}")
        return code

    def decode(self, raw: Raw) -> Value:
        """Return the value of a raw one, in the parameter's unit.

        A code without a name in `choices` comes back as "code_N": what the device says is shown.
        One that is not in `values` comes back as UNKNOWN.
        """
        if isinstance(raw, bytes):
            return str(ipaddress.IPv4Address(raw))
        if self.choices is not None:
            return next((word for word, code in self.choices.items() if code == raw),
                        "unknown" if raw == UNKNOWN else f"code_{raw}")
        if self.values:
            known = isinstance(raw, int) and 0 <= raw < len(self.values)
            value: Value = self.kind(self.values[int(raw)] if known else UNKNOWN)
            return value
        if self.wire == "f":
            return _shortest_float32(raw * self.factor + self.offset)
        if self.kind is float:
            return round(raw * self.factor + self.offset, 9)
        return self.kind(raw * self.factor + self.offset)  # type: ignore[no-any-return]


def _shortest_float32(value: float) -> float:
    """Return the shortest number that is the same as a 32-bit one: 0.1, not 0.10000000149."""
    for digits in range(6, 9):
        short = float(f"{value:.{digits}g}")
        try:
            if struct.pack("<f", short) == struct.pack("<f", value):
                return short
        except OverflowError:
            return value
    return float(f"{value:.9g}")


class RecordAccess(Protocol):
    """A device whose records can be read and written."""

    def read_record(self, record: Record) -> tuple[Raw, ...]:
        """Return the raw fields of a record."""

    def write_record(self, record: Record, values: tuple[Raw, ...]) -> None:
        """Write all fields of a record; raises RefusedError where the device refuses."""

    def require_answer(self) -> None:
        """Ask what every such device answers; raises DriverError where this one does not now."""


def suggestion(word: str, known: Iterable[str]) -> str:
    """Return '; did you mean "…"?' for the nearest known word, else ""."""
    close = difflib.get_close_matches(word, list(known), n=1)
    return f'; did you mean "{close[0]}"?' if close else ""


def read_settings(device: RecordAccess, settings: Iterable[Setting]) -> dict[str, Value]:
    """Read settings from the device, each record once."""
    records: dict[Record, tuple[Raw, ...]] = {}
    values = {}
    for setting in settings:
        if setting.record not in records:
            records[setting.record] = device.read_record(setting.record)
        values[setting.name] = setting.decode(records[setting.record][setting.field])
    return values


def write_settings(device: RecordAccess, settings: Mapping[str, Setting],
                   changes: Mapping[str, Value]) -> dict[str, Value]:
    """Write settings and read them back: all of them, or none.

    Records that already hold the wanted values are not written. A record that the device refuses
    is tried again after the others, because limits can depend on each other (a minimum above the
    old maximum). When one is refused for good, those already written get their old values back.

    Returns:
        The values that the device reports afterwards.

    Raises:
        SettingError: A name or a value is not acceptable; nothing was sent.
        RefusedError: The device refused, or reports another value than the one written.
    """
    wanted: dict[Record, dict[int, Raw]] = {}
    for name, value in changes.items():
        setting = settings.get(name)
        if setting is None:
            raise SettingError(f'there is no setting "{name}"{suggestion(name, settings)}')
        if setting.read_only:
            raise SettingError(f"{name} can be read only")
        wanted.setdefault(setting.record, {})[setting.field] = setting.encode(value)

    written: list[tuple[Record, tuple[Raw, ...]]] = []
    waiting = deque(wanted.items())
    refused = 0
    try:
        while waiting:
            record, fields = waiting.popleft()
            before = device.read_record(record)
            after = tuple(fields.get(index, raw) for index, raw in enumerate(before))
            if after == before:
                continue
            written.append((record, before))  # also where no answer comes: it may have taken it
            try:
                device.write_record(record, after)
                refused = 0
            except RefusedError as error:
                written.pop()
                refused += 1
                if refused > len(waiting):
                    asked = ", ".join(f"{name} = {settings[name].text(value)}"
                                      for name, value in changes.items()
                                      if settings[name].record == record)
                    raise RefusedError(f"{asked}: {error}") from error
                waiting.append((record, fields))
                continue
            _check_read_back(device, settings, changes, record)
    except DriverError:
        for record, before in reversed(written):
            with contextlib.suppress(RefusedError):  # the others get theirs back all the same
                device.write_record(record, before)
        raise
    return read_settings(device, (settings[name] for name in changes))


def _check_read_back(device: RecordAccess, settings: Mapping[str, Setting],
                     changes: Mapping[str, Value], record: Record) -> None:
    for name, value in changes.items():
        setting = settings[name]
        if setting.record == record:
            reported = read_settings(device, [setting])[name]
            if reported != setting.check(value):
                raise RefusedError(f"the device took {name} = {setting.text(value)} but reports "
                                   f"{setting.text(reported)}")
