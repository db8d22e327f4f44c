"""What a method may spend and has spent, in work that does not depend on the clock."""

from dataclasses import dataclass

import numpy as np

from slicer.sequence.bound import PairBound, step_lengths
from slicer.sequence.layered.layered_search import LayeredSearch
from slicer.sequence.problem import Search

ARCS_PER_NODE = 60
"""So many arcs of the bound are looked at in the time in which a search generates one node."""
NO_LIMIT = int(np.iinfo(np.int64).max)
MOST_BETWEEN = 300_000_000
"""Arcs of the bound that are looked at between two looks at the clock, in ten steps at most."""


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
    lengths = step_lengths(steps, again=bound.bound > -np.inf)
    done = looked_at = 0
    while done < steps and looked_at < most_arcs:
        arcs = bound.climbed.blocks.arcs
        count = max(1, min(10, min(MOST_BETWEEN, most_arcs - looked_at) // max(1, arcs), steps - done))
        budget.spent += count * arcs // ARCS_PER_NODE
        at_rest = bound.improve(search.cost, lengths[done : done + count])
        done, looked_at = done + count, looked_at + count * arcs
        if complete:
            search.raise_bound(bound.bound)
            search.report("bound")
        if at_rest or search.should_stop():
            break
    bound.use_best_multipliers()
