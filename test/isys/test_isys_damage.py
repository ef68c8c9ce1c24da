"""What bytes that are hurt at random cost, in simulated time."""

from __future__ import annotations

import itertools

import pytest
from isys_master import Recorder
from virtual_line import EPOCH, MODULES, VirtualLink, VirtualTime

from isys_radar_driver import line
from isys_radar_driver.frames import MASTER, READ_TARGET_LIST, Delimiter, Frame
from isys_radar_driver.radar import Options
from isys_radar_driver.session import RadarBus
from isys_radar_driver.targets import Resolution, encode_target_list

REQUEST_SIZE = 11  # bytes
HURTING = 0.6  # of the kinds of damage; the others only delay


@pytest.fixture
def virtual(monkeypatch):
    """Connect a radar on a virtual line; return bus, what it tells, and the link."""
    def connect(model="iSYS-4001", **options):
        clock = VirtualTime()
        link = VirtualLink(clock, model)
        for module in MODULES:
            monkeypatch.setattr(module, "time", clock)
        monkeypatch.setattr(line, "SerialLink", lambda *_: link)
        heard = Recorder()
        bus = RadarBus("virtual", link.baud_rate, [Options(**options)], heard)
        bus.open()
        bus.set_active(True)
        run(bus, link, 2.0)
        return bus, heard, link

    return connect


def run(bus, link, seconds):
    """Let a bus work for some time."""
    end = link.clock.now + seconds
    while link.clock.now < end:
        link.clock.sleep(bus.poll())


def sent_as(targets):
    """Return the frame that a radar sends for a list."""
    pdu = encode_target_list(targets, Resolution.BITS_32)
    return Frame(MASTER, 128, READ_TARGET_LIST, pdu, Delimiter.SD3).encode()


@pytest.mark.parametrize(("rate", "least"), [(1e-3, 0.97), (1e-2, 0.80)])
def test_damage_costs_one_cycle(virtual, capsys, rate, least):
    bus, heard, link = virtual(wanted={"output1.range_max": 140.0})
    (radar,), reply = bus.devices, sent_as(heard.lists[-1][1])
    heard.lists.clear()
    link.faults.damage = rate
    begin, seconds = EPOCH + link.clock.now, 600.0
    run(bus, link, seconds)
    times = [begin, *(stamp * 1e-9 for _, _, stamp in heard.lists)]
    gap = max(later - before for before, later in itertools.pairwise(times))
    wrong = sum(sent_as(targets) not in link.replies for _, targets, _ in heard.lists)
    cycles = seconds / radar.cycle_time
    undamaged = cycles * (1 - HURTING * rate) ** (REQUEST_SIZE + len(reply))
    published = (len(heard.lists) - wrong) / undamaged
    with capsys.disabled():
        print(f"\n{rate:g} a byte: {published:.1%} of {undamaged:.0f} undamaged lists published, "
              f"longest gap {gap:.2f} s, {wrong} wrong", end="")
    assert published >= least
    assert gap < 2.0
    assert wrong == 0


@pytest.mark.parametrize("noise", [b"\x00", b"\xa2\x01\x80\xda", b"\x68\x68", b"\x10"])
def test_a_line_that_never_falls_silent_does_not_hang_the_bus(virtual, noise):
    bus, heard, link = virtual()
    begin = link.clock.now
    link.noise = noise
    for _ in range(3):
        before = link.clock.now
        link.clock.sleep(bus.poll())
        assert link.clock.now - before < 6.0
    run(bus, link, 20.0)
    assert "bytes arrive that are no iSYS frames" in str(heard.lost[-1][1])
    link.noise = b""
    run(bus, link, 5.0)
    assert bus.devices[0].is_connected
    assert heard.lists[-1][2] * 1e-9 - EPOCH > begin + 20.0
