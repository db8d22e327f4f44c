"""What the cheapest walk through each block of columns costs, from every state on.

An exact dynamic programme over the states of every block, backwards: the value of a state and a place of the
nozzle is what printing the rest of the block costs at least.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import allocating_inner_kernel, inner_kernel
from slicer.sequence.bound.ends import Ends
from slicer.sequence.bound.lagrangian_costs import apply_multipliers
from slicer.sequence.bound.paid import ENTER_LEFT, ENTER_RIGHT, LEAVE_LEFT, LEAVE_RIGHT, Paid, way_cost
from slicer.sequence.bound.pair_costs import BlockCosts, detour_row
from slicer.sequence.bound.visits import settle_visits
from slicer.sequence.states import NONE, OUTSIDE, Blocks

OWN, FROM_LEFT, FROM_RIGHT = range(3)
"""Where a travel to the next toolpath comes from: its own column, or one on that side of it."""


class Room(NamedTuple):
    """What comes next at a state, its steps one after the other.

    Attributes:
        onward: int64 (m,), the toolpath of each step, oriented in direction 0.
        rest: float64 (3, m, 2), for each way of coming there and each direction, what is left to pay after
            the travel, less what is off at its end.
    """

    onward: NDArray[np.int64]
    rest: NDArray[np.float64]


class Travels(NamedTuple):
    """Where the costs of the travels from a toolpath are: a row of ``Paid.arc`` (the next one, after
    ``stride``, is for the other direction), one of detours, or -1, and how many steps there are."""

    row: int
    stride: int
    extra: int
    steps: int


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
        paid, value: room for what the blocks pay there, and for what ``evaluate`` fills in.
    """
    apply_multipliers(blocks, block_costs, multipliers, paid)
    evaluate(blocks, block_costs, ends, paid, value)
    by_start = _roots(blocks, ends, value)
    settle_visits(blocks, block_costs, ends, multipliers, by_start)
    return by_start


@allocating_inner_kernel
def evaluate(
    blocks: Blocks,
    block_costs: BlockCosts,
    ends: Ends,
    paid: Paid,
    value: NDArray[np.float64],
) -> None:
    """Fill ``value``, numbered as ``Blocks`` does: the least cost from there to the end of the block.

    Infinite after a toolpath that may not be printed so.
    """
    room = Room(np.empty(most_steps(blocks), np.int64), np.empty((3, most_steps(blocks), 2)))
    for k in range(len(blocks.state_start) - 1):
        _finish(blocks, block_costs, ends, paid, value, k)
        _evaluate_block(blocks, block_costs, paid, value, k, room)


@inner_kernel
def _evaluate_block(
    blocks: Blocks,
    block_costs: BlockCosts,
    paid: Paid,
    value: NDArray[np.float64],
    k: int,
    room: Room,
) -> None:
    """Fill in the values of block k but for those where all is printed, which are known."""
    passing, price = paid.passing, paid.price
    onward, rest = room
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
            for f in range(2):
                at, behind = low + v + f, value[x + f] + visit
                rest[OWN, j, f] = behind
                rest[FROM_LEFT, j, f] = behind - price[ENTER_LEFT, at]
                rest[FROM_RIGHT, j, f] = behind - price[ENTER_RIGHT, at]
                from_left = min(from_left, way_cost(paid, ENTER_LEFT, at, in_left) + behind)
                from_right = min(from_right, way_cost(paid, ENTER_RIGHT, at, in_right) + behind)
        at = blocks.value_start[s]
        value[at] = min(from_left, from_right + block_costs.cross[k])
        value[at + 1] = min(from_right, from_left + block_costs.cross[k])
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
            row, extra = block_costs.arc_start[k] + u * stride, detour_row(blocks, block_costs, s, x)
            travels = Travels(row, stride, extra, count)
            a, b = _cheapest(paid, block_costs, travels, room, OWN, first, last)
            if first > 0:
                c, d = _cheapest(paid, block_costs, travels, room, FROM_RIGHT, 0, first)
                a, b = min(a, c - price[LEAVE_LEFT, low + u]), min(b, d - price[LEAVE_LEFT, low + u + 1])
            if last < count:
                c, d = _cheapest(paid, block_costs, travels, room, FROM_LEFT, last, count)
                a, b = min(a, c - price[LEAVE_RIGHT, low + u]), min(b, d - price[LEAVE_RIGHT, low + u + 1])
            for f in range(2):
                way = way_cost(paid, LEAVE_LEFT, low + u + f, out_left)
                leave = value[at] + way
                way = way_cost(paid, LEAVE_RIGHT, low + u + f, out_right)
                leave = min(leave, value[at + 1] + way)
                value[x + f] = min(leave, b if f else a)
                if barred and not allowed[low + u + f]:
                    value[x + f] = np.inf


@inner_kernel
def _cheapest(
    paid: Paid, block_costs: BlockCosts, travels: Travels, room: Room, how: int, first: int, last: int
) -> tuple[float, float]:
    """The least cost from a toolpath on, left in either direction, by some of the steps."""
    arc, detour = paid.arc, block_costs.detour
    onward, rest = room
    row, stride, extra, steps = travels
    # One least cost for each pair of directions: a single one would have to wait for itself.
    a = b = c = d = np.inf
    if extra < 0:
        for j in range(first, last):
            t = row + onward[j]
            a, b = min(a, arc[t] + rest[how, j, 0]), min(b, arc[t + 1] + rest[how, j, 1])
            t += stride
            c, d = min(c, arc[t] + rest[how, j, 0]), min(d, arc[t + 1] + rest[how, j, 1])
    else:
        for j in range(first, last):
            t, q = row + onward[j], extra + 2 * j
            a = min(a, arc[t] + detour[q] + rest[how, j, 0])
            b = min(b, arc[t + 1] + detour[q + 1] + rest[how, j, 1])
            t, q = t + stride, q + 2 * steps
            c = min(c, arc[t] + detour[q] + rest[how, j, 0])
            d = min(d, arc[t + 1] + detour[q + 1] + rest[how, j, 1])
    return min(a, b), min(c, d)


@inner_kernel
def most_steps(blocks: Blocks) -> int:
    """The most steps that a state has."""
    most = 0
    for s in range(len(blocks.dense)):
        most = max(most, blocks.move_start[s + 1] - blocks.move_start[s])
    return most


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
