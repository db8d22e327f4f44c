"""Take back cuts that later ones have made needless."""

import numpy as np
from numpy.typing import NDArray

from slicer.cutting.hindering import hinders
from slicer.kernels import inner_kernel, kernel
from slicer.nozzle import NozzleBody

NONE = -1


@kernel
def glue(
    body: NozzleBody, segments: NDArray[np.float64], owner: NDArray[np.int32], span: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Join parts that meet wherever what results can still be printed.

    Two parts can be one where nothing must be printed between them: where no chain of toolpaths that wait for
    one another leads from the one to the other.

    Args:
        segments: float64 (n, 2, 2), the whole toolpaths in mm.
        owner: int32 (m,), the toolpath of each part, in an order in which they can be printed.
        span: float64 (m, 2), from where to where, in parts of its length; changed to those of the result.

    Returns:
        bool (m,), which rows are left; these hold all.
    """
    m = len(owner)
    parts = np.empty((m, 2, 2))
    for k in range(m):
        for end in range(2):
            for axis in range(2):
                a, b = segments[owner[k], 0, axis], segments[owner[k], 1, axis]
                parts[k, end, axis] = a + span[k, end] * (b - a)
    above = np.zeros((m, m), np.bool_)  # [b, c]: b, printed, makes c unprintable
    for b in range(m):
        for c in range(m):
            above[b, c] = b != c and hinders(body, parts[b], parts[c])
    order = np.arange(m)
    place = np.arange(m)
    left = np.ones(m, np.bool_)
    reached = np.zeros(m, np.bool_)
    spare = np.empty(m, np.int64)
    glued = True
    while glued:
        glued = False
        for i in range(m):
            for j in range(m):
                if i == j or not left[i] or not left[j] or owner[i] != owner[j] or span[i, 1] != span[j, 0]:
                    continue
                early, late = (i, j) if place[i] < place[j] else (j, i)
                if not _between(above, left, order, place, early, late, reached):
                    _join(above, left, order, place, early, late, reached, spare)
                    span[early, 0], span[early, 1] = span[i, 0], span[j, 1]
                    glued = True
    return left


@inner_kernel
def _between(
    above: NDArray[np.bool_],
    left: NDArray[np.bool_],
    order: NDArray[np.int64],
    place: NDArray[np.int64],
    early: int,
    late: int,
    reached: NDArray[np.bool_],
) -> bool:
    """Whether something must be printed after ``early`` and before ``late``; ``reached`` tells what after."""
    for k in range(place[early] + 1, place[late]):
        x = order[k]
        reached[x] = False
        if not left[x]:
            continue
        reached[x] = above[x, early]
        for q in range(place[early] + 1, k):
            y = order[q]
            reached[x] |= reached[y] and above[x, y]
        if reached[x] and above[late, x]:
            return True
    return False


@inner_kernel
def _join(
    above: NDArray[np.bool_],
    left: NDArray[np.bool_],
    order: NDArray[np.int64],
    place: NDArray[np.int64],
    early: int,
    late: int,
    reached: NDArray[np.bool_],
    spare: NDArray[np.int64],
) -> None:
    """Let ``early`` be both, behind what ``late`` waits for and before what waits for it."""
    begin, end = place[early], place[late]
    size = 0
    for k in range(begin + 1, end):
        if not reached[order[k]]:
            spare[size] = order[k]
            size += 1
    spare[size], spare[size + 1] = early, late
    size += 2
    for k in range(begin + 1, end):
        if reached[order[k]]:
            spare[size] = order[k]
            size += 1
    for k in range(size):
        order[begin + k] = spare[k]
        place[spare[k]] = begin + k
    left[late] = False
    for c in range(len(left)):
        if c != early:
            above[early, c] |= above[late, c]
            above[c, early] |= above[c, late]
