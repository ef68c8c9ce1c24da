# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A CAN bus through python-can: what is handed over, and errors in words.

Many kernels have no CAN, so the interface is a stand-in where a test is about the kernel's errors.
"""

from __future__ import annotations

import errno
import os
import select
import socket
import threading
import time

import can
import pytest
from bus_master import needs_errors_of_socketcand

from driver_common import can_link
from driver_common.advice import CAN_ERRORS
from driver_common.can_link import CanLink, parse_options
from driver_common.errors import LinkError, SettingError
from driver_common.simulator.bus import CanFrame, SimulatedBus

DEADLINE = 60.0  # s; far more than anything takes, also on a busy machine
FILTERS = ((0x10, 0x1000083F),)
SOON = 30.0  # s; a node that is told to stop must end within that


def open_link(interface="socketcan", channel="can0", options=(), bitrate=500_000):
    return CanLink(interface, channel, bitrate, options, FILTERS)


class StandIn:
    """What python-can returns: it remembers how it was opened, and fails as it is told."""

    def __init__(self, error=None, **arguments):
        self.arguments = arguments
        self.error = error
        self.sent = []
        self.closed = 0
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    def fileno(self):
        return self.socket.fileno()

    def send(self, message, timeout=None):
        if self.error:
            raise self.error
        self.sent.append((message, timeout))

    def recv(self, timeout=None):
        raise self.error

    def shutdown(self):
        self.closed += 1
        self.socket.close()
        if self.error:
            raise self.error


@pytest.fixture
def stand_in(monkeypatch):
    """Open stand-ins in place of buses; the list has those that were opened."""
    opened = []

    def bus(**arguments):
        opened.append(StandIn(**arguments))
        return opened[-1]

    monkeypatch.setattr(can, "Bus", bus)
    return opened


@pytest.fixture
def failing(monkeypatch):
    """Let opening a bus fail."""
    def fail_with(error):
        def bus(**_):
            raise error

        monkeypatch.setattr(can, "Bus", bus)

    return fail_with


class Devices:
    """Devices on a simulated bus that answer each frame with the next number."""

    def __init__(self):
        self.heard = []
        self.due = []

    def receive(self, frame, now):
        self.heard.append(frame)
        self.due.append((now, frame._replace(can_id=frame.can_id + 1)))

    def poll(self, now):
        due, self.due = self.due, []
        return due

    def next_due(self, now):
        return self.due[0][0] if self.due else None


@pytest.fixture
def server():
    """Start a socketcand server which knows the channel can0 only."""
    bus = SimulatedBus(Devices(), channel="can0").start()
    yield bus
    bus.close()


def at(server):
    return [f"host={server.host}", f"port={server.port}"]


@pytest.fixture
def tcp_server():
    """Start a TCP server that greets each client with some bytes, and says nothing more."""
    closing = []

    def start(greeting):
        listener = socket.create_server(("127.0.0.1", 0))
        clients = []

        def greet():
            while True:
                try:
                    clients.append(listener.accept()[0])
                except OSError:
                    return
                clients[-1].sendall(greeting)

        thread = threading.Thread(target=greet, daemon=True)
        thread.start()
        closing.append((listener, thread, clients))
        host, port = listener.getsockname()
        return [f"host={host}", f"port={port}"]

    yield start
    for listener, thread, clients in closing:
        listener.shutdown(socket.SHUT_RDWR)
        listener.close()
        thread.join()
        for client in clients:
            client.close()


# --- options -----------------------------------------------------------------------------------

def test_options_become_values_of_their_own_type():
    assert parse_options(["host=10.0.0.1", "port=29536", "tcp_tune=True", "quick=false",
                          "offset=-3", "name=a=b", "empty=", "odd=--3", "power=3²"]) == {
        "host": "10.0.0.1", "port": 29536, "tcp_tune": True, "quick": False, "offset": -3,
        "name": "a=b", "empty": "", "odd": "--3", "power": "3²"}


@pytest.mark.parametrize("option", ["host", "=5", "", "-"])
def test_an_option_without_name_or_value_is_refused(option):
    with pytest.raises(SettingError, match=r'can_options must be like "host=127.0.0.1", not '):
        parse_options([option])


def test_the_bus_is_opened_as_asked_for(stand_in):
    open_link("slcan", "/dev/ttyACM0", ["ttyBaudrate=115200"])
    assert stand_in[0].arguments == {
        "interface": "slcan", "channel": "/dev/ttyACM0", "bitrate": 500_000,
        "ignore_config": True, "ttyBaudrate": 115200}


def test_an_error_that_waits_in_the_kernel_is_told_at_once(monkeypatch):
    """As on a channel that is down: to bind to it is no error, but leaves one behind."""
    bus = StandIn()
    with socket.create_server(("127.0.0.1", 0)) as free:
        bus.socket.connect(free.getsockname())
    bus.socket.send(b"")  # nobody listens there
    poll = select.poll()
    poll.register(bus.socket, select.POLLERR)
    assert poll.poll(5000)
    monkeypatch.setattr(can, "Bus", lambda **arguments: bus)
    with pytest.raises(LinkError, match="cannot open socketcan can0: nothing listens there"):
        open_link()
    assert bus.closed == 1


def test_a_bus_without_a_socket_leaves_nothing_open(monkeypatch, tmp_path):
    bus = StandIn()
    with (tmp_path / "serial").open("w") as file:
        bus.fileno = file.fileno
        monkeypatch.setattr(can, "Bus", lambda **arguments: bus)
        before = len(os.listdir("/proc/self/fd"))
        assert open_link("slcan").receive_buffer == 0
        assert len(os.listdir("/proc/self/fd")) == before


def test_the_kernel_filters_where_it_can(stand_in):
    open_link("socketcan")
    assert stand_in[0].arguments["can_filters"] == [
        {"can_id": 0x10, "can_mask": 0x1000083F, "extended": True}]


@pytest.mark.parametrize("interface", ["pcan", "kvaser", "virtual"])
def test_python_does_not_filter(stand_in, interface):
    open_link(interface)
    assert "can_filters" not in stand_in[0].arguments


def test_the_kernel_keeps_more_frames_than_usual(stand_in):
    before = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    open_link()
    option = socket.SOL_SOCKET, socket.SO_RCVBUF
    assert stand_in[0].socket.getsockopt(*option) > before.getsockopt(*option)
    before.close()


def test_an_interface_without_a_socket_can_be_used(stand_in, monkeypatch):
    def no_socket(bus):
        raise NotImplementedError

    monkeypatch.setattr(StandIn, "fileno", no_socket)
    open_link("pcan").send(1, b"")
    assert stand_in[0].sent


# --- frames ------------------------------------------------------------------------------------

def test_frames_go_out_extended_and_not_for_ever(stand_in):
    link = open_link()
    link.send(0x1234567, b"\x01\x02")
    (message, timeout), = stand_in[0].sent
    assert (message.arbitration_id, bytes(message.data)) == (0x1234567, b"\x01\x02")
    assert message.is_extended_id
    assert not message.is_fd
    assert 0 < timeout <= 1


def test_frames_go_out_and_come_in(server):
    link = open_link("socketcand", options=at(server))
    link.send(0x1234567, b"\x01\x02")
    message = link.receive(DEADLINE)
    assert (message.arbitration_id, bytes(message.data)) == (0x1234568, b"\x01\x02")
    assert server._devices.heard == [CanFrame(0x1234567, b"\x01\x02")]
    link.close()


def test_a_link_can_be_closed_twice(server):
    link = open_link("socketcand", options=at(server))
    link.close()
    link.close()


def test_a_link_whose_interface_is_gone_can_be_closed(stand_in):
    link = open_link()
    stand_in[0].error = OSError(errno.ENODEV, "No such device")
    link.close()
    assert stand_in[0].closed == 1


def test_sending_on_a_closed_link_is_an_error(server):
    link = open_link("socketcand", options=at(server))
    link.close()
    with pytest.raises(LinkError, match="lost socketcand can0: "):
        link.send(1, b"")


# --- errors of the kernel ----------------------------------------------------------------------

ADVICE = {
    errno.ENODEV: "there is no such channel; 'ip -brief link show type can' lists them",
    errno.ENETDOWN: "it is down; 'sudo ip link set can0 up type can bitrate 500000' brings it up",
    errno.EAFNOSUPPORT: "this kernel has no CAN; 'sudo modprobe can_raw' loads it",
    errno.EPERM: "no permission; bring the channel up as root, then a user may open it",
    errno.ECONNREFUSED: "nothing listens there; check host and port in can_options",
    errno.ENOBUFS: "the transmit buffer is full: nobody acknowledges; check wiring, termination "
                   "and bit rate",
    errno.ECONNRESET: "the server closed the connection",
    errno.EPIPE: "the server closed the connection",
}


def operation_error(number):
    """Return an error as python-can raises it where the kernel raised one."""
    error = can.CanOperationError(f"Failed to transmit: {os.strerror(number)}", number)
    error.__cause__ = OSError(number, os.strerror(number))
    return error


def test_every_advice_is_tested():
    assert CAN_ERRORS.keys() == ADVICE.keys()


@pytest.mark.parametrize("number", ADVICE, ids=errno.errorcode.get)
def test_a_bus_that_cannot_be_opened_is_told_with_what_to_do(failing, number):
    failing(OSError(number, os.strerror(number)))
    with pytest.raises(LinkError) as caught:
        open_link()
    assert str(caught.value) == f"cannot open socketcan can0: {ADVICE[number]}"


@pytest.mark.parametrize("number", ADVICE, ids=errno.errorcode.get)
def test_a_bus_that_is_lost_is_told_with_what_to_do(stand_in, number):
    link = open_link()
    stand_in[0].error = operation_error(number)
    with pytest.raises(LinkError) as caught:
        link.send(1, b"")
    assert str(caught.value) == f"lost socketcan can0: {ADVICE[number]}"
    with pytest.raises(can.CanError) as received:
        link.receive(0.1)
    assert str(link.lost(received.value)) == str(caught.value)


def test_a_transmit_queue_that_stays_full_is_told_with_what_to_do(stand_in):
    link = open_link()
    stand_in[0].error = can.CanOperationError("Transmit buffer full")  # as python-can says it
    with pytest.raises(LinkError) as caught:
        link.send(1, b"")
    assert str(caught.value) == f"lost socketcan can0: {ADVICE[errno.ENOBUFS]}"


def test_an_error_code_of_another_interface_is_not_taken_for_one_of_the_kernel(failing):
    failing(can.CanInitializationError("the transmit queue is full", error_code=1))
    with pytest.raises(LinkError) as caught:
        open_link("pcan", "PCAN_USBBUS1")
    assert str(caught.value) == ("cannot open pcan PCAN_USBBUS1: the transmit queue is full "
                                 "[Error Code 1]")


@pytest.mark.parametrize(("error", "words"), [
    (ImportError("no module named uptime"), "no module named uptime"),
    (NotImplementedError(), "NotImplementedError"),
    (can.CanError("Failed to receive: x  Traceback (most recent call last):\n  File"),
     "Failed to receive: x  Traceback (most recent call last):"),
    (TypeError("unexpected keyword argument 'prot'"), "unexpected keyword argument 'prot'"),
    (OSError(errno.EIO, "Input/output error"), "[Errno 5] Input/output error")])
def test_any_other_error_is_told_in_one_line(failing, error, words):
    failing(error)
    with pytest.raises(LinkError) as caught:
        open_link()
    assert str(caught.value) == f"cannot open socketcan can0: {words}"


def test_the_text_of_the_cause_is_told_without_a_traceback(failing):
    error = can.CanError("Failed to receive: bad  Traceback (most recent call last):\n  File")
    error.__cause__ = ValueError("bad")
    failing(error)
    with pytest.raises(LinkError, match=r"^cannot open socketcan can0: bad$"):
        open_link()


def test_an_interface_that_python_can_does_not_have_is_named_with_the_nearest():
    with pytest.raises(LinkError) as caught:
        open_link("soketcan")
    assert str(caught.value).startswith(
        'cannot open soketcan can0: python-can has no such interface; did you mean "socketcan')
    assert "can_interface can be " in str(caught.value)
    assert "socketcand" in str(caught.value)


@pytest.mark.parametrize("interface", sorted(can.VALID_INTERFACES - {
    "socketcan", "socketcand", "udp_multicast", "virtual"}))
def test_an_interface_that_does_not_work_here_says_why_in_words(interface):
    with pytest.raises(LinkError) as caught:
        open_link(interface, "no_such_channel")
    text = str(caught.value)
    assert text.startswith(f"cannot open {interface} no_such_channel: ")
    for word in ("\n", "import", "module '", "Errno", os.path.dirname(can.__file__), "__"):
        assert word not in text


@pytest.mark.parametrize(("error", "text"), [
    ("Cannot import module can.interfaces.gs_usb for CAN interface 'gs_usb': No module named 'usb'",
     "python-can needs the Python package usb for it, which is not here"),
    ("Cannot import module can.interfaces.ixxat for CAN interface 'ixxat': cannot import name "
     "'HRESULT' from 'can.ctypesutil' (/somewhere/can/ctypesutil.py)",
     "python-can needs the library of its maker for it, which is not here"),
    ("The Vector interface is only supported on Windows\nsorry",
     "The Vector interface is only supported on Windows"),
])
def test_what_an_interface_lacks_is_told(failing, error, text):
    failing(can.CanInterfaceNotImplementedError(error))
    with pytest.raises(LinkError) as caught:
        open_link("gs_usb")
    assert str(caught.value).startswith(f"cannot open gs_usb can0: {text}")


def test_a_channel_that_is_not_there_is_an_error_in_words():
    with pytest.raises(LinkError) as caught:
        open_link("socketcan", "can_not")
    assert str(caught.value) in (f"cannot open socketcan can_not: {ADVICE[errno.ENODEV]}",
                                 f"cannot open socketcan can_not: {ADVICE[errno.EAFNOSUPPORT]}",
                                 f"cannot open socketcan can_not: {ADVICE[errno.EPERM]}")


# --- servers -----------------------------------------------------------------------------------

@pytest.mark.parametrize("options", [
    [], ["host=127.0.0.1"], ["port=29536"], ["host=5", "port=29536"],
    ["host=127.0.0.1", "port=none"]])
def test_a_server_needs_host_and_port(options):
    with pytest.raises(LinkError, match=r'socketcand needs can_options such as .*"port=29536"'):
        open_link("socketcand", options=options)


def test_a_server_that_is_not_there_is_an_error_at_once(server):
    options = at(server)
    server.close()
    began = time.monotonic()
    with pytest.raises(LinkError) as caught:
        open_link("socketcand", options=options)
    assert str(caught.value) == (f"cannot open socketcand can0 at {server.host}:{server.port}: "
                                 f"{ADVICE[errno.ECONNREFUSED]}")
    assert time.monotonic() - began < SOON


def test_a_host_that_does_not_exist_is_named(monkeypatch):
    def unknown(*_, **__):
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    monkeypatch.setattr(socket, "getaddrinfo", unknown)
    with pytest.raises(LinkError) as caught:
        open_link("socketcand", options=["host=gateway", "port=29536"])
    assert str(caught.value) == ("cannot open socketcand can0 at gateway:29536: Name or service "
                                 "not known; check host in can_options")


@pytest.mark.parametrize("port", [-1, 70000])
def test_a_port_that_does_not_exist_is_an_error(port):
    with pytest.raises(LinkError, match=f"cannot open socketcand can0 at 127.0.0.1:{port}: "):
        open_link("socketcand", options=["host=127.0.0.1", f"port={port}"])


def test_a_server_that_does_not_answer_is_given_up_soon(monkeypatch, tcp_server):
    monkeypatch.setattr(can_link, "CONNECT_TIMEOUT", 0.3)
    began = time.monotonic()
    with pytest.raises(LinkError, match="no answer; check host and port in can_options"):
        open_link("socketcand", options=tcp_server(b""))
    assert time.monotonic() - began < SOON


@pytest.mark.parametrize("greeting", [b"SSH-2.0-OpenSSH_9.6\r\n", b"\xff\xfe\x00\x80 >"])
def test_another_server_is_not_taken_for_socketcand(tcp_server, greeting):
    with pytest.raises(LinkError, match="that is no socketcand server; check host and port"):
        open_link("socketcand", options=tcp_server(greeting))


@needs_errors_of_socketcand
def test_a_channel_that_the_server_does_not_have_is_an_error(server):
    with pytest.raises(LinkError, match=r"cannot open socketcand can7: .*could not open bus"):
        open_link("socketcand", "can7", at(server))


def test_a_server_that_goes_is_an_error_of_one_line(server):
    link = open_link("socketcand", options=at(server))
    server.close()
    with pytest.raises(LinkError) as caught:  # noqa: PT012
        deadline = time.monotonic() + DEADLINE
        while time.monotonic() < deadline:
            link.send(1, b"")
            try:
                link.receive(0.02)
            except (can.CanError, OSError) as error:
                raise link.lost(error) from error
    assert str(caught.value) == f"lost socketcand can0: {ADVICE[errno.EPIPE]}"
    link.close()
