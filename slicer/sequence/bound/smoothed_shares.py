"""The share of all walks that passes through each value of a block, each travel and each way.

Forwards, after ``smoothed_dp.weigh`` has gone backwards (the forward-backward algorithm: Baum and Petrie,
"Statistical inference for probabilistic functions of finite state Markov chains", Annals of Mathematical
Statistics 37, 1966).
"""

from math import ldexp
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel, kernel
from slicer.sequence.bound.ends import Ends
from slicer.sequence.bound.paid import ENTER_LEFT, ENTER_RIGHT, LEAVE_LEFT, Paid, between, way_cost
from slicer.sequence.bound.pair_costs import BlockCosts, detour_row
from slicer.sequence.bound.pair_dp import most_steps
from slicer.sequence.bound.smoothed_dp import Weights, entries, log_of, start_of_walk, way_weight
from slicer.sequence.states import OUTSIDE, Blocks

NEGLIGIBLE = 1e-10
"""A state with a smaller share of all walks is not looked at for the shares of those behind it."""
FAR = -700
"""Where a weight is of a power of two so much lower than what may follow, shares are told by logarithms."""


class Shares(NamedTuple):
    """Parts of all walks, between 0 and 1.

    Attributes:
        value: float64, those through each value of ``Blocks``.
        arc: float64, those that use each travel, numbered as ``BlockCosts.direct``.
        ways: float64 (4, p), those that use each way of leaving or entering.
        jumps: float64 (4, p), those of them that are jumps and pay less than the most for it.
        passing: float64 (4, d), the same by the down-set that is jumped over.
    """

    value: NDArray[np.float64]
    arc: NDArray[np.float64]
    ways: NDArray[np.float64]
    jumps: NDArray[np.float64]
    passing: NDArray[np.float64]


class Room(NamedTuple):
    """Scratch for the steps of a state: what they enter, what weighs behind, and the share that passes."""

    onward: NDArray[np.int64]
    rest: NDArray[np.float64]
    passed: NDArray[np.float64]


@kernel
def share_out(
    blocks: Blocks,
    block_costs: BlockCosts,
    ends: Ends,
    paid: Paid,
    weights: Weights,
    start_share: NDArray[np.float64],
    shares: Shares,
) -> None:
    """Fill in the shares.

    Args:
        start_share: float64 (k,), the part of all walks that begins with each start.
    """
    share = shares.value
    share[:] = 0.0
    shares.arc[:] = 0.0
    shares.ways[:] = 0.0
    shares.jumps[:] = 0.0
    shares.passing[:] = 0.0
    most = most_steps(blocks)
    room = Room(np.empty(most, np.int64), np.empty((most, 2)), np.empty((most, 2)))
    for k in range(len(blocks.state_start) - 1):
        for t in range(len(start_share)):
            share[start_of_walk(blocks, ends, t, k)] += start_share[t]
        for s in range(blocks.state_start[k], blocks.state_start[k + 1]):
            total = 0.0
            for x in range(blocks.value_start[s], blocks.value_start[s + 1]):
                total += share[x]
            if total > NEGLIGIBLE:
                _share_state(blocks, block_costs, paid, weights, shares, (k, s), room)


@inner_kernel
def _share_state(
    blocks: Blocks,
    block_costs: BlockCosts,
    paid: Paid,
    weights: Weights,
    shares: Shares,
    place: tuple[int, int],
    room: Room,
) -> None:
    """Hand the share of a state's values on to where walks go from there; place is (k, s)."""
    k, s = place
    value, share, priced = weights.value, shares.value, block_costs.jumps.priced
    onward, rest, passed = room
    low = 2 * blocks.path_start[k]
    stride = 2 * blocks.path_start[k + 1] - low
    at, first = blocks.value_start[s], blocks.move_start[s]
    size = blocks.move_start[s + 1] - first
    common = entries(
        (blocks.move_path, blocks.move_value), first, value, weights.exponent, onward[:size], rest
    )
    for j in range(size):
        passed[j, 0] = passed[j, 1] = 0.0
    for x in range(at + OUTSIDE, blocks.value_start[s + 1]):
        if share[x] <= 0.0 or value[x] <= 0.0:
            continue
        u = blocks.value_path[x]
        row = block_costs.arc_start[k] + u * stride
        extra = detour_row(blocks, block_costs, s, x)
        far = weights.in_logarithms or size == 0 or weights.exponent[x] < common + FAR
        whole = log_of(weights, x) if far else 0.0
        part = share[x] / value[x]
        for side in range(2):
            way, over = LEAVE_LEFT + side, blocks.end_set[s, side]
            if far:
                cost = way_cost(paid, priced, way, low + u, paid.passing[way, over])
                out = share[x] * np.exp(log_of(weights, at + side) - cost / weights.temperature - whole)
            else:
                scale = _power(weights.exponent[at + side] - weights.exponent[x])
                weight = way_weight(weights, priced, way, low + u, weights.passing[way, over])
                out = part * scale * value[at + side] * weight
            share[at + side] += out
            _use_way(paid, priced, shares, (way, low + u, over), out)
        part *= 0.0 if far else _power(common - weights.exponent[x])
        for j in range(size):
            for f in range(2):
                if far:
                    cost = paid.arc[row + onward[j] + f]
                    if extra >= 0:
                        cost += block_costs.detour[extra + 2 * j + f]
                    behind = log_of(weights, blocks.move_value[first + j] + f)
                    w = share[x] * np.exp(behind - cost / weights.temperature - whole)
                else:
                    w = part * weights.arc[row + onward[j] + f] * rest[j, f]
                    if extra >= 0:
                        w *= np.float64(weights.detour[extra + 2 * j + f]) ** 8
                shares.arc[row + onward[j] + f] += w
                passed[j, f] += w
    for side in range(2):
        if share[at + side] <= 0.0 or value[at + side] <= 0.0:
            continue
        far = weights.in_logarithms or weights.exponent[at + side] < common + FAR
        whole = log_of(weights, at + side) if far else 0.0
        part = share[at + side] / value[at + side]
        part *= 0.0 if far else _power(common - weights.exponent[at + side])
        for way in range(ENTER_LEFT, ENTER_RIGHT + 1):
            across, over = way - ENTER_LEFT != side, blocks.end_set[s, way - ENTER_LEFT]
            for j in range(size):
                for f in range(2):
                    v = low + onward[j] + f
                    if far:
                        cost = way_cost(paid, priced, way, v, paid.passing[way, over])
                        cost += block_costs.cross[k] if across else 0.0
                        behind = log_of(weights, blocks.move_value[first + j] + f)
                        w = share[at + side] * np.exp(behind - cost / weights.temperature - whole)
                    else:
                        w = part * way_weight(weights, priced, way, v, weights.passing[way, over])
                        w *= rest[j, f] * (weights.cross[k] if across else 1.0)
                    _use_way(paid, priced, shares, (way, v, over), w)
                    passed[j, f] += w
    for j in range(size):
        for f in range(2):
            share[blocks.move_value[first + j] + f] += passed[j, f]


@inner_kernel
def _use_way(
    paid: Paid, priced: NDArray[np.bool_], shares: Shares, use: tuple[int, int, int], part: float
) -> None:
    """Enter a part of all walks that leaves or enters; use is (way, toolpath, down-set on that side)."""
    way, at, over = use
    shares.ways[way, at] += part
    if priced[way, at] and between(paid, way, at, over):
        shares.jumps[way, at] += part
        shares.passing[way, over] += part


@inner_kernel
def _power(exponent: int) -> float:
    """2 to a power, or the nearest to it that is a number."""
    if exponent == 0:
        return 1.0
    return ldexp(1.0, max(-1000, min(1000, exponent)))
