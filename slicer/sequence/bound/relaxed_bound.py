"""The column-pair bound of sheets that nothing else has bounded: over down-sets, or over counts of what is
printed where columns have too many of those.

The same decomposition as in ``pair_costs``, for every objective. Steep columns are given counts
(``states.RelaxedColumns``), and visits have multipliers (``visits``). The coarsest counts, a single group in
most columns, find nearly the same prices as finer ones in a fraction of the time; from these, some steps over
finer ones see more.
"""

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.bound.nearby import PACE
from slicer.sequence.bound.pair_bound import PairBound
from slicer.sequence.bound.subgradient_ascent import step_lengths
from slicer.sequence.bound.tree_bound import raise_tree_bound
from slicer.sequence.problem import Search
from slicer.sequence.states import DownSets, RelaxedColumns, Section, cover, few_down_sets

ARCS = {"quick": 200_000_000, "default": 2_500_000_000, "high": 30_000_000_000}
"""Travels looked at in all steps, at about 0.6 ns each."""
STEPS = {"quick": 20, "default": 40, "high": 100}
"""Steps for which the travels of all down-sets have to be enough."""
MOST_STEPS = {"quick": 20, "default": 150, "high": 300}
"""What is left goes into more steps."""
MOST_STEPS_OF_EACH = {"quick": 20, "default": 100, "high": 150}
"""The same where steps over the coarsest counts and over finer ones share the travels, of each."""
COARSE_SHARE = {"quick": 0.5, "default": 0.3, "high": 0.4}
"""Of the travels, those of steps over the coarsest counts, where there are enough for both."""
FINER_STEPS = {"quick": 4, "default": 12, "high": 20}
FINER_STEPS_WHEN_TIED = {"quick": 6, "default": 20, "high": 40}
"""Steps over finer counts at least, which are made as fine as the travels that are left allow.

From prices that coarse counts have found, ihc_8x8 comes to 80.2 mm in 5.0 s; over the coarsest alone to 79.4,
and over finer ones alone to 79.3.
"""
ENOUGH_FOR_BOTH, ENOUGH_WHEN_ROUTED, ENOUGH_WHEN_TIED = 45, 90, 20
"""So many steps over the coarsest counts alone have to be affordable, or else none are left for others.

The second where travels are routed, and mostly timed: there finer counts bring less. ihc_8x8 comes to 27.82 s
in 2.1 s over the coarsest alone, and with finer ones to 27.99 in 3.1. The third where a nozzle's body ties
columns: finer counts tell better which go together, and few do. Under a needle of 25G that sheet comes to
39.2 s over the coarsest alone, and to 44.5 with finer ones.
"""
FINER_LENGTH, LAST_LENGTHS = 2.0, (0.6, 0.4)
"""Over counts, the first step over finer ones, and the last one over coarse ones and of all, are so long a
part of the cost, over the number of coarse steps. Such bounds end far below the cost, and shorter steps stay
where they are."""
MOST_BYTES = {"quick": 4e8, "default": 8e8, "high": 2.5e9}
"""What a bound over finer states may take."""
AT_ONCE, PER_LOOK = 20, 1
"""Steps between two looks at all states, or so many times as many as take as long as a look,"""
MOST_BETWEEN = 2_500_000_000
"""but no more than look at so many travels: the clock is asked then, too."""
USEFUL_STEPS, LEAST_STEPS = 30, 6
"""Fewer steps than the first bring much less: ihc_16x16 comes to 266 mm after 20, to 270 after 30 and to 273
after 40. Fewer than the second are no use."""
STRETCH = 4
"""For so many steps, so many times as many travels may be looked at."""
MOST_TRAVELS = 40_000_000
"""Travels between the toolpaths of neighbouring columns that are tabulated at all, at 16 bytes each, and
25 more for those whose multipliers move."""
MOST_TOOLPATHS = 1_500
"""A column with more has so many counts and steps that telling them apart alone takes too long."""


def raise_relaxed_bound(search: Search) -> None:
    """Give a search without a bound one, as high as the effort allows; on the largest sheets, by a tree.

    It rises towards the cost of the best sequence, and so comes last. Nothing is done where the time is over,
    or for a search that serves another one, whose turn comes when its own sequence is found.
    """
    if search.lower_bound > 0.0 or search.problem.n < 2 or search.serves_another or search.should_stop():
        return None
    if not _raise_by_pairs(search) and not search.stopped:
        raise_tree_bound(search)
    return None


def _raise_by_pairs(search: Search) -> bool:
    """Raise the bound over down-sets or counts; False where there can be none, or where it is not above 0."""
    section = Section.whole(search.problem, search.objective)
    size = np.bincount(section.column).astype(np.int64)
    beside = size[:-1] + size[1:] if len(size) > 1 else size
    if int(((2 * beside) ** 2).sum()) > MOST_TRAVELS or size.max() > MOST_TOOLPATHS:
        return False
    most = ARCS[search.effort]
    sets = few_down_sets(section, most // STEPS[search.effort])
    if sets is not None:
        bound = _prepared(search, PairBound.over(section, sets, cover(sets)))
        steps = _steps(bound, most, MOST_STEPS[search.effort])
        _climb(search, bound, step_lengths(steps), most)
        return search.lower_bound > 0.0
    columns = RelaxedColumns.coarse(section)
    if search.should_stop():
        return False
    together = columns.together(columns.coarsest, search.should_stop)
    if search.should_stop() or columns.arcs(columns.coarsest, together) > STRETCH * most // LEAST_STEPS:
        return False
    sets = columns.sets(columns.coarsest)
    if sets is None or search.should_stop():
        return False
    _raise_over_counts(search, columns, sets, together)
    return search.lower_bound > 0.0


def _raise_over_counts(
    search: Search,
    columns: RelaxedColumns,
    coarsest: DownSets,
    together: list[NDArray[np.bool_]] | None,
) -> None:
    """Take steps over the coarsest counts, and some over finer ones, where there are travels for both."""
    section, most = columns.section, ARCS[search.effort]
    finer_steps = (FINER_STEPS if together is None else FINER_STEPS_WHEN_TIED)[search.effort]
    coarse = int(COARSE_SHARE[search.effort] * most)
    bound = _prepared(search, PairBound.over(section, coarsest, cover(coarsest), together, columns.never))
    arcs = max(1, bound.looked_at.arcs)
    finest = columns.coarsest
    enough = ENOUGH_WHEN_ROUTED if search.objective.routed else ENOUGH_FOR_BOTH
    enough = enough if together is None else ENOUGH_WHEN_TIED
    if most // arcs >= enough and not search.should_stop():
        # Of all pairs of states those that go together and are near.
        share = arcs / columns.arcs(columns.coarsest)
        columns = columns.with_all_choices()
        finest = columns.finest(int((most - coarse) / finer_steps / share), MOST_BYTES[search.effort])
    if finest == columns.coarsest:
        steps = _steps(bound, most, MOST_STEPS[search.effort])
        _climb(search, bound, step_lengths(steps, last=LAST_LENGTHS[1] / steps), most)
        return
    steps = _steps(bound, coarse, MOST_STEPS_OF_EACH[search.effort])
    if not _climb(search, bound, step_lengths(steps, last=LAST_LENGTHS[0] / steps), coarse):
        return
    sets, finer = columns.sets(finest), columns.together(finest, search.should_stop)
    # Where it cannot be told which of them go together, all would be too many.
    if sets is None or (finer is None) != (together is None) or search.should_stop():
        return
    found = bound
    bound = _prepared(search, PairBound.over(section, sets, cover(sets), finer, columns.never))
    bound.go_on_from(found)
    del found
    finer_steps = max(finer_steps, _steps(bound, most - coarse, MOST_STEPS_OF_EACH[search.effort], 1))
    _climb(search, bound, np.geomspace(FINER_LENGTH, LAST_LENGTHS[1], finer_steps) / steps, most - coarse)


def _prepared(search: Search, bound: PairBound) -> PairBound:
    """The bound with what the search can afford of it."""
    if not search.should_stop():
        bound.see_walls(search.cost)
    bound.pace = PACE
    return bound


def _steps(bound: PairBound, most: int, most_steps: int, useful_steps: int = USEFUL_STEPS) -> int:
    """How many steps a bound takes with so many travels."""
    arcs = max(1, bound.looked_at.arcs)
    useful = min(useful_steps, STRETCH * most // arcs)
    return int(np.clip(most // arcs, max(LEAST_STEPS, useful), most_steps))


def _climb(search: Search, bound: PairBound, lengths: NDArray[np.float64], most: int) -> bool:
    """Raise a bound and tell the search, until too many travels have been looked at; False where nothing
    higher can be found, or the time is over."""
    arcs = max(1, bound.looked_at.arcs)
    at_once = max(1, min(max(AT_ONCE, PER_LOOK * bound.blocks.arcs // arcs), MOST_BETWEEN // arcs))
    looked_at = 0
    for done in range(0, len(lengths), at_once):
        if search.proved or search.should_stop():
            return False
        if looked_at > STRETCH * most:
            break
        now = lengths[done : done + at_once]
        looked_at += bound.arcs_of(len(now))
        at_rest = bound.improve(search.cost, now)
        search.raise_bound_on_all(bound.bound)
        search.report("bound")
        if at_rest:
            return False
    return not search.proved and not search.should_stop()
