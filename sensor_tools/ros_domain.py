# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A ROS domain of one's own, so that two runs on a machine do not hear each other."""

from __future__ import annotations

import os
import socket

DOMAINS = range(1, 101)  # beyond them the ports overlap those that Linux gives to clients
_held: list[socket.socket] = []


def claim_domain() -> int:
    """Return a domain in which no node of this machine is; it is ours until the process ends.

    The first participant of a domain takes a UDP port that follows from the domain's number (RTPS
    2.2, 9.6.1.1). Whoever holds that port keeps the domain: a later node takes the next port.
    """
    start = os.getpid() % len(DOMAINS)
    candidates: tuple[int, ...] = (*DOMAINS[start:], *DOMAINS[:start])
    for domain in candidates:
        holder = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            holder.bind(("", 7410 + 250 * domain))
        except OSError:
            holder.close()
        else:
            _held.append(holder)
            return domain
    raise OSError("all ROS domains of this machine are taken")
