"""Beam search over down-sets, guided by the column-pair bound.

The bound is raised for a while, then a layered search keeps the most promising nodes of each layer. A first,
narrow search gives the ascent a cost to aim at. Where the columns have too many down-sets, the search stays
in a corridor around the incumbent, and is repeated around what it finds. On sheets too large for any
corridor, window search takes its place.
"""

import numpy as np

from slicer.sequence.construct import initial_incumbent
from slicer.sequence.layered.bounded_search import bound_around, search_below
from slicer.sequence.layered.work_budget import WorkBudget, raise_bound
from slicer.sequence.problem import Found, Incumbent, Options, Problem

ARCS_PER_TOOLPATH = {"quick": 10_000, "default": 40_000, "high": 120_000}
"""How large the bound may be: what one evaluation looks at, for each toolpath."""
PASSES = {
    "quick": ((10, 2_500), (20, 5_000)),
    "default": ((10, 2_500), (30, 50_000)),
    "high": ((10, 2_500), (40, 50_000), (100, 250_000)),
}
"""Steps of the bound, and the successors of a layer in the search after them."""
MOST_GENERATED = 100_000_000
"""Successors of all layers of a search."""
SUCCESSORS_PER_COLUMN = 5
"""About so many successors has a node for each column of the sheet."""
LEAST_WIDTH = 5
MOST_CORRIDORS = 4


def beam(problem: Problem, options: Options) -> Found:
    """The best sequence that beam search finds; never worse than ``options.initial``."""
    if problem.n == 0:
        return Found(np.empty(0, np.int32))
    incumbent = initial_incumbent(problem, options)
    budget = WorkBudget(0)
    stopped, complete = False, False
    try:
        for _ in range(MOST_CORRIDORS):
            before = incumbent.cost
            complete = _search_corridor(problem, options, incumbent, budget)
            if complete or incumbent.cost >= before or options.out_of_time():
                break
        stopped = options.out_of_time() and not incumbent.proved
    except KeyboardInterrupt:
        stopped = True
    return Found(
        incumbent.oriented,
        budget.nodes,
        budget.generated,
        incumbent.lower_bound if options.objective.name == "straight" and complete else None,
        stopped,
        incumbent.proved,
    )


def _search_corridor(problem: Problem, options: Options, incumbent: Incumbent, budget: WorkBudget) -> bool:
    """All passes over the states around the incumbent; whether those were all states there are."""
    opened = bound_around(problem, options, incumbent, ARCS_PER_TOOLPATH[options.effort])
    if opened is None:
        return False
    bound, complete = opened
    for steps, successors in PASSES[options.effort]:
        affordable = min(successors, MOST_GENERATED // problem.n)
        width = max(LEAST_WIDTH, affordable // (SUCCESSORS_PER_COLUMN * bound.section.columns))
        raise_bound(bound, incumbent, budget, steps, options, complete=complete)
        if bound.bound >= incumbent.cost or options.out_of_time():
            break
        found = search_below(bound, incumbent, budget, width, options, complete=complete)
        incumbent.report("search", bounded=complete)
        if found.lower_bound >= incumbent.cost or not found.finished:
            break
    return complete
