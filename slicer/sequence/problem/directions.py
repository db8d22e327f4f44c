"""The best allowed directions for a given order: a dynamic programme over two states, O(n)."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slicer.errors import SequenceError
from slicer.kernels import kernel
from slicer.sequence.problem.objective import CostModel, Objective
from slicer.sequence.problem.problem import Problem
from slicer.sequence.problem.travel_cost import arc_cost

FREE_START = -1
"""Stands before the first toolpath where its direction is free; ``FREE_START - 1 - f`` where it is f."""


def start_of(problem: Problem) -> int:
    """What stands before the first toolpath of a sequence, for ``arc_cost``."""
    return FREE_START if problem.first_flipped is None else FREE_START - 1 - int(problem.first_flipped)


def directed(problem: Problem, order: ArrayLike, objective: Objective | None = None) -> NDArray[np.int32]:
    """Orient each toolpath of an order as it may be, so that the direct travels between them cost the least.

    Args:
        problem: the toolpaths, their allowed directions, and that of the first where it is fixed.
        order: int (n,), the toolpath that is printed k-th.
        objective: what a travel costs; its length where None is given.

    Returns:
        int32 (n,), the sequence of oriented toolpaths.

    Raises:
        SequenceError: the order begins with a toolpath that may not be printed as the first must be.
    """
    sequence = np.asarray(order, np.int32)
    if problem.n and not problem.allowed[sequence[0], _possible(problem)].any():
        raise SequenceError(
            f"an order that begins with toolpath {sequence[0]} cannot be printed: first_flipped is "
            f"{problem.first_flipped}, and from that end the toolpath runs down more steeply than it may"
        )
    cost_model = (objective or Objective()).cost_model
    points = problem.segments.reshape(-1, 2)
    return _direct(points, cost_model, problem.allowed, start_of(problem), sequence)


def _possible(problem: Problem) -> list[int]:
    """The directions that the first toolpath of all may have, whichever it is."""
    return [0, 1] if problem.first_flipped is None else [int(problem.first_flipped)]


@kernel
def _direct(
    points: NDArray[np.float64],
    cost_model: CostModel,
    allowed: NDArray[np.bool_],
    start: int,
    order: NDArray[np.int32],
) -> NDArray[np.int32]:
    n = len(order)
    oriented = np.empty(n, np.int32)
    if n == 0:
        return oriented
    came_from = np.zeros((n, 2), np.int8)
    cost = np.empty(2)
    for f in range(2):
        cost[f] = arc_cost(points, cost_model, start, 2 * order[0] + f) if allowed[order[0], f] else np.inf
    for k in range(1, n):
        now = np.empty(2)
        for f in range(2):
            straight = cost[0] + arc_cost(points, cost_model, 2 * order[k - 1], 2 * order[k] + f)
            flipped = cost[1] + arc_cost(points, cost_model, 2 * order[k - 1] + 1, 2 * order[k] + f)
            came_from[k, f] = flipped < straight
            now[f] = min(straight, flipped) if allowed[order[k], f] else np.inf
        cost = now
    f = 1 if cost[1] < cost[0] else 0
    for k in range(n - 1, -1, -1):
        oriented[k] = 2 * order[k] + f
        f = came_from[k, f]
    return oriented
