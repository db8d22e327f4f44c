"""The one place where numba is configured: every compiled kernel of the project goes through ``kernel``."""

import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

import numba

P = ParamSpec("P")
R = TypeVar("R")


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile ``function`` to machine code on its first call and keep the result on disk.

    The types survive the decorator, so that ``mypy --strict`` checks the callers of a kernel. Numba
    keeps the machine code beside the module, or in the user's cache folder where that is read-only.
    """
    return _compiled(function)


def bare_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """A ``kernel`` that allocates nothing and so counts no references to its arrays.

    In a short kernel that is called millions of times the atomic counting of references takes most of
    the time. Without numba's runtime, creating an array inside is an error at compile time.
    """
    return _compiled(function, _nrt=False)


def _compiled(function: Callable[P, R], **flags: Any) -> Callable[P, R]:
    package = function.__module__.partition(".")[0]
    source = Path(function.__code__.co_filename)
    for folder in source.parents:
        if folder.name == package:
            _forget_outdated(folder)
            break
    njit = cast(Callable[..., Callable[[Callable[P, R]], Callable[P, R]]], numba.njit)
    return njit(cache=True, **flags)(function)


def is_kept(compiled: Callable[..., Any]) -> bool:
    """Whether the machine code of a kernel is on disk, so that it need not be compiled again."""
    name = compiled.__module__.rpartition(".")[2]
    return any(Path(cast(Any, compiled).stats.cache_path).glob(f"{name}.{compiled.__name__}-*.nbi"))


@cache
def _forget_outdated(package: Path) -> None:
    """Drop kept machine code that is older than any source of the package.

    Numba looks at the file of a kernel alone, and so would go on using what it has inlined from another
    file that has changed since.
    """
    newest = max(source.stat().st_mtime for source in package.rglob("*.py"))
    for index in package.rglob("__pycache__/*.nbi"):
        try:
            outdated = index.stat().st_mtime < newest
        except FileNotFoundError:
            continue  # another process that has just started was faster
        if outdated and os.access(index.parent, os.W_OK):
            index.unlink(missing_ok=True)
