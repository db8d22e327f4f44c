"""Down-sets of columns against their definition."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer.sequence import Problem
from slicer.sequence.problem.objective import Objective
from slicer.sequence.states.downsets import DownSets, any_order, down_sets
from slicer.sequence.states.one_column import UNLIMITED
from slicer.sequence.states.section import Section, extents


def members(sets: DownSets, column: int) -> dict[int, frozenset[int]]:
    """The toolpaths of each down-set of a column, followed from the empty one along the steps."""
    known = {int(sets.start[column]): frozenset[int]()}
    for i in range(sets.start[column], sets.start[column + 1]):
        for e in range(sets.step_start[i], sets.step_start[i + 1]):
            grown = known[i] | {int(sets.step_path[e])}
            assert known.setdefault(int(sets.step_to[e]), grown) == grown
    return known


def all_down_sets(problem: Problem, column: int) -> set[frozenset[int]]:
    paths = [int(s) for s in np.flatnonzero(problem.column == column)]
    under = {s: set(problem.pred[problem.pred_start[s] : problem.pred_start[s + 1]].tolist()) for s in paths}
    found, frontier = {frozenset[int]()}, [frozenset[int]()]
    while frontier:
        printed = frontier.pop()
        for s in paths:
            grown = printed | {s}
            if s not in printed and under[s] <= printed and grown not in found:
                found.add(grown)
                frontier.append(grown)
    return found


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_every_down_set_is_there_once_with_its_steps_and_maximal_elements(sheet, seed):
    problem = Problem.build(sheet(seed, 24))
    sets = down_sets(Section.whole(problem, Objective()), 10**6)
    assert sets.complete
    for c in range(len(sets.size)):
        expected = all_down_sets(problem, c)
        known = members(sets, c)
        assert len(known) == sets.counts[c] == len(expected)
        assert set(known.values()) == expected
        for i, printed in known.items():
            tops = sets.top_path[sets.top_start[i] : sets.top_start[i + 1]].tolist()
            covered = {int(p) for s in printed for p in problem.pred[slice(*problem.pred_start[s : s + 2])]}
            assert sorted(tops) == sorted(printed - covered)
            for e in range(sets.step_start[i], sets.step_start[i + 1]):
                to = sets.step_to[e]
                assert to > i
                assert sets.top_path[sets.top_start[to] + sets.step_slot[e]] == sets.step_path[e]


def test_a_fixed_first_toolpath_is_in_every_down_set_of_its_column_but_the_empty_one(sheet):
    for seed in range(30):
        problem = Problem.build(sheet(seed, 24))
        first = int(problem.starts[-1] >> 1)
        problem = Problem.build(problem.segments, first=first)
        sets = down_sets(Section.whole(problem, Objective()), 10**6)
        known = members(sets, int(problem.column[first]))
        assert sum(first not in printed for printed in known.values()) == 1


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6), limit=st.integers(2, 12))
def test_a_corridor_is_small_and_holds_the_guiding_order(sheet, seed, limit):
    section = Section.whole(Problem.build(sheet(seed, 30, 4)), Objective())
    guide = any_order(section)
    sets = down_sets(section, limit, guide)
    everything = down_sets(section, 10**6)
    for c in range(len(sets.size)):
        order = [int(s) for s in guide if section.column[s] == c]
        known = set(members(sets, c).values())
        assert all(frozenset(order[:k]) in known for k in range(len(order) + 1))
        assert len(known) <= max(limit, len(order) + 1)
        assert known <= set(members(everything, c).values())
        assert (sets.corridor[c] == UNLIMITED) == (len(known) == everything.counts[c]) or sets.corridor[c] > 3


def test_a_window_is_ordered_by_the_precedence_of_the_whole(sheet):
    for seed in range(30):
        problem = Problem.build(sheet(seed, 40, 8))
        whole = Section.whole(problem, Objective())
        order = any_order(whole)
        assert problem.refusal(order) is None
        window = Section.window(
            problem,
            Objective(),
            (2 * order).astype(np.int32),
            2,
            problem.n - 1,
            np.empty((0, 4)),
            extents(problem),
        )
        again = order[2:-1][any_order(window)]
        assert again[0] == order[2]
        assert again[-1] == order[-2]
        assert problem.refusal(np.concatenate([order[:2], again, order[-1:]])) is None


@pytest.mark.parametrize("count", [1, 2, 300])
def test_an_antichain_has_a_column_for_each_toolpath(count):
    x = np.arange(count, dtype=float)
    segments = np.stack([np.stack([x, 0 * x], 1), np.stack([x + 0.5, 0 * x], 1)], 1)
    sets = down_sets(Section.whole(Problem.build(segments), Objective()), 100)
    assert sets.counts.tolist() == [2] * count


def test_a_chain_has_one_down_set_more_than_toolpaths():
    y = np.arange(50, dtype=float)
    segments = np.stack([np.stack([0 * y, y], 1), np.stack([0 * y + 1, y], 1)], 1)
    sets = down_sets(Section.whole(Problem.build(segments), Objective()), 100)
    assert sets.counts.tolist() == [51]
    assert all(b == a + 1 for a, b in pairwise(sets.step_to.tolist()))
