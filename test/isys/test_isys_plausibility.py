# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Nonsense behind a good checksum is not published."""

from __future__ import annotations

import collections
import copy
import math
import random

import pytest

from isys_radar_driver.frames import MASTER, READ_TARGET_LIST, Delimiter, Frame, FrameParser
from isys_radar_driver.models import MODELS, find_model
from isys_radar_driver.plausibility import MEMORY_CYCLES, Continuity, Limits
from isys_radar_driver.simulator.scene import scene_of
from isys_radar_driver.targets import (
    Resolution,
    Target,
    TargetList,
    decode_target_list,
    encode_target_list,
)

GOOD = Target(signal=40.0, velocity=1.0, range=20.0, angle=0.1)


def limits_of(name, output=1, offset=0.0):
    model = find_model(name)
    return Limits.of(model, output, max(model.max_targets.values()), 0.075,
                     range_max=model.range_max, velocity_max=model.velocity_max, offset=offset)


# --- limits ------------------------------------------------------------------------------------

@pytest.mark.parametrize(("model", "change", "objection"), [
    ("iSYS-4001", {"range": -5.0}, "a range of -5 is beyond -0.5 … 187.5"),
    ("iSYS-4001", {"range": 2000.0}, "a range of 2000 is beyond -0.5 … 187.5"),
    ("iSYS-4001", {"velocity": 5000.0}, "a velocity of 5000 is beyond -87.5 … 87.5"),
    ("iSYS-4001", {"velocity": -100.0}, "a velocity of -100 is beyond -87.5 … 87.5"),
    ("iSYS-4001", {"angle": math.radians(200.0)}, "a angle of 3.49066 is beyond -1.5708 … 1.5708"),
    ("iSYS-4001", {"signal": 300.0}, "a signal of 300 is beyond 0 … 250"),
    ("iSYS-6006", {"range": 13.0}, "a range of 13 is beyond -0.5 … 12.5"),
    ("iSYS-4001", {}, ""),
    ("iSYS-4001", {"range": 150.0, "velocity": -70.0, "angle": -0.9, "signal": 250.0}, ""),
    ("iSYS-4013", {"range": -5.0}, ""),  # it measures none
    ("iSYS-6003", {"velocity": 400.0, "angle": 4.0, "range": 19.0}, "")])
def test_a_value_beyond_what_the_model_measures_is_implausible(model, change, objection):
    targets = TargetList(1, (GOOD._replace(range=1.0), GOOD._replace(**change)))
    assert limits_of(model).objection(targets) == objection


def test_a_list_of_another_output_or_with_too_many_targets_is_implausible():
    limits = limits_of("iSYS-4001", output=2)
    assert limits.objection(TargetList(1)) == "it is of output 1, not 2"
    assert limits.objection(TargetList(2, (GOOD,) * 35)) == ""
    assert limits.objection(TargetList(2, (GOOD,) * 36)) == "it has 36 targets, not 35 at most"


def test_a_mounting_offset_may_make_ranges_negative():
    near = TargetList(1, (GOOD._replace(range=-2.0),))
    assert limits_of("iSYS-6203").objection(near)
    assert not limits_of("iSYS-6203", offset=2.0).objection(near)


@pytest.mark.parametrize("name", [model.name for model in MODELS.values()
                                  if model.has_target_lists])
def test_nothing_that_a_radar_sees_is_implausible(name):
    model = find_model(name)
    scene, limits = scene_of(model), limits_of(name)
    for cycle in range(6000):
        assert not limits.objection(TargetList(1, tuple(scene(0.15 * cycle))))


# --- continuity --------------------------------------------------------------------------------

def steady(continuity, targets, cycles=40, cycle=0.075):
    """Let targets approach for some cycles; return the time and the targets of the next one."""
    for number in range(cycles):
        now = number * cycle
        moved = TargetList(1, tuple(target._replace(range=target.range - target.velocity * now)
                                    for target in targets))
        assert not continuity.follow(moved, now, now - 1)
    now = cycles * cycle
    return now, [target._replace(range=target.range - target.velocity * now)
                 for target in targets]


def test_nothing_jumps_on_a_clean_line():
    model, continuity = find_model("iSYS-4003"), Continuity()
    scene, cycle = scene_of(model, 5), model.cycle_time(0)
    for now in (cycle * number for number in range(round(900 / cycle))):
        assert not continuity.follow(TargetList(1, tuple(scene(now))), now, now - 2 * cycle)


TWO = [Target(40.0, 3.0, 50.0, 0.1), Target(30.0, -2.0, 80.0, -0.2)]


@pytest.mark.parametrize("change", [{"range": 4.0}, {"range": -0.3}, {"velocity": 0.5},
                                    {"angle": 0.02}, {"signal": 2.56}])
def test_a_target_that_jumps_in_a_single_value_is_implausible(change):
    continuity = Continuity()
    now, targets = steady(continuity, TWO)
    (name, step), = change.items()
    jumped = targets[1]._replace(**{name: getattr(targets[1], name) + step})
    assert continuity.follow(TargetList(1, (targets[0], jumped)), now, 0.0) == "target 2 jumps"
    assert not continuity.follow(TargetList(1, tuple(targets)), now + 1e-6, 0.0)


def test_targets_may_come_and_go():
    continuity = Continuity()
    now, targets = steady(continuity, TWO)
    other = Target(25.0, 8.0, 20.0, 0.4)
    for there in ((), targets[:1], targets[1:], [*targets, other], [other, targets[1]], [other]):
        assert not copy.deepcopy(continuity).follow(TargetList(1, tuple(there)), now, 0.0)


def test_a_change_that_stays_is_believed_after_a_few_lists():
    continuity = Continuity()
    now, targets = steady(continuity, TWO)
    dropped = 0
    changed = TargetList(1, (targets[0], targets[1]._replace(velocity=0.0, signal=34.0)))
    while continuity.follow(changed, now, 0.0):
        now += 0.075
        dropped += 1
    assert dropped <= 2


def test_noise_widens_what_is_believed():
    noise, continuity, objections = random.Random(1), Continuity(), 0
    for cycle in range(400):
        now = cycle * 0.075
        targets = TargetList(1, tuple(Target(
            noise.gauss(40, 1.0), noise.gauss(0, 0.1), noise.gauss(20 + 9 * index, 0.1),
            noise.gauss(0.2 * index, 0.01)) for index in range(5)))
        objections += bool(continuity.follow(targets, now, now - 1))
    assert objections < 8


# --- damage ------------------------------------------------------------------------------------

def flipped(data, rate, noise):
    """Return bytes of which one in `1 / rate` has a bit flipped."""
    return bytes(byte ^ (1 << noise.randrange(8) if noise.random() < rate else 0)
                 for byte in data)


class Judge:
    """What the driver makes of frames that arrive from one radar."""

    def __init__(self, model):
        self.limits = limits_of(model)
        self.continuity = Continuity()
        self.parser = FrameParser()

    def takes(self, data, now):
        """Return the list that is published, the one that is dropped; None where there is none."""
        self.parser.damaged_frame = None
        frames = [frame for frame in (*self.parser.feed(data), *self.parser.flush())
                  if frame.function_code == READ_TARGET_LIST]
        oldest = now - MEMORY_CYCLES * self.limits.cycle_time
        if not frames:
            damaged = self.parser.damaged_frame
            if damaged is not None and damaged.function_code == READ_TARGET_LIST:
                self.continuity.follow(decode_target_list(damaged), now, oldest, whole=False)
            return None, None
        targets = decode_target_list(frames[0])
        jump = self.continuity.follow(targets, now, oldest)
        return (None, targets) if self.limits.objection(targets) or jump else (targets, None)


def differs(one, other):
    """Whether a list says something else: by more than a list of 16 bit is coarse (table 29)."""
    coarse = (1.0, 0.01, 0.01, math.radians(0.01))
    return len(one.targets) != len(other.targets) or any(
        abs(value - true) > step for pair in zip(one.targets, other.targets, strict=True)
        for value, true, step in zip(*pair, coarse, strict=True))


def test_most_wrong_lists_with_a_good_checksum_are_caught(capsys):
    """One bit in 300 bytes flips, lists have 35 targets: one in ten good checksums lies."""
    noise, judge = random.Random(7), Judge("iSYS-4001")
    scene = scene_of(find_model("iSYS-4001"), 35)
    counts = collections.Counter()
    for cycle in range(2500):
        truth = TargetList(1, tuple(scene(cycle * 0.075)))
        pdu = encode_target_list(truth, Resolution.BITS_32)
        sent = Frame(MASTER, 128, READ_TARGET_LIST, pdu, Delimiter.SD3).encode()
        arrived = flipped(sent, 1 / 300, noise)
        published, dropped = judge.takes(arrived, cycle * 0.075)
        measured = published or dropped
        if measured is not None:
            kind = "good" if arrived == sent else (
                "wrong" if differs(measured, truth) else "wrong in the last digits")
            counts[kind] += 1
            counts[kind, "published"] += published is not None
    with capsys.disabled():
        for kind in ("wrong", "wrong in the last digits", "good"):
            print(f"\n{counts[kind]} lists are {kind}, "
                  f"{counts[kind, 'published'] / counts[kind]:.1%} of them published", end="")
    assert counts["wrong", "published"] <= 0.05 * counts["wrong"]
    assert counts["good", "published"] > 0.8 * counts["good"]
