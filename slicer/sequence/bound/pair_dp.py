"""What the cheapest walk through each block of columns costs, from every state on.

An exact dynamic programme over the states of every block, backwards: the value of a state and a place of the
nozzle is what printing the rest of the block costs at least.
"""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import allocating_inner_kernel, inner_kernel
from slicer.sequence.bound.ends import Ends
from slicer.sequence.bound.lagrangian_costs import apply_multipliers
from slicer.sequence.bound.paid import ENTER_LEFT, ENTER_RIGHT, LEAVE_LEFT, LEAVE_RIGHT, Paid, way_cost
from slicer.sequence.bound.pair_costs import BlockCosts, detour_row
from slicer.sequence.bound.visits import charge_visits, settle_visits
from slicer.sequence.states import NONE, OUTSIDE, Blocks


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
    charge_visits(blocks, block_costs, multipliers, paid)
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
    arc, passing = paid.arc, paid.passing
    rest = np.empty((most_steps(blocks), 2))
    onward = np.empty(len(rest), np.int64)
    allowed, barred = blocks.allowed, False
    for u in range(len(allowed)):
        barred |= not allowed[u]
    for k in range(len(blocks.state_start) - 1):
        low = 2 * blocks.path_start[k]
        stride = 2 * blocks.path_start[k + 1] - low
        final = blocks.state_start[k + 1] - 1
        _finish(blocks, block_costs, ends, paid, value, k)
        for s in range(final - 1, blocks.state_start[k] - 1, -1):
            first = blocks.move_start[s]
            count = blocks.move_start[s + 1] - first
            from_left = from_right = np.inf
            over_first, over_last = blocks.end_set[s]
            out_left, out_right = passing[LEAVE_LEFT, over_first], passing[LEAVE_RIGHT, over_last]
            in_left, in_right = passing[ENTER_LEFT, over_first], passing[ENTER_RIGHT, over_last]
            for j in range(count):
                v, x = 2 * blocks.move_path[first + j], blocks.move_value[first + j]
                a, b = value[x], value[x + 1]
                onward[j], rest[j, 0], rest[j, 1] = v, a, b
                for f in range(2):
                    at, behind = low + v + f, rest[j, f]
                    from_left = min(from_left, way_cost(paid, ENTER_LEFT, at, in_left) + behind)
                    from_right = min(from_right, way_cost(paid, ENTER_RIGHT, at, in_right) + behind)
            at = blocks.value_start[s]
            value[at] = min(from_left, from_right + block_costs.cross[k])
            value[at + 1] = min(from_right, from_left + block_costs.cross[k])
            for x in range(at + OUTSIDE, blocks.value_start[s + 1], 2):
                u = blocks.value_path[x]
                for f in range(2):
                    way = way_cost(paid, LEAVE_LEFT, low + u + f, out_left)
                    leave = value[at] + way
                    way = way_cost(paid, LEAVE_RIGHT, low + u + f, out_right)
                    value[x + f] = min(leave, value[at + 1] + way)
                a, b = value[x], value[x + 1]
                row = block_costs.arc_start[k] + u * stride
                extra = detour_row(blocks, block_costs, s, x)
                if extra < 0:
                    for j in range(count):
                        t = row + onward[j]
                        a = min(a, arc[t] + rest[j, 0], arc[t + 1] + rest[j, 1])
                        t += stride
                        b = min(b, arc[t] + rest[j, 0], arc[t + 1] + rest[j, 1])
                else:
                    for j in range(count):
                        t, q = row + onward[j], extra + 2 * j
                        a = min(
                            a,
                            arc[t] + block_costs.detour[q] + rest[j, 0],
                            arc[t + 1] + block_costs.detour[q + 1] + rest[j, 1],
                        )
                        t, q = t + stride, q + 2 * count
                        b = min(
                            b,
                            arc[t] + block_costs.detour[q] + rest[j, 0],
                            arc[t + 1] + block_costs.detour[q + 1] + rest[j, 1],
                        )
                value[x], value[x + 1] = a, b
                if barred:
                    value[x] = a if allowed[low + u] else np.inf
                    value[x + 1] = b if allowed[low + u + 1] else np.inf


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
