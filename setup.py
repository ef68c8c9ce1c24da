# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Build and install the package; colcon calls this (build type ament_python)."""

from glob import glob

from setuptools import find_packages, setup

PACKAGE = "industrial_sensor_drivers"
SHARE = f"share/{PACKAGE}"

setup(
    name=PACKAGE,
    version="0.1.0",  # the same as in package.xml, like all that is said here about the package
    description=(
        "Drivers for InnoSenT iSYS radars, ICOtronic wireless accelerometers"
        " and Pepperl+Fuchs UC4000 ultrasonic sensors."
    ),
    maintainer=f"{PACKAGE} maintainers",
    maintainer_email="maintainers@example.com",
    license="Apache-2.0",
    python_requires=">=3.10",
    extras_require={"test": ["pytest"]},  # tells "colcon test" to call pytest
    packages=find_packages(exclude=["test", "test.*", "bench", "bench.*"]),
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (SHARE, ["package.xml"]),
        (f"{SHARE}/launch", sorted(glob("launch/*.py"))),
        (f"{SHARE}/config", sorted(glob("config/*.yaml"))),
        (f"{SHARE}/config/next_stages", sorted(glob("config/next_stages/*.yaml"))),
        (f"{SHARE}/config/security", sorted(glob("config/security/*.xml"))),
        (f"{SHARE}/layouts", sorted(glob("layouts/*"))),
        (f"{SHARE}/rviz", sorted(glob("rviz/*.rviz"))),
        (f"{SHARE}/urdf", sorted(glob("urdf/*.xacro"))),
    ],
    entry_points={
        "console_scripts": [
            "convert_imu = industrial_sensor_drivers.programs:convert_imu",
            "demo = industrial_sensor_drivers.programs:demo",
            "doctor = industrial_sensor_drivers.programs:doctor",
            "icotronic_node = industrial_sensor_drivers.programs:icotronic_node",
            "isys_radar_node = industrial_sensor_drivers.programs:isys_radar_node",
            "radar_scan = industrial_sensor_drivers.programs:radar_scan",
            "record_qos = industrial_sensor_drivers.programs:record_qos",
            "sensors = industrial_sensor_drivers.programs:sensors",
            "simulate = industrial_sensor_drivers.programs:simulate",
            "uc4000_node = industrial_sensor_drivers.programs:uc4000_node",
        ],
    },
)
