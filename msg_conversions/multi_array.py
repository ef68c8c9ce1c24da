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
