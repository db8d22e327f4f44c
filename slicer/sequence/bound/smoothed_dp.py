"""All walks through each block of columns at once, each weighed by how cheap it is.

Where ``pair_dp`` takes the least over the ways on, here their weights exp(-cost / T) are added up. -T·log of
the sum is a smooth stand-in for the least cost, at a temperature T in the unit of the costs: never above it,
and the nearer the lower T (Nesterov, "Smooth minimization of non-smooth functions", Mathematical Programming
103, 2005). The share of all weight that passes through each travel, see ``smoothed_shares``, tells how it
grows with the multipliers, without the leaps from one cheapest walk to another.

A weight is a multiple of a power of two of its own, or long walks could not be told from none. The ends of a
state mostly share theirs. One that is far from all that may follow, as where a sheet has islands, weighs less
than a number can tell beside the others, and is worked out in logarithms.
"""

from math import frexp, ldexp, log
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel, kernel
from slicer.sequence.bound.ends import Ends
from slicer.sequence.bound.paid import ENTER_LEFT, ENTER_RIGHT, LEAVE_LEFT, LEAVE_RIGHT, Paid, way_cost
from slicer.sequence.bound.pair_costs import BlockCosts, detour_row
from slicer.sequence.bound.pair_dp import most_steps
from slicer.sequence.states import NONE, OUTSIDE, Blocks

LOG_2 = log(2.0)
NOTHING, LEAST_POWER = -(1 << 30), -(1 << 29)
"""The power of two of no weight, and the least of any."""
ROOM = 1e5
"""A state whose greatest weight is not so far from 1 keeps the power of two of those behind it."""
FAINT, FAINT_END = 2.0**-900, 2.0**-720
"""Smaller weights of the outside and of an end, beside what may follow, are worked out in logarithms: numbers
end at 2^-1022. What an end misses of a faint outside is nothing beside the least that is told by numbers."""


class Weights(NamedTuple):
    """What travels weigh at some multipliers and temperature, and what states come to.

    Attributes:
        temperature: in the unit of the costs.
        in_logarithms: whether all weights are worked out so, as some travels cost too little to be weighed.
        arc, ways, least, most, passing: exp(-cost / T) of what ``Paid`` has by these names.
        detour: float32, the eighth root of the same of ``BlockCosts.detour``: single precision ends at
            exp(-87).
        cross: float64 (b,), exp(-cost / T).
        value: float64, the weight of all walks from each value of ``Blocks`` to the end of its block, as a
            multiple of 2 to the power of its
        exponent: int32.
    """

    temperature: float
    in_logarithms: bool
    arc: NDArray[np.float64]
    ways: NDArray[np.float64]
    least: NDArray[np.float64]
    most: NDArray[np.float64]
    passing: NDArray[np.float64]
    detour: NDArray[np.float32]
    cross: NDArray[np.float64]
    value: NDArray[np.float64]
    exponent: NDArray[np.int32]


@kernel
def weigh(blocks: Blocks, block_costs: BlockCosts, ends: Ends, paid: Paid, weights: Weights) -> None:
    """Fill in ``value`` and ``exponent``, backwards through each block."""
    _, in_logarithms, arc, _, _, _, passing, detour, cross, value, exponent = weights
    priced = block_costs.jumps.priced
    faint, faint_end = (np.inf, np.inf) if in_logarithms else (FAINT, FAINT_END)
    allowed, steps = blocks.allowed, (blocks.move_path, blocks.move_value)
    rest = np.empty((most_steps(blocks), 2))
    onward = np.empty(len(rest), np.int64)
    count = len(blocks.state_start) - 1
    for k in range(count):
        low = 2 * blocks.path_start[k]
        stride = 2 * blocks.path_start[k + 1] - low
        final = blocks.state_start[k + 1] - 1
        _finish(blocks, block_costs, ends, paid, weights, k)
        for s in range(final - 1, blocks.state_start[k] - 1, -1):
            first = blocks.move_start[s]
            size = blocks.move_start[s + 1] - first
            common = entries(steps, first, value, exponent, onward[:size], rest)
            from_left = from_right = 0.0
            over_first, over_last = blocks.end_set[s]
            out_left, out_right = passing[LEAVE_LEFT, over_first], passing[LEAVE_RIGHT, over_last]
            in_left, in_right = passing[ENTER_LEFT, over_first], passing[ENTER_RIGHT, over_last]
            for j in range(size):
                for f in range(2):
                    v, a = low + onward[j] + f, rest[j, f]
                    from_left += a * way_weight(weights, priced, ENTER_LEFT, v, in_left)
                    from_right += a * way_weight(weights, priced, ENTER_RIGHT, v, in_right)
            at, end = blocks.value_start[s], blocks.value_start[s + 1]
            a, b = from_left + cross[k] * from_right, from_right + cross[k] * from_left
            value[at], value[at + 1] = a, b
            exponent[at] = exponent[at + 1] = common
            greatest, left, right = max(a, b), a, b
            if a < faint:
                _put(weights, at, log_outside(blocks, block_costs, paid, weights, (k, s, 0)))
                left = 0.0
            if b < faint:
                _put(weights, at + 1, log_outside(blocks, block_costs, paid, weights, (k, s, 1)))
                right = 0.0
            for x in range(at + OUTSIDE, end, 2):
                u = blocks.value_path[x]
                place = low + u
                for f in range(2):
                    leave = left * way_weight(weights, priced, LEAVE_LEFT, place + f, out_left)
                    leave += right * way_weight(weights, priced, LEAVE_RIGHT, place + f, out_right)
                    value[x + f] = leave
                a, b = value[x], value[x + 1]
                row = block_costs.arc_start[k] + u * stride
                extra = detour_row(blocks, block_costs, s, x)
                if extra < 0:
                    for j in range(size):
                        t = row + onward[j]
                        a += arc[t] * rest[j, 0] + arc[t + 1] * rest[j, 1]
                        t += stride
                        b += arc[t] * rest[j, 0] + arc[t + 1] * rest[j, 1]
                else:
                    for j in range(size):
                        t, q = row + onward[j], extra + 2 * j
                        d, e = np.float64(detour[q]) ** 8, np.float64(detour[q + 1]) ** 8
                        a += d * arc[t] * rest[j, 0] + e * arc[t + 1] * rest[j, 1]
                        t, q = t + stride, q + 2 * size
                        d, e = np.float64(detour[q]) ** 8, np.float64(detour[q + 1]) ** 8
                        b += d * arc[t] * rest[j, 0] + e * arc[t + 1] * rest[j, 1]
                value[x], value[x + 1] = a, b
                exponent[x] = exponent[x + 1] = common
                greatest = max(greatest, a, b)
                if a < faint_end or b < faint_end or not allowed[place] or not allowed[place + 1]:
                    _put_ends(blocks, block_costs, paid, weights, (k, s, x))
            if greatest < 1.0 / ROOM or greatest > ROOM:
                _normalise(value[at:end], exponent[at:end], greatest, common)


@inner_kernel
def way_weight(weights: Weights, priced: NDArray[np.bool_], way: int, at: int, passing: float) -> float:
    """What leaving or entering an oriented toolpath weighs; ``paid.way_cost`` has the same as costs."""
    weight = weights.ways[way, at]
    if priced[way, at]:
        return float(min(weights.least[way, at], max(weight * passing, weights.most[way, at])))
    return float(weight)


@inner_kernel
def entries(
    steps: tuple[NDArray[np.int32], NDArray[np.int32]],
    first: int,
    value: NDArray[np.float64],
    exponent: NDArray[np.int32],
    onward: NDArray[np.int64],
    rest: NDArray[np.float64],
) -> int:
    """Fill in what steps from ``first`` on enter, and what weighs behind each; their common power of two.

    A call with all of ``Blocks`` takes as long as the rest.
    """
    move_path, move_value = steps
    common = NOTHING
    for j in range(len(onward)):
        x = move_value[first + j]
        common = max(common, exponent[x], exponent[x + 1])
    for j in range(len(onward)):
        x = move_value[first + j]
        onward[j] = 2 * move_path[first + j]
        for f in range(2):
            lower = exponent[x + f] - common
            scale = 1.0 if lower == 0 else ldexp(1.0, lower) if lower > -1000 else 0.0
            rest[j, f] = value[x + f] * scale
    return common


@inner_kernel
def _normalise(value: NDArray[np.float64], exponent: NDArray[np.int32], greatest: float, common: int) -> None:
    """Bring the greatest weight of a state near 1; of its own values those that share their power of two."""
    if greatest == 0.0:
        return
    power = frexp(greatest)[1]
    scale = ldexp(1.0, -power)
    for x in range(len(value)):
        if exponent[x] == common:
            value[x] *= scale
            exponent[x] = common + power


@inner_kernel
def _put(weights: Weights, x: int, logarithm: float) -> None:
    """Enter a weight by its logarithm."""
    weights.value[x], weights.exponent[x] = 0.0, NOTHING
    if logarithm > -np.inf:
        power = max(LEAST_POWER, int(np.floor(logarithm / LOG_2)) + 1)
        weights.value[x], weights.exponent[x] = np.exp(logarithm - LOG_2 * power), power


@inner_kernel
def _put_ends(
    blocks: Blocks, block_costs: BlockCosts, paid: Paid, weights: Weights, place: tuple[int, int, int]
) -> None:
    """Enter both directions of an end that is faint, or none of one that may not be printed so."""
    k, s, x = place
    for f in range(2):
        if not blocks.allowed[2 * blocks.path_start[k] + blocks.value_path[x + f]]:
            _put(weights, x + f, -np.inf)
        elif weights.in_logarithms or weights.value[x + f] < FAINT_END:
            _put(weights, x + f, log_end(blocks, block_costs, paid, weights, (k, s, x + f)))


@inner_kernel
def log_of(weights: Weights, x: int) -> float:
    """The logarithm of the weight of a value."""
    if weights.value[x] == 0.0:
        return -np.inf
    return float(np.log(weights.value[x]) + LOG_2 * weights.exponent[x])


@inner_kernel
def _log_sum(a: float, b: float) -> float:
    """The logarithm of a sum by those of its parts."""
    if a < b:
        a, b = b, a
    return a if b == -np.inf else float(a + np.log1p(np.exp(b - a)))


@inner_kernel
def log_outside(
    blocks: Blocks, block_costs: BlockCosts, paid: Paid, weights: Weights, place: tuple[int, int, int]
) -> float:
    """The logarithm of the weight of block k's state s with the nozzle on one side: place is (k, s, side)."""
    k, s, side = place
    if k == (0 if side == 0 else len(blocks.state_start) - 2):
        return -np.inf  # there is nothing on that side
    low, total = 2 * blocks.path_start[k], -np.inf
    for m in range(blocks.move_start[s], blocks.move_start[s + 1]):
        for f in range(2):
            behind = log_of(weights, blocks.move_value[m] + f)
            for way in range(2):
                passing = paid.passing[ENTER_LEFT + way, blocks.end_set[s, way]]
                at = low + 2 * blocks.move_path[m] + f
                cost = way_cost(paid, block_costs.jumps.priced, ENTER_LEFT + way, at, passing)
                if way != side:
                    cost += block_costs.cross[k]
                total = _log_sum(total, behind - cost / weights.temperature)
    return total


@inner_kernel
def log_end(
    blocks: Blocks, block_costs: BlockCosts, paid: Paid, weights: Weights, place: tuple[int, int, int]
) -> float:
    """The logarithm of the weight of value x, an end, of block k's state s: place is (k, s, x)."""
    k, s, x = place
    low = 2 * blocks.path_start[k]
    u, first = blocks.value_path[x], blocks.move_start[s]
    row = block_costs.arc_start[k] + u * (2 * blocks.path_start[k + 1] - low)
    extra, total = detour_row(blocks, block_costs, s, x), -np.inf
    for side in range(2):
        passing = paid.passing[LEAVE_LEFT + side, blocks.end_set[s, side]]
        cost = way_cost(paid, block_costs.jumps.priced, LEAVE_LEFT + side, low + u, passing)
        total = _log_sum(total, log_of(weights, blocks.value_start[s] + side) - cost / weights.temperature)
    for m in range(first, blocks.move_start[s + 1]):
        for f in range(2):
            cost = paid.arc[row + 2 * blocks.move_path[m] + f]
            if extra >= 0:
                cost += block_costs.detour[extra + 2 * (m - first) + f]
            total = _log_sum(total, log_of(weights, blocks.move_value[m] + f) - cost / weights.temperature)
    return total


@inner_kernel
def _finish(
    blocks: Blocks, block_costs: BlockCosts, ends: Ends, paid: Paid, weights: Weights, k: int
) -> None:
    """Fill in the weights where all of block k is printed; ``pair_dp`` has the same as costs."""
    final = blocks.state_start[k + 1] - 1
    at, low = blocks.value_start[final], 2 * blocks.path_start[k]
    left = right = True
    if ends.last_home[0] != NONE:
        left, right = ends.last_home[1] < k, ends.last_home[0] > k
    crossing = -block_costs.cross[k] / weights.temperature
    _put(weights, at, 0.0 if left else crossing if right else -np.inf)
    _put(weights, at + 1, 0.0 if right else crossing if left else -np.inf)
    for x in range(at + OUTSIDE, blocks.value_start[final + 1]):
        u = blocks.value_path[x]
        stays = 0.0 if ends.last_home[0] == NONE else -np.inf
        if not left and not right:
            own = ends.last_local[0] if ends.last_home[0] == k else ends.last_local[1]
            stays = 0.0 if u == own else -np.inf
        if blocks.allowed[low + u]:
            _put(weights, x, _log_sum(stays, log_end(blocks, block_costs, paid, weights, (k, final, x))))
        else:
            _put(weights, x, -np.inf)


@kernel
def smoothed_roots(blocks: Blocks, ends: Ends, weights: Weights) -> NDArray[np.float64]:
    """float64 (k,), what ``pair_dp.roots`` gives, smoothed."""
    out = np.zeros(len(ends.start_value))
    for t in range(len(out)):
        for k in range(len(blocks.state_start) - 1):
            out[t] -= weights.temperature * log_of(weights, start_of_walk(blocks, ends, t, k))
    return out


@inner_kernel
def start_of_walk(blocks: Blocks, ends: Ends, t: int, k: int) -> int:
    """The value at which walks through block k begin, for the t-th start."""
    x = blocks.value_start[blocks.state_start[k]]
    if ends.start_home[t, 0] > k:
        return int(x + 1)
    if ends.start_home[t, 1] < k:
        return int(x)
    return int(ends.start_value[t, 0 if ends.start_home[t, 0] == k else 1])
