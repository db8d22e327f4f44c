"""What a method may spend and has spent, in work that does not depend on the clock."""

from dataclasses import dataclass

import numpy as np

from slicer.sequence.bound import PairBound
from slicer.sequence.layered.layered_search import LayeredSearch
from slicer.sequence.problem import Search

ARCS_PER_NODE = 35
"""So many arcs of the bound are looked at in the time in which a search generates one node,"""
ARCS_ALONG_SUBGRADIENTS = 60
"""or so many where the bound rises along subgradients."""
NO_LIMIT = int(np.iinfo(np.int64).max)
MOST_BETWEEN = 300_000_000
"""Arcs of the bound that are looked at between two evaluations of it, in ten steps at most; along
subgradients, between two looks at the clock."""


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


def raise_bound(
    search: Search,
    bound: PairBound,
    budget: WorkBudget,
    steps: int,
    *,
    complete: bool,
    most_arcs: int = NO_LIMIT,
) -> None:
    """Raise a bound by some steps, go to its best multipliers, and tell the search where it is complete.

    With ``most_arcs`` it ends once steps have looked at so many travels.
    """
    per_node = ARCS_ALONG_SUBGRADIENTS if bound.along_subgradients else ARCS_PER_NODE
    done = looked_at = 0
    while done < steps and looked_at < most_arcs:
        arcs = bound.climbed.blocks.arcs
        count = max(1, min(10, min(MOST_BETWEEN, most_arcs - looked_at) // max(1, arcs), steps - done))
        done, looked_at = done + count, looked_at + count * arcs
        budget.spent += count * arcs // per_node
        at_rest = bound.improve(search.cost, count, search.should_stop)
        if complete:
            search.raise_bound(bound.bound)
            search.report("bound")
        if at_rest or search.should_stop():
            break
    bound.use_best_multipliers()
