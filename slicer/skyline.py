"""The skyline of what is printed: compiled, kept up to date toolpath by toolpath.

It is a list of pieces from left to right, each a line from (xl, yl) to (xr, yr); where no piece is,
nothing is printed. An upright toolpath is a piece without width. Pieces lie in flat arrays: ``piece``
float64 (capacity, 4) with xl, yl, xr, yr, and ``link`` int32 (capacity, 2) with the neighbours to the
left and right. Piece 0 stands left of everything and piece 1 right of everything. Whoever uses the
skyline holds a cursor, a piece near the nozzle: places are found by walking from there, which costs no
more than looking at what a travel passes over.
"""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel, kernel
from slicer.taut_string import EPS_MM, pass_over, push

LEFT, RIGHT = 0, 1


@kernel
def new_skyline(n: int) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """(piece, link) of an empty skyline with room for ``n`` toolpaths; pieces are taken from 2 upwards."""
    piece = np.empty((2 * n + 2, 4))
    piece[LEFT] = -np.inf
    piece[RIGHT] = np.inf
    link = np.empty((2 * n + 2, 2), np.int32)
    link[LEFT, RIGHT] = RIGHT
    link[RIGHT, LEFT] = LEFT
    return piece, link


@inner_kernel
def seek(piece: NDArray[np.float64], link: NDArray[np.int32], cursor: int, x: float) -> int:
    """The last piece that begins left of ``x``, found by walking from ``cursor``."""
    while piece[cursor, 0] >= x - EPS_MM:
        cursor = link[cursor, LEFT]
    while piece[link[cursor, RIGHT], 0] < x - EPS_MM:
        cursor = link[cursor, RIGHT]
    return cursor


@inner_kernel
def _height(piece: NDArray[np.float64], c: int, x: float) -> float:
    part = (x - piece[c, 0]) / (piece[c, 2] - piece[c, 0])
    return float(piece[c, 1] + part * (piece[c, 3] - piece[c, 1]))


@inner_kernel
def _insert_after(link: NDArray[np.int32], c: int, new: int) -> None:
    following = link[c, RIGHT]
    link[new, LEFT], link[new, RIGHT] = c, following
    link[c, RIGHT] = new
    link[following, LEFT] = new


@inner_kernel
def _put(piece: NDArray[np.float64], c: int, xl: float, yl: float, xr: float, yr: float) -> None:
    """Write a piece number by number: a row assigned at once takes numba three seconds to compile."""
    piece[c, 0], piece[c, 1], piece[c, 2], piece[c, 3] = xl, yl, xr, yr


@inner_kernel
def lay(
    piece: NDArray[np.float64],
    link: NDArray[np.int32],
    cursor: int,
    used: int,
    segment: NDArray[np.float64],
) -> tuple[int, int]:
    """Print a toolpath that has nothing above it: it replaces the skyline over its x-range.

    Args:
        used: the pieces that are taken, 2 at first.
        segment: float64 (2, 2), [endpoint, xy] in mm.

    Returns:
        The piece of the toolpath, which is a good cursor, and the new ``used``.
    """
    first, second = (0, 1) if segment[0, 0] <= segment[1, 0] else (1, 0)
    xl, xr = segment[first, 0], segment[second, 0]
    upright = xr - xl <= EPS_MM
    c = seek(piece, link, cursor, xl)
    new = used
    used += 1
    if piece[c, 2] > xl + EPS_MM and c != LEFT:  # c reaches over the left end: it is cut there
        if piece[c, 2] > xr + EPS_MM:  # and over the right end: its rest stays there
            rest = used
            used += 1
            _put(piece, rest, xr, _height(piece, c, xr), piece[c, 2], piece[c, 3])
            _insert_after(link, c, rest)
        piece[c, 3] = _height(piece, c, xl)
        piece[c, 2] = xl
    while True:  # what else the toolpath covers goes
        covered = link[c, RIGHT]
        left, right = piece[covered, 0], piece[covered, 2]
        if right - left <= EPS_MM and abs(left - xl) <= EPS_MM and not upright:
            c = covered  # an upright on the left end is passed by, not passed over
            continue
        if covered == RIGHT or right > xr + EPS_MM or left >= xr - EPS_MM:
            if upright and right - left <= EPS_MM and abs(left - xl) <= EPS_MM:
                segment_top = max(segment[0, 1], segment[1, 1])
                piece[covered, 1] = max(piece[covered, 1], segment_top)
                piece[covered, 3] = piece[covered, 1]
                return covered, used - 1
            break
        link[c, RIGHT] = link[covered, RIGHT]
        link[link[covered, RIGHT], LEFT] = c
    covered = link[c, RIGHT]
    if covered != RIGHT and piece[covered, 0] < xr - EPS_MM:  # begins under the toolpath: its rest stays
        piece[covered, 1] = _height(piece, covered, xr)
        piece[covered, 0] = xr
    if upright:
        top = max(segment[0, 1], segment[1, 1])
        _put(piece, new, xl, top, xl, top)
    else:
        _put(piece, new, xl, segment[first, 1], xr, segment[second, 1])
    _insert_after(link, c, new)
    return new, used


@inner_kernel
def overpass(
    piece: NDArray[np.float64],
    link: NDArray[np.int32],
    cursor: int,
    start: NDArray[np.float64],
    end: NDArray[np.float64],
    hull: NDArray[np.float64],
) -> tuple[int, int]:
    """The taut string over the skyline between two points, if the straight line would go through it.

    The line is blocked where it passes below the skyline strictly inside its x-range. Then the string
    is the upper convex hull of start, skyline and end, see ``taut_string``.

    Args:
        start, end: float64 (2,), xy in mm.
        hull: float64 (k, 2), room for the string; k at least 2 + twice the pieces passed.

    Returns:
        (points of the string, cursor near ``end``); 0 points where the straight line is free. The
        string is left in ``hull`` from start to end, both included unless the skyline is above them.
    """
    onwards = start[0] <= end[0]
    low, high = (start, end) if onwards else (end, start)
    a, b = low[0], high[0]
    c = seek(piece, link, cursor, a)
    at_low = at_high = c
    if b - a <= EPS_MM:
        return 0, c
    line = (a, low[1], b, (high[1] - low[1]) / (b - a))
    hull[0, 0], hull[0, 1] = a, low[1]
    size, blocked = 1, False
    if c == LEFT:
        c = link[c, RIGHT]
    while piece[c, 0] < b - EPS_MM:
        size, hit = pass_over(hull, size, piece, c, line)
        blocked |= hit
        at_high = c
        c = link[c, RIGHT]
    cursor = at_high if onwards else at_low
    if not blocked:
        return 0, cursor
    size = push(hull, size, b, high[1])
    if not onwards:
        for k in range(size // 2):
            for axis in range(2):
                hull[k, axis], hull[size - 1 - k, axis] = hull[size - 1 - k, axis], hull[k, axis]
    return size, cursor
