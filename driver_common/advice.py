# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What can be wrong on the way to a device, and what to do about it: the words, once for all.

The links, the sessions and the doctor take them from here, so that the log of a node, its
diagnostics and the doctor's table say the same.
"""

from __future__ import annotations

import errno
from typing import NamedTuple


class Advice(NamedTuple):
    """A cause, and what to do; both with gaps in braces for what is known where it is said.

    Attributes:
        cause: What is wrong.
        remedy: What to do about it, "" where nothing can be done.
    """

    cause: str
    remedy: str = ""

    def filled(self, **facts: object) -> Advice:
        """Return it with its gaps filled."""
        return Advice(self.cause.format(**facts), self.remedy.format(**facts))

    def text(self, **facts: object) -> str:
        """Return both in one line, with their gaps filled."""
        return "; ".join(filter(None, self.filled(**facts)))


# --- serial ports ---

NO_PORT = Advice("there is no such port{ports}", "is it plugged in?")
NO_SERIAL_PORT = Advice("that is no serial port{ports}")
NO_PERMISSION = Advice("no permission", "add yourself to the group {group} with 'sudo usermod -aG "
                                        "{group} $USER' and log in again")
IN_USE = Advice("it is in use by {holder}", "close that one first")
GONE = Advice("it is gone", "is it plugged in?")
NOBODY_LISTENS = Advice("nothing listens there", "check host and port{where}")
SLOW_ADAPTER = Advice("its driver hands over what it received only every {milliseconds} ms",
                      "as root: 'echo 1 > {file}'")
NO_LOW_LATENCY = Advice("its driver has no mode of low latency",
                        "where answers come late, take an adapter that has one (such as FTDI's)")
NOISE = Advice("bytes arrive that nobody asked for ({count} in {seconds:g} s)",
               "something else talks on this line, or a device sends by itself; disconnect it")
ECHO = Advice("the line returns what is sent",
              "a single LIN wire does so by design; switch off the echo of an RS-485 adapter")

# --- devices on a serial line ---

NOTHING_ANSWERS = Advice(
    "no sensor answers, at no address and no baud rate",
    "check power and wiring (RS-485: A and B swapped? Rx and Tx swapped?)")
SILENCE = Advice("", "check power, wiring and the address")
NO_ECHO = Advice("not even the echo of what was sent", "is the line connected, or local_echo off?")
SILENCE_BEHIND_ECHO = Advice(
    "the line returns what is sent, so it is right up to there",
    "check the sensor's power and wiring, and the address")
SILENCE_RS485 = Advice("", "check power, wiring (RS-485: A and B swapped?) and the address")
POOR_LINE = Advice("it answers only some requests",
                   "check the wiring (termination, length, ground)")
GARBAGE = Advice("bytes arrive that are no {family} frames",
                 "several sensors answer at once (give the parameter address), or something else "
                 "talks on this line, or the baud rate is another one")
ANOTHER_ADDRESS = Advice("a sensor answers at address {address}{rate}",
                         "correct the parameter{parameters}")
SEVERAL = Advice("several sensors answer ({addresses})",
                 "say which one with the parameter address, or name all of them with the "
                 "parameter sensors")
SAME_ADDRESS = Advice("only damaged answers come from address {address}",
                      "several devices have address {address}: connect them one by one and give "
                      "each its own; or there is interference")

ANOTHER_RATE = Advice("a sensor answers at {rate} Bd, not at {wanted}",
                      "correct the parameter serial_baud")
ANOTHER_FAMILY = Advice("{model} answers, which is no {family}",
                        "connect the right one, or use {node}_node")

# --- CAN ---

NO_CHANNEL = Advice("there is no such channel", "'ip -brief link show type can' lists them")
BUS_DOWN = Advice("it is down", "'sudo ip link set {channel} up type can bitrate {bitrate}' "
                                "brings it up")
NO_CAN = Advice("this kernel has no CAN", "'sudo modprobe can_raw' loads it")
NO_CAN_PERMISSION = Advice("no permission",
                           "bring the channel up as root, then a user may open it")
SERVER_CLOSED = Advice("the server closed the connection")
NO_ACKNOWLEDGE = Advice("the transmit buffer is full: nobody acknowledges",
                        "check wiring, termination and bit rate")
BUS_OFF = Advice("it is bus-off", "check wiring, termination and bit rate; 'ip link set … type can "
                                  "restart-ms 100' lets it recover")
BUS_ERRORS = Advice("{count} error frames in {seconds:g} s",
                    "check wiring, termination and bit rate")
WRONG_BIT_RATE = Advice(
    "it runs at {present} bit/s, not at {bitrate}",
    "'sudo ip link set {channel} down' and 'sudo ip link set {channel} up type can bitrate "
    "{bitrate}', or correct the parameter can_bitrate")
SMALL_BUFFER = Advice("the kernel keeps only {size} KiB of frames while this host is busy",
                      "'sudo sysctl -w net.core.rmem_max={wanted}' allows more")

# --- ICOtronic sensors ---

NO_UNIT = Advice("no stationary unit answers", "check its power, wiring, termination and bit rate")
OTHER_HOST = Advice("another host on the bus works with this stationary unit",
                    "end one of the two")
CONNECTED_ELSEWHERE = Advice("the stationary unit has a connection to a sensor already, which "
                             "hides the others", "end the node or program that uses it")
NONE_IN_RANGE = Advice("no sensor is in range of the stationary unit",
                       "wake it up or bring it nearer")
NOT_IN_RANGE = Advice("the sensor{which} is not in range of the stationary unit (in range: "
                      "{in_range})", "wake it up, bring it nearer or correct the parameter")
DOES_NOT_CONNECT = Advice("the sensor {which} does not connect",
                          "bring it nearer, or check its battery")

# --- ROS ---

DISCOVERY_OFF = Advice("ROS_AUTOMATIC_DISCOVERY_RANGE is OFF: nodes do not find each other",
                       "set it to SUBNET or LOCALHOST, or list peers in ROS_STATIC_PEERS")
DISCOVERY_LOCAL = Advice("nodes of other computers are not seen (ROS_AUTOMATIC_DISCOVERY_RANGE is "
                         "LOCALHOST)", "for other computers set it to SUBNET, everywhere")
DISCOVERY_UNKNOWN = Advice("ROS_AUTOMATIC_DISCOVERY_RANGE is {value!r}, which ROS does not know",
                           "use SUBNET, LOCALHOST, OFF or SYSTEM_DEFAULT")
LOCALHOST_ONLY = Advice("ROS_LOCALHOST_ONLY is set, which is deprecated and overrules "
                        "ROS_AUTOMATIC_DISCOVERY_RANGE",
                        "unset it, and set ROS_AUTOMATIC_DISCOVERY_RANGE")
SAME_NAME = Advice("{count} nodes have the name {name}",
                   "end all but one, or give each its name with '-r __node:=NAME'")
SHALLOW_RECORDER = Advice("{process} keeps {depth} messages of {topic} while it is busy; {needed} "
                          "are needed to lose nothing",
                          "start it with '--qos-profile-overrides-path FILE', made by 'ros2 run "
                          "industrial_sensor_drivers record_qos > FILE'")

# --- what the operating system says ---

SERIAL_ERRORS = {
    errno.ENOENT: NO_PORT,
    errno.EACCES: NO_PERMISSION,
    errno.EWOULDBLOCK: IN_USE,
    errno.EBUSY: IN_USE,
    errno.EIO: GONE,
    errno.ENXIO: GONE,
    errno.ECONNREFUSED: NOBODY_LISTENS,
    errno.EISDIR: NO_SERIAL_PORT,
    errno.ENOTTY: NO_SERIAL_PORT,
}
CAN_ERRORS = {
    errno.ENODEV: NO_CHANNEL,
    errno.ENETDOWN: BUS_DOWN,
    errno.EAFNOSUPPORT: NO_CAN,
    errno.EPERM: NO_CAN_PERMISSION,
    errno.ECONNREFUSED: NOBODY_LISTENS,
    errno.ECONNRESET: SERVER_CLOSED,
    errno.EPIPE: SERVER_CLOSED,
    errno.ENOBUFS: NO_ACKNOWLEDGE,
}
