# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""`./dev soak`: its table can be carried out, and its verdict can fail. It soaks nothing here."""

import argparse

import numpy as np
import pytest
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Range

from bench.soak.client import TRANSITIONS
from bench.soak.faults import FAULTS, Fault
from bench.soak.lane import SIGNALS, SORTS, STEPS
from bench.soak.report import Event, Program, Usage, complaints, fault_table, program_table
from bench.soak.truth import judge_clouds, judge_ranges
from bench.soak.watch import LEVELS, Line, Status, Watch
from driver_common.health import unexplained
from icotronic_driver.health import HEALTH as ICOTRONIC
from isys_radar_driver.health import HEALTH as ISYS
from isys_radar_driver.simulator.scene import scene_of
from msg_conversions.header import to_header
from msg_conversions.point_cloud import to_point_cloud
from sensor_tools.demo.families import RADAR
from sensor_tools.demo.machine import Machine
from sensor_tools.simulate import FAMILIES
from uc4000_driver.health import HEALTH as UC4000
from uc4000_driver.simulator.scene import scene_of as filling_of
from uc4000_driver.telegram import FACTORY_ADDRESS

HEALTH = {"isys": ISYS, "uc4000": UC4000, "icotronic": ICOTRONIC}
ALL_KEYS = [key for health in HEALTH.values() for key in health.keys]
NOW = 1_800_000_000.0  # s since the epoch
ROWS = [pytest.param(driver, fault, id=f"{driver}, {fault.name}")
        for driver, faults in FAULTS.items() for fault in faults]


# --- the table -----------------------------------------------------------------------------------

@pytest.mark.parametrize(("driver", "fault"), ROWS)
def test_a_row_is_well_formed(driver, fault):
    assert fault.inject
    assert fault.lasts[0] <= fault.lasts[1]
    assert fault.bound > 0.0
    assert any(fault in sort.faults(fault.name) for sort in SORTS if sort.driver == driver)
    counters = {notice[1:] for notice in fault.notices if notice.startswith("+")}
    assert not unexplained(counters, ALL_KEYS)  # serial drivers share rows, and not all counters
    assert not fault.notices or len(unexplained(counters, HEALTH[driver].keys)) < len(
        fault.notices)
    for notice in set(fault.notices) - {f"+{counter}" for counter in counters}:
        kind, _, text = notice.partition(" ")
        assert kind in (*LEVELS, "log")
        assert text
    for step in (*fault.inject, *fault.remove):
        who, _, what = step.partition(" ")
        assert who in STEPS
        if who == "client":
            what = what.removeprefix("refuses ").removeprefix("set ")
            assert what in TRANSITIONS or "=" in what
        elif who in ("node", "machine"):
            assert what in SIGNALS


@pytest.mark.parametrize("driver", FAULTS)
def test_the_simulators_know_every_step(driver):
    names = [fault.name for fault in FAULTS[driver]]
    assert len(names) == len(set(names))
    parser = argparse.ArgumentParser()
    FAMILIES[driver].add_arguments(parser)
    simulation = FAMILIES[driver].open_simulation(
        parser.parse_args(["--listen", "127.0.0.1:0"]))
    try:
        for fault in FAULTS[driver]:
            for step in (*fault.inject, *fault.remove):
                who, _, command = step.partition(" ")
                if who == "sim":
                    name, _, argument = command.partition(" ")
                    simulation.commands[name](argument)
    finally:
        simulation.close()


# --- what came -----------------------------------------------------------------------------------

def watch(*stamps):
    """Return what came of a driver with 10 data per s."""
    came = Watch(10.0, "lists")
    came.add_stamps([NOW + stamp for stamp in stamps])
    return came


def test_all_is_well_once_data_come_as_usual():
    came = watch(0.0, 2.0, *(3.0 + 0.1 * number for number in range(10)))
    assert came.whole_since(NOW + 1.0) == NOW + 3.0
    assert came.whole_since(NOW + 3.85) is None
    assert came.outages(NOW, NOW + 4.0) == pytest.approx(3.0)
    assert came.came(NOW + 1.0, NOW + 3.05) == 2


def test_a_fault_can_be_noticed_by_a_level_a_counter_or_a_line():
    came = watch()
    came.add_status(Status(NOW, 0, "10 lists", {"time-outs": "3", "lists": "7"}))
    before = dict(came.values)
    assert came.noticed("+time-outs", NOW, before) is None
    came.add_status(Status(NOW + 1, 1, "does not answer", {"time-outs": "4", "lists": "2"}))
    came.log.append(Line(NOW + 2, "lost the port"))
    assert came.noticed("+time-outs", NOW, before) is not None
    assert came.noticed("WARN not answer", NOW, before) == NOW + 1
    assert came.noticed("ERROR not answer", NOW, before) is None
    assert came.noticed("WARN not answer", NOW + 1.5, before) is None
    assert came.noticed("log lost", NOW, before) == NOW + 2
    assert came.published == 7 + 2  # it began anew
    assert came.said(NOW) == ["OK … lists", "WARN does not answer"]


# --- whether it is true --------------------------------------------------------------------------

def cloud(late=0.0, beside=0.0):
    targets = scene_of(RADAR)(NOW - late)
    return serialize_message(to_point_cloud(
        [(target.range + beside, target.angle, -target.velocity, target.signal)
         for target in targets], "radar", round(NOW * 1e9)))


def test_a_point_where_nothing_is_is_wrong():
    assert judge_clouds([cloud()], Machine(), 0.0) is None
    assert judge_clouds([cloud(beside=30.0)], Machine(), 0.0).values == 3
    assert judge_clouds([cloud(late=2.0)], Machine(), 0.0).time == pytest.approx(NOW)
    assert judge_clouds([cloud(late=2.0)], Machine(), 2.0) is None


def test_a_distance_that_is_none_of_the_container_is_wrong():
    true = filling_of(FACTORY_ADDRESS)(NOW)

    def measured(distance):
        return serialize_message(Range(header=to_header("", round(NOW * 1e9)), range=distance))

    assert judge_ranges([measured(true), measured(np.inf)], Machine(), 0.0) is None
    assert judge_ranges([measured(true), measured(true + 0.3)], Machine(), 0.0).values == 1


# --- the verdict ---------------------------------------------------------------------------------

FAULT = Fault("silence", ("sim silent on",), ("sim silent off",), ("WARN .",), bound=5.0)


def event(**values):
    values = {"noticed": "WARN .", "recovery": 1.0, **values}
    made = Event.of("isys pty", FAULT, 30.0)
    for name, value in values.items():
        setattr(made, name, value)
    return made


LATER = Usage(400.0, 85.0, 20, 17)


def program(code=0, later=LATER, **values):
    return Program("isys pty", [Usage(100.0, 80.0, 20, 17), Usage(250.0, 82.0, 20, 17), later],
                   code, **values)


def test_all_is_well():
    assert complaints([event(), event(lost=7, explained=7)], [program()]) == []


@pytest.mark.parametrize(("values", "words"), [
    ({"noticed": ""}, "not noticed"), ({"recovery": None}, "no recovery"),
    ({"recovery": 6.0}, "recovered after 6.0 s instead of 5 s"), ({"wrong": 2}, "2 wrong values"),
    ({"trouble": ["sim plug: no"]}, "sim plug: no")])
def test_an_event_that_is_not_well(values, words):
    assert complaints([event(**values)], []) == [f"isys pty, silence, at 30 s: {words}"]


@pytest.mark.parametrize(("values", "words"), [
    ({"code": 1}, "exit code 1"), ({"code": None}, "did not end"),
    ({"later": Usage(400.0, 82.0, 21, 17)}, "descriptors grew from 20 to 21"),
    ({"later": Usage(400.0, 82.0, 20, 18)}, "threads grew from 17 to 18"),
    ({"later": Usage(400.0, 180.0, 20, 17)}, "memory grew by 100 MB"),
    ({"trouble": ["Traceback"]}, "Traceback")])
def test_a_program_that_is_not_well(values, words):
    assert complaints([], [program(**values)]) == [f"isys pty: {words}"]


def test_the_tables_say_what_became_of_it():
    header, row = fault_table([event(recovery=1.0, lost=5, explained=4),
                               event(recovery=3.0, lost=2, explained=2)]).splitlines()
    assert header.split()[:3] == ["driver", "fault", "injected"]
    assert row.split() == ["isys", "pty", "silence", "2", "2", "WARN", ".", "2", "2.00", "s",
                           "3.00", "s", "5", "s", "7", "6", "0"]
    header, row = program_table([program(published=10, received=9)]).splitlines()
    assert row.split()[2:] == ["10", "9", "80", "→", "85", "MB", "+1.00", "MB/min", "20", "→", "20",
                               "17", "→", "17", "0"]
