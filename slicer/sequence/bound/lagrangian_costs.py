"""What each block of columns pays for its travels at some multipliers, see ``pair_costs``."""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel
from slicer.sequence.bound.jumps import price_jumps
from slicer.sequence.bound.paid import (
    ENTER_LEFT,
    ENTER_RIGHT,
    ENTERED,
    LEAVE_LEFT,
    LEAVE_RIGHT,
    LEFT_OFF,
    Moved,
    Paid,
)
from slicer.sequence.bound.pair_costs import BlockCosts
from slicer.sequence.states import Blocks


def room_to_pay(blocks: Blocks, block_costs: BlockCosts) -> Paid:
    """Room for what blocks pay, with what they pay for travels inside columns until some multiplier moves."""
    arc = block_costs.direct.copy()
    seams = np.diff(block_costs.pair_start) > 0
    for k in range(blocks.blocks):
        stride = 2 * int(blocks.path_start[k + 1] - blocks.path_start[k])
        travels = arc[block_costs.arc_start[k] : block_costs.arc_start[k + 1]].reshape(stride, stride)
        for c in (int(blocks.bounds[k]), int(blocks.bounds[k + 1])):
            if seams[c]:
                low = 2 * int(blocks.column_start[c] - blocks.column_start[blocks.bounds[k]])
                own = slice(low, low + 2 * int(blocks.column_size[c]))
                travels[own, own] *= 0.5
    pairs = int(block_costs.pair_start[-1])
    moved = Moved(
        np.zeros(1, np.int64),
        np.empty(pairs, np.int64),
        np.empty((pairs, 2), np.int64),
        np.zeros(pairs, np.bool_),
    )
    return Paid(
        arc,
        np.zeros((2, 2 * len(blocks.path))),
        np.zeros(len(blocks.path)),
        moved,
        np.empty_like(block_costs.ways),
        np.empty_like(block_costs.ways),
        np.empty_like(block_costs.ways),
        np.empty((4, blocks.down_sets)),
        np.empty_like(block_costs.price_at),
    )


@inner_kernel
def apply_multipliers(
    blocks: Blocks,
    block_costs: BlockCosts,
    multipliers: NDArray[np.float64],
    paid: Paid,
) -> None:
    """What each block pays at these multipliers, into ``paid``."""
    arc, ways, moved = paid.arc, paid.ways, paid.moved
    for way in range(4):
        for at in range(ways.shape[1]):
            ways[way, at] = block_costs.ways[way, at]
            if block_costs.price_at[way, at] >= 0:
                ways[way, at] += block_costs.price_sign[way, at] * multipliers[block_costs.price_at[way, at]]
            paid.least[way, at] = paid.most[way, at] = ways[way, at]
    price_jumps(blocks, block_costs.jumps, block_costs.ways, multipliers, paid)
    for t in range(moved.known[0]):
        share = multipliers[moved.multiplier[t]]
        last, first = moved.travel[t]
        arc[last] = 0.5 * block_costs.direct[last] + share
        arc[first] = 0.5 * block_costs.direct[first] - share
    prices = multipliers[block_costs.pair_start[-1] : block_costs.visits].reshape(4, -1)
    for k in range(len(blocks.state_start) - 1):
        left, right = blocks.bounds[k], blocks.bounds[k + 1]
        # Of a block's columns only the outer ones are seams, and have the others on one side.
        for c, leave, enter in ((left, LEAVE_RIGHT, ENTER_RIGHT), (right, LEAVE_LEFT, ENTER_LEFT)):
            if block_costs.pair_start[c + 1] == block_costs.pair_start[c] or left == right:
                continue
            at = 2 * (blocks.path_start[k] + blocks.column_start[c] - blocks.column_start[left])
            for u in range(at, at + 2 * blocks.column_size[c]):
                own = 2 * blocks.path[u >> 1] + (u & 1)
                paid.price[LEFT_OFF, u] = prices[leave, own]
                paid.price[ENTERED, u] = prices[enter, own]
    if block_costs.visits < block_costs.visits_end:
        for at in range(len(paid.visit)):
            paid.visit[at] = multipliers[block_costs.visits + at]


@inner_kernel
def note_all_moved(
    blocks: Blocks, block_costs: BlockCosts, multipliers: NDArray[np.float64], moved: Moved
) -> None:
    """Enter all travels whose multipliers are not 0."""
    at = 0
    for c in range(len(blocks.column_size)):
        if block_costs.pair_start[c + 1] == at:
            continue
        for u in range(2 * blocks.column_size[c]):
            for v in range(2 * blocks.column_size[c]):
                if multipliers[at] != 0.0 and not moved.is_known[at]:
                    note_moved(blocks, block_costs, moved, c, u, v)
                at += 1


@inner_kernel
def note_moved(blocks: Blocks, block_costs: BlockCosts, moved: Moved, column: int, u: int, v: int) -> None:
    """Enter a travel that was not known, between two of a seam column's own oriented toolpaths."""
    at = block_costs.pair_start[column] + u * 2 * blocks.column_size[column] + v
    moved.is_known[at] = True
    count = moved.known[0]
    moved.known[0] = count + 1
    moved.multiplier[count] = at
    for side in range(2):
        k = blocks.home[column, side]
        first = 2 * (blocks.column_start[column] - blocks.column_start[blocks.bounds[k]])
        stride = 2 * (blocks.path_start[k + 1] - blocks.path_start[k])
        moved.travel[count, side] = block_costs.arc_start[k] + (first + u) * stride + first + v
