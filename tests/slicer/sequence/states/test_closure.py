"""What must come before what, also by way of other columns: held against the orders of random sheets."""

from itertools import pairwise

import numpy as np
from fields import hindered, random_body, random_extension
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer.errors import CycleError
from slicer.sequence import Problem
from slicer.sequence.bound.tree_bound import _may_join
from slicer.sequence.problem import Objective
from slicer.sequence.states import RelaxedColumns, Section
from slicer.sequence.states.closure import closures_of_columns, comes_before, never_follows
from slicer.sequence.states.group_counts import with_what_follows


def closed(n, pairs):
    """bool (n, n), by Warshall's algorithm."""
    before = np.zeros((n, n), np.bool_)
    before[tuple(np.array(list(pairs), int).reshape(-1, 2).T)] = True
    for k in range(n):
        before |= np.outer(before[:, k], before[k])
    return before


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 10**6), st.integers(0, 10**6))
def test_every_order_goes_by_it(sheet, field, seed):
    random = np.random.default_rng(seed)
    segments, body = sheet(field, 12, 4), random_body(random, 0.2)
    try:
        problem = Problem.build(segments, body=body)
    except CycleError:
        return
    section = Section.whole(problem, Objective())
    pairs = np.argwhere(hindered(segments, body))
    before = comes_before(section)
    exact = closed(section.n, pairs)
    assert np.array_equal(before, exact)
    between = np.any(exact[:, :, None] & exact[None], axis=1)
    never = never_follows(section, before)
    assert np.array_equal(never, exact.T | between | np.eye(section.n, dtype=np.bool_))
    a, b = np.triu_indices(section.n, 1)
    joined = _may_join(problem, a, b)
    assert joined[~(never & never.T)[a, b]].all()
    told = np.zeros_like(exact)
    told[section.pred, np.repeat(np.arange(section.n), np.diff(section.pred_start))] = True
    assert np.array_equal(joined, ~(exact | exact.T)[a, b] | (told | told.T)[a, b])
    closures = closures_of_columns(section, before)
    columns = RelaxedColumns.of(section)
    for _ in range(3):
        order = random_extension(random, section.n, pairs)
        assert not any(never[a, b] for a, b in pairwise(order))
        for c, closure in enumerate(closures):
            own = np.flatnonzero(section.column == c)
            inner = [int(np.searchsorted(own, s)) for s in order if section.column[s] == c]
            assert not any(closure.never[a, b] for a, b in pairwise(inner))
            for choice in columns.choices[c]:
                assert is_walk(with_what_follows(closure, choice), inner)


def is_walk(sets, order):
    """Whether the steps of one column in this order are there, each among those that may follow the last."""
    at, top = 0, None
    for s in order:
        (step,) = np.flatnonzero(sets.step_path[sets.step_start[at] : sets.step_start[at + 1]] == s)
        if top is not None and step not in sets.follows[sets.follow_start[top] : sets.follow_start[top + 1]]:
            return False
        step += sets.step_start[at]
        at = sets.step_to[step]
        top = sets.top_start[at] + sets.step_slot[step]
    return at == sets.start[1] - 1


def test_what_another_column_has_in_between_orders_a_column():
    """The lower one of a column's two lines, then one beside them, then the upper one."""
    segments = np.array([[[0.0, 0.0], [0.2, 0.0]], [[0.5, 0.1], [0.7, 0.1]], [[0.0, 0.2], [0.2, 0.2]]])
    edges = np.array([[0, 1], [1, 2]], np.int32)
    section = Section.whole(Problem.build(segments, edges=edges), Objective())
    assert section.column.tolist() == [0, 1, 0]
    assert not comes_before(section.part(section.column == 0)).any()
    before = comes_before(section)
    closure = closures_of_columns(section, before)[0]
    assert closure.before.tolist() == [[False, True], [False, False]]
    assert closure.never.tolist() == [[True, False], [True, True]]  # next of its column it is
    assert never_follows(section, before)[0, 2]  # but not of the sequence
    assert np.diff(RelaxedColumns.of(section).choices[0][0].sets.step_start).tolist() == [1, 1, 0]
