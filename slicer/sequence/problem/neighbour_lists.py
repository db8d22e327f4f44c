"""The nearest toolpaths that can be printed directly after, or before, each oriented toolpath."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.errors import SequenceError
from slicer.kernels import inner_kernel, kernel
from slicer.sequence.problem.comparability import realizer
from slicer.sequence.problem.objective import Objective
from slicer.sequence.problem.problem import Problem
from slicer.sequence.problem.travel_cost import direct_cost

COUNT = 10
NONE = -1
DEAREST = 3e5
"""What a travel may cost, mm or s. Local search takes a gain above ``LEAST_GAIN`` for real, and would go on
for ever where rounding alone feigns such gains.
"""


@dataclass(frozen=True, eq=False)
class Neighbours:
    """Candidate lists, nearest first, filled up with ``NONE``; empty where u may not be printed so.

    Attributes:
        after: int32 (2n, k), oriented toolpaths that can directly follow oriented toolpath u.
        before: int32 (2n, k), those that u can directly follow.
    """

    after: NDArray[np.int32]
    before: NDArray[np.int32]


def neighbours(problem: Problem, objective: Objective | None = None, count: int = COUNT) -> Neighbours:
    """Find ``count`` neighbours both ways, sparsely: a grid over the endpoints, O(n) for usual sheets.

    A toolpath can directly follow u unless it must be printed before u, or lies above it with another one in
    between, and only in directions that it may be printed in. (What a nozzle's body forbids by way of several
    toolpaths is not seen: whoever makes a move looks at the precedence.) For machines whose axes differ in
    speed, "near" is measured by what a travel of about the distance between toolpaths costs along each axis.

    Raises:
        SequenceError: a travel across the sheet costs more than ``DEAREST``.
    """
    points = problem.segments.reshape(-1, 2)
    near = points.copy()
    if len(points):
        extent, hop = np.ptp(points, axis=0), pitch(problem)
        cost_model = (objective or Objective()).cost_model
        across = direct_cost(cost_model, *extent)
        if not across <= DEAREST:
            raise SequenceError(
                f"a travel across this sheet of {extent[0]:g} x {extent[1]:g} mm costs {across:g} "
                f"{'s' if cost_model.timed else 'mm'}, but must not cost more than {DEAREST:g}. Look at the "
                "speeds, accelerations and fixed time of the machine, and at the units of the sheet."
            )
        near *= [direct_cost(cost_model, hop, 0.0) / hop, direct_cost(cost_model, 0.0, hop) / hop]
    order = Order(realizer(problem), problem.planar, problem.succ_start, problem.succ)
    if not len(near):
        none = np.empty((0, count), np.int32)
        return Neighbours(none, none)
    cells = _cells(near)
    after = _nearest(near, cells, problem.allowed, order, count, False)
    before = _nearest(near, cells, problem.allowed, order, count, True)
    return Neighbours(after, before)


def pitch(problem: Problem) -> float:
    """About how far an end is from the next one, in mm: the side of its share of the sheet."""
    points = problem.segments.reshape(-1, 2)
    extent = np.ptp(points, axis=0)
    return float(np.sqrt(max(extent.prod(), extent.max() ** 2 * 1e-3, 1e-12) / len(points)))


class Order(NamedTuple):
    """What says whether a toolpath can directly follow another.

    Attributes:
        ranks: int32 (n, 2), see ``realizer``.
        planar: whether the precedence is that of "is below" alone.
        succ_start, succ: see ``Problem``.
    """

    ranks: NDArray[np.int32]
    planar: bool
    succ_start: NDArray[np.int32]
    succ: NDArray[np.int32]


class Cells(NamedTuple):
    """Points by the square cell of a grid that they lie in, about as many cells as points.

    Attributes:
        lower: float64 (2,), the corner of the first cell.
        size: the side of a cell.
        shape: int64 (2,), how many there are along x and y.
        place: int64 (m, 2), the cell of each point.
        start: int64 (cells + 1,), where the points of each cell begin in ``held``, column by column.
        held: int32 (m,), the points.
    """

    lower: NDArray[np.float64]
    size: float
    shape: NDArray[np.int64]
    place: NDArray[np.int64]
    start: NDArray[np.int64]
    held: NDArray[np.int32]


def _cells(points: NDArray[np.float64]) -> Cells:
    lower, extent = points.min(axis=0), np.ptp(points, axis=0)
    side = np.sqrt(2.0 * extent.prod() / len(points))
    size = max(float(side), float(extent.max()) / (len(points) + 1.0), 1e-12)
    shape = (extent / size).astype(np.int64) + 1
    place = ((points - lower) / size).astype(np.int64)
    number = place[:, 0] * shape[1] + place[:, 1]
    start = np.concatenate([[0], np.cumsum(np.bincount(number, minlength=int(shape.prod())))])
    return Cells(lower, size, shape, place, start, np.argsort(number, kind="stable").astype(np.int32))


@kernel
def _nearest(
    points: NDArray[np.float64],
    cells: Cells,
    allowed: NDArray[np.bool_],
    order: Order,
    count: int,
    backward: bool,
) -> NDArray[np.int32]:
    m = len(points)
    out = np.full((m, count), NONE, np.int32)
    cell, start, held = cells.size, cells.start, cells.held
    columns, rows = cells.shape
    ranks, planar, succ_start, succ = order
    distance = np.empty(count)
    for u in range(m):
        if not allowed[u >> 1, u & 1]:
            continue
        # The search is for entries near the end of u; backward, for ends near its entry.
        near = u if backward else u ^ 1
        x, y = points[near]
        cx, cy = cells.place[near]
        found, seen = 0, 0
        for ring in range(max(columns, rows)):
            # No point of this ring is nearer than (ring - 1) cells. In a long chain hardly anything can
            # follow: what is looked at is bounded.
            if (found == count and (ring - 1) * cell > distance[count - 1]) or seen > 60 * count:
                break
            for gx in range(max(0, cx - ring), min(columns, cx + ring + 1)):
                step = 1 if abs(gx - cx) == ring else max(1, 2 * ring)
                gy = cy - ring
                while gy <= cy + ring:
                    if 0 <= gy < rows:
                        for k in range(start[gx * rows + gy], start[gx * rows + gy + 1]):
                            p = held[k]
                            seen += 1
                            d = np.sqrt((points[p, 0] - x) ** 2 + (points[p, 1] - y) ** 2)
                            if found == count and d >= distance[count - 1]:
                                continue
                            v = p ^ 1 if backward else p
                            if not allowed[v >> 1, v & 1]:
                                continue
                            low, high = (v >> 1, u >> 1) if backward else (u >> 1, v >> 1)
                            if not _can_follow(ranks, succ_start, succ, low, high):
                                continue
                            if not planar and _is_before(succ_start, succ, high, low):
                                continue
                            if found < count:
                                found += 1
                            at = found - 1
                            while at > 0 and distance[at - 1] > d:
                                distance[at], out[u, at] = distance[at - 1], out[u, at - 1]
                                at -= 1
                            distance[at], out[u, at] = d, v
                    gy += step
    return out


@inner_kernel
def _can_follow(
    ranks: NDArray[np.int32],
    succ_start: NDArray[np.int32],
    succ: NDArray[np.int32],
    s: int,
    t: int,
) -> bool:
    """Whether some printable sequence has toolpath ``t`` directly after ``s``."""
    if s == t:
        return False
    if (ranks[s, 0] < ranks[t, 0]) != (ranks[s, 1] < ranks[t, 1]):
        return True
    if ranks[t, 0] < ranks[s, 0]:
        return False
    return _is_before(succ_start, succ, s, t)


@inner_kernel
def _is_before(succ_start: NDArray[np.int32], succ: NDArray[np.int32], s: int, t: int) -> bool:
    """Whether a row of the precedence says that toolpath ``s`` is printed before ``t``."""
    found = False
    for k in range(succ_start[s], succ_start[s + 1]):
        found |= succ[k] == t
    return found
