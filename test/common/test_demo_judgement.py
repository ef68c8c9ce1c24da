# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The demonstration judges drivers: it finds what is wrong with them, and not what machines do."""

from types import SimpleNamespace as Message

import numpy as np
import pytest

from icotronic_driver.laws import STANDARD_GRAVITY
from icotronic_driver.simulator.scene import vibration
from isys_radar_driver.simulator.scene import scene_of
from msg_conversions.point_cloud import to_point_cloud
from sensor_tools.demo import heartbeat
from sensor_tools.demo.completeness import count
from sensor_tools.demo.families import RADAR, compare_radar, compare_vibration
from sensor_tools.demo.machine import BUSY_WAIT, Machine

START = 1_800_000_000.0  # s since the epoch
SAMPLES = START + np.arange(0, 4, 1 / 9523.8)
CYCLES = START + np.arange(0, 4, 0.075)
QUIET = Machine()


def machine(lateness=0.0, wait=0.0, since=START, until=START + 4):
    """A machine that was late by so much for some time, while the driver waited for so much."""
    seconds = np.linspace(START - 2, START + 6, 801)
    busy = np.clip(seconds, since, until) - since
    return Machine(["driver"], np.column_stack((seconds, lateness * busy, wait * busy)))


def imus(times, stamps, axis=0, scale=1.0):
    values = scale * STANDARD_GRAVITY * vibration(times)[:, axis]
    return [Message(header=Message(stamp=Message(sec=int(stamp), nanosec=int(stamp % 1 * 1e9))),
                    linear_acceleration=Message(x=value))
            for stamp, value in zip(stamps.tolist(), values.tolist(), strict=True)]


def clouds(stamps, turned=False, scale=1.0):
    scene = scene_of(RADAR)
    side = -1.0 if turned else 1.0
    return [to_point_cloud([(scale * target.range, side * target.angle, 0.0, 0.0)
                            for target in scene(now)], "radar", int(1e9 * stamp))
            for now, stamp in zip(CYCLES, stamps, strict=True)]


def test_good_samples_agree():
    comparison = compare_vibration(imus(SAMPLES, SAMPLES + 0.0004), QUIET)
    assert comparison.agrees
    assert comparison.delay == pytest.approx(0.0004, abs=5e-5)


@pytest.mark.parametrize("busy", [QUIET, machine(0.003, 2.0)], ids=["quiet", "busy"])
@pytest.mark.parametrize(("wrong", "late"), [
    ({"axis": 1}, 0.0), ({"axis": 2}, 0.0), ({"scale": 1.5}, 0.0), ({"scale": -1.0}, 0.0),
    ({}, 0.0065), ({}, -0.0065), ({}, 0.5)])
def test_wrong_samples_do_not(wrong, late, busy):
    assert not compare_vibration(imus(SAMPLES, SAMPLES + late, **wrong), busy).agrees


def test_a_scale_that_is_10_percent_off_does_not_on_a_quiet_machine():
    assert not compare_vibration(imus(SAMPLES, SAMPLES, scale=1.1), QUIET).agrees


@pytest.mark.parametrize("late", [0.005, -0.005])
def test_stamps_that_are_off_by_5_ms_do_not(late):
    assert not compare_vibration(imus(SAMPLES, SAMPLES + late), QUIET).agrees
    assert not compare_radar(clouds(CYCLES + late), QUIET).agrees


def test_a_clock_that_wanders_is_excused_by_a_machine_that_is_late_only():
    wandering = imus(SAMPLES, SAMPLES + 0.002 * np.sin(2 * np.pi * (SAMPLES - START) / 8))
    assert not compare_vibration(wandering, QUIET).agrees
    assert not compare_vibration(wandering, machine(wait=2.0)).agrees
    assert compare_vibration(wandering, machine(lateness=0.005)).agrees


@pytest.mark.parametrize(("busy_from", "agrees"), [
    (START + 0.3, True), (START + 0.6, False), (START + 5, False)])
def test_a_moment_before_a_busy_time_is_not_judged_alone(busy_from, agrees):
    beginning = np.where(SAMPLES < START + 0.25, 0.02, 0.0)
    busy = machine(lateness=0.004, since=busy_from, until=START + 6)
    assert compare_vibration(imus(SAMPLES, SAMPLES + beginning), busy).agrees == agrees


def test_good_clouds_agree():
    comparison = compare_radar(clouds(CYCLES + 0.0005), QUIET)
    assert comparison.agrees
    assert comparison.delay == pytest.approx(0.0005, abs=1e-4)


@pytest.mark.parametrize("busy", [QUIET, machine(0.003, 2.0)], ids=["quiet", "busy"])
@pytest.mark.parametrize(("wrong", "late"), [
    ({"turned": True}, 0.0), ({"scale": 1.1}, 0.0), ({}, 0.0065), ({}, 0.5)])
def test_wrong_clouds_do_not(wrong, late, busy):
    assert not compare_radar(clouds(CYCLES + late, **wrong), busy).agrees


def test_clouds_without_points_do_not():
    clouds = [to_point_cloud([], "radar", int(1e9 * now)) for now in CYCLES]
    assert not compare_radar(clouds, QUIET).agrees


def test_lost_messages_are_missed():
    complete = count(SAMPLES, 9523.8, START, START + 4, QUIET)
    assert complete.suffices
    assert (complete.came, complete.busy, complete.windows) == (len(SAMPLES), 0, 4)
    lossy = SAMPLES[np.arange(len(SAMPLES)) % 8 > 0]
    assert not count(lossy, 9523.8, START, START + 4, QUIET).suffices
    ended = SAMPLES[SAMPLES < START + 3]
    assert not count(ended, 9523.8, START, START + 4, QUIET).suffices


@pytest.mark.parametrize("busy", [{"lateness": 0.01}, {"wait": 0.7}])
def test_what_is_lost_while_the_machine_is_busy_is_excused(busy):
    hole = SAMPLES[(SAMPLES < START + 2) | (SAMPLES > START + 3)]
    excused = count(hole, 9523.8, START, START + 4,
                    machine(**busy, since=START + 2, until=START + 3))
    assert excused.suffices
    assert 1 <= excused.busy <= 3
    assert excused.came == pytest.approx(9523.8 * (excused.windows - excused.busy), abs=2)
    assert not count(hole, 9523.8, START, START + 4,
                     machine(**busy, since=START + 4, until=START + 5)).suffices


def test_that_other_programs_wait_excuses_nothing():
    times = np.array([START + 2])
    busy = machine(wait=2 * BUSY_WAIT)
    assert busy.is_busy(times)
    assert busy.of(["driver", "other"]).is_busy(times)
    assert not busy.of(["other"]).is_busy(times)


def test_the_notes_of_the_heartbeat_are_read_but_for_a_line_that_is_not_complete(tmp_path):
    log = tmp_path / "log"
    log.write_text(f"{START:.3f} 0.0 1.0\n{START + 1:.3f} 0.004 1.5\n{START + 2:.3f} 0.0")
    notes = Machine.of_log(log, ["driver"])
    assert notes.lateness(np.array([START + 0.5])) == pytest.approx(0.004)
    assert notes.is_busy(np.array([START, START + 1])).all()
    log.write_text("")
    assert not Machine.of_log(log, ["driver"]).is_busy(np.array([START])).any()


def test_the_heartbeat_notes_beats_that_are_late(monkeypatch, capsys):
    now = [100.0]
    sleeps = iter([0.005] * 100 + [1.005] + [None])

    def sleep(_):
        seconds = next(sleeps)
        if seconds is None:
            raise KeyboardInterrupt
        now[0] += seconds

    monkeypatch.setattr(heartbeat.time, "sleep", sleep)
    monkeypatch.setattr(heartbeat.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(heartbeat.sys, "argv", ["heartbeat", "0"])
    with pytest.raises(KeyboardInterrupt):
        heartbeat.main()
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert float(rows[-2][1]) == pytest.approx(0.0, abs=1e-6)
    assert float(rows[-1][1]) == pytest.approx(1.005, rel=1e-3)
    assert rows[-1][2] == "0.0000"
