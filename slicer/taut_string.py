"""The taut string over what is printed, piece by piece: the geometry of a travel that may not go straight.

The string is the upper convex hull of both ends of the travel and the skyline strictly between them (Andrew,
"Another efficient algorithm for convex hulls in two dimensions", Information Processing Letters 9, 1979).
A ``hull`` is float64 (h, 2), xy in mm from left to right, with room for two points more than twice the
pieces that are passed; the caller puts the left end in as its first point.
"""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel
from slicer.nozzle import EPS_MM as PRESS_EPS_MM

EPS_MM = 1e-9
HAIR_MM = PRESS_EPS_MM
"""As much as a toolpath is lowered where a body's reach begins: that makes no bend."""


@inner_kernel
def pass_over(
    hull: NDArray[np.float64],
    size: int,
    piece: NDArray[np.float64],
    q: int,
    line: tuple[float, float, float, float],
) -> tuple[int, bool]:
    """Put a piece of a skyline on a hull, as far as it lies strictly between the ends of a travel.

    Args:
        hull: the string so far.
        size: how many points it has.
        piece: float64 (p, 4), pieces [x left, y left, x right, y right] in mm; an upright has no width.
        q: which of them.
        line: x and y of the travel's left end, x of its right end, and its slope.

    Returns:
        The new size, and whether the straight travel would pass below the piece.
    """
    ax, ay, bx, slope = line
    xl, yl, xr, yr = piece[q, 0], piece[q, 1], piece[q, 2], piece[q, 3]
    if xr - xl <= EPS_MM:
        if not ax + EPS_MM < xl < bx - EPS_MM:
            return size, False
        return push(hull, size, xl, yl), yl > ay + slope * (xl - ax) + EPS_MM
    rise = (yr - yl) / (xr - xl)
    if xl < ax:
        xl, yl = ax, yl + rise * (ax - xl)
    if xr > bx:
        xr, yr = bx, yr + rise * (bx - xr)
    if xr - xl <= EPS_MM:
        return size, False
    blocked = yl > ay + slope * (xl - ax) + EPS_MM or yr > ay + slope * (xr - ax) + EPS_MM
    return push(hull, push(hull, size, xl, yl), xr, yr), blocked


@inner_kernel
def push(hull: NDArray[np.float64], size: int, x: float, y: float) -> int:
    """Add a point to the right end of a hull; the new size.

    What stands out by no more than ``HAIR_MM`` holds no string up: a bend that rounding makes of points in
    line would be a stop of the travel, and dear.
    """
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
            if turn < -HAIR_MM * (x - hull[size - 2, 0]):
                break
        size -= 1
    hull[size, 0], hull[size, 1] = x, y
    return size + 1
