"""The upper envelope of lines, kept in the linked list of ``slicer.pieces``: raised line by line.

Lines may leave gaps and jumps between them. What a line does not cover is left as it was, piece by piece,
so that raising the envelope by the same line twice changes nothing.
"""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel
from slicer.pieces import (
    CURSOR,
    EPS_MM,
    FREED,
    LEFT,
    RIGHT,
    USED,
    give_back,
    height,
    insert_after,
    put,
    seek,
    taken,
)


@inner_kernel
def raise_by(
    piece: NDArray[np.float64],
    link: NDArray[np.int32],
    place: NDArray[np.int64],
    line: tuple[float, float, float, float],
) -> bool:
    """Raise the envelope by a line [x left, y left, x right, y right]; False where the room is too small.

    The pieces are cut at the ends of the line and where it crosses them. Then each lies wholly above it or
    wholly below, and what is below gives way.
    """
    xl, yl, xr, yr = line
    if xr - xl <= EPS_MM:
        return True
    slope = (yr - yl) / (xr - xl)
    c = seek(piece, link, place[CURSOR], xl)
    place[CURSOR] = c
    passed, q = 0, link[c, RIGHT]
    while piece[q, 0] < xr - EPS_MM:
        passed += 1
        q = link[q, RIGHT]
    if len(piece) - place[USED] + place[FREED] < 3 * passed + 8:
        return False
    first, rest = LEFT, LEFT  # pieces that are cut at the ends of the line
    if c != LEFT and piece[c, 2] > xl + EPS_MM:
        first = _cut(piece, link, place, c, xl)
    q = link[c, RIGHT]
    before = c  # where the next piece of the line goes behind
    x = xl  # so far the envelope is done
    lying = LEFT  # the piece of the line that ends at x, if any
    while True:
        if q == RIGHT or piece[q, 0] >= xr - EPS_MM:
            if xr - x > EPS_MM:
                lying = _go_on(piece, link, place, before, lying, (x, xr, yl + slope * (x - xl), yr))
            break
        if abs(piece[q, 2] - xl) <= EPS_MM:  # an upright on the left end
            before, q = q, link[q, RIGHT]
            continue
        if piece[q, 0] > x + EPS_MM:  # a gap
            to = piece[q, 0]
            ends = (x, to, yl + slope * (x - xl), yl + slope * (to - xl))
            lying = _go_on(piece, link, place, before, lying, ends)
            before, x = lying, to
            continue
        if piece[q, 2] > xr + EPS_MM:
            rest = _cut(piece, link, place, q, xr)
        over = yl + slope * (piece[q, 0] - xl) - piece[q, 1]
        over_end = yl + slope * (piece[q, 2] - xl) - piece[q, 3]
        if over <= EPS_MM and over_end <= EPS_MM:  # it stays
            before, lying, x = q, LEFT, piece[q, 2]
            q = link[q, RIGHT]
            continue
        if min(over, over_end) < -EPS_MM:  # they cross
            at = piece[q, 0] + over / (over - over_end) * (piece[q, 2] - piece[q, 0])
            if piece[q, 0] + EPS_MM < at < piece[q, 2] - EPS_MM:
                _cut(piece, link, place, q, at)
                continue
            if over + over_end <= 0.0:  # they touch at an end, as far as can be told
                before, lying, x = q, LEFT, piece[q, 2]
                q = link[q, RIGHT]
                continue
        to, following = piece[q, 2], link[q, RIGHT]
        if q == first:
            first = LEFT
        give_back(link, place, q)
        q = following
        if to - x > EPS_MM:
            ends = (x, to, yl + slope * (x - xl), yl + slope * (to - xl))
            lying = _go_on(piece, link, place, before, lying, ends)
            before, x = lying, to
    _mend(piece, link, place, c, first)
    if rest != LEFT and lying == LEFT:
        _mend(piece, link, place, link[rest, LEFT], rest)
    return True


@inner_kernel
def raise_upright(
    piece: NDArray[np.float64], link: NDArray[np.int32], place: NDArray[np.int64], x: float, y: float
) -> bool:
    """Raise the envelope by a point, a piece without width; False where the room is too small."""
    if len(piece) - place[USED] + place[FREED] < 2:
        return False
    c = seek(piece, link, place[CURSOR], x)
    place[CURSOR] = c
    if c != LEFT and piece[c, 2] > x + EPS_MM:
        if height(piece, c, x) >= y:
            return True
        _cut(piece, link, place, c, x)
    elif c != LEFT and piece[c, 2] >= x - EPS_MM and piece[c, 3] >= y:
        return True
    q = link[c, RIGHT]
    if q != RIGHT and piece[q, 0] <= x + EPS_MM:
        if piece[q, 1] >= y:
            return True
        if piece[q, 2] - piece[q, 0] <= EPS_MM:
            piece[q, 1] = piece[q, 3] = y
            return True
    new = taken(link, place)
    put(piece, new, x, y, x, y)
    insert_after(link, c, new)
    return True


@inner_kernel
def _cut(
    piece: NDArray[np.float64], link: NDArray[np.int32], place: NDArray[np.int64], q: int, x: float
) -> int:
    """Cut a piece at x, strictly inside; its right part."""
    y = height(piece, q, x)
    new = taken(link, place)
    put(piece, new, x, y, piece[q, 2], piece[q, 3])
    piece[q, 2], piece[q, 3] = x, y
    insert_after(link, q, new)
    return new


@inner_kernel
def _go_on(
    piece: NDArray[np.float64],
    link: NDArray[np.int32],
    place: NDArray[np.int64],
    before: int,
    lying: int,
    ends: tuple[float, float, float, float],
) -> int:
    """Lengthen the piece of the line that lies there, or begin one behind ``before``; which it is.

    ``ends`` are x and x, then y and y, from left to right.
    """
    x, to, y, y_to = ends
    if lying != LEFT:
        piece[lying, 2], piece[lying, 3] = to, y_to
        return lying
    new = taken(link, place)
    put(piece, new, x, y, to, y_to)
    insert_after(link, before, new)
    return new


@inner_kernel
def _mend(
    piece: NDArray[np.float64], link: NDArray[np.int32], place: NDArray[np.int64], left: int, right: int
) -> None:
    """Make one again of a piece that was cut in vain."""
    if right == LEFT or link[left, RIGHT] != right:
        return
    piece[left, 2], piece[left, 3] = piece[right, 2], piece[right, 3]
    give_back(link, place, right)
