"""Search through the states of a sheet layer by layer, each layer with one more toolpath printed.

A node is what is printed, the last toolpath and its direction; of equal nodes the cheaper one is kept. What
it costs so far plus the values of all its blocks (``pair_dp.evaluate``) is a lower bound on every sequence
through it. Nodes above a cut are dropped, and beyond a width the worst. If only the cut dropped nodes, then
no sequence below the cut is missed.
"""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import allocating_inner_kernel, bare_kernel, inner_kernel, kernel
from slicer.sequence.layered.layer import Layer, Limits, Seen, Sheet, StateSpace, Trail
from slicer.sequence.layered.node_pool import (
    BOUND,
    COST,
    LAST,
    PARENT,
    NodePool,
    doubled,
    drop_dominated,
    keep_best,
    rebuild_table,
    sort_by_bound,
)
from slicer.sequence.layered.successors import Gathered, Scratch, gather, in_block, step_of, value_at
from slicer.sequence.problem import scrambled
from slicer.sequence.states import Blocks


def first_layer(space: StateSpace, starts: NDArray[np.int32]) -> Layer:
    """The nodes where one toolpath is printed."""
    m = len(starts)
    state = np.tile(space.blocks.state_start[:-1], (m, 1))
    estimate, key = np.zeros(m), np.zeros(m, np.uint64)
    _begin(space.blocks, space.value, space.sheet, starts, state, estimate, key)
    return Layer(state, starts, np.zeros(m), estimate, key)


@bare_kernel
def _begin(
    blocks: Blocks,
    value: NDArray[np.float64],
    sheet: Sheet,
    starts: NDArray[np.int32],
    state: NDArray[np.int32],
    estimate: NDArray[np.float64],
    key: NDArray[np.uint64],
) -> None:
    """Fill in the states, estimates and keys after each of the starts."""
    column, local = sheet.column, sheet.local
    for i in range(len(starts)):
        u = starts[i]
        c = column[u >> 1]
        home = blocks.home[c]
        key[i] = scrambled((u >> 1) + 1)
        for k in range(state.shape[1]):
            mine = 0
            if home[0] <= k <= home[1]:
                mine = in_block(blocks, k, u, local[u >> 1], c)
                state[i, k] = blocks.move_to[step_of(blocks, state[i, k], mine >> 1)]
            estimate[i] += value_at(blocks, value, k, state[i, k], mine, home)


@kernel
def expand_layers(
    space: StateSpace, layer: Layer, pool: NodePool, trail: Trail, limits: Limits, seen: Seen, most: int
) -> tuple[Layer, NodePool, Trail, Seen]:
    """Search layer after layer.

    It ends with the last layer, at an empty one, beyond ``most_nodes``, or after ``most`` more successors.
    """
    # What creates arrays counts references to every array that it touches, at an atomic instruction each:
    # most of the time, were the loops over nodes in here.
    count = layer.state.shape[1]
    scratch = Scratch(
        np.empty(count), np.empty(count + 1), np.empty(count + 1), np.empty(_columns(space), np.int32)
    )
    layers, missed, nodes, generated, widest = seen
    until = generated + most
    while layers < len(trail.begin) - 1 and len(layer.last) > 0 and generated < until:
        nodes += len(layer.last)
        if nodes > limits.most_nodes:
            break
        width = limits.width if generated <= limits.enough else min(limits.width, limits.narrow)
        rebuild_table(pool, 0)
        # Of nodes that may dominate each other more are gathered before the worst are dropped. A narrow layer
        # after wide ones does without: what each time takes depends on the pool.
        room = 4 * width if limits.metric else width + max(width // 4, len(pool.table) // 16)
        gathered = Gathered(0, 0, limits.cut, np.inf, 0, room)
        while True:
            gathered = gather(space, layer, pool, limits, width, scratch, gathered)
            if gathered.at == len(layer.last):
                break
            pool = doubled(pool, gathered.size)
        size, dropped = _choose(space, pool, limits, width, gathered)
        missed, generated, widest = min(missed, dropped), generated + gathered.generated, max(widest, size)
        sort_by_bound(pool, size, np.empty(size, np.int32))
        begin = trail.begin[layers]
        if begin + size > len(trail.last):
            trail = _longer(trail, begin, begin + size)
        before = layer
        layer = _new_layer(size, count)
        _enter(space, before, pool, layer, trail, begin)
        layers += 1
        trail.begin[layers] = begin + size
    return layer, pool, trail, Seen(layers, missed, nodes, generated, widest)


@inner_kernel
def _columns(space: StateSpace) -> int:
    """How many columns there are; a kernel that allocates would take out all arrays of the blocks for it."""
    return len(space.blocks.column_size)


@inner_kernel
def _choose(
    space: StateSpace, pool: NodePool, limits: Limits, width: int, gathered: Gathered
) -> tuple[int, float]:
    """Drop what has no room in a layer: how many nodes are left, and the least bound dropped of all."""
    size, dropped = gathered.size, gathered.dropped
    if limits.metric:
        size = drop_dominated(pool, space.sheet.segments, size)
    if size > width:
        dropped = min(dropped, keep_best(pool, size, width)[0])
        size = width
    return size, dropped


@allocating_inner_kernel
def _new_layer(size: int, count: int) -> Layer:
    """Room for a layer of so many nodes over so many blocks."""
    return Layer(
        np.empty((size, count), np.int32),
        np.empty(size, np.int32),
        np.empty(size),
        np.empty(size),
        np.empty(size, np.uint64),
    )


@allocating_inner_kernel
def _longer(trail: Trail, used: int, needed: int) -> Trail:
    """A trail with the same nodes and more room."""
    room = max(needed, 2 * len(trail.last))
    longer = Trail(np.empty(room, np.int32), np.empty(room, np.int32), trail.begin)
    for at in range(used):
        longer.last[at], longer.parent[at] = trail.last[at], trail.parent[at]
    return longer


@inner_kernel
def _enter(space: StateSpace, before: Layer, pool: NodePool, layer: Layer, trail: Trail, begin: int) -> None:
    """Fill in a layer with the pool's nodes in the order of its chain, and the trail to them.

    The states of a node are those of its parent but for one column.
    """
    blocks, column, local = space.blocks, space.sheet.column, space.sheet.local
    for i in range(len(layer.last)):
        at = pool.chain[i]
        v, parent = pool.tag[at, LAST], pool.tag[at, PARENT]
        trail.last[begin + i], trail.parent[begin + i] = v, parent
        layer.last[i], layer.key[i] = v, pool.key[at]
        layer.cost[i] = pool.number[at, COST]
        layer.estimate[i] = pool.number[at, BOUND] - pool.number[at, COST]
        c = column[v >> 1]
        for k in range(layer.state.shape[1]):
            s = before.state[parent, k]
            if blocks.home[c, 0] <= k <= blocks.home[c, 1]:
                s = blocks.move_to[step_of(blocks, s, in_block(blocks, k, v, local[v >> 1], c) >> 1)]
            layer.state[i, k] = s
