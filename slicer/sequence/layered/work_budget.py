"""What a method may spend and has spent, in work that does not depend on the clock."""

from dataclasses import dataclass

from slicer.sequence.bound import PairBound, step_lengths
from slicer.sequence.layered.layered_search import LayeredSearch
from slicer.sequence.problem import Search

ARCS_PER_NODE = 60
"""So many arcs of the bound are looked at in the time in which a search generates one node."""
MOST_BETWEEN = 300_000_000
"""Arcs of the bound that steps look at between two looks at the clock,"""
AT_ONCE, MANY_AT_ONCE = 10, 30
"""in so many steps at most; or in so many where they look at some states of many, and then at all again."""


@dataclass
class WorkBudget:
    """What a run may spend and has spent."""

    limit: int
    spent: int = 0
    nodes: int = 0
    generated: int = 0

    def add(self, found: LayeredSearch) -> None:
        """Enter a search."""
        self.spent += found.generated
        self.nodes += found.nodes
        self.generated += found.generated


def raise_bound(search: Search, bound: PairBound, budget: WorkBudget, steps: int, *, complete: bool) -> None:
    """Raise a bound by some steps, go to its best multipliers, and tell the search where it is complete."""
    lengths = step_lengths(steps, bound.gap(search.cost))
    while len(lengths):
        arcs = bound.looked_at.arcs
        most = MANY_AT_ONCE if bound.looked_at.chooses else AT_ONCE
        count = max(1, min(most, MOST_BETWEEN // max(1, arcs), len(lengths)))
        budget.spent += bound.arcs_of(count) // ARCS_PER_NODE
        at_rest = bound.improve(search.cost, lengths[:count])
        lengths = lengths[count:]
        if complete:
            search.raise_bound(bound.bound)
            search.report("bound")
        if at_rest or search.should_stop():
            break
    bound.use_best_multipliers()
