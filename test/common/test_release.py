# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The files that a release needs beside the code: they can be read, and say what is so."""

import re
import xml.dom.minidom
from pathlib import Path

import pytest
import yaml
from catkin_pkg.changelog import get_changelog_from_path
from catkin_pkg.package import parse_package
from catkin_pkg.package_version import get_forthcoming_label

ROOT = Path(__file__).resolve().parent.parent.parent
YAML = [ROOT / ".pre-commit-config.yaml", *ROOT.glob(".github/**/*.y*ml"),
        *ROOT.glob("config/*.yaml")]
PYTHONS = ["3.10", "3.11", "3.12", "3.13"]


def test_the_changelog_can_be_read_by_the_tools_of_a_release():
    get_changelog_from_path(str(ROOT / "CHANGELOG.rst"), "industrial_sensor_drivers")
    text = (ROOT / "CHANGELOG.rst").read_text(encoding="utf-8")
    assert get_forthcoming_label(text) == "Forthcoming"


def test_package_xml_is_complete():
    package = parse_package(str(ROOT / "package.xml"))
    assert package.authors
    assert package.maintainers
    assert [each.file for each in package.licenses] == ["LICENSE"]
    xml.dom.minidom.parse(str(ROOT / "package.xml"))


@pytest.mark.parametrize("path", YAML, ids=lambda path: path.name)
def test_yaml_can_be_read(path):
    assert isinstance(yaml.safe_load(path.read_text(encoding="utf-8")), dict)


def test_workflows_use_the_versions_that_are_supported():
    jobs = yaml.safe_load((ROOT / ".github/workflows/test.yaml").read_text())["jobs"]
    assert jobs["wheels"]["strategy"]["matrix"]["python"] == PYTHONS
    assert jobs["jazzy"]["runs-on"] == "ubuntu-24.04"
    assert "(3, 10) <= sys.version_info < (3, 14)" in (ROOT / "dev").read_text()


def test_a_bug_report_asks_for_what_helps():
    form = (ROOT / ".github/ISSUE_TEMPLATE/bug_report.yml").read_text()
    assert "sensors doctor --json" in form
    assert "save_recording" in form


@pytest.mark.parametrize("name", ["README.md", "QUALITY_DECLARATION.md", "CONTRIBUTING.md"])
def test_links_lead_somewhere(name):
    links = re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", (ROOT / name).read_text(encoding="utf-8"))
    assert [link for link in links if not (ROOT / link).exists()] == []
