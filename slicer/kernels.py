"""The one place where numba is configured: every compiled kernel of the package goes through ``kernel``."""

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

import numba

P = ParamSpec("P")
R = TypeVar("R")


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile ``function`` to machine code on its first call and keep the result on disk.

    The types survive the decorator, so that ``mypy --strict`` checks the callers of a kernel. Numba
    keeps the machine code beside the module, or in the user's cache folder where that is read-only.
    """
    return cast(Callable[P, R], numba.njit(cache=True)(function))
