"""What stands under a sweep line: toolpaths in order of height, in a treap and in a linked list.

The treap finds a place, the list finds neighbours; both lie in flat arrays. Node n, the root, stands below
and node n + 1 above everything.
"""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel

NONE = -1


@inner_kernel
def height(lines: NDArray[np.float64], s: int, x: float) -> float:
    """y of a slanted toolpath at x."""
    x0, y0, x1, y1 = lines[s, 0, 0], lines[s, 0, 1], lines[s, 1, 0], lines[s, 1, 1]
    return float(y0 + (y1 - y0) / (x1 - x0) * (x - x0))


@inner_kernel
def _rotate_up(c: int, left: NDArray[np.int32], right: NDArray[np.int32], parent: NDArray[np.int32]) -> None:
    p, g = parent[c], parent[parent[c]]
    if left[p] == c:
        left[p] = right[c]
        if right[c] != NONE:
            parent[right[c]] = p
        right[c] = p
    else:
        right[p] = left[c]
        if left[c] != NONE:
            parent[left[c]] = p
        left[c] = p
    parent[p], parent[c] = c, g
    if left[g] == p:
        left[g] = c
    else:
        right[g] = c


@inner_kernel
def remove(
    c: int,
    left: NDArray[np.int32],
    right: NDArray[np.int32],
    parent: NDArray[np.int32],
    weight: NDArray[np.uint32],
    below: NDArray[np.int32],
    above: NDArray[np.int32],
) -> None:
    """Take ``c`` out of the treap and of the list."""
    while left[c] != NONE or right[c] != NONE:
        a, b = left[c], right[c]
        if b == NONE or (a != NONE and weight[a] > weight[b]):
            _rotate_up(a, left, right, parent)
        else:
            _rotate_up(b, left, right, parent)
    p = parent[c]
    if left[p] == c:
        left[p] = NONE
    else:
        right[p] = NONE
    above[below[c]] = above[c]
    below[above[c]] = below[c]


@inner_kernel
def insert(
    lines: NDArray[np.float64],
    c: int,
    uprights: NDArray[np.bool_],
    children: tuple[NDArray[np.int32], NDArray[np.int32]],
    parent: NDArray[np.int32],
    weight: NDArray[np.uint32],
    below: NDArray[np.int32],
    above: NDArray[np.int32],
) -> None:
    """Put ``c`` in its place. Heights are compared in the middle of the common x-range, as defined."""
    left, right = children
    upright = uprights[c]
    root = len(lines)  # the node below everything is the root: all else hangs to its right
    p, go_left = root, False
    s = right[root]
    middle = (lines[c, 0, 1] + lines[c, 1, 1]) / 2
    while s != NONE:
        if upright and uprights[s]:
            go_left = middle < (lines[s, 0, 1] + lines[s, 1, 1]) / 2
        elif upright:
            go_left = middle < height(lines, s, lines[c, 0, 0])
        else:
            x = (max(lines[c, 0, 0], lines[s, 0, 0]) + min(lines[c, 1, 0], lines[s, 1, 0])) / 2
            go_left = height(lines, c, x) < height(lines, s, x)
        p = s
        s = left[s] if go_left else right[s]
    parent[c] = p
    left[c] = right[c] = NONE
    if go_left:
        left[p] = c
        low = below[p]
    else:
        right[p] = c
        low = p
    high = above[low]
    below[c], above[c] = low, high
    above[low] = below[high] = c
    while parent[c] != root and weight[parent[c]] < weight[c]:
        _rotate_up(c, left, right, parent)


@inner_kernel
def highest_under(
    lines: NDArray[np.float64], left: NDArray[np.int32], right: NDArray[np.int32], x: float, y: float
) -> int:
    """The highest node below (x, y); no upright may stand in the treap."""
    low = len(lines)
    s = right[low]
    while s != NONE:
        if height(lines, s, x) < y:
            low = s
            s = right[s]
        else:
            s = left[s]
    return low
