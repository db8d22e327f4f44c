"""Window search: order a few consecutive toolpaths of a sequence anew, exactly or nearly so, everywhere.

What a window holds is bounded by the two down-sets before and after it, so that its columns have few
down-sets of their own. Where the pair bound of a window reaches what the window costs, there is nothing to
gain; elsewhere a narrow layered search looks for less. Windows overlap by half, and grow when a pass over
the sequence finds nothing.
"""

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.bound import PairBound
from slicer.sequence.layered.layered_search import RELATIVE_EPS, search_layers
from slicer.sequence.layered.work_budget import ARCS_PER_NODE, WorkBudget
from slicer.sequence.problem import Search
from slicer.sequence.states import Ground, Section, cover, down_sets, extents, join_tied_columns, section_cost

FIRST_LENGTH = 50
GROWTH = 1.4
LENGTHS = np.geomspace(0.16, 0.01, 6)
"""Of the steps of the bound for each window. On ihc_8x8 from two to twelve serve as well in the same time."""
WIDTH = 100
"""Nodes of a layer in a window's search."""
MOST_DOWN_SETS = 300
"""A column of a window with more than these is searched in a corridor around the given order."""
MERGED_STATES = 2_000
WORK_PER_TOOLPATH = {"quick": 2_000, "default": 10_000, "high": 60_000}
SECONDS_UNDER_A_BODY = 1.5e-7
"""What a unit of work takes there, about, twice as much as for a point."""


def window_search(
    search: Search,
    oriented: NDArray[np.int32],
    *,
    work: int | None = None,
    length: int = FIRST_LENGTH,
    exhausted: set[bytes] | None = None,
    thrifty: bool = False,
) -> NDArray[np.int32]:
    """Improve a printable sequence by window search; what comes back costs no more.

    Args:
        search: effort, objective, and when to stop; it is not told.
        oriented: int32 (n,), oriented toolpaths.
        work: the budget, as a ``WorkBudget`` counts it; None for that of the effort.
        length: toolpaths in a window, at first.
        thrifty: the first pass that saves fewer seconds than it takes is the last.
        exhausted: windows that hold nothing to gain; those found are added. None where none is known yet.

    Returns:
        int32 (n,), oriented toolpaths.
    """
    problem, objective = search.problem, search.objective
    n = problem.n
    budget = WorkBudget(WORK_PER_TOOLPATH[search.effort] * n if work is None else work)
    best = oriented.copy()
    extent = extents(problem)
    exhausted = set() if exhausted is None else exhausted
    while n > 1:
        length = min(length, n)
        gained, spent = 0.0, budget.spent
        ground, done = Ground(problem.segments, problem.body), 0
        for begin in _begins(n, length):
            if budget.spent >= budget.limit or search.should_stop():
                return best
            window = best[begin : begin + length]
            if window.tobytes() in exhausted:
                continue
            if objective.routed:
                ground.print(best[done:begin])
                done = begin
            section = Section.window(problem, objective, best, begin, begin + length, ground.pieces(), extent)
            section = join_tied_columns(section, MOST_DOWN_SETS)
            gain = improve_window(search, section, window, budget)
            gained += gain
            if gain == 0.0:
                exhausted.add(window.tobytes())
        if thrifty and not search.won_back(gained, SECONDS_UNDER_A_BODY * (budget.spent - spent)):
            break
        if gained == 0.0:
            if length == n:
                break
            length = int(length * GROWTH) + 1
    return best


def _begins(n: int, length: int) -> list[int]:
    """Where the windows of a pass begin; the last one reaches the end."""
    stride = max(1, length // 2)
    return [*range(0, n - length, stride), n - length]


def improve_window(search: Search, section: Section, inner: NDArray[np.int32], budget: WorkBudget) -> float:
    """Order a window anew, in place, and say by how much cheaper it has become.

    Args:
        search: is asked whether to stop.
        section: the window as a section.
        inner: int32 (k,), the oriented toolpaths of the window.
        budget: where the work is entered.
    """
    order = np.arange(section.n, dtype=np.int32)
    sets = down_sets(section, MOST_DOWN_SETS, order)
    bound = PairBound.over(section, sets, cover(sets, MERGED_STATES))
    cost = section_cost(section, sets, bound.sky, 2 * order + (inner & 1))
    budget.spent += 500 + len(LENGTHS) * bound.blocks.arcs // ARCS_PER_NODE
    bound.improve(cost, LENGTHS)
    if bound.bound >= cost * (1 - RELATIVE_EPS):
        return 0.0
    bound.use_best_multipliers()
    found = search_layers(search, bound, cost, WIDTH)
    budget.add(found)
    if found.oriented is None or found.cost >= cost:
        return 0.0
    inner[:] = 2 * (inner[found.oriented >> 1] >> 1) + (found.oriented & 1)
    return cost - found.cost
