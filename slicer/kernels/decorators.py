"""The one place where numba is configured: every compiled kernel of the project goes through ``kernel``."""

import contextlib
import gc
import pickle
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

import numba
from llvmlite import ir
from numba.np import arrayobj

from slicer.kernels import machine_code, struct_values
from slicer.kernels.lean_library import IN_VECTORS, lean, packed
from slicer.kernels.patch import Patch
from slicer.kernels.typing_memo import remembered

P = ParamSpec("P")
R = TypeVar("R")


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile ``function`` to machine code on its first call and keep the result on disk.

    The types survive the decorator, so that ``mypy --strict`` checks the callers of a kernel. Where the
    machine code is kept, and when it is used again, says ``machine_code``. A division by zero gives infinity
    or no number, as numpy's does, and no exception.
    """
    return _compiled(function)


def bare_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """A ``kernel`` that allocates nothing and so counts no references to its arrays.

    Where arrays are touched millions of times, in a short kernel or in the loops of a long one, the atomic
    counting of references takes most of the time. Without numba's runtime, creating an array inside is an
    error at compile time.
    """
    return _compiled(function, _nrt=False)


def inner_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """A ``bare_kernel`` that kernels alone call: Python cannot, and so nothing is compiled for it to do so.

    What takes its arguments from Python objects is a fifth of all that is compiled.
    """
    return _compiled(function, _nrt=False, no_cpython_wrapper=True)


def vector_inner_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """An ``inner_kernel`` in which like operations side by side are made one on vectors.

    That takes LLVM a tenth longer, and most kernels gain nothing by it.
    """
    compiled = inner_kernel(function)
    setattr(compiled, IN_VECTORS, True)
    return compiled


def allocating_inner_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """An ``inner_kernel`` that creates arrays, as a ``kernel`` may."""
    return _compiled(function, no_cpython_wrapper=True)


def _compiled(function: Callable[P, R], **flags: Any) -> Callable[P, R]:
    njit = cast(Callable[..., Callable[[Callable[P, R]], Callable[P, R]]], numba.njit)
    # Numba asks for the locator while it decorates; other users of numba in the process keep theirs.
    config = cast(Any, numba.config)
    before = config.CACHE_LOCATOR_CLASSES
    config.CACHE_LOCATOR_CLASSES = f"{machine_code.__name__}.{machine_code.ByContent.__name__}"
    try:
        compiled = njit(cache=True, error_model="numpy", no_cfunc_wrapper=True, **flags)(function)
    finally:
        config.CACHE_LOCATOR_CLASSES = before
    _name_apart(compiled)
    _outlive_other_sources(compiled)
    _compile_once(compiled)
    _compile_quickly(compiled)
    _keep_packed(compiled)
    return compiled


def _compile_once(compiled: Any) -> None:
    """Let kernels that call this one share its machine code, whatever the types of whole numbers they have.

    Numba types a constant apart from a number, and compiles a callee anew for each mixture of constants,
    int32 and int64: the same instructions over and over. LLVM still puts constants in where it inlines.
    """
    call_template = compiled.get_call_template
    compiled.get_call_template = lambda args, kws: call_template(
        tuple(widest(kind) for kind in args), {name: widest(kind) for name, kind in kws.items()}
    )


def widest(kind: Any) -> Any:
    """The numba type that stands for this one in a call: no constants, one width of signed whole numbers."""
    types = cast(Any, numba.types)
    plain = types.unliteral(kind)
    if isinstance(plain, types.BaseAnonymousTuple):
        return types.BaseTuple.from_types(tuple(widest(part) for part in plain))
    return types.int64 if plain in (types.int8, types.int16, types.int32) else plain


def _compile_quickly(compiled: Any) -> None:
    """Spare work of Python while this kernel is compiled, and of numba's while it looks up types."""
    compile_kernel = compiled.compile

    def compile_now(signature: Any) -> Any:
        kept = is_kept(compiled, signature)
        if not kept:
            for told in _TOLD:
                told()
        with (
            _few_collections(),
            _PLAIN_INDICES.applied(),
            struct_values.kept(),
            remembered(),
            lean(compiled),
            _alone(compiled, kept),
        ):
            return compile_kernel(signature)

    compiled.compile = compile_now


@contextlib.contextmanager
def tell_of_compiling(told: Callable[[], None]) -> Iterator[None]:
    """While this is open, call ``told`` before each kernel that this process compiles anew."""
    _TOLD.append(told)
    try:
        yield
    finally:
        _TOLD.remove(told)


_TOLD: list[Callable[[], None]] = []


def _alone(compiled: Any, kept: bool) -> contextlib.AbstractContextManager[None]:
    """Let another process that wants the same kernel wait for it and find it, and not compile it as well."""
    if kept:
        return contextlib.nullcontext()
    return machine_code.held(compiled.py_func.__code__.co_filename)


@contextlib.contextmanager
def _few_collections() -> Iterator[None]:
    """Let Python look for garbage less often.

    Numba and LLVM's binding make hundreds of thousands of objects that live until the kernel is done; looking
    through them again and again took a tenth of all compile time.
    """
    before = gc.get_threshold()
    gc.set_threshold(COLLECT_AFTER, *before[1:])
    try:
        yield
    finally:
        gc.set_threshold(*before)


def _plain_index(context: Any, builder: Any, kind: Any, index: Any, size: Any) -> Any:
    """``fix_integer_index``, but an index that is no constant counts from the front alone.

    Numba looks at each whether it is negative and then counts from the end: instructions at every access, on
    the way to its address, that took a quarter of the time of the tightest kernels.
    """
    if isinstance(index, ir.Constant):
        return _NUMBAS_INDEX(context, builder, kind, index, size)
    return context.cast(builder, index, kind, numba.types.intp)


_NUMBAS_INDEX = cast(Any, arrayobj).fix_integer_index
_PLAIN_INDICES = Patch((arrayobj, "fix_integer_index", _plain_index))


def _name_apart(compiled: Any) -> None:
    """Let no two processes that compile at once give their code the same file name.

    Numba counts the files of a kernel, so two processes that begin together would write two signatures to one
    file, and a later run would call the one with the arguments of the other.
    """
    kept = compiled._cache._cache_file
    kept._data_name_pattern = kept._data_name_pattern.replace("{number", f"{PROCESS}.{{number")


def _outlive_other_sources(compiled: Any) -> None:
    """Take a list of kept code that cannot be read for an empty one.

    It names the classes of arguments, and other sources may have had some that are gone: numba would fail
    before it sees by the stamp that the code is theirs.
    """
    kept = compiled._cache._cache_file
    load = kept._load_index

    def load_index() -> Any:
        try:
            return load()
        except (ImportError, LookupError, AttributeError, TypeError, ValueError, EOFError):
            return {}
        except pickle.UnpicklingError:
            return {}

    kept._load_index = load_index


def _keep_packed(compiled: Any) -> None:
    """Let this kernel's library be kept packed, and no other one that is compiled meanwhile."""
    save = compiled._cache.save_overload

    def save_packed(signature: Any, result: Any) -> None:
        with packed():
            save(signature, result)

    compiled._cache.save_overload = save_packed


COLLECT_AFTER = 200_000
PROCESS = uuid.uuid4().hex[:8]


def is_kept(compiled: Callable[..., Any], signature: Any = None) -> bool:
    """Whether the machine code of a kernel is on disk, so that it need not be compiled again.

    Args:
        signature: for arguments of these numba types; None for any.
    """
    kept = cast(Any, compiled)._cache._cache_file
    if not Path(kept._index_path).is_file():
        return False
    signatures = {tuple(types) for types, *_ in kept._load_index()}
    return bool(signatures) if signature is None else tuple(signature) in signatures
