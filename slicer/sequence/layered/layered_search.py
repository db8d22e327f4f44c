"""A layered search from the first toolpath to the last: a beam, and a proof if nothing was cut off."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.bound import PairBound
from slicer.sequence.layered.layer import Layer, Limits, Seen, Sheet, StateSpace, Trail
from slicer.sequence.layered.layers import expand_layers, first_layer
from slicer.sequence.layered.node_pool import new_pool
from slicer.sequence.problem import Search
from slicer.sequence.states import NONE, needs, out_of_reach, sets_of_states

RELATIVE_EPS = 1e-10
"""A sequence must be better by this part of its cost to count as better; rounding stays far below."""
NARROW = 500
"""Nodes of a layer, where a search has generated as many nodes as it should have in all."""
BETWEEN = 500_000
"""Successors between two looks at the clock."""


@dataclass(frozen=True, eq=False)
class LayeredSearch:
    """What a layered search found.

    Attributes:
        oriented: int32 (n,), the cheapest sequence found below the cut, or None.
        cost: its cost, or infinity.
        lower_bound: no sequence below the cut that the search missed costs less; infinity where it
            missed none.
        nodes, generated: nodes expanded, and successors generated.
        widest: the most nodes of a layer.
        finished: False where time or memory ended it.
    """

    oriented: NDArray[np.int32] | None
    cost: float
    lower_bound: float
    nodes: int
    generated: int
    widest: int
    finished: bool


def search_layers(
    search: Search,
    bound: PairBound,
    cut: float,
    width: int,
    *,
    most_nodes: int = np.iinfo(np.int64).max,
    enough: int = np.iinfo(np.int64).max,
) -> LayeredSearch:
    """Search below ``cut``, guided by a bound at its best multipliers.

    Args:
        search: is asked whether to stop.
        bound: ``bound.value`` must be that of its best multipliers, see ``PairBound.use_best_multipliers``.
        cut: only sequences that cost less are of interest.
        width: the most nodes of a layer.
        most_nodes: the search gives up beyond so many nodes in all.
        enough: once it has generated so many nodes, its layers have ``NARROW`` at most.
    """
    section, blocks = bound.section, bound.blocks
    below = cut - RELATIVE_EPS * abs(cut) if np.isfinite(cut) else cut
    # Neither times nor detours are sure to obey the triangle inequality.
    metric = not section.cost_model.timed and not section.routed
    distant = needs(section, bound.sets, out_of_reach(section, blocks.home))
    sheet = Sheet(section.segments, section.column, bound.sets.local, distant, section.cost_model)
    first_set, set_of = np.zeros(1, np.int64), np.zeros(1, np.int32)
    if section.routed or len(distant.path):
        first_set, set_of = sets_of_states(blocks, bound.sets)
    space = StateSpace(blocks, bound.value, sheet, bound.sky, first_set, set_of)
    layer = first_layer(space, bound.ends.starts)
    trail = _first_trail(layer, section.n)
    limits = Limits(below, width, metric, enough, NARROW, most_nodes)
    pool, seen = new_pool(), Seen(1, np.inf, 0, 0, 0)
    while seen.layers < section.n and len(layer.last):
        if seen.nodes > most_nodes or search.should_stop():
            return LayeredSearch(None, np.inf, bound.bound, seen.nodes, seen.generated, seen.widest, False)
        layer, pool, trail, seen = expand_layers(space, layer, pool, trail, limits, seen, BETWEEN)
    oriented, cost = None, np.inf
    if len(layer.last):
        at = int(np.argmin(layer.cost))
        oriented, cost = _walked(trail, section.n, at), float(layer.cost[at])
    return LayeredSearch(oriented, cost, seen.dropped, seen.nodes, seen.generated, seen.widest, True)


def _first_trail(layer: Layer, n: int) -> Trail:
    """The trail of a search that has come to its first layer of n."""
    m = len(layer.last)
    trail = Trail(
        np.empty(max(n, m), np.int32), np.full(max(n, m), NONE, np.int32), np.zeros(n + 1, np.int64)
    )
    trail.last[:m] = layer.last
    trail.begin[1] = m
    return trail


def _walked(trail: Trail, n: int, at: int) -> NDArray[np.int32]:
    """int32 (n,), the oriented toolpaths on the way to a node of the last layer."""
    oriented = np.empty(n, np.int32)
    for k in range(n - 1, -1, -1):
        node = trail.begin[k] + at
        oriented[k], at = trail.last[node], int(trail.parent[node])
    return oriented
