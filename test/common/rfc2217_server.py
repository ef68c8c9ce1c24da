# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A serial port offered over the network, as a gateway does; also as a program of its own."""

import contextlib
import socket
import sys
import threading

import serial
import serial.rfc2217


class PortWithoutModemLines(serial.Serial):
    """A port on a pseudo-terminal, which has no such lines."""

    cts = dsr = ri = cd = False

    def _update_rts_state(self):
        pass

    _update_dtr_state = _update_break_state = _update_rts_state


class Rfc2217Server:
    """A serial port offered over the network, with pyserial's own server side."""

    def __init__(self, path, host="127.0.0.1"):
        self.port = PortWithoutModemLines(path, timeout=0.05)
        self._server = socket.create_server((host, 0))
        self.url = f"rfc2217://{host}:{self._server.getsockname()[1]}"
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self):
        try:
            self._connection, _ = self._server.accept()
        except OSError:  # closed before anybody came
            return
        manager = serial.rfc2217.PortManager(self.port, self)
        threading.Thread(target=self._receive, args=[manager], daemon=True).start()
        with contextlib.suppress(OSError):
            while data := self._connection.recv(1024):
                self.port.write(b"".join(manager.filter(data)))

    def _receive(self, manager):
        with contextlib.suppress(OSError, TypeError):  # closed
            while True:
                if data := self.port.read(self.port.in_waiting or 1):
                    self.write(b"".join(manager.escape(data)))

    def write(self, data):
        self._connection.sendall(data)

    def close(self):
        self._connection.close()
        self._server.close()


def main():
    """Serve the port that is named first at the host that is named second, until input ends."""
    server = Rfc2217Server(*sys.argv[1:])
    print(server.url, flush=True)
    sys.stdin.read()
