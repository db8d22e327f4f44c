"""The tree of ``mcts`` on flat arrays: children one by one, and which of them to go to.

A tree is int32 (m, 4), by node: the oriented toolpath that it adds, its first child, its next sibling, and
the number of its children. Its worth is float64 (m, 3): visits, the sum of their costs, and the least.
"""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel

WIDEN = 1.0
"""A node has at most this times the root of its visits as children."""
EXPLORE = 0.1
"""Weight of the confidence bound beside costs in units of how far the mean is above the least."""
ENTRY, CHILD, SIBLING, CHILDREN = 0, 1, 2, 3
VISITS, SUM, LEAST = 0, 1, 2
NONE = -1
FAINT = 1e-9
"""No spread of costs counts as less."""


@inner_kernel
def add_node(tree: NDArray[np.int32], worth: NDArray[np.float64], at: int, entry: int) -> int:
    """Enter a node without visits; the number of nodes."""
    tree[at, ENTRY] = entry
    tree[at, CHILD], tree[at, SIBLING], tree[at, CHILDREN] = NONE, NONE, 0
    worth[at, VISITS], worth[at, SUM], worth[at, LEAST] = 0.0, 0.0, np.inf
    return at + 1


@inner_kernel
def add_child(tree: NDArray[np.int32], worth: NDArray[np.float64], node: int, made: int, entry: int) -> int:
    """Enter a node as the first child of another; the number of nodes."""
    nodes = add_node(tree, worth, made, entry)
    tree[made, SIBLING], tree[node, CHILD] = tree[node, CHILD], made
    tree[node, CHILDREN] += 1
    return nodes


@inner_kernel
def is_child(tree: NDArray[np.int32], node: int, entry: int) -> bool:
    """Whether a child of the node adds this oriented toolpath."""
    child = tree[node, CHILD]
    while child != NONE and tree[child, ENTRY] != entry:
        child = tree[child, SIBLING]
    return bool(child != NONE)


@inner_kernel
def may_widen(tree: NDArray[np.int32], worth: NDArray[np.float64], node: int) -> bool:
    """Whether the node has been visited often enough for one more child (progressive widening)."""
    return bool(tree[node, CHILDREN] < WIDEN * np.sqrt(worth[node, VISITS]))


@inner_kernel
def select(tree: NDArray[np.int32], worth: NDArray[np.float64], node: int) -> int:
    """The child with the highest upper confidence bound (UCB1 on costs), or ``NONE`` where there is none."""
    chosen, highest = NONE, -np.inf
    spread = max(worth[0, SUM] / max(worth[0, VISITS], 1.0) - worth[0, LEAST], FAINT)
    child = tree[node, CHILD]
    while child != NONE:
        visits = worth[child, VISITS]
        value = -0.5 * (worth[child, SUM] / visits + worth[child, LEAST]) / spread
        value += EXPLORE * np.sqrt(np.log(worth[node, VISITS]) / visits)
        if value > highest:
            chosen, highest = child, value
        child = tree[child, SIBLING]
    return chosen


@inner_kernel
def backpropagate(worth: NDArray[np.float64], node: int, cost: float) -> None:
    """Enter what a rollout through the node has cost."""
    worth[node, VISITS] += 1.0
    worth[node, SUM] += cost
    worth[node, LEAST] = min(worth[node, LEAST], cost)
