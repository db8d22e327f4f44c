"""What beam and proof share: the bound over a corridor around the incumbent, and the search below it."""

import numpy as np

from slicer.sequence.bound import PairBound
from slicer.sequence.layered.layered_search import LayeredSearch, search_layers
from slicer.sequence.layered.windows import window_search
from slicer.sequence.layered.work_budget import WorkBudget
from slicer.sequence.problem import Incumbent, Options, Problem
from slicer.sequence.states import Section, widest_corridor


def bound_around(
    problem: Problem, options: Options, incumbent: Incumbent, arcs_per_toolpath: int
) -> tuple[PairBound, bool] | None:
    """The bound over the widest corridor around the incumbent, and whether nothing was left out of it.

    On sheets too large even for that, windows are searched instead, and None is returned.
    """
    section = Section.whole(problem, options.objective)
    most_arcs = max(problem.n, 100) * arcs_per_toolpath
    corridor = widest_corridor(section, incumbent.oriented >> 1, most_arcs)
    if corridor is None:
        incumbent.offer(window_search(problem, options, incumbent.oriented))
        incumbent.report("windows", bounded=False)
        return None
    return PairBound.over(section, corridor.sets, corridor.bounds, corridor.allowed), corridor.complete


def search_below(
    bound: PairBound,
    incumbent: Incumbent,
    budget: WorkBudget,
    width: int,
    options: Options,
    *,
    complete: bool,
    most_nodes: int = np.iinfo(np.int64).max,
) -> LayeredSearch:
    """Fix states, search the rest below the incumbent, and tell it and the budget; see ``search_layers``."""
    bound.fix_states(incumbent.cost)
    bound.use_best_multipliers()
    found = search_layers(bound, incumbent.cost, width, options, most_nodes=most_nodes)
    budget.add(found)
    incumbent.offer(found.oriented)
    if complete and found.finished:
        incumbent.raise_bound(found.lower_bound)
    return found
