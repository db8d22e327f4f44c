"""Parallel lines against an outline: which stretches of each belong to the closed area."""

from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

RESOLUTION_MM = 0.001
"""The last decimal of a position in a program. Shorter gaps in a line cannot be said, so they are none."""

BORDER_MM = 1e-6
"""What lies as near to a border as this lies on it: a nanometre, far above rounding and far below matter."""

MAX_CROSSINGS = 10_000_000


class Rows(NamedTuple):
    """The lines of tiles, as counted from each tile's centre.

    Attributes:
        centre, along: float64 (t, 2), of each tile, mm and unit vector.
        spacing: float64 (t,), mm from line to line.
        each_side: float64 (t,), the lines on either side of the one through the centre.
        number: intp (t,), in the numbering of all lines, of the first line of each tile, the one at
            ``-each_side``.
        boxes: (t,) polygons of the tiles.
    """

    centre: NDArray[np.float64]
    along: NDArray[np.float64]
    spacing: NDArray[np.float64]
    each_side: NDArray[np.float64]
    number: NDArray[np.intp]
    boxes: NDArray[np.object_]


class TooManyCrossingsError(ValueError):
    """An outline that crosses lines more often than memory holds."""


def clip(
    ends: NDArray[np.float64],
    line: NDArray[np.intp],
    along: NDArray[np.float64],
    rows: Rows,
    area: shapely.Geometry,
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """The stretches of lines that lie in an area or on its border.

    Along each line the places where borders cross it or come within ``BORDER_MM`` of it are sorted; the
    stretches between them lie in the area with their middles or not at all, and stretches that meet, but
    for ``RESOLUTION_MM``, are one. So neither the corners of the outline nor the seams between its
    polygons cut a line that goes on behind them.

    Args:
        ends: float64 (n, 2, 2), the lines within their tiles, in the direction of ``along``.
        line: intp (n,), which line of ``rows`` each is.
        along: float64 (n, 2), unit vectors.

    Returns:
        Float64 (m, 2, 2), the stretches, and for each the index in ``ends``, ascending.

    Raises:
        TooManyCrossingsError: there would be more than ``MAX_CROSSINGS``.
    """
    index = np.full(int(line.max(initial=-1)) + 1, -1, np.intp)
    index[line] = np.arange(len(line))
    of, edge = _meetings(rows, _edges(area, ends), index)
    length = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    of, low, high = _near(of, edge, ends[of, 0], along[of], length[of])
    every = np.arange(len(ends))
    whose = np.concatenate([every, every, of, of])
    place = np.concatenate([np.zeros(len(ends)), length, low, high])
    sequence = np.lexsort((place, whose))
    whose, place = whose[sequence], place[sequence]
    between = np.flatnonzero((whose[1:] == whose[:-1]) & (place[1:] > place[:-1]))
    middle = (place[between] + place[between + 1]) / 2
    x, y = (ends[whose[between], 0] + along[whose[between]] * middle[:, None]).T
    shapely.prepare(area)
    between = between[shapely.intersects_xy(area, x, y)]
    whose = np.concatenate([whose[between], of])
    low, high = np.concatenate([place[between], low]), np.concatenate([place[between + 1], high])
    whose, low, high = _joined(whose, low, high)
    start = ends[whose, 0] + along[whose] * low[:, None]
    end = ends[whose, 0] + along[whose] * high[:, None]
    start = np.where((low == 0)[:, None], ends[whose, 0], start)
    end = np.where((high == length[whose])[:, None], ends[whose, 1], end)
    return np.stack([start, end], axis=1), whose


def _edges(area: shapely.Geometry, ends: NDArray[np.float64]) -> NDArray[np.float64]:
    """The sides of an area, float64 (m, 2, 2), without those that lie beyond all lines."""
    xy, ring = shapely.get_coordinates(shapely.get_rings(shapely.get_parts(area)), return_index=True)
    sides: NDArray[np.float64] = np.stack([xy[:-1], xy[1:]], axis=1)[ring[1:] == ring[:-1]]
    if len(ends) == 0:
        return np.empty((0, 2, 2))
    low, high = ends.min(axis=(0, 1)) - BORDER_MM, ends.max(axis=(0, 1)) + BORDER_MM
    near = ((sides.max(axis=1) >= low) & (sides.min(axis=1) <= high)).all(axis=1)
    kept: NDArray[np.float64] = sides[near]
    return kept


def _meetings(
    rows: Rows, sides: NDArray[np.float64], index: NDArray[np.intp]
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Pairs of a line, as an index in ``ends``, and a side (2, 2) that may come near it.

    The lines of a tile are as far from each other as its spacing, so what a side spans across them says
    which ones it meets.
    """
    if len(sides) == 0:
        return np.empty(0, np.intp), np.empty((0, 2, 2))
    low_x, low_y, high_x, high_y = shapely.bounds(rows.boxes).T
    margin = 2 * BORDER_MM + 1e-9 * np.maximum(high_x - low_x, high_y - low_y)
    wide = shapely.box(low_x - margin, low_y - margin, high_x + margin, high_y + margin)
    tile, side = shapely.STRtree(shapely.linestrings(sides)).query(wide, predicate="intersects")
    across = np.stack([-rows.along[:, 1], rows.along[:, 0]], axis=1)[tile]
    off = ((sides[side] - rows.centre[tile][:, None]) * across[:, None]).sum(axis=2)
    spacing, most = rows.spacing[tile], rows.each_side[tile]
    first = np.maximum(np.ceil((off.min(axis=1) - margin[tile]) / spacing), -most)
    last = np.minimum(np.floor((off.max(axis=1) + margin[tile]) / spacing), most)
    counts = np.maximum(last - first + 1, 0).astype(np.int64)
    if counts.sum() > MAX_CROSSINGS:
        raise TooManyCrossingsError(
            f"crosses hatch lines some {float(counts.sum()):.3g} times, but at most {MAX_CROSSINGS:.3g} can "
            "be held; give it fewer corners, or raise spacing_mm"
        )
    step = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    of = np.repeat((rows.number + rows.each_side)[tile] + first, counts) + step
    side = np.repeat(side, counts)
    there = of < len(index)
    found, side = index[of[there].astype(np.intp)], side[there]
    return found[found >= 0], sides[side[found >= 0]]


def _near(
    of: NDArray[np.intp],
    side: NDArray[np.float64],
    start: NDArray[np.float64],
    along: NDArray[np.float64],
    length: NDArray[np.float64],
) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.float64]]:
    """Where sides lie on their lines: the line, from where and to where along it, in mm.

    A side that crosses its line does so in one place; one that is nearly parallel lies on it as long as
    it is within ``BORDER_MM``.
    """
    offset = side - start[:, None]
    t = (offset * along[:, None]).sum(axis=2)
    s = along[:, None, 0] * offset[:, :, 1] - along[:, None, 1] * offset[:, :, 0]
    change = s[:, 1] - s[:, 0]
    level = np.abs(change) <= 1e-3 * BORDER_MM
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        bounds = (np.array([-BORDER_MM, 0.0, BORDER_MM]) - s[:, :1]) / np.where(level, 1.0, change)[:, None]
    enter, leave = bounds[:, ::2].min(axis=1), bounds[:, ::2].max(axis=1)
    meets = np.where(level, np.abs(s[:, 0]) <= BORDER_MM, (enter <= 1) & (leave >= 0))
    part = np.stack([np.where(level, 0.0, enter), bounds[:, 1], np.where(level, 1.0, leave)], axis=1)
    place = t[:, :1] + np.clip(part, 0, 1) * (t[:, 1] - t[:, 0])[:, None]
    low, high = np.minimum(place[:, 0], place[:, 2]), np.maximum(place[:, 0], place[:, 2])
    crosses = ~level & (high - low <= RESOLUTION_MM)
    low, high = np.where(crosses, place[:, 1], low), np.where(crosses, place[:, 1], high)
    meets &= (high >= 0) & (low <= length)
    return of[meets], np.clip(low, 0, length)[meets], np.clip(high, 0, length)[meets]


def _joined(
    whose: NDArray[np.intp], low: NDArray[np.float64], high: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.float64]]:
    """The union of the stretches of each line; gaps that a program cannot say are closed."""
    if len(whose) == 0:
        return whose, low, high
    sequence = np.lexsort((low, whose))
    whose, low, high = whose[sequence], low[sequence], high[sequence]
    # The farthest end so far, as its place in the order of all ends: lines later in that order win anew.
    ranked = np.lexsort((high, whose))
    rank = np.empty_like(ranked)
    rank[ranked] = np.arange(len(ranked))
    reach = high[ranked][np.maximum.accumulate(rank)]
    opens = np.ones(len(whose), np.bool_)
    opens[1:] = (whose[1:] != whose[:-1]) | (low[1:] > reach[:-1] + RESOLUTION_MM)
    first = np.flatnonzero(opens)
    last = np.append(first[1:], len(whose)) - 1
    return whose[first], low[first], reach[last]
