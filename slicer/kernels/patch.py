"""What numba does in another way while one of our kernels is compiled, and not for what others compile."""

import contextlib
from collections.abc import Iterator
from typing import Any, cast

from numba.core.compiler_lock import global_compiler_lock


class Patch:
    """Attributes of numba's classes and modules that have other values for a while.

    That is under the lock of numba's compiler, so that no other thread compiles meanwhile.
    """

    def __init__(self, *changes: tuple[Any, str, Any]) -> None:
        """Take the owner, the name and the other value of each."""
        self._changes = changes
        self._before: list[Any] = []
        self._depth = 0

    @contextlib.contextmanager
    def applied(self) -> Iterator[None]:
        """While this is open, also more than once, the attributes have the other values."""
        with cast(Any, global_compiler_lock):
            if self._depth == 0:
                self._before = [vars(owner).get(name, _INHERITED) for owner, name, _ in self._changes]
                for owner, name, value in self._changes:
                    setattr(owner, name, value)
            self._depth += 1
            try:
                yield
            finally:
                self._depth -= 1
                if self._depth == 0:
                    for (owner, name, _), before in zip(self._changes, self._before, strict=True):
                        if before is _INHERITED:
                            delattr(owner, name)
                        else:
                            setattr(owner, name, before)


_INHERITED = object()
