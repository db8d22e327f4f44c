"""What a method may spend and has spent, in work that does not depend on the clock."""

from dataclasses import dataclass

from slicer.sequence.descend import Descent
from slicer.sequence.incumbent import Incumbent
from slicer.sequence.method import Options
from slicer.sequence.pair_bound import PairBound

ARCS_PER_NODE = 60
"""So many arcs of the bound are looked at in the time in which a search generates one node."""
MOST_BETWEEN = 100_000_000
"""Arcs of the bound that are looked at between two looks at the clock, in ten steps at most."""


@dataclass
class Ledger:
    """What a run may spend and has spent."""

    budget: int
    work: int = 0
    nodes: int = 0
    generated: int = 0

    def add(self, found: Descent) -> None:
        """Enter a search."""
        self.work += found.generated
        self.nodes += found.nodes
        self.generated += found.generated


def raise_bound(
    bound: PairBound,
    incumbent: Incumbent,
    ledger: Ledger,
    steps: int,
    options: Options,
    *,
    complete: bool,
) -> None:
    """Raise a bound by some steps, settle it, and tell the incumbent."""
    arcs = bound.blocks.arcs
    stride = max(1, min(10, MOST_BETWEEN // max(1, arcs)))
    for done in range(0, steps, stride):
        count = min(stride, steps - done)
        ledger.work += count * arcs // ARCS_PER_NODE
        at_rest = bound.improve(incumbent.cost, count)
        if complete:
            incumbent.raise_bound(bound.bound)
            incumbent.report("bound")
        if at_rest or options.out_of_time():
            break
    bound.settle()
