"""Whether one toolpath lies below another, in constant time: two linear orders whose intersection it is.

The covering relation of "is below", with a source under and a sink over everything, is drawn in the plane
without crossings. Such a relation has dimension two (Baker, Fishburn and Roberts, "Partial orders of
dimension 2", Networks 2, 1972): a lies below b exactly where a comes before b in both the leftmost and the
rightmost topological order (Kameda, "On the vector representation of the reachability in planar directed
graphs", Inf. Process. Lett. 3, 1975).
"""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import kernel
from slicer.sequence.problem.problem import Problem, compressed


def realizer(problem: Problem) -> NDArray[np.int32]:
    """Ranks of the toolpaths in the leftmost and in the rightmost topological order, O(n log n).

    Returns:
        int32 (n, 2); a lies below b exactly where both ranks of a are below those of b. What a nozzle's body
        forbids besides is not among it.
    """
    n = problem.n
    # Toolpaths just above one another's ground share no open range of x: their middles order them.
    middle = problem.segments[:, :, 0].mean(axis=1)
    below = problem.below  # a nozzle's body adds to the precedence what is not planar
    succ_start, succ = compressed(below[:, 0], below[:, 1], n)
    rows = np.repeat(np.arange(n), np.diff(succ_start))
    succ = succ[np.lexsort((middle[succ], rows))]
    minimal = np.flatnonzero(np.bincount(below[:, 1], minlength=n) == 0)
    lowest: NDArray[np.int32] = minimal[np.argsort(middle[minimal], kind="stable")].astype(np.int32)
    ranks = np.empty((n, 2), np.int32)
    ranks[:, 0] = _reversed_postorder(succ_start, succ, lowest, True)
    ranks[:, 1] = _reversed_postorder(succ_start, succ, lowest, False)
    return ranks


@kernel
def _reversed_postorder(
    succ_start: NDArray[np.int32], succ: NDArray[np.int32], lowest: NDArray[np.int32], right_first: bool
) -> NDArray[np.int32]:
    """Rank by depth-first search: what is entered last on the way up is ranked first among equals."""
    n = len(succ_start) - 1
    rank = np.full(n, -1, np.int32)
    seen = np.zeros(n, np.bool_)
    visited = np.zeros(n, np.int32)  # how many successors have been entered
    stack = np.empty(n, np.int32)
    left = n
    for t in range(len(lowest)):
        root = lowest[len(lowest) - 1 - t] if right_first else lowest[t]
        depth = 1
        stack[0] = root
        seen[root] = True
        while depth > 0:
            s = stack[depth - 1]
            degree = succ_start[s + 1] - succ_start[s]
            if visited[s] == degree:
                left -= 1
                rank[s] = left
                depth -= 1
                continue
            k = degree - 1 - visited[s] if right_first else visited[s]
            visited[s] += 1
            above = succ[succ_start[s] + k]
            if not seen[above]:
                seen[above] = True
                stack[depth] = above
                depth += 1
    return rank
