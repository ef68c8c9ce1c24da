# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a recorder is told about queues: for which topics, and why."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from nodes import Ros
from rclpy.duration import Duration
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Imu

from sensor_tools import record_qos

ROOT = Path(__file__).resolve().parent.parent.parent
DEADLINE = 60.0  # s; far more than anything takes, also on a busy machine
BURST = 1500  # samples that come while a recorder writes to its disk, for 0.16 s


def written(*arguments):
    """Return what the command writes, as the recorder reads it."""
    return yaml.safe_load(record_qos.profiles(map(record_qos.NamedNode.parse, arguments)))


def test_every_topic_of_a_node_is_there_under_its_name_and_those_of_its_sensors():
    topics = written("/cart/radars=isys_radar:front,rear", "spindle=icotronic")
    assert {"/cart/radars/front/points", "/cart/radars/rear/raw_signals", "/spindle/imu/batch",
            "/spindle/imu/data_raw", "/diagnostics"} <= topics.keys()
    assert len(topics) == 2 * 9 + 12
    assert topics["/spindle/imu/data_raw"] == {
        "history": "keep_last", "depth": 2000, "reliability": "reliable", "durability": "volatile"}


def test_the_file_of_the_package_has_the_usual_names():
    topics = yaml.safe_load((ROOT / "config" / "record_qos.yaml").read_text())
    assert topics == written("isys_radar=isys_radar", "icotronic=icotronic", "uc4000=uc4000")


@pytest.mark.parametrize("text", ["icotronic", "=icotronic", "/press=laser"])
def test_another_kind_of_node_is_refused(text, capsys):
    with pytest.raises(SystemExit, match="2"):
        record_qos.main([text])
    assert "is not like /press/spindle=icotronic" in capsys.readouterr().err


RECORDER = """
import json, sys
import rclpy
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Imu

rclpy.init()
node = rclpy.create_node("busy_recorder")
subscriptions = {depth: node.create_subscription(
    Imu, "/burst", lambda message: None, QoSProfile(depth=depth), raw=True) for depth in (10, 2000)}
print("ready", flush=True)
sys.stdin.readline()  # it writes to its disk; meanwhile messages come
counts = {}
for depth, subscription in subscriptions.items():
    with subscription.handle:
        counts[depth] = 0
        while subscription.handle.take_message(Imu, True) is not None:
            counts[depth] += 1
print(json.dumps(counts), flush=True)
"""


def test_a_queue_of_ten_loses_nearly_all_that_comes_while_a_recorder_is_busy():
    with Ros() as ros, subprocess.Popen([sys.executable, "-c", RECORDER], text=True,
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE) as recorder:
        try:
            assert recorder.stdout.readline() == "ready\n"
            publisher = ros.node.create_publisher(Imu, "/burst", QoSProfile(depth=2000))
            ros.wait_until(lambda: publisher.get_subscription_count() == 2)
            for _ in range(BURST):
                publisher.publish(Imu())
            assert publisher.wait_for_all_acked(Duration(seconds=DEADLINE))
            counts, _ = recorder.communicate("\n", timeout=DEADLINE)
        finally:
            recorder.kill()
    assert json.loads(counts) == {"10": 10, "2000": BURST}
