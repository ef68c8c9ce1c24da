# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The faults, a row each: how it comes and goes, how it must be noticed, when all must be well.

A step is "WHO WHAT". Who is the simulator, which takes WHAT as a command on its standard input, the
node, the machine (both of them), a reader of the node's topic, or a client of the node; see `STEPS`
in bench/soak/lane.py.

A notice is how the driver tells: "LEVEL TEXT" by a status with this level, or a worse one, and a
text that matches; "+KEY" by a counter of the diagnostics that grows; "log TEXT" by a line of its
log. One of those in a row must come. A row without any must not be told: the driver copes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

LASTS = (3.0, 4.0)  # s; the diagnostics come once a second
MOMENT = (0.0, 0.0)
LONG = (12.0, 13.0)  # s; longer than a network may be silent
SUSPENSION = (0.5, 5.0)  # s


@dataclass(frozen=True)
class Fault:
    """A fault.

    Attributes:
        name: Its name.
        inject: Steps with which it comes.
        remove: Steps with which it goes.
        notices: How it may be noticed; none where it is not to be told.
        bound: Time in s from its end until data must come again as before.
        lasts: Shortest and longest time in s for which it stays.
        transport: The only one on which there is such a fault, "" = any.
        lag: Time in s by which data come late meanwhile, without a sign of that.
    """

    name: str
    inject: tuple[str, ...]
    remove: tuple[str, ...] = ()
    notices: tuple[str, ...] = ()
    bound: float = 5.0
    lasts: tuple[float, float] = LASTS
    transport: str = ""
    lag: float = 0.0


ANY = (
    Fault("suspended subscriber", ("reader start", "reader suspend"), ("reader end",)),
    Fault("deactivated", ("client deactivate",), ("client activate",),
          ("OK acquisition stopped", "WARN acquisition stopped")),
    Fault("cleaned up", ("client deactivate", "client cleanup"),
          ("client configure", "client activate"), ("STALE not configured",), 12.0),
    Fault("transitions in a wrong order", (
        "client refuses configure", "client refuses cleanup", "client deactivate",
        "client refuses deactivate", "client activate", "client refuses activate"),
        lasts=MOMENT),
)

_UNHEARD = ("WARN .",)
SERIAL = (
    *ANY,
    Fault("silence", ("sim silent on",), ("sim silent off",), _UNHEARD),
    Fault("unplugged", ("sim unplug",), ("sim plug",), ("ERROR .",)),
    Fault("half-open TCP", ("sim hang",), (), ("log lost", "ERROR ."), lasts=LONG,
          transport="tcp"),
    Fault("replies lost", ("sim drop 0.3",), ("sim drop 0",), ("+time-outs",)),
    Fault("replies late, 50 ms", ("sim delay 0.05",), ("sim delay 0",), lag=0.05),
    Fault("replies late, 0.4 s", ("sim delay 0.4",), ("sim delay 0",), _UNHEARD, lag=0.4),
    Fault("replies in two pieces", ("sim split 0.004",), ("sim split 0",)),
    Fault("noise before replies", ("sim noise 0.5",), ("sim noise 0",),
          ("+dropped bytes", "+damaged replies", "+stray bytes", "+checksum errors",
           "+damaged frames")),
    Fault("noise, half of the time", ("sim babble 0.5",), ("sim babble 0",),
          ("+dropped bytes", "+time-outs", "+stray bytes", "+checksum errors", "WARN .",
           "ERROR .")),
    Fault("noise without end", ("sim babble 1",), ("sim babble 0",), _UNHEARD),
    *(Fault(f"a stuck transmitter: {byte}", (f"sim babble_byte {byte}", "sim babble 1"),
            ("sim babble 0", "sim babble_byte -1"), _UNHEARD) for byte in ("0x55", "0x00")),
)

ISYS = (
    *SERIAL,
    Fault("node suspended", ("node suspend",), ("node continue",), ("+lost cycles",),
          lasts=SUSPENSION),
    # The simulator holds a reply back then, which answers the same request when that comes again.
    Fault("machine suspended", ("machine suspend",), ("machine continue",), ("+lost cycles",),
          lasts=SUSPENSION, lag=SUSPENSION[1]),
    Fault("power cycle", ("sim power-cycle",), (), ("+lost cycles", "+time-outs"), lasts=MOMENT),
    Fault("damage 1e-3", ("sim damage 0.001",), ("sim damage 0",),
          ("+lost cycles", "+damaged frames", "+dropped bytes", "+time-outs", "+stale frames",
           "+damaged replies", "+refusals"), lasts=(8.0, 10.0)),
    Fault("damage 1e-2", ("sim damage 0.01",), ("sim damage 0",),
          ("+lost cycles", "+damaged frames", "+time-outs"), lasts=(5.0, 8.0)),
    Fault("damaged replies", ("sim corrupt 0.5",), ("sim corrupt 0",),
          ("+damaged replies", "+damaged frames")),
    Fault("echo", ("sim echo on",), ("sim echo off",)),
    Fault("another baud rate", ("sim baud 57600",), ("sim baud 115200",), _UNHEARD,
          transport="pty"),
    Fault("refuses target lists", ("sim refuse 0xDA",), ("sim refuse",), ("+refusals",)),
    Fault("refuses everything", ("sim refuse 0xD0,0xD1,0xD2,0xD4,0xD6,0xDA",), ("sim refuse",),
          ("+refusals",)),
    Fault("nonsense in lists", ("sim nonsense on",), ("sim nonsense off",),
          ("+implausible lists",)),
    Fault("overloaded receiver", ("sim clipping on",), ("sim clipping off",), ("+clippings",)),
    Fault("power cycle, silent on what is optional", ("sim bare on", "sim power-cycle"),
          ("sim bare off",), ("+lost cycles", "+time-outs")),
    Fault("power cycle, measures by itself", (
        "sim strict on", "sim self-starting on", "sim power-cycle"),
        ("sim strict off", "sim self-starting off"), ("+lost cycles", "+time-outs")),
    Fault("parameter sets", ("client set frequency_channel=2",),
          ("client set frequency_channel=1",)),
    Fault("wrong parameter sets", (
        "client refuses frequency_channel=99", 'client refuses frequency_channel="many"',
        "client refuses output1.range_max=-5.0", "client refuses no_such_parameter=1"),
        lasts=MOMENT),
)

UC4000 = (
    *SERIAL,
    Fault("node suspended", ("node suspend",), ("node continue",), lasts=SUSPENSION),
    Fault("machine suspended", ("machine suspend",), ("machine continue",), lasts=SUSPENSION),
    Fault("power cycle", ("sim power-cycle",), lasts=MOMENT),
    Fault("damage 1e-2", ("sim damage 0.01",), ("sim damage 0",),
          ("+time-outs", "+checksum errors", "+damaged requests", "+stray bytes", "+refusals"),
          lasts=(8.0, 10.0)),
    Fault("damaged replies", ("sim corrupt 0.5",), ("sim corrupt 0",), ("+checksum errors",)),
    Fault("echo", ("sim echo on",), ("sim echo off",)),
    Fault("refuses", ("sim refuse 0x0B",), ("sim refuse",), ("+refusals",)),
    Fault("measures beyond its limits", ("sim limits 0.03,4.07",), ("sim limits 0.25,4.0",)),
    Fault("hears too much", ("sim overreach 12",), ("sim overreach 0",)),
    Fault("answers late, 10 ms", ("sim evaluation 0.010",), ("sim evaluation 0.005",)),
    Fault("answers at once", ("sim at-once on",), ("sim at-once off",)),
    Fault("parameter sets", ("client set gain_db=66.0", "client set temperature_compensation=off"),
          ("client set temperature_compensation=on", "client set gain_db=72.0")),
    Fault("wrong parameter sets", (
        "client refuses gain_db=-5.0", 'client refuses gain_db="many"',
        "client refuses no_such_parameter=1"), lasts=MOMENT),
)

_AWAY = ("ERROR .",)
ICOTRONIC = (
    *ANY,
    Fault("node suspended", ("node suspend",), ("node continue",), ("+pauses of this host",),
          lasts=SUSPENSION),
    Fault("machine suspended", ("machine suspend",), ("machine continue",),
          ("+pauses of this host",), lasts=SUSPENSION),
    Fault("silence", ("sim silent on",), ("sim silent off",), ("+lost frames", *_AWAY), 12.0),
    Fault("server gone", ("sim unplug",), ("sim plug",), _AWAY, 12.0),
    Fault("half-open TCP", ("sim hang",), (), ("log lost", *_AWAY), 15.0, LONG),
    Fault("sensor away", ("sim away Test-STH",), ("sim back Test-STH",), _AWAY, 12.0),
    Fault("sensor's power cycle", ("sim power-cycle Test-STH",), (), ("+connections", *_AWAY), 12.0,
          MOMENT),
    Fault("stationary unit's power cycle", ("sim power-cycle STU",), (), ("+connections", *_AWAY),
          12.0, MOMENT),
    Fault("power cycle, connects late", ("sim connect_time 3", "sim power-cycle Test-STH"),
          ("sim connect_time 0",), _AWAY, 15.0),
    Fault("power cycle, refuses to connect", (
        "sim refused_connects 3", "sim power-cycle Test-STH"), ("sim refused_connects 0",),
        ("+connections", *_AWAY), 15.0),
    Fault("power cycle, new to the unit", ("sim newness 2", "sim power-cycle Test-STH"),
          ("sim newness 0",), ("+connections", *_AWAY), 15.0),
    Fault("power cycle, silent on what is optional", (
        "sim silent-on optional", "sim power-cycle Test-STH"), ("sim silent-on nothing",),
        ("+connections", *_AWAY), 15.0),
    Fault("frames lost, 1e-3", ("sim loss 0.001",), ("sim loss 0",), ("+lost frames",)),
    Fault("frames lost, 1e-2 in runs", ("sim loss_run 5", "sim loss 0.01"),
          ("sim loss 0", "sim loss_run 1"), ("+lost frames",)),
    Fault("frames twice", ("sim duplicate 0.01",), ("sim duplicate 0",), ("+duplicate frames",)),
    Fault("frames swapped", ("sim swap 0.01",), ("sim swap 0",)),
    Fault("damage 1e-3", ("sim damage 0.001",), ("sim damage 0",),
          ("+lost frames", "+damaged frames", "+duplicate frames")),
    Fault("damage 1e-2", ("sim damage 0.01",), ("sim damage 0",),
          ("+lost frames", "+damaged frames", "+duplicate frames")),
    Fault("frames late, up to 2 ms", ("sim jitter 0.002",), ("sim jitter 0",)),
    Fault("frames in bursts of 16 ms", ("sim burst 0.016",), ("sim burst 0",)),
    Fault("answers lost", ("sim answer_loss 0.7",), ("sim answer_loss 0",), lasts=LONG),
    Fault("answers late, 1 s", ("sim answer_delay 1.0",), ("sim answer_delay 0",),
          ("+stale frames",), lasts=LONG),
    Fault("foreign frames", ("sim foreign 500",), ("sim foreign 0",), ("+foreign frames",)),
    Fault("error frames", ("sim errors 50",), ("sim errors 0",), ("+error frames",)),
    Fault("answers filled up", ("sim padding on",), ("sim padding off",)),
    Fault("parameter sets", ("client set led=disabled", "client set batch_period=0.05"),
          ("client set led=enabled", "client set batch_period=0.02")),
    Fault("wrong parameter sets", (
        "client refuses sample_rate=-5.0", 'client refuses sample_rate="many"',
        "client refuses no_such_parameter=1"), lasts=MOMENT),
)

FAULTS: Mapping[str, tuple[Fault, ...]] = {"isys": ISYS, "uc4000": UC4000, "icotronic": ICOTRONIC}
