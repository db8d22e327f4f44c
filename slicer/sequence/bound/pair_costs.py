"""What each block of columns pays of a travel, so that all blocks together never pay more than it costs.

A column that two blocks share is their *seam*. Every travel is split among the blocks that see it:

- Inside a seam column both blocks pay half, one of them more and the other less by a multiplier. Inside any
  other column, one block pays in full.
- Between two columns of one block, that block pays in full, less the price of leaving a seam column and
  less the price of entering one; the neighbour that shares the column pays these prices.
- Where no block has both ends, each pays what the travel covers along x up to its own seam, at least, and
  half of what a travel over that seam costs beyond its length along x (a time has such a part).

So every oriented toolpath of a seam column has four prices (leave left, leave right, enter from the left,
enter from the right) and every pair of them a multiplier. Whatever those are, the cheapest walks through
the blocks together are a lower bound: a Lagrangian decomposition with copies of the seam columns (Guignard
and Kim, "Lagrangean decomposition", Mathematical Programming 39, 1987).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel, kernel
from slicer.sequence.bound.jumps import Jumps, beyond_length, jumps_over_seams
from slicer.sequence.bound.paid import ENTER_LEFT, ENTER_RIGHT, LEAVE_LEFT, LEAVE_RIGHT
from slicer.sequence.problem import CostModel, least_cost_per_mm, least_travel_cost
from slicer.sequence.states import OUTSIDE, Blocks, Section

START_SHARE = 0.46
"""Prices begin with this share of the distance to the nearest toolpath on the other side.

Subgradients forget slowly where they began: with 1/3, default searches of 10x10 end at 112.0 under a bound of
110.2 mm; with anything from 0.42 to 0.5 they find the optimum, 111.78, under about 111.5.
"""

FAR = 5.0
"""A toolpath that is more than so many hops away, from one to the nearest of its column, begins as one that
is so far: between islands a travel is long, and hardly ever made."""


class BlockCosts(NamedTuple):
    """The parts of the costs that do not change with the multipliers.

    "Local" numbers are oriented toolpaths as a block numbers its own, counted on through the blocks.

    Attributes:
        arc_start: int64 (b + 1,); block k's costs are a square matrix [from, to] from arc_start[k] on.
        direct: float64, those matrices: the cost of each travel inside a block.
        ways: float64 (4, p), for each way of leaving or entering and each local number, what is paid
            along x; infinite where there is nothing on that side.
        price_at: int32 (4, p), the multiplier that is added there, or -1.
        price_sign: float64 (4, p), its factor: 1 or -1.
        cross: float64 (b,), for passing over a block without touching it.
        pair_start: int64 (c + 1,); the multipliers of travels inside column c are a square matrix
            [from, to] from pair_start[c] on, empty where the column is no seam.
        detour_start: int64 (s + 1,), the ends of the detours of each state, which begin where those of the
            next one end: the last is looked at first. None where its travels are priced as direct.
        detour: float32, what a travel costs beyond ``direct`` because of what is printed, see ``detours``.
        visits: the first multiplier of a visit, one for each of a block's toolpaths, if there are any.
        visits_end: the end of those.
        jumps: travels that jump over seam columns, whose prices follow those of visits.
        size: how many multipliers there are.
    """

    arc_start: NDArray[np.int64]
    direct: NDArray[np.float64]
    ways: NDArray[np.float64]
    price_at: NDArray[np.int32]
    price_sign: NDArray[np.float64]
    cross: NDArray[np.float64]
    pair_start: NDArray[np.int64]
    detour_start: NDArray[np.int64]
    detour: NDArray[np.float32]
    visits: int
    visits_end: int
    jumps: Jumps
    size: int


class Seams(NamedTuple):
    """Where blocks meet, and what a travel over a seam column costs.

    Attributes:
        middle: float64 (b + 1,), the x of the middle of each seam column in mm, infinite at both ends.
        beyond: float64 (b + 1,), what a travel over it costs beyond its length along x.
        rate: the least cost of a millimetre along x.
    """

    middle: NDArray[np.float64]
    beyond: NDArray[np.float64]
    rate: float


def block_costs(
    section: Section, blocks: Blocks, *, visits: bool = False
) -> tuple[BlockCosts, NDArray[np.float64]]:
    """Measure all travels inside blocks, and give the multipliers that the ascent begins with.

    Args:
        section: what is ordered.
        blocks: its blocks.
        visits: whether walks may print a toolpath twice or not at all, so that visits have multipliers.
    """
    bounds = blocks.bounds
    inner = np.zeros(section.columns, np.bool_)
    inner[bounds[1:-1]] = True
    oriented = 2 * blocks.column_size.astype(np.int64)
    pair_start = np.concatenate([[0], np.cumsum(np.where(inner, oriented * oriented, 0))])
    arc_start = np.concatenate([[0], np.cumsum(4 * np.diff(blocks.path_start).astype(np.int64) ** 2)])
    x = section.segments[:, :, 0]
    seam = np.array([0.5 * (x[section.column == c].min() + x[section.column == c].max()) for c in bounds])
    seam[0], seam[-1] = -np.inf, np.inf
    rate = least_cost_per_mm(section.cost_model)
    cross = rate * np.diff(seam)
    # What a travel over a seam column costs beyond that; a concave cost of length never falls behind.
    beyond = np.zeros(len(bounds))
    for t in range(1, len(bounds) - 1):
        beyond[t] = beyond_length(section, bounds[t] - 1, bounds[t] + 1, rate)
    direct, ways, price_at, price_sign, prices = _measure(
        blocks,
        section.segments,
        section.column,
        section.cost_model,
        Seams(seam, beyond, rate),
        arc_start,
        pair_start[-1],
    )
    first_visit = int(pair_start[-1]) + len(prices)
    visits_end = first_visit + len(blocks.path) * visits
    jumps, begin = jumps_over_seams(section, blocks, ways, beyond, rate, visits_end)
    multipliers = np.concatenate(
        [np.zeros(pair_start[-1]), prices, np.zeros(visits_end - first_visit), begin]
    )
    out = BlockCosts(
        arc_start,
        direct,
        ways,
        price_at,
        price_sign,
        cross,
        pair_start,
        *no_detours(blocks),
        first_visit,
        visits_end,
        jumps,
        len(multipliers),
    )
    return out, multipliers


def no_detours(blocks: Blocks) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """``detour_start`` and ``detour`` of direct travels."""
    return np.zeros(len(blocks.dense) + 1, np.int64), np.empty(0, np.float32)


@inner_kernel
def column_of(blocks: Blocks, k: int, u: int) -> tuple[int, int]:
    """The column of a block's oriented toolpath u, and u's number in that column."""
    c = blocks.bounds[k]
    while u >= 2 * blocks.column_size[c]:
        u -= 2 * blocks.column_size[c]
        c += 1
    return c, u


@inner_kernel
def detour_row(blocks: Blocks, block_costs: BlockCosts, s: int, x: int) -> int:
    """Where the detours from value x of state s begin, a pair for each step of the state; -1 for none."""
    if block_costs.detour_start[s + 1] == block_costs.detour_start[s]:
        return -1
    steps = blocks.move_start[s + 1] - blocks.move_start[s]
    return int(block_costs.detour_start[s + 1] + 2 * steps * (x - blocks.value_start[s] - OUTSIDE))


@kernel
def _measure(
    blocks: Blocks,
    segments: NDArray[np.float64],
    column: NDArray[np.int32],
    cost_model: CostModel,
    seams: Seams,
    arc_start: NDArray[np.int64],
    first_price: int,
) -> tuple[
    NDArray[np.float64], NDArray[np.float64], NDArray[np.int32], NDArray[np.float64], NDArray[np.float64]
]:
    """direct, ways, price_at and price_sign of ``BlockCosts``, and the prices to begin with."""
    seam, beyond, rate = seams
    n = len(segments)
    count = len(blocks.state_start) - 1
    direct = np.empty(arc_start[-1])
    ways = np.full((4, 2 * len(blocks.path)), np.inf)
    price_at = np.full((4, 2 * len(blocks.path)), -1, np.int32)
    price_sign = np.zeros((4, 2 * len(blocks.path)))
    price = np.zeros(8 * n)
    hops, measured = 0.0, 0
    for k in range(count):
        low, high = blocks.path_start[k], blocks.path_start[k + 1]
        left, right = blocks.bounds[k], blocks.bounds[k + 1]
        stride = 2 * (high - low)
        for a in range(stride):
            s, f = blocks.path[low + (a >> 1)], a & 1
            nearest = np.full(2, np.inf)  # of the other columns of this block, after a and before a
            hop = np.inf  # to the nearest toolpath of its own column
            for b in range(stride):
                t, g = blocks.path[low + (b >> 1)], b & 1
                out_x, out_y = segments[s, 1 - f, 0], segments[s, 1 - f, 1]
                cost = least_travel_cost(cost_model, segments[t, g, 0] - out_x, segments[t, g, 1] - out_y)
                direct[arc_start[k] + a * stride + b] = cost
                if column[s] == column[t] and s != t:
                    hop = min(hop, cost)
                if column[s] != column[t] and blocks.allowed[2 * low + b]:
                    nearest[0] = min(nearest[0], cost)
                    in_x, in_y = segments[s, f, 0], segments[s, f, 1]
                    cost = least_travel_cost(
                        cost_model, in_x - segments[t, 1 - g, 0], in_y - segments[t, 1 - g, 1]
                    )
                    nearest[1] = min(nearest[1], cost)
            if hop < np.inf:
                hops, measured = hops + hop, measured + 1
            for way in range(4):
                leaves, leftward = way < 2, way % 2 == 0
                if k == (0 if leftward else count - 1):
                    continue
                here, there = (left, right) if leftward else (right, left)
                at_seam = column[s] == there and 0 < k + (0 if there == left else 1) < count
                at = 2 * low + a
                number = first_price + way * 2 * n + 2 * s + f
                if column[s] == here:
                    ways[way, at], price_at[way, at], price_sign[way, at] = 0.0, number, 1.0
                else:
                    x = segments[s, 1 - f if leaves else f, 0]
                    ways[way, at] = rate * (x - seam[k] if leftward else seam[k + 1] - x)
                    ways[way, at] += 0.5 * (beyond[k] if leftward else beyond[k + 1])
                    if at_seam:
                        price_at[way, at], price_sign[way, at] = number, -1.0
            for end in range(2):
                if column[s] == right and k < count - 1:
                    price[2 * n * (LEAVE_LEFT if end == 0 else ENTER_LEFT) + 2 * s + f] = (
                        START_SHARE * nearest[end]
                    )
                elif column[s] == left and k > 0:
                    price[2 * n * (LEAVE_RIGHT if end == 0 else ENTER_RIGHT) + 2 * s + f] = (
                        START_SHARE * nearest[end]
                    )
    most = START_SHARE * FAR * hops / max(1, measured)
    if most > 0.0:
        price = np.minimum(price, most)
    return direct, ways, price_at, price_sign, price
