"""Tour merging: cross several sequences wherever they have printed the same, and keep the best sections.

What is printed after p toolpaths is all that the rest of a sequence depends on. Where two sequences have
printed the same set, either may go on as the other does, at the price of the one travel from the last
toolpath of the one to the next of the other. A dynamic programme over (position, sequence followed) finds
the best of all such crossings, O(n·k²) for k sequences of n toolpaths. It is exact for travels over the
skyline as well, since that too depends on nothing but the set.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import kernel
from slicer.nozzle import NozzleBody
from slicer.sequence.problem import (
    FORBIDDEN,
    CostModel,
    Objective,
    Problem,
    arc_cost,
    scrambled,
    skyline_cost,
    start_of,
)
from slicer.skyline import lay, lay_to_leave, new_skyline


def merge_tours(
    problem: Problem, objective: Objective, tours: Sequence[NDArray[np.int32]]
) -> NDArray[np.int32]:
    """The cheapest sequence whose every step is one of the given ones'; it costs no more than any of them.

    Args:
        problem: what is ordered.
        objective: what counts; its true cost, travels over the skyline included.
        tours: printable sequences, each int32 (n,) of oriented toolpaths.

    Returns:
        int32 (n,), oriented toolpaths.
    """
    every: NDArray[np.int32] = np.stack(list(tours)).astype(np.int32)
    if len(every) == 1 or problem.n < 2:
        first: NDArray[np.int32] = every[0]
        return first
    printed = prefix_hashes(every)
    cost_model = objective.cost_model
    start = start_of(problem)
    if objective.routed:
        doublings = 0
        while True:
            links = _routed_links(
                problem.segments, problem.body, cost_model, start, every, printed, doublings
            )
            if len(links):
                break
            doublings += 1
    else:
        links = _direct_links(problem.segments, cost_model, start, every, printed)
    return _cross(every, printed, links)


@kernel
def prefix_hashes(tours: NDArray[np.int32]) -> NDArray[np.uint64]:
    """uint64 (k, n): for each sequence a hash of the set of toolpaths before each position."""
    k, n = tours.shape
    out = np.zeros((k, n), np.uint64)
    for t in range(k):
        for p in range(1, n):
            out[t, p] = out[t, p - 1] ^ scrambled((tours[t, p - 1] >> 1) + 1)
    return out


@kernel
def _direct_links(
    segments: NDArray[np.float64],
    cost_model: CostModel,
    start: int,
    tours: NDArray[np.int32],
    printed: NDArray[np.uint64],
) -> NDArray[np.float64]:
    """float64 (k, k, n): the cost of going from sequence s into position p of sequence t; infinite if barred.

    ``start`` stands before the first toolpath, see ``arc_cost``.
    """
    k, n = tours.shape
    points = segments.reshape(-1, 2)
    out = np.full((k, k, n), np.inf)
    for s in range(k):
        for p in range(n):
            u = start if p == 0 else tours[s, p - 1]
            for t in range(k):
                if printed[s, p] == printed[t, p]:
                    out[s, t, p] = arc_cost(points, cost_model, u, tours[t, p])
    return out


@kernel
def _routed_links(
    segments: NDArray[np.float64],
    body: NozzleBody,
    cost_model: CostModel,
    start: int,
    tours: NDArray[np.int32],
    printed: NDArray[np.uint64],
    doublings: int,
) -> NDArray[np.float64]:
    """As ``_direct_links``, but over the skyline of what is printed; empty where that needs more room."""
    k, n = tours.shape
    out = np.full((k, k, n), np.inf)
    for s in range(k):
        sky = new_skyline(segments, body, doublings)
        for p in range(n):
            if p > 0:
                u = tours[s, p - 1]
                if not lay_to_leave(sky, segments[u >> 1], 1 - (u & 1)):
                    return out[:0]
            for t in range(k):
                v = tours[t, p]
                if printed[s, p] != printed[t, p]:
                    continue
                if p == 0:
                    out[s, t, p] = 0.0 if start == -1 or (v & 1) == -2 - start else FORBIDDEN
                    continue
                u = tours[s, p - 1]
                begin, end = segments[u >> 1, 1 - (u & 1)], segments[v >> 1, v & 1]
                out[s, t, p] = skyline_cost(sky.piece, sky.link, sky.place, sky.hull, begin, end, cost_model)
            if p > 0 and body.half_width > 0.0 and not lay(sky, segments[tours[s, p - 1] >> 1]):
                return out[:0]
    return out


@kernel
def _cross(
    tours: NDArray[np.int32], printed: NDArray[np.uint64], links: NDArray[np.float64]
) -> NDArray[np.int32]:
    """Follow the cheapest way through ``links``, see ``_direct_links``; change sequence for gain alone."""
    k, n = tours.shape
    came_from = np.zeros((k, n), np.int32)
    cost = links[0, :, 0].copy()
    now = np.empty(k)
    for p in range(1, n):
        for t in range(k):
            came_from[t, p] = t  # what stays on its sequence needs no reason
            now[t] = cost[t] + links[t, t, p]
            for s in range(k):
                if cost[s] + links[s, t, p] < now[t]:
                    now[t] = cost[s] + links[s, t, p]
                    came_from[t, p] = s
        cost[:] = now
    out = np.empty(n, np.int32)
    t = int(np.argmin(cost))
    for p in range(n - 1, -1, -1):
        out[p] = tours[t, p]
        t = came_from[t, p]
    return out
