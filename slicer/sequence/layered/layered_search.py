"""A layered search from the first toolpath to the last: a beam, and a proof if nothing was cut off."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.bound import PairBound
from slicer.sequence.layered.layer import Limits, Sheet, StateSpace
from slicer.sequence.layered.layers import expand, first_layer, next_layer
from slicer.sequence.layered.node_pool import new_pool
from slicer.sequence.problem import Search
from slicer.sequence.states import needs, out_of_reach, sets_of_states

RELATIVE_EPS = 1e-10
"""A sequence must be better by this part of its cost to count as better; rounding stays far below."""
NARROW = 500
"""Nodes of a layer, where a search has generated as many nodes as it should have in all."""


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
    pool = new_pool()
    parents, lasts = [layer.parent], [layer.last]
    missed, nodes, generated, widest = np.inf, 0, 0, 0
    for _ in range(section.n - 1):
        nodes += len(layer.last)
        if nodes > most_nodes or search.should_stop():
            return LayeredSearch(None, np.inf, bound.bound, nodes, generated, widest, False)
        limits = Limits(below, width if generated <= enough else min(width, NARROW), metric)
        pool, size, dropped, more = expand(space, layer, pool, limits)
        layer = next_layer(blocks, sheet, layer, pool, size)
        missed = min(missed, dropped)
        generated += more
        widest = max(widest, len(layer.last))
        parents.append(layer.parent)
        lasts.append(layer.last)
        if len(layer.last) == 0:
            return LayeredSearch(None, np.inf, missed, nodes, generated, widest, True)
    at = int(np.argmin(layer.cost))
    cost = float(layer.cost[at])
    oriented = np.empty(section.n, np.int32)
    for k in range(section.n - 1, -1, -1):
        oriented[k] = lasts[k][at]
        at = int(parents[k][at])
    return LayeredSearch(oriented, cost, missed, nodes, generated, widest, True)
