# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What bytes that are hurt at random cost, in simulated time."""

from __future__ import annotations

import itertools

import pytest
from virtual_line import EPOCH, VirtualLink, VirtualMaster, VirtualTime

from isys_radar_driver.frames import MASTER, READ_TARGET_LIST, Delimiter, Frame
from isys_radar_driver.radar import Options
from isys_radar_driver.targets import Resolution, encode_target_list

REQUEST_SIZE = 11  # bytes
HURTING = 0.6  # of the kinds of damage; the others only delay


@pytest.fixture
def master(monkeypatch):
    """A master whose radar measures on a virtual line."""
    link = VirtualLink(VirtualTime(), "iSYS-4001")
    master = VirtualMaster(monkeypatch, link, Options(wanted={"output1.range_max": 140.0}))
    master.measure(10)
    return master


def sent_as(targets):
    """Return the frame that a radar sends for a list."""
    pdu = encode_target_list(targets, Resolution.BITS_32)
    return Frame(MASTER, 128, READ_TARGET_LIST, pdu, Delimiter.SD3).encode()


@pytest.mark.parametrize(("rate", "least"), [(1e-3, 0.97), (1e-2, 0.80)])
def test_damage_costs_one_cycle(master, capsys, rate, least):
    heard, link, reply = master.heard, master.link, sent_as(master.heard.lists[-1][1])
    heard.lists.clear()
    link.faults.damage = rate
    begin, seconds = EPOCH + link.clock.now, 200.0
    master.run(seconds)
    times = [begin, *(stamp * 1e-9 for _, _, stamp in heard.lists)]
    gap = max(later - before for before, later in itertools.pairwise(times))
    wrong = sum(sent_as(targets) not in link.replies for _, targets, _ in heard.lists)
    cycles = seconds / master.radar.cycle_time
    undamaged = cycles * (1 - HURTING * rate) ** (REQUEST_SIZE + len(reply))
    published = (len(heard.lists) - wrong) / undamaged
    with capsys.disabled():
        print(f"\n{rate:g} a byte: {published:.1%} of {undamaged:.0f} undamaged lists published, "
              f"longest gap {gap:.2f} s, {wrong} wrong", end="")
    assert published >= least
    assert gap < 2.0
    assert wrong == 0


@pytest.mark.parametrize("noise", [b"\x00", b"\xa2\x01\x80\xda", b"\x68\x68", b"\x10"])
def test_a_line_that_never_falls_silent_does_not_hang_the_bus(master, noise):
    link = master.link
    begin = link.clock.now
    link.noise = noise * 8
    for _ in range(3):
        before = link.clock.now
        link.clock.sleep(master.bus.poll())
        assert link.clock.now - before < 6.0
    master.run(20.0)
    assert "bytes arrive that are no iSYS frames" in str(master.heard.lost[-1][1])
    link.noise = b""
    master.run(5.0)
    assert master.radar.is_connected
    assert master.heard.lists[-1][2] * 1e-9 - EPOCH > begin + 20.0
