"""The upper envelope of what a program has printed so far, kept while it is replayed.

It is independent of the planner's skyline on purpose, and more general: nothing is assumed of the order
in which lines come. Pieces from left to right stand in a sorted array; each is a line with the number of
the program line that printed it. Upright lines, whose x-range is lost in the resolution, are kept apart.
"""

import numpy as np
from numpy.typing import NDArray

from slicer.kernels import kernel

NONE = -1
# Columns of a piece or an upright: from (XL, YL) to (XR, YR), printed by line LINE.
XL, YL, XR, YR, LINE = 0, 1, 2, 3, 4


@kernel
def _at(piece: NDArray[np.float64], x: float) -> float:
    return float(piece[YL] + (piece[YR] - piece[YL]) * (x - piece[XL]) / (piece[XR] - piece[XL]))


@kernel
def _first_ending_after(pieces: NDArray[np.float64], count: int, x: float) -> int:
    low, high = 0, count
    while low < high:
        middle = (low + high) // 2
        if pieces[middle, XR] > x:
            high = middle
        else:
            low = middle + 1
    return low


@kernel
def _obstacle(
    pieces: NDArray[np.float64],
    count: int,
    uprights: NDArray[np.float64],
    upright_count: int,
    line: NDArray[np.float64],
    tolerance: float,
    same_x: float,
) -> tuple[int, float, float]:
    """What printed material a line from left to right passes below, by more than rounding explains.

    Each of the two lines may be off by ``tolerance`` at right angles, and each end by as much along x.

    Returns:
        (program line of the deepest obstacle or NONE, how far below it in y, at which x).
    """
    worst, who, where = 0.0, NONE, 0.0
    xl, xr = line[XL], line[XR]
    if xr - xl <= 2 * tolerance:  # up or down along one x: only an upright could be there
        low = min(line[YL], line[YR])
        k = _first_ending_after(pieces, count, xl - tolerance)
        while k < count and pieces[k, XL] < xl + tolerance:
            if pieces[k, XL] < xl - tolerance and pieces[k, XR] > xr + tolerance:
                slope = (pieces[k, YR] - pieces[k, YL]) / (pieces[k, XR] - pieces[k, XL])
                over = _at(pieces[k], (xl + xr) / 2) - low
                if (
                    over > tolerance * (1 + np.sqrt(1 + slope * slope)) + abs(slope) * tolerance
                    and over > worst
                ):
                    worst, who, where = over, int(pieces[k, LINE]), xl
            k += 1
        k = _first_ending_after(uprights, upright_count, xl - 2 * tolerance)
        while k < upright_count and uprights[k, XL] < xr + 2 * tolerance:
            # Only what is upright beyond doubt is above or below another upright.
            apart = max(xr, uprights[k, XR]) - min(xl, uprights[k, XL])
            over = uprights[k, YR] - low
            if apart <= same_x and over > 2 * tolerance and over > worst:
                worst, who, where = over, int(uprights[k, LINE]), xl
            k += 1
        return who, worst, where
    slope = (line[YR] - line[YL]) / (xr - xl)
    stretch = np.sqrt(1 + slope * slope)
    k = _first_ending_after(pieces, count, xl)
    while k < count and pieces[k, XL] < xr:
        left = max(pieces[k, XL], xl) + tolerance
        right = min(pieces[k, XR], xr) - tolerance
        if right > left:
            other = (pieces[k, YR] - pieces[k, YL]) / (pieces[k, XR] - pieces[k, XL])
            allowed = tolerance * (stretch + np.sqrt(1 + other * other))
            for x in (left, right):
                over = _at(pieces[k], x) - _at(line, x)
                if over > allowed and over > worst:
                    worst, who, where = over, int(pieces[k, LINE]), x
        k += 1
    k = _first_ending_after(uprights, upright_count, xl + tolerance)
    while k < upright_count and uprights[k, XR] < xr - tolerance:
        x = uprights[k, XL]
        over = uprights[k, YR] - _at(line, x)
        if x > xl + tolerance and over > tolerance * (1 + stretch) + abs(slope) * tolerance and over > worst:
            worst, who, where = over, int(uprights[k, LINE]), x
        k += 1
    return who, worst, where


@kernel
def _splice(
    pieces: NDArray[np.float64], count: int, begin: int, end: int, new: NDArray[np.float64], fresh: int
) -> int:
    """Put ``fresh`` rows of ``new`` in the place of rows begin to end; the new count."""
    shift = fresh - (end - begin)
    if shift > 0:
        for k in range(count - 1, end - 1, -1):
            pieces[k + shift] = pieces[k]
    elif shift < 0:
        for k in range(end, count):
            pieces[k + shift] = pieces[k]
    for k in range(fresh):
        pieces[begin + k] = new[k]
    return count + shift


@kernel
def _append(new: NDArray[np.float64], fresh: int, xl: float, xr: float, source: NDArray[np.float64]) -> int:
    """Add the part of ``source`` from xl to xr, or lengthen the last piece if that is its other part."""
    if xr - xl <= 0:
        return fresh
    if fresh and new[fresh - 1, LINE] == source[LINE] and new[fresh - 1, XR] == xl:
        new[fresh - 1, XR], new[fresh - 1, YR] = xr, _at(source, xr)
        return fresh
    new[fresh, XL], new[fresh, YL] = xl, _at(source, xl)
    new[fresh, XR], new[fresh, YR] = xr, _at(source, xr)
    new[fresh, LINE] = source[LINE]
    return fresh + 1


@kernel
def _raise_to(
    pieces: NDArray[np.float64], count: int, line: NDArray[np.float64], new: NDArray[np.float64]
) -> int:
    """Make the envelope the greater of itself and a slanted line; the new count of pieces."""
    xl, xr = line[XL], line[XR]
    begin = _first_ending_after(pieces, count, xl)
    k, fresh, x = begin, 0, xl
    while k < count and pieces[k, XL] < xr:
        piece = pieces[k]
        fresh = _append(new, fresh, piece[XL], min(xl, piece[XR]), piece)
        fresh = _append(new, fresh, x, piece[XL], line)
        x = max(x, piece[XL])
        right = min(piece[XR], xr)
        left_gain, right_gain = _at(line, x) - _at(piece, x), _at(line, right) - _at(piece, right)
        if left_gain >= 0 and right_gain >= 0:
            fresh = _append(new, fresh, x, right, line)
        elif left_gain <= 0 and right_gain <= 0:
            fresh = _append(new, fresh, x, right, piece)
        else:
            cross = x + (right - x) * left_gain / (left_gain - right_gain)
            first, second = (line, piece) if left_gain > 0 else (piece, line)
            fresh = _append(new, fresh, x, cross, first)
            fresh = _append(new, fresh, cross, right, second)
        x = right
        fresh = _append(new, fresh, max(xr, piece[XL]), piece[XR], piece)
        k += 1
    fresh = _append(new, fresh, x, xr, line)  # beyond the last piece
    return _splice(pieces, count, begin, k, new, fresh)


@kernel
def replay(
    lines: NDArray[np.float64], prints: NDArray[np.bool_], tolerance: float, same_x: float
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Replay moves and tell which of them pass below what was printed before.

    Args:
        lines: float64 (n, 5), from (x, y) to (x, y) in the direction of the move, and its line number.
        prints: bool (n,), whether a move lays material; others only pass.
        tolerance: resolution of positions, in mm.
        same_x: two uprights constrain each other if their x lie within this; a negative number for never.

    Returns:
        (int64 (v, 2): [index of the move, program line of what it passes below],
        float64 (v, 2): [how far below, x], in mm).
    """
    n = len(lines)
    pieces = np.empty((256, 5))
    uprights = np.empty((256, 5))
    count = upright_count = 0
    who = np.empty((64, 2), np.int64)
    how = np.empty((64, 2))
    found = 0
    new = np.empty((1024, 5))
    for k in range(n):
        line = lines[k].copy()
        if line[XL] > line[XR]:
            line[XL], line[YL], line[XR], line[YR] = lines[k, XR], lines[k, YR], lines[k, XL], lines[k, YL]
        if not prints[k] and line[XR] - line[XL] <= 2 * tolerance:
            continue  # a travel along one x never collides
        obstacle, depth, x = _obstacle(pieces, count, uprights, upright_count, line, tolerance, same_x)
        if obstacle != NONE:
            if found == len(who):
                who = np.concatenate((who, np.empty_like(who)))
                how = np.concatenate((how, np.empty_like(how)))
            who[found, 0], who[found, 1] = k, obstacle
            how[found, 0], how[found, 1] = depth, x
            found += 1
        if not prints[k]:
            continue
        if count + 4 > len(pieces):
            pieces = np.concatenate((pieces, np.empty_like(pieces)))
        if upright_count + 1 > len(uprights):
            uprights = np.concatenate((uprights, np.empty_like(uprights)))
        if line[XR] - line[XL] <= 2 * tolerance:
            line[YL], line[YR] = min(line[YL], line[YR]), max(line[YL], line[YR])
            begin = _first_ending_after(uprights, upright_count, line[XR])
            new[0] = line
            upright_count = _splice(uprights, upright_count, begin, begin, new, 1)
        else:
            if 4 * count + 8 > len(new):
                new = np.empty((8 * count + 16, 5))
            begin = _first_ending_after(uprights, upright_count, line[XL] + tolerance)
            end = kept = begin
            while end < upright_count and uprights[end, XR] < line[XR] - tolerance:
                # What the line has passed over is no obstacle of its own any more.
                if uprights[end, YR] > _at(line, uprights[end, XL]):
                    uprights[kept] = uprights[end]
                    kept += 1
                end += 1
            upright_count = _splice(uprights, upright_count, kept, end, new, 0)
            count = _raise_to(pieces, count, line, new)
    return who[:found], how[:found]
