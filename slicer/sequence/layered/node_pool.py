"""The nodes that a layer's successors are gathered in: each once, the cheapest, and in the end the best.

A ``NodePool`` is a hash table with open addressing over flat arrays, used for layer after layer.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import allocating_inner_kernel, inner_kernel
from slicer.sequence.problem import scrambled
from slicer.sequence.states import NONE

FIRST_CAPACITY = 4096
PARENT, LAST = 0, 1
COST, BOUND = 0, 1
RUN = 8
"""So many nodes are sorted by insertion."""


class NodePool(NamedTuple):
    """Room for nodes; how many there are is known to whoever uses it.

    Attributes:
        tag: int32 (m, 2), parent and last oriented toolpath.
        number: float64 (m, 2), cost so far and lower bound.
        key: uint64 (m,), a hash of what is printed.
        spare: float64 (m,), scratch.
        chain: int32 (m,), scratch, and the numbers of nodes in the order of ``sort_by_bound``.
        table: int32 (2m,), nodes by hash of key and last toolpath, or ``NONE``; 2m is a power of two.
    """

    tag: NDArray[np.int32]
    number: NDArray[np.float64]
    key: NDArray[np.uint64]
    spare: NDArray[np.float64]
    chain: NDArray[np.int32]
    table: NDArray[np.int32]


def new_pool() -> NodePool:
    """A pool of ``FIRST_CAPACITY`` nodes."""
    m = FIRST_CAPACITY
    return NodePool(
        np.empty((m, 2), np.int32),
        np.empty((m, 2)),
        np.empty(m, np.uint64),
        np.empty(m),
        np.empty(m, np.int32),
        np.full(2 * m, NONE, np.int32),
    )


@inner_kernel
def insert(
    pool: NodePool, size: int, key: np.uint64, last: int, parent: int, cost: float, bound: float
) -> int:
    """Enter a node, unless it is there and no dearer; the new size. There must be room for one more."""
    mask = len(pool.table) - 1
    place = int((key ^ scrambled(-last - 1)) >> np.uint64(20)) & mask
    at = pool.table[place]
    while at != NONE and (pool.key[at] != key or pool.tag[at, LAST] != last):
        place = (place + 1) & mask
        at = pool.table[place]
    if at == NONE:
        at = size
        size += 1
        pool.table[place] = at
        pool.key[at], pool.tag[at, LAST] = key, last
    elif pool.number[at, COST] <= cost:
        return size
    pool.tag[at, PARENT] = parent
    pool.number[at, COST], pool.number[at, BOUND] = cost, bound
    return size


@inner_kernel
def rebuild_table(pool: NodePool, size: int) -> None:
    """Fill the table anew, with the first ``size`` nodes."""
    mask = len(pool.table) - 1
    for place in range(mask + 1):
        pool.table[place] = NONE
    for at in range(size):
        place = int((pool.key[at] ^ scrambled(-pool.tag[at, LAST] - 1)) >> np.uint64(20)) & mask
        while pool.table[place] != NONE:
            place = (place + 1) & mask
        pool.table[place] = at


@allocating_inner_kernel
def doubled(pool: NodePool, size: int) -> NodePool:
    """A pool of twice the room with the same nodes."""
    m = 2 * len(pool.key)
    wider = NodePool(
        np.empty((m, 2), np.int32),
        np.empty((m, 2)),
        np.empty(m, np.uint64),
        np.empty(m),
        np.empty(m, np.int32),
        np.empty(2 * m, np.int32),
    )
    for at in range(size):
        _copy(pool, at, wider, at)
    rebuild_table(wider, size)
    return wider


@inner_kernel
def _copy(pool: NodePool, at: int, target: NodePool, to: int) -> None:
    for k in range(2):
        target.tag[to, k] = pool.tag[at, k]
        target.number[to, k] = pool.number[at, k]
    target.key[to] = pool.key[at]


@inner_kernel
def keep_best(pool: NodePool, size: int, width: int) -> tuple[float, float]:
    """Move the ``width`` < size nodes of least bound to the front, in their order.

    Returns the least bound that was dropped and the greatest that was kept; the table is left as it was.
    """
    for at in range(size):
        pool.spare[at] = pool.number[at, BOUND]
    limit = _smallest(pool.spare, size, width - 1)
    ties = width
    for at in range(size):
        ties -= pool.number[at, BOUND] < limit
    kept, least = 0, np.inf
    for at in range(size):
        bound = pool.number[at, BOUND]
        if bound < limit or (bound == limit and ties > 0):
            ties -= bound == limit
            _copy(pool, at, pool, kept)
            kept += 1
        else:
            least = min(least, bound)
    return least, limit


@inner_kernel
def _smallest(values: NDArray[np.float64], size: int, rank: int) -> float:
    """The value of that rank, from 0; reorders the values (Hoare's FIND, CACM 4, 1961)."""
    low, high = 0, size - 1
    while low < high:
        pivot = values[(low + high) >> 1]
        i, j = low, high
        while i <= j:
            while values[i] < pivot:
                i += 1
            while values[j] > pivot:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if rank <= j:
            high = j
        elif rank >= i:
            low = i
        else:
            break
    return float(values[rank])


@inner_kernel
def sort_by_bound(pool: NodePool, size: int, spare: NDArray[np.int32]) -> None:
    """Put the numbers of the first nodes into the chain, least bound first, equal ones as they come.

    Merges runs that are sorted (Knuth, The Art of Computer Programming 3, 5.2.4); ``spare`` is int32 (size,).
    """
    chain, number = pool.chain, pool.number
    for begin in range(0, size, RUN):
        for at in range(begin, min(begin + RUN, size)):
            to = at
            while to > begin and number[chain[to - 1], BOUND] > number[at, BOUND]:
                chain[to] = chain[to - 1]
                to -= 1
            chain[to] = at
    run = RUN
    while run < size:
        for begin in range(0, size, 2 * run):
            middle, end = min(begin + run, size), min(begin + 2 * run, size)
            left, right = begin, middle
            for to in range(begin, end):
                from_left = right == end
                if left < middle and right < end:
                    from_left = number[chain[left], BOUND] <= number[chain[right], BOUND]
                if from_left:
                    spare[to] = chain[left]
                    left += 1
                else:
                    spare[to] = chain[right]
                    right += 1
        for at in range(size):
            chain[at] = spare[at]
        run *= 2


@inner_kernel
def drop_dominated(pool: NodePool, segments: NDArray[np.float64], size: int) -> int:
    """Drop nodes whose end another node with the same printed reaches for no more; how many are left.

    For costs that obey the triangle inequality. The table is used up.
    """
    mask = len(pool.table) - 1
    for place in range(mask + 1):
        pool.table[place] = NONE
    for at in range(size):  # lists of the nodes with the same key
        place = int(pool.key[at] >> np.uint64(20)) & mask
        pool.chain[at] = pool.table[place]
        pool.table[place] = at
    for at in range(size):
        a = pool.tag[at, LAST]
        pool.spare[at] = 0.0
        rival = pool.table[int(pool.key[at] >> np.uint64(20)) & mask]
        while rival != NONE:
            if rival != at and pool.key[rival] == pool.key[at]:
                b = pool.tag[rival, LAST]
                dx = segments[a >> 1, 1 - (a & 1), 0] - segments[b >> 1, 1 - (b & 1), 0]
                dy = segments[a >> 1, 1 - (a & 1), 1] - segments[b >> 1, 1 - (b & 1), 1]
                gap = pool.number[at, COST] - pool.number[rival, COST] - np.sqrt(dx * dx + dy * dy)
                if gap > 0.0 or (gap == 0.0 and rival < at):
                    pool.spare[at] = 1.0
                    break
            rival = pool.chain[rival]
    kept = 0
    for at in range(size):
        if pool.spare[at] == 0.0:
            _copy(pool, at, pool, kept)
            kept += 1
    return kept
