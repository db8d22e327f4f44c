"""What a travel costs that keeps above the skylines of down-sets."""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import bare_kernel
from slicer.sequence.problem import CostModel, direct_cost, leg_cost
from slicer.sequence.states import DownSets, Section, Skylines
from slicer.skyline import EPS_MM


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


@bare_kernel
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
            size, hit = _pass_over(sky.gap, sky.gap_start[c], sky.gap_start[c + 1], sky.hull, size, line)
            blocked |= hit
        i = printed[c]
        size, hit = _pass_over(sky.piece, sky.start[i], sky.start[i + 1], sky.hull, size, line)
        blocked |= hit
    if not blocked:
        return direct
    size = _push(sky.hull, size, bx, by)
    length, cost = 0.0, 0.0
    here_x, here_y = out_x, out_y
    for t in range(size + 1):
        q = t if onwards else size - 1 - t
        x, y = in_x, in_y
        if t < size:
            x, y = sky.hull[q, 0], sky.hull[q, 1] + cost_model.clearance
        step = np.sqrt((x - here_x) ** 2 + (y - here_y) ** 2)
        ends = np.sqrt((x - in_x) ** 2 + (y - in_y) ** 2) <= EPS_MM
        if t < size and (step <= EPS_MM or ends):
            continue
        length += step
        cost += leg_cost(cost_model, x - here_x, y - here_y)
        here_x, here_y = x, y
    if cost_model.fixed > 0.0 and length > cost_model.fixed_from:
        cost += cost_model.fixed
    return cost


@bare_kernel
def _pass_over(
    piece: NDArray[np.float64],
    first: int,
    last: int,
    hull: NDArray[np.float64],
    size: int,
    line: tuple[float, float, float, float],
) -> tuple[int, bool]:
    """Put the pieces strictly between ax and bx on the hull; its size, and whether the line is below one."""
    ax, ay, bx, slope = line
    blocked = False
    for q in range(first, last):
        xl, yl, xr, yr = piece[q, 0], piece[q, 1], piece[q, 2], piece[q, 3]
        if xr - xl <= EPS_MM:
            if ax + EPS_MM < xl < bx - EPS_MM:
                blocked |= yl > ay + slope * (xl - ax) + EPS_MM
                size = _push(hull, size, xl, yl)
            continue
        rise = (yr - yl) / (xr - xl)
        if xl < ax:
            xl, yl = ax, yl + rise * (ax - xl)
        if xr > bx:
            xr, yr = bx, yr + rise * (bx - xr)
        if xr - xl <= EPS_MM:
            continue
        blocked |= yl > ay + slope * (xl - ax) + EPS_MM or yr > ay + slope * (xr - ax) + EPS_MM
        size = _push(hull, size, xl, yl)
        size = _push(hull, size, xr, yr)
    return size, blocked


@bare_kernel
def _push(hull: NDArray[np.float64], size: int, x: float, y: float) -> int:
    """Add a point to the right end of an upper hull (Andrew's monotone chain); the new size."""
    while size > 0:
        if x - hull[size - 1, 0] <= EPS_MM:  # of one x, the higher counts
            if hull[size - 1, 1] >= y:
                return size
        elif size == 1:
            break
        else:
            turn = (hull[size - 1, 0] - hull[size - 2, 0]) * (y - hull[size - 2, 1]) - (
                hull[size - 1, 1] - hull[size - 2, 1]
            ) * (x - hull[size - 2, 0])
            if turn < 0:
                break
        size -= 1
    hull[size, 0], hull[size, 1] = x, y
    return size + 1
