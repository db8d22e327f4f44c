"""What two blocks pay for a travel that jumps over the seam column between them.

Neither of them has both of its ends. The block that it leaves pays a price for the end there, a multiplier,
and the block that it enters pays what is left: the least, over all ends that it may come from, of what the
travel costs less the price there. So the two never pay more than it costs, whatever the prices are. (They
solve the dual of a transport problem, where that is called the c-transform of the prices: Villani, "Topics in
Optimal Transportation", 2003.)

Both blocks have the column that is jumped over, and know its down-set. That has a price as well, which the
block that is left pays and the other one gets back: so they jump at the same time.

Who leaves for farther columns cannot be told apart. Such a travel has a price of its own at either end, which
does not look at the other one, and no block pays more than that for any jump. None pays less than nothing, or
more than the cheapest jump from there: so a jump at a time when none is meant to be is no gift.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import bare_kernel, inner_kernel
from slicer.sequence.bound.paid import ENTER_LEFT, ENTER_RIGHT, LEAVE_LEFT, LEAVE_RIGHT, Paid
from slicer.sequence.problem import CostModel, least_travel_cost
from slicer.sequence.states import Blocks, Section

LEFTWARD, RIGHTWARD = range(2)


class Jumps(NamedTuple):
    """The travels over each seam column between the columns next to it.

    Attributes:
        at: int64 (b + 1, 2), for each seam where the oriented toolpaths of the columns on its left and on its
            right begin, in the numbers of all blocks.
        first: int64 (b + 1, 2), for each seam the first multiplier of the ends that leftward jumps leave, and
            of those that rightward ones do: one for each oriented toolpath of that column.
        cost_start: int64 (b + 2,); a seam's costs are a matrix from cost_start on, [from, to] of rightward
            jumps between oriented toolpaths. A leftward one costs as much as the same the other way round.
        cost: float64, those matrices.
        most: float64 (4, p), what a block pays at most for each way of leaving or entering, where that is a
            jump, beside the price of a travel into the next column; infinite for others.
        passing: the first multiplier of those of down-sets, as ``DownSets`` numbers them: for jumps over the
            column leftwards, then for jumps rightwards.
    """

    at: NDArray[np.int64]
    first: NDArray[np.int64]
    cost_start: NDArray[np.int64]
    cost: NDArray[np.float64]
    most: NDArray[np.float64]
    passing: int


def jumps_over_seams(
    section: Section,
    blocks: Blocks,
    far: NDArray[np.float64],
    beyond: NDArray[np.float64],
    rate: float,
    first: int,
) -> tuple[Jumps, NDArray[np.float64]]:
    """All jumps, and the prices that the ascent begins with.

    Args:
        section: what is ordered.
        blocks: its blocks.
        far: float64 (4, p), what blocks pay for a travel whose other end is not known.
        beyond: float64 (b + 1,), what a travel over a seam costs beyond its length along x.
        rate: the least cost of a millimetre along x.
        first: the number of the first price.
    """
    count, seams = blocks.blocks, blocks.bounds
    at, firsts = np.full((2, count + 1, 2), -1, np.int64)
    cost_start = np.zeros(count + 2, np.int64)
    most = np.full(far.shape, np.inf)
    prices = [np.empty(0)]
    for t in range(1, count):
        seam = int(seams[t])
        pairs = 4 * int(blocks.column_size[seam - 1]) * int(blocks.column_size[seam + 1])
        cost_start[t + 1] = cost_start[t] + pairs
    cost_start[count + 1] = cost_start[count]
    costs = np.empty(cost_start[-1])
    for t in range(1, count):
        seam = int(seams[t])
        left, right = _places(blocks, t - 1, seam - 1), _places(blocks, t, seam + 1)
        cost = costs[cost_start[t] : cost_start[t + 1]].reshape(left.stop - left.start, -1)
        _measure_jumps(
            section.segments,
            section.cost_model,
            blocks.path[left.start // 2 : left.stop // 2],
            blocks.path[right.start // 2 : right.stop // 2],
            cost,
        )
        at[t], firsts[t] = (left.start, right.start), (first + cost.shape[0], first)
        first += sum(cost.shape)
        prices += [far[LEAVE_RIGHT, left], far[LEAVE_LEFT, right]]
        backward = cost.reshape(-1, 2, cost.shape[1])[:, ::-1].reshape(cost.shape)
        backward = backward.reshape(cost.shape[0], -1, 2)[:, :, ::-1].reshape(cost.shape)
        for way, place, least in (
            (LEAVE_RIGHT, left, cost.min(axis=1)),
            (ENTER_LEFT, right, cost.min(axis=0)),
            (LEAVE_LEFT, right, backward.min(axis=0)),
            (ENTER_RIGHT, left, backward.min(axis=1)),
        ):
            most[way, place] = least
        for ways, place, a, b in (
            ((LEAVE_RIGHT, ENTER_RIGHT), left, seam - 1, seam + 2),
            ((LEAVE_LEFT, ENTER_LEFT), right, seam - 2, seam + 1),
        ):
            if a >= 0 and b < section.columns:
                further = 0.5 * max(0.0, beyond_length(section, a, b, rate) - beyond[t])
                for way in ways:
                    most[way, place] = np.minimum(most[way, place], far[way, place] + further)
    prices.append(np.zeros(2 * blocks.down_sets))
    return Jumps(at, firsts, cost_start, costs, most, first), np.concatenate(prices)


def _places(blocks: Blocks, k: int, column: int) -> slice:
    """Where block k has the oriented toolpaths of a column, in the numbers of all blocks."""
    before = blocks.column_start[column] - blocks.column_start[blocks.bounds[k]]
    at = 2 * int(blocks.path_start[k] + before)
    return slice(at, at + 2 * int(blocks.column_size[column]))


def beyond_length(section: Section, a: int, b: int, rate: float) -> float:
    """What any travel from column a to column b, on its right, costs beyond its length along x.

    No cost of a length falls behind ``rate``, so the nearest ends of the two have the least.
    """
    x = section.segments[:, :, 0]
    gap = x[section.column == b].min() - x[section.column == a].max()
    return float(least_travel_cost(section.cost_model, gap, 0.0) - rate * gap)


@bare_kernel
def _measure_jumps(
    segments: NDArray[np.float64],
    cost_model: CostModel,
    left: NDArray[np.int32],
    right: NDArray[np.int32],
    cost: NDArray[np.float64],
) -> None:
    for a in range(cost.shape[0]):
        s, f = left[a >> 1], a & 1
        for b in range(cost.shape[1]):
            t, g = right[b >> 1], b & 1
            dx, dy = segments[t, g, 0] - segments[s, 1 - f, 0], segments[t, g, 1] - segments[s, 1 - f, 1]
            # A hop may be joined one way only.
            cost[a, b] = min(least_travel_cost(cost_model, dx, dy), least_travel_cost(cost_model, -dx, -dy))


@inner_kernel
def price_jumps(
    blocks: Blocks,
    jumps: Jumps,
    far: NDArray[np.float64],
    multipliers: NDArray[np.float64],
    paid: Paid,
) -> None:
    """Let jumps cost what their prices say.

    Args:
        blocks: where jumps leave and enter.
        jumps: they.
        far: as ``jumps_over_seams`` was given it.
        multipliers: prices among them.
        paid: its ``ways``, ``least`` and ``most``, ``far`` included, are changed in place for jumps, and
            ``passing`` and ``source`` filled in.
    """
    paid.source[:] = -1
    for s in range(blocks.down_sets):
        for direction in range(2):
            price = multipliers[passing_price(blocks, jumps, LEAVE_LEFT + direction, s)]
            paid.passing[LEAVE_LEFT + direction, s] = price
            paid.passing[ENTER_RIGHT - direction, s] = -price
    for t in range(1, len(blocks.state_start) - 1):
        for direction in range(2):
            _price(blocks, jumps, t, direction, far, multipliers, paid)


@inner_kernel
def _price(
    blocks: Blocks,
    jumps: Jumps,
    t: int,
    direction: int,
    far: NDArray[np.float64],
    multipliers: NDArray[np.float64],
    paid: Paid,
) -> None:
    """Price the jumps over seam t in one direction."""
    left, right = blocks.bounds[t] - 1, blocks.bounds[t] + 1
    columns = 2 * blocks.column_size[right]
    leave, enter, start, end = LEAVE_RIGHT, ENTER_LEFT, left, right
    begin, arrive = jumps.at[t, 0], jumps.at[t, 1]
    if direction == LEFTWARD:
        leave, enter, start, end = LEAVE_LEFT, ENTER_RIGHT, right, left
        begin, arrive = arrive, begin
    leaving, entering = 2 * blocks.column_size[start], 2 * blocks.column_size[end]
    low, first = jumps.cost_start[t], jumps.first[t, direction]
    for a in range(leaving):
        u = begin + a
        paid.source[leave, u] = first + a
        paid.least[leave, u] = paid.ways[leave, u] - far[leave, u]
        paid.most[leave, u] = paid.least[leave, u] + jumps.most[leave, u]
        paid.ways[leave, u] = paid.least[leave, u] + multipliers[first + a]
    for b in range(entering):
        v = arrive + b
        least = np.inf
        for a in range(leaving):
            u = begin + a
            if blocks.allowed[u]:
                place = a * columns + b if direction == RIGHTWARD else (b ^ 1) * columns + (a ^ 1)
                rest = jumps.cost[low + place] - multipliers[first + a]
                if rest < least:
                    least = rest
                    paid.source[enter, v] = first + a
        paid.least[enter, v] = paid.ways[enter, v] - far[enter, v]
        paid.most[enter, v] = paid.least[enter, v] + jumps.most[enter, v]
        paid.ways[enter, v] = paid.least[enter, v] + least


@inner_kernel
def passing_price(blocks: Blocks, jumps: Jumps, way: int, down_set: int) -> int:
    """The multiplier of jumps that leave or enter this way, over a column at a down-set."""
    direction = way if way < ENTER_LEFT else ENTER_RIGHT - way
    return int(jumps.passing + direction * blocks.down_sets + down_set)
