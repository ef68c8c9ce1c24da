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
