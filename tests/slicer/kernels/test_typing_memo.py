"""Answers of numba's typing are kept while our kernels are compiled, and are those that numba gives."""

from collections import Counter

import numba
import numpy as np
import pytest
from numba.core import targetconfig, types
from numba.core.compiler import Flags
from numba.core.errors import TypingError
from numba.core.registry import cpu_target
from numba.core.types.functions import BaseFunction
from numba.extending import overload

from slicer.kernels import kernel, typing_memo
from slicer.kernels.typing_memo import remembered

NUMBAS = typing_memo._NUMBAS_GET_CALL_TYPE


@pytest.fixture
def asked(monkeypatch):
    """How often numba itself was asked for the type of which function."""
    count = Counter()

    def counting(self, context, args, kws):
        count[self.typing_key] += 1
        return NUMBAS(self, context, args, kws)

    monkeypatch.setattr(typing_memo, "_NUMBAS_GET_CALL_TYPE", counting)
    monkeypatch.setattr(typing_memo, "_ANSWERS", {})
    monkeypatch.setattr(BaseFunction, "get_call_type", BaseFunction.get_call_type)  # restored afterwards
    return count


def sqrt_of(kind):
    context = cpu_target.typing_context
    context.refresh()
    return context.resolve_function_type(np.sqrt, (kind,), {})


def test_the_numba_at_hand_is_as_expected():
    assert typing_memo.as_expected()


def test_a_question_is_asked_once(asked):
    with remembered():
        first = sqrt_of(types.float64)
        assert sqrt_of(types.float64) is first
        assert asked[np.sqrt] == 1
        assert sqrt_of(types.float32) != first  # another question
        assert asked[np.sqrt] == 2


def numbas_ways():
    config = targetconfig.TargetConfig
    return BaseFunction.get_call_type, config.__eq__, config.__hash__


def fails_inside(before):
    with remembered(), remembered():
        assert not set(numbas_ways()) & set(before)
        raise ZeroDivisionError


def test_numba_is_as_before_outside():
    before = numbas_ways()
    assert before[0] is NUMBAS
    with pytest.raises(ZeroDivisionError):
        fails_inside(before)
    assert numbas_ways() == before


def test_a_refusal_is_not_kept(asked):
    def nothing(): ...

    def ask():
        return cpu_target.typing_context.resolve_function_type(nothing, (types.int64,), {})

    @overload(nothing)
    def answer(x):
        if given:
            return lambda x: x
        return None

    given = False
    cpu_target.typing_context.refresh()
    with remembered():
        with pytest.raises(TypingError):
            ask()
        given = True
        # Numba keeps that there is no implementation, but is asked for it again.
        with pytest.raises(TypingError):
            ask()
    assert asked[nothing] == 2


def test_an_overload_that_comes_later_is_not_hidden():
    def twice(): ...

    @overload(twice)
    def of_whole(x):
        return (lambda x: 2 * x) if isinstance(x, types.Integer) else None

    @kernel
    def first(x):
        return twice(x)

    assert first(3) == 6

    @overload(twice)
    def of_others(x):
        return (lambda x: x + x + 0.5) if isinstance(x, types.Float) else None

    @kernel
    def second(x):
        return twice(x)

    assert second(3.0) == 6.5
    assert second(3) == 6


def test_flags_are_equal_as_numba_has_it():
    plain, same, other = Flags(), Flags(), Flags()
    same.nrt = False  # the default, said in full
    other.nrt = True
    numbas = [one == two for one in (plain, same, other) for two in (plain, same, other)]
    hashes = [hash(one) for one in (plain, same, other)]
    with remembered():
        assert [one == two for one in (plain, same, other) for two in (plain, same, other)] == numbas
        assert [hash(one) for one in (plain, same, other)] == hashes
        assert plain != "flags"
    assert numbas == [True, True, False, True, True, False, False, False, True]


def test_flags_that_change_after_an_answer_do_not_take_it_along(asked):
    flags = Flags()
    with remembered(), targetconfig.ConfigStack().enter(flags):
        sqrt_of(types.float64)
        flags.nrt = True
        sqrt_of(types.float64)
        flags.nrt = False
        sqrt_of(types.float64)
    assert asked[np.sqrt] == 2


def test_another_numba_is_left_alone(monkeypatch):
    monkeypatch.setattr(typing_memo, "_EXPECTED", False)
    with remembered():
        assert BaseFunction.get_call_type is NUMBAS
    assert numba.njit(lambda x: x + 1)(1) == 2
