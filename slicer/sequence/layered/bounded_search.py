"""What beam and proof share: the bound over a corridor around the best sequence, and the search below it."""

import numpy as np

from slicer.sequence.bound import PACE, PairBound
from slicer.sequence.layered.layered_search import LayeredSearch, search_layers
from slicer.sequence.layered.windows import window_search
from slicer.sequence.layered.work_budget import WorkBudget
from slicer.sequence.problem import Search
from slicer.sequence.states import Section, widest_joined_corridor


def bound_around(search: Search, arcs_per_toolpath: int) -> tuple[PairBound, bool] | None:
    """The bound over the widest corridor around the best sequence, and whether nothing was left out of it.

    On sheets too large even for that, windows are searched instead, and None is returned.
    """
    most_arcs = max(search.problem.n, 100) * arcs_per_toolpath
    section, corridor = widest_joined_corridor(
        Section.whole(search.problem, search.objective), search.oriented >> 1, most_arcs
    )
    if corridor is None:
        search.offer(window_search(search, search.oriented))
        search.report("windows")
        return None
    bound = PairBound.over(section, corridor.sets, corridor.bounds, corridor.allowed)
    bound.see_walls(search.cost)
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
