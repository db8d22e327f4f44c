"""Counts of groups: every sequence is a walk through them."""

import numpy as np
from fields import random_extension, relation, segment_sets
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from slicer.sequence import Problem
from slicer.sequence.problem.objective import Objective
from slicer.sequence.states.downsets import DownSets
from slicer.sequence.states.group_counts import _counted, never_follows, relaxations
from slicer.sequence.states.relaxed_columns import relaxed_sets
from slicer.sequence.states.section import Section


def walks_through(sets: DownSets, order: list[int], column: int) -> bool:
    """Whether a column's toolpaths, in this order, are steps from its first state to its last."""
    at = sets.start[column]
    for s in order:
        steps = range(sets.step_start[at], sets.step_start[at + 1])
        taken = [e for e in steps if sets.step_path[e] == s]
        if len(taken) != 1:
            return False
        at = sets.step_to[taken[0]]
        if sets.top_path[sets.top_start[at] + sets.step_slot[taken[0]]] != s:
            return False
    return at == sets.start[column + 1] - 1


@settings(max_examples=100, deadline=None)
@given(segment_sets(max_n=9), st.integers(0, 10**6))
def test_every_printable_order_is_a_walk(segments, seed):
    assume(len(segments))
    random = np.random.default_rng(seed)
    problem = Problem.build(segments)
    section = Section.whole(problem, Objective())
    order = random_extension(random, problem.n, np.argwhere(relation(segments)))
    sets, _ = relaxed_sets(section, int(random.integers(0, 10_000)))
    for c in range(section.columns):
        own = [int(s) for s in order if section.column[s] == c]
        assert walks_through(sets, own, c)
        part = section.part(section.column == c)
        place = {int(s): k for k, s in enumerate(np.flatnonzero(section.column == c))}
        for choice in relaxations(part, 1_000):
            assert walks_through(choice, [place[s] for s in own], 0)
        never = never_follows(part)
        for s, t in zip(order[:-1], order[1:], strict=True):
            if section.column[s] == section.column[t] == c:
                assert not never[place[int(s)], place[int(t)]]


@settings(max_examples=60, deadline=None)
@given(segment_sets(max_n=9))
def test_they_go_from_one_group_to_the_down_sets(segments):
    assume(len(segments))
    section = Section.whole(Problem.build(segments), Objective())
    for c in range(section.columns):
        part = section.part(section.column == c)
        choices = relaxations(part, 1_000)
        assert choices[0].counts.tolist() == [part.n + 1]
        assert choices[-1].complete
        assert [choice.complete for choice in choices[:-1]] == [False] * (len(choices) - 1)
        assert len(relaxations(part, 0)) >= 1


def test_numbers_of_many_groups_are_exact_beyond_what_floats_hold():
    stack = [[[0.0, y], [1.0, y]] for y in np.arange(72) * 0.1]
    section = Section.whole(Problem.build(np.array(stack)), Objective())
    part = section.part(section.column == 0)
    before = np.triu(np.ones((72, 72), np.bool_), 1)
    groups = np.arange(72) // 2  # 3^36 numbers, between 2^53 and 2^62
    sets = _counted(part, before, groups, 4_000)
    assert sets.counts.tolist() == [73]
    assert walks_through(sets, list(range(72)), 0)
