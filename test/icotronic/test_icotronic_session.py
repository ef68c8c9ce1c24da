# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The conversation with simulated sensors over a real socketcand server, step by step.

The test calls `poll` itself, so that nothing happens behind its back. The sensors are in the same
process: what they measured and lost and what the session made of it can be compared.
"""

from __future__ import annotations

import collections
import contextlib
import math
import socket
import threading
import time
from types import SimpleNamespace

import can
import numpy as np
import pytest
from bus_master import (
    DEADLINE,
    BusMaster,
    BusRecorder,
    needs_errors_of_socketcand,
    wait_until,
)

from driver_common import can_link
from driver_common.device_thread import DeviceThread
from driver_common.errors import (
    FrameError,
    LinkError,
    NoAnswerError,
    RefusedError,
    SettingError,
    WrongDeviceError,
)
from driver_common.simulator import bus as simulated_bus
from driver_common.simulator.bus import CanFrame
from icotronic_driver import acquisition, commands, connection, maintenance
from icotronic_driver import line as can_line
from icotronic_driver.access import Access
from icotronic_driver.commands import CONFIGURATION, EEPROM, STREAMING, SYSTEM
from icotronic_driver.eeprom import STH_EEPROM, STU_EEPROM, Status
from icotronic_driver.identifier import SPU_1, STH_1, STU_1, Identifier
from icotronic_driver.laws import STANDARD_GRAVITY, ChannelOptions, Law
from icotronic_driver.line import STREAM_ID, Line
from icotronic_driver.listener import Listener
from icotronic_driver.sensor import Options, Phase
from icotronic_driver.session import IcotronicBus
from icotronic_driver.settings import SETTINGS
from icotronic_driver.simulator import line, scene, sth, stu, unit
from icotronic_driver.simulator.line import SimulatedIcotronic, simulated_network
from icotronic_driver.values import AdcConfiguration, NetworkState

PATIENCE, CONNECT_TIMEOUT = connection.PATIENCE, connection.CONNECT_TIMEOUT
RATE = 38.4e6 / (3 * 21 * 64)  # values/s after a reset
SETTLED = 1.0  # s after which the clock of a stream is near the truth, on a machine that is busy
RAW_TOLERANCE = 25  # ADC steps of 4 and 2.5 mg; times since the epoch are rounded to 0.2 µs


class Stream:
    """One stream as a user of the session got it."""

    def __init__(self, sensor):
        self.channels = sensor.options.channels
        self.data_sets = sensor.format.data_sets
        self.frames = []  # number of the first sample, stamp, period, values
        self._numbers = collections.deque()
        self._decoder, self._decode = sensor.decoder, sensor.decoder.decode_frame
        self._decoder.decode_frame = self._note_number

    def _note_number(self, *frame):
        values = self._decode(*frame)
        if values is not None:
            self._numbers.append(self._decoder.number * self.data_sets)
        return values

    def take(self, stamp, period, values):
        self.frames.append((self._numbers.popleft(), stamp, period, values))

    def samples(self):
        """Return number, stamp in s and raw values of each sample."""
        numbers, stamps, rows = [], [], []
        for number, stamp, period, values in self.frames:
            for index in range(self.data_sets):
                numbers.append(number + index)
                stamps.append(stamp * 1e-9 + index * period * 1e-9)
                rows.append(values[index * len(self.channels):(index + 1) * len(self.channels)])
        return np.array(numbers), np.array(stamps), np.array(rows)


class Recorder(BusRecorder, Listener):
    """Remembers what the bus tells."""

    def __init__(self):
        super().__init__()
        self.streams = []
        self.readings = {}

    def on_stream(self, sensor):
        self.streams.append(Stream(sensor))
        return self.streams[-1].take

    def on_readings(self, sensor, name):
        self.readings.setdefault(name, []).append(getattr(sensor.readings, name))


class Host(BusMaster):
    """A bus that the test polls."""

    def __init__(self, server, **options):
        heard = Recorder()
        super().__init__(make_bus(server, heard, **options), heard)
        self.sensor = self.device
        self.bus.open()

    def find(self):
        """Poll until the sensor is found once more."""
        before = len(self.heard.found)
        self.until(lambda: len(self.heard.found) > before)
        return self

    def stream(self, frames=30):
        """Start the stream, and poll until that many more frames have come."""
        if self.sensor.decoder is None:
            self.bus.set_active(True)
        return self.more(frames)

    def more(self, frames=30):
        """Poll until the present stream brought that many more frames."""
        end = self.taken + frames
        self.until(lambda: self.taken >= end)
        return self.heard.streams[-1]

    @property
    def taken(self):
        """Frames of all streams that came so far."""
        return sum(len(stream.frames) for stream in self.heard.streams)


def make_bus(server, listener, *, channel="can0", **options):
    where = [f"host={server.host}", f"port={server.port}"]
    return IcotronicBus(Line("socketcand", channel, 1_000_000, where), Options(**options), listener)


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    """Do not wait as long as real radios need."""
    monkeypatch.setattr(simulated_bus, "BATCH_TIME", 0.0005)
    for name, value in (("STU_DELAY", 0.0), ("STH_DELAY", 0.0), ("CONNECT_TIME", 0.01),
                        ("ADVERTISEMENT", 0.005), ("SUPERVISION_TIME", 0.1), ("BOOT_TIME", 0.1)):
        for module in (unit, sth, stu, line):
            if hasattr(module, name):
                monkeypatch.setattr(module, name, value)
    for module, name, value in (
            (connection, "SETTLE_TIME", 0.05), (connection, "PATIENCE", 0.4),
            (connection, "CONNECT_POLL", 0.02), (acquisition, "KEEP_ALIVE", 0.2),
            (acquisition, "SILENCE", 0.4), (maintenance, "RESET_TIME", 0.15)):
        monkeypatch.setattr(module, name, value)


@pytest.fixture
def impatient(monkeypatch):
    """Do not wait long for answers, where none comes."""
    request = Line.request
    monkeypatch.setattr(Line, "request",
                        lambda line, asked, timeout=0.15, attempts=3: request(
                            line, asked, min(timeout, 0.15), attempts))
    monkeypatch.setattr(connection, "RELEASE_TIMEOUT", 0.1)


@pytest.fixture
def start():
    """Start simulated networks; they end with the test."""
    servers = []

    def start_one(*names, **options):
        servers.append(simulated_network(names or ("Test-STH",), **options).start())
        return servers[-1]

    yield start_one
    for server in servers:
        server.close()


@pytest.fixture
def listen():
    """Open hosts on networks; they close with the test."""
    hosts = []

    def listen_on(server, **options):
        hosts.append(Host(server, **options))
        return hosts[-1]

    yield listen_on
    for host in hosts:
        host.bus.close()


@pytest.fixture
def connect(start, listen):
    """Start a network and connect to its sensor; return host, network and simulated sensor.

    The sensor is named, so that nobody waits for others.
    """
    def connect_one(*, calibrated=True, sensor_name="Test-STH", **options):
        server = start(calibrated=calibrated)
        host = listen(server, sensor_name=sensor_name, **options).find()
        return host, server.network, server.network.sensors[0]

    return connect_one


def true_values(simulated, stream, numbers, first=0):
    """Return what the sensor measured; `first` is the sample which the host numbers with 0."""
    times = simulated.sample_times(0, int(numbers.max()) + first + 1)[numbers + first]
    columns = ["xyz".index(channel) for channel in stream.channels]
    return times, simulated.raw_values(times)[:, columns].astype(int)


def assert_true(simulated, stream, *, stamp_error=None):
    """Check every sample that came against what was measured."""
    numbers, stamps, values = stream.samples()
    times, truth = true_values(simulated, stream, numbers)
    assert np.abs(values - truth).max() <= RAW_TOLERANCE
    if stamp_error is not None:
        assert np.abs(stamps - times).max() <= stamp_error


# --- finding the sensor ------------------------------------------------------------------------

def test_the_only_sensor_in_range_is_connected_and_identified(connect, monkeypatch):
    monkeypatch.undo()  # with the true times
    host, network, simulated = connect(sensor_name="")
    assert network.stu.connected is simulated
    sensor = host.sensor
    assert (sensor.identity.name, sensor.identity.mac) == ("Test-STH", "08:6B:D7:01:DE:81")
    assert (str(sensor.identity.hardware), str(sensor.identity.firmware)) == ("1.4.0", "2.1.10")
    assert sensor.identity.production_date == "2021-10-05"
    assert (sensor.stu_identity.name, sensor.stu_identity.mac) == ("Valerie", "08:6B:D7:01:0B:5C")
    assert sensor.settings.keys() == SETTINGS.keys() == sensor.values.keys()
    assert sensor.sample_rate == pytest.approx(RATE)
    assert (host.heard.lost, host.heard.warnings) == ([], [])


@pytest.mark.parametrize("options", [
    {"sensor_name": "Tool-7"}, {"sensor_mac": "08:6B:D7:01:DE:82"},
    {"sensor_number": 1},
    {"sensor_name": "Tool-7", "sensor_mac": "08:6B:D7:01:DE:82"}])
def test_of_several_sensors_the_wanted_one_is_connected(start, listen, options):
    server = start("Spindle", "Tool-7", "Chuck")
    host = listen(server, **options).find()
    assert host.sensor.identity.name == "Tool-7"
    assert server.network.stu.connected is server.network.sensor("Tool-7")


def test_several_sensors_and_none_wanted_is_an_error_that_lists_them(start, listen):
    server = start("Spindle", "Tool-7")
    error = listen(server).lose()
    assert isinstance(error, WrongDeviceError)
    assert str(error) == (
        '2 sensors are in range: "Spindle" (08:6B:D7:01:DE:81, number 0, -52 dBm); "Tool-7" '
        "(08:6B:D7:01:DE:82, number 1, -52 dBm); say which one with the parameter sensor_name, "
        "sensor_mac or sensor_number")


def test_the_list_of_sensors_is_not_told_again_because_the_rssi_changes(start, listen):
    server = start("Spindle", "Tool-7")
    host = listen(server)
    host.lose()
    for rssi in (-40, -61):
        server.network.sensors[0].rssi = rssi
        host.until(lambda rssi=rssi: f"{rssi} dBm" in str(host.sensor.error))
    assert len(host.heard.lost) == 1


def test_several_sensors_of_the_same_name_are_told_apart_by_mac(start, listen):
    server = start("Spindle", "Spindle")
    error = listen(server, sensor_name="Spindle").lose()
    assert "2 sensors are in range" in str(error)
    assert "sensor_mac" in str(error)


def test_a_wanted_sensor_that_is_not_in_range_is_named_beside_those_that_are(start, listen):
    server = start("Spindle", "Tool-7")
    host = listen(server, sensor_name="Chuck", sensor_mac="AA:BB:CC:DD:EE:FF")
    error = str(host.lose())
    assert error.startswith('the sensor "Chuck" AA:BB:CC:DD:EE:FF is not in range')
    assert '"Spindle" (08:6B' in error
    assert "correct the parameter" in error


def test_no_sensor_in_range_is_told_once_and_the_sensor_is_found_when_it_comes(start, listen):
    server = start()
    simulated = server.network.sensors[0]
    simulated.in_range = False
    host = listen(server)
    assert "no sensor is in range of the stationary unit; wake it up" in str(host.lose())
    first = host.sensor.error
    host.until(lambda: host.sensor.error is not first)  # it looked again
    simulated.in_range = True
    host.find()
    assert len(host.heard.lost) == 1


def test_a_sensor_that_advertises_rarely_is_waited_for(start, listen, monkeypatch):
    monkeypatch.setattr(connection, "PATIENCE", 3.0)  # the true one
    server = start()
    simulated = server.network.sensors[0]
    simulated.eeprom["Sleep Time 1"] = 0.001  # so it advertises every 1.25 s
    host = listen(server).find()
    assert host.heard.lost == []


def test_a_second_sensor_that_advertises_rarely_is_seen_before_one_is_taken(start, listen):
    server = start("Spindle", "Tool-7")
    asleep = server.network.sensor("Tool-7")
    asleep.eeprom["Sleep Time 1"], asleep.eeprom["Advertisement Time 1"] = 0.001, 0.3
    assert "2 sensors are in range" in str(listen(server).lose())
    assert PATIENCE > 2.5  # s; no sensor advertises less often (field note N5)


@pytest.mark.parametrize("options", [{}, {"sensor_name": "Test-STH"},
                                     {"sensor_mac": "08:6B:D7:01:DE:81"}])
def test_a_new_sensor_is_taken_once_it_tells_name_mac_and_rssi(start, listen, options):
    server = start()
    server.network.faults.newness = 0.3
    host = listen(server, **options)
    host.until(lambda: host.sensor.seen)
    assert [one[1:] for one in host.bus.maintenance.scan()] == [
        ("Test-S", "00:00:00:00:00:00", 0)]
    host.until(lambda: host.sensor.is_connected)
    assert host.sensor.target == (0, "Test-STH", "08:6B:D7:01:DE:81", -52)


def test_a_sensor_that_stays_new_is_not_taken_and_named(start, listen):
    server = start()
    server.network.faults.newness = 10**6
    assert str(listen(server).lose()) == (
        "no sensor has told its name, its MAC address and its RSSI yet (in range: "
        '"Test-S" (00:00:00:00:00:00, number 0, 0 dBm))')


@pytest.mark.parametrize("seconds", [3.5, 12.5, 14.0, 19.5])
def test_a_connection_may_take_20_s(start, listen, monkeypatch, seconds):
    scale = 0.05  # everything is that much faster
    monkeypatch.setattr(connection, "CONNECT_RETRY", 3.0 * scale)
    monkeypatch.setattr(connection, "CONNECT_TIMEOUT", CONNECT_TIMEOUT * scale)
    server = start()
    server.network.faults.connect_time = seconds * scale
    host = listen(server, sensor_name="Test-STH")
    host.until(lambda: host.sensor.is_connected)
    assert host.heard.lost == []


@pytest.mark.parametrize("options", [{}, {"sensor_name": "Test-STH"}, {"sensor_number": 0}])
def test_a_connection_that_comes_after_the_time_out_is_kept(start, listen, monkeypatch, options):
    monkeypatch.setattr(connection, "CONNECT_TIMEOUT", 0.2)
    server = start()
    server.network.faults.connect_time = 1.0
    host = listen(server, **options)
    assert "does not connect" in str(host.lose())
    host.until(lambda: host.sensor.is_connected)
    host.stream()
    assert not any("connection" in text for text in host.heard.notes)


def test_a_greeting_that_fails_leaves_no_sensor_connected(start, listen, impatient):
    server = start()
    server.network.sensors[0].ignore.add((SYSTEM, 0x0B, 5))  # it does not even tell its name
    error = str(listen(server).lose())
    assert "STH 1 does not answer" in error
    assert server.network.stu.connected is None


def test_a_configuration_that_fails_leaves_no_sensor_connected(start, listen, impatient):
    server = start()
    simulated = server.network.sensors[0]
    host = listen(server, wanted={"adc.prescaler": 5})
    host.until(lambda: host.sensor.phase is Phase.CONNECTING)
    write = simulated._handlers[CONFIGURATION, 0x00]
    simulated._handlers[CONFIGURATION, 0x00] = lambda payload, now: (
        None if payload[0] & 0x80 else write(payload, now))
    assert "STH 1 does not answer" in str(host.lose())
    assert server.network.stu.connected is None


def test_a_connect_that_is_refused_is_asked_for_again(start, listen, monkeypatch):
    monkeypatch.setattr(connection, "CONNECT_RETRY", 0.2)
    server = start()
    server.network.faults.refused_connects = 3
    host = listen(server).find()
    assert server.network.faults.refused_connects == 0
    assert host.heard.lost == []


def test_a_sensor_that_never_connects_is_named(start, listen, monkeypatch):
    monkeypatch.setattr(connection, "CONNECT_RETRY", 0.1)
    monkeypatch.setattr(connection, "CONNECT_TIMEOUT", 0.5)
    server = start()
    server.network.faults.refused_connects = 10**6
    host = listen(server)
    error = str(host.lose())
    assert 'the sensor "Test-STH" (08:6B:D7:01:DE:81' in error
    assert "does not connect; bring it nearer, or check its battery" in error
    server.network.faults.refused_connects = 0
    host.find()


def test_a_silent_stationary_unit_is_told_once_and_waited_for(start, listen, impatient):
    server = start()
    server.network.faults.silent = True
    host = listen(server)
    error = host.lose()
    assert isinstance(error, NoAnswerError)
    assert str(error).startswith("STU 1 does not answer on socketcand can0")
    host.until(lambda: host.sensor.error is not error)
    server.network.faults.silent = False
    host.find()
    assert len(host.heard.lost) == 1


class Proxy:
    """Stands between host and server; what it drops, nobody is told."""

    def __init__(self, server):
        self._server = server
        self._socket = socket.create_server(("127.0.0.1", 0))
        self.host, self.port = self._socket.getsockname()
        self.connections = []
        self.dropped = set()
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self):
        with contextlib.suppress(OSError):
            while True:
                client, _ = self._socket.accept()
                server = socket.create_connection((self._server.host, self._server.port))
                number = len(self.connections)
                self.connections.append((client, server))
                for source, sink in (client, server), (server, client):
                    threading.Thread(target=self._pump, args=[number, source, sink],
                                     daemon=True).start()

    def _pump(self, number, source, sink):
        with contextlib.suppress(OSError):
            while data := source.recv(4096):
                if number not in self.dropped:
                    sink.sendall(data)
            sink.shutdown(socket.SHUT_WR)

    def close(self):
        self._socket.close()
        for client, server in self.connections:
            client.close()
            server.close()


def test_a_server_that_is_gone_unnoticed_is_connected_again(start, listen, impatient, monkeypatch):
    monkeypatch.setattr(can_line, "SILENCE", 0.5)
    proxy = Proxy(start())
    host = listen(proxy)
    host.stream()
    proxy.dropped.update(range(len(proxy.connections)))
    host.until(lambda: len(proxy.connections) > len(proxy.dropped))
    host.until(lambda: host.sensor.is_connected)
    host.stream()
    proxy.close()


def test_a_connection_that_an_ended_host_left_is_given_up_for_the_wanted_sensor(start, listen):
    server = start("Spindle", "Tool-7")
    ended = Host(server, sensor_name="Spindle").find()
    ended.stream()
    ended.bus.line.close()  # as when its process is killed
    host = listen(server, sensor_name="Tool-7").find()
    assert host.sensor.identity.name == "Tool-7"
    assert server.network.stu.connected is server.network.sensor("Tool-7")
    assert not server.network.sensor("Spindle").streams


def test_a_connection_that_an_ended_host_left_is_kept_where_it_is_the_wanted_one(start, listen):
    server = start("Spindle", "Tool-7")
    ended = Host(server, sensor_name="Spindle", channels="xyz").find()
    ended.stream()
    ended.bus.line.close()
    host = listen(server, sensor_name="Spindle").find()
    assert host.heard.notes[0] == "keeping a connection that was left over"
    assert_true(server.network.sensor("Spindle"), host.stream())


def test_a_connection_that_was_left_to_a_sensor_that_does_not_answer_is_released(
        start, listen, impatient):
    server = start()
    ended = Host(server).find()
    ended.bus.line.close()
    simulated = server.network.sensors[0]
    simulated.ignore.add((SYSTEM, 0x0B, 5))
    host = listen(server, sensor_name="Test-STH")
    host.until(lambda: server.network.stu.connected is None)
    simulated.ignore.clear()
    host.until(lambda: host.sensor.is_connected)
    assert "releasing a connection that was left over" in host.heard.notes


def test_a_connection_of_a_living_host_is_left_alone(start, listen):
    server = start()
    first = listen(server).find()
    first.sensor.options.status_period = 0.5  # it asks something every 50 ms
    first.stream()
    second = listen(server)
    thread = threading.Thread(target=first.until, args=(lambda: second.heard.lost,))
    thread.start()
    assert "another host on the bus works with this stationary unit" in str(second.lose())
    thread.join()
    first.more()
    assert first.heard.lost == []


@pytest.mark.parametrize(("size", "warnings"), [(4 << 20, 0), (212992, 1), (0, 0)])
def test_a_small_receive_buffer_of_the_kernel_is_told_once(start, listen, size, warnings):
    host = listen(start()).find()
    host.bus.line.interface = "socketcan"
    open_line = host.bus.line.open

    def open_with_size():
        open_line()
        host.bus.line.link.receive_buffer = size

    host.bus.line.open = open_with_size
    for _ in range(2):
        host.bus.close()
        host.bus.open()
    assert len([text for text in host.heard.warnings if "net.core.rmem_max" in text]) == warnings


def test_a_scan_lists_the_sensors_in_range(start, listen):
    server = start("Spindle", "Tool-7")
    server.network.sensor("Tool-7").rssi = -71
    host = listen(server, sensor_name="Chuck")
    host.lose()
    seen = host.bus.maintenance.scan()
    assert [(one.name, one.mac[-2:], one.number, one.rssi) for one in seen] == [
        ("Spindle", "81", 0, -52), ("Tool-7", "82", 1, -71)]


def test_a_scan_while_connected_shows_the_connected_one(connect):
    host, *_ = connect()
    assert [one.name for one in host.bus.maintenance.scan()] == ["Test-STH"]


# --- losing it ---------------------------------------------------------------------------------

def test_a_sensor_that_walks_away_while_it_streams_comes_back_and_streams(connect):
    host, _, simulated = connect()
    host.stream()
    simulated.in_range = False
    assert "the sensor was lost while it streamed" in str(host.lose())
    assert host.sensor.decoder is None
    simulated.in_range = True
    host.find()
    host.more()
    assert host.sensor.connections == 2


def test_a_sensor_that_walks_away_while_it_is_idle_is_noticed(connect, impatient):
    host, _, simulated = connect()
    simulated.in_range = False
    assert "disconnected" in str(host.lose())
    simulated.in_range = True
    host.find()


@pytest.mark.parametrize("streaming", [True, False])
def test_after_a_power_loss_the_settings_are_written_again(connect, impatient, streaming):
    host, network, simulated = connect(wanted={"adc.oversampling_rate": 256})
    host.bus.write(host.sensor, {"adc.prescaler": 4, "led": "disabled"})
    if streaming:
        host.stream()
    network.power_loss(simulated)
    assert simulated.adc == AdcConfiguration()
    host.find()
    assert (simulated.adc.prescaler, simulated.adc.oversampling_rate) == (4, 256)
    assert not simulated.led
    if streaming:
        host.more()


def test_after_a_power_loss_of_the_stationary_unit_the_sensor_comes_back(connect):
    host, network, _ = connect()
    host.stream()
    network.power_loss(network.stu)
    host.find()
    host.more()


def test_a_bus_that_falls_silent_while_streaming_is_noticed_and_waited_for(connect, impatient):
    host, network, _ = connect()
    host.stream()
    network.faults.silent = True
    assert "does not answer" in str(host.lose())
    network.faults.silent = False
    host.find()
    host.more()


def test_a_stream_that_ends_while_the_sensor_stays_is_started_again(connect):
    host, network, simulated = connect()
    host.stream()
    with network.lock:
        simulated.streams.clear()
    host.until(lambda: len(host.heard.streams) == 2)
    host.more()
    assert host.heard.warnings == ["the stream fell silent; starting it again"]
    assert (host.heard.lost, host.sensor.statistics.lost) == ([], 0)


def test_a_stream_that_could_not_be_started_is_started_later(connect):
    host, _, simulated = connect()
    simulated.refuse.add((STREAMING, 0x00))
    host.bus.set_active(True)
    assert str(host.lose()).startswith("STH 1 cannot start the stream: not available")
    simulated.refuse.clear()
    host.more()


def test_a_slow_stream_is_not_taken_for_silent(connect):
    host, _, _ = connect(sample_rate=6.0)  # a frame takes longer than any other may be silent
    host.stream(4)
    assert host.heard.warnings == []
    assert host.sensor.connections == 1


def test_a_stream_whose_restart_failed_is_started_later(connect, impatient):
    host, network, _ = connect()
    host.stream()
    network.faults.answer_loss = 1.0
    with pytest.raises(NoAnswerError):
        host.bus.acquisition.restart()
    network.faults.answer_loss = 0.0
    host.more()


def test_reconnecting_begins_with_a_new_search(connect):
    host, network, _ = connect()
    host.stream()
    host.bus.maintenance.reconnect()
    assert network.stu.connected is None
    assert host.sensor.phase is Phase.SEARCHING
    host.find()
    host.more()


@pytest.mark.parametrize("node", [STH_1, STU_1])
@pytest.mark.parametrize("options", [{}, {"sensor_name": "Test-STH"}])
def test_after_a_reset_the_sensor_comes_back_without_further_ado(connect, node, options):
    host, network, simulated = connect(**options)
    host.stream()
    host.bus.maintenance.reset(node)
    cycles = (simulated if node == STH_1 else network.stu).eeprom["Power On Cycles"]
    assert cycles == 2
    host.find()
    host.more()
    if node == STH_1:
        assert [str(error) for _, error in host.heard.lost] == ["reset, as asked for"]


def test_without_a_sensor_each_action_says_why(start, listen):
    server = start()
    server.network.sensors[0].in_range = False
    host = listen(server)
    host.lose()
    bus, maintenance = host.bus, host.bus.maintenance
    for action in (
            lambda: bus.write(bus.sensor, {"led": "disabled"}), maintenance.measure,
            maintenance.unsaved, maintenance.save,
            lambda: maintenance.read_eeprom(STH_1), lambda: maintenance.reset(STH_1),
            lambda: bus.set_enabled(bus.sensor, True),
            lambda: maintenance.execute(commands.READ_STATE.request(STH_1))):
        with pytest.raises(NoAnswerError, match="the sensor is not connected: no sensor is in"):
            action()


def test_before_the_bus_is_open_an_action_says_so(start):
    server = start()
    server.close()
    bus = make_bus(server, Recorder())
    with pytest.raises(LinkError, match="nothing listens there"):
        bus.open()
    with pytest.raises(NoAnswerError, match="nothing listens there"):
        bus.maintenance.measure()


# --- the thread of the bus ---------------------------------------------------------------------

class Service:
    """The bus in its own thread, as in a node."""

    def __init__(self, server, **options):
        self.heard = Recorder()
        self.states = []
        self.bus = make_bus(server, self.heard, **options)
        self.thread = DeviceThread("bus", self.bus, self.states.append)
        self.thread.start()

    def stream(self, frames=30):
        """Start the stream anew and wait for frames."""
        before = len(self.heard.streams)
        self.thread.post(lambda: self.bus.set_active(True))
        wait_until(lambda: len(self.heard.streams) > before
                   and len(self.heard.streams[-1].frames) >= frames)


@pytest.fixture
def serve():
    services = []

    def serve_one(server, **options):
        services.append(Service(server, **options))
        return services[-1]

    yield serve_one
    for service in services:
        service.thread.stop()


@pytest.mark.parametrize("streaming", [True, False])
def test_a_server_that_goes_and_comes_back_is_noticed_and_opened_again(start, serve, streaming):
    server = start()
    service = serve(server)
    wait_until(lambda: service.heard.found)
    if streaming:
        service.stream()
    server.close()
    wait_until(lambda: len(service.states) >= 2)
    again = SimulatedIcotronic(server.network, f"{server.host}:{server.port}", "").start()
    try:
        wait_until(lambda: len(service.heard.found) == 2)
        assert service.states[0] is service.states[-1] is None
        for error in service.states[1:-1]:
            assert isinstance(error, LinkError)
            assert "\n" not in str(error)
            assert "lost socketcand can0" in str(error) or "nothing listens there" in str(error)
        if streaming:
            wait_until(lambda: len(service.heard.streams) == 2
                       and len(service.heard.streams[1].frames) > 30)
    finally:
        service.thread.stop()
        again.close()


@needs_errors_of_socketcand
def test_bus_off_is_an_error_that_says_what_to_do_and_the_bus_is_opened_again(start, serve):
    server = start()
    service = serve(server)
    wait_until(lambda: service.heard.found)
    service.stream()
    server.network.send(CanFrame(0x40, b"", error=True))
    wait_until(lambda: len(service.heard.found) == 2)
    opened, error, reopened = service.states
    assert (opened, reopened) == (None, None)
    assert isinstance(error, LinkError)
    assert str(error).startswith("socketcand can0: it is bus-off; check wiring, termination")
    wait_until(lambda: len(service.heard.streams) == 2 and service.heard.streams[1].frames)


@pytest.mark.parametrize("state", ["searching", "connecting", "streaming"])
def test_the_thread_ends_soon_and_leaves_the_sensor_alone(start, serve, state):
    server = start()
    network = server.network
    network.sensors[0].in_range = state != "searching"
    network.faults.refused_connects = 10**6 if state == "connecting" else 0
    service = serve(server)
    if state == "streaming":
        service.stream()
    else:
        wait_until(lambda: service.bus.sensor.phase.value == state)
    service.thread.stop()
    assert network.stu.connected is None
    assert not network.sensors[0].streams
    assert not network.sensors[0].connected


def test_the_thread_ends_soon_although_nobody_answers(start, serve, impatient):
    server = start()
    service = serve(server)
    service.stream()
    server.network.faults.silent = True
    service.thread.stop()  # for ever, if it waited for an answer


def test_what_cannot_wait_ends_a_request_without_an_answer(start, serve, monkeypatch):
    attempts, attempt = threading.Semaphore(0), Line._attempt
    server = start()
    service = serve(server)
    service.stream()
    request = Line.request

    def ask_for_ever(line, asked, *_, **__):
        return request(line, asked, 0.02, 10**9)

    with monkeypatch.context() as patch:
        patch.setattr(Line, "request", ask_for_ever)
        patch.setattr(Line, "_attempt", lambda *args: attempts.release() or attempt(*args))
        server.network.faults.silent = True
        for _ in range(10):
            assert attempts.acquire(timeout=DEADLINE)
        assert service.thread.call(lambda: "done", DEADLINE, interrupt=True) == "done"
    server.network.faults.silent = False
    came = len(service.heard.streams[-1].frames)
    wait_until(lambda: len(service.heard.streams[-1].frames) > came + 30)
    assert service.states == [None]


def test_a_server_that_says_nothing_hangs_neither_the_start_nor_the_end(monkeypatch, serve):
    monkeypatch.setattr(can_link, "CONNECT_TIMEOUT", 0.2)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        host, port = listener.getsockname()
        service = serve(SimpleNamespace(host=host, port=port))
        wait_until(lambda: len(service.states) >= 2)
        assert {str(error) for error in service.states} == {
            f"cannot open socketcand can0 at {host}:{port}: no answer; check host and port in "
            "can_options"}
        service.thread.stop()


# --- the stream --------------------------------------------------------------------------------

@pytest.mark.parametrize("channels", ["x", "xyz"])
def test_every_sample_comes_with_its_value_and_its_time(connect, channels):
    host, network, simulated = connect(channels=channels)
    simulated.clock_error = 50e-6
    stream = host.stream(5000)
    numbers, stamps, values = stream.samples()
    assert (numbers == np.arange(len(numbers))).all()
    times, truth = true_values(simulated, stream, numbers)
    assert np.abs(values - truth).max() <= RAW_TOLERANCE
    late = times > times[0] + SETTLED
    assert np.abs(stamps - times)[late].min() < 1e-3  # all of them: test_sample_clock
    assert np.diff(stamps).min() > 0
    assert host.sensor.measured_rate == pytest.approx(RATE / len(channels), rel=0.02)
    assert host.sensor.statistics.lost == 0
    host.bus.set_active(False)
    assert host.sensor.statistics.frames == network.streamed == len(stream.frames)


@pytest.mark.parametrize("channels", ["y", "z", "xy", "xz", "yz"])
def test_any_channels_can_be_streamed(connect, channels):
    host, _, simulated = connect(channels=channels)
    stream = host.stream(400)
    assert stream.data_sets == (3 if len(channels) == 1 else 1)
    assert host.sensor.sample_rate == pytest.approx(RATE / len(channels))
    assert_true(simulated, stream)


BAD_RADIO = {
    "single frames": {"loss": 0.02},
    "runs": {"loss": 0.003, "loss_run": 40},
    "nearly a turn of the counter": {"loss": 0.001, "loss_run": 240},
    "duplicates": {"duplicate": 0.05},
    "jitter": {"jitter": 0.01},
    "bursts": {"burst": 0.03},
    "everything": {"loss": 0.01, "loss_run": 3, "duplicate": 0.03, "jitter": 0.004,
                   "burst": 0.008},
}


@pytest.mark.parametrize("faults", BAD_RADIO.values(), ids=BAD_RADIO)
def test_what_a_bad_radio_loses_is_counted_and_what_arrives_is_true(connect, faults):
    host, network, simulated = connect()
    host.stream(200)
    for name, value in faults.items():
        setattr(network.faults, name, value)
    host.more(1000)
    host.until(lambda: network.lost or "loss" not in faults)
    for name in faults:
        setattr(network.faults, name, getattr(stu.Faults(), name))
    stream = host.more(200)
    assert_true(simulated, stream)
    host.bus.set_active(False)
    counts = host.sensor.statistics
    assert counts.lost == network.lost
    assert counts.frames + counts.duplicates == network.streamed
    assert counts.frames == len(stream.frames)
    assert (counts.duplicates > 0) == ("duplicate" in faults)
    assert (counts.lost > 0) == ("loss" in faults)


@pytest.mark.parametrize("faults", [{"swap": 0.02}, {"damage": 0.02},
                                    {"swap": 0.02, "damage": 0.02, "duplicate": 0.02}])
def test_frames_that_come_twice_in_the_wrong_order_or_damaged_have_rising_stamps(connect, faults):
    host, network, simulated = connect()
    host.stream(200)
    for name, value in faults.items():
        setattr(network.faults, name, value)
    stream = host.more(2000)
    for name in faults:
        setattr(network.faults, name, 0.0)
    host.more(200)
    numbers, stamps, _ = stream.samples()
    assert np.diff(stamps).min() > 0
    assert np.diff(numbers).min() > 0
    if len(faults) == 1:
        assert_true(simulated, stream)
    host.bus.set_active(False)
    counts = host.sensor.statistics
    assert counts.frames + counts.duplicates + counts.damaged == network.streamed
    assert counts.damaged <= network.damaged + network.streamed * 0.01
    if "damage" not in faults:
        assert (counts.lost, counts.damaged) == (0, 0)


def test_the_times_behind_a_gap_are_true(connect):
    host, network, simulated = connect(channels="xyz")
    host.stream(round(SETTLED * RATE / 3))
    network.faults.loss, network.faults.loss_run = 0.02, 100
    host.more(500)
    network.faults.loss = 0.0
    stream = host.more(300)
    numbers, stamps, _ = stream.samples()
    times, _ = true_values(simulated, stream, numbers)
    behind = np.flatnonzero(np.diff(numbers) > 1) + 1
    assert len(behind)
    assert np.abs(stamps - times)[behind].min() < 2e-3  # lost frames shift by 0.3 ms each
    assert np.diff(stamps).min() > 0


def test_losses_are_told_once_and_counted_on(connect):
    host, network, _ = connect()
    host.stream()
    network.faults.loss = 0.05
    host.more(600)
    (warning,) = host.heard.warnings
    assert "were lost on the radio; more are counted in the diagnostics only" in warning
    assert host.sensor.statistics.lost > 3


def test_frames_lost_while_the_sensor_was_away_for_a_moment_are_counted(connect, monkeypatch):
    monkeypatch.setattr(acquisition, "SILENCE", 5.0)
    monkeypatch.setattr(stu, "SUPERVISION_TIME", 5.0)
    host, network, simulated = connect()
    host.stream(300)
    away = time.monotonic() + 0.4  # several turns of the counter, and no broken connection yet
    simulated.in_range = False
    host.until(lambda: time.monotonic() > away)
    simulated.in_range = True
    stream = host.more(300)
    assert_true(simulated, stream)
    host.bus.set_active(False)
    assert host.sensor.statistics.lost == network.lost > 800
    assert host.heard.lost == []


def test_frames_that_waited_for_a_busy_host_are_not_taken_for_lost(connect):
    host, network, simulated = connect()
    host.stream(300)
    time.sleep(0.4)  # the frames of this time wait in the kernel
    stream = host.more(2000)
    assert_true(simulated, stream)
    host.bus.set_active(False)
    assert (host.sensor.statistics.lost, network.lost) == (0, 0)
    assert host.sensor.statistics.frames == network.streamed


def test_reading_this_and_that_loses_no_frame_of_the_stream(connect):
    host, network, simulated = connect(status_period=0.5)
    simulated.battery, simulated.temperature, simulated.rssi = 3.4, -12.5, -66
    host.stream()
    host.until(lambda: all(len(host.heard.readings.get(name, ())) >= 2
                           for name in vars(host.sensor.readings)))
    host.bus.set_active(False)
    assert host.sensor.statistics.lost == 0
    assert host.sensor.statistics.frames == network.streamed
    readings = host.sensor.readings
    assert readings.battery_voltage == pytest.approx(3.4, abs=0.001)
    assert (readings.temperature, readings.rssi) == (-12.5, -66)
    assert readings.sth_status.state is NetworkState.OPERATING
    assert readings.stu_status.radio_connected
    assert readings.power_cycles == (1, 0)


# --- what a unit does not have -----------------------------------------------------------------

@pytest.mark.parametrize(("silent_on", "offered", "missing"), [
    ("unused", {"name", "adc", "used_sensor", "reduced_energy", "lowest_energy"},
     ["calibration", "led", "gtin", "power cycles", "production date of the stationary unit"]),
    ("optional", {"name"},
     ["adc", "used_sensor", "calibration", "reduced_energy", "led", "firmware", "battery voltage",
      "temperature", "stu status"])])
def test_a_unit_that_is_silent_on_what_is_optional_is_used(
        start, listen, monkeypatch, silent_on, offered, missing):
    waited, asked = [], []
    attempt = Line._attempt

    def noted(line, request, timeout):
        asked.append((request.frame.identifier.receiver, request.name))
        try:
            return attempt(line, request, timeout)
        except NoAnswerError:
            waited.append(timeout)
            raise

    monkeypatch.setattr(Line, "_attempt", noted)
    server = start()
    server.network.stay_silent(silent_on)
    host = listen(server, status_period=0.5)
    host.bus.set_active(True)
    host.find()
    assert 0.4 < sum(waited) < 0.8  # s
    assert {name.partition(".")[0] for name in host.sensor.settings} == offered
    (note,) = [text for text in host.heard.notes if text.startswith("not offered")]
    assert note.startswith("not offered, because there is no answer: ")
    assert set(missing) < set(note.partition(": ")[2].split(", "))
    asked.clear()
    assert_true(server.network.sensors[0], host.more(2500))
    if silent_on == "optional":
        assert {name for _, name in asked} == {"read the RSSI"}
    assert host.heard.lost == []
    server.network.stay_silent("nothing")
    host.bus.maintenance.reconnect()
    host.find()
    assert host.sensor.settings.keys() == SETTINGS.keys()
    assert host.heard.notes.count(note) == 1


def test_a_request_is_made_as_often_as_the_vendors_client_makes_it(connect, monkeypatch):
    host, network, _ = connect()
    lost = iter([True] * 9)
    ask = network._ask
    monkeypatch.setattr(network, "_ask", lambda *args: next(lost, False) or ask(*args))
    assert host.bus.line.request(commands.READ_LED.request(STH_1), 0.03)
    assert next(lost, None) is None


def test_an_answer_that_waited_for_a_busy_host_counts(connect, monkeypatch):
    host, *_ = connect()
    send = host.bus.line.link.send

    def send_and_sleep(*frame):
        send(*frame)
        time.sleep(0.2)  # another process has the processor

    monkeypatch.setattr(host.bus.line.link, "send", send_and_sleep)
    assert host.bus.line.request(commands.READ_LED.request(STH_1), 0.05, attempts=1)


@pytest.mark.parametrize(("mode", "wanted", "prescaler", "differing"), [
    ("push", {"adc.prescaler": 2}, 2, {}), ("push", {}, 5, {}),
    ("leave", {"adc.prescaler": 2}, 5, {}),
    ("check", {"adc.prescaler": 2}, 5, {"adc.prescaler": (2, 5)})])
def test_adc_settings_that_something_else_changed_are_noticed_by_the_pace(
        connect, monkeypatch, mode, wanted, prescaler, differing):
    monkeypatch.setattr(acquisition, "RATE_TIME", 0.3)
    host, network, simulated = connect(wanted=wanted, config_mode=mode)
    host.stream()
    with network.lock:
        simulated._adc_command(bytes.fromhex("80 05 04 06 42"), time.monotonic())
    host.until(lambda: len(host.heard.streams) == 2)
    assert simulated.adc.prescaler == host.sensor.adc.prescaler == prescaler
    assert host.sensor.differing == differing
    assert host.heard.warnings[0] == (
        "something else changed the ADC settings; starting the stream again")
    stream = host.more(300)
    assert_true(simulated, stream)


def test_a_pace_that_the_adc_settings_do_not_explain_is_told_once(connect, monkeypatch):
    monkeypatch.setattr(acquisition, "RATE_TIME", 0.2)
    host, _, simulated = connect()
    simulated.clock_error = -0.4
    host.stream()
    host.until(lambda: host.heard.warnings)
    host.more(1500)
    (warning,) = [text for text in host.heard.warnings if "ADC" in text]
    assert "samples per second, not at 9524 as its ADC settings say" in warning
    assert len(host.heard.streams) == 1


def test_nothing_is_read_while_streaming_where_that_is_wanted(connect, monkeypatch):
    host, network, _ = connect(status_period=0.0)
    host.stream()
    asked = []
    monkeypatch.setattr(network, "_ask", lambda *args: asked.append(args))
    host.more(2000)
    assert asked == []


def test_a_reading_that_the_firmware_lacks_is_left_out(start, listen):
    server = start()
    server.network.sensors[0].refuse.add((STREAMING, 0x20))
    host = listen(server, status_period=0.5).find()
    host.stream()
    host.until(lambda: len(host.heard.readings.get("temperature", ())) >= 2)
    assert "battery_voltage" not in host.heard.readings
    assert host.sensor.readings.battery_voltage is None
    assert host.heard.lost == []


def test_the_stream_ends_at_the_sensor_when_the_host_is_not_active_any_more(connect):
    host, network, simulated = connect()
    host.stream()
    host.bus.set_active(False)
    assert not simulated.streams
    assert network.stu.connected is simulated
    host.stream()
    assert simulated.streams


def test_the_acquisition_can_be_stopped_and_started(connect):
    host, _, simulated = connect()
    host.stream()
    host.bus.set_enabled(host.sensor, False)
    assert not simulated.streams
    host.bus.set_enabled(host.sensor, True)
    host.more()


def test_the_acquisition_cannot_be_started_where_nobody_listens(connect):
    host, _, simulated = connect()
    with pytest.raises(SettingError, match="activate it first"):
        host.bus.set_enabled(host.sensor, True)
    assert not simulated.streams


def test_a_stream_with_other_channels_begins_anew(connect):
    host, _, simulated = connect(channels="x")
    host.stream()
    host.sensor.options.channels = "yz"
    host.bus.acquisition.restart()
    stream = host.more(300)
    assert stream.channels == "yz"
    assert [channel.name for channel in host.sensor.channels] == ["y", "z"]
    assert_true(simulated, stream)
    assert host.sensor.statistics.lost == 0


def test_frames_still_on_their_way_are_not_taken_for_the_next_stream(connect):
    host, network, _ = connect()
    network.faults.jitter = 0.05
    host.stream(100)
    for _ in range(3):
        host.bus.acquisition.restart()
        host.more(100)
    assert (host.sensor.statistics.lost, network.lost) == (0, 0)
    host.bus.set_active(False)
    assert host.sensor.statistics.frames == network.streamed


# --- what else is on the bus -------------------------------------------------------------------

@pytest.fixture
def other_client():
    """Connect another program to a network."""
    buses = []

    def connect_one(server):
        buses.append(can.Bus(interface="socketcand", channel="can0", host=server.host,
                             port=server.port, ignore_config=True))
        buses[-1].send(can.Message(arbitration_id=0x7FF, is_extended_id=False))  # I am listening
        return buses[-1]

    yield connect_one
    for bus in buses:
        bus.shutdown()


def test_foreign_frames_are_counted_and_harm_nothing(connect):
    host, network, simulated = connect()
    network.faults.foreign = 400.0
    host.bus.write(host.sensor, {"adc.prescaler": 3})
    stream = host.stream(1500)
    network.faults.foreign = 0.0
    assert_true(simulated, stream)
    assert host.bus.line.counts.foreign > 50
    assert (host.sensor.statistics.lost, host.sensor.statistics.damaged) == (0, 0)
    assert host.bus.line.counts.other_host == 0


def test_the_identifier_of_the_stream_in_a_standard_frame_is_foreign(connect):
    host, network, _ = connect()
    host.stream()
    before = host.bus.line.counts.foreign
    network.send(CanFrame(STREAM_ID & 0x7FF, bytes(8), extended=False))
    host.until(lambda: host.bus.line.counts.foreign == before + 1)
    assert host.sensor.statistics.damaged == 0


def test_a_second_host_with_our_number_is_counted(start, listen, other_client):
    server = start()
    host = listen(server).find()
    host.stream()
    other = other_client(server)
    request = commands.READ_RSSI.request(STU_1, commands.SELF)
    other.send(can.Message(arbitration_id=request.frame.identifier.encode(),
                           data=request.frame.data, is_extended_id=True))
    host.until(lambda: host.bus.line.counts.other_host == 1)
    host.until(lambda: host.bus.line.counts.stale >= 1)  # the answer to what we did not ask
    assert host.sensor.statistics.lost == 0


@pytest.mark.parametrize("data", ["A2 00", "A2 00 01 02 03 04 05", ""])
def test_a_data_frame_of_wrong_length_is_dropped_and_counted(connect, data):
    host, network, simulated = connect()
    host.stream()
    network.send(CanFrame(STREAM_ID, bytes.fromhex(data)))
    host.until(lambda: host.sensor.statistics.damaged == 1)
    stream = host.more(50)
    assert f"data frame of {len(bytes.fromhex(data))} bytes instead of 8" in (
        host.sensor.statistics.fault)
    assert host.sensor.statistics.lost == 0
    assert_true(simulated, stream)


def test_an_answer_of_wrong_length_is_an_error_that_shows_it(connect, monkeypatch):
    host, _, simulated = connect()
    monkeypatch.setitem(simulated._handlers, (CONFIGURATION, 0x00),
                        lambda payload, now: bytes.fromhex("00 02 05"))
    with pytest.raises(FrameError, match="read the ADC configuration: answer carries 3"):
        host.bus.maintenance.execute(commands.READ_ADC.request(STH_1))


@pytest.mark.parametrize("answer", ["", "02", "02 00 78 79 7A"])
def test_a_wrong_number_of_sensors_does_not_end_the_search(
        start, listen, impatient, monkeypatch, answer):
    server = start()
    stu = server.network.stu
    with monkeypatch.context() as patch:
        patch.setitem(stu._handlers, (SYSTEM, 0x0B),
                      lambda payload, now: bytes.fromhex(answer))
        host = listen(server)
        error = str(host.lose())
        assert "does not answer" in error or "answer carries" in error
    host.find()


@needs_errors_of_socketcand
def test_error_frames_are_counted(connect):
    host, network, _ = connect()
    host.stream()
    network.send(CanFrame(0x04, b"", error=True))
    host.until(lambda: host.bus.line.counts.errors == 1)
    assert host.heard.lost == []


def test_answers_that_are_lost_on_the_radio_are_asked_for_again(connect):
    host, network, simulated = connect()
    network.faults.answer_loss = 0.1
    host.bus.write(host.sensor, {"adc.prescaler": 7, "led": "disabled"})
    network.faults.answer_loss = 0.0
    assert (simulated.adc.prescaler, simulated.led) == (7, False)


@pytest.mark.parametrize(("number", "words"), [
    (1, "not available"), (2, "general error"), (3, "write not allowed"),
    (4, "unsupported format"), (5, "wrong key or magic number"), (200, "unknown error 200")])
def test_an_error_acknowledgement_is_told_in_words(connect, monkeypatch, number, words):
    host, _, simulated = connect()

    def refuse_to_write(payload, now):
        if payload[0] & 0x80:
            raise unit.Refusal(number)
        return simulated._adc_command(payload, now)

    monkeypatch.setitem(simulated._handlers, (CONFIGURATION, 0x00), refuse_to_write)
    with pytest.raises(RefusedError, match="adc.prescaler = 3: STH 1 cannot write the ADC "
                                           rf"configuration: {words} \(error {number:02X} 00"):
        host.bus.write(host.sensor, {"adc.prescaler": 3})


# --- settings ----------------------------------------------------------------------------------

def both_ends(name):
    """Return the smallest and the largest value of a setting."""
    setting = SETTINGS[name]
    if name == "name":
        return ["", "Häuptli"]
    if name.startswith("used_sensor."):
        return [10, 1]
    if setting.choices:
        return list(setting.choices)
    low, high = setting.limits
    return [-1.5e6, 2.5e-7] if low is None else [low, high]


def test_every_setting_takes_both_ends_of_its_range_and_nothing_else_changes(connect):
    host, _, _ = connect()
    for name in SETTINGS:
        before = dict(host.sensor.values)
        for value in both_ends(name):
            assert host.bus.write(host.sensor, {name: value}) == {name: value}
            host.sensor.read_all(Access(host.bus.line), SETTINGS, host.bus._note)
            assert host.sensor.values == before | {name: value}


def test_a_value_is_rounded_to_what_the_sensor_can_hold(connect):
    host, _, simulated = connect()
    assert host.bus.write(host.sensor, {"reduced_energy.advertisement_time": 1.0003}) == {
        "reduced_energy.advertisement_time": 1.0}
    assert simulated.eeprom["Advertisement Time 1"] == 1.0


@pytest.mark.parametrize(("name", "value", "words"), [
    ("adc.prescaler", 0, "adc.prescaler = 0 is out of range, allowed is 1 … 127"),
    ("adc.acquisition_time", 5, "lies between two steps, the nearest are 4 cycles and 8 cycles"),
    ("adc.oversampling_rate", 8192, "out of range"),
    ("adc.reference_voltage", 3.0, "must be one of 1.25 V, 1.65 V"),
    ("used_sensor.x", 0, "out of range"), ("led", "blue", "must be one of enabled, disabled"),
    ("name", "much too long", "at most 8 bytes in UTF-8"), ("name", "a\0b", "no zero"),
    ("calibration.acceleration_x.slope", math.nan, "finite"),
    ("reduced_energy.sleep_time", 0.0, "out of range"), ("speed", 1, 'no setting "speed"')])
def test_what_is_wrong_is_not_sent(connect, name, value, words):
    host, _, simulated = connect()
    before = simulated.eeprom.writes, simulated.adc
    with pytest.raises(SettingError) as caught:
        host.bus.write(host.sensor, {"adc.prescaler": 9, name: value})
    assert words in str(caught.value)
    assert (simulated.eeprom.writes, simulated.adc) == before


def test_several_settings_are_written_all_or_none(connect):
    host, _, simulated = connect()
    with pytest.raises(RefusedError, match=r"used_sensor.y = 11: STH 1 cannot .* not available"):
        host.bus.write(host.sensor, {"adc.prescaler": 9, "led": "disabled", "used_sensor.y": 11})
    assert simulated.adc == AdcConfiguration()
    assert simulated.used_sensors == (1, 2, 3)
    assert simulated.led
    assert host.sensor.values["adc.prescaler"] == 2


def test_a_new_adc_configuration_restarts_the_stream_at_its_rate(connect):
    host, _, simulated = connect()
    host.stream(100)
    host.bus.write(host.sensor, {"adc.prescaler": 5})
    stream = host.more(300)
    assert len(host.heard.streams) == 2
    assert host.sensor.sample_rate == pytest.approx(RATE / 2)
    _, stamps, _ = stream.samples()
    assert np.median(np.diff(stamps)) == pytest.approx(2 / RATE, rel=0.01)
    assert_true(simulated, stream)
    assert host.sensor.statistics.lost == 0


def test_after_a_refusal_the_stream_runs_again(connect):
    host, *_ = connect()
    host.stream()
    with pytest.raises(RefusedError):
        host.bus.write(host.sensor, {"used_sensor.x": 11})
    host.more()
    assert host.heard.lost == []


def test_a_setting_that_does_not_need_it_leaves_the_stream_running(connect):
    host, network, simulated = connect()
    host.stream()
    host.bus.write(host.sensor, {"led": "disabled", "reduced_energy.sleep_time": 600.0})
    stream = host.more()
    assert host.heard.streams == [stream]
    assert not simulated.led
    host.bus.set_active(False)
    assert host.sensor.statistics.frames == network.streamed


def test_other_sensors_on_the_channels_are_measured(connect):
    host, _, simulated = connect(channels="x")
    host.bus.write(host.sensor, {"used_sensor.x": 3, "used_sensor.z": 5})
    stream = host.stream(200)
    assert simulated.used_sensors == (3, 2, 5)
    assert_true(simulated, stream)


def test_wanted_settings_are_written_and_told(connect):
    host, _, simulated = connect(wanted={"adc.prescaler": 5, "led": "disabled",
                                         "adc.acquisition_time": 8})
    assert (simulated.adc.prescaler, simulated.led) == (5, False)
    assert host.heard.notes[0] == "wrote adc.prescaler: 2 → 5, led: enabled → disabled"
    assert host.sensor.differing == {}


@pytest.mark.parametrize(("mode", "differing"), [
    ("check", {"adc.prescaler": (5, 2)}), ("leave", {})])
def test_settings_are_left_as_they_are_where_that_is_wanted(connect, mode, differing):
    host, _, simulated = connect(wanted={"adc.prescaler": 5, "led": "enabled"}, config_mode=mode)
    assert simulated.adc.prescaler == 2
    assert host.sensor.differing == differing
    assert host.heard.warnings == (
        ["adc.prescaler is 2, not 5 as wanted"] if differing else [])


def test_of_wanted_settings_the_possible_ones_are_written(connect):
    host, _, simulated = connect(wanted={"adc.prescaler": 5, "used_sensor.x": 11})
    assert simulated.adc.prescaler == 5
    assert host.sensor.differing == {"used_sensor.x": (11, 1)}
    assert any("used_sensor.x = 11: STH 1 cannot" in text for text in host.heard.warnings)


@pytest.mark.parametrize(("channels", "wanted", "total"), [("x", 1000.0, 1000.0),
                                                           ("xyz", 1000.0, 3000.0)])
def test_a_sample_rate_becomes_the_nearest_adc_configuration(connect, channels, wanted, total):
    host, _, simulated = connect(channels=channels, sample_rate=wanted)
    assert simulated.adc.sample_rate == pytest.approx(total, rel=0.01)
    assert host.sensor.sample_rate == pytest.approx(wanted, rel=0.01)
    assert any(text.startswith("sample_rate 1000/s: nearest is ") and "prescaler" in text
               for text in host.heard.notes)
    assert_true(simulated, host.stream(100))


def test_a_new_sample_rate_takes_effect_while_streaming(connect):
    host, _, simulated = connect()
    host.stream()
    host.sensor.options.sample_rate = 500.0
    host.bus.acquisition.restart()
    host.more(50)
    assert simulated.adc.sample_rate == pytest.approx(500.0, rel=0.01)
    assert host.heard.values[-1]["adc.prescaler"] == simulated.adc.prescaler


def test_a_firmware_that_lacks_a_setting_is_told(start, listen):
    server = start()
    server.network.sensors[0].refuse.add((CONFIGURATION, 0xC0))
    host = listen(server).find()
    assert "not offered, because there is no answer: led" in host.heard.notes
    assert "led" not in host.sensor.settings
    host.stream()


def test_a_new_name_is_followed(connect):
    host, _, simulated = connect(sensor_name="Test-STH")
    host.bus.write(host.sensor, {"name": "Spindle"})
    assert simulated.name == "Spindle"
    host.bus.maintenance.reconnect()
    host.find()
    assert host.sensor.identity.name == "Spindle"


# --- what the numbers mean (field note N7) -----------------------------------------------------

G = STANDARD_GRAVITY


def set_calibration(simulated, slope, offset, axis="X"):
    simulated.eeprom[f"Acceleration {axis}: Slope"] = slope
    simulated.eeprom[f"Acceleration {axis}: Offset"] = offset


def laws(**channels):
    """Return options in which some channels have another sensor or law than by their number."""
    options = {axis: ChannelOptions() for axis in "xyz"}
    return {"laws": options | {axis: one if isinstance(one, ChannelOptions) else ChannelOptions(one)
                               for axis, one in channels.items()}}


def value_of(channel, volts, reference):
    """Return what a channel makes of a voltage at the ADC."""
    return channel.slope * round(volts / reference * 65535) + channel.offset


@pytest.mark.parametrize("reference", [3.3, 1.8, 5.0])
@pytest.mark.parametrize(("number", "points", "unit"), [
    (1, {1.65: 0.0, 2.97: 100 * G, 0.33: -100 * G}, "m/s²"),
    (2, {0.9: 0.0, 1.7: 40 * G}, "m/s²"), (3, {0.9: 0.0, 0.1: -40 * G}, "m/s²"),
    (4, {0.9: 0.0, 1.7: 40 * G}, "m/s²"), (5, {0.772: -40.0, 1.267: 125.0}, "°C"),
    (6, {0.0: 0.0, 3.3: 1.0}, ""), (7, {1.65: 0.5}, ""), (8, {1.65: 0.5}, ""),
    (9, {1.65: 0.5}, ""), (10, {0.509: 2.9, 0.737: 4.2}, "V")])
def test_a_channel_means_what_its_sensor_measures(start, listen, reference, number, points, unit):
    host = listen(start(), wanted={
        "adc.reference_voltage": reference, "used_sensor.x": number}).find()
    (channel,) = host.sensor.channels
    assert channel.unit == unit
    assert channel.source.startswith(f"sensor number {number} (")
    step = abs(channel.slope)
    for volts, value in points.items():
        if volts <= reference:
            assert value_of(channel, volts, reference) == pytest.approx(value, abs=step)
    assert host.heard.warnings == []


@pytest.mark.parametrize(("name", "limit"), [("rotation_78480", 78480.0),
                                             ("rotation_61698", 61698.113)])
def test_a_head_that_is_named_has_its_own_law(start, listen, name, limit):
    host = listen(start(), channels="xy", **laws(y=name)).find()
    x, y = host.sensor.channels
    assert (x.unit, y.unit, y.source) == ("m/s²", "rad/s²", f"its sensor {name}")
    assert value_of(y, 2.97, 3.3) == pytest.approx(limit, abs=y.slope)
    assert value_of(y, 1.65, 3.3) == pytest.approx(0.0, abs=y.slope)


def test_a_channel_can_have_a_law_of_its_own(start, listen):
    law = ChannelOptions("linear", Law((0.5, 2.5), (0.0, 20.0), "bar"))
    host = listen(start(), **laws(x=law)).find()
    (channel,) = host.sensor.channels
    assert (channel.unit, str(channel)) == ("bar", "x: 0.5 … 2.5 V = 0 … 20 bar, by its volts and "
                                                   "values")
    assert value_of(channel, 1.5, 3.3) == pytest.approx(10.0, abs=channel.slope)


@pytest.mark.parametrize(("volts", "values"), [
    ((1.0, 1.0), (0.0, 1.0)), ((0.0, 1.0), (2.0, 2.0)), ((0.0, math.nan), (0.0, 1.0)),
    ((0.0,), (0.0, 1.0))])
def test_what_is_no_law_is_refused(volts, values):
    with pytest.raises(SettingError, match="a law needs"):
        Law(volts, values, "g")


def test_the_law_of_each_channel_is_told(connect):
    host, *_ = connect(channels="xy")
    assert host.heard.notes == [
        "channels x: 0.33 … 2.97 V = -100 … 100 g, by sensor number 1 (ADXL1001, x); "
        "y: 0.1 … 1.7 V = -40 … 40 g, by sensor number 2 (ADXL358C, y)"]


@pytest.mark.parametrize("number", [1, 2, 3, 4, 5, 6, 7, 8, 9, 10])
def test_every_sensor_measures_the_truth(connect, number):
    host, _, simulated = connect(wanted={"used_sensor.x": number})
    simulated.vibration = scene.rest
    simulated.temperature, simulated.light, simulated.battery = 31.0, 0.6, 3.9
    simulated.backpacks = (0.1, 0.2, 0.9)
    truth = {1: 0.0, 2: 0.0, 3: G, 4: 0.0, 5: 31.0, 6: 0.6, 7: 0.1, 8: 0.2, 9: 0.9, 10: 3.9}
    _, _, values = host.stream(100).samples()
    (channel,) = host.sensor.channels
    measured = channel.slope * values[-1, 0] + channel.offset
    assert measured == pytest.approx(truth[number], abs=abs(channel.slope))


def test_another_sensor_changes_the_law_while_streaming(connect):
    host, *_ = connect()
    host.stream()
    host.bus.write(host.sensor, {"used_sensor.x": 5})
    host.more()
    assert len(host.heard.streams) == 2
    assert host.sensor.channels[0].unit == "°C"


def test_a_sensor_of_an_unknown_number_gives_its_voltage(start, listen):
    server = start()
    server.network.sensors[0].used_sensors = (77, 2, 3)
    host = listen(server).find()
    (channel,) = host.sensor.channels
    assert (channel.unit, value_of(channel, 1.65, 3.3)) == ("V", pytest.approx(1.65, abs=1e-4))
    assert host.heard.warnings == ["channel x: what sensor number 77 measures is not known; set "
                                   "channel.x.sensor; using its voltage alone"]


@pytest.mark.parametrize("reference", [3.3, 1.8])
@pytest.mark.parametrize("commands_known", [True, False])
def test_the_factors_of_the_device_are_used_where_that_is_wanted(
        start, listen, reference, commands_known):
    server = start()
    simulated = server.network.sensors[0]
    set_calibration(simulated, 400 / 65535, -190.0)
    if not commands_known:
        simulated.ignore |= {(CONFIGURATION, 0x60), (CONFIGURATION, 0x61)}
    host = listen(server, wanted={"adc.reference_voltage": reference}, **laws(x="device")).find()
    (channel,) = host.sensor.channels
    assert channel.source == ("the device's factors" if commands_known else "the device's EEPROM")
    assert value_of(channel, 1.65, reference) == pytest.approx(10.0 * G, abs=channel.slope)
    assert host.heard.warnings == []


@pytest.mark.parametrize(("slope", "offset", "words"), [
    (0.0, 0.0, "the slope is zero"), (math.nan, -100.0, "are not numbers"),
    (0.003, math.inf, "are not numbers"), (1e6, -100.0, "g is absurd"),
    (1e-9, 0.0, "g is absurd"), (0.003, 50.0, "zero g is not within the span")])
def test_implausible_factors_are_replaced_by_what_the_sensor_is(
        start, listen, slope, offset, words):
    server = start()
    set_calibration(server.network.sensors[0], slope, offset)
    host = listen(server, **laws(x="device")).find()
    (channel,) = host.sensor.channels
    assert channel.law == Law((0.33, 2.97), (-100, 100), "g")
    (warning,) = host.heard.warnings
    assert warning.startswith("channel x: no plausible calibration (the device's factors: ")
    assert words in warning
    assert warning.endswith("using sensor number 1 (ADXL1001, x)")
    host.stream()


def test_a_calibration_that_is_written_while_streaming_is_used(connect):
    host, *_ = connect(**laws(x="device"))
    host.stream()
    host.bus.write(host.sensor, {"calibration.acceleration_x.slope": 0.005,
                                 "calibration.acceleration_x.offset": -150.0})
    host.more()
    assert len(host.heard.streams) == 2
    assert host.sensor.channels[0].slope == pytest.approx(0.005 * STANDARD_GRAVITY)


# --- EEPROM ------------------------------------------------------------------------------------

def test_the_whole_eeprom_can_be_read(connect):
    host, network, simulated = connect()
    host.stream()
    fields = host.bus.maintenance.read_eeprom(STH_1)
    assert {field.name: value for field, value in fields.items()} == {
        name: simulated.eeprom[name] for name in STH_EEPROM}
    fields = host.bus.maintenance.read_eeprom(STU_1)
    assert {field.name: value for field, value in fields.items()} == {
        name: network.stu.eeprom[name] for name in STU_EEPROM}
    assert host.sensor.statistics.lost == 0


def test_the_eeprom_of_the_stationary_unit_can_be_read_without_a_sensor(start, listen):
    server = start()
    server.network.sensors[0].in_range = False
    host = listen(server)
    host.lose()
    assert host.bus.maintenance.read_eeprom(STU_1)[STU_EEPROM["STU Name"]] == "Valerie"


def test_an_eeprom_that_is_not_initialised_is_told(start, listen):
    server = start()
    server.network.sensors[0].eeprom["EEPROM Status"] = 0x17
    host = listen(server).find()
    assert host.heard.warnings == [
        "the sensor's EEPROM is not initialised (0x17): at its next reset it takes default values"]


def change_what_the_eeprom_does_not_take(host, simulated):
    """Change three settings, as with a firmware that keeps them in its RAM only."""
    host.bus.write(host.sensor, {
        "reduced_energy.sleep_time": 120.0, "calibration.acceleration_y.slope": 0.25,
        "calibration.acceleration_y.offset": -3.0})
    simulated.eeprom["Sleep Time 1"] = 77.0
    set_calibration(simulated, 0.5, -7.0, "Y")


def test_a_preview_shows_what_a_save_would_change_and_changes_nothing(connect):
    host, _, simulated = connect()
    assert host.bus.maintenance.unsaved() == {}
    change_what_the_eeprom_does_not_take(host, simulated)
    writes = simulated.eeprom.writes
    changes = host.bus.maintenance.unsaved()
    assert {field.name for field in changes} == {
        "Sleep Time 1", "Acceleration Y: Slope", "Acceleration Y: Offset"}
    assert changes[STH_EEPROM["Sleep Time 1"]] == (77.0, 120.0)
    assert simulated.eeprom.writes == writes


def test_only_what_differs_is_saved_and_it_survives_a_reset(connect):
    host, _, simulated = connect()
    change_what_the_eeprom_does_not_take(host, simulated)
    writes = simulated.eeprom.writes
    assert len(host.bus.maintenance.save()) == 3
    assert simulated.eeprom.writes == writes + 3
    assert host.bus.maintenance.save() == {}
    assert simulated.eeprom.writes == writes + 3
    host.bus.maintenance.reset(STH_1)
    host.find()
    assert simulated.eeprom["Sleep Time 1"] == 120.0
    assert host.sensor.values["reduced_energy.sleep_time"] == 120.0
    assert host.bus.maintenance.unsaved() == {}


def test_what_was_not_changed_is_not_saved(connect):
    host, _, simulated = connect()
    set_calibration(simulated, 0.5, -7.0, "Z")  # the factors that the firmware works with differ
    host.bus.write(host.sensor, {"name": "Spindle"})
    host.bus.maintenance.save()
    assert simulated.eeprom["Acceleration Z: Slope"] == 0.5


def test_a_locked_eeprom_refuses_a_save_with_the_field_that_it_refused(connect, monkeypatch):
    host, _, simulated = connect()
    change_what_the_eeprom_does_not_take(host, simulated)
    simulated.eeprom["EEPROM Status"] = int(Status.LOCKED)
    write = simulated.eeprom.write

    def locked(page, offset, content):
        if page == 8:
            raise unit.Refusal(unit.WRITE_NOT_ALLOWED)
        write(page, offset, content)

    monkeypatch.setattr(simulated.eeprom, "write", locked)
    with pytest.raises(RefusedError) as caught:
        host.bus.maintenance.save()
    assert "Acceleration Y: Slope" in str(caught.value)
    assert "write not allowed" in str(caught.value)
    assert "saved before: Sleep Time 1" in str(caught.value)
    assert {field.name for field in host.bus.maintenance.unsaved()} == {
        "Acceleration Y: Slope", "Acceleration Y: Offset"}


def test_an_eeprom_that_does_not_keep_what_it_acknowledged_is_noticed(connect, monkeypatch):
    host, _, simulated = connect()
    change_what_the_eeprom_does_not_take(host, simulated)
    monkeypatch.setattr(simulated.eeprom, "write", lambda page, offset, content: None)
    with pytest.raises(RefusedError, match="Sleep Time 1 was not saved: the EEPROM took 120 s "
                                           "but holds 77 s; it may be locked"):
        host.bus.maintenance.save()


def test_a_save_that_is_not_possible_says_so(connect):
    host, _, simulated = connect()
    change_what_the_eeprom_does_not_take(host, simulated)
    simulated.refuse.add((EEPROM, 0x01))
    with pytest.raises(RefusedError, match="cannot write the EEPROM: not available"):
        host.bus.maintenance.save()


# --- other commands ----------------------------------------------------------------------------

def test_a_calibration_measurement_measures_everything(connect):
    host, _, simulated = connect()
    simulated.temperature = 31.25
    simulated.vibration = lambda times: np.tile([0.0, 50.0, -10.0], (len(times), 1))
    host.stream()
    results = host.bus.maintenance.measure()
    assert results["temperature [°C]"] == 31.25
    assert [results[f"acceleration {axis}"] for axis in (1, 2, 3)] == pytest.approx(
        [32768, 37732, 13902], abs=2)  # 1.65 V, 1.9 V and 0.7 V of 3.3 V
    assert (results["ground 1"], results["supply 1"]) == (0, 65535)
    host.more()


def test_a_measurement_that_is_refused_is_left_out(connect):
    host, _, simulated = connect()
    simulated.refuse.add((CONFIGURATION, 0x62))
    assert host.bus.maintenance.measure() == {}


def test_any_request_can_be_carried_out_while_streaming(connect):
    host, _, simulated = connect()
    host.stream()
    execute = host.bus.maintenance.execute
    assert execute(commands.READ_STATE.request(STH_1)).state is NetworkState.OPERATING
    assert execute(commands.READ_ADC.request(STH_1)) == simulated.adc
    signal = execute(commands.TEST_SIGNAL.request(STU_1, 1, 2, b"\x03"))
    assert (signal.shape, signal.module) == (1, 0x302)
    host.more()


def test_a_request_to_a_node_that_is_not_there_is_named(connect, impatient):
    host, *_ = connect()
    with pytest.raises(NoAnswerError, match=r"STH 5 does not answer on .* \(read the state\)"):
        host.bus.maintenance.execute(commands.READ_STATE.request(5))


def test_closing_leaves_the_sensor_stopped_and_disconnected(connect):
    host, network, simulated = connect()
    host.stream()
    host.bus.close()
    assert not simulated.streams
    assert network.stu.connected is None
    assert not simulated.connected
    host.bus.close()  # a second time does nothing


def test_a_bus_can_be_opened_again(connect):
    host, network, simulated = connect()
    host.stream()
    host.bus.close()
    host.bus.open()
    host.find()
    host.more()
    assert network.stu.connected is simulated


def test_our_requests_carry_the_node_numbers_of_the_manual(start, listen, other_client):
    server = start()
    other = other_client(server)
    listen(server).find()
    heard = []
    while (message := other.recv(0.1)) is not None:
        heard.append(message)
    assert heard
    senders = {Identifier.decode(message.arbitration_id).sender for message in heard}
    assert senders == {SPU_1, STH_1, STU_1}
    assert all(message.is_extended_id for message in heard)
