"""What the cheapest walk through each block of columns costs, from every state on.

An exact dynamic programme over the states of every block, backwards: the value of a state and a place of the
nozzle is what printing the rest of the block costs at least.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import allocating_inner_kernel, inner_kernel, vector_inner_kernel
from slicer.sequence.bound.ends import Ends
from slicer.sequence.bound.lagrangian_costs import apply_multipliers
from slicer.sequence.bound.paid import (
    ENTER_LEFT,
    ENTER_RIGHT,
    ENTERED,
    LEAVE_LEFT,
    LEAVE_RIGHT,
    LEFT_OFF,
    Paid,
    way_cost,
)
from slicer.sequence.bound.pair_costs import BlockCosts, detour_row
from slicer.sequence.bound.visits import settle_visits
from slicer.sequence.bound.what_follows import find_steps, is_counted, most_steps
from slicer.sequence.states import NONE, OUTSIDE, Blocks, Follows

OWN, ACROSS = range(2)
"""Where a travel to the next toolpath comes from: its own column, or another one of its block."""


class Room(NamedTuple):
    """What comes next at a state, its steps one after the other.

    Attributes:
        onward: int64 (m,), the toolpath of each step, oriented in direction 0.
        rest: float64 (2, m, 2), for each way of coming there and each direction, what is left to pay after
            the travel, less what is off at its end.
        back: float64 (2, m), what is left to pay from outside on, from the left and from the right, in the
            cheaper direction.
        place: int64 (2, m), of the steps of the first and the last column's down-sets; ``NONE`` if left out.
    """

    onward: NDArray[np.int64]
    rest: NDArray[np.float64]
    back: NDArray[np.float64]
    place: NDArray[np.int64]


@allocating_inner_kernel
def bound_by_start(
    blocks: Blocks,
    block_costs: BlockCosts,
    ends: Ends,
    multipliers: NDArray[np.float64],
    paid: Paid,
    value: NDArray[np.float64],
) -> NDArray[np.float64]:
    """float64 (k,), the lower bound on all sequences that begin with each of the possible starts.

    Args:
        multipliers: at which of them.
        paid: room for what the blocks pay there.
        value: room for the least cost from each value of ``Blocks`` to the end of its block; infinite after a
            toolpath that may not be printed so.
    """
    apply_multipliers(blocks, block_costs, multipliers, paid)
    most = most_steps(blocks)
    room = Room(
        np.empty(most, np.int64),
        np.empty((2, most, 2)),
        np.empty((2, most)),
        np.empty((2, most), np.int64),
    )
    for k in range(len(blocks.state_start) - 1):
        _finish(blocks, block_costs, ends, paid, value, k)
        # None is a type of its own, so that the code for counts is left out of what is compiled for it.
        if is_counted(block_costs):
            _evaluate_block(blocks, block_costs, paid, value, k, room, blocks.follows)
        else:
            _evaluate_block(blocks, block_costs, paid, value, k, room, None)
    by_start = _roots(blocks, ends, value)
    settle_visits(blocks, block_costs, ends, multipliers, by_start)
    return by_start


@vector_inner_kernel
def _evaluate_block(
    blocks: Blocks,
    block_costs: BlockCosts,
    paid: Paid,
    value: NDArray[np.float64],
    k: int,
    room: Room,
    counts: Follows | None,
) -> None:
    """Fill in the values of block k but for those where all is printed, which are known.

    Args:
        counts: what may come next, where states are counts.
    """
    arc, detour, passing, price = paid.arc, block_costs.detour, paid.passing, paid.price
    tops = blocks.follows.top_start
    onward, rest, back = room.onward, room.rest, room.back
    side, top, back_left, back_right = 0, 0, np.inf, np.inf
    low = 2 * blocks.path_start[k]
    stride = 2 * blocks.path_start[k + 1] - low
    allowed, barred = blocks.allowed, False
    for u in range(stride):
        barred |= not allowed[low + u]
    for s in range(blocks.state_start[k + 1] - 2, blocks.state_start[k] - 1, -1):
        steps = blocks.move_start[s]
        count = blocks.move_start[s + 1] - steps
        from_left = from_right = np.inf
        over_first, over_last = blocks.end_set[s]
        out_left, out_right = passing[LEAVE_LEFT, over_first], passing[LEAVE_RIGHT, over_last]
        in_left, in_right = passing[ENTER_LEFT, over_first], passing[ENTER_RIGHT, over_last]
        for j in range(count):
            v, x = 2 * blocks.move_path[steps + j], blocks.move_value[steps + j]
            onward[j] = v
            visit = paid.visit[(low + v) >> 1]
            left = right = np.inf
            for f in range(2):
                at, behind = low + v + f, value[x + f] + visit
                rest[OWN, j, f] = behind
                rest[ACROSS, j, f] = behind - price[ENTERED, at]
                left = min(left, way_cost(paid, ENTER_LEFT, at, in_left) + behind)
                right = min(right, way_cost(paid, ENTER_RIGHT, at, in_right) + behind)
            if counts is not None:
                back[0, j], back[1, j] = left, right
            from_left, from_right = min(from_left, left), min(from_right, right)
        at, cross = blocks.value_start[s], block_costs.cross[k]
        value[at] = min(from_left, from_right + cross)
        value[at + 1] = min(from_right, from_left + cross)
        if counts is not None:
            find_steps(blocks, k, s, room.place)
        # Ends and steps are in the order of columns: steps first .. last - 1 are in the column of u.
        column, end, first, last = blocks.bounds[k], 0, 0, 0
        for x in range(at + OUTSIDE, blocks.value_start[s + 1], 2):
            u = blocks.value_path[x]
            while u >= end:
                end += 2 * blocks.column_size[column]
                column += 1
                first = last
                while last < count and onward[last] < end:
                    last += 1
                if counts is not None:
                    back_left, back_right = _least_back(back, first, last, count)
                    side = 0 if column == blocks.bounds[k] + 1 else 1
                    top = tops[blocks.end_set[s, side]] - x // 2
            row, extra = block_costs.arc_start[k] + u * stride, detour_row(blocks, block_costs, s, x)
            from_left, from_right = value[at], value[at + 1]
            a = b = c = d = np.inf
            if counts is not None:
                # None of these has a detour.
                a, b, from_left, from_right = _cheapest_that_follow(
                    arc, counts, (row, stride), room, side, top + x // 2
                )
                # Whatever lies in between, it is the block's next toolpath all the same.
                from_left, from_right = min(from_left, back_left), min(from_right, back_right)
                from_left, from_right = min(from_left, from_right + cross), min(from_right, from_left + cross)
                # Of two columns, the other one's steps are all those before its own, or all behind them.
                begin, behind_all = (last, count) if first == 0 else (0, first)
                for j in range(begin, behind_all):
                    t = row + onward[j]
                    x_a, y_a = rest[ACROSS, j, 0], rest[ACROSS, j, 1]
                    c = min(c, min(arc[t] + x_a, arc[t + 1] + y_a))
                    d = min(d, min(arc[t + stride] + x_a, arc[t + stride + 1] + y_a))
            if counts is None:
                for j in range(count):
                    how = OWN if first <= j < last else ACROSS
                    t = row + onward[j]
                    x_a, y_a = arc[t] + rest[how, j, 0], arc[t + 1] + rest[how, j, 1]
                    t += stride
                    x_b, y_b = arc[t] + rest[how, j, 0], arc[t + 1] + rest[how, j, 1]
                    if extra >= 0:
                        q = extra + 2 * j
                        x_a, y_a = x_a + detour[q], y_a + detour[q + 1]
                        q += 2 * count
                        x_b, y_b = x_b + detour[q], y_b + detour[q + 1]
                    if how == OWN:
                        a, b = min(a, x_a, y_a), min(b, x_b, y_b)
                    else:
                        c, d = min(c, x_a, y_a), min(d, x_b, y_b)
            a, b = min(a, c - price[LEFT_OFF, low + u]), min(b, d - price[LEFT_OFF, low + u + 1])
            for f in range(2):
                gone_left = from_left + way_cost(paid, LEAVE_LEFT, low + u + f, out_left)
                gone_right = from_right + way_cost(paid, LEAVE_RIGHT, low + u + f, out_right)
                value[x + f] = min(gone_left, gone_right, b if f else a)
                if barred and not allowed[low + u + f]:
                    value[x + f] = np.inf


@inner_kernel
def _least_back(back: NDArray[np.float64], first: int, last: int, count: int) -> tuple[float, float]:
    """The least of all steps but first .. last - 1."""
    left = right = np.inf
    for j in range(count):
        if not first <= j < last:
            left, right = min(left, back[0, j]), min(right, back[1, j])
    return left, right


@vector_inner_kernel
def _cheapest_that_follow(
    arc: NDArray[np.float64], follows: Follows, travels: tuple[int, int], room: Room, side: int, top: int
) -> tuple[float, float, float, float]:
    """The least cost from a toolpath on, left in either direction, by steps of its own column that may come
    next after it; and by way of outside, from the left and from the right.

    Args:
        travels: where the costs of those from it begin, and how far on those for its other direction begin.
        side: whether that is the block's last column, not the first.
        top: the toolpath, as a maximal element.
    """
    onward, rest, back, place = room
    a = b = left = right = np.inf
    for q in range(follows.start[top], follows.start[top + 1]):
        j = place[side, follows.steps[q]]
        if j >= 0:
            t = travels[0] + onward[j]
            x, y = rest[OWN, j, 0], rest[OWN, j, 1]
            a = min(a, min(arc[t] + x, arc[t + 1] + y))
            t += travels[1]
            b = min(b, min(arc[t] + x, arc[t + 1] + y))
            left, right = min(left, back[0, j]), min(right, back[1, j])
    return a, b, left, right


@inner_kernel
def _finish(
    blocks: Blocks,
    block_costs: BlockCosts,
    ends: Ends,
    paid: Paid,
    value: NDArray[np.float64],
    k: int,
) -> None:
    """The values where all of block k is printed: what leaving it for the end of the sequence costs.

    Where the end is free, the sequence may end here or go on outside; a price for that may be negative.
    """
    final = blocks.state_start[k + 1] - 1
    at, low = blocks.value_start[final], 2 * blocks.path_start[k]
    value[at] = value[at + 1] = 0.0
    stays, left, right = 0.0, True, True
    if ends.last_home[0] != NONE:
        left, right = ends.last_home[1] < k, ends.last_home[0] > k
        stays = np.inf
        value[at] = 0.0 if left else block_costs.cross[k] if right else np.inf
        value[at + 1] = 0.0 if right else block_costs.cross[k] if left else np.inf
    for x in range(at + OUTSIDE, blocks.value_start[final + 1]):
        u = blocks.value_path[x]
        if not blocks.allowed[low + u]:
            value[x] = np.inf
            continue
        value[x] = stays
        if not left and not right:
            own = ends.last_local[0] if ends.last_home[0] == k else ends.last_local[1]
            value[x] = 0.0 if u == own else np.inf
        # It may go out either way and pass over to where the sequence ends.
        for way in range(LEAVE_RIGHT + 1):
            passing = paid.passing[way, blocks.end_set[final, way]]
            cost = way_cost(paid, way, low + u, passing)
            value[x] = min(value[x], value[at + way] + cost)


@allocating_inner_kernel
def _roots(blocks: Blocks, ends: Ends, value: NDArray[np.float64]) -> NDArray[np.float64]:
    """What all blocks together pay for the cheapest walks from each of the possible starts."""
    count = len(blocks.state_start) - 1
    left = np.zeros(count + 1)  # blocks before k, which the start is right of
    right = np.zeros(count + 1)  # blocks from k on, which the start is left of
    for k in range(count):
        left[k + 1] = left[k] + value[blocks.value_start[blocks.state_start[k]] + 1]
    for k in range(count - 1, -1, -1):
        right[k] = right[k + 1] + value[blocks.value_start[blocks.state_start[k]]]
    out = np.empty(len(ends.start_value))
    for t in range(len(out)):
        low, high = ends.start_home[t]
        out[t] = left[low] + right[high + 1] + value[ends.start_value[t, 0]]
        if high > low:
            out[t] += value[ends.start_value[t, 1]]
    return out
