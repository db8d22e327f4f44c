"""Printability: which toolpath must be laid before which, as the covering relation of "is below".

Toolpath b lies below a when, at some x of the open overlap of their x-ranges, b is strictly lower. A
vertical toolpath is defined at one x: it is tied to what passes above or below it there, and to other
verticals of that x. Lines that only share a border of their x-ranges do not constrain each other. For
lines that do not cross, the relation has no cycles (Rival and Urrutia, "Representing orders by
translating convex figures in the plane", Order 4, 1988).
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slicer.errors import CrossingError, SlicerError
from slicer.nozzle import NozzleBody
from slicer.sweep import sweep
from slicer.treap import NONE

EPS_MM = 1e-9
"""Two x that differ by no more count as the same, and so do two heights."""


def covering_edges(segments: ArrayLike) -> NDArray[np.int32]:
    """The covering relation of "is below": its transitive closure is the whole precedence.

    A vertical line swept over the sheet keeps the toolpaths under it in order of height. Two that become
    neighbours are comparable, and every comparable pair is joined by a chain of neighbours. The graph of
    neighbours is planar with one source and one sink, so a pair is implied by others exactly where one
    of the two faces beside it has that pair as a whole side (Tamassia and Tollis, "A unified approach to
    visibility representations of planar graphs", 1986): that is seen when a gap is split or healed.
    Takes O(n log n).

    Args:
        segments: float (n, 2, 2), [endpoint, xy] in mm, in any order of endpoints.

    Returns:
        int32 (m, 2), rows (a, b): a is printed immediately before b, sorted; m is at most 3n.

    Raises:
        CrossingError: two toolpaths cross or overlap; it names both.
        SlicerError: a coordinate is not finite.
    """
    lines = _left_to_right(segments)
    if len(lines) == 0:
        return np.empty((0, 2), np.int32)
    first, last = _ranks(lines[:, 0, 0], lines[:, 1, 0])
    by_first, by_last = (np.argsort(rank, kind="stable") for rank in (first, last))
    edges, low, high = sweep(lines, first, last, by_first, by_last, EPS_MM)
    if low != NONE:
        raise CrossingError((low, high), _describe_crossing(lines, low, high))
    return edges[np.lexsort((edges[:, 1], edges[:, 0]))]


def hindering_edges(segments: ArrayLike, body: NozzleBody) -> NDArray[np.int32]:
    """Precedence under a nozzle with a body: row (a, b): a is printed before b, or b would stand in its way.

    The transitive closure of the rows is that of the whole relation: "is below", and "the other would push
    deeper into the body than may be". It may have cycles; then no order is printable. The rows hold all of
    ``covering_edges``, and of the others a few a toolpath: see ``slicer.hindrance``.

    Args:
        segments: float64 (n, 2, 2), [endpoint, xy] in mm.
        body: the nozzle.

    Returns:
        int32 (m, 2), sorted.

    Raises:
        CrossingError, SlicerError: see ``covering_edges``.
    """
    below = covering_edges(segments)
    if body.is_point or len(np.asarray(segments)) < 2:
        return below
    # What only a body needs is neither loaded nor compiled for a point.
    from slicer.hindrance import hindered_by
    from slicer.implied_edges import Lists, without_implied

    lines = _left_to_right(segments)
    ranks = _ranks(lines[:, 0, 0], lines[:, 1, 0])
    return without_implied(below, Lists(*hindered_by(body, lines, ranks)))


def hindered(
    segments: ArrayLike, queries: ArrayLike, body: NozzleBody
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """What each query would hinder, were it laid like a toolpath: that must all come before it.

    A query hinders a toolpath that lies straight below it, or for which it would stand in the way of the
    body. Only the highest are named: every other toolpath that a query hinders comes before one of those,
    by "is below" or by ``hindering_edges``. Takes about as long as ``hindering_edges`` for as many toolpaths.

    Args:
        segments: float (n, 2, 2), the toolpaths in mm; they must not cross.
        queries: float (q, 2, 2) in mm; they may touch toolpaths, but not cross them.
        body: the nozzle.

    Returns:
        (start int32 (q + 1,), toolpath int32): query k hinders ``toolpath[start[k]:start[k + 1]]``.

    Raises:
        SlicerError: a coordinate is not finite.
    """
    from slicer.hindrance import hindered_by

    lines = _left_to_right(segments)
    ranks = _ranks(lines[:, 0, 0], lines[:, 1, 0]) if len(lines) else (np.empty(0, np.int32),) * 2
    return hindered_by(body, lines, ranks, _left_to_right(queries))


def columns(segments: ArrayLike) -> NDArray[np.int32]:
    """Number the column of each toolpath: the connected components of "x-ranges overlap".

    Columns are numbered from left to right. Toolpaths of different columns never lie below each
    other; only a nozzle's body can tie them.
    A vertical on the border between two columns is a column of its own, together with the other
    verticals of that x.

    Args:
        segments: float (n, 2, 2) in mm.

    Returns:
        int32 (n,), the column of each toolpath.
    """
    lines = _left_to_right(segments)
    n = len(lines)
    if n == 0:
        return np.empty(0, np.int32)
    first, last = _ranks(lines[:, 0, 0], lines[:, 1, 0])
    # Doubled ranks make open ranges half-open: a range (l, r) covers 2l+1 .. 2r-1, a vertical just 2l.
    start = np.where(first == last, 2 * first, 2 * first + 1)
    end = np.where(first == last, 2 * first, 2 * last - 1)
    by_start = np.argsort(start, kind="stable")
    reach = np.maximum.accumulate(end[by_start])
    opens = np.concatenate([[False], start[by_start][1:] > reach[:-1]])
    out = np.empty(n, np.int32)
    out[by_start] = np.cumsum(opens)
    return out


def violations(order: ArrayLike, edges: ArrayLike) -> NDArray[np.int64]:
    """Rows of ``edges`` that an order breaks: toolpaths printed after one that lies above them.

    Args:
        order: int (n,), the toolpath that is printed k-th.
        edges: int (m, 2), rows (a, b): a is printed before b.

    Returns:
        int64 (v,), indices into ``edges``; empty for a printable order.
    """
    sequence = np.asarray(order, np.int64)
    pairs = np.asarray(edges, np.int64).reshape(-1, 2)
    position = np.empty(len(sequence), np.int64)
    position[sequence] = np.arange(len(sequence))
    return np.flatnonzero(position[pairs[:, 0]] > position[pairs[:, 1]])


def _left_to_right(segments: ArrayLike) -> NDArray[np.float64]:
    """The segments as float (n, 2, 2) with the left (for verticals, the lower) endpoint first."""
    lines = np.asarray(segments, np.float64).reshape(-1, 2, 2)
    if not np.isfinite(lines).all():
        bad = int(np.flatnonzero(~np.isfinite(lines).all(axis=(1, 2)))[0])
        raise SlicerError(
            f"toolpath {bad} has a coordinate that is not a finite number: {lines[bad].tolist()}"
        )
    dx = lines[:, 1, 0] - lines[:, 0, 0]
    upright = np.abs(dx) <= EPS_MM
    swap = np.where(upright, lines[:, 1, 1] < lines[:, 0, 1], dx < 0)
    return np.where(swap[:, None, None], lines[:, ::-1], lines)


def _ranks(
    left: NDArray[np.float64], right: NDArray[np.float64]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Number the distinct x of both ends in ascending order; x within ``EPS_MM`` share a number."""
    n = len(left)
    x = np.concatenate([left, right])
    ascending = np.argsort(x, kind="stable")
    ranks = np.empty(2 * n, np.int32)
    ranks[ascending] = np.cumsum(np.diff(x[ascending], prepend=x[ascending[0]]) > EPS_MM)
    return ranks[:n], ranks[n:]


def _describe_crossing(lines: NDArray[np.float64], low: int, high: int) -> str:
    def text(k: int) -> str:
        (x0, y0), (x1, y1) = lines[k]
        return f"toolpath {k} from ({x0:g}, {y0:g}) to ({x1:g}, {y1:g})"

    low, high = sorted((low, high))
    return f"{text(low)} mm crosses or overlaps {text(high)} mm; neither can be printed first. Part them."
