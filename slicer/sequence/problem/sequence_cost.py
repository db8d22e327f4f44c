"""What a sequence really costs: its travels as they are made over what is printed at that moment."""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import kernel
from slicer.sequence.problem.objective import CostModel, Objective
from slicer.sequence.problem.problem import Problem
from slicer.sequence.problem.travel_cost import direct_sum, leg_cost
from slicer.skyline import EPS_MM, lay, new_skyline, overpass


def true_cost(problem: Problem, objective: Objective, oriented: NDArray[np.int32]) -> float:
    """The objective of a printable sequence of oriented toolpaths (n,), in mm or s.

    A travel goes straight unless that would pass below the skyline; else over the skyline, lifted by the
    clearance, and each of its legs counts from rest to rest.
    """
    if problem.n == 0:
        return 0.0
    if oriented.min() < 0 or oriented.max() >= 2 * problem.n:  # compiled code would read what is not there
        raise AssertionError(f"a sequence of {problem.n} toolpaths holds one that does not exist")
    if not objective.routed:
        return direct_sum(problem.segments, objective.cost_model, oriented)
    return _routed_sum(problem.segments, objective.cost_model, oriented)


@kernel
def _routed_sum(segments: NDArray[np.float64], cost_model: CostModel, oriented: NDArray[np.int32]) -> float:
    n = len(oriented)
    piece, link = new_skyline(n)
    hull = np.empty((4 * n + 8, 2))
    cursor, used = lay(piece, link, 0, 2, segments[oriented[0] >> 1])
    total = 0.0
    for k in range(1, n):
        u, v = oriented[k - 1], oriented[k]
        start, end = segments[u >> 1, 1 - (u & 1)], segments[v >> 1, v & 1]
        cost, cursor = skyline_cost(piece, link, cursor, start, end, hull, cost_model)
        total += cost
        cursor, used = lay(piece, link, cursor, used, segments[v >> 1])
    return total


@kernel
def skyline_cost(
    piece: NDArray[np.float64],
    link: NDArray[np.int32],
    cursor: int,
    start: NDArray[np.float64],
    end: NDArray[np.float64],
    hull: NDArray[np.float64],
    cost_model: CostModel,
) -> tuple[float, int]:
    """Cost of one travel over a skyline, and a cursor near its end; see ``overpass`` for the arguments."""
    size, cursor = overpass(piece, link, cursor, start, end, hull)
    x, y = start[0], start[1]
    total = 0.0
    length = 0.0
    for t in range(size + 1):
        to_x = hull[t, 0] if t < size else end[0]
        to_y = hull[t, 1] + cost_model.clearance if t < size else end[1]
        step = np.hypot(to_x - x, to_y - y)
        if step > EPS_MM:
            total += leg_cost(cost_model, to_x - x, to_y - y)
            length += step
            x, y = to_x, to_y
    if cost_model.fixed > 0.0 and length > cost_model.fixed_from:
        total += cost_model.fixed
    return total, cursor
