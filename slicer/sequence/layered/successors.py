"""The successors of the nodes of a layer: what may be printed next, and what it leads to at least.

A step leads to states of all blocks that have its toolpath, and is taken only where all is printed that the
toolpath needs elsewhere, so that a node is closed under the whole precedence.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel
from slicer.sequence.layered.layer import Layer, Limits, StateSpace
from slicer.sequence.layered.node_pool import NodePool, insert, keep_best, rebuild_table
from slicer.sequence.problem import direct_cost, least_travel_cost, scrambled
from slicer.sequence.states import FREE, NONE, OUTSIDE, Blocks, cost_over, needs_printed


class Gathered(NamedTuple):
    """How far the gathering of a layer has come.

    Attributes:
        at: the node of the layer before whose successors are next.
        size: nodes in the pool.
        cut: nodes whose bound is above it are dropped.
        dropped: the least bound dropped.
        generated: successors looked at.
        room: with more nodes in the pool than this the worst are dropped.
    """

    at: int
    size: int
    cut: float
    dropped: float
    generated: int
    room: int


class Scratch(NamedTuple):
    """Room for what is known of one node.

    Attributes:
        old: float64 (b,), the value of each block.
        passed: float64 (b + 1,), the change of the estimate if the blocks before k come to lie to the left.
        ahead: float64 (b + 1,), the same if those from k on come to lie to the right.
        printed: int32 (c,), the down-set of each column.
    """

    old: NDArray[np.float64]
    passed: NDArray[np.float64]
    ahead: NDArray[np.float64]
    printed: NDArray[np.int32]


@inner_kernel
def gather(
    space: StateSpace,
    layer: Layer,
    pool: NodePool,
    limits: Limits,
    width: int,
    scratch: Scratch,
    gathered: Gathered,
) -> Gathered:
    """Enter the successors of a layer's nodes into the pool, until they are done or the pool is full.

    A node whose successors have no room begins anew in a larger pool, which leaves those that are there.
    """
    blocks, value, sheet = space.blocks, space.value, space.sheet
    segments, column, local, distant, cost_model = sheet
    tied, allowed = len(distant.path) > 0, blocks.allowed
    highest = limits.cut
    first, size, cut, dropped, generated, room = gathered
    old, passed, ahead, printed = scratch
    for i in range(first, len(layer.last)):
        before = generated
        u = layer.last[i]
        u_home = blocks.home[column[u >> 1]]
        out_x, out_y = segments[u >> 1, 1 - (u & 1), 0], segments[u >> 1, 1 - (u & 1), 1]
        _look_around(space, layer.state[i], u, scratch)
        if space.sky.routed or tied:
            _read_sets(space, layer.state[i], printed)
        for k in range(len(old)):
            s = layer.state[i, k]
            for e in range(blocks.move_start[s], blocks.move_start[s + 1]):
                path = blocks.path[blocks.path_start[k] + blocks.move_path[e]]
                v_home = blocks.home[column[path]]
                if v_home[0] != k:
                    continue  # a seam column belongs to the block on its left
                other = NONE
                if v_home[1] > k:
                    other = step_of(blocks, layer.state[i, k + 1], local[path])
                    if other == NONE:
                        continue
                if tied and not needs_printed(distant, local, column, printed, path):
                    continue
                low, high = min(u_home[0], v_home[0]), max(u_home[1], v_home[1])
                # Only blocks from u to v see a change; those between see the nozzle change sides.
                common = layer.estimate[i] + passed[k] - passed[low] + ahead[v_home[1] + 1] - ahead[high + 1]
                for f in range(2):
                    if not allowed[2 * (blocks.path_start[k] + blocks.move_path[e]) + f]:
                        continue
                    estimate = common + value[blocks.move_value[e] + f] - old[k]
                    if other != NONE:
                        estimate += value[blocks.move_value[other] + f] - old[k + 1]
                    dx, dy = segments[path, f, 0] - out_x, segments[path, f, 1] - out_y
                    direct = direct_cost(cost_model, dx, dy)
                    cost = layer.cost[i] + direct
                    generated += 1
                    if space.sky.routed:
                        if cost_model.join > 0.0:
                            # A slow hop that has to rise over something is not joined, and then costs less.
                            cost = layer.cost[i] + least_travel_cost(cost_model, dx, dy)
                        if cost + estimate <= cut:
                            over = cost_over(
                                cost_model,
                                space.sky,
                                printed,
                                (column[u >> 1], column[path]),
                                (u >> 1, segments[u >> 1]),
                                (out_x, out_y),
                                (segments[path, f, 0], segments[path, f, 1]),
                            )
                            cost = layer.cost[i] + (direct if over == FREE else over)
                    if cost + estimate <= cut:
                        if size == len(pool.key):
                            return Gathered(i, size, cut, dropped, before, room)
                        key = layer.key[i] ^ scrambled(path + 1)
                        size = insert(pool, size, key, 2 * path + f, i, cost, cost + estimate)
                    elif cost + estimate <= highest:
                        # It is of interest, but there is no room for it.
                        dropped = min(dropped, cost + estimate)
        if size > room:
            least, cut = keep_best(pool, size, width)
            size, dropped = width, min(dropped, least)
            rebuild_table(pool, size)
    return Gathered(len(layer.last), size, cut, dropped, generated, room)


@inner_kernel
def _read_sets(space: StateSpace, state: NDArray[np.int32], printed: NDArray[np.int32]) -> None:
    """Fill in the down-set of each column from the states of the blocks."""
    blocks = space.blocks
    for k in range(len(state)):
        width = blocks.bounds[k + 1] - blocks.bounds[k] + 1
        at = space.first_set[k] + (state[k] - blocks.state_start[k]) * width
        for q in range(width):
            printed[blocks.bounds[k] + q] = space.set_of[at + q]


@inner_kernel
def _look_around(space: StateSpace, state: NDArray[np.int32], u: int, scratch: Scratch) -> None:
    """Fill in what every block's value is after u, and sums of what it changes by if the nozzle goes past."""
    blocks, value = space.blocks, space.value
    column, local = space.sheet.column, space.sheet.local
    old, passed, ahead, _ = scratch
    home = blocks.home[column[u >> 1]]
    count = len(old)
    passed[0] = ahead[count] = 0.0
    for k in range(count):
        mine = 0
        if home[0] <= k <= home[1]:
            mine = in_block(blocks, k, u, local[u >> 1], column[u >> 1])
        old[k] = value_at(blocks, value, k, state[k], mine, home)
        passed[k + 1] = passed[k] + value[blocks.value_start[state[k]] + 1] - old[k]
    for k in range(count - 1, -1, -1):
        ahead[k] = ahead[k + 1] + value[blocks.value_start[state[k]]] - old[k]


@inner_kernel
def step_of(blocks: Blocks, s: int, path: int) -> int:
    """The step of state s that prints a block's toolpath, or ``NONE``."""
    for e in range(blocks.move_start[s], blocks.move_start[s + 1]):
        if blocks.move_path[e] == path:
            return e
    return NONE


@inner_kernel
def value_at(
    blocks: Blocks, value: NDArray[np.float64], k: int, s: int, u: int, home: NDArray[np.int32]
) -> float:
    """The value of state s of block k after the oriented toolpath u, whose blocks are ``home``.

    ``u`` is in the block's numbers, and of no interest where the block does not have it.
    """
    at = blocks.value_start[s]
    if k > home[1]:
        return float(value[at])
    if k < home[0]:
        return float(value[at + 1])
    for x in range(at + OUTSIDE, blocks.value_start[s + 1]):
        if blocks.value_path[x] == u:
            return float(value[x])
    return np.inf


@inner_kernel
def in_block(blocks: Blocks, k: int, u: int, local: int, column: int) -> int:
    """The number that block k gives to the oriented toolpath u of a column that it has."""
    before = blocks.column_start[column] - blocks.column_start[blocks.bounds[k]]
    return int(2 * (before + local) + (u & 1))
