# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the conversion of bags refuses; what it gives is tested together with the node."""

import pytest
from std_msgs.msg import String

from msg_conversions.cdr import serialise
from sensor_tools import bags, convert_imu
from sensor_tools.bags import Record, read_bag, write_bag


@pytest.fixture
def bag(tmp_path):
    """A bag with nothing to convert."""
    if not bags.has_library():
        pytest.skip(bags.NEEDED)
    with write_bag(tmp_path / "bag") as write:
        write(Record("/chatter", "std_msgs/msg/String", serialise(String(data="hello")), 5))
    return tmp_path / "bag"


def test_a_bag_holds_what_was_written(bag):
    (record,) = read_bag(bag)
    assert record == ("/chatter", "std_msgs/msg/String", serialise(String(data="hello")), 5)


@pytest.mark.parametrize(("arguments", "reason"), [
    (["bag", "new"], "bag has no messages of a topic …/imu/batch"),
    (["bag", "new", "--to", "batch"], "bag has no messages of a topic …/imu/data_raw"),
    (["other", "new"], "there is no bag other"), (["empty", "new"], "cannot read the bag empty: ")])
def test_what_cannot_be_converted_is_told(bag, monkeypatch, capsys, arguments, reason):
    monkeypatch.chdir(bag.parent)
    (bag.parent / "empty").mkdir()
    with pytest.raises(SystemExit, match="1"):
        convert_imu.main(arguments)
    assert reason in capsys.readouterr().err
    assert not (bag.parent / "new").exists()


def test_a_bag_is_not_overwritten(bag):
    with pytest.raises(Exception, match="exists already; name another"), write_bag(bag):
        pass


@pytest.mark.parametrize("words", [["bag", "new"], ["bag", "new", "--to", "batch"]])
def test_a_missing_library_is_told(tmp_path, monkeypatch, capsys, words):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(bags, "has_library", lambda: False)
    (tmp_path / "bag").mkdir()
    with pytest.raises(SystemExit, match="1"):
        convert_imu.main(words)
    assert "pip install rosbags" in capsys.readouterr().err
