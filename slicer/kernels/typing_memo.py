"""Answers of numba's type inference, kept while kernels are compiled.

One job asks numba 25,000 times what type a function has for given arguments, and these are a few hundred
different questions: each kernel asks anew what ``int64 + int64`` is. Numba derives every answer from its
templates, which was a fifth of all compiling. It also compares its compiler flags with each other all the
time, option by option.

Both shortcuts hold only while one of our kernels is compiled, under the lock of numba's compiler, so that
other users of numba in the process never meet them; and they are left out where a numba is built otherwise.
"""

import contextlib
import inspect
from typing import Any, cast

from numba.core import targetconfig
from numba.core.types import functions

from slicer.kernels.patch import Patch

_ANSWERS: dict[tuple[Any, ...], Any] = {}
_HASHES: dict[type, int] = {}


def remembered() -> contextlib.AbstractContextManager[None]:
    """While this is open, a question that numba's typing has answered is not worked out again."""
    return _PATCH.applied() if as_expected() else contextlib.nullcontext()


def as_expected() -> bool:
    """Whether this numba asks and compares as the shortcuts take it to."""
    return _EXPECTED


def _looks_as_expected() -> bool:
    try:
        return (
            list(inspect.signature(_NUMBAS_GET_CALL_TYPE).parameters) == ["self", "context", "args", "kws"]
            and list(cast(Any, targetconfig.TargetConfig).__slots__) == ["_values"]
            and hash(default := cast(Any, targetconfig.TargetConfig)()) == _hash_of_flags(default)
            and callable(targetconfig.ConfigStack.top_or_none)
            and hasattr(functions.BaseFunction, "get_impl_key")
        )
    except (AttributeError, TypeError, ValueError):
        return False


def _get_call_type(self: Any, context: Any, args: Any, kws: Any) -> Any:
    """``BaseFunction.get_call_type``; a refusal or an error is not kept.

    The key has the function's type, and with it all its templates: one that was registered since makes
    another type.
    """
    flags = cast(Any, targetconfig.ConfigStack).top_or_none()
    asked = (self, context, tuple(args), tuple(kws.items()))
    try:
        kept = _ANSWERS.get((*asked, flags))
    except TypeError:  # an argument that cannot be hashed
        return _NUMBAS_GET_CALL_TYPE(self, context, args, kws)
    # Lowering asks the type how the answer is implemented, so that this very type must know it.
    if kept is not None and kept.args in self._impl_keys:
        return kept
    found = _NUMBAS_GET_CALL_TYPE(self, context, args, kws)
    if found is not None:
        _ANSWERS[(*asked, None if flags is None else flags.copy())] = found
    return found


def _equal_flags(self: Any, other: Any) -> Any:
    """``TargetConfig.__eq__``: what was set is compared first, and the defaults only where that differs."""
    if self is other:
        return True
    if type(self) is type(other) and self._values == other._values:
        return True
    return _NUMBAS_EQUAL(self, other)


def _hash_of_flags(self: Any) -> int:
    """``TargetConfig.__hash__``, which is that of the options' names and so one number for each class."""
    kind = type(self)
    if kind not in _HASHES:
        _HASHES[kind] = _NUMBAS_HASH(self)
    return _HASHES[kind]


_NUMBAS_GET_CALL_TYPE: Any = getattr(functions.BaseFunction, "get_call_type", None)
_NUMBAS_EQUAL: Any = getattr(targetconfig.TargetConfig, "__eq__", None)
_NUMBAS_HASH: Any = getattr(targetconfig.TargetConfig, "__hash__", None)
_EXPECTED = _looks_as_expected()
_PATCH = Patch(
    (functions.BaseFunction, "get_call_type", _get_call_type),
    (targetconfig.TargetConfig, "__eq__", _equal_flags),
    (targetconfig.TargetConfig, "__hash__", _hash_of_flags),
)
