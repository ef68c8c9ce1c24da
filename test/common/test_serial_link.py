# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A serial port on a real pseudo-terminal or TCP: bytes in and out, and errors in words."""

from __future__ import annotations

import os
import socket
import stat
import threading
import time
import tty

import pytest
from bus_master import wait_until
from rfc2217_server import Rfc2217Server

from driver_common import serial_link
from driver_common.errors import LinkError
from driver_common.serial_link import SerialLink
from driver_common.simulator.line import SPEEDS, SimulatedLine

DEADLINE = 60.0  # s; far more than anything takes, also on a busy machine


class Terminal:
    """A pseudo-terminal; `path` is the serial port, `master` the other end of the cable."""

    def __init__(self):
        self.master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self.path = os.ttyname(self._slave)
        self._plugged = True

    def write(self, data):
        os.write(self.master, data)

    def read(self):
        return os.read(self.master, 4096)

    def speed(self):
        return SPEEDS[tty.tcgetattr(self.master)[5]]

    def unplug(self):
        if self._plugged:
            self._plugged = False
            os.close(self.master)
            os.close(self._slave)


@pytest.fixture
def terminal():
    terminal = Terminal()
    yield terminal
    terminal.unplug()


@pytest.fixture
def link(terminal):
    link = SerialLink(terminal.path, 115200)
    yield link
    link.close()


def read_all(link, count, timeout=DEADLINE):
    data = b""
    while len(data) < count:
        more = link.read(timeout)
        assert more
        data += more
    return data


def error_of(port, baud_rate=115200):
    with pytest.raises(LinkError) as caught:
        SerialLink(port, baud_rate)
    return str(caught.value)


def test_a_host_that_was_held_up_waits_once_more(terminal, link, monkeypatch):
    real = time.monotonic
    times = iter([real()])  # the wait of 10 ms seems to take 5 s more
    monkeypatch.setattr(time, "monotonic", lambda: next(times, None) or real() + 5.0)
    late = threading.Timer(0.1, terminal.write, [b"late"])
    late.start()
    assert read_all(link, 4, timeout=0.01) == b"late"
    late.join()


def test_reads_end_while_the_driver_is_stopping(terminal, link):
    terminal.write(b"something")
    link.interrupt()
    for _ in range(2):
        with pytest.raises(LinkError, match="the driver is to stop"):
            link.read(DEADLINE)
    link.resume()
    assert link.read(DEADLINE) == b"something"


def test_bytes_go_out_and_come_in_unchanged(terminal, link):
    everything = bytes(range(256))
    link.write(everything)
    assert terminal.read() == everything
    terminal.write(everything)
    assert read_all(link, 256) == everything


def test_a_read_waits_for_the_first_byte(terminal, link):
    timer = threading.Timer(0.05, terminal.write, [b"late"])
    timer.start()
    assert link.read(DEADLINE)[:1] == b"l"
    timer.join()


def test_a_read_that_is_not_to_wait_gives_what_is_there(terminal, link):
    assert link.read(0) == b""
    terminal.write(b"now")
    assert link.read(DEADLINE) == b"now"
    assert link.read(0) == b""


def test_a_read_gives_up_after_its_time(link):
    assert link.read(0.01) == b""
    assert link.read(-1.0) == b""


def test_what_arrived_before_the_port_was_opened_is_not_read(terminal):
    terminal.write(b"old")
    link = SerialLink(terminal.path, 115200)
    assert link.read(0.05) == b""
    link.close()


def test_the_baud_rate_is_set_and_can_change(terminal, link):
    assert (link.baud_rate, terminal.speed()) == (115200, 115200)
    link.baud_rate = 9600
    assert (link.baud_rate, terminal.speed()) == (9600, 9600)


def test_the_time_of_bytes_on_the_line(link):
    assert link.seconds(115200) == pytest.approx(10.0)
    link.baud_rate = 9600
    assert link.seconds(96) == pytest.approx(0.1)


def test_a_port_is_opened_for_one_program_alone(terminal, link):
    error = error_of(terminal.path)
    assert f"cannot open {terminal.path}: it is in use by another program" in error  # this one
    assert f"fuser -v {terminal.path}" in error
    link.close()
    SerialLink(terminal.path, 115200).close()


@pytest.mark.parametrize(("port", "words"), [
    ("", "serial_port is not set; give a device path"),
    ("/dev/ttyMissing", "cannot open /dev/ttyMissing: there is no such port"),
    ("/dev/null", "cannot open /dev/null: that is no serial port"),
    ("/tmp", "cannot open /tmp: that is no serial port"),
    ("socket://127.0.0.1:1", "nothing listens there; check host and port"),
    ("socket://no.such.host.invalid:1", "there is no such host; check its name"),
    ("socket://127.0.0.1", "a host and a port are needed, as in socket://host:port"),
    ("socket://127.0.0.1:port", "a host and a port are needed, as in socket://host:port"),
    ("sucket://127.0.0.1:1", "sucket:// is not possible here"),
])
def test_a_port_that_cannot_be_opened_is_named_with_the_reason(port, words):
    error = error_of(port)
    assert words in error
    assert port in error


def test_a_port_without_permission_is_named_with_the_way_out(terminal):
    mode = stat.S_IMODE(os.stat(terminal.path).st_mode)
    os.chmod(terminal.path, 0)
    root = os.geteuid() == 0
    if root:
        os.seteuid(65534)  # nobody; root may open everything
    try:
        error = error_of(terminal.path)
    finally:
        if root:
            os.seteuid(0)
        os.chmod(terminal.path, mode)
    assert f"cannot open {terminal.path}: no permission" in error
    assert "sudo usermod -aG dialout $USER" in error


@pytest.mark.parametrize("action", [
    lambda link: link.read(DEADLINE), lambda link: link.write(b"?"),
    lambda link: setattr(link, "baud_rate", 9600)], ids=["read", "write", "baud_rate"])
def test_a_port_that_is_unplugged_is_named(terminal, link, action):
    terminal.unplug()
    with pytest.raises(LinkError, match=f"lost {terminal.path}: .*(unplugged|gone)"):
        action(link)


def test_a_read_ends_when_the_port_is_unplugged(terminal, link):
    timer = threading.Timer(0.05, terminal.unplug)
    timer.start()
    with pytest.raises(LinkError, match=f"lost {terminal.path}"):
        link.read(DEADLINE)
    timer.join()


def test_a_port_that_is_gone_can_be_closed(terminal, link):
    terminal.unplug()
    link.close()
    link.close()
    with pytest.raises(LinkError, match=f"lost {terminal.path}"):
        link.read(0)


def test_a_port_that_takes_no_bytes_is_named(link, terminal):
    with pytest.raises(LinkError, match=f"{terminal.path} takes no bytes; is flow control on"):
        link.write(bytes(1_000_000))  # nobody reads


def test_a_tcp_port_is_a_link_as_well():
    with socket.create_server(("127.0.0.1", 0)) as server:
        link = SerialLink(f"socket://127.0.0.1:{server.getsockname()[1]}", 115200)
        peer = server.accept()[0]
        link.write(b"ping")
        assert peer.recv(4) == b"ping"
        peer.sendall(b"pong")
        assert read_all(link, 4) == b"pong"
        assert link.read(0.01) == b""
        link.baud_rate = 9600
        peer.close()
        with pytest.raises(LinkError, match=r"lost socket://127\.0\.0\.1"):
            link.read(DEADLINE)
        link.close()


class Device:
    """A device that answers the bytes of each request backwards."""

    baud_rate = 115200

    def __init__(self):
        self.heard = []

    def receive(self, data, now):
        self.heard.append(data)
        return [(now, data[::-1])]


def test_a_simulated_line_answers_at_its_baud_rate_alone():
    device = Device()
    line = SimulatedLine(device).start()
    link = SerialLink(line.port, 115200)
    link.write(b"abc")
    assert read_all(link, 3) == b"cba"
    link.baud_rate = 9600
    link.write(b"abc")
    read_all(link, 3)
    assert device.heard[0] == b"abc"
    assert device.heard[-1] != b"abc"
    link.close()
    line.close()


def test_no_wait_for_a_simulated_line_ends_while_the_machine_holds_it_up():
    class HeldUp(Device):
        def receive(self, data, now):
            time.sleep(0.3)
            return super().receive(data, now)

    line = SimulatedLine(HeldUp()).start()
    link = SerialLink(line.port, 115200)
    link.write(b"a")
    assert link.read(0.05) == b"a"
    wait_until(lambda: not line.is_behind)
    assert link.read(0.05) == b""
    link.close()
    assert not line.is_behind
    line.close()
    assert not line.is_behind


def test_a_simulated_line_that_was_closed_leaves_later_ones_alone(tmp_path):
    path = str(tmp_path / "port")
    first = SimulatedLine(Device(), link=path).start()
    first.close()
    assert not os.path.lexists(path)
    second = SimulatedLine(Device(), link=path).start()
    first.close()  # its descriptors belong to the second one by now
    link = SerialLink(path, 115200)
    link.write(b"ab")
    assert read_all(link, 2) == b"ba"
    link.close()
    second.close()


@pytest.mark.parametrize("where", ["link", "listen"])
def test_a_simulated_line_can_be_unplugged(where, tmp_path):
    line = SimulatedLine(Device(), **{
        where: {"link": str(tmp_path / "port"), "listen": "127.0.0.1:0"}[where]}).start()
    port = line.port
    link = SerialLink(port, 115200)
    line.unplug()
    with pytest.raises(LinkError, match="lost"):
        link.read(DEADLINE)
    link.close()
    with pytest.raises(LinkError, match=r"no such port|nothing listens"):
        SerialLink(port, 115200)
    line.plug()
    assert line.port == port
    link = SerialLink(port, 115200)
    link.write(b"ab")
    assert read_all(link, 2) == b"ba"
    link.close()
    line.close()


def test_a_simulated_server_can_forget_its_client():
    line = SimulatedLine(Device(), listen="127.0.0.1:0").start()
    link = SerialLink(line.port, 115200)
    link.write(b"ab")
    assert read_all(link, 2) == b"ba"
    line.hang()
    second = SerialLink(line.port, 115200)
    second.write(b"cd")
    assert read_all(second, 2) == b"dc"
    link.write(b"ab")
    assert link.read(0.05) == b""  # and no error
    link.close()
    second.close()
    line.close()


def test_a_simulated_line_can_babble():
    line = SimulatedLine(Device()).start()
    link = SerialLink(line.port, 115200)
    line.faults.babble_byte, line.faults.babble = 0x55, 0.5
    assert set(read_all(link, 2000)) == {0x55}
    line.faults.babble_byte = -1
    assert len(set(read_all(link, 4000))) > 2
    link.close()
    line.close()


# --- ports elsewhere -----------------------------------------------------------------------------

def test_a_port_over_rfc_2217(terminal):
    server = Rfc2217Server(terminal.path)
    link = SerialLink(server.url, 57600)
    assert server.port.baudrate == 57600
    everything = bytes(range(256))
    link.write(everything)
    received = b""
    while len(received) < 256:
        received += terminal.read()
    assert received == everything
    terminal.write(everything)
    assert read_all(link, 256) == everything
    link.baud_rate = 9600
    assert server.port.baudrate == 9600
    assert link.read(0.05) == b""
    link.close()
    server.close()


def test_a_network_port_that_is_silent_is_opened_again(monkeypatch):
    monkeypatch.setattr(serial_link, "SILENCE", 0.0)
    with socket.create_server(("127.0.0.1", 0)) as server:
        link = SerialLink(f"socket://127.0.0.1:{server.getsockname()[1]}", 115200)
        dead, _ = server.accept()
        link.write(b"first")  # into a connection of which the other end has gone
        link.write(b"second")
        alive, _ = server.accept()
        assert alive.recv(100) == b"second"
        alive.sendall(b"answer")
        assert read_all(link, 6) == b"answer"
        link.write(b"third")  # the answer showed that it lives
        assert alive.recv(100) == b"third"
        link.close()
        for connection in dead, alive:
            connection.close()


@pytest.mark.parametrize(("port", "text"), [
    ("loop://", "loop:// is not possible here; give a device path, sim://MODEL, socket://"),
    ("spy:///dev/ttyS0?file={file}", "spy:// is not possible here"),
    ("alt:///dev/ttyS0?class=VTIMESerial", "alt:// is not possible here"),
    ("hwgrep://no such thing", "no ports found matching"),
    ("hwgrep://(", "missing )"),
    ("rfc2217://127.0.0.1", "a host and a port are needed, as in rfc2217://host:port"),
    ("rfc2217://127.0.0.1:1?x=1", "a host and a port are needed, as in rfc2217://host:port"),
    ("{file}", "there is no such port")])
def test_a_port_that_cannot_be_is_refused_and_nothing_is_made(port, text, tmp_path):
    file = tmp_path / "file"
    assert text in error_of(port.format(file=file))
    assert not list(tmp_path.iterdir())
