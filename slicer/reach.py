"""What a printed toolpath forbids to the tip of a nozzle with a body: its reach.

Let h(d) be the height of the lower boundary of the body's hard core (``slicer.nozzle``) at distance d from
the axis. With a toolpath printed the tip may not pass below the greatest a.y - h(|x - a.x|) over its points
a. From the axis outwards -h is level, then falls along the flank: a concave function, as the toolpath is
one over its x-range. So what the greatest of their sums looks like is their slopes in descending order, one
line after another (Rockafellar, "Convex Analysis", 1970, section 16); barrel and shoulder give two more such
chains. A flank ends where it is as wide as the barrel, or where another part reaches farther. What lies below
the lowest place that a tip goes to is of no interest, and ends it, too.
"""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import inner_kernel
from slicer.nozzle import EPS_MM as PRESS_EPS_MM
from slicer.nozzle import NozzleBody

EPS_MM = 1e-9
MOST_LINES = 8
"""Four of the needle, two of the barrel and two of the shoulder."""


@inner_kernel
def reach(body: NozzleBody, floor: float, segment: NDArray[np.float64], lines: NDArray[np.float64]) -> int:
    """Write what a printed toolpath forbids to the tip, the toolpath itself apart; how many lines it takes.

    Args:
        body: the nozzle, not a point.
        floor: the lowest y of any toolpath, in mm.
        segment: float64 (2, 2), [endpoint, xy] in mm.
        lines: float64 (MOST_LINES, 4), filled with [x left, y left, x right, y right]; the greatest counts.
    """
    first, second = (0, 1) if segment[0, 0] <= segment[1, 0] else (1, 0)
    xl, yl, xr, yr = segment[first, 0], segment[first, 1], segment[second, 0], segment[second, 1]
    if xr - xl <= EPS_MM:  # of an upright the upper end reaches farthest
        yl = yr = max(yl, yr)
    mirrored = yl > yr
    if mirrored:
        xl, yl, xr, yr = -xr, yr, -xl, yl
    press = body.press + PRESS_EPS_MM
    room = yr - floor
    count = 0
    # Half width of the hard core where it begins, at height ``low``.
    low = press
    core = body.half_width + body.flank * press - press * np.sqrt(1.0 + body.flank * body.flank)
    if core < 0.0 < body.flank:
        low -= core / body.flank
        core = 0.0
    widest = body.barrel - press if body.flank > 0.0 else core
    core = min(core, widest)
    high = min(min(body.length, body.barrel_from) + press, room)
    if core >= 0.0 and low < high:
        drop = min(high - low, (widest - core) / body.flank) if body.flank > 0.0 else 0.0
        out = body.flank * drop
        x, y = xl - core - out, yl - low - drop
        if (yr - yl) * body.flank > xr - xl:  # steeper than the flank
            count, x, y = _add(lines, count, x, y, xr - xl, yr - yl)
            count, x, y = _add(lines, count, x, y, out, drop)
        else:
            count, x, y = _add(lines, count, x, y, out, drop)
            count, x, y = _add(lines, count, x, y, xr - xl, yr - yl)
        count, x, y = _add(lines, count, x, y, 2.0 * core, 0.0)
        count, x, y = _add(lines, count, x, y, out, -drop)
    for part in range(2):
        begins = body.barrel_from if part == 0 else body.length
        wide = (body.barrel if part == 0 else body.shoulder) - press
        if begins + press < room and wide > 0.0:
            x, y = xl - wide, yl - begins - press
            count, x, y = _add(lines, count, x, y, xr - xl, yr - yl)
            count, x, y = _add(lines, count, x, y, 2.0 * wide, 0.0)
    if mirrored:
        for k in range(count):
            lines[k, 0], lines[k, 2] = -lines[k, 2], -lines[k, 0]
            lines[k, 1], lines[k, 3] = lines[k, 3], lines[k, 1]
    return count


@inner_kernel
def _add(
    lines: NDArray[np.float64], count: int, x: float, y: float, dx: float, dy: float
) -> tuple[int, float, float]:
    """Go on by (dx, dy) from (x, y) with a line, unless it has no width; how many there are, and the end."""
    if dx > EPS_MM:
        lines[count, 0], lines[count, 1] = x, y
        lines[count, 2], lines[count, 3] = x + dx, y + dy
        count += 1
    return count, x + dx, y + dy


@inner_kernel
def highest(lines: NDArray[np.float64], count: int, x: float) -> float:
    """The greatest y at x of the first ``count`` lines; minus infinity where there is none."""
    out = -np.inf
    for k in range(count):
        xl, yl, xr, yr = lines[k, 0], lines[k, 1], lines[k, 2], lines[k, 3]
        if xl <= x <= xr:
            out = max(out, yl + (x - xl) / (xr - xl) * (yr - yl))
    return out
