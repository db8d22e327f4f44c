"""The proven optimum, with an upper and a lower bound on the way there.

Rounds of three: the pair bound rises by some steps, states that no better sequence can pass through are
struck out, and a layered search looks below the incumbent. When no layer of it was cut off for its width,
or nothing that was cut off could be better, then the incumbent is optimal. Every round has a wider search.
"""

import numpy as np

from slicer.sequence.construct import initial_incumbent
from slicer.sequence.layered.bounded_search import bound_around, search_below
from slicer.sequence.layered.work_budget import WorkBudget, raise_bound
from slicer.sequence.problem import Found, Incumbent, Options, Problem

ARCS_PER_TOOLPATH = {"quick": 20_000, "default": 40_000, "high": 120_000}
"""How large the bound may be: what one evaluation looks at, for each toolpath."""
MOST_NODES = 40_000_000
WORK_PER_TOOLPATH = {"quick": 8_000, "default": 60_000, "high": 500_000}
"""Budgets of work, as a ``WorkBudget`` counts it."""
BRANCHING = 24
"""About so many nodes are generated from one."""
ROUNDS = ((10, 50), (20, 100), (30, 500), (40, 1_000), (50, 2_000), (60, 5_000))
"""Steps of the bound and width of the search in each round; later ones double the width."""


def exact(problem: Problem, options: Options) -> Found:
    """Prove the optimum if the effort is enough, and return the best sequence in any case.

    Without a proof, the lower bound is that of the pair bound or of the states that were cut off. Where
    the columns have too many down-sets, a corridor around the incumbent is searched and nothing is proved;
    on sheets too large even for that, window search takes its place.
    """
    n = problem.n
    if n == 0:
        return Found(np.empty(0, np.int32))
    incumbent = initial_incumbent(problem, options)
    budget = WorkBudget(max(n, 100) * WORK_PER_TOOLPATH[options.effort])
    stopped, complete = False, False
    try:
        complete = _rounds(problem, options, incumbent, budget)
        stopped = options.out_of_time() and not incumbent.proved
    except KeyboardInterrupt:
        stopped = True
    bounds_travel = options.objective.name == "straight" and (complete or incumbent.lower_bound > 0.0)
    return Found(
        incumbent.oriented,
        budget.nodes,
        budget.generated,
        incumbent.lower_bound if bounds_travel else None,
        stopped,
        incumbent.proved,
    )


def _rounds(problem: Problem, options: Options, incumbent: Incumbent, budget: WorkBudget) -> bool:
    """Alternate between bound and search until proof or until the effort is spent; whether bounds hold."""
    opened = bound_around(problem, options, incumbent, ARCS_PER_TOOLPATH[options.effort])
    if opened is None:
        return False
    bound, complete = opened
    turn = 0
    while not incumbent.proved and budget.spent < budget.limit and not options.out_of_time():
        steps, width = ROUNDS[min(turn, len(ROUNDS) - 1)]
        width <<= max(0, turn - len(ROUNDS) + 1)
        raise_bound(bound, incumbent, budget, steps, options, complete=complete)
        if bound.bound >= incumbent.cost:
            break
        affordable = (budget.limit - budget.spent) // (BRANCHING * problem.n)
        width = int(max(50, min(width, affordable)))
        found = search_below(
            bound, incumbent, budget, width, options, complete=complete, most_nodes=MOST_NODES
        )
        if not complete and found.finished and found.lower_bound >= incumbent.cost:
            break  # nothing better in this corridor
        incumbent.report("search", bounded=complete)
        turn += 1
    return complete
