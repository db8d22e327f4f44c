"""What carries each toolpath, and when it could first be laid, seen on narrow upright strips of the sheet.

It is for the eye alone: a strip is a fraction of a bead wide, and what happens within it is not told apart.
What a program may print is the affair of ``gcode.check``.
"""

import math

import numpy as np
from numpy.typing import NDArray

STRIPS_PER_BEAD, MOST_STRIPS = 4, 50_000
CARRIED = 1.6
"""A bead hangs where the one below it is farther than this many of its heights, axis to axis."""


def support(
    toolpaths: NDArray[np.float64], height_mm: NDArray[np.float64], bed_mm: float
) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
    """How much of each toolpath hangs, and after how many toolpaths it could have been laid.

    Args:
        toolpaths: float64 (n, 2, 2), [start, end] in mm, in the order of printing.
        height_mm: float64 (n,), of their beads.
        bed_mm: where the bed is.

    Returns:
        Percent of the length of each (n,) that has nothing close below it, and int64 (n,), how many of the
        toolpaths must be printed before it, counted to the last that lies directly below.
    """
    n = len(toolpaths)
    hangs, after = np.zeros(n, np.uint8), np.zeros(n, np.int64)
    if n == 0:
        return hangs, after
    low, high = float(toolpaths[:, :, 0].min()), float(toolpaths[:, :, 0].max())
    strip = max(float(np.median(height_mm)) / STRIPS_PER_BEAD, (high - low) / MOST_STRIPS, 1e-6)
    strips = int((high - low) / strip) + 1
    top = np.full(strips, bed_mm)
    owner = np.full(strips, -1, np.int64)
    # A strip belongs to a toolpath that passes its middle; one between two middles has the nearest.
    columns = (toolpaths[:, :, 0] - low) / strip - 0.5
    first = np.clip(np.ceil(columns.min(axis=1)), 0, strips - 1).astype(np.int64)
    last = np.clip(np.floor(columns.max(axis=1)), first, strips - 1).astype(np.int64) + 1
    middle = low + (np.arange(strips) + 0.5) * strip
    for k, ((x0, y0), (x1, y1)) in enumerate(toolpaths.tolist()):
        a, b = int(first[k]), int(last[k])
        run, rise = x1 - x0, y1 - y0
        if b - a == 1 or run == 0:
            y = np.full(b - a, min(y0, y1))
            upper = np.full(b - a, max(y0, y1))
            cosine = 1.0
        else:
            y = upper = y0 + (middle[a:b] - x0) * (rise / run)
            cosine = abs(run) / math.hypot(run, rise)
        below = top[a:b]
        height = float(height_mm[k])
        distance = (y - below) * cosine
        reach = np.where(owner[a:b] < 0, 0.5 + CARRIED - 1.0, CARRIED) * height
        hangs[k] = round(100 * float(np.count_nonzero(distance > reach)) / (b - a))
        under = below < y + 1e-6
        after[k] = int(owner[a:b][under].max(initial=-1)) + 1
        higher = upper > below
        top[a:b][higher] = upper[higher]
        owner[a:b][higher] = k
    return hangs, after
