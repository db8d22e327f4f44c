"""The cheapest walk through each block of columns, and the ascent of the bound that these walks give.

``evaluate`` is an exact dynamic programme over the states of every block, backwards: the value of a state
and a place of the nozzle is what printing the rest of the block costs at least. ``ascend`` moves the
multipliers of ``pair_prices`` along a subgradient: wherever the walks of two neighbours disagree.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import bare_kernel, kernel
from slicer.sequence.blocks import OUTSIDE, Blocks
from slicer.sequence.pair_prices import ENTER_LEFT, ENTER_RIGHT, LEAVE_LEFT, LEAVE_RIGHT, Tariff, weigh
from slicer.sequence.section import NONE

FIRST_STEP = 0.3
SHRINK = 0.7
PATIENCE = 15
MOMENTUM = 0.9
GAIN = 2e-3
"""A gain below this part of the remaining gap does not count against ``PATIENCE``."""


class Ends(NamedTuple):
    """Where the walks of all blocks begin and end.

    Attributes:
        starts: int32 (k,), the oriented toolpaths to begin with, as far as the blocks have them.
        start_value: int32 (k, 2), for each of them, its value in the first and the last
            block that has its column.
        start_home: int32 (k, 2), those blocks.
        last_home: int32 (2,), the first and last block of the last toolpath; (NONE, NONE) for a free end.
        last_local: int32 (2,), the last oriented toolpath in the numbers of those blocks.
    """

    starts: NDArray[np.int32]
    start_value: NDArray[np.int32]
    start_home: NDArray[np.int32]
    last_home: NDArray[np.int32]
    last_local: NDArray[np.int32]


@kernel
def evaluate(
    blocks: Blocks,
    tariff: Tariff,
    ends: Ends,
    arc: NDArray[np.float64],
    ways: NDArray[np.float64],
    value: NDArray[np.float64],
) -> None:
    """Fill ``value``, numbered as ``Blocks`` does: the least cost from there to the end of the block."""
    most = 2 * np.max(np.diff(blocks.move_start))
    onward = np.empty(most, np.int64)
    rest = np.empty(most)
    for k in range(len(blocks.state_start) - 1):
        low = 2 * blocks.path_start[k]
        stride = 2 * blocks.path_start[k + 1] - low
        final = blocks.state_start[k + 1] - 1
        _finish(blocks, tariff, ends, ways, value, k)
        for s in range(final - 1, blocks.state_start[k] - 1, -1):
            count = 0
            from_left = from_right = np.inf
            for m in range(blocks.move_start[s], blocks.move_start[s + 1]):
                for f in range(2):
                    v = 2 * blocks.move_path[m] + f
                    w = value[blocks.move_value[m] + f]
                    onward[count], rest[count] = v, w
                    count += 1
                    from_left = min(from_left, ways[ENTER_LEFT, low + v] + w)
                    from_right = min(from_right, ways[ENTER_RIGHT, low + v] + w)
            at = blocks.value_start[s]
            value[at] = min(from_left, from_right + tariff.cross[k])
            value[at + 1] = min(from_right, from_left + tariff.cross[k])
            for x in range(at + OUTSIDE, blocks.value_start[s + 1]):
                u = blocks.value_path[x]
                best = min(value[at] + ways[LEAVE_LEFT, low + u], value[at + 1] + ways[LEAVE_RIGHT, low + u])
                row = tariff.arc_start[k] + u * stride
                for t in range(count):
                    best = min(best, arc[row + onward[t]] + rest[t])
                value[x] = best


@bare_kernel
def _finish(
    blocks: Blocks,
    tariff: Tariff,
    ends: Ends,
    ways: NDArray[np.float64],
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
        value[at] = 0.0 if left else tariff.cross[k] if right else np.inf
        value[at + 1] = 0.0 if right else tariff.cross[k] if left else np.inf
    for x in range(at + OUTSIDE, blocks.value_start[final + 1]):
        u = blocks.value_path[x]
        value[x] = stays
        if not left and not right:
            own = ends.last_local[0] if ends.last_home[0] == k else ends.last_local[1]
            value[x] = 0.0 if u == own else np.inf
        if left:
            value[x] = min(value[x], ways[LEAVE_LEFT, low + u])
        if right:
            value[x] = min(value[x], ways[LEAVE_RIGHT, low + u])


@kernel
def roots(blocks: Blocks, ends: Ends, value: NDArray[np.float64]) -> NDArray[np.float64]:
    """float64 (k,), the lower bound on all sequences that begin with each of the possible starts."""
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


@bare_kernel
def trace(
    blocks: Blocks,
    tariff: Tariff,
    ends: Ends,
    arc: NDArray[np.float64],
    ways: NDArray[np.float64],
    value: NDArray[np.float64],
    start: int,
    slope: NDArray[np.float64],
) -> None:
    """Walk the cheapest walk of every block from a start; add to ``slope`` how the bound grows with the
    multipliers."""
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
            if u != NONE:
                # Going outside and coming back is two steps of the walk, at the same state.
                for side in range(2):
                    if value[x] == value[at + side] + ways[LEAVE_LEFT + side, low + u]:
                        _pay_way(tariff, LEAVE_LEFT + side, low + u, slope)
                        x, u = at + side, NONE
                        break
            m, f, way = _next(blocks, tariff, arc, ways, value, k, s, x)
            v = 2 * blocks.move_path[m] + f
            if u == NONE:
                _pay_way(tariff, way, low + v, slope)
            else:
                _pay_arc(blocks, tariff, k, u, v, slope)
            s, x = blocks.move_to[m], blocks.move_value[m] + f
        u = blocks.value_path[x]
        if u != NONE:
            for side in range(2):
                if ways[LEAVE_LEFT + side, low + u] == value[x]:
                    _pay_way(tariff, LEAVE_LEFT + side, low + u, slope)
                    break


@bare_kernel
def _next(
    blocks: Blocks,
    tariff: Tariff,
    arc: NDArray[np.float64],
    ways: NDArray[np.float64],
    value: NDArray[np.float64],
    k: int,
    s: int,
    x: int,
) -> tuple[int, int, int]:
    """The cheapest step from value x of state s: its number, direction, and the way in if from outside."""
    low = 2 * blocks.path_start[k]
    stride = 2 * blocks.path_start[k + 1] - low
    u, side = blocks.value_path[x], x - blocks.value_start[s]
    best, move, flip, entry = np.inf, blocks.move_start[s], 0, ENTER_LEFT
    for m in range(blocks.move_start[s], blocks.move_start[s + 1]):
        for f in range(2):
            v, w = 2 * blocks.move_path[m] + f, value[blocks.move_value[m] + f]
            if u != NONE:
                cost = arc[tariff.arc_start[k] + u * stride + v] + w
                if cost < best:
                    best, move, flip = cost, m, f
                continue
            for way in (ENTER_LEFT, ENTER_RIGHT):
                cost = ways[way, low + v] + w
                if way - ENTER_LEFT != side:
                    cost += tariff.cross[k]
                if cost < best:
                    best, move, flip, entry = cost, m, f, way
    return move, flip, entry


@bare_kernel
def _pay_way(tariff: Tariff, way: int, at: int, slope: NDArray[np.float64]) -> None:
    if tariff.price_at[way, at] >= 0:
        slope[tariff.price_at[way, at]] += tariff.price_sign[way, at]


@bare_kernel
def _pay_arc(blocks: Blocks, tariff: Tariff, k: int, u: int, v: int, slope: NDArray[np.float64]) -> None:
    """Note a travel inside block k from u to v, both in its own numbers."""
    low = blocks.path_start[k]
    prices = tariff.pair_start[-1]
    stride = (len(slope) - prices) // 4
    right = blocks.bounds[k + 1]
    u_column, u_local = _column_of(blocks, k, u)
    v_column, v_local = _column_of(blocks, k, v)
    pairs = tariff.pair_start[u_column]
    u_seam = tariff.pair_start[u_column + 1] > pairs
    v_seam = tariff.pair_start[v_column + 1] > tariff.pair_start[v_column]
    if u_column == v_column:
        if u_seam:
            at = pairs + u_local * 2 * blocks.column_size[u_column] + v_local
            slope[at] += 1.0 if u_column == right else -1.0
        return
    rightward = v_column > u_column
    if u_seam:
        way = LEAVE_RIGHT if rightward else LEAVE_LEFT
        slope[prices + way * stride + 2 * blocks.path[low + (u >> 1)] + (u & 1)] -= 1.0
    if v_seam:
        way = ENTER_LEFT if rightward else ENTER_RIGHT
        slope[prices + way * stride + 2 * blocks.path[low + (v >> 1)] + (v & 1)] -= 1.0


@bare_kernel
def _column_of(blocks: Blocks, k: int, u: int) -> tuple[int, int]:
    """The column of a block's oriented toolpath u, and u's number in that column."""
    c = blocks.bounds[k]
    while u >= 2 * blocks.column_size[c]:
        u -= 2 * blocks.column_size[c]
        c += 1
    return c, u


@kernel
def ascend(
    blocks: Blocks,
    tariff: Tariff,
    ends: Ends,
    multipliers: NDArray[np.float64],
    best: NDArray[np.float64],
    direction: NDArray[np.float64],
    memory: NDArray[np.float64],
    arc: NDArray[np.float64],
    ways: NDArray[np.float64],
    value: NDArray[np.float64],
    target: float,
    iterations: int,
) -> bool:
    """Raise the bound by subgradient steps with momentum; whether it reached ``target`` or a standstill.

    The step is Polyak's, θ·(target − bound)/‖direction‖², along a moving average of subgradients; θ shrinks
    after ``PATIENCE`` steps without a gain worth the name, and the ascent goes back to the best point.

    Args:
        multipliers, best: where the ascent is, and where the bound was best so far.
        direction: the moving average.
        memory: float64 (3,), θ, the steps without gain, and the best bound; carried between calls.
        arc, ways, value: room for what ``weigh`` and ``evaluate`` write.
        target: a cost that some sequence has.
    """
    slope = np.zeros(len(multipliers))
    for _ in range(iterations):
        weigh(blocks, tariff, multipliers, arc, ways)
        evaluate(blocks, tariff, ends, arc, ways, value)
        by_start = roots(blocks, ends, value)
        start = int(np.argmin(by_start))
        bound = by_start[start]
        if bound > memory[2]:
            if bound > memory[2] + GAIN * (target - memory[2]):
                memory[1] = 0.0
            memory[2] = bound
            best[:] = multipliers
        else:
            memory[1] += 1.0
            if memory[1] > PATIENCE:
                memory[0] *= SHRINK
                memory[1] = 0.0
                multipliers[:] = best
                direction[:] = 0.0
                continue
        if memory[2] >= target or tariff.size == 0:
            return True
        slope[:] = 0.0
        trace(blocks, tariff, ends, arc, ways, value, start, slope)
        norm = 0.0
        for t in range(len(slope)):
            direction[t] = MOMENTUM * direction[t] + (1.0 - MOMENTUM) * slope[t]
            norm += direction[t] * direction[t]
        if norm < 1e-12:
            return True
        step = memory[0] * (1.0 - MOMENTUM) * (target - bound) / norm
        for t in range(len(slope)):
            multipliers[t] += step * direction[t]
    return False
