"""Columns of a large sheet, and what a pair of them pays for travels, at some prices."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import allocating_inner_kernel, inner_kernel
from slicer.sequence.bound.paid import ENTER_LEFT, ENTER_RIGHT, LEAVE_LEFT, LEAVE_RIGHT


class Layout(NamedTuple):
    """Columns, their down-sets and endpoints; toolpaths are numbered column by column.

    Attributes:
        begin: int32 (c + 1,); column c has the toolpaths begin[c] .. begin[c + 1] - 1.
        column: int32 (n,), the column of each.
        point: float64 (2n, 2) in mm; toolpath s in direction f is entered at point[2s + f] and left at
            point[2s + 1 - f].
        seam: float64 (c,), the x of the middle of each column.
        set_start, step_start, step_path, step_to, step_slot, top_start, top_path: see ``DownSets``.
        allowed: bool (2n,), whether a toolpath may be printed so.
        touched: int32 (2, d), the least toolpath that is a step or a maximal element of a down-set or of a
            greater one of its column, and the greatest of one or of a smaller one.
        member: uint64 (d, w), the toolpaths of each down-set, see ``Needs``.
        needed: uint64 (2, d, w), what each down-set needs of the column on its left, and on its right.
    """

    begin: NDArray[np.int32]
    column: NDArray[np.int32]
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
    touched: NDArray[np.int32]
    member: NDArray[np.uint64]
    needed: NDArray[np.uint64]


class PairColumn(NamedTuple):
    """What the pair needs of one of its columns. Steps and maximal elements are counted through, each twice,
    oriented; toolpaths and down-sets count from the column's first.

    Attributes:
        top_start, step_start: int32 (d + 1,), those of each down-set.
        top_path, step_path: int32, their toolpaths.
        top_set: int32, the down-set of which each is a maximal element.
        step_set, step_top: int32, the down-set that a step leads to, and the maximal element it becomes.
        arc_start, arc: int64 (d + 1,) and float64, what the travel from each maximal element of a down-set to
            each of its steps costs, be it by going outside, which is the same to the dynamic programme.
        way: float64 (4, 2m), the costs of ``jumps`` of each toolpath; of leaving, they are the least with
            going across, and infinite where it may not be printed so.
        place: float64 (4, 2m), x and y where each is left and entered.
        price: float64 (2, 2m), of leaving it to the other column (minus infinity where it may not be printed
            so), and of entering it from there.
    """

    top_start: NDArray[np.int32]
    step_start: NDArray[np.int32]
    top_path: NDArray[np.int32]
    step_path: NDArray[np.int32]
    top_set: NDArray[np.int32]
    step_set: NDArray[np.int32]
    step_top: NDArray[np.int32]
    arc_start: NDArray[np.int64]
    arc: NDArray[np.float64]
    way: NDArray[np.float64]
    place: NDArray[np.float64]
    price: NDArray[np.float64]


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


@inner_kernel
def leave_cost(layout: Layout, price: NDArray[np.float64], c: int, u: int, side: int) -> float:
    """What getting out to a side costs after u, 0 for left: at once, or on the other side and across."""
    cross = layout.seam[c + 1] - layout.seam[c]
    left = way_cost(layout, price, c, LEAVE_LEFT, u) + (cross if side == 1 else 0.0)
    right = way_cost(layout, price, c, LEAVE_RIGHT, u) + (cross if side == 0 else 0.0)
    return float(min(left, right))


@allocating_inner_kernel
def pair_column(layout: Layout, price: NDArray[np.float64], c: int, side: int) -> PairColumn:
    """Column c for side 0, or c + 1 for side 1, of the pair of both."""
    begin, end = layout.set_start[c + side], layout.set_start[c + side + 1]
    base = 2 * layout.begin[c + side]
    size, sets = 2 * layout.begin[c + side + 1] - base, end - begin
    first_top, first_step = 2 * layout.top_start[begin], 2 * layout.step_start[begin]
    tops, steps = 2 * layout.top_start[end] - first_top, 2 * layout.step_start[end] - first_step
    column = PairColumn(
        np.empty(sets + 1, np.int32),
        np.empty(sets + 1, np.int32),
        np.empty(tops, np.int32),
        np.empty(steps, np.int32),
        np.empty(tops, np.int32),
        np.empty(steps, np.int32),
        np.empty(steps, np.int32),
        np.zeros(sets + 1, np.int64),
        np.empty(4 * _arcs(layout, begin, end)),
        np.empty((4, size)),
        np.empty((4, size)),
        np.empty((2, size)),
    )
    leave, enter = (LEAVE_RIGHT, ENTER_RIGHT) if side == 0 else (LEAVE_LEFT, ENTER_LEFT)
    for v in range(size):
        for way in range(2):
            out = leave_cost(layout, price, c, base + v, way)
            column.way[LEAVE_LEFT + way, v] = out if layout.allowed[base + v] else np.inf
            column.way[ENTER_LEFT + way, v] = way_cost(layout, price, c, ENTER_LEFT + way, base + v)
        for axis in range(2):
            column.place[axis, v] = layout.point[(base + v) ^ 1, axis]
            column.place[2 + axis, v] = layout.point[base + v, axis]
        column.price[0, v] = price[leave, base + v] if layout.allowed[base + v] else -np.inf
        column.price[1, v] = price[enter, base + v]
    for t in range(tops):
        column.top_path[t] = 2 * layout.top_path[(first_top + t) >> 1] + (t & 1) - base
    for k in range(steps):
        e = (first_step + k) >> 1
        column.step_path[k] = 2 * layout.step_path[e] + (k & 1) - base
        column.step_set[k] = layout.step_to[e] - begin
        top = layout.top_start[layout.step_to[e]] + layout.step_slot[e]
        column.step_top[k] = 2 * top - first_top + (k & 1)
    outermost = c == 0 if side == 0 else c + 1 == len(layout.begin) - 2
    part, at = 1.0 if outermost else 0.5, 0  # see ``arc_cost``
    for s in range(sets + 1):
        column.top_start[s] = 2 * layout.top_start[begin + s] - first_top
        column.step_start[s] = 2 * layout.step_start[begin + s] - first_step
        column.arc_start[s] = at
        if s < sets:
            for t in range(2 * layout.top_start[begin + s], 2 * layout.top_start[begin + s + 1]):
                column.top_set[t - first_top] = s
                for k in range(2 * layout.step_start[begin + s], 2 * layout.step_start[begin + s + 1]):
                    u, v = column.top_path[t - first_top], column.step_path[k - first_step]
                    dx = column.place[0, u] - column.place[2, v]
                    dy = column.place[1, u] - column.place[3, v]
                    out = min(
                        column.way[LEAVE_LEFT, u] + column.way[ENTER_LEFT, v],
                        column.way[LEAVE_RIGHT, u] + column.way[ENTER_RIGHT, v],
                    )
                    direct = part * np.sqrt(dx * dx + dy * dy)
                    column.arc[at] = min(direct, out) if column.price[0, u] > -np.inf else np.inf
                    at += 1
    return column


@inner_kernel
def _arcs(layout: Layout, begin: int, end: int) -> int:
    """The steps from maximal elements of the down-sets begin .. end - 1, without directions."""
    count = 0
    for s in range(begin, end):
        tops = layout.top_start[s + 1] - layout.top_start[s]
        count += tops * (layout.step_start[s + 1] - layout.step_start[s])
    return int(count)
