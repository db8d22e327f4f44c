"""Strike out the states that no sequence below a known cost can pass through.

The least cost of a block's walk through a state, plus the roots of all other blocks, is a lower bound on
every sequence through that state. Tested against the cost of a known sequence this removes most states, so
that the ascent and the search go on with a fraction of them (reduced-cost fixing; for states of a dynamic
programme: Ibaraki, "Successive sublimation methods for dynamic programming computation", Annals of
Operations Research 11, 1987).
"""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import kernel
from slicer.sequence.bound.ends import Ends
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
from slicer.sequence.bound.pair_costs import BlockCosts, column_of, detour_row
from slicer.sequence.states import OUTSIDE, Blocks


@kernel
def bound_through_states(
    blocks: Blocks,
    block_costs: BlockCosts,
    ends: Ends,
    paid: Paid,
    value: NDArray[np.float64],
    by_start: NDArray[np.float64],
) -> NDArray[np.float64]:
    """float64 (s,), for each state a lower bound on all sequences that pass through it.

    Args:
        value: what ``bound_by_start`` has filled in.
        by_start: what it gave.
    """
    arc, price, passing = paid.arc, paid.price, paid.passing
    reached = np.empty(len(value))
    for x in range(len(value)):
        reached[x] = np.inf
    out = np.empty(len(blocks.dense))
    for k in range(len(blocks.state_start) - 1):
        low = 2 * blocks.path_start[k]
        stride = 2 * blocks.path_start[k + 1] - low
        for t in range(len(by_start)):
            at = blocks.value_start[blocks.state_start[k]]  # the start lies left of the block
            if ends.start_home[t, 0] > k:
                at += 1
            elif ends.start_home[t, 1] >= k:
                at = ends.start_value[t, 0 if ends.start_home[t, 0] == k else 1]
            reached[at] = min(reached[at], by_start[t] - value[at])
        for s in range(blocks.state_start[k], blocks.state_start[k + 1]):
            at, end = blocks.value_start[s], blocks.value_start[s + 1]
            out[s] = np.inf
            over_first, over_last = blocks.end_set[s]
            in_left, in_right = passing[ENTER_LEFT, over_first], passing[ENTER_RIGHT, over_last]
            for x in range(at + OUTSIDE, end):
                u = low + blocks.value_path[x]
                way = way_cost(paid, LEAVE_LEFT, u, passing[LEAVE_LEFT, over_first])
                reached[at] = min(reached[at], reached[x] + way)
                way = way_cost(paid, LEAVE_RIGHT, u, passing[LEAVE_RIGHT, over_last])
                reached[at + 1] = min(reached[at + 1], reached[x] + way)
            from_left = min(reached[at], reached[at + 1] + block_costs.cross[k])
            from_right = min(reached[at + 1], reached[at] + block_costs.cross[k])
            for m in range(blocks.move_start[s], blocks.move_start[s + 1]):
                for f in range(2):
                    v, to = low + 2 * blocks.move_path[m] + f, blocks.move_value[m] + f
                    if blocks.allowed[v]:
                        best = from_left + way_cost(paid, ENTER_LEFT, v, in_left)
                        best = min(best, from_right + way_cost(paid, ENTER_RIGHT, v, in_right))
                        reached[to] = min(reached[to], best + paid.visit[v >> 1])
            for x in range(at + OUTSIDE, end):
                u = blocks.value_path[x]
                column, own = column_of(blocks, k, u)
                first, last = u - own, u - own + 2 * blocks.column_size[column]
                row, detour = block_costs.arc_start[k] + u * stride, detour_row(blocks, block_costs, s, x)
                for m in range(blocks.move_start[s], blocks.move_start[s + 1]):
                    v = 2 * blocks.move_path[m]
                    for f in range(2):
                        if not blocks.allowed[low + v + f]:
                            continue
                        to = blocks.move_value[m] + f
                        cost = arc[row + v + f] + paid.visit[(low + v) >> 1]
                        if not first <= v < last:
                            cost -= price[LEFT_OFF, low + u] + price[ENTERED, low + v + f]
                        if detour >= 0:
                            cost += block_costs.detour[detour + 2 * (m - blocks.move_start[s]) + f]
                        reached[to] = min(reached[to], reached[x] + cost)
            for x in range(at, end):
                out[s] = min(out[s], reached[x] + value[x])
    return out
