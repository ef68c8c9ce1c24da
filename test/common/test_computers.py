# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Sensor, node and recorder on different computers: network namespaces, or one over loopback."""

import os
import shutil
import socket
import subprocess
import time
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple

import pytest
from nodes import DEADLINE, NodeProcess, Process

HERE = f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})"
ISYS, ICOTRONIC, UC4000 = (
    f"{family}_driver.program" for family in ("isys_radar", "icotronic", "uc4000"))
NETWORK = "10.77.0"


class Computer(NamedTuple):
    """A computer: its address, and the command in front of what runs there."""

    address: str
    within: tuple[str, ...] = ()


class ForbiddenError(Exception):
    """This system does not allow network namespaces."""


def hold(stack, *command):
    """Return a process which holds the namespaces that a command makes, until the stack ends."""
    holder = subprocess.Popen([*command, "cat"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True)
    stack.callback(holder.communicate)
    holder.stdin.write("ready\n")
    holder.stdin.flush()
    answer = holder.stdout.readline().strip()
    if answer != "ready":
        raise ForbiddenError(answer)
    return str(holder.pid)


def inside(number):
    """Return the command which runs something in the namespaces of a process."""
    return "nsenter", "--preserve-credentials", "-U", "-n", "-t", number


def connect(stack):
    """Return two computers with an Ethernet link between them, and nothing else."""
    first = hold(stack, "unshare", "--user", "--map-root-user", "--net")
    second = hold(stack, *inside(first), "unshare", "--net")
    run_in(first, "ip", "link", "add", "eth0", "type", "veth", "peer", "name", "eth0", "netns",
           second)
    computers = []
    for number, holder in enumerate((first, second), 1):
        address = f"{NETWORK}.{number}"
        run_in(holder, "ip", "addr", "add", f"{address}/24", "dev", "eth0")
        for device in "lo", "eth0":
            run_in(holder, "ip", "link", "set", device, "up")
        computers.append(Computer(address, inside(holder)))
    for holder in first, second:  # Fast DDS leaves out what is not up when it starts
        deadline = time.monotonic() + DEADLINE
        while "state UP" not in run_in(holder, "ip", "link", "show", "eth0"):
            assert time.monotonic() < deadline, "the link does not come up"
    return computers


def run_in(holder, *command):
    """Return what a command prints in the namespaces of a process; raises ForbiddenError."""
    result = subprocess.run([*inside(holder), *command], capture_output=True, text=True)
    if result.returncode:
        raise ForbiddenError(result.stderr.strip())
    return result.stdout


@pytest.fixture(params=["namespaces", "loopback"])
def computers(request):
    """Two computers."""
    with ExitStack() as stack:
        if request.param == "loopback":
            yield [Computer("127.0.0.1")] * 2
            return
        try:
            both = connect(stack)
        except (ForbiddenError, OSError) as error:  # OSError: no such program
            pytest.skip(f"no network namespaces here: {error}")
        yield both


def found(text):
    """Return the address that a program printed first."""
    return text.split()[0].rstrip(":,")


def test_a_serial_port_over_tcp(computers):
    gateway, host = computers
    with Process("sensor_tools.simulate", "isys", "--model", "iSYS-4001", "--listen",
                 f"{gateway.address}:0", within=gateway.within) as simulator:
        port = found(simulator.wait_for_line("socket://"))
        assert gateway.address in port
        with NodeProcess(ISYS, {"serial_port": port}, within=host.within) as node:
            assert "iSYS-4001" in node.wait_for_line("connected to")
            node.stop()


def test_a_serial_port_over_rfc_2217(computers, tmp_path):
    gateway, host = computers
    path = str(tmp_path / "port")
    with Process("sensor_tools.simulate", "isys", "--model", "iSYS-4003", "--link",
                 path) as simulator:
        simulator.wait_for_line("iSYS-4003")
        with Process("rfc2217_server", path, gateway.address, before=HERE,
                     within=gateway.within) as server:
            port = server.wait_for_line("rfc2217://")
            with NodeProcess(ISYS, {"serial_port": port}, within=host.within) as node:
                assert "9600 Bd" in node.wait_for_line("connected to")  # at a rate that it found
                node.stop()


def test_a_can_bus_over_socketcand(computers):
    gateway, host = computers
    with Process("sensor_tools.simulate", "icotronic", "--listen", f"{gateway.address}:0",
                 within=gateway.within) as simulator:
        port = found(simulator.wait_for_line(f"{gateway.address}:")).rpartition(":")[2]
        options = [f"host={gateway.address}", f"port={port}"]
        with NodeProcess(ICOTRONIC, {"can_interface": "socketcand", "can_options": options},
                         within=host.within) as node:
            assert "Test-STH" in node.wait_for_line("connected to")
            node.stop()


def hear(computers, settings):
    """Have a recorder hear a node on the other computer; each has settings of its own."""
    (host, recorder), (at_host, at_recorder) = computers, [
        {"FASTDDS_BUILTIN_TRANSPORTS": "UDPv4",  # computers share no memory
         "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", **setting} for setting in settings]
    with Process("range_listener", "/uc4000/range", before=HERE, within=recorder.within,
                 env=at_recorder) as listener:
        listener.wait_for_line("listening")
        with NodeProcess(UC4000, {"serial_port": "sim://UC4000"}, within=host.within,
                         env=at_host) as node:
            listener.wait_for_line("heard")
            node.stop()


def test_dds_with_unicast_peers(computers):
    hear(computers, [{"ROS_STATIC_PEERS": other.address} for other in reversed(computers)])


def test_dds_with_a_discovery_server(computers):
    program = shutil.which("fast-discovery-server")
    if program is None:
        pytest.skip("there is no fast-discovery-server")
    host, _ = computers
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = str(free.getsockname()[1])
    libraries = f"{Path(program).parent.parent / 'lib'}:{os.environ.get('LD_LIBRARY_PATH', '')}"
    server = subprocess.Popen(
        [*host.within, program, "--server-id", "0", "--udp-address", host.address, "--udp-port",
         port], stdout=subprocess.DEVNULL, stdin=subprocess.DEVNULL,
        env={**os.environ, "LD_LIBRARY_PATH": libraries})  # the wheels' lie beside their programs
    try:
        hear(computers, [{"ROS_DISCOVERY_SERVER": f"{host.address}:{port}"}] * 2)
        assert server.poll() is None
    finally:
        server.terminate()
        server.wait()
