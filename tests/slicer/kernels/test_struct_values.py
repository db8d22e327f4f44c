"""Structs stay values while kernels are compiled, and kernels give what Python gives."""

from collections import Counter
from typing import NamedTuple

import numba
import numpy as np
import pytest
from numba.core import cgutils, types
from numba.extending import intrinsic
from numba.np import arrayobj

from slicer.kernels import allocating_inner_kernel, inner_kernel, kernel, struct_values
from slicer.kernels.patch import Patch

POINTS = np.arange(24.0).reshape(6, 4)[:, ::2]
NUMBERS = np.array([3, 1, 2, 5, 4], np.int32)


class Sheet(NamedTuple):
    points: np.ndarray
    numbers: np.ndarray


@inner_kernel
def longest(sheet, k):
    numbers = sheet.numbers if k > 0 else sheet.numbers[1:]
    most = 0
    for number in numbers:
        most = max(most, number)
    return most


@allocating_inner_kernel
def doubled(values):
    out = np.empty(2 * len(values), values.dtype)
    out[: len(values)] = values
    out[len(values) :] = values[::-1]
    return out


@kernel
def rows(points, numbers):
    total = 0.0
    for k, (x, y) in enumerate(points):
        total += k * x - y
    for a, b in zip(numbers[1:], numbers[:-1]):  # noqa: B905 (which kernels do not know)
        total += a * b
    return total


@kernel
def rebound(points, numbers):
    """A struct that is another one on one of two ways, and is read and written behind both."""
    part = points[2:]
    for k in range(3):
        if k == 1:
            part = points[k:, ::-1]
        elif k == 2:
            part = part.T
        if part.shape[0] > 3:
            part[0, 0] += 1.0
    return part.sum() + numbers.size + part.shape[1]


@kernel
def in_branches(points, numbers):
    sheet = Sheet(points[:], numbers[:])
    if numbers[0] > 2:
        sheet = Sheet(points[1:], numbers[:-1])
        most = longest(sheet, 0)
    else:
        most = longest(sheet, 1)
    return most + len(sheet.points) + sheet.numbers[-1]


@kernel
def made(points, numbers):
    wide = doubled(numbers)
    grid = np.zeros((len(numbers), 2))
    for k in range(len(numbers)):
        grid[k] = points[k]
    z = complex(grid[1, 0], grid[2, 1])
    z += 1j * wide[7]
    return z.real + 2.0 * z.imag + wide.sum() + grid.reshape(-1)[3] + grid.copy()[3, 1]


@kernel
def first(points, numbers):
    return points[1, 1] + numbers[2] + len(points)


def of_python(compiled):
    """The same without any compiling, also of what it calls."""
    names = {name: getattr(value, "py_func", value) for name, value in globals().items()}
    function = compiled.py_func
    return type(function)(function.__code__, names, function.__name__)


@pytest.mark.parametrize("compiled", [rows, rebound, in_branches, made, first], ids=lambda one: one.__name__)
@pytest.mark.parametrize("numbers", [NUMBERS, NUMBERS[::-1].copy()[1:]], ids=["up", "down"])
def test_kernels_give_what_python_gives(compiled, numbers):
    given, by_hand = POINTS.copy(), POINTS.copy()
    assert compiled(given, numbers) == of_python(compiled)(by_hand, numbers)
    assert np.array_equal(given, by_hand)


def test_the_numba_at_hand_is_as_expected():
    assert struct_values.as_expected()


@pytest.fixture
def made_places(monkeypatch):
    """How often a struct went into memory, and the context that counts."""
    count = Counter()
    numbas = struct_values._put_into_memory

    def counting(struct):
        count[type(struct)] += 1
        numbas(struct)

    monkeypatch.setattr(struct_values, "_put_into_memory", counting)
    return count


def compiled_now(function):
    """Numba's own, as no kernel is that an earlier run may have left on disk."""

    def called(*args):
        with struct_values.kept():
            return numba.njit(function)(*args)

    return called


def test_what_is_read_alone_has_no_place(made_places):
    @compiled_now
    def read(points):
        return points[0, 1] + len(points) + points.shape[1]

    assert read(POINTS) == 2.0 + 6 + 2
    assert not made_places


def test_what_has_an_address_is_put_into_memory_where_it_came_to_be(made_places):
    @compiled_now
    def reduced(points):
        total = 0.0
        for k in range(len(points)):
            row = points[k]
            if k % 2:
                total += row.sum()
            else:
                total -= np.max(row)
        return total

    assert reduced(POINTS) == of_rows(POINTS)
    assert made_places


def of_rows(points):
    return sum(row.sum() if k % 2 else -row.max() for k, row in enumerate(points))


@intrinsic
def three_more(context, number):
    """Adds 1 three times: reads and writes a struct in a loop that it was made before."""

    def code(context, builder, signature, args):
        struct = context.make_complex(builder, number, value=args[0])
        with cgutils.for_range(builder, context.get_constant(types.intp, 3)):
            struct.real = builder.fadd(struct.real, context.get_constant(types.float64, 1.0))
        return struct._getvalue()

    return number(number), code


@intrinsic
def written_before_the_end(context, number):
    """Writes into a struct from a block that has its end already."""

    def code(context, builder, signature, args):
        struct = context.make_complex(builder, number, value=args[0])
        block, behind = builder.append_basic_block("block"), builder.append_basic_block("behind")
        builder.branch(block)
        builder.position_at_end(block)
        builder.branch(behind)
        with builder.goto_block(block):
            struct.real = builder.fadd(struct.imag, context.get_constant(types.float64, 1.0))
            struct.imag = struct.real
        builder.position_at_end(behind)
        return struct._getvalue()

    return number(number), code


def test_what_is_written_later_in_a_loop_is_read_by_what_stands_earlier():
    @compiled_now
    def of_kernel(z):
        return three_more(z), written_before_the_end(z)

    assert of_kernel(1.0 + 2.0j) == (4.0 + 2.0j, 3.0 + 3.0j)


def numbas_ways():
    names = ("__init__", "__getattr__", "__getitem__", "_getvalue")
    of_structs = [vars(cgutils.ValueStructProxy).get(name) for name in names]
    return of_structs, arrayobj.make_array, arrayobj.fix_integer_index


def test_numba_is_as_before_outside():
    before = numbas_ways()
    first(POINTS, NUMBERS)

    def fails():
        with struct_values.kept(), struct_values.kept():
            assert numbas_ways()[0] != before[0]
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fails()
    assert numbas_ways() == before
    assert before[0] == [None] * 4  # all are inherited


def test_another_numba_is_left_alone(monkeypatch):
    monkeypatch.setattr(struct_values, "_EXPECTED", False)
    before = numbas_ways()
    with struct_values.kept():
        assert numbas_ways() == before
    assert numba.njit(lambda x: x[1])(NUMBERS) == 1


def test_a_patch_is_undone_once_nobody_needs_it():
    class Owner:
        own = 1

    class Heir(Owner):
        pass

    patch = Patch((Owner, "own", 2), (Heir, "own", 3))
    with patch.applied():
        with patch.applied():
            assert (Owner.own, Heir.own) == (2, 3)
        assert (Owner.own, Heir.own) == (2, 3)
    assert (Owner.own, Heir.own) == (1, 1)
    assert "own" not in vars(Heir)
