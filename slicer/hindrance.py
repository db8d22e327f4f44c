"""Which toolpaths the body of the nozzle would hit, found by following the edge of what a toolpath forbids.

Once toolpath A is printed, the tip may no longer be where a point of A would lie in the hard core of the
body (see ``slicer.nozzle``). All parts of the core, needle, barrel and shoulder, are convex and go up without
end; so what A forbids is, for each of them, all that lies below one concave line, the sum of A and the
mirrored lower edge of the core. From the higher end of A it runs level by the half width to either side, then
down along A, then down the flank as far as that goes; along A only then, where A is steeper. What passes
below that line somewhere must be printed before A.

At each x only the highest toolpath below the line needs to be named, the others lie below that one. The line
is therefore followed through the trapezoids of the sheet (``slicer.trapezoids``), and the toolpath below is
taken down in each of them. A flank is followed only until the flank of a toolpath that was taken down lies
higher: from there on, that one's line tells the rest, if it does not end before. As it lies higher, no two
can rely on each other.
"""

import numpy as np
from numpy.typing import NDArray

from slicer.forbidden import STRAIGHT, X_EPS_MM, Starts, edges_of, is_upright, starts_of
from slicer.kernels import inner_kernel, kernel
from slicer.nozzle import EPS_MM, NozzleBody, stands_in_the_way
from slicer.trapezoids import (
    Ends,
    Trapezoids,
    behind_wall,
    cut,
    height_at,
    on_top_of,
    underneath,
    upright_under,
)
from slicer.treap import NONE


def hindered_by(
    body: NozzleBody,
    lines: NDArray[np.float64],
    ranks: tuple[NDArray[np.int32], NDArray[np.int32]],
    queries: NDArray[np.float64] | None = None,
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """See ``precedence.hindered``; without queries, what toolpaths hinder by the body alone.

    Args:
        body: the nozzle.
        lines: float64 (n, 2, 2) in mm, from left to right, uprights from below.
        ranks: int32 (n,) twice, of the x of both ends.
        queries: float64 (q, 2, 2) in the same manner.

    Returns:
        (start int32 (q + 1,), toolpath int32): query k hinders ``toolpath[start[k]:start[k + 1]]``.
    """
    own = queries is None
    asked = lines if queries is None else queries
    edges = edges_of(body) + ([] if own else [STRAIGHT])
    if len(lines) == 0 or len(asked) == 0 or not edges:
        return np.zeros(len(asked) + 1, np.int32), np.empty(0, np.int32)
    ends = Ends.of(lines, *ranks)
    starts, points = starts_of(asked, edges, ends.x)
    to_right, to_left, found = cut(lines, ends, points)
    q = len(asked)
    starts.at[:] = found[: 2 * q * len(edges)].reshape(q, len(edges), 2)
    starts.passing[:] = NONE
    passing = found[2 * q * len(edges) :]
    on_wall = starts.wall[is_upright(asked)] >= 0
    under = np.where(on_wall, passing, to_right.low[np.where(on_wall, 0, passing)])
    starts.passing[is_upright(asked)] = np.where(under < len(lines), under, NONE)
    shape = np.array(edges, np.float64)
    right = _meet((lines, asked), own, shape, starts, to_right, 0)
    left = _meet((lines, asked), own, shape, starts, to_left, 1)
    return _confirm(body, (lines, asked), own, right, left)


@kernel
def _meet(
    segments: tuple[NDArray[np.float64], NDArray[np.float64]],
    own: bool,
    edges: NDArray[np.float64],
    starts: Starts,
    sheet: Trapezoids,
    side: int,
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """(start, toolpath): what the lines of each query meet on one side, which may not all be hindered.

    Args:
        segments: the toolpaths, and the queries.
        own: whether query k is toolpath k.
        edges: float64 (e, 5), numbers of each ``Edge``.
        sheet: the trapezoids on the way to that side.
        side: 0 to the right, 1 to the left.
    """
    lines, asked = segments
    n, q = len(lines), len(asked)
    begin = np.zeros(q + 1, np.int32)
    met = np.empty(4 * q + n, np.int32)
    new = np.empty(n, np.int32)
    seen = np.full(n, -1, np.int32)  # the last query that met a toolpath
    total = 0
    for k in range(q):
        if own:
            seen[k] = k
        count = _note(starts.passing[k], k, seen, new, 0)
        for e in range(len(edges)):
            count = _walk((lines, asked[k]), (k, e, side), edges[e], starts, sheet, seen, new, count)
        if total + count > len(met):
            longer = np.empty(2 * len(met) + count, np.int32)
            for c in range(total):
                longer[c] = met[c]
            met = longer
        for c in range(count):
            met[total + c] = new[c]
        total += count
        begin[k + 1] = total
    return begin, met[:total]


@kernel
def _confirm(
    body: NozzleBody,
    segments: tuple[NDArray[np.float64], NDArray[np.float64]],
    own: bool,
    right: tuple[NDArray[np.int32], NDArray[np.int32]],
    left: tuple[NDArray[np.int32], NDArray[np.int32]],
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """(start, toolpath): of what is met on both sides, what is hindered.

    What is met within rounding errors may not be, nor need an upright which only its wall tells of.
    """
    lines, asked = segments
    to_right, on_right = right
    to_left, on_left = left
    q = len(asked)
    begin = np.zeros(q + 1, np.int32)
    out = np.empty(len(on_right) + len(on_left), np.int32)
    seen = np.full(len(lines), -1, np.int32)
    total = 0
    for k in range(q):
        rights = to_right[k + 1] - to_right[k]
        for c in range(rights + to_left[k + 1] - to_left[k]):
            s = on_right[to_right[k] + c] if c < rights else on_left[to_left[k] + c - rights]
            if seen[s] == k:
                continue
            seen[s] = k
            if stands_in_the_way(body, asked[k], lines[s]) or (not own and _lies_below(lines[s], asked[k])):
                out[total] = s
                total += 1
        begin[k + 1] = total
    return begin, out[:total].copy()


@inner_kernel
def _walk(
    segments: tuple[NDArray[np.float64], NDArray[np.float64]],
    task: tuple[int, int, int],
    edge: NDArray[np.float64],
    starts: Starts,
    sheet: Trapezoids,
    seen: NDArray[np.int32],
    new: NDArray[np.int32],
    count: int,
) -> int:
    """Follow one line to one side and note what it meets; returns how many toolpaths are noted now.

    Args:
        segments: the toolpaths, and the query.
        task: numbers of the query and the edge, and the side: 0 to the right, 1 to the left.
        edge: numbers of an ``Edge``.
        seen, new, count: see ``_note``.
    """
    lines, asked = segments
    k, e, side = task
    sign = 1.0 - 2.0 * side
    bottom, top = len(lines), len(lines) + 1
    walls = len(sheet.upright_start) - 1
    width, steep = edge[1], edge[2]
    x, y = sign * starts.point[k, e, 0], starts.point[k, e, 1]
    run, fall = asked[1, 0] - asked[0, 0], asked[1, 1] - asked[0, 1]
    # Along the toolpath the line falls on the side of its lower end alone, before the flank or after it.
    if (fall >= 0.0) == (side == 0) or run <= X_EPS_MM:
        run = fall = 0.0
    else:
        fall = -abs(fall) / run
    steeper = fall <= -steep
    mine, far = _flank(asked, sign, steep), sign * asked[1 - side, 0]
    told = np.inf  # from where on the line of another tells the rest
    at = starts.at[k, e, side]
    wall = starts.wall[k]
    if wall >= 0:
        wall = wall if side == 0 else walls - 1 - wall
        count = _note(upright_under(sheet, wall, lines, y), k, seen, new, count)
    for piece in range(3):
        from_x, from_y = x, y
        on_flank = piece == (1 if steeper else 2)
        if piece == 0:
            slope, stop = 0.0, x + width
        elif on_flank:
            slope, stop = -steep, x + edge[3] - width
        else:
            slope, stop = fall, x + run
        stop = min(stop, told)
        while x < stop:
            low, high = sheet.low[at], sheet.high[at]
            until = min(stop, sheet.end[at])
            y = from_y + slope * (until - from_x)
            # Where the line leaves through a side of the trapezoid; slopes tell through which it may.
            leaves = NONE
            if high != top and slope > sheet.line[high, 2] and y > height_at(sheet, high, until):
                leaves = high
            elif low != bottom and slope < sheet.line[low, 2] and y < height_at(sheet, low, until):
                leaves = low
            if leaves != NONE:
                gap = from_y + slope * (x - from_x) - height_at(sheet, leaves, x)
                until = max(x, min(until, x + gap / (sheet.line[leaves, 2] - slope)))
                y = from_y + slope * (until - from_x)
            if low != bottom:
                count = _note(low, k, seen, new, count)
                if on_flank and _flank(lines[low], sign, steep) > mine:
                    middle = (x + until) / 2
                    if from_y + slope * (middle - from_x) > height_at(sheet, low, middle) + EPS_MM:
                        theirs = _flank_begins(lines[low], sign, steep)
                        if theirs >= far or edge[3] == np.inf:
                            told = min(told, theirs + width)
                            stop = min(stop, told)
            x = until
            if leaves != NONE:
                at = on_top_of(sheet, high, x) if leaves == high else underneath(sheet, low, x)
            elif x < stop:
                wall = sheet.wall[at]
                if wall == walls or y < sheet.floor:
                    return count
                count = _note(upright_under(sheet, wall, lines, y), k, seen, new, count)
                at = behind_wall(sheet, wall, x, y)
    return count


@inner_kernel
def _note(s: int, k: int, seen: NDArray[np.int32], new: NDArray[np.int32], count: int) -> int:
    """Note that query k meets toolpath s, if there is one; returns how many are noted now.

    Args:
        seen: int32 (n,), the last query that met each toolpath.
        new: int32 (n,), those that this one has met, in no order.
        count: how many those are.
    """
    if s == NONE or seen[s] == k:
        return count
    seen[s] = k
    new[count] = s
    return count + 1


@inner_kernel
def _flank(line: NDArray[np.float64], sign: float, steep: float) -> float:
    """How high the flank of a toolpath lies: y on the axis x = 0 of a line through one of its ends."""
    return float(max(line[0, 1] + steep * sign * line[0, 0], line[1, 1] + steep * sign * line[1, 0]))


@inner_kernel
def _flank_begins(line: NDArray[np.float64], sign: float, steep: float) -> float:
    """x, along the way, of that end."""
    first = line[0, 1] + steep * sign * line[0, 0] > line[1, 1] + steep * sign * line[1, 0]
    return float(sign * (line[0, 0] if first else line[1, 0]))


@inner_kernel
def _lies_below(low: NDArray[np.float64], high: NDArray[np.float64]) -> bool:
    """Whether one segment lies straight below another, by the definition in ``slicer.precedence``."""
    left, right = max(low[0, 0], high[0, 0]), min(low[1, 0], high[1, 0])
    low_upright = low[1, 0] - low[0, 0] <= X_EPS_MM
    high_upright = high[1, 0] - high[0, 0] <= X_EPS_MM
    if low_upright and high_upright:
        return bool(abs(left - right) <= X_EPS_MM and low[1, 1] <= high[0, 1] + X_EPS_MM)
    if low_upright:
        inside = high[0, 0] + X_EPS_MM < left < high[1, 0] - X_EPS_MM
        return bool(inside and low[1, 1] <= _y_at(high, left) + X_EPS_MM)
    if high_upright:
        inside = low[0, 0] + X_EPS_MM < left < low[1, 0] - X_EPS_MM
        return bool(inside and _y_at(low, left) <= high[0, 1] + X_EPS_MM)
    if right - left <= X_EPS_MM:
        return False
    middle = (left + right) / 2
    return bool(_y_at(low, middle) < _y_at(high, middle) - X_EPS_MM)


@inner_kernel
def _y_at(line: NDArray[np.float64], x: float) -> float:
    return float(line[0, 1] + (line[1, 1] - line[0, 1]) / (line[1, 0] - line[0, 0]) * (x - line[0, 0]))
