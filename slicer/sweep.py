"""The compiled sweep behind ``precedence.covering_edges``: a vertical line moves over the sheet.

The toolpaths under the line stand in a treap, see ``slicer.treap``. A gap is named by the node below it.
"""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel, kernel
from slicer.treap import NONE, height, insert, remove

# What is known of the gap between a node and the next one above it.
OLD = 0  # the two have been neighbours since before this x
HEALED = 1  # what stood between them has ended at this x
FRESH = 2  # at least one of them begins at this x


@inner_kernel
def _cross(lines: NDArray[np.float64], low: int, high: int, eps: float) -> bool:
    """Whether ``low``, the lower of two slanted neighbours, rises above ``high`` or lies on it throughout."""
    left = max(lines[low, 0, 0], lines[high, 0, 0])
    right = min(lines[low, 1, 0], lines[high, 1, 0])
    at_left = height(lines, high, left) - height(lines, low, left)
    at_right = height(lines, high, right) - height(lines, low, right)
    return bool(at_left < -eps or at_right < -eps or (at_left <= eps and at_right <= eps))


@inner_kernel
def _uprights_clash(
    lines: NDArray[np.float64], low: int, high: int, uprights: NDArray[np.bool_], eps: float
) -> bool:
    """Whether two neighbours, at least one of them upright, share more than a point."""
    x = lines[low, 0, 0] if uprights[low] else lines[high, 0, 0]
    top = lines[low, 1, 1] if uprights[low] else height(lines, low, x)
    bottom = lines[high, 0, 1] if uprights[high] else height(lines, high, x)
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
            remove(c, left, right, parent, weight, below, above)
            gap[low] = HEALED
            implied[low] = True
            touched[count] = low
            count += 1
        begin = i
        while i < n and first[by_first[i]] == rank:
            c = by_first[i]
            i += 1
            if uprights[c]:
                insert(lines, c, uprights, (left, right), parent, weight, below, above)
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
                remove(by_first[k], left, right, parent, weight, below, above)
        for k in range(begin, i):
            c = by_first[k]
            if uprights[c]:
                continue
            insert(lines, c, uprights, (left, right), parent, weight, below, above)
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
