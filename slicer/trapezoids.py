"""The sheet cut into trapezoids: between two toolpaths, one above the other, from one x to another.

At the ends of every toolpath the sheet is cut upwards and downwards as far as the next toolpath (the
vertical decomposition of computational geometry; de Berg et al., "Computational Geometry", chapter 6). An
upright cuts the trapezoid in which it stands. So whoever follows a line through the sheet meets in every
trapezoid one toolpath below and one above, and at its end a *wall*, at which uprights may stand. Node n is
what lies below everything and node n + 1 what lies above.

The walls are numbered by the rank of their x, as ``precedence`` ranks it.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel, kernel
from slicer.treap import NONE, highest_under, insert, remove


class Ends(NamedTuple):
    """Where toolpaths begin and end, in ranks of x; equal for uprights.

    Attributes:
        first, last: int32 (n,), the rank of each left and right end.
        by_first, by_last: int64 (n,), what sorts those.
        x: float64 (ranks,), the x of each rank in mm.
    """

    first: NDArray[np.int32]
    last: NDArray[np.int32]
    by_first: NDArray[np.int64]
    by_last: NDArray[np.int64]
    x: NDArray[np.float64]

    @classmethod
    def of(cls, lines: NDArray[np.float64], first: NDArray[np.int32], last: NDArray[np.int32]) -> "Ends":
        """The ends of lines (n, 2, 2) that run from left to right."""
        x = np.empty(int(last.max(initial=-1)) + 1)
        x[last], x[first] = lines[:, 1, 0], lines[:, 0, 0]
        return cls(first, last, np.argsort(first, kind="stable"), np.argsort(last, kind="stable"), x)


class Points(NamedTuple):
    """Places to be found in the sheet while it is swept.

    Attributes:
        xy: float64 (m, 2) in mm.
        moment: int64 (m,): 2k for what lies between the walls k - 1 and k, 2k + 1 for what passes the wall k.
        by_moment: int64 (m,), what sorts those.
    """

    xy: NDArray[np.float64]
    moment: NDArray[np.int64]
    by_moment: NDArray[np.int64]


class Trapezoids(NamedTuple):
    """The trapezoids of a sheet as one meets them on the way to the right, or mirrored, to the left.

    All x count in the direction of the way: to the left they are negative.

    Attributes:
        line: float64 (n + 2, 3), of each node x and y of the first end, and the slope.
        low, high: int32 (t,), the node below and above each trapezoid.
        begin, end: float64 (t,), its x.
        wall: int32 (t,), the wall at its end; the number of walls where there is none.
        above_start, above: int32 (n + 3,) and (t,), the trapezoids on each node, along the way.
        under_start, under: the same for those under it.
        behind_start, behind: int32 (walls + 2,) and (t,), the trapezoids that begin at each wall, from low to
            high; number 0 is what lies before the first wall, k + 1 what lies behind wall k.
        upright_start, upright: int32 (walls + 1,) and (u,), the uprights at each wall, from low to high.
        floor: no toolpath reaches below this y.
    """

    line: NDArray[np.float64]
    low: NDArray[np.int32]
    high: NDArray[np.int32]
    begin: NDArray[np.float64]
    end: NDArray[np.float64]
    wall: NDArray[np.int32]
    above_start: NDArray[np.int32]
    above: NDArray[np.int32]
    under_start: NDArray[np.int32]
    under: NDArray[np.int32]
    behind_start: NDArray[np.int32]
    behind: NDArray[np.int32]
    upright_start: NDArray[np.int32]
    upright: NDArray[np.int32]
    floor: float


def cut(
    lines: NDArray[np.float64], ends: Ends, points: Points
) -> tuple[Trapezoids, Trapezoids, NDArray[np.int32]]:
    """Cut a sheet into trapezoids, of which there are at most 3n + 1; takes O((n + m) log n).

    Args:
        lines: float64 (n, 2, 2) in mm, from left to right, uprights from below; none may cross.

    Returns:
        (on the way to the right, on the way to the left, int32 (m,)): the last one has of every point the
        trapezoid that holds it, or at an odd moment the highest node that passes below it.
    """
    n = len(lines)
    # The shape of the treap need only look random.
    weight = np.random.default_rng(0).permutation(n + 2).astype(np.uint32)
    low, high, begin, end, found = _cut(lines, ends, points, weight)
    line = np.zeros((n + 2, 3))
    line[:n, :2] = lines[:, 0]
    slanted = ends.first != ends.last
    d = lines[slanted, 1] - lines[slanted, 0]
    line[:n, 2][slanted] = d[:, 1] / d[:, 0]
    line[n, 1], line[n + 1, 1] = -np.inf, np.inf
    of_rising_foot = np.argsort(lines[:, 0, 1], kind="stable")
    upright = of_rising_foot[~slanted[of_rising_foot]].astype(np.int32)
    rank = np.asarray(ends.first[upright], np.int32)
    walls = len(ends.x)
    floor = float(lines[:, :, 1].min())
    # Outside there is nothing to be met, so any x will do there.
    x = np.concatenate([ends.x[:1] - 1, ends.x, ends.x[-1:] + 1])
    to_right = _directed(
        line, low, high, x[begin + 1], x[end + 1], (begin, end), (rank, upright, walls), floor
    )
    mirrored = line * [-1.0, 1.0, -1.0]
    turned = (walls - 1 - end, walls - 1 - begin)
    to_left = _directed(
        mirrored, low, high, -x[end + 1], -x[begin + 1], turned, (walls - 1 - rank, upright, walls), floor
    )
    return to_right, to_left, found


def _directed(
    line: NDArray[np.float64],
    low: NDArray[np.int32],
    high: NDArray[np.int32],
    begin: NDArray[np.float64],
    end: NDArray[np.float64],
    walls: tuple[NDArray[np.int32], NDArray[np.int32]],
    uprights: tuple[NDArray[np.int32], NDArray[np.int32], int],
    floor: float,
) -> Trapezoids:
    nodes = len(line)
    first, last = walls
    rank, upright, count = uprights
    left = line[low, 1] + line[low, 2] * (begin - line[low, 0])
    behind = np.lexsort((line[low, 2], left, first))
    return Trapezoids(
        line,
        low,
        high,
        begin,
        end,
        last,
        _starts(low, nodes),
        np.lexsort((begin, low)).astype(np.int32),
        _starts(high, nodes),
        np.lexsort((begin, high)).astype(np.int32),
        _starts(first + 1, count + 1),
        behind.astype(np.int32),
        _starts(rank, count),
        upright[np.argsort(rank, kind="stable")],
        floor,
    )


def _starts(of: NDArray[np.signedinteger], groups: int) -> NDArray[np.int32]:
    start = np.zeros(groups + 1, np.int32)
    np.cumsum(np.bincount(of, minlength=groups), out=start[1:])
    return start


@inner_kernel
def height_at(sheet: Trapezoids, s: int, x: float) -> float:
    """y of a node at x, or infinity below and above everything."""
    return float(sheet.line[s, 1] + sheet.line[s, 2] * (x - sheet.line[s, 0]))


@inner_kernel
def on_top_of(sheet: Trapezoids, s: int, x: float) -> int:
    """The trapezoid on node s that begins at or before x."""
    return _at(sheet.above, sheet.above_start[s], sheet.above_start[s + 1], sheet.begin, x)


@inner_kernel
def underneath(sheet: Trapezoids, s: int, x: float) -> int:
    """The trapezoid under node s that begins at or before x."""
    return _at(sheet.under, sheet.under_start[s], sheet.under_start[s + 1], sheet.begin, x)


@inner_kernel
def _at(of: NDArray[np.int32], first: int, last: int, begin: NDArray[np.float64], x: float) -> int:
    while last - first > 1:
        middle = (first + last) // 2
        if begin[of[middle]] <= x:
            first = middle
        else:
            last = middle
    return int(of[first])


@inner_kernel
def behind_wall(sheet: Trapezoids, wall: int, x: float, y: float) -> int:
    """The trapezoid that begins at a wall and holds (x, y) there."""
    first, last = sheet.behind_start[wall + 1], sheet.behind_start[wall + 2]
    while last - first > 1:
        middle = (first + last) // 2
        if height_at(sheet, sheet.low[sheet.behind[middle]], x) <= y:
            first = middle
        else:
            last = middle
    at = int(sheet.behind[first])
    # Several may begin in one point.
    top = len(sheet.line) - 1
    while sheet.high[at] != top and height_at(sheet, sheet.high[at], x) < y:
        at = on_top_of(sheet, sheet.high[at], x)
    return at


@inner_kernel
def upright_under(sheet: Trapezoids, wall: int, lines: NDArray[np.float64], y: float) -> int:
    """The highest upright at a wall whose lower end lies below y, or ``NONE``."""
    first, last = sheet.upright_start[wall] - 1, sheet.upright_start[wall + 1]
    while last - first > 1:
        middle = (first + last) // 2
        if lines[sheet.upright[middle], 0, 1] < y:
            first = middle
        else:
            last = middle
    return int(sheet.upright[first]) if first >= sheet.upright_start[wall] else NONE


@kernel
def _cut(
    lines: NDArray[np.float64], ends: Ends, points: Points, weight: NDArray[np.uint32]
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]:
    """(low, high, begin, end) of each trapezoid, the last two as walls from -1 on; and the points found."""
    first, last, by_first, by_last = ends.first, ends.last, ends.by_first, ends.by_last
    xy, moment, by_moment = points.xy, points.moment, points.by_moment
    n = len(lines)
    walls = len(ends.x)
    bottom, top = n, n + 1
    left = np.full(n + 2, NONE, np.int32)
    right = np.full(n + 2, NONE, np.int32)
    parent = np.full(n + 2, NONE, np.int32)
    below = np.full(n + 2, NONE, np.int32)
    above = np.full(n + 2, NONE, np.int32)
    above[bottom], below[top] = top, bottom
    uprights = first == last
    low = np.empty(3 * n + 1, np.int32)
    high = np.empty(3 * n + 1, np.int32)
    begin = np.empty(3 * n + 1, np.int32)
    end = np.full(3 * n + 1, walls, np.int32)
    found = np.empty(len(moment), np.int32)
    trapezoid = np.full(n + 2, NONE, np.int32)  # the one that is open on each node
    touched = np.empty(3 * n + 1, np.int32)
    low[0], high[0], begin[0] = bottom, top, -1
    trapezoid[bottom] = 0
    count = 1
    i = j = k = 0
    for wall in range(walls + 1):
        while k < len(moment) and moment[by_moment[k]] == 2 * wall:
            p = by_moment[k]
            found[p] = trapezoid[highest_under(lines, left, right, xy[p, 0], xy[p, 1])]
            k += 1
        if wall == walls:
            break
        changed = 0
        while j < n and last[by_last[j]] == wall:
            c = by_last[j]
            j += 1
            if uprights[c]:
                continue
            _close(below[c], wall, trapezoid, end)
            _close(c, wall, trapezoid, end)
            touched[changed] = below[c]
            changed += 1
            remove(c, left, right, parent, weight, below, above)
        while k < len(moment) and moment[by_moment[k]] == 2 * wall + 1:
            p = by_moment[k]
            found[p] = highest_under(lines, left, right, xy[p, 0], xy[p, 1])
            k += 1
        start = i
        while i < n and first[by_first[i]] == wall:
            c = by_first[i]
            i += 1
            if uprights[c]:
                middle = (lines[c, 0, 1] + lines[c, 1, 1]) / 2
                node = highest_under(lines, left, right, lines[c, 0, 0], middle)
                _close(node, wall, trapezoid, end)
                touched[changed] = node
                changed += 1
        for index in range(start, i):
            c = by_first[index]
            if uprights[c]:
                continue
            insert(lines, c, uprights, (left, right), parent, weight, below, above)
            _close(below[c], wall, trapezoid, end)
            touched[changed] = below[c]
            touched[changed + 1] = c
            changed += 2
        for index in range(changed):
            node = touched[index]
            if trapezoid[node] != NONE or (node < n and last[node] == wall):  # opened, or ended itself
                continue
            trapezoid[node] = count
            low[count], high[count], begin[count] = node, above[node], wall
            count += 1
    return low[:count].copy(), high[:count].copy(), begin[:count].copy(), end[:count].copy(), found


@inner_kernel
def _close(node: int, wall: int, trapezoid: NDArray[np.int32], end: NDArray[np.int32]) -> None:
    """Let the trapezoid that is open on a node, if there is one, end at a wall."""
    if trapezoid[node] != NONE:
        end[trapezoid[node]] = wall
        trapezoid[node] = NONE
