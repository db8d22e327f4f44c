"""Flat arrays of whole numbers as text that a page unpacks: differences by bytes, deflated, in base 64."""

import base64
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray


def pack(arrays: Mapping[str, NDArray[Any]]) -> tuple[list[dict[str, Any]], str]:
    """Arrays of at most 32 bits each as a table of what they are, and their text.

    Bytes (uint8) stand as they are. Of all others stand the differences to the number before, the lowest
    bytes of all of them first: along a sheet differences repeat, and their high bytes are nearly all zero.

    Args:
        arrays: by name; each (n,), whose values fit into int32.

    Returns:
        For each array {"name", "n", "bytes"}, in the order of the text; and the text.
    """
    table, data = [], []
    for name, values in arrays.items():
        width = 1 if values.dtype == np.uint8 else 4
        table.append({"name": name, "n": len(values), "bytes": width})
        if width == 1:
            data.append(values.tobytes())
        else:
            steps = np.diff(values.astype(np.int64), prepend=0).astype("<i4")
            data.append(np.ascontiguousarray(steps.view(np.uint8).reshape(-1, 4).T).tobytes())
    return table, base64.b64encode(zlib.compress(b"".join(data), 9)).decode("ascii")


def counted(values: NDArray[np.float64], least: float) -> tuple[NDArray[np.int64], float]:
    """Numbers as multiples of a unit of at least ``least``, the greater the numbers are; and that unit."""
    unit = max(least, float(np.abs(values).max(initial=0.0)) / 2**30)
    return np.round(values / unit).astype(np.int64), unit
