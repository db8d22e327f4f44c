"""What must come before what, also by way of other columns: held against the orders of random sheets."""

from itertools import pairwise

import numpy as np
from counted import walks_through
from fields import closure, hindered, random_extension, under_some_body
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer.sequence import Problem
from slicer.sequence.bound.tree_bound import _may_join
from slicer.sequence.problem import Objective
from slicer.sequence.states import RelaxedColumns, Section
from slicer.sequence.states.closure import closures_of_columns, comes_before, never_follows
from slicer.sequence.states.group_counts import with_what_follows


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 10**6), st.integers(0, 10**6))
def test_every_order_goes_by_it(sheet, field, seed):
    random = np.random.default_rng(seed)
    problem = under_some_body(random, sheet(field, 12, 4))
    if problem is None:
        return
    section = Section.whole(problem, Objective())
    pairs = np.argwhere(hindered(problem.segments, problem.body))
    before = comes_before(section)
    exact = closure(hindered(problem.segments, problem.body))
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
        for c, inside in enumerate(closures):
            own = np.flatnonzero(section.column == c)
            inner = [int(np.searchsorted(own, s)) for s in order if section.column[s] == c]
            assert not any(inside.never[a, b] for a, b in pairwise(inner))
            for choice in columns.choices[c]:
                assert walks_through(with_what_follows(inside, choice), inner, 0)


def test_what_another_column_has_in_between_orders_a_column():
    """The lower one of a column's two lines, then one beside them, then the upper one."""
    segments = np.array([[[0.0, 0.0], [0.2, 0.0]], [[0.5, 0.1], [0.7, 0.1]], [[0.0, 0.2], [0.2, 0.2]]])
    edges = np.array([[0, 1], [1, 2]], np.int32)
    section = Section.whole(Problem.build(segments, edges=edges), Objective())
    assert section.column.tolist() == [0, 1, 0]
    assert not comes_before(section.part(section.column == 0)).any()
    before = comes_before(section)
    inside = closures_of_columns(section, before)[0]
    assert inside.before.tolist() == [[False, True], [False, False]]
    assert inside.never.tolist() == [[True, False], [True, True]]  # next of its column it is
    assert never_follows(section, before)[0, 2]  # but not of the sequence
    assert np.diff(RelaxedColumns.of(section).choices[0][0].sets.step_start).tolist() == [1, 1, 0]
