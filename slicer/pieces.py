"""The linked list that a skyline is kept in: pieces of lines from left to right, and where to find them.

``piece`` is float64 (capacity, 4), [x left, y left, x right, y right] in mm, and ``link`` int32 (capacity,
2), the neighbours on the left and on the right. Piece 0 stands left of everything and piece 1 right of
everything. ``place`` is int64 (4,): a piece near the last place that was looked at, the pieces that have
been taken so far, how many of them have been given back, and the last of those; each names by its left link
the one that was given back before it.
"""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel
from slicer.taut_string import EPS_MM as EPS_MM

LEFT, RIGHT = 0, 1
CURSOR, USED, FREED, LAST_FREED = 0, 1, 2, 3


@inner_kernel
def seek(piece: NDArray[np.float64], link: NDArray[np.int32], cursor: int, x: float) -> int:
    """The last piece that begins left of ``x``, found by walking from ``cursor``."""
    while piece[cursor, 0] >= x - EPS_MM:
        cursor = link[cursor, LEFT]
    while piece[link[cursor, RIGHT], 0] < x - EPS_MM:
        cursor = link[cursor, RIGHT]
    return cursor


@inner_kernel
def height(piece: NDArray[np.float64], c: int, x: float) -> float:
    """y of a piece at x."""
    part = (x - piece[c, 0]) / (piece[c, 2] - piece[c, 0])
    return float(piece[c, 1] + part * (piece[c, 3] - piece[c, 1]))


@inner_kernel
def insert_after(link: NDArray[np.int32], c: int, new: int) -> None:
    """Link a piece in, on the right of another."""
    following = link[c, RIGHT]
    link[new, LEFT], link[new, RIGHT] = c, following
    link[c, RIGHT] = new
    link[following, LEFT] = new


@inner_kernel
def put(piece: NDArray[np.float64], c: int, xl: float, yl: float, xr: float, yr: float) -> None:
    """Write a piece number by number: a row assigned at once takes numba three seconds to compile."""
    piece[c, 0], piece[c, 1], piece[c, 2], piece[c, 3] = xl, yl, xr, yr


@inner_kernel
def taken(link: NDArray[np.int32], place: NDArray[np.int64]) -> int:
    """A piece that nobody has; there must be room."""
    if place[FREED] == 0:
        place[USED] += 1
        return int(place[USED] - 1)
    q = place[LAST_FREED]
    place[FREED] -= 1
    place[LAST_FREED] = link[q, LEFT]
    return int(q)


@inner_kernel
def give_back(link: NDArray[np.int32], place: NDArray[np.int64], q: int) -> None:
    """Unlink a piece; the cursor must not stay on it."""
    left, right = link[q, LEFT], link[q, RIGHT]
    link[left, RIGHT], link[right, LEFT] = right, left
    link[q, LEFT] = place[LAST_FREED]
    place[LAST_FREED] = q
    place[FREED] += 1
