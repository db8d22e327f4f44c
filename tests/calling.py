"""Calls a kernel that only kernels call: Python cannot, so a kernel does it for the tests."""

from collections.abc import Callable
from typing import Any

import numba


def from_python(inner: Callable[..., Any]) -> Callable[..., Any]:
    """A function that calls an ``inner_kernel`` with its arguments, as they come."""

    def call(*args: Any) -> Any:
        return inner(*args)

    return numba.njit(error_model="numpy")(call)
