"""The skyline over each down-set of a column, and what a travel over such skylines costs.

Where a travel has to go depends on what is printed: on the down-set of each column that it passes. So the
skylines are made once for all down-sets, and a search that knows the down-sets knows every travel.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import bare_kernel
from slicer.sequence.blocks import Blocks
from slicer.sequence.cost import direct_cost, leg_cost
from slicer.sequence.downsets import DownSets
from slicer.sequence.section import Section
from slicer.skyline import EPS_MM

MOST_PIECES = 64
"""Room for pieces of a skyline at first; it doubles as needed."""


class Skylines(NamedTuple):
    """Skylines as pieces [x left, y left, x right, y right] from left to right; uprights have no width.

    Attributes:
        routed: whether travels keep above what is printed; if not, the rest is empty.
        start: int32 (d + 1,), the pieces of each down-set.
        piece: float64 (p, 4), in mm.
        top: float64 (d,), the greatest height of each down-set's skyline.
        gap_start: int32 (c + 1,), the pieces of what stands between column c - 1 and column c for good.
        gap: float64 (q, 4), in mm.
        hull: float64 (h, 2), scratch for the points of a taut string.
    """

    routed: bool
    start: NDArray[np.int32]
    piece: NDArray[np.float64]
    top: NDArray[np.float64]
    gap_start: NDArray[np.int32]
    gap: NDArray[np.float64]
    hull: NDArray[np.float64]


def skylines(section: Section, sets: DownSets) -> Skylines:
    """The skylines of all down-sets of a section, over what was printed before it."""
    if not section.routed:
        empty = np.empty((0, 4))
        none = np.zeros(1, np.int32)
        return Skylines(False, none, empty, np.empty(0), none, empty, np.empty((0, 2)))
    columns = section.columns
    base, gap_start, gap = _ground(section)
    base_start = np.concatenate([[0], np.cumsum([len(b) for b in base])]).astype(np.int32)
    ground = np.concatenate([*base, np.empty((0, 4))])
    count = int(sets.start[columns])
    start = np.zeros(count + 1, np.int32)
    top = np.full(count, -np.inf)
    room = MOST_PIECES * count + len(ground)
    while True:
        piece = np.empty((room, 4))
        if _raise(
            section.segments,
            sets.start,
            sets.step_start,
            sets.step_path,
            sets.step_to,
            base_start,
            ground,
            np.full(count, -1, np.int32),
            np.full(count, -1, np.int32),
            start,
            piece,
            top,
        ):
            break
        room *= 2
    widest = int(np.diff(start).max()) if count else 0
    return Skylines(
        True,
        start,
        piece[: start[-1]].copy(),
        top,
        gap_start,
        gap,
        np.empty((2 * (widest * columns + len(gap)) + 8, 2)),
    )


def _ground(section: Section) -> tuple[list[NDArray[np.float64]], NDArray[np.int32], NDArray[np.float64]]:
    """Split what was printed before: the pieces in each column, and those in the gaps before each."""
    columns = section.columns
    middle = 0.5 * (section.ground[:, 0] + section.ground[:, 2])
    left, right = section.extent.T
    after = np.searchsorted(left, middle, side="right")  # columns that begin left of the piece
    inside = (after > 0) & (middle <= right[np.maximum(after - 1, 0)])
    base = [section.ground[inside & (after == c + 1)] for c in range(columns)]
    gaps = [section.ground[~inside & (after == c)] for c in range(columns)]
    gap_start = np.concatenate([[0], np.cumsum([len(g) for g in gaps])]).astype(np.int32)
    return base, gap_start, np.concatenate([*gaps, np.empty((0, 4))])


@bare_kernel
def _raise(
    segments: NDArray[np.float64],
    set_start: NDArray[np.int32],
    step_start: NDArray[np.int32],
    step_path: NDArray[np.int32],
    step_to: NDArray[np.int32],
    base_start: NDArray[np.int32],
    ground: NDArray[np.float64],
    parent: NDArray[np.int32],
    printed: NDArray[np.int32],
    start: NDArray[np.int32],
    piece: NDArray[np.float64],
    top: NDArray[np.float64],
) -> bool:
    """Fill in all skylines, each from that of a smaller down-set; False where the room is too small.

    A printed toolpath has nothing above it, so that it replaces the skyline over its x-range.
    """
    size = 0
    for c in range(len(set_start) - 1):
        for i in range(set_start[c], set_start[c + 1]):
            for e in range(step_start[i], step_start[i + 1]):
                parent[step_to[e]], printed[step_to[e]] = i, step_path[e]
            before = parent[i]
            low, high = (
                (start[before], start[before + 1]) if before >= 0 else (base_start[c], base_start[c + 1])
            )
            if size + 2 * (high - low) + 3 > len(piece):
                return False
            xl = xr = yl = yr = np.inf
            if before >= 0:
                s = printed[i]
                a = 0 if segments[s, 0, 0] <= segments[s, 1, 0] else 1
                xl, yl, xr, yr = (
                    segments[s, a, 0],
                    segments[s, a, 1],
                    segments[s, 1 - a, 0],
                    segments[s, 1 - a, 1],
                )
                if xr - xl <= EPS_MM:
                    yl = yr = max(yl, yr)
            for side in range(2):  # what is left of the toolpath, the toolpath, what is right of it
                for q in range(low, high):
                    source = piece if before >= 0 else ground
                    bl, hl, br, hr = source[q, 0], source[q, 1], source[q, 2], source[q, 3]
                    slope = (hr - hl) / (br - bl) if br - bl > EPS_MM else 0.0
                    if side == 0 and (bl < xl - EPS_MM or (br - bl <= EPS_MM and bl <= xl + EPS_MM)):
                        if br > xl:
                            br, hr = xl, hl + slope * (xl - bl)
                    elif side == 1 and (
                        br > xr + EPS_MM or (br - bl <= EPS_MM and bl >= xr - EPS_MM and xr > xl)
                    ):
                        if bl < xr:
                            bl, hl = xr, hl + slope * (xr - bl)
                    else:
                        continue
                    piece[size, 0], piece[size, 1], piece[size, 2], piece[size, 3] = bl, hl, br, hr
                    size += 1
                if side == 0 and before >= 0:
                    piece[size, 0], piece[size, 1], piece[size, 2], piece[size, 3] = xl, yl, xr, yr
                    size += 1
            start[i + 1] = size
            top[i] = -np.inf
            for q in range(start[i], size):
                top[i] = max(top[i], piece[q, 1], piece[q, 3])
    return True


def sets_of_states(blocks: Blocks, sets: DownSets) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Where each block begins, and the down-sets of the columns of each of its states, state by state."""
    rows, begin = [np.empty(0, np.int32)], [0]
    for k in range(blocks.blocks):
        states = blocks.dense[blocks.state_start[k] : blocks.state_start[k + 1]]
        at = np.stack(np.unravel_index(states, blocks.shape(k, sets)), axis=1)
        at += sets.start[blocks.bounds[k] : blocks.bounds[k + 1] + 1]
        rows.append(at.astype(np.int32).ravel())
        begin.append(begin[-1] + at.size)
    return np.array(begin, np.int64), np.concatenate(rows)


def walk_cost(section: Section, sets: DownSets, sky: Skylines, oriented: NDArray[np.int32]) -> float:
    """What a sequence (n,) of a section costs; all its down-sets must be among those of ``sets``."""
    printed = sets.start[:-1].copy()
    arrays = (sets.step_start, sets.step_path, sets.step_to)
    return _walk(section.segments, section.column, section.parameters, sky, *arrays, printed, oriented)


@bare_kernel
def _walk(
    segments: NDArray[np.float64],
    column: NDArray[np.int32],
    parameters: NDArray[np.float64],
    sky: Skylines,
    step_start: NDArray[np.int32],
    step_path: NDArray[np.int32],
    step_to: NDArray[np.int32],
    printed: NDArray[np.int32],
    oriented: NDArray[np.int32],
) -> float:
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
                total += travel_cost(parameters, sky, printed, low, high, out_x, out_y, in_x, in_y)
            else:
                total += direct_cost(parameters, in_x - out_x, in_y - out_y)
        for e in range(step_start[printed[c]], step_start[printed[c] + 1]):
            if step_path[e] == v >> 1:
                printed[c] = step_to[e]
                break
    return total


@bare_kernel
def travel_cost(
    parameters: NDArray[np.float64],
    sky: Skylines,
    printed: NDArray[np.int32],
    low_column: int,
    high_column: int,
    out_x: float,
    out_y: float,
    in_x: float,
    in_y: float,
) -> float:
    """Cost of the travel between two points of two columns, over the down-sets ``printed`` of the columns.

    It is straight unless that passes below a skyline strictly between the two; then it follows the taut
    string over it, lifted by the clearance (see ``slicer.travel``).
    """
    onwards = out_x <= in_x
    ax, ay, bx, by = (out_x, out_y, in_x, in_y) if onwards else (in_x, in_y, out_x, out_y)
    direct = direct_cost(parameters, in_x - out_x, in_y - out_y)
    if bx - ax <= EPS_MM:
        return direct
    slope = (by - ay) / (bx - ax)
    sky.hull[0, 0], sky.hull[0, 1] = ax, ay
    size, blocked = 1, False
    for c in range(low_column, high_column + 1):
        if c > low_column:
            size, hit = _pass_over(
                sky.gap, sky.gap_start[c], sky.gap_start[c + 1], sky.hull, size, ax, ay, bx, slope
            )
            blocked |= hit
        i = printed[c]
        size, hit = _pass_over(sky.piece, sky.start[i], sky.start[i + 1], sky.hull, size, ax, ay, bx, slope)
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
            x, y = sky.hull[q, 0], sky.hull[q, 1] + parameters[1]
        step = np.sqrt((x - here_x) ** 2 + (y - here_y) ** 2)
        ends = np.sqrt((x - in_x) ** 2 + (y - in_y) ** 2) <= EPS_MM
        if t < size and (step <= EPS_MM or ends):
            continue
        length += step
        cost += leg_cost(parameters, x - here_x, y - here_y)
        here_x, here_y = x, y
    if parameters[8] > 0.0 and length > parameters[9]:
        cost += parameters[8]
    return cost


@bare_kernel
def _pass_over(
    piece: NDArray[np.float64],
    first: int,
    last: int,
    hull: NDArray[np.float64],
    size: int,
    ax: float,
    ay: float,
    bx: float,
    slope: float,
) -> tuple[int, bool]:
    """Put the pieces strictly between ax and bx on the hull; its size, and whether the line is below one."""
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
