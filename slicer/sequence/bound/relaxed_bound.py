"""The column-pair bound of sheets that nothing else has bounded: over down-sets, or over counts of what is
printed where columns have too many of those.

The same decomposition as in ``pair_costs``, for every objective. Steep columns are given states that are
relaxed as little as the effort allows (``states.relaxed_sets``), and visits have multipliers (``visits``).
"""

import numpy as np

from slicer.sequence.bound.nearby import PACE
from slicer.sequence.bound.pair_bound import PairBound
from slicer.sequence.bound.subgradient_ascent import step_lengths
from slicer.sequence.bound.tree_bound import raise_tree_bound
from slicer.sequence.problem import Search
from slicer.sequence.states import Section, cover, relaxed_sets

ARCS = {"quick": 200_000_000, "default": 3_000_000_000, "high": 60_000_000_000}
"""Travels looked at in all steps, at about 0.7 ns each."""
STEPS = {"quick": 20, "default": 40, "high": 100}
"""Steps for which states are made as fine as the travels allow; the rest of them goes into more steps."""
MOST_STEPS = {"quick": 20, "default": 150, "high": 300}
LAST_LENGTHS = 0.4
"""Over counts, the last step is so long a part of the cost, over the number of steps: such bounds end far
below the cost, and shorter steps stay where they are. ihc_8x8 comes to 78.1 mm in 40 steps, and to 76.5 with
the lengths that suit down-sets."""
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
    relaxed = relaxed_sets(section, most // STEPS[search.effort], STRETCH * most // LEAST_STEPS)
    if relaxed is None:
        return False
    sets, _ = relaxed
    bound = PairBound.over(section, sets, cover(sets))
    if search.should_stop():
        return False
    bound.see_walls(search.cost)
    bound.pace = PACE
    arcs = max(1, bound.looked_at.arcs)
    useful = min(USEFUL_STEPS, STRETCH * most // arcs)
    steps = int(np.clip(most // arcs, max(LEAST_STEPS, useful), MOST_STEPS[search.effort]))
    at_once = max(1, min(max(AT_ONCE, PER_LOOK * bound.blocks.arcs // arcs), MOST_BETWEEN // arcs))
    lengths = step_lengths(steps) if sets.complete else step_lengths(steps, last=LAST_LENGTHS / steps)
    looked_at = 0
    for done in range(0, steps, at_once):
        if looked_at > STRETCH * most or search.proved or search.should_stop():
            break
        now = lengths[done : done + at_once]
        looked_at += bound.arcs_of(len(now))
        at_rest = bound.improve(search.cost, now)
        search.raise_bound_on_all(bound.bound)
        search.report("bound")
        if at_rest:
            break
    return search.lower_bound > 0.0
