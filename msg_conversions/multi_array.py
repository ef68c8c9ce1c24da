# Copyright 2026 industrial_sensor_drivers maintainers
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Arrays as std_msgs/Float32MultiArray and Float64MultiArray."""

from __future__ import annotations

import array
from collections.abc import Sequence

import numpy as np
from std_msgs.msg import (
    Float32MultiArray,
    Float64MultiArray,
    MultiArrayDimension,
    MultiArrayLayout,
)


def to_float32_multi_array(values: np.ndarray, labels: Sequence[str]) -> Float32MultiArray:
    """Return an array with one labelled dimension per axis, row-major.

    Args:
        values: Any shape; int16 and float32 are kept exactly.
        labels: One per axis.
    """
    data = array.array("f", np.ascontiguousarray(values, np.float32).tobytes())
    return Float32MultiArray(layout=_layout(values, labels), data=data)


def to_float64_multi_array(values: np.ndarray, labels: Sequence[str]) -> Float64MultiArray:
    """Return an array with one labelled dimension per axis, row-major.

    Args:
        values: Any shape.
        labels: One per axis.
    """
    data = array.array("d", np.ascontiguousarray(values, np.float64).tobytes())
    return Float64MultiArray(layout=_layout(values, labels), data=data)


def _layout(values: np.ndarray, labels: Sequence[str]) -> MultiArrayLayout:
    dimensions = [MultiArrayDimension(label=label, size=size, stride=int(
        np.prod(values.shape[axis:]))) for axis, (label, size) in
        enumerate(zip(labels, values.shape, strict=True))]
    return MultiArrayLayout(dim=dimensions, data_offset=0)
