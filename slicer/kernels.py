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


def bare_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """A ``kernel`` that allocates nothing and so counts no references to its arrays.

    In a short kernel that is called millions of times the atomic counting of references takes most of
    the time. Without numba's runtime, creating an array inside is an error at compile time.
    """
    return cast(Callable[P, R], numba.njit(cache=True, _nrt=False)(function))
