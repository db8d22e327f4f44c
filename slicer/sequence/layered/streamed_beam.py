"""Beam search over large sheets, guided by the streamed bound.

The tighter that bound, the fewer nodes are enough: of 20x20 tiles with a gap of 0.6 % layers of 30 nodes end
within 0.1 % of the optimum, with one of 3 % those of 300.
"""

import numpy as np

from slicer.sequence.bound import StreamedBound, climb, open_streamed_bound
from slicer.sequence.layered.node_pool import new_pool
from slicer.sequence.layered.streamed_layers import REACH, advance, best_of, new_beam
from slicer.sequence.problem import Search

WIDTHS = {"quick": (10, 30), "default": (30, 100), "high": (30, 100, 300)}
"""Nodes of a layer, of one beam after the other; how wide they may be goes with the size of the sheet."""
MOST_SUCCESSORS = {"quick": 30_000_000, "default": 150_000_000, "high": 1_500_000_000}
"""Of all layers of a beam, at about 0.15 µs each."""
MOST_COLUMNS = 64
"""On wider sheets beams leave toolpaths behind and come back for them too late, and only the bound is raised.

On 40x40 tiles they end 1 to 3 % above the optimum, on 100x100 above all that local search starts from.
"""
FEW_SUCCESSORS = 20_000_000
"""A beam of so few is not spared where hardly anything is left to gain."""
SUCCESSORS_PER_COLUMN = 2
"""Within reach of the nozzle."""
LAYERS_AT_ONCE = 500
"""Between two looks at the clock."""


def streamed_beam(search: Search) -> StreamedBound | None:
    """Bound the search, offer what beams find, and return the bound; None without one, or if time ran out.

    Columns must not be tied by a nozzle's body: a node would not know what it needs elsewhere.
    """
    bound = open_streamed_bound(search)
    if bound is None or bound.tied or not climb(search, bound) or not bound.near_starts:
        return None
    if bound.columns > MOST_COLUMNS:
        return bound
    known, pool = bound.all_values(), new_pool()
    n = search.problem.n
    for width in WIDTHS[search.effort]:
        successors = width * n * min(bound.columns, 2 * REACH + 1) * SUCCESSORS_PER_COLUMN
        enough = search.proved or (search.near_enough and successors > FEW_SUCCESSORS)
        if enough or successors > MOST_SUCCESSORS[search.effort]:
            break
        beam = new_beam(bound.layout, bound.near_starts, width)
        at = 0
        while at < n - 1:
            span = at, min(n - 1, at + LAYERS_AT_ONCE)
            pool, at, generated = advance(bound.layout, known, beam, pool, span, width)
            search.nodes_visited += (at - span[0]) * width
            search.states_created += generated
            if search.should_stop() or at < span[1]:  # the corridor may be a dead end
                return None
        oriented = best_of(beam)
        search.offer(bound.oriented[oriented].astype(np.int32))
        search.report("search")
    return bound
