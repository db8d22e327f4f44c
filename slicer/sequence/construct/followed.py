"""A sequence that follows another one as far as precedence lets it."""

import heapq

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slicer.sequence.problem import Problem


def followed(problem: Problem, rank: ArrayLike, flipped: ArrayLike) -> NDArray[np.int32] | None:
    """The sequence in which the printable toolpath of the lowest rank always comes next.

    Of a rank that is itself printable this is the sequence by rank.

    Args:
        problem: what is ordered; its start and its directions hold before all others.
        rank: float (n,), when each toolpath should come.
        flipped: bool (n,), the direction that each should have.

    Returns:
        int32 (n,), oriented toolpaths; None where that start cannot be had this way.
    """
    wanted = np.array(rank, dtype=np.float64)
    direction = np.array(flipped, dtype=np.bool_)
    direction ^= ~problem.allowed[np.arange(problem.n), direction.astype(np.intp)]
    if problem.first is not None:
        wanted[problem.first] = -np.inf
    waits = np.diff(problem.pred_start)
    ready = [(wanted[s], s) for s in np.flatnonzero(waits == 0).tolist()]
    heapq.heapify(ready)
    order: list[int] = []
    while ready:
        _, s = heapq.heappop(ready)
        order.append(s)
        for t in problem.succ[problem.succ_start[s] : problem.succ_start[s + 1]].tolist():
            waits[t] -= 1
            if waits[t] == 0:
                heapq.heappush(ready, (wanted[t], t))
    sequence = np.array(order, dtype=np.int64)
    if problem.n and problem.first_flipped is not None:
        direction[sequence[0]] = problem.first_flipped
    if problem.refusal(sequence, direction[sequence]) is not None:
        return None
    return (2 * sequence + direction[sequence]).astype(np.int32)
