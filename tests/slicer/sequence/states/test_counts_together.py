"""Which counts of columns go together: all that any printable sequence passes, and few else."""

import numpy as np
from fields import hindered, random_extension, under_some_body
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer import generate
from slicer.cutting import cut
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
    problem = under_some_body(random, sheet(field, 12, 4))
    if problem is None:
        return
    section = Section.whole(problem, STRAIGHT)
    columns = RelaxedColumns.of(section)
    states = [choices[random.integers(len(choices))] for choices in columns.choices]
    together = counts_together(section.column, comes_before(section), states)
    order = random_extension(random, problem.n, np.argwhere(hindered(problem.segments, problem.body)))
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


def test_what_takes_too_long_is_not_told(monkeypatch):
    columns = RelaxedColumns.of(walk())
    finest = [len(choices) - 1 for choices in columns.choices]
    for chosen in (columns.coarsest, finest):
        assert columns.together(chosen) is not None
        assert columns.together(chosen, lambda: True) is None
        for limit in ("MOST_WORK", "MOST_DENSE"):
            with monkeypatch.context() as patch:
                patch.setattr(f"slicer.sequence.states.counts_together.{limit}", 0)
                assert columns.together(chosen) is None


def test_single_toolpaths_are_told_as_down_sets_are():
    """What products of matrices say, and what comparing counts of groups of one does."""
    section = walk()
    columns = RelaxedColumns.of(section)
    down_sets = [choices[-1] for choices in columns.choices]
    each = [
        states._replace(groups=np.arange(int(states.sets.size[0])), printed=members(states.sets).astype(int))
        for states in down_sets
    ]
    before = comes_before(section)
    for mask, same in zip(
        counts_together(section.column, before, down_sets),
        counts_together(section.column, before, each),
        strict=True,
    ):
        assert np.array_equal(mask, same)
