"""The cheapest walk through one pair of neighbouring columns, without a graph of its states.

The same dynamic programme as ``pair_dp``, for sheets whose blocks together do not fit into memory. All
pairs of a down-set of the left column and one of the right have a place, so that nothing but their values has
to be kept, and those of one pair of columns at a time.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel, kernel
from slicer.sequence.bound.jumps import ENTER_LEFT, ENTER_RIGHT, LEAVE_LEFT, LEAVE_RIGHT
from slicer.sequence.states import holds


class Layout(NamedTuple):
    """Columns, their down-sets and endpoints; toolpaths are numbered column by column.

    Attributes:
        begin: int32 (c + 1,); column c has the toolpaths begin[c] .. begin[c + 1] - 1.
        point: float64 (2n, 2) in mm; toolpath s in direction f is entered at point[2s + f] and left at
            point[2s + 1 - f].
        seam: float64 (c,), the x of the middle of each column.
        set_start, step_start, step_path, step_to, step_slot, top_start, top_path: see ``DownSets``.
        allowed: bool (2n,), whether a toolpath may be printed so.
        member: uint64 (d, w), the toolpaths of each down-set, see ``Needs``.
        needed: uint64 (2, d, w), what each down-set needs of the column on its left, and on its right.
    """

    begin: NDArray[np.int32]
    point: NDArray[np.float64]
    seam: NDArray[np.float64]
    set_start: NDArray[np.int32]
    step_start: NDArray[np.int32]
    step_path: NDArray[np.int32]
    step_to: NDArray[np.int32]
    step_slot: NDArray[np.int32]
    top_start: NDArray[np.int32]
    top_path: NDArray[np.int32]
    allowed: NDArray[np.bool_]
    member: NDArray[np.uint64]
    needed: NDArray[np.uint64]


class Values(NamedTuple):
    """The least cost to the end of a pair's walk, for state (i, j) and each place of the nozzle.

    Attributes:
        outside: float64 (i, j, 2): left and right of the pair.
        left: float64 (t, j): at the end of oriented toolpath t, counted through the maximal elements of
            the left column's down-sets, twice each.
        right: float64 (i, t), the same of the right column.
    """

    outside: NDArray[np.float64]
    left: NDArray[np.float64]
    right: NDArray[np.float64]


@inner_kernel
def arc_cost(layout: Layout, price: NDArray[np.float64], c: int, u: int, v: int) -> float:
    """What the pair of columns c and c + 1 pays for the travel from oriented toolpath u to v."""
    middle, last = 2 * layout.begin[c + 1], len(layout.begin) - 2
    dx = layout.point[u ^ 1, 0] - layout.point[v, 0]
    dy = layout.point[u ^ 1, 1] - layout.point[v, 1]
    cost = float(np.sqrt(dx * dx + dy * dy))
    if u < middle and v < middle:
        return cost if c == 0 else 0.5 * cost
    if u >= middle and v >= middle:
        return cost if c + 1 == last else 0.5 * cost
    if u < middle:
        return cost - float(price[LEAVE_RIGHT, u] + price[ENTER_LEFT, v])
    return cost - float(price[LEAVE_LEFT, u] + price[ENTER_RIGHT, v])


@inner_kernel
def way_cost(layout: Layout, price: NDArray[np.float64], c: int, way: int, u: int) -> float:
    """What that pair pays for leaving u, or entering it, from or to columns left or right of the pair."""
    leftward = way in (LEAVE_LEFT, ENTER_LEFT)
    if c == 0 if leftward else c + 1 == len(layout.begin) - 2:
        return np.inf
    here = u < 2 * layout.begin[c + 1]
    if here == leftward:
        return float(price[way, u])
    x = layout.point[u ^ 1 if way in (LEAVE_LEFT, LEAVE_RIGHT) else u, 0]
    return float((x - layout.seam[c] if leftward else layout.seam[c + 1] - x) - price[way, u])


@kernel
def evaluate_pair(layout: Layout, price: NDArray[np.float64], c: int, values: Values) -> None:
    """Fill the values of columns c and c + 1 at these prices, from everything printed back to nothing.

    Infinite where the down-sets do not go together, and after a toolpath that may not be printed so.
    """
    a0, b0, end = layout.set_start[c], layout.set_start[c + 1], layout.set_start[c + 2]
    middle = 2 * layout.begin[c + 1]
    size = 2 * layout.begin[c + 2] - middle  # oriented toolpaths of the right column
    cross = layout.seam[c + 1] - layout.seam[c]
    most = 0
    for s in range(a0, end):
        most = max(most, 2 * (layout.step_start[s + 1] - layout.step_start[s]))
        most = max(most, 2 * (layout.top_start[s + 1] - layout.top_start[s]))
    ways = np.empty((4, size))
    for way in range(4):
        for v in range(size):
            ways[way, v] = way_cost(layout, price, c, way, middle + v)
    # Of the right column, everything that does not depend on i: its steps, tops, and travels between them.
    top_base = layout.top_start[b0]
    arc_start = np.zeros(end - b0 + 1, np.int64)
    for s in range(b0, end):
        steps, tops = (
            layout.step_start[s + 1] - layout.step_start[s],
            layout.top_start[s + 1] - layout.top_start[s],
        )
        arc_start[s - b0 + 1] = arc_start[s - b0] + 4 * steps * tops
    arc = np.empty(arc_start[-1])
    for s in range(b0, end):
        at = arc_start[s - b0]
        for t in range(2 * layout.top_start[s], 2 * layout.top_start[s + 1]):
            u = 2 * layout.top_path[t >> 1] + (t & 1)
            for e in range(2 * layout.step_start[s], 2 * layout.step_start[s + 1]):
                arc[at] = arc_cost(layout, price, c, u, 2 * layout.step_path[e >> 1] + (e & 1))
                at += 1
    row, onward = np.empty(most, np.int64), np.empty(most, np.int64)
    own = np.empty((most, most))
    over, back = np.empty((most, size)), np.empty((most, size))
    leave, enter = np.empty((2, most)), np.empty((2, most))
    rest, rest_right = np.empty(most), np.empty(most)
    may = np.empty(most, np.bool_)
    allowed, member, of_left, of_right = layout.allowed, layout.member, layout.needed[0], layout.needed[1]
    for i in range(b0 - 1, a0 - 1, -1):
        steps = 2 * (layout.step_start[i + 1] - layout.step_start[i])
        tops = 2 * (layout.top_start[i + 1] - layout.top_start[i])
        for q in range(steps):
            e = layout.step_start[i] + (q >> 1)
            v = 2 * layout.step_path[e] + (q & 1)
            row[q] = 2 * (
                layout.top_start[layout.step_to[e]] - layout.top_start[a0] + layout.step_slot[e]
            ) + (q & 1)
            enter[0, q] = way_cost(layout, price, c, ENTER_LEFT, v)
            enter[1, q] = way_cost(layout, price, c, ENTER_RIGHT, v)
            for u in range(size):
                back[q, u] = arc_cost(layout, price, c, middle + u, v)
        for p in range(tops):
            u = 2 * layout.top_path[layout.top_start[i] + (p >> 1)] + (p & 1)
            may[p] = allowed[u]
            leave[0, p] = way_cost(layout, price, c, LEAVE_LEFT, u)
            leave[1, p] = way_cost(layout, price, c, LEAVE_RIGHT, u)
            for v in range(size):
                over[p, v] = arc_cost(layout, price, c, u, middle + v)
            for q in range(steps):
                e = layout.step_start[i] + (q >> 1)
                own[p, q] = arc_cost(layout, price, c, u, 2 * layout.step_path[e] + (q & 1))
        first_top = 2 * (layout.top_start[i] - layout.top_start[a0])
        for j in range(end - 1, b0 - 1, -1):
            if i == b0 - 1 and j == end - 1:
                _finish(layout, price, c, values)
                continue
            if not (holds(member, i, of_left, j) and holds(member, j, of_right, i)):
                _bar(layout, c, values, i, j)
                continue
            from_left = from_right = np.inf
            for q in range(steps):
                w = values.left[row[q], j - b0]
                rest[q] = w
                from_left, from_right = min(from_left, enter[0, q] + w), min(from_right, enter[1, q] + w)
            count = 0
            for e in range(layout.step_start[j], layout.step_start[j + 1]):
                v = 2 * layout.step_path[e] - middle
                to = 2 * (layout.top_start[layout.step_to[e]] - top_base + layout.step_slot[e])
                for f in range(2):
                    w = values.right[i - a0, to + f]
                    rest_right[count], onward[count] = w, v + f
                    count += 1
                    from_left = min(from_left, ways[ENTER_LEFT, v + f] + w)
                    from_right = min(from_right, ways[ENTER_RIGHT, v + f] + w)
            left, right = min(from_left, from_right + cross), min(from_right, from_left + cross)
            values.outside[i - a0, j - b0, 0], values.outside[i - a0, j - b0, 1] = left, right
            for p in range(tops):
                best = min(left + leave[0, p], right + leave[1, p])
                for q in range(steps):
                    best = min(best, own[p, q] + rest[q])
                for q in range(count):
                    best = min(best, over[p, onward[q]] + rest_right[q])
                values.left[first_top + p, j - b0] = best if may[p] else np.inf
            at = arc_start[j - b0]
            for t in range(2 * layout.top_start[j], 2 * layout.top_start[j + 1]):
                u = 2 * layout.top_path[t >> 1] + (t & 1) - middle
                best = min(left + ways[LEAVE_LEFT, u], right + ways[LEAVE_RIGHT, u])
                for q in range(steps):
                    best = min(best, back[q, u] + rest[q])
                for q in range(count):
                    best = min(best, arc[at] + rest_right[q])
                    at += 1
                values.right[i - a0, t - 2 * top_base] = best if allowed[u + middle] else np.inf


@inner_kernel
def _finish(layout: Layout, price: NDArray[np.float64], c: int, values: Values) -> None:
    """The values where all is printed: the sequence ends here, or goes on outside at a price below zero."""
    a0, b0, end = layout.set_start[c], layout.set_start[c + 1], layout.set_start[c + 2]
    i, j = b0 - 1 - a0, end - 1 - b0
    values.outside[i, j, 0] = values.outside[i, j, 1] = 0.0
    for s in (b0 - 1, end - 1):
        for t in range(2 * layout.top_start[s], 2 * layout.top_start[s + 1]):
            u = 2 * layout.top_path[t >> 1] + (t & 1)
            leave = min(way_cost(layout, price, c, LEAVE_LEFT, u), way_cost(layout, price, c, LEAVE_RIGHT, u))
            cost = min(0.0, leave) if layout.allowed[u] else np.inf
            if s == b0 - 1:
                values.left[t - 2 * layout.top_start[a0], j] = cost
            else:
                values.right[i, t - 2 * layout.top_start[b0]] = cost


@inner_kernel
def _bar(layout: Layout, c: int, values: Values, i: int, j: int) -> None:
    """The values of down-sets i and j that do not go together."""
    a0, b0 = layout.set_start[c], layout.set_start[c + 1]
    values.outside[i - a0, j - b0, 0] = values.outside[i - a0, j - b0, 1] = np.inf
    for t in range(2 * layout.top_start[i], 2 * layout.top_start[i + 1]):
        values.left[t - 2 * layout.top_start[a0], j - b0] = np.inf
    for t in range(2 * layout.top_start[j], 2 * layout.top_start[j + 1]):
        values.right[i - a0, t - 2 * layout.top_start[b0]] = np.inf
