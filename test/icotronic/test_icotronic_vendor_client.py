# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The vendor's own client, the package icotronic, unchanged, against the simulated system.

The client runs in a process of its own. Its configuration file lies in a home directory made for
it; host and port of the server, which it cannot be told, come from python-can's CAN_CONFIG.
"""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from icotronic_driver.simulator.line import simulated_network
from icotronic_driver.simulator.scene import vibration
from icotronic_driver.values import AdcConfiguration

# Without it, the directory of this file is taken for it; that has no origin.
pytestmark = pytest.mark.skipif(
    getattr(importlib.util.find_spec("icotronic"), "origin", None) is None,
    reason="the package icotronic is not installed; it needs Python 3.12 or later")

CONFIGURATION = """\
dynaconf_merge: true
can:
  linux:
    interface: socketcand
    channel: can0
"""

CLIENT = '''
import asyncio, json, sys, traceback
from netaddr import EUI
from icotronic.can.connection import Connection
from icotronic.can.adc import ADCConfiguration
from icotronic.can.error import ErrorResponseError, UnsupportedFeatureException
from icotronic.can.node.eeprom.status import EEPROMStatus
from icotronic.can.node.sensor import Times
from icotronic.can.node.sth import STH
from icotronic.can.sensor import SensorConfiguration
from icotronic.can.streaming import StreamingConfiguration

async def find(stu):
    while len(nodes := await stu.get_sensor_nodes()) < 2:
        pass
    return [[node.name, node.sensor_node_number, str(node.mac_address), node.rssi]
            for node in nodes]

async def connect(stu):
    names = []
    for wanted in "Test-STH", 1, EUI("08-6B-D7-01-DE-81"):
        async with stu.connect_sensor_node(wanted) as node:
            names.append([await node.get_name(), await stu.is_connected()])
    return [*names, await stu.is_connected()]

async def connect_with_mac(stu):
    await stu.activate_bluetooth()
    while not await stu.get_available_nodes():
        pass
    while not await stu.is_connected():
        await stu.connect_with_mac_address(EUI("08-6B-D7-01-DE-81"))
    await stu.deactivate_bluetooth()
    return await stu.is_connected()

async def identity(stu, node):
    before = await node.get_name()
    await node.set_name("Renamed")
    changed = await node.get_name()
    await node.set_name(before)
    return [before, changed, await node.get_name(), await node.get_rssi(),
            str(await node.get_mac_address()), await stu.get_name(),
            str(await stu.get_mac_address())]

async def product_data(stu, node):
    async def of(one):
        return [await one.get_gtin(), str(await one.get_hardware_version()),
                str(await one.get_firmware_version()), await one.get_firmware_release_name(),
                await one.get_serial_number(), await one.get_product_name(),
                list(await one.get_oem_data()), str(await one.get_state())]
    return [await of(node), await of(stu)]

async def energy_times(stu, node):
    async def times():
        return [[value.sleep, value.advertisement] for value in
                (await node.get_energy_mode_reduced(), await node.get_energy_mode_lowest())]
    before = await times()
    await node.set_energy_mode_reduced(Times(sleep=60000, advertisement=1000))
    await node.set_energy_mode_lowest(Times(sleep=120000, advertisement=2000))
    changed = await times()
    await node.set_energy_mode_reduced()
    await node.set_energy_mode_lowest()
    return [before, changed, await times()]

async def adc(stu, node):
    before = await node.get_adc_configuration()
    await node.set_adc_configuration(5.0, 16, 8, 128)
    changed = await node.get_adc_configuration()
    await node.set_adc_configuration()
    return [[dict(each), each.sample_rate()] for each in (before, changed)]

async def sensors(stu, node):
    async def numbers():
        now = await node.get_sensor_configuration()
        return [now.first, now.second, now.third]
    before = await numbers()
    await node.set_sensor_configuration(SensorConfiguration(first=5, second=0, third=1))
    changed = await numbers()
    try:
        await node.set_sensor_configuration(SensorConfiguration(first=99, second=0, third=0))
        refused = False
    except UnsupportedFeatureException:
        refused = True
    await node.set_sensor_configuration(SensorConfiguration(first=1, second=2, third=3))
    return [before, changed, refused]

async def single_values(stu, node):
    return [(await node.get_streaming_data_single()).values,
            (await node.get_streaming_data_single(StreamingConfiguration(second=True, first=False))
             ).values, await node.get_supply_voltage()]

async def self_test(stu, node):
    before = await node.get_acceleration_voltage("z")
    await node.activate_acceleration_self_test("z")
    between = await node.get_acceleration_voltage("z")
    await node.deactivate_acceleration_self_test("z")
    return [before, between, await node.get_acceleration_voltage("z")]

async def streaming(stu, node):
    streams = []
    for channels, count in ((StreamingConfiguration(first=True), 1500),
                            (StreamingConfiguration(first=True, third=True), 1000),
                            (StreamingConfiguration(first=True, second=True, third=True), 1000)):
        frames = []
        async with node.open_data_stream(channels) as stream:
            async for data, lost in stream:
                frames.append([data.counter, lost, *data.values])
                if len(frames) == count:
                    break
        streams.append(frames)
    return streams

async def eeprom(stu, node):
    results = []
    for one in node, stu:
        memory = one.eeprom
        await memory.write_gtin(0x0123456789ABCDEF)
        await memory.write_serial_number("S-42")
        await memory.write_product_name("Accelerometer")
        await memory.write_oem_data(list(range(64)))
        await memory.write_batch_number(1337)
        await memory.write_float(10, 3, 1.5)
        results.append([
            str(await memory.read_status()), await memory.read_name(), await memory.read_gtin(),
            await memory.read_serial_number(), await memory.read_product_name(),
            list(await memory.read_oem_data()), await memory.read_batch_number(),
            await memory.read_float(10, 3), str(await memory.read_production_date()),
            await memory.read_power_off_cycles(), str(await memory.read_hardware_version()),
            await one.get_gtin(), await one.get_serial_number()])
    memory = node.eeprom
    await memory.write_sleep_time_1(60000)
    times = await node.get_energy_mode_reduced()
    results.append([await memory.read_sleep_time_1(), times.sleep,
                    await memory.read_advertisement_time_1(), await memory.read_sleep_time_2(),
                    await memory.read_advertisement_time_2()])
    return results

async def locked_eeprom(stu, node):
    await node.eeprom.write_status(EEPROMStatus("Locked"))
    await node.eeprom.write_release_name("Free")
    try:
        await node.eeprom.write_gtin(1)
    except ErrorResponseError as error:
        return [await node.eeprom.read_release_name(), str(error)]

async def reset(stu):
    async with stu.connect_sensor_node("Test-STH") as node:
        await node.set_adc_configuration(prescaler=9)
        await node.reset()
        while await stu.is_connected():
            pass
    async with stu.connect_sensor_node("Test-STH") as node:
        prescaler = (await node.get_adc_configuration()).prescaler
    await stu.reset()
    return [prescaler, await stu.is_connected(), (await stu.get_state()).location_name()]

async def main():
    async def chapter(coroutine, *nodes):
        try:
            result = await coroutine(*nodes)
        except BaseException:
            result = traceback.format_exc()
        print(json.dumps([coroutine.__name__, result]), flush=True)

    async with Connection() as stu:
        for each in find, connect, connect_with_mac:
            await chapter(each, stu)
        async with stu.connect_sensor_node("Test-STH", STH) as node:
            for each in (identity, product_data, energy_times, adc, sensors, single_values,
                         self_test, streaming, eeprom, locked_eeprom):
                await chapter(each, stu, node)
        await chapter(reset, stu)

asyncio.run(main())
'''


@pytest.fixture(scope="module")
def recorded() -> list[np.ndarray]:
    """The accelerations in g which the simulated sensor measured, in order."""
    return []


@pytest.fixture(scope="module")
def results(recorded: list[np.ndarray], tmp_path_factory: pytest.TempPathFactory,
            ) -> dict[str, Any]:
    """What the client reports, by chapter; a text is the traceback of one that failed."""
    home = tmp_path_factory.mktemp("home")
    (home / ".config" / "ICOtronic").mkdir(parents=True)
    (home / ".config" / "ICOtronic" / "config.yaml").write_text(CONFIGURATION)
    server = simulated_network(["Test-STH", "Second"])
    sensor = server.network.sensors[0]

    def measure(times: np.ndarray) -> np.ndarray:
        truth = vibration(times)
        truth[:, 2] = 1.0  # at rest in z, to see the self test there
        recorded.append(truth)
        return truth

    sensor.vibration = measure
    sensor.rssi = -61
    server.network.faults.refused_connects = 1  # the client has to ask again, after 3 s
    server.start()
    environment = {name: value for name, value in os.environ.items()
                   if not name.startswith(("XDG_", "DYNACONF"))}
    environment.update(HOME=str(home),
                       CAN_CONFIG=json.dumps({"host": server.host, "port": server.port}))
    try:
        done = subprocess.run([sys.executable, "-c", CLIENT], env=environment, cwd=home, timeout=50,
                              capture_output=True, text=True, check=False)
    finally:
        server.close()
    assert done.returncode == 0, done.stderr
    assert server.network.faults.refused_connects == 0
    return dict(json.loads(line) for line in done.stdout.splitlines())


def test_it_finds_the_sensors(results: dict[str, Any]) -> None:
    assert results["find"] == [["Test-STH", 0, "08-6B-D7-01-DE-81", -61],
                               ["Second", 1, "08-6B-D7-01-DE-82", -52]]


def test_it_connects_by_name_number_and_mac_address(results: dict[str, Any]) -> None:
    assert results["connect"] == [["Test-STH", True], ["Second", True], ["Test-STH", True], False]
    assert results["connect_with_mac"] is False


def test_it_reads_who_they_are(results: dict[str, Any]) -> None:
    assert results["identity"] == ["Test-STH", "Renamed", "Test-STH", -61, "08-6B-D7-01-DE-81",
                                   "Valerie", "08-6B-D7-01-0B-5C"]
    state = "Get State, Location: Application, State: Operating"
    assert results["product_data"] == [
        [0, "1.4.0", "2.1.10", "Tanja", "0", "0", [0] * 64, state],
        [0, "1.4.0", "2.1.10", "Valerie", "0", "0", [0] * 64, state]]


def test_it_reads_and_writes_the_configuration(results: dict[str, Any]) -> None:
    assert results["energy_times"] == [[[300000, 1250], [259200000, 2500]],
                                       [[60000, 1000], [120000, 2000]],
                                       [[300000, 1250], [259200000, 2500]]]
    keys = ("reference_voltage", "prescaler", "acquisition_time", "oversampling_rate")
    before, changed = results["adc"]
    assert before == [dict(zip(keys, (3.3, 2, 8, 64), strict=True)), pytest.approx(9523.8, abs=0.1)]
    assert changed == [dict(zip(keys, (5.0, 16, 8, 128), strict=True)),
                       pytest.approx(AdcConfiguration(16, 8, 128, 5.0).sample_rate)]
    assert results["sensors"] == [[1, 2, 3], [5, 2, 1], True]


def test_it_reads_single_values(results: dict[str, Any]) -> None:
    three, one, voltage = results["single_values"]
    assert three == [pytest.approx(32768, abs=2000), pytest.approx(17873, abs=13000), 18270]
    assert one == [pytest.approx(17873, abs=13000), 0, 0]
    assert voltage == pytest.approx(3.71, abs=0.001)
    before, between, after = results["self_test"]
    assert before == after == pytest.approx(0.92, abs=1e-4)
    assert between == pytest.approx(before + 0.1, abs=1e-4)


def _raw(accelerations: np.ndarray) -> np.ndarray:
    """Return the ADC's values by the definition of sensors 1, 2 and 3 (field note N7)."""
    volts = [1.65, 0.9, 0.9] + accelerations * [1.32 / 100, 0.8 / 40, 0.8 / 40]
    return np.rint(volts / 3.3 * 65535)


def test_it_streams_every_value(results: dict[str, Any], recorded: list[np.ndarray]) -> None:
    truth = _raw(np.concatenate(recorded))
    for frames, columns in zip(results["streaming"], ([0], [0, 2], [0, 1, 2]), strict=True):
        table = np.array(frames)
        assert not table[:, 1].any()  # the client itself found no loss
        assert (np.diff(table[:, 0]) % 256 == 1).all()
        values = table[:, 2:].reshape(-1, len(columns))
        wanted = truth[:, columns]
        starts = np.flatnonzero((np.abs(wanted - values[0]) <= 1).all(axis=1))
        assert any(np.abs(wanted[start:start + len(values)] - values).max() <= 1
                   for start in starts if start + len(values) <= len(wanted))


def test_it_reads_and_writes_the_eeprom(results: dict[str, Any]) -> None:
    sth, stu, times = results["eeprom"]
    common = [0x0123456789ABCDEF, "S-42", "Accelerometer", list(range(64)), 1337, 1.5,
              "2021-10-05", 0, "1.4.0", 0x0123456789ABCDEF, "S-42"]
    assert sth == ["Initialized (0xac)", "Test-STH", *common]
    assert stu == ["Initialized (0xac)", "Valerie", *common]
    assert times == [60000, 60000, 1250, 259200000, 2500]
    released, error = results["locked_eeprom"]
    assert released == "Free"
    assert "Received error response" in error


def test_it_resets_both(results: dict[str, Any]) -> None:
    assert results["reset"] == [2, False, "Application"]
