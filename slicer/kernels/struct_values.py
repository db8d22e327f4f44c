"""Structs of kernels, such as arrays, stay values where they are looked into as soon as they are there.

Numba puts every struct whose member it wants into memory first: a place that is filled with zeros twice, then
with the struct, to be read from. A kernel looks thousands of times for where an array's data begin and how
many there are, and LLVM has to find out for each that the place is not needed. Here a member is taken out of
the value. There is a place once somebody asks for its address, or looks from another block of instructions:
what stands earlier in the code may there run later, in a loop, than what is written into the struct.
That was a twentieth of all compiling.

As in ``typing_memo`` this holds only while one of our kernels is compiled, and is left out where a numba is
built otherwise.
"""

import contextlib
import inspect
from typing import Any

from llvmlite.ir import IRBuilder
from numba.core import cgutils
from numba.np import arrayobj

from slicer.kernels.patch import Patch


def kept() -> contextlib.AbstractContextManager[None]:
    """While this is open, numba's structs stay values as long as they are only read."""
    return _PATCH.applied() if as_expected() else contextlib.nullcontext()


def as_expected() -> bool:
    """Whether this numba handles structs as the shortcut takes it to."""
    return _EXPECTED


def _init(self: Any, context: Any, builder: Any, value: Any = None, ref: Any = None) -> None:
    """``ValueStructProxy.__init__``; without a value, or with a place, numba's way is taken."""
    model = context.data_model_manager[self._fe_type]
    if value is None or ref is not None or value.type != model.get_value_type():
        _NUMBAS_INIT(self, context, builder, value, ref)
        return
    self._context, self._builder, self._datamodel = context, builder, model
    self._be_type, self._held = value.type, value
    block = builder.block
    self._site = block, block.instructions[builder._anchor - 1] if builder._anchor else None


def _get_attribute(self: Any, field: str) -> Any:
    """``__getattr__``, which is asked for what is not there: the place of a struct that is a value so far."""
    if field in PLACES and "_held" in vars(self):
        _put_into_memory(self)
        return vars(self)[field]
    return _NUMBAS_GET_ATTRIBUTE(self, field)


def _get_item(self: Any, index: int) -> Any:
    if not _is_value(self):
        return _NUMBAS_GET_ITEM(self, index)
    if index >= len(self):
        raise IndexError(index)  # ends a loop over the members
    return self._builder.extract_value(self._held, index)


def _get_value(self: Any) -> Any:
    return self._held if _is_value(self) else _NUMBAS_GET_VALUE(self)


def _make_array(kind: Any) -> Any:
    """``make_array``, whose class asks for the address of the shape; made once for each type of array."""
    if kind not in _ARRAYS:
        numbas = _NUMBAS_MAKE_ARRAY(kind)

        def shape(struct: Any) -> Any:
            if _is_value(struct):
                return struct[struct._datamodel.get_field_position("shape")]
            return numbas.shape.fget(struct)

        _ARRAYS[kind] = type(numbas.__name__, (numbas,), {"shape": property(shape)})
    return _ARRAYS[kind]


_ARRAYS: dict[Any, Any] = {}


def _is_value(struct: Any) -> bool:
    """Whether it has no place and needs none, since all that looks into it runs right behind what made it."""
    own = vars(struct)
    return "_held" in own and PLACES[0] not in own and struct._builder.block is own["_site"][0]


def _put_into_memory(struct: Any) -> None:
    """Make the place, and fill it where numba would have: there every later use comes by."""
    builder = struct._builder
    here, behind = builder.block, builder.block.instructions[builder._anchor :]
    entry = builder.function.entry_basic_block
    builder.position_at_start(entry)
    place = builder.alloca(struct._be_type)
    block, last = struct._site
    if last is not None:
        builder.position_after(last)
    elif block is not entry:
        builder.position_at_start(block)
    builder.store(struct._held, place)
    if behind:
        builder.position_before(behind[0])
    else:
        builder.position_at_end(here)
    struct._value = struct._outer_ref = place


PLACES = ("_value", "_outer_ref")


def _looks_as_expected() -> bool:
    try:
        return (
            list(inspect.signature(_NUMBAS_INIT).parameters) == ["self", "context", "builder", "value", "ref"]
            and list(inspect.signature(_NUMBAS_GET_ATTRIBUTE).parameters) == ["self", "field"]
            and list(inspect.signature(_NUMBAS_GET_ITEM).parameters) == ["self", "index"]
            and list(inspect.signature(_NUMBAS_GET_VALUE).parameters) == ["self"]
            and not {"__init__", "__getattr__", "__getitem__", "_getvalue"} & vars(_Struct).keys()
            and list(inspect.signature(_NUMBAS_MAKE_ARRAY).parameters) == ["array_type"]
            and IRBuilder()._anchor == 0
            and set(PLACES) <= set(_NUMBAS_INIT.__code__.co_names)
        )
    except (AttributeError, TypeError, ValueError):
        return False


_Struct: Any = getattr(cgutils, "ValueStructProxy", None)
_NUMBAS_INIT: Any = getattr(_Struct, "__init__", None)
_NUMBAS_GET_ATTRIBUTE: Any = getattr(_Struct, "__getattr__", None)
_NUMBAS_GET_ITEM: Any = getattr(_Struct, "__getitem__", None)
_NUMBAS_GET_VALUE: Any = getattr(_Struct, "_getvalue", None)
_NUMBAS_MAKE_ARRAY: Any = getattr(arrayobj, "make_array", None)
_EXPECTED = _looks_as_expected()
_PATCH = Patch(
    (_Struct, "__init__", _init),
    (_Struct, "__getattr__", _get_attribute),
    (_Struct, "__getitem__", _get_item),
    (_Struct, "_getvalue", _get_value),
    (arrayobj, "make_array", _make_array),
)
