"""The skyline of what is printed: compiled, kept up to date toolpath by toolpath.

It is a list of pieces from left to right, each a line from (xl, yl) to (xr, yr); where no piece is, the tip
may go anywhere. An upright toolpath is a piece without width. Of a nozzle that is a point the skyline is
made of toolpaths; a body keeps the tip above their reach as well (``slicer.reach``), and the skyline is the
upper envelope of both.

Pieces lie in flat arrays and are linked. Piece 0 stands left of everything and piece 1 right of everything.
Places are found by walking from a cursor, the piece that was looked at last, which costs no more than
looking at what a travel passes over.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.envelope import raise_by, raise_upright
from slicer.kernels import allocating_inner_kernel, inner_kernel, kernel
from slicer.nozzle import EPS_MM as PRESS_EPS_MM
from slicer.nozzle import NozzleBody
from slicer.pieces import (
    CURSOR,
    EPS_MM,
    FREED,
    LAST_FREED,
    LEFT,
    RIGHT,
    USED,
    height,
    insert_after,
    put,
    seek,
)
from slicer.reach import MOST_LINES, highest, reach
from slicer.taut_string import pass_over, push

FULL = -1
"""Instead of a number of pieces, where an array has no room for them."""
FIRST_ROOM = 256


class Skyline(NamedTuple):
    """Pieces, and what they are made by; an argument of compiled code.

    Attributes:
        piece: float64 (capacity, 4), [x left, y left, x right, y right] in mm.
        link: int32 (capacity, 2), the neighbours on the left and on the right.
        place: int64 (4,), see ``slicer.pieces``.
        hull: float64 (2 * capacity + 8, 2), where ``overpass`` leaves the points of a taut string.
        lines: float64 (MOST_LINES, 4), scratch for the reach of a toolpath.
        body: the nozzle.
        floor: the lowest y of any toolpath, in mm; of no interest for a point.
    """

    piece: NDArray[np.float64]
    link: NDArray[np.int32]
    place: NDArray[np.int64]
    hull: NDArray[np.float64]
    lines: NDArray[np.float64]
    body: NozzleBody
    floor: float


@kernel
def new_skyline(segments: NDArray[np.float64], body: NozzleBody, doublings: int) -> Skyline:
    """An empty skyline for toolpaths float64 (n, 2, 2), with its room doubled so often.

    A body's skyline begins with less room than it can need: only what is seen from above takes any.
    """
    n = len(segments)
    floor = np.inf
    if body.half_width > 0.0:
        for k in range(n):
            floor = min(floor, segments[k, 0, 1], segments[k, 1, 1])
    room = 2 * n + 2 if body.half_width == 0.0 else n + FIRST_ROOM
    return skyline_with_room(room << doublings, body, floor)


@kernel
def skyline_with_room(room: int, body: NozzleBody, floor: float) -> Skyline:
    """An empty skyline with room for so many pieces; a point's needs two for each toolpath, and two more."""
    piece = np.empty((room, 4))
    link = np.empty((room, 2), np.int32)
    sky = Skyline(
        piece,
        link,
        np.empty(4, np.int64),
        np.empty((2 * room + 8, 2)),
        np.empty((MOST_LINES, 4)),
        body,
        floor,
    )
    clear(sky)
    return sky


@inner_kernel
def clear(sky: Skyline) -> None:
    """Take all pieces away."""
    put(sky.piece, LEFT, -np.inf, -np.inf, -np.inf, -np.inf)
    put(sky.piece, RIGHT, np.inf, np.inf, np.inf, np.inf)
    sky.link[LEFT, RIGHT] = RIGHT
    sky.link[RIGHT, LEFT] = LEFT
    sky.place[CURSOR], sky.place[USED] = LEFT, 2
    sky.place[FREED], sky.place[LAST_FREED] = 0, 0


@inner_kernel
def append(sky: Skyline, piece: NDArray[np.float64], q: int) -> None:
    """Put a piece of another skyline behind all others; there must be room."""
    new = sky.place[USED]
    sky.place[USED] += 1
    put(sky.piece, new, piece[q, 0], piece[q, 1], piece[q, 2], piece[q, 3])
    insert_after(sky.link, sky.link[RIGHT, LEFT], new)


@inner_kernel
def copied(sky: Skyline, piece: NDArray[np.float64], size: int) -> int:
    """Put all pieces behind the first ``size`` rows of an array; how many it holds then, or ``FULL``."""
    q = sky.link[LEFT, RIGHT]
    while q != RIGHT:
        if size == len(piece):
            return FULL
        for axis in range(4):
            piece[size, axis] = sky.piece[q, axis]
        size += 1
        q = sky.link[q, RIGHT]
    return size


@allocating_inner_kernel
def widened(sky: Skyline) -> Skyline:
    """The same skyline with twice the room; the old one must not be used any more."""
    room = len(sky.piece)
    piece, link = np.empty((2 * room, 4)), np.empty((2 * room, 2), np.int32)
    for q in range(sky.place[USED]):
        put(piece, q, sky.piece[q, 0], sky.piece[q, 1], sky.piece[q, 2], sky.piece[q, 3])
        link[q, LEFT], link[q, RIGHT] = sky.link[q, LEFT], sky.link[q, RIGHT]
    return Skyline(piece, link, sky.place, np.empty((4 * room + 8, 2)), sky.lines, sky.body, sky.floor)


@inner_kernel
def lay(sky: Skyline, segment: NDArray[np.float64]) -> bool:
    """Print a toolpath; False where the room is too small: then lay it again in a wider skyline.

    Args:
        segment: float64 (2, 2), [endpoint, xy] in mm. For a nozzle that is a point it must have nothing
            above it.
    """
    if sky.body.half_width == 0.0:
        replace(sky.piece, sky.link, sky.place, segment)
        return True
    return _raise(sky, segment, 0.0)


@inner_kernel
def lay_to_leave(sky: Skyline, segment: NDArray[np.float64], end: int) -> bool:
    """Print a toolpath as far as it counts for the travel that leaves it at an end; then ``lay`` it.

    A tip that leaves the lower end of a toolpath stands below the reach of its rise, and stood there when it
    printed it: so much the reach counts lowered. The toolpath itself counts in full.
    """
    if sky.body.half_width == 0.0:
        replace(sky.piece, sky.link, sky.place, segment)
        return True
    count = reach(sky.body, sky.floor, segment, sky.lines)
    return _raise(sky, segment, max(0.0, highest(sky.lines, count, segment[end, 0]) - segment[end, 1]))


@allocating_inner_kernel
def with_laid(sky: Skyline, segment: NDArray[np.float64], end: int) -> Skyline:
    """The skyline with a toolpath laid to be left at an ``end``, or in full where that is negative.

    For a point, who has laid it to leave it need not lay it again.
    """
    while not (lay(sky, segment) if end < 0 else lay_to_leave(sky, segment, end)):
        sky = widened(sky)
    return sky


@inner_kernel
def _raise(sky: Skyline, segment: NDArray[np.float64], lowered: float) -> bool:
    """Raise the skyline to a toolpath and to its reach, lowered by so much."""
    piece, link, place = sky.piece, sky.link, sky.place
    first, second = (0, 1) if segment[0, 0] <= segment[1, 0] else (1, 0)
    xl, xr = segment[first, 0], segment[second, 0]
    lines = sky.lines
    for k in range(reach(sky.body, sky.floor, segment, lines)):
        line = (lines[k, 0], lines[k, 1] - lowered, lines[k, 2], lines[k, 3] - lowered)
        if not raise_by(piece, link, place, line):
            return False
    # As far below as its reach, for a bend of a hair where the two meet would be a stop of every travel.
    yl, yr = segment[first, 1] - PRESS_EPS_MM, segment[second, 1] - PRESS_EPS_MM
    if xr - xl <= EPS_MM:
        return raise_upright(piece, link, place, xl, max(yl, yr))
    return raise_by(piece, link, place, (xl, yl, xr, yr))


@inner_kernel
def replace(
    piece: NDArray[np.float64],
    link: NDArray[np.int32],
    place: NDArray[np.int64],
    segment: NDArray[np.float64],
) -> None:
    """Lay a toolpath that has nothing above it: it replaces the skyline over its x-range."""
    first, second = (0, 1) if segment[0, 0] <= segment[1, 0] else (1, 0)
    xl, xr = segment[first, 0], segment[second, 0]
    upright = xr - xl <= EPS_MM
    c = seek(piece, link, place[CURSOR], xl)
    new = place[USED]
    used = new + 1
    if piece[c, 2] > xl + EPS_MM and c != LEFT:  # c reaches over the left end: it is cut there
        if piece[c, 2] > xr + EPS_MM:  # and over the right end: its rest stays there
            rest = used
            used += 1
            put(piece, rest, xr, height(piece, c, xr), piece[c, 2], piece[c, 3])
            insert_after(link, c, rest)
        piece[c, 3] = height(piece, c, xl)
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
                place[CURSOR], place[USED] = covered, used - 1
                return
            break
        link[c, RIGHT] = link[covered, RIGHT]
        link[link[covered, RIGHT], LEFT] = c
    covered = link[c, RIGHT]
    if covered != RIGHT and piece[covered, 0] < xr - EPS_MM:  # begins under the toolpath: its rest stays
        piece[covered, 1] = height(piece, covered, xr)
        piece[covered, 0] = xr
    if upright:
        top = max(segment[0, 1], segment[1, 1])
        put(piece, new, xl, top, xl, top)
    else:
        put(piece, new, xl, segment[first, 1], xr, segment[second, 1])
    insert_after(link, c, new)
    place[CURSOR], place[USED] = new, used


@inner_kernel
def overpass(
    piece: NDArray[np.float64],
    link: NDArray[np.int32],
    place: NDArray[np.int64],
    hull: NDArray[np.float64],
    start: NDArray[np.float64],
    end: NDArray[np.float64],
) -> int:
    """The taut string over the skyline between two points, if the straight line would go through it.

    The line is blocked where it passes below the skyline strictly inside its x-range. Then the string
    is the upper convex hull of start, skyline and end, see ``taut_string``.

    Args:
        piece, link, place, hull: of the ``Skyline``. A call with all of it takes as long as the rest.
        start, end: float64 (2,), xy in mm.

    Returns:
        Points of the string; 0 where the straight line is free. The string is left in ``hull`` from
        start to end, both included unless the skyline is above them.
    """
    onwards = start[0] <= end[0]
    low, high = (start, end) if onwards else (end, start)
    a, b = low[0], high[0]
    c = seek(piece, link, place[CURSOR], a)
    place[CURSOR] = c
    at_low = at_high = c
    if b - a <= EPS_MM:
        return 0
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
    place[CURSOR] = at_high if onwards else at_low
    if not blocked:
        return 0
    size = push(hull, size, b, high[1])
    if not onwards:
        for k in range(size // 2):
            for axis in range(2):
                hull[k, axis], hull[size - 1 - k, axis] = hull[size - 1 - k, axis], hull[k, axis]
    return size
