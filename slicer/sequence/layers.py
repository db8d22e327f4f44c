"""Search through the states of a sheet layer by layer, each layer with one more toolpath printed.

A node is what is printed, the last toolpath and its direction; of equal nodes the cheaper one is kept. What
it costs so far plus the values of all its blocks (``pair_walk.evaluate``) is a lower bound on every sequence
through it. Nodes above a cut are dropped, and beyond a width the worst. If only the cut dropped nodes, then
no sequence below the cut is missed.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import bare_kernel, kernel
from slicer.sequence.blocks import OUTSIDE, Blocks
from slicer.sequence.cost import direct_cost
from slicer.sequence.downsets import scrambled
from slicer.sequence.section import NONE


class Layer(NamedTuple):
    """The nodes with one number of printed toolpaths.

    Attributes:
        state: int32 (m, b), the state of each block.
        last: int32 (m,), the last oriented toolpath.
        cost: float64 (m,), of the travels so far.
        estimate: float64 (m,), the sum of the blocks' values: at least this much is to come.
        key: uint64 (m,), a hash of what is printed.
        parent: int32 (m,), the node of the layer before.
    """

    state: NDArray[np.int32]
    last: NDArray[np.int32]
    cost: NDArray[np.float64]
    estimate: NDArray[np.float64]
    key: NDArray[np.uint64]
    parent: NDArray[np.int32]


@bare_kernel
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


@bare_kernel
def in_block(blocks: Blocks, offset: NDArray[np.int64], k: int, u: int, local: int, column: int) -> int:
    """The number that block k gives to the oriented toolpath u of a column that it has."""
    before = offset[column] - offset[blocks.bounds[k]]
    return int(2 * (before + local) + (u & 1))


@kernel
def first_layer(
    blocks: Blocks,
    value: NDArray[np.float64],
    column: NDArray[np.int32],
    local: NDArray[np.int32],
    starts: NDArray[np.int32],
) -> Layer:
    """The nodes where one toolpath is printed."""
    count = len(blocks.state_start) - 1
    offset = np.append(np.zeros(1, np.int64), np.cumsum(blocks.column_size.astype(np.int64)))
    m = len(starts)
    state = np.empty((m, count), np.int32)
    estimate = np.zeros(m)
    key = np.empty(m, np.uint64)
    for i in range(m):
        u = starts[i]
        s = u >> 1
        home = blocks.home[column[s]]
        key[i] = scrambled(s + 1)
        for k in range(count):
            state[i, k] = blocks.state_start[k]
            mine = 0
            if home[0] <= k <= home[1]:
                mine = in_block(blocks, offset, k, u, local[s], column[s])
                for e in range(blocks.move_start[state[i, k]], blocks.move_start[state[i, k] + 1]):
                    if blocks.move_path[e] == mine >> 1:
                        state[i, k] = blocks.move_to[e]
                        break
            estimate[i] += value_at(blocks, value, k, state[i, k], mine, home)
    return Layer(state, starts.copy(), np.zeros(m), estimate, key, np.full(m, NONE, np.int32))


@kernel
def advance(
    blocks: Blocks,
    value: NDArray[np.float64],
    segments: NDArray[np.float64],
    column: NDArray[np.int32],
    local: NDArray[np.int32],
    parameters: NDArray[np.float64],
    layer: Layer,
    cut: float,
    width: int,
    metric: bool,
) -> tuple[Layer, float, int]:
    """The next layer, the least bound of all nodes that were dropped for width, and how many were generated.

    Args:
        cut: nodes whose bound is above it are dropped.
        width: of the others, so many are kept.
        metric: the cost obeys the triangle inequality, so that a node is of no use if another one has the
            same printed and could go to this one's end for less.
    """
    count = len(blocks.state_start) - 1
    offset = np.append(np.zeros(1, np.int64), np.cumsum(blocks.column_size.astype(np.int64)))
    capacity = 1024
    found = np.empty((2, capacity), np.int32)  # parent, oriented toolpath
    number = np.empty((2, capacity))  # cost, bound
    keys = np.empty(capacity, np.uint64)
    table = np.full(4 * capacity, NONE, np.int32)
    size, generated, dropped = 0, 0, np.inf
    old = np.empty(count)
    passed = np.zeros(count + 1)  # the change of the estimate if the blocks before k come to lie to the left
    ahead = np.zeros(count + 1)  # the same if those from k on come to lie to the right
    for i in range(len(layer.last)):
        u = layer.last[i]
        u_path = u >> 1
        u_column = column[u_path]
        u_home = blocks.home[u_column]
        out_x, out_y = segments[u_path, 1 - (u & 1), 0], segments[u_path, 1 - (u & 1), 1]
        for k in range(count):
            mine = 0
            if u_home[0] <= k <= u_home[1]:
                mine = in_block(blocks, offset, k, u, local[u_path], u_column)
            old[k] = value_at(blocks, value, k, layer.state[i, k], mine, u_home)
            at = blocks.value_start[layer.state[i, k]]
            passed[k + 1] = passed[k] + value[at + 1] - old[k]
        for k in range(count - 1, -1, -1):
            ahead[k] = ahead[k + 1] + value[blocks.value_start[layer.state[i, k]]] - old[k]
        for k in range(count):
            s = layer.state[i, k]
            for e in range(blocks.move_start[s], blocks.move_start[s + 1]):
                path = blocks.path[blocks.path_start[k] + blocks.move_path[e]]
                v_column = column[path]
                v_home = blocks.home[v_column]
                if v_home[0] != k:
                    continue  # a seam column belongs to the block on its left
                other = NONE
                if v_home[1] > k:
                    other = _step(blocks, layer.state[i, k + 1], local[path])
                    if other == NONE:
                        continue
                low, high = min(u_home[0], v_home[0]), max(u_home[1], v_home[1])
                # Only blocks from u to v see a change; those between see the nozzle change sides.
                common = layer.estimate[i] + passed[k] - passed[low] + ahead[v_home[1] + 1] - ahead[high + 1]
                for f in range(2):
                    estimate = common + value[blocks.move_value[e] + f] - old[k]
                    if other != NONE:
                        estimate += value[blocks.move_value[other] + f] - old[k + 1]
                    cost = layer.cost[i] + direct_cost(
                        parameters, segments[path, f, 0] - out_x, segments[path, f, 1] - out_y
                    )
                    generated += 1
                    bound = cost + estimate
                    if not bound <= cut:
                        continue
                    v = 2 * path + f
                    key = layer.key[i] ^ scrambled(path + 1)
                    mask = len(table) - 1
                    place = int((key ^ scrambled(-v - 1)) >> np.uint64(20)) & mask
                    while table[place] != NONE and (keys[table[place]] != key or found[1, table[place]] != v):
                        place = (place + 1) & mask
                    at = table[place]
                    if at == NONE:
                        if size == len(keys):
                            found = np.concatenate((found, found), axis=1)
                            number = np.concatenate((number, number), axis=1)
                            keys = np.concatenate((keys, keys))
                        at = size
                        table[place] = at
                        keys[at], found[1, at], number[0, at] = key, v, np.inf
                        size += 1
                    if cost < number[0, at]:
                        found[0, at], number[0, at], number[1, at] = i, cost, bound
                    if 2 * size > len(table):
                        table = _rehash(keys[:size], found[1, :size], 2 * len(table))
        if size > 4 * width:
            size, least, cut = _keep_best(found, number, keys, size, width)
            dropped = min(dropped, least)
            table = _rehash(keys[:size], found[1, :size], len(table))
    if metric:
        size = _drop_dominated(segments, found, number, keys, size)
    if size > width:
        size, least, cut = _keep_best(found, number, keys, size, width)
        dropped = min(dropped, least)
    return _settle(blocks, column, local, layer, found, number, keys, size), dropped, generated


@bare_kernel
def _step(blocks: Blocks, s: int, path: int) -> int:
    """The step of state s that prints a block's toolpath, or ``NONE``."""
    for e in range(blocks.move_start[s], blocks.move_start[s + 1]):
        if blocks.move_path[e] == path:
            return e
    return NONE


@kernel
def _rehash(keys: NDArray[np.uint64], last: NDArray[np.int32], size: int) -> NDArray[np.int32]:
    """A table of that size, a power of two, with all nodes in it."""
    table = np.full(size, NONE, np.int32)
    for at in range(len(keys)):
        place = int((keys[at] ^ scrambled(-last[at] - 1)) >> np.uint64(20)) & (size - 1)
        while table[place] != NONE:
            place = (place + 1) & (size - 1)
        table[place] = at
    return table


@kernel
def _keep_best(
    found: NDArray[np.int32],
    number: NDArray[np.float64],
    keys: NDArray[np.uint64],
    size: int,
    width: int,
) -> tuple[int, float, float]:
    """Move the ``width`` nodes of least bound to the front; also the least bound dropped, the most kept."""
    limit = np.partition(number[1, :size], width - 1)[width - 1]
    ties = width - np.count_nonzero(number[1, :size] < limit)
    kept, least = 0, np.inf
    for at in range(size):
        bound = number[1, at]
        if bound > limit or (bound == limit and ties == 0):
            least = min(least, bound)
            continue
        if bound == limit:
            ties -= 1
        found[:, kept] = found[:, at]
        number[:, kept] = number[:, at]
        keys[kept] = keys[at]
        kept += 1
    return kept, least, limit


@kernel
def _drop_dominated(
    segments: NDArray[np.float64],
    found: NDArray[np.int32],
    number: NDArray[np.float64],
    keys: NDArray[np.uint64],
    size: int,
) -> int:
    """Drop nodes whose end another node with the same printed reaches for less; how many are left."""
    slots = 1024
    while slots < 2 * size:
        slots *= 2
    head = np.full(slots, NONE, np.int32)
    after = np.full(size, NONE, np.int32)
    for at in range(size):
        place = int(keys[at] >> np.uint64(20)) & (slots - 1)
        after[at] = head[place]
        head[place] = at
    kept = 0
    useless = np.zeros(size, np.bool_)
    for at in range(size):
        a = found[1, at]
        rival = head[int(keys[at] >> np.uint64(20)) & (slots - 1)]
        while rival != NONE and not useless[at]:
            b = found[1, rival]
            if rival != at and keys[rival] == keys[at]:
                gap = np.hypot(
                    segments[a >> 1, 1 - (a & 1), 0] - segments[b >> 1, 1 - (b & 1), 0],
                    segments[a >> 1, 1 - (a & 1), 1] - segments[b >> 1, 1 - (b & 1), 1],
                )
                reached = number[0, rival] + gap
                useless[at] = reached < number[0, at] or (reached == number[0, at] and rival < at)
            rival = after[rival]
    for at in range(size):
        if not useless[at]:
            found[:, kept] = found[:, at]
            number[:, kept] = number[:, at]
            keys[kept] = keys[at]
            kept += 1
    return kept


@kernel
def _settle(
    blocks: Blocks,
    column: NDArray[np.int32],
    local: NDArray[np.int32],
    layer: Layer,
    found: NDArray[np.int32],
    number: NDArray[np.float64],
    keys: NDArray[np.uint64],
    size: int,
) -> Layer:
    """The kept nodes as a layer: their states are those of their parents but for one column."""
    offset = np.append(np.zeros(1, np.int64), np.cumsum(blocks.column_size.astype(np.int64)))
    state = np.empty((size, layer.state.shape[1]), np.int32)
    for at in range(size):
        state[at] = layer.state[found[0, at]]
        v = found[1, at]
        c = column[v >> 1]
        for k in range(blocks.home[c, 0], blocks.home[c, 1] + 1):
            mine = in_block(blocks, offset, k, v, local[v >> 1], c) >> 1
            state[at, k] = blocks.move_to[_step(blocks, state[at, k], mine)]
    return Layer(
        state,
        found[1, :size].copy(),
        number[0, :size].copy(),
        number[1, :size] - number[0, :size],
        keys[:size].copy(),
        found[0, :size].copy(),
    )
