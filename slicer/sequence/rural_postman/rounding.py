"""Tours from the solution in parts of a relaxation: whole travels, then larger parts before smaller ones.

Such a tour leaves long travels where the solution is in halves, which local search then puts right: it comes
to shorter ones than local search from any printable sequence, since that one is of another make.
"""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel, kernel
from slicer.sequence.rural_postman.relaxation import CHEAPER, Relaxation
from slicer.sequence.rural_postman.violated_sets import root_of

NONE = -1


def rounded(relaxed: Relaxation, noise: float, random: np.random.Generator) -> NDArray[np.int32] | None:
    """A path through all toolpaths, int32 (n,) oriented ones, as a solution in parts suggests it.

    Args:
        relaxed: solved, see ``Relaxation.raise_bound``.
        noise: parts of travels are raised by up to so much, at random; with 0 it is the same path every time.
        random: where from.

    Returns:
        None where the sequence may not begin at any end that is left over.
    """
    part = relaxed.part + noise * random.random(len(relaxed.part)) * (relaxed.part > CHEAPER)
    order = np.lexsort((relaxed.reduced, -np.round(part, 9)))
    out = np.empty(len(relaxed.points) // 2, np.int32)
    found = _join(relaxed.points, relaxed.begins, relaxed.travels[order], out)
    return out if found else None


@kernel
def _join(
    points: NDArray[np.float64],
    begins: NDArray[np.bool_],
    travels: NDArray[np.int64],
    out: NDArray[np.int32],
) -> bool:
    """Take travels in their order as long as they make no ring, then the shortest between what is left over.

    The last two ends, 2n and 2n + 1, are those of the toolpath of no length that makes a path a tour.
    """
    n2 = len(points)
    mate, root = np.empty(n2 + 2, np.int64), np.empty(n2 // 2 + 1, np.int64)
    for u in range(n2 + 2):
        mate[u] = NONE
    for s in range(len(root)):
        root[s] = s
    left = len(root)
    for k in range(len(travels)):
        u, v = travels[k, 0], travels[k, 1]
        if mate[u] == NONE and mate[v] == NONE and left > 1 and _link(mate, root, u, v):
            left -= 1
    loose = np.empty(n2 + 2, np.int64)
    while left > 1:
        count = 0
        for u in range(n2 + 2):
            if mate[u] == NONE:
                loose[count] = u
                count += 1
        least, a, b = np.inf, NONE, NONE
        for i in range(count):
            u = loose[i]
            for j in range(i + 1, count):
                v = loose[j]
                length = 0.0
                if v < n2:
                    dx, dy = points[u, 0] - points[v, 0], points[u, 1] - points[v, 1]
                    length = np.sqrt(dx * dx + dy * dy)
                elif v == n2 and not begins[u]:
                    continue
                if length < least and root_of(root, u >> 1) != root_of(root, v >> 1):
                    least, a, b = length, u, v
        if a == NONE or not _link(mate, root, a, b):
            return False
        left -= 1
    a = NONE
    for u in range(n2 + 2):  # two ends are left, which close the tour
        if mate[u] == NONE:
            if a == NONE:
                a = u
            else:
                mate[a], mate[u] = u, a
    at = mate[n2]
    if at >= n2 or not begins[at]:
        return False
    for k in range(n2 // 2):
        out[k] = at
        at = mate[at ^ 1]
    return True


@inner_kernel
def _link(mate: NDArray[np.int64], root: NDArray[np.int64], u: int, v: int) -> bool:
    """Join two ends by a travel, unless that makes a ring."""
    a, b = root_of(root, u >> 1), root_of(root, v >> 1)
    if a == b:
        return False
    mate[u], mate[v], root[a] = v, u, b
    return True
