"""What a sequence really costs: its travels as they are made over what is printed at that moment."""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel, kernel
from slicer.nozzle import NozzleBody
from slicer.sequence.problem.objective import CostModel, Objective
from slicer.sequence.problem.problem import Problem
from slicer.sequence.problem.travel_cost import direct_cost, direct_sum, leg_cost
from slicer.skyline import Skyline, lay, lay_to_leave, new_skyline, overpass, replace
from slicer.taut_string import EPS_MM

NO_ROOM = -1.0


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
    doublings = 0
    while True:
        cost = _routed_sum(problem.segments, problem.body, objective.cost_model, oriented, doublings)
        if cost != NO_ROOM:  # rather than 0 or more: a cost that is no number must end here too
            return cost
        doublings += 1


@kernel
def _routed_sum(
    segments: NDArray[np.float64],
    body: NozzleBody,
    cost_model: CostModel,
    oriented: NDArray[np.int32],
    doublings: int,
) -> float:
    """See ``true_cost``; ``NO_ROOM`` where the skyline needs more room."""
    return _sum_over(new_skyline(segments, body, doublings), segments, cost_model, oriented)


@inner_kernel
def _sum_over(
    sky: Skyline, segments: NDArray[np.float64], cost_model: CostModel, oriented: NDArray[np.int32]
) -> float:
    """See ``_routed_sum``. Where nothing is allocated, no references are counted, which takes as long."""
    point = sky.body.half_width == 0.0
    total = 0.0
    for k in range(1, len(oriented)):
        u, v = oriented[k - 1], oriented[k]
        start, end = segments[u >> 1, 1 - (u & 1)], segments[v >> 1, v & 1]
        if point:
            replace(sky.piece, sky.link, sky.place, segments[u >> 1])
        elif not lay_to_leave(sky, segments[u >> 1], 1 - (u & 1)):
            return NO_ROOM
        total += skyline_cost(sky.piece, sky.link, sky.place, sky.hull, start, end, cost_model)
        if not point and not lay(sky, segments[u >> 1]):
            return NO_ROOM
    return total


@inner_kernel
def skyline_cost(
    piece: NDArray[np.float64],
    link: NDArray[np.int32],
    place: NDArray[np.int64],
    hull: NDArray[np.float64],
    start: NDArray[np.float64],
    end: NDArray[np.float64],
    cost_model: CostModel,
) -> float:
    """Cost of one travel over a skyline; see ``overpass`` for the arguments."""
    size = overpass(piece, link, place, hull, start, end)
    if size == 0:
        return direct_cost(cost_model, end[0] - start[0], end[1] - start[1])
    return string_cost(cost_model, hull, size, True, (start[0], start[1]), (end[0], end[1]))


@inner_kernel
def string_cost(
    cost_model: CostModel,
    hull: NDArray[np.float64],
    size: int,
    onwards: bool,
    start: tuple[float, float],
    end: tuple[float, float],
) -> float:
    """Cost of a travel along a taut string of ``size`` points, lifted by the clearance.

    ``onwards`` says whether the string runs from ``start`` to ``end`` in ``hull``, or the other way round.
    """
    x, y = start
    length, cost = 0.0, 0.0
    for t in range(size + 1):
        to_x, to_y = end
        if t < size:
            q = t if onwards else size - 1 - t
            to_x, to_y = hull[q, 0], hull[q, 1] + cost_model.clearance
        step = np.sqrt((to_x - x) ** 2 + (to_y - y) ** 2)
        if step > EPS_MM:
            cost += leg_cost(cost_model, to_x - x, to_y - y)
            length += step
            x, y = to_x, to_y
    if cost_model.fixed > 0.0 and length > cost_model.fixed_from:
        cost += cost_model.fixed
    return cost
