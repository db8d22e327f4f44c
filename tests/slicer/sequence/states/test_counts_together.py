"""Which counts of columns go together: all that any printable sequence passes, and few else."""

import numpy as np
from fields import hindered, random_body, random_extension
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer import generate
from slicer.cutting import cut
from slicer.errors import CycleError
from slicer.hatch import hatch
from slicer.nozzle import NozzleBody
from slicer.sequence import Problem
from slicer.sequence.bound.pair_bound import PairBound
from slicer.sequence.problem import Objective
from slicer.sequence.states import RelaxedColumns, Section, comes_before, cover
from slicer.sequence.states.counts_together import counts_together
from slicer.sequence.states.joint_states import joint_states, members

STRAIGHT = Objective()


def state_of(states, printed):
    """The number of a column's state in which just these of its toolpaths are printed, bool (n,)."""
    if states.groups is None:
        rows, row = members(states.sets), printed
    else:
        rows, row = states.printed, np.bincount(states.groups, printed, int(states.groups.max()) + 1)
    (found,) = np.flatnonzero((rows == row).all(axis=1))
    return found


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 10**6), st.integers(0, 10**6))
def test_whatever_a_sequence_passes_goes_together(sheet, field, seed):
    random = np.random.default_rng(seed)
    segments, body = sheet(field, 12, 4), random_body(random, 0.2)
    try:
        problem = Problem.build(segments, body=body)
    except CycleError:
        return
    section = Section.whole(problem, STRAIGHT)
    columns = RelaxedColumns.of(section)
    states = [choices[random.integers(len(choices))] for choices in columns.choices]
    together = counts_together(section, comes_before(section), states)
    if together is None:
        assert section.columns < 2 or len(section.ties) == 0
        return
    order = random_extension(random, problem.n, np.argwhere(hindered(segments, body)))
    printed = np.zeros(problem.n, np.bool_)
    for s in [None, *order]:
        if s is not None:
            printed[s] = True
        at = [state_of(some, printed[section.column == c]) for c, some in enumerate(states)]
        for c, mask in enumerate(together):
            assert mask[at[c], at[c + 1]]


def walk():
    body = NozzleBody.of(0.25, press_mm=0.02)
    segments = cut(hatch(generate.random_walk(4, 3, seed=1)).segments, body).segments
    return Section.whole(Problem.build(segments, body=body), STRAIGHT)


def test_of_down_sets_those_that_are_closed_go_together():
    section = walk()
    columns = RelaxedColumns.of(section)
    finest = [len(choices) - 1 for choices in columns.choices]
    assert all(choices[t].groups is None for choices, t in zip(columns.choices, finest, strict=True))
    sets = columns.sets(finest)
    told = columns.together(finest)
    closed = joint_states(section, sets, cover(sets))
    for mask, exact in zip(told, closed, strict=True):
        assert not (mask & ~exact).any()
        assert (mask != exact).sum() <= 0.02 * mask.size  # what a third column needs in between tells more
    assert sum(mask.sum() for mask in told) < 0.6 * sum(mask.size for mask in told)


def test_a_bound_over_counts_rises_by_it():
    section = walk()
    columns = RelaxedColumns.of(section)
    sets, together = columns.sets(columns.coarsest), columns.together(columns.coarsest)
    bounds = []
    for among in (None, together):
        bound = PairBound.over(section, sets, cover(sets), among)
        bound.improve(30.0, np.geomspace(0.3, 0.01, 40))
        bounds.append(bound.bound)
    assert bounds[1] > 1.02 * bounds[0]


def test_under_a_point_all_go_together():
    segments = hatch(generate.random_walk(3, 2, seed=1)).segments
    columns = RelaxedColumns.of(Section.whole(Problem.build(segments), STRAIGHT))
    assert columns.together(columns.coarsest) is None
