"""What beam and proof share: the bound over a corridor around the best sequence, and the search below it."""

import numpy as np

from slicer.sequence.bound import PACE, PairBound
from slicer.sequence.layered.layered_search import LayeredSearch, search_layers
from slicer.sequence.layered.windows import window_search
from slicer.sequence.layered.work_budget import WorkBudget
from slicer.sequence.problem import Search
from slicer.sequence.states import Corridor, Section, states_of_all

WHOLE = {"quick": 1, "default": 10, "high": 30}
"""So many times as many travels may be looked at where one block holds the sheet (``dynamic_programme``)."""

ARCS_PER_SECOND = 80_000_000
"""With a deadline, no more are looked at than can be in about half of the time: building states asks no
clock. A search under a deadline depends on the machine in any case.
"""


def complete_states(search: Search, arcs_per_toolpath: int) -> bool:
    """Whether a bound with so many travels for each toolpath can hold all states there are."""
    _, corridor = _widest_states(search, arcs_per_toolpath)
    return corridor is not None and corridor.complete


def bound_around(search: Search, arcs_per_toolpath: int) -> tuple[PairBound, bool] | None:
    """The bound over the widest corridor around the best sequence, and whether nothing was left out of it.

    On sheets too large even for that, windows are searched instead, and None is returned.
    """
    section, corridor = _widest_states(search, arcs_per_toolpath)
    if corridor is None:
        search.offer(window_search(search, search.oriented))
        search.report("windows")
        return None
    bound = PairBound.over(section, corridor.sets, corridor.bounds, corridor.allowed)
    bound.pace = PACE
    return bound, corridor.complete


def search_below(
    search: Search,
    bound: PairBound,
    budget: WorkBudget,
    width: int,
    *,
    complete: bool,
    most_nodes: int = np.iinfo(np.int64).max,
    enough: int = np.iinfo(np.int64).max,
) -> LayeredSearch:
    """Fix states, look for less than the best so far in the rest, and tell search and budget.

    See ``search_layers``.
    """
    bound.fix_states(search.cost)
    bound.use_best_multipliers()
    found = search_layers(search, bound, search.cost, width, most_nodes=most_nodes, enough=enough)
    budget.add(found)
    search.nodes_visited += found.nodes
    search.states_created += found.generated
    search.offer(found.oriented)
    if complete and found.finished:
        search.raise_bound(found.lower_bound)
    return found


def _widest_states(search: Search, arcs_per_toolpath: int) -> tuple[Section, Corridor | None]:
    """What ``states_of_all`` has around the best sequence."""
    most_arcs = max(search.problem.n, 100) * arcs_per_toolpath
    # What knows all that is printed is of use where travels are made over it.
    whole = WHOLE[search.effort] * most_arcs if search.objective.routed else 0
    left = search.time_left()
    if left is not None:
        whole = int(min(whole, max(0.0, left) * ARCS_PER_SECOND))
    return states_of_all(search.problem, search.objective, search.oriented >> 1, most_arcs, whole)
