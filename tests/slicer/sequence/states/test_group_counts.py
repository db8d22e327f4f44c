"""Counts of groups: every sequence is a walk through them."""

import itertools
import json
from dataclasses import replace

import numpy as np
from counted import relaxed_sets, walks_through
from fields import random_extension, relation, segment_sets
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from slicer import grid
from slicer.hatch import hatch
from slicer.sequence import Problem
from slicer.sequence.problem.objective import Objective
from slicer.sequence.states.closure import Closure, closures_of_columns
from slicer.sequence.states.group_counts import (
    Relaxation,
    _counted,
    coarse_relaxations,
    relaxations,
    with_what_follows,
)
from slicer.sequence.states.section import Section


def choices_of(part: Section, most: int) -> tuple[Closure, list[Relaxation]]:
    """What must come before what of one column, and all its states."""
    (closure,) = closures_of_columns(part, None)
    return closure, relaxations(part, closure, coarse_relaxations(part, closure, most))


@settings(max_examples=100, deadline=None)
@given(segment_sets(max_n=9), st.integers(0, 10**6))
def test_every_printable_order_is_a_walk(segments, seed):
    assume(len(segments))
    random = np.random.default_rng(seed)
    problem = Problem.build(segments)
    section = Section.whole(problem, Objective())
    order = random_extension(random, problem.n, np.argwhere(relation(segments)))
    sets = relaxed_sets(section, int(random.integers(0, 10_000)))
    for c in range(section.columns):
        own = [int(s) for s in order if section.column[s] == c]
        assert walks_through(sets, own, c)
        part = section.part(section.column == c)
        place = {int(s): k for k, s in enumerate(np.flatnonzero(section.column == c))}
        closure, choices = choices_of(part, 1_000)
        for choice in choices:
            assert walks_through(with_what_follows(closure, choice), [place[s] for s in own], 0)


@settings(max_examples=60, deadline=None)
@given(segment_sets(max_n=9))
def test_they_go_from_one_group_to_the_down_sets(segments):
    assume(len(segments))
    section = Section.whole(Problem.build(segments), Objective())
    for c in range(section.columns):
        part = section.part(section.column == c)
        choices = [choice.sets for choice in choices_of(part, 1_000)[1]]
        assert choices[0].counts.tolist() == [part.n + 1]
        assert choices[-1].complete
        assert [choice.complete for choice in choices[:-1]] == [False] * (len(choices) - 1)
        assert len(choices_of(part, 0)[1]) >= 1


def test_each_choice_has_more_groups_than_the_one_before():
    """Families that are told apart come before their parts, however many of these there are."""
    angles = np.random.default_rng(1).uniform(60.0, 90.0, (8, 1))
    described = {"tile_mm": 1.0, "spacing_mm": 0.25, "angles_deg": angles.tolist()}
    section = Section.whole(Problem.build(hatch(grid.loads(json.dumps(described))).segments), Objective())
    groups = [choice.groups for choice in choices_of(section.part(section.column == 0), 0)[1]]
    counts = [int(of_each.max()) + 1 for of_each in groups]
    assert counts[:3] == [1, 4, 8]
    assert counts == sorted(set(counts))
    for coarse, fine in itertools.pairwise(groups[:3]):
        assert len(np.unique(np.stack([coarse, fine]), axis=1).T) == fine.max() + 1


def test_numbers_of_many_groups_are_exact_beyond_what_floats_hold():
    stack = [[[0.0, y], [1.0, y]] for y in np.arange(72) * 0.1]
    section = Section.whole(Problem.build(np.array(stack)), Objective())
    part = section.part(section.column == 0)
    before = np.triu(np.ones((72, 72), np.bool_), 1)
    groups = np.arange(72) // 2  # 3^36 numbers, between 2^53 and 2^62
    sets = _counted(part, before, groups, 4_000).sets
    assert sets.counts.tolist() == [73]
    assert walks_through(sets, list(range(72)), 0)


def test_what_follows_has_room_for_what_both_toolpaths_need():
    """Two stacks side by side: the top of one cannot come after the bottom of the other too early or too late."""
    stacks = [[[x, y], [x + 0.4, y]] for x in (0.0, 0.5) for y in (0.0, 0.1, 0.2)]
    section = Section.whole(Problem.build(np.array(stacks)), Objective())
    part = replace(section, column=np.zeros(6, np.int32), extent=np.array([[0.0, 0.9]]))
    closure, (one_group, *_) = choices_of(part, 0)
    sets = with_what_follows(closure, one_group)
    assert one_group.groups.tolist() == [0] * 6
    bottom, top = 0, 5
    by_count = []
    for d in range(7):
        for t in range(sets.top_start[d], sets.top_start[d + 1]):
            if sets.top_path[t] == bottom:
                next_ones = sets.step_start[d] + sets.follows[sets.follow_start[t] : sets.follow_start[t + 1]]
                steps = sets.step_path[sets.step_start[d] : sets.step_start[d + 1]]
                by_count.append(
                    (int(one_group.printed[d, 0]), top in steps, top in sets.step_path[next_ones])
                )
    # The bottom alone, then what is under the top as well; after it, all else of its own stack is left.
    assert by_count == [(1, False, False), (2, True, False), (3, True, True), (4, True, False)]


def test_real_down_sets_let_all_steps_follow():
    section = Section.whole(Problem.build(np.array([[[x, 0.0], [x, 1.0]] for x in (0.0, 0.1)])), Objective())
    part = section.part(section.column == 0)
    closure, choices = choices_of(part, 100)
    sets = with_what_follows(closure, choices[-1])
    assert np.array_equal(
        np.diff(sets.follow_start), np.repeat(np.diff(sets.step_start), np.diff(sets.top_start))
    )
