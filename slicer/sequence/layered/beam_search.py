"""Beam search over down-sets, guided by the column-pair bound.

The bound is raised for a while, then a layered search keeps the most promising nodes of each layer. A first,
narrow search gives the ascent a cost to aim at. Where the columns have too many down-sets, the search stays
in a corridor around the incumbent, and is repeated around what it finds. On sheets too large for any
corridor, window search takes its place.
"""

from slicer.sequence.bound import raise_relaxed_bound
from slicer.sequence.construct import start_greedily
from slicer.sequence.layered.bounded_search import bound_around, complete_states, search_below
from slicer.sequence.layered.work_budget import WorkBudget, raise_bound
from slicer.sequence.problem import Search

ARCS_PER_TOOLPATH = {"quick": 10_000, "default": 40_000, "high": 120_000}
"""How large the bound may be: what one evaluation looks at, for each toolpath."""
PASSES = {
    "quick": ((20, 2_500, False), (20, 5_000, False)),
    "default": ((20, 2_500, False), (60, 50_000, False)),
    "high": ((30, 2_500, False), (100, 50_000, False), (200, 250_000, False)),
}
"""Steps of the bound, the successors of a layer in the search after them, and whether that is for where a
search before it has found something.
"""
ROUTED_PASSES = PASSES | {
    "quick": ((20, 2_500, False),),
    "default": ((130, 5_000, False), (0, 15_000, False), (0, 70_000, True)),
}
"""The same where states know walls: there a search costs more than steps.

On dti_small_101D_sagittal_10x10 the narrow ones find nothing below 44.9 s, nor does the dear one; on a random
walk of 10x10 they come from 45.3 to 45.1 s, and that one to 44.8.
"""
SECONDS = 1.2e-7
"""What a successor takes, about: the dear search is made only for what it may win back."""
MOST_STEPPED = {"quick": 100_000_000, "default": 1_200_000_000, "high": 10_000_000_000}
"""Travels that the steps of a pass may look at, or there are fewer of them."""
MOST_GENERATED = 100_000_000
"""Successors of all layers of a search."""
SUCCESSORS_PER_COLUMN = 5
"""About so many successors has a node for each column of the sheet."""
LEAST_WIDTH = 5
MOST_CORRIDORS = 4


def beam_sees_all(search: Search) -> bool:
    """Whether the beam can look at all states there are; for a started search."""
    return complete_states(search, ARCS_PER_TOOLPATH[search.effort])


def beam(search: Search) -> None:
    """Beam search around the best sequence so far, or around greedy's."""
    start_greedily(search)
    budget = WorkBudget(0)
    for _ in range(MOST_CORRIDORS):
        before = search.cost
        if _search_corridor(search, budget) or search.cost >= before or search.should_stop():
            break
    raise_relaxed_bound(search)


def _search_corridor(search: Search, budget: WorkBudget) -> bool:
    """All passes over the states around the best sequence; whether those were all states there are."""
    opened = bound_around(search, ARCS_PER_TOOLPATH[search.effort])
    if opened is None:
        return False
    bound, complete = opened
    bound.see_walls(search.cost)
    passes = (ROUTED_PASSES if search.objective.routed else PASSES)[search.effort]
    begun = search.cost
    for steps, successors, encouraged in passes:
        affordable = min(successors, MOST_GENERATED // search.problem.n)
        worth = search.cost < begun and search.pays(SECONDS * affordable * search.problem.n)
        if encouraged and not worth:
            break
        steps = min(steps, MOST_STEPPED[search.effort] // max(1, bound.looked_at.arcs))
        width = max(LEAST_WIDTH, affordable // (SUCCESSORS_PER_COLUMN * bound.section.columns))
        raise_bound(search, bound, budget, steps, complete=complete)
        if bound.bound >= search.cost or search.should_stop():
            break
        found = search_below(search, bound, budget, width, complete=complete)
        search.report("search")
        if found.lower_bound >= search.cost or not found.finished:
            break
    return complete
