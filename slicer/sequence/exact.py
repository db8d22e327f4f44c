"""The proven optimum, with an upper and a lower bound on the way there.

Rounds of three: the pair bound rises by some steps, states that no better sequence can pass through are
struck out, and a layered search looks below the incumbent. When no layer of it was cut off for its width,
or nothing that was cut off could be better, then the incumbent is optimal. Every round has a wider search.
"""

import numpy as np

from slicer.sequence.corridor import widest_corridor
from slicer.sequence.descend import descend
from slicer.sequence.incumbent import Incumbent
from slicer.sequence.ledger import Ledger, raise_bound
from slicer.sequence.method import Found, Options
from slicer.sequence.pair_bound import PairBound
from slicer.sequence.problem import Problem
from slicer.sequence.section import Section
from slicer.sequence.window import polish

ARCS_PER_TOOLPATH = {"quick": 20_000, "default": 40_000, "high": 120_000}
"""How large the bound may be: what one evaluation looks at, for each toolpath."""
MOST_NODES = 40_000_000
WORK_PER_TOOLPATH = {"quick": 8_000, "default": 60_000, "high": 500_000}
"""Budgets of work, as a ``Ledger`` counts it."""
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
    incumbent = Incumbent(problem, options)
    ledger = Ledger(max(n, 100) * WORK_PER_TOOLPATH[options.effort])
    stopped, complete = False, False
    try:
        complete = _rounds(problem, options, incumbent, ledger)
        stopped = options.out_of_time() and not incumbent.proved
    except KeyboardInterrupt:
        stopped = True
    bounds_travel = options.objective.name == "straight" and (complete or incumbent.lower_bound > 0.0)
    return Found(
        incumbent.oriented,
        ledger.nodes,
        ledger.generated,
        incumbent.lower_bound if bounds_travel else None,
        stopped,
        incumbent.proved,
    )


def _rounds(problem: Problem, options: Options, incumbent: Incumbent, ledger: Ledger) -> bool:
    """Alternate between bound and search until proof or until the effort is spent; whether bounds hold."""
    section = Section.whole(problem, options.objective)
    corridor = widest_corridor(
        section, incumbent.oriented >> 1, max(problem.n, 100) * ARCS_PER_TOOLPATH[options.effort]
    )
    if corridor is None:
        incumbent.offer(polish(problem, options, incumbent.oriented))
        incumbent.report("windows", bounded=False)
        return False
    bound = PairBound.over(section, corridor.sets, corridor.bounds, corridor.allowed)
    turn = 0
    while not incumbent.proved and ledger.work < ledger.budget and not options.out_of_time():
        steps, width = ROUNDS[min(turn, len(ROUNDS) - 1)]
        width <<= max(0, turn - len(ROUNDS) + 1)
        raise_bound(bound, incumbent, ledger, steps, options, complete=corridor.complete)
        if bound.bound >= incumbent.cost:
            break
        bound.strike(incumbent.cost)
        bound.settle()
        affordable = (ledger.budget - ledger.work) // (BRANCHING * problem.n)
        width = int(max(50, min(width, affordable)))
        found = descend(bound, incumbent.cost, width, options, most_nodes=MOST_NODES)
        ledger.add(found)
        incumbent.offer(found.oriented)
        if corridor.complete and found.finished:
            incumbent.raise_bound(found.lower_bound)
        elif found.finished and found.lower_bound >= incumbent.cost:
            break  # nothing better in this corridor
        incumbent.report("search", bounded=corridor.complete)
        turn += 1
    return corridor.complete
