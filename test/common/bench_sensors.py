"""Simulated sensors on real transports for the tests of the command `sensors`, and the command."""

from __future__ import annotations

import contextlib
import json
import os
import signal
from dataclasses import dataclass

from icotronic_driver.simulator.line import simulated_network
from isys_radar_driver.simulator.line import simulated_line as simulated_radars
from sensor_tools.cli import program
from uc4000_driver.simulator.line import simulated_line as simulated_ultrasonic_sensors


class Bench:
    """Starts simulators; all of them end with it. Remembers the bytes that reach serial lines."""

    def __init__(self):
        self._stack = contextlib.ExitStack()
        self.heard = bytearray()

    def radars(self, *models, addresses=(), baud_rate=0):
        return self._start(*simulated_radars(models, addresses, baud_rate=baud_rate))

    def ultrasonic_sensors(self, *addresses):
        return self._start(*simulated_ultrasonic_sensors(addresses))

    def _start(self, line, sensors):
        receive = line._device.receive

        def listen(data, now):
            self.heard += data
            return receive(data, now)

        line._device.receive = listen
        self._stack.callback(line.close)
        line.start()
        return line, sensors

    def network(self, *names):
        """Return the network, and the options with which the command reaches it."""
        server = simulated_network(names or ["Test-STH"]).start()
        self._stack.callback(server.close)
        return server.network, ["--can", "can0", "--can-interface", "socketcand", "--can-option",
                                f"host={server.host}", "--can-option", f"port={server.port}"]

    def empty_port(self):
        """Return a port with nobody on it, and what the other end of the cable writes with."""
        master, slave = os.openpty()
        for descriptor in (master, slave):
            self._stack.callback(os.close, descriptor)
        return os.ttyname(slave), master

    def close(self):
        self._stack.close()


@dataclass
class Outcome:
    """What a command printed, and its exit code."""

    code: int
    out: str
    err: str

    @property
    def json(self):
        return json.loads(self.out)


def run(capfd, *words):
    """Run the command in this process."""
    handler = signal.getsignal(signal.SIGTERM)
    capfd.readouterr()
    try:
        program.main([str(word) for word in words])
    except SystemExit as end:
        code = end.code or 0
    finally:
        signal.signal(signal.SIGTERM, handler)
    return Outcome(code, *capfd.readouterr())
