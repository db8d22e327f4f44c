"""The compiled sweep behind ``precedence.covering_edges``: a vertical line moves over the sheet.

The toolpaths under the line stand in a treap (for finding a place) and in a linked list (for finding the
neighbours), both in flat arrays. Node n stands below, node n + 1 above everything. A gap is named by the
node below it.
"""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel, kernel

NONE = -1

# What is known of the gap between a node and the next one above it.
OLD = 0  # the two have been neighbours since before this x
HEALED = 1  # what stood between them has ended at this x
FRESH = 2  # at least one of them begins at this x


@inner_kernel
def _height(lines: NDArray[np.float64], s: int, x: float) -> float:
    x0, y0, x1, y1 = lines[s, 0, 0], lines[s, 0, 1], lines[s, 1, 0], lines[s, 1, 1]
    return float(y0 + (y1 - y0) / (x1 - x0) * (x - x0))


@kernel
def _cross(lines: NDArray[np.float64], low: int, high: int, eps: float) -> bool:
    """Whether ``low``, the lower of two slanted neighbours, rises above ``high`` or lies on it throughout."""
    left = max(lines[low, 0, 0], lines[high, 0, 0])
    right = min(lines[low, 1, 0], lines[high, 1, 0])
    at_left = _height(lines, high, left) - _height(lines, low, left)
    at_right = _height(lines, high, right) - _height(lines, low, right)
    return bool(at_left < -eps or at_right < -eps or (at_left <= eps and at_right <= eps))


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
def _remove(
    c: int,
    left: NDArray[np.int32],
    right: NDArray[np.int32],
    parent: NDArray[np.int32],
    weight: NDArray[np.uint32],
    below: NDArray[np.int32],
    above: NDArray[np.int32],
) -> None:
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
def _insert(
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
            go_left = middle < _height(lines, s, lines[c, 0, 0])
        else:
            x = (max(lines[c, 0, 0], lines[s, 0, 0]) + min(lines[c, 1, 0], lines[s, 1, 0])) / 2
            go_left = _height(lines, c, x) < _height(lines, s, x)
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
def _uprights_clash(
    lines: NDArray[np.float64], low: int, high: int, uprights: NDArray[np.bool_], eps: float
) -> bool:
    """Whether two neighbours, at least one of them upright, share more than a point."""
    x = lines[low, 0, 0] if uprights[low] else lines[high, 0, 0]
    top = lines[low, 1, 1] if uprights[low] else _height(lines, low, x)
    bottom = lines[high, 0, 1] if uprights[high] else _height(lines, high, x)
    return bool(top > bottom + eps)


@kernel
def sweep(
    lines: NDArray[np.float64],
    first: NDArray[np.int32],
    last: NDArray[np.int32],
    by_first: NDArray[np.int64],
    by_last: NDArray[np.int64],
    eps: float,
) -> tuple[NDArray[np.int32], int, int]:
    """Covering pairs of "is below" among segments that run from left to right.

    Args:
        lines: float64 (n, 2, 2), left end first; uprights lower end first.
        first, last: int32 (n,), the rank of the x at which each begins and ends; equal for uprights.
        by_first, by_last: int64 (n,), what sorts those; a sort inside would take a second to compile.
        eps: heights that differ by no more touch, in mm.

    Returns:
        (pairs int32 (m, 2), -1, -1), or (empty, low, high) where two segments cross.
    """
    n = len(lines)
    bottom, top = n, n + 1
    left = np.full(n + 2, NONE, np.int32)
    right = np.full(n + 2, NONE, np.int32)
    parent = np.full(n + 2, NONE, np.int32)
    below = np.full(n + 2, NONE, np.int32)
    above = np.full(n + 2, NONE, np.int32)
    above[bottom], below[top] = top, bottom
    weight = np.empty(n + 2, np.uint32)
    state = np.uint32(2463534242)
    for k in range(n + 2):  # xorshift32 (Marsaglia 2003): the shape of the treap need only look random
        state ^= np.uint32(state << np.uint32(13))
        state ^= np.uint32(state >> np.uint32(17))
        state ^= np.uint32(state << np.uint32(5))
        weight[k] = state
    gap = np.full(n + 2, OLD, np.int8)
    implied = np.zeros(n + 2, np.bool_)  # of each gap: other pairs say the same
    uprights = first == last
    pairs = np.empty((4 * n + 4, 2), np.int32)
    m = 0
    touched = np.empty(3 * n + 6, np.int32)
    i = j = 0
    while i < n or j < n:
        rank = last[by_last[j]]
        if i < n:
            rank = min(rank, first[by_first[i]])
        count = 0
        while j < n and last[by_last[j]] == rank:
            c = by_last[j]
            j += 1
            if uprights[c]:
                continue
            low, high = below[c], above[c]
            if gap[low] == OLD and not implied[low] and low != bottom:
                pairs[m, 0], pairs[m, 1] = low, c
                m += 1
            if gap[c] == OLD and not implied[c] and high != top:
                pairs[m, 0], pairs[m, 1] = c, high
                m += 1
            _remove(c, left, right, parent, weight, below, above)
            gap[low] = HEALED
            implied[low] = True
            touched[count] = low
            count += 1
        begin = i
        while i < n and first[by_first[i]] == rank:
            c = by_first[i]
            i += 1
            if uprights[c]:
                _insert(lines, c, uprights, (left, right), parent, weight, below, above)
        # Chains of uprights between what passes on either side: each pair of neighbours is a cover, and
        # says what the pair around the chain says.
        for k in range(begin, i):
            c = by_first[k]
            if not uprights[c]:
                continue
            low, high = below[c], above[c]
            if low != bottom:
                if _uprights_clash(lines, low, c, uprights, eps):
                    return pairs[:0], low, c
                pairs[m, 0], pairs[m, 1] = low, c
                m += 1
                if not uprights[low]:
                    implied[low] = True
            if high != top:
                if _uprights_clash(lines, c, high, uprights, eps):
                    return pairs[:0], c, high
                if not uprights[high]:
                    pairs[m, 0], pairs[m, 1] = c, high
                    m += 1
        for k in range(begin, i):
            if uprights[by_first[k]]:
                _remove(by_first[k], left, right, parent, weight, below, above)
        for k in range(begin, i):
            c = by_first[k]
            if uprights[c]:
                continue
            _insert(lines, c, uprights, (left, right), parent, weight, below, above)
            low = below[c]
            # A gap that stood before is now spanned by the longer way through c, so its pair is implied.
            gap[low] = gap[c] = FRESH
            implied[low] = implied[c] = False
            touched[count] = low
            touched[count + 1] = c
            count += 2
        for k in range(count):
            low = touched[k]
            if low < n and last[low] == rank:  # it has ended here itself
                continue
            gap[low] = OLD
            high = above[low]
            if low != bottom and high != top and _cross(lines, low, high, eps):
                return pairs[:0], low, high
    return pairs[:m].copy(), NONE, NONE
