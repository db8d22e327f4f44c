"""Beam search over large sheets, guided by the streamed bound.

The tighter that bound, the fewer nodes are enough: of 20x20 tiles with a gap of 0.6 % layers of 30 nodes end
within 0.1 % of the optimum, with one of 3 % those of 300.
"""

import numpy as np
from numpy.typing import NDArray

from slicer.sequence.bound import StreamedBound, climb, open_streamed_bound
from slicer.sequence.construct import start_along_levels
from slicer.sequence.layered.node_pool import new_pool
from slicer.sequence.layered.streamed_layers import REACH, advance
from slicer.sequence.layered.streamed_nodes import best_of, new_beam
from slicer.sequence.problem import Search

Widths = tuple[tuple[int, float], ...]
WIDTHS: dict[str, Widths] = {
    "quick": ((10, 0.0), (30, 0.0)),
    "default": ((30, 0.0), (100, 0.0)),
    "high": ((30, 0.0), (100, 0.0), (300, 0.0)),
}
"""Nodes of a layer, of one beam after the other, and the part of the cost that must be left to gain for it.
How wide they may be goes with the size of the sheet.
"""
MOST_SUCCESSORS = {"quick": 30_000_000, "default": 150_000_000, "high": 1_500_000_000}
"""Of all layers of a beam, at about 0.05 µs each."""
MOST_COLUMNS, BAND_COLUMNS = 64, 24
"""On wider sheets beams leave toolpaths behind and come back for them too late, so that bands of columns are
printed one after the other.

On 40x40 tiles beams end 1 to 3 % above the optimum, on 100x100 above all that local search starts from.
"""
BAND_WIDTHS = ((10, 0.0), (5, 0.0), (20, 0.0), (30, 0.05))
"""In bands several narrow beams, the widest if more is left to gain: on 20x100 tiles wide ones are no better.

Of the first fifth of 100x100 10, 20, 30, 45 and 100 nodes come to 2191, 2626, 2503, 2514 and 2248 mm.
"""
LOOSE_COLUMNS = 24
LOOSE_WIDTHS = WIDTHS | {"default": ((30, 0.0), (100, 0.0), (300, 0.03))}
"""The same where the bound is loose, so that beams leave toolpaths behind more easily."""
FEW_SUCCESSORS = 20_000_000
"""A beam of so few is not spared where hardly anything is left to gain."""
SUCCESSORS_PER_COLUMN = 2
"""Within reach of the nozzle."""
LAYERS_AT_ONCE = 500
"""Between two looks at the clock."""


def streamed_beam(search: Search, *, loose: bool = False) -> StreamedBound | None:
    """Bound the search, offer what beams find, and return the bound; None without one, or if time ran out.

    Columns must not be tied by a nozzle's body: a node would not know what it needs elsewhere.

    Args:
        search: for straight travel.
        loose: whether the bound is less tight than on a sheet as it is printed.
    """
    bound = open_streamed_bound(search)
    if bound is None or bound.tied or not climb(search, bound):
        return None
    if bound.columns > MOST_COLUMNS:
        in_time = _bands(search, bound, BAND_WIDTHS)
    elif loose and bound.columns > LOOSE_COLUMNS:
        in_time = _bands(search, bound, LOOSE_WIDTHS[search.effort])
    else:
        in_time = _beams(search, bound, (LOOSE_WIDTHS if loose else WIDTHS)[search.effort])
    return bound if in_time else None


def _beams(search: Search, bound: StreamedBound, widths: Widths) -> bool:
    """Beams of these widths over a whole sheet, each while enough is left to gain, see ``WIDTHS``.

    Nothing is searched where the corridor has no start, or is too large to be held. False where time ran out.
    """
    known, pool = bound.all_values(search.should_stop), new_pool()
    if known is None or not bound.near_starts:
        return not search.should_stop()
    n = search.problem.n
    for width, least_gap in widths:
        successors = width * n * min(bound.columns, 2 * REACH + 1) * SUCCESSORS_PER_COLUMN
        most = FEW_SUCCESSORS if search.near_enough else MOST_SUCCESSORS[search.effort]
        enough = search.proved or search.lower_bound > (1.0 - least_gap) * search.cost
        if enough or successors > most:
            break
        beam = new_beam(bound.layout, bound.near_starts, width)
        at = 0
        while at < n - 1:
            span = at, min(n - 1, at + LAYERS_AT_ONCE)
            pool, at, generated = advance(bound.layout, known, beam, pool, span, width)
            search.nodes_visited += (at - span[0]) * width
            search.states_created += generated
            if search.should_stop():
                return False
            if at < span[1]:
                return True  # the corridor is a dead end
        oriented = best_of(beam)
        search.offer(bound.oriented[oriented].astype(np.int32))
        search.report("search")
    return True


def _bands(search: Search, bound: StreamedBound, widths: Widths) -> bool:
    """Beams over bands of columns, printed one after the other; False where time ran out."""
    problem = search.problem
    price = np.empty_like(bound.best)
    price[:, bound.oriented] = bound.best
    columns = np.array_split(np.arange(bound.columns), -(-bound.columns // BAND_COLUMNS))
    # The first band that a sequence may begin in comes first, then those right of it, then those left of it.
    begins = bound.column[problem.starts >> 1]
    begin = next(k for k, band in enumerate(columns) if np.isin(begins, band).any())
    columns = columns[begin:] + columns[:begin][::-1]
    parts: list[NDArray[np.intp]] = []
    for band in columns:
        toolpaths = np.flatnonzero(np.isin(bound.column, band))
        part = search.part(problem.part(toolpaths, begins=not parts))
        start_along_levels(part)
        inner = open_streamed_bound(part)
        here = np.stack([2 * toolpaths, 2 * toolpaths + 1], axis=1).ravel()
        if inner is not None:  # a single column is short of that
            inner.price = inner.best = price[:, here[inner.oriented]] * inner.inner
            if climb(part, inner, again=True):
                _beams(part, inner, widths)
        if search.should_stop():
            return False
        search.nodes_visited += part.nodes_visited
        search.states_created += part.states_created
        parts.append(here[part.oriented])
        search.report("search")
    search.offer(np.concatenate(parts).astype(np.int32))
    search.report("search")
    return True
