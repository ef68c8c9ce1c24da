# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Settings of the site; `./dev docs` builds it with Sphinx, as rosdoc2 does."""

project = "industrial_sensor_drivers"
copyright = "2026, industrial_sensor_drivers maintainers"  # the name that Sphinx wants
extensions = ["myst_parser"]
myst_heading_anchors = 3  # anchors as on GitHub, so that links work in both
exclude_patterns = ["_build"]
suppress_warnings = ["misc.highlighting_failure"]  # a log is no program
html_theme = "alabaster"
html_theme_options = {"description": "ROS 2 drivers for industrial sensors", "page_width": "1100px"}
html_show_sourcelink = False
