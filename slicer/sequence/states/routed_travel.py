"""What a travel costs that keeps above the skylines of down-sets."""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import bare_kernel, inner_kernel
from slicer.nozzle import EPS_MM as PRESS_EPS_MM
from slicer.reach import highest, reach
from slicer.sequence.problem import CostModel, direct_cost, string_cost
from slicer.sequence.states.column_skylines import Skylines
from slicer.sequence.states.downsets import DownSets
from slicer.sequence.states.section import Section
from slicer.taut_string import EPS_MM, HAIR_MM, pass_over, push

FREE = -1.0
"""Stands for the cost of a travel that nothing is in the way of."""


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
            cost = FREE
            if sky.routed:
                cost = cost_over(
                    cost_model,
                    sky,
                    printed,
                    (column[u >> 1], c),
                    (u >> 1, segments[u >> 1]),
                    (out_x, out_y),
                    (in_x, in_y),
                )
            if cost == FREE:
                cost = direct_cost(cost_model, in_x - out_x, in_y - out_y)
            total += cost
        for e in range(step_start[printed[c]], step_start[printed[c] + 1]):
            if step_path[e] == v >> 1:
                printed[c] = step_to[e]
                break
    return total


@inner_kernel
def cost_over(
    cost_model: CostModel,
    sky: Skylines,
    printed: NDArray[np.int32],
    columns: tuple[int, int],
    leaving: tuple[int, NDArray[np.float64]],
    start: tuple[float, float],
    end: tuple[float, float],
) -> float:
    """Cost of the travel from a toolpath in one of two columns to the other, where it has to go over what is
    printed, the down-sets ``printed``; ``FREE`` where it is straight.

    ``leaving`` is the toolpath that the travel leaves, which was printed last. The travel is straight unless
    that passes below a skyline strictly between the two; then it follows the taut string over it, lifted by
    the clearance (see ``slicer.travel``).
    """
    (out_x, out_y), (in_x, in_y) = start, end
    onwards = out_x <= in_x
    ax, ay, bx, by = (out_x, out_y, in_x, in_y) if onwards else (in_x, in_y, out_x, out_y)
    if bx - ax <= EPS_MM:
        return FREE
    line = (ax, ay, bx, (by - ay) / (bx - ax))
    if sky.body.half_width > 0.0:
        count = _gather(sky, printed, columns, leaving, start, line)
        if count == 0:
            return FREE
        size = string_over(sky.over, count, sky.hull, line)
        return string_cost(cost_model, sky.hull, size, onwards, start, end)
    low_column, high_column = min(columns[0], columns[1]), max(columns[0], columns[1])
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
        return FREE
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


@inner_kernel
def _gather(
    sky: Skylines,
    printed: NDArray[np.int32],
    columns: tuple[int, int],
    leaving: tuple[int, NDArray[np.float64]],
    start: tuple[float, float],
    line: tuple[float, float, float, float],
) -> int:
    """Gather in ``sky.over`` what stands above a straight travel of a nozzle with a body; how many points.

    The toolpath that is left counts as it does in ``skyline.lay_to_leave``: it is taken out of the down-set
    of its column, which is that before it was printed, and stands by itself.
    """
    path, count = leaving[0], 0
    low, high = min(columns[0], columns[1]), max(columns[0], columns[1])
    for c in range(sky.reaching[low, 0], sky.reaching[high, 1] + 1):
        i = printed[c]
        if c == columns[0]:
            for e in range(sky.steps.start[i], sky.steps.start[i + 1]):
                if sky.steps.path[e] == path:
                    i = sky.steps.origin[e]
                    break
        count = pieces_above(sky.over, count, sky.piece, sky.start[i], sky.start[i + 1], line)
    count = pieces_above(sky.over, count, sky.gap, 0, len(sky.gap), line)
    return leaving_above(sky, count, leaving, start, line)


@inner_kernel
def leaving_above(
    sky: Skylines,
    count: int,
    leaving: tuple[int, NDArray[np.float64]],
    start: tuple[float, float],
    line: tuple[float, float, float, float],
) -> int:
    """Add what stands above a travel of the toolpath that it leaves; see ``_gather``."""
    path, segment = leaving
    lines = sky.lines
    if sky.reached[0] != path:  # travels are mostly priced one after the other from the same toolpath
        sky.reached[0], sky.reached[1] = path, reach(sky.body, sky.floor, segment, lines)
    known = sky.reached[1]
    rise = max(0.0, highest(lines, known, start[0]) - start[1])
    for k in range(known):
        count = _above(sky.over, count, (lines[k, 0], lines[k, 1], lines[k, 2], lines[k, 3]), rise, line)
    a = 0 if segment[0, 0] <= segment[1, 0] else 1
    own = (segment[a, 0], segment[a, 1], segment[1 - a, 0], segment[1 - a, 1])
    if own[2] - own[0] <= EPS_MM:
        top = max(own[1], own[3])
        own = (own[0], top, own[0], top)
    return _above(sky.over, count, own, PRESS_EPS_MM, line)


@inner_kernel
def pieces_above(
    over: NDArray[np.float64],
    count: int,
    piece: NDArray[np.float64],
    first: int,
    last: int,
    line: tuple[float, float, float, float],
) -> int:
    """Add what stands above a travel of the pieces first .. last - 1 of a skyline, see ``_above``."""
    beyond = last
    while first < beyond:  # the first piece that does not end before the travel begins
        middle = (first + beyond) // 2
        if piece[middle, 2] < line[0]:
            first = middle + 1
        else:
            beyond = middle
    while first < last and piece[first, 0] < line[2]:
        q = first
        count = _above(over, count, (piece[q, 0], piece[q, 1], piece[q, 2], piece[q, 3]), 0.0, line)
        first += 1
    return count


@inner_kernel
def _above(
    over: NDArray[np.float64],
    count: int,
    piece: tuple[float, float, float, float],
    lowered: float,
    line: tuple[float, float, float, float],
) -> int:
    """Add the ends of a piece, lowered, as far as it lies strictly between the ends of a travel and an end
    stands above it; see ``taut_string.pass_over``."""
    ax, ay, bx, slope = line
    xl, yl, xr, yr = piece[0], piece[1] - lowered, piece[2], piece[3] - lowered
    if xr - xl <= EPS_MM:
        if not ax + EPS_MM < xl < bx - EPS_MM:
            return count
    else:
        rise = (yr - yl) / (xr - xl)
        if xl < ax:
            xl, yl = ax, yl + rise * (ax - xl)
        if xr > bx:
            xr, yr = bx, yr + rise * (bx - xr)
        if xr - xl <= EPS_MM:
            return count
    for x, y in ((xl, yl), (xr, yr)):
        if y > ay + slope * (x - ax) + EPS_MM:
            over[count, 0], over[count, 1] = x, y
            count += 1
    return count


@inner_kernel
def string_over(
    over: NDArray[np.float64],
    count: int,
    hull: NDArray[np.float64],
    line: tuple[float, float, float, float],
) -> int:
    """The taut string over points in any order, from the left end of a travel to its right; how many points.

    It goes on along the steepest way each time (Jarvis, "On the identification of the convex hull of a finite
    set of points in the plane", Information Processing Letters 2, 1973): few points hold a string up.
    """
    ax, ay, bx, slope = line
    end_y = ay + slope * (bx - ax)
    x, y = ax, ay
    for q in range(count):
        if over[q, 0] <= ax + EPS_MM:
            y = max(y, over[q, 1])
        if over[q, 0] >= bx - EPS_MM:
            end_y = max(end_y, over[q, 1])
    hull[0, 0], hull[0, 1] = x, y
    size = 1
    while x < bx - EPS_MM:
        best, to_x, to_y = (end_y - y) / (bx - x), bx, end_y
        for q in range(count):
            if x + EPS_MM < over[q, 0] < bx - EPS_MM:
                # Of points in line it goes to the last, as ``taut_string.push`` does.
                higher = over[q, 1] - y - best * (over[q, 0] - x)
                beyond = (over[q, 0] - x) / (to_x - x)
                if higher > (-HAIR_MM * beyond if beyond > 1.0 else HAIR_MM):
                    best, to_x, to_y = (over[q, 1] - y) / (over[q, 0] - x), over[q, 0], over[q, 1]
        x, y = to_x, to_y
        hull[size, 0], hull[size, 1] = x, y
        size += 1
    return size
