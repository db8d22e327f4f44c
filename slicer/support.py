"""What hangs: the parts of toolpaths with nothing under or beside them that was printed before."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import NDArray

if TYPE_CHECKING:  # it imports what compiles the routing
    from slicer.travel import Plan

SLACK_MM = 0.002
"""Neighbours of a tile lie a bead's height apart: positions with three decimals must not part them."""
LEAST_MM = 0.001
"""Positions are written with three decimals: what hangs over less cannot be drawn."""


@dataclass(frozen=True, eq=False)
class Hanging:
    """What of each toolpath hangs, in the order of printing.

    Attributes:
        length_mm: float64 (n,), the length that hangs.
        bridge_mm: float64 (n,), the longest piece that hangs without a break.
        pieces: float64 (m, 2, 2), from where to where, in mm, toolpath by toolpath; none shorter than 0.001.
    """

    length_mm: NDArray[np.float64]
    bridge_mm: NDArray[np.float64]
    pieces: NDArray[np.float64]


def hanging(toolpaths: NDArray[np.float64], height_mm: NDArray[np.float64]) -> Hanging:
    """What lies farther than a bead's height from everything that was printed before it, the bed included.

    The bed is half a bead below the lowest toolpath. A toolpath does not carry itself.

    Args:
        toolpaths: float64 (n, 2, 2), in the order of printing, from [0] to [1], in mm.
        height_mm: float64 (n,), the height of the bead of each.
    """
    n = len(toolpaths)
    if n == 0:
        return Hanging(np.empty(0), np.empty(0), np.empty((0, 2, 2)))
    reach = height_mm + SLACK_MM
    later, earlier = _neighbours(toolpaths, reach)
    first, last = _within(toolpaths[later], toolpaths[earlier], reach[later])
    of, begin, end = [later], [first], [last]
    on_bed = _below(toolpaths, float(toolpaths[:, :, 1].min()) + reach)
    of.append(np.arange(n))
    begin.append(on_bed[0])
    end.append(on_bed[1])
    # The end of a toolpath ends what hangs: an interval without length stands there.
    of.append(np.arange(n))
    begin.append(np.ones(n))
    end.append(np.ones(n))
    return _gaps(np.concatenate(of), np.concatenate(begin), np.concatenate(end), toolpaths)


def hanging_of(plan: "Plan", height_mm: NDArray[np.float64]) -> Hanging:
    """What of a plan hangs. The hops that it extrudes carry and hang like toolpaths: what hangs of one counts
    to the toolpath that it leads to.

    Args:
        height_mm: float64 (n,), the height of the bead of each toolpath, and of the hop to it.
    """
    n, joined = len(plan.toolpaths), np.flatnonzero(plan.joined)
    hops = np.stack([plan.toolpaths[joined - 1, 1], plan.toolpaths[joined, 0]], axis=1)
    laid = np.insert(plan.toolpaths, joined, hops, axis=0)
    owner = np.insert(np.arange(n), joined, joined)
    found = hanging(laid, height_mm[owner])
    length, bridge = np.zeros(n), np.zeros(n)
    np.add.at(length, owner, found.length_mm)
    np.maximum.at(bridge, owner, found.bridge_mm)
    return Hanging(length, bridge, found.pieces)


def _neighbours(
    toolpaths: NDArray[np.float64], reach: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Pairs (later, earlier) that come within reach of the later one."""
    lines = shapely.linestrings(toolpaths)
    tree = shapely.STRtree(lines)
    later, earlier = tree.query(lines, predicate="dwithin", distance=reach)
    before = earlier < later
    return later[before], earlier[before]


def _within(
    q: NDArray[np.float64], a: NDArray[np.float64], reach: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The interval of each q (m, 2, 2), in parts of its length, no farther than reach from its a (m, 2, 2).

    It is where a line crosses a stadium: a slab across a, between its ends, and a circle around either end.
    """
    d, e = q[:, 1] - q[:, 0], a[:, 1] - a[:, 0]
    length = np.hypot(e[:, 0], e[:, 1])
    along = e / np.maximum(length, 1e-300)[:, None]
    offset = q[:, 0] - a[:, 0]
    first, last = np.full(len(q), np.inf), np.full(len(q), -np.inf)
    # Slab: |across| <= reach and 0 <= along <= length, both linear in t.
    across = (_cross(along, offset), _cross(along, d))
    lengthwise = (_dot(along, offset), _dot(along, d))
    low, high = _between(*across, -reach, reach)
    low2, high2 = _between(*lengthwise, np.zeros(len(q)), length)
    low, high = np.maximum(low, low2), np.minimum(high, high2)
    held = low <= high
    first[held], last[held] = low[held], high[held]
    for end in range(2):
        to = q[:, 0] - a[:, end]
        squared, half, rest = _dot(d, d), _dot(to, d), _dot(to, to) - reach**2
        root = half**2 - squared * rest
        held = root >= 0
        width = np.sqrt(np.where(held, root, 0.0))
        first = np.where(held, np.minimum(first, (-half - width) / squared), first)
        last = np.where(held, np.maximum(last, (-half + width) / squared), last)
    return np.clip(first, 0.0, 1.0), np.clip(last, 0.0, 1.0)


def _between(
    at: NDArray[np.float64], slope: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Where low <= at + slope t <= high."""
    level = np.abs(slope) < 1e-15
    safe = np.where(level, 1.0, slope)
    one, other = (low - at) / safe, (high - at) / safe
    inside = (at >= low) & (at <= high)
    first = np.where(level, np.where(inside, -np.inf, np.inf), np.minimum(one, other))
    last = np.where(level, np.where(inside, np.inf, -np.inf), np.maximum(one, other))
    return first, last


def _below(
    toolpaths: NDArray[np.float64], limit: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The interval of each toolpath that lies no higher than its limit."""
    y, rise = toolpaths[:, 0, 1], toolpaths[:, 1, 1] - toolpaths[:, 0, 1]
    first, last = _between(y, rise, np.full(len(y), -np.inf), limit)
    return np.clip(first, 0.0, 1.0), np.clip(last, 0.0, 1.0)


def _gaps(
    of: NDArray[np.intp],
    begin: NDArray[np.float64],
    end: NDArray[np.float64],
    toolpaths: NDArray[np.float64],
) -> Hanging:
    """What the intervals of each toolpath leave, intervals that end before they begin being none."""
    n = len(toolpaths)
    held = begin <= end
    of, begin, end = of[held], begin[held], end[held]
    order = np.lexsort((begin, of))
    of, begin, end = of[order], begin[order], end[order]
    # Toolpaths are two apart, so that the furthest end so far is one of the same toolpath.
    reached = np.maximum.accumulate(end + 2.0 * of) - 2.0 * of
    start = np.concatenate([[True], of[1:] != of[:-1]])
    before = np.where(start, 0.0, np.concatenate([[0.0], reached[:-1]]))
    gap = np.maximum(begin - before, 0.0)
    length = np.hypot(*(toolpaths[:, 1] - toolpaths[:, 0]).T)
    total, longest = np.zeros(n), np.zeros(n)
    np.add.at(total, of, gap)
    np.maximum.at(longest, of, gap)
    some = np.flatnonzero(gap * length[of] > LEAST_MM)
    parts = np.stack([before[some], begin[some]], axis=1)[:, :, None]
    start_xy, end_xy = toolpaths[of[some], :1], toolpaths[of[some], 1:]
    return Hanging(total * length, longest * length, start_xy + parts * (end_xy - start_xy))


def _dot(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1])


def _cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
