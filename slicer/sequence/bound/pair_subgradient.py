"""Which travels and prices the cheapest walks use: how the bound grows with each multiplier."""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel
from slicer.sequence.bound.ends import Ends
from slicer.sequence.bound.jumps import passing_price
from slicer.sequence.bound.lagrangian_costs import note_moved
from slicer.sequence.bound.paid import (
    ENTER_LEFT,
    ENTER_RIGHT,
    ENTERED,
    LEAVE_LEFT,
    LEAVE_RIGHT,
    LEFT_OFF,
    Moved,
    Paid,
    between,
    way_cost,
)
from slicer.sequence.bound.pair_costs import BlockCosts, column_of, detour_row
from slicer.sequence.bound.visits import settle_in_subgradient
from slicer.sequence.bound.what_follows import find_top, is_counted, may_follow
from slicer.sequence.states import NONE, OUTSIDE, Blocks


@inner_kernel
def add_subgradient(
    blocks: Blocks,
    block_costs: BlockCosts,
    ends: Ends,
    paid: Paid,
    value: NDArray[np.float64],
    start: int,
    subgradient: NDArray[np.float64],
) -> None:
    """Walk the cheapest walk of every block from a start; add to ``subgradient`` how the bound grows with the
    multipliers."""
    settle_in_subgradient(blocks, block_costs, ends, start, subgradient)
    for k in range(len(blocks.state_start) - 1):
        low = 2 * blocks.path_start[k]
        final = blocks.state_start[k + 1] - 1
        s, x = blocks.state_start[k], blocks.value_start[blocks.state_start[k]]
        if ends.start_home[start, 0] > k:
            x += 1
        elif ends.start_home[start, 1] >= k:
            x = ends.start_value[start, 0 if ends.start_home[start, 0] == k else 1]
            for m in range(blocks.move_start[s], blocks.move_start[s + 1]):
                if blocks.move_value[m] <= x <= blocks.move_value[m] + 1:
                    s = blocks.move_to[m]
                    break
        while s < final:
            u, at = blocks.value_path[x], blocks.value_start[s]
            # Going outside and coming back is two steps of the walk, at the same state.
            for side in range(OUTSIDE + 1):
                cost, place = 0.0, x
                if side < OUTSIDE:
                    if u == NONE:
                        continue
                    way = LEAVE_LEFT + side
                    cost = way_cost(paid, way, low + u, paid.passing[way, blocks.end_set[s, side]])
                    place = at + side
                    if value[place] + cost > value[x]:
                        continue
                m, f, way, rest = _next(blocks, block_costs, paid, value, k, s, place, x)
                if side < OUTSIDE and value[x] == rest + cost:
                    _pay_way(blocks, block_costs, paid, s, LEAVE_LEFT + side, low + u, subgradient)
                    u = NONE
                    break
            v = 2 * blocks.move_path[m] + f
            if u == NONE:
                _pay_way(blocks, block_costs, paid, s, way, low + v, subgradient)
            else:
                _pay_arc(blocks, block_costs, paid.moved, k, u, v, subgradient)
            if is_counted(block_costs):
                subgradient[block_costs.visits + ((low + v) >> 1)] += 1.0
            s, x = blocks.move_to[m], blocks.move_value[m] + f
        u = blocks.value_path[x]
        if u != NONE:
            at = blocks.value_start[final]
            for side in range(2):
                way = LEAVE_LEFT + side
                cost = way_cost(paid, way, low + u, paid.passing[way, blocks.end_set[final, side]])
                if value[x] == value[at + side] + cost:
                    _pay_way(blocks, block_costs, paid, final, way, low + u, subgradient)
                    break


@inner_kernel
def _next(
    blocks: Blocks,
    block_costs: BlockCosts,
    paid: Paid,
    value: NDArray[np.float64],
    k: int,
    s: int,
    x: int,
    after: int,
) -> tuple[int, int, int, float]:
    """The cheapest step from value x of state s: its number, direction, the way in if from outside, and what
    is left to pay with it.

    Args:
        after: the value at whose toolpath the block was left, or x.
    """
    low = 2 * blocks.path_start[k]
    stride = 2 * blocks.path_start[k + 1] - low
    u, side = blocks.value_path[x], x - blocks.value_start[s]
    best, move, flip, entry = np.inf, blocks.move_start[s], 0, ENTER_LEFT
    top, down_set = 0, 0
    detours, first, last = -1, 0, 0
    counted = is_counted(block_costs) and blocks.value_path[after] != NONE
    if u != NONE or counted:
        column, own = column_of(blocks, k, blocks.value_path[after])
        first = blocks.value_path[after] - own
        last = first + 2 * blocks.column_size[column]
        top, down_set = find_top(blocks, s, after, 0 if first == 0 else 1)
    if u != NONE:
        detours = detour_row(blocks, block_costs, s, x)
    for m in range(blocks.move_start[s], blocks.move_start[s + 1]):
        v = 2 * blocks.move_path[m]
        if counted and first <= v < last and not may_follow(blocks, top, down_set, (v - first) // 2):
            continue
        for f in range(2):
            v = 2 * blocks.move_path[m] + f
            w = value[blocks.move_value[m] + f] + paid.visit[(low + v) >> 1]
            if u != NONE:
                cost = paid.arc[block_costs.arc_start[k] + u * stride + v]
                if not first <= v < last:
                    cost -= paid.price[LEFT_OFF, low + u] + paid.price[ENTERED, low + v]
                if detours >= 0:
                    cost += block_costs.detour[detours + 2 * (m - blocks.move_start[s]) + f]
                cost += w
                if cost < best:
                    best, move, flip = cost, m, f
                continue
            for way in (ENTER_LEFT, ENTER_RIGHT):
                passing = paid.passing[way, blocks.end_set[s, way - ENTER_LEFT]]
                cost = way_cost(paid, way, low + v, passing) + w
                if way - ENTER_LEFT != side:
                    cost += block_costs.cross[k]
                if cost < best:
                    best, move, flip, entry = cost, m, f, way
    return move, flip, entry, best


@inner_kernel
def _pay_way(
    blocks: Blocks,
    block_costs: BlockCosts,
    paid: Paid,
    s: int,
    way: int,
    at: int,
    subgradient: NDArray[np.float64],
) -> None:
    """Note that state s is left, or entered, by a way."""
    if block_costs.price_at[way, at] >= 0:
        subgradient[block_costs.price_at[way, at]] += block_costs.price_sign[way, at]
    if paid.source[way, at] < 0:
        return
    down_set = blocks.end_set[s, way & 1]
    if between(paid, way, at, down_set):
        sign = 1.0 if way < ENTER_LEFT else -1.0
        subgradient[paid.source[way, at]] += sign
        subgradient[passing_price(blocks, block_costs.jumps, way, down_set)] += sign


@inner_kernel
def _pay_arc(
    blocks: Blocks,
    block_costs: BlockCosts,
    moved: Moved,
    k: int,
    u: int,
    v: int,
    subgradient: NDArray[np.float64],
) -> None:
    """Note a travel inside block k from u to v, both in its own numbers."""
    low = blocks.path_start[k]
    prices = block_costs.pair_start[-1]
    stride = (block_costs.visits - prices) // 4
    right = blocks.bounds[k + 1]
    u_column, u_local = column_of(blocks, k, u)
    v_column, v_local = column_of(blocks, k, v)
    pairs = block_costs.pair_start[u_column]
    u_seam = block_costs.pair_start[u_column + 1] > pairs
    v_seam = block_costs.pair_start[v_column + 1] > block_costs.pair_start[v_column]
    if u_column == v_column:
        if u_seam:
            at = pairs + u_local * 2 * blocks.column_size[u_column] + v_local
            subgradient[at] += 1.0 if u_column == right else -1.0
            if not moved.is_known[at]:
                note_moved(blocks, block_costs, moved, u_column, u_local, v_local)
        return
    rightward = v_column > u_column
    if u_seam:
        way = LEAVE_RIGHT if rightward else LEAVE_LEFT
        subgradient[prices + way * stride + 2 * blocks.path[low + (u >> 1)] + (u & 1)] -= 1.0
    if v_seam:
        way = ENTER_LEFT if rightward else ENTER_RIGHT
        subgradient[prices + way * stride + 2 * blocks.path[low + (v >> 1)] + (v & 1)] -= 1.0
