"""What a travel costs that keeps above the skylines of down-sets."""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import bare_kernel, inner_kernel
from slicer.sequence.problem import CostModel, direct_cost, string_cost
from slicer.sequence.states import DownSets, Section, Skylines
from slicer.taut_string import EPS_MM, pass_over, push


def section_cost(section: Section, sets: DownSets, sky: Skylines, oriented: NDArray[np.int32]) -> float:
    """What a sequence (n,) of a section costs; all its down-sets must be among those of ``sets``."""
    printed = sets.start[:-1].copy()
    return _walk(section.segments, section.column, section.cost_model, sky, sets, printed, oriented)


@bare_kernel
def _walk(
    segments: NDArray[np.float64],
    column: NDArray[np.int32],
    cost_model: CostModel,
    sky: Skylines,
    sets: DownSets,
    printed: NDArray[np.int32],
    oriented: NDArray[np.int32],
) -> float:
    step_start, step_path, step_to = sets.step_start, sets.step_path, sets.step_to
    total = 0.0
    for k in range(len(oriented)):
        v = oriented[k]
        c = column[v >> 1]
        if k > 0:
            u = oriented[k - 1]
            out_x, out_y = segments[u >> 1, 1 - (u & 1), 0], segments[u >> 1, 1 - (u & 1), 1]
            in_x, in_y = segments[v >> 1, v & 1, 0], segments[v >> 1, v & 1, 1]
            if sky.routed:
                low, high = min(c, column[u >> 1]), max(c, column[u >> 1])
                total += routed_cost(cost_model, sky, printed, low, high, (out_x, out_y), (in_x, in_y))
            else:
                total += direct_cost(cost_model, in_x - out_x, in_y - out_y)
        for e in range(step_start[printed[c]], step_start[printed[c] + 1]):
            if step_path[e] == v >> 1:
                printed[c] = step_to[e]
                break
    return total


@inner_kernel
def routed_cost(
    cost_model: CostModel,
    sky: Skylines,
    printed: NDArray[np.int32],
    low_column: int,
    high_column: int,
    start: tuple[float, float],
    end: tuple[float, float],
) -> float:
    """Cost of the travel between two points of two columns, over the down-sets ``printed`` of the columns.

    It is straight unless that passes below a skyline strictly between the two; then it follows the taut
    string over it, lifted by the clearance (see ``slicer.travel``).
    """
    (out_x, out_y), (in_x, in_y) = start, end
    onwards = out_x <= in_x
    ax, ay, bx, by = (out_x, out_y, in_x, in_y) if onwards else (in_x, in_y, out_x, out_y)
    direct = direct_cost(cost_model, in_x - out_x, in_y - out_y)
    if bx - ax <= EPS_MM:
        return direct
    line = (ax, ay, bx, (by - ay) / (bx - ax))
    sky.hull[0, 0], sky.hull[0, 1] = ax, ay
    size, blocked = 1, False
    for c in range(low_column, high_column + 1):
        if c > low_column:
            size, hit = _pass_over_all(sky.gap, sky.gap_start[c], sky.gap_start[c + 1], sky.hull, size, line)
            blocked |= hit
        i = printed[c]
        size, hit = _pass_over_all(sky.piece, sky.start[i], sky.start[i + 1], sky.hull, size, line)
        blocked |= hit
    if not blocked:
        return direct
    size = push(sky.hull, size, bx, by)
    return string_cost(cost_model, sky.hull, size, onwards, start, end)


@inner_kernel
def _pass_over_all(
    piece: NDArray[np.float64],
    first: int,
    last: int,
    hull: NDArray[np.float64],
    size: int,
    line: tuple[float, float, float, float],
) -> tuple[int, bool]:
    """Put some pieces on the hull; see ``taut_string.pass_over``."""
    blocked = False
    for q in range(first, last):
        size, hit = pass_over(hull, size, piece, q, line)
        blocked |= hit
    return size, blocked
