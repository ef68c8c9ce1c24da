# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a device calls itself cannot steer a terminal or break a line of the log."""

import pytest

from driver_common.text import printable_text
from icotronic_driver.commands import decode_name
from isys_radar_driver import commands as isys
from uc4000_driver import commands as uc4000


@pytest.mark.parametrize(("data", "text"), [
    (b"Test-STH", "Test-STH"), (b"a b\0rest", "a b"), (b"", ""),
    (b"\x1b[31mred", "\ufffd[31mred"), (b"two\nlines", "two\ufffdlines"),
    (b"\x07\x7f", "\ufffd\ufffd"),
    ("Prüfung".encode(), "Prüfung"), ("\u202eabc".encode(), "\ufffdabc"),
    ("\x9bm".encode(), "\ufffdm"), ("\u2028".encode(), "\ufffd"), (b"\xff", "\ufffd")])
def test_what_is_not_printable_is_replaced(data, text):
    assert printable_text(data, "utf-8") == text


def test_every_driver_cleans_what_its_device_calls_itself():
    evil = b"\x1b]0;a\x07\n"
    for text in (decode_name(evil[:6], evil[6:]), isys.READ_DEVICE_NAME.decode(evil),
                 uc4000.READ_VERSION.decode(evil.ljust(18, b"\0"))):
        assert text.isprintable(), text
