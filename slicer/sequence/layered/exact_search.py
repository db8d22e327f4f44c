"""The proven optimum, with an upper and a lower bound on the way there.

Rounds of three: the pair bound rises by some steps, states that no better sequence can pass through are
struck out, and a layered search looks below the incumbent. When no layer of it was cut off for its width,
or nothing that was cut off could be better, then the incumbent is optimal. Every round has a wider search.
"""

from slicer.sequence.bound import StreamedBound, raise_relaxed_bound
from slicer.sequence.construct import start_greedily
from slicer.sequence.layered.bounded_search import bound_around, complete_states, search_below
from slicer.sequence.layered.dynamic_programme import holds_whole, prove_over_all_states
from slicer.sequence.layered.work_budget import WorkBudget, raise_bound
from slicer.sequence.problem import Search

ARCS_PER_TOOLPATH = {"quick": 20_000, "default": 40_000, "high": 120_000}
"""How large the bound may be: what one evaluation looks at, for each toolpath."""
MOST_NODES = 40_000_000
WORK_PER_TOOLPATH = {"quick": 8_000, "default": 60_000, "high": 500_000}
"""Budgets of work, as a ``WorkBudget`` counts it."""
TIED = 3
"""Where a nozzle's body ties columns, both may be so many times as much: joined columns have more states.

Of dti_small_101D_sagittal_10x10, cut for a tip that reaches one spacing to either side, the gap of ``auto``
comes to 4.5 %, and to 6.3 % without.
"""
BRANCHING = 24
"""About so many nodes are generated from one."""
WIDE = 1_000
"""A search in a round of this width that has found nothing better, be it narrower for want of budget, is not
repeated before it may end in the proof, if the proof is in reach."""
IN_REACH = 0.03
"""The gap up to which it is."""
NEARLY = 2e-3
"""Where less than this part of the cost is left, a proof is near enough to be tried in any case."""
LAST_SEARCH = 0.3
"""The share of the budget that is kept for that; until then the bound rises and strikes out states."""
STANDSTILL = 0.1
"""A bound that rises by less than this part of the gap in a round has come as far as it pays."""
FULL = 12
"""That search is so many times wider than it could be if all its layers were full."""
SECONDS = 2e-7
"""What a unit of the budget takes, about."""
ROUNDS = ((25, 50), (40, 2_000), (80, 5_000), (100, 10_000))
"""Steps of the bound and width of the search in each round; later ones double the width.

A search so narrow proves most sheets of 4x4 tiles. Where it does not, all states are looked at for less than
more rounds of the bound would take.
"""
KNOWN_ROUNDS = ((12, 500), *ROUNDS[1:])
"""The same where the bound begins with good prices."""
ROUTED_ROUNDS = ((50, 100), (50, 500), (60, 2_000), *ROUNDS[2:])
"""The same where states know walls: there searches cost more, and the bound takes more steps to rise."""
TIED_ROUNDS = ((30, 50), (30, 100), (40, 500), *ROUTED_ROUNDS[2:])
"""The same where a nozzle's body ties columns, too: a successor takes ten times as long, and most proofs are
far, which narrow rounds tell soon enough.
"""


def exact_sees_all(search: Search) -> bool:
    """Whether the proof can look at all states there are; for a started search."""
    return complete_states(search, _more(search) * ARCS_PER_TOOLPATH[search.effort])


def _more(search: Search) -> int:
    """How many times the usual a bound and its budget may be."""
    return 1 if search.problem.planar else TIED


def _rounds(search: Search, known: StreamedBound | None) -> tuple[tuple[int, int], ...]:
    """Steps and widths of the rounds that suit a search."""
    if search.objective.routed:
        return ROUTED_ROUNDS if search.problem.planar else TIED_ROUNDS
    return ROUNDS if known is None else KNOWN_ROUNDS


def exact(
    search: Search, *, stop_when_near: bool = False, thrifty: bool = False, known: StreamedBound | None = None
) -> None:
    """Prove the optimum if the effort is enough, and offer the best sequence in any case.

    With what is ``known`` of straight travel it begins where that bound has come to.

    With ``stop_when_near`` it ends where a search finds nothing better and little is left to gain, but no
    proof is near.
    With ``thrifty`` it ends where the bound comes to rest far from a proof, and half of what it leaves would
    not win back the seconds of another round.

    Without a proof, the lower bound is that of the pair bound or of the states that were cut off. Where
    the columns have too many down-sets, a corridor around the best sequence is searched and nothing is
    proved; on sheets too large even for that, window search takes its place.
    """
    start_greedily(search)
    n = search.problem.n
    budget = WorkBudget(_more(search) * max(n, 100) * WORK_PER_TOOLPATH[search.effort])
    opened = bound_around(search, _more(search) * ARCS_PER_TOOLPATH[search.effort])
    if opened is None:
        return raise_relaxed_bound(search)
    bound, complete = opened
    if complete and holds_whole(bound):
        return prove_over_all_states(search, bound)
    bound.see_walls(search.cost)
    if known is not None and complete:
        bound.start_from(known.column, known.oriented, known.best)
        bound.use_best_multipliers()
        bound.fix_states(search.cost)
    rounds = _rounds(search, known if complete else None)
    turn, found_less = 0, True
    while not search.proved and budget.spent < budget.limit and not search.should_stop():
        steps, width = rounds[min(turn, len(rounds) - 1)]
        width <<= max(0, turn - len(rounds) + 1)
        narrow = width < WIDE
        turn += 1
        before, known_before, spent_before = bound.bound, search.lower_bound, budget.spent
        raise_bound(search, bound, budget, steps, complete=complete)
        if bound.bound >= search.cost:
            break
        rest = budget.limit - budget.spent
        rises = bound.bound > before + STANDSTILL * (search.cost - before)
        last = not found_less and bound.bound > (1.0 - IN_REACH) * search.cost
        if last and rises and rest > LAST_SEARCH * budget.limit:
            bound.fix_states(search.cost)
            bound.use_best_multipliers()
            continue
        affordable = rest // (BRANCHING * n)
        width = min(FULL * affordable, MOST_NODES // n) if last else min(width, affordable)
        width = int(max(50, width))
        least = search.cost
        found = search_below(
            search,
            bound,
            budget,
            width,
            complete=complete,
            most_nodes=MOST_NODES,
            enough=min(2 * rest, budget.limit),
        )
        if not complete and found.finished and found.lower_bound >= search.cost:
            break  # nothing better in this corridor
        search.report("search")
        found_less = search.cost < least or narrow
        far = search.lower_bound < (1.0 - NEARLY) * search.cost
        if stop_when_near and not found_less and search.near_enough and far:
            break
        # Searches raise the bound, too.
        risen = search.lower_bound > known_before + STANDSTILL * (search.cost - known_before)
        in_reach = search.lower_bound > (1.0 - IN_REACH) * search.cost
        if thrifty and not (risen or in_reach or search.pays(SECONDS * (budget.spent - spent_before))):
            break
        # Where a nozzle ties columns, proofs of time are far, and this round would only come again.
        tied = search.objective.routed and not search.problem.planar and search.effort != "high"
        if tied and not found_less and search.lower_bound <= known_before and bound.bound <= before:
            break
    return None if complete else raise_relaxed_bound(search)
