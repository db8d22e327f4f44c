"""The upper envelope of what a program has printed so far, kept while it is replayed.

It is independent of the planner's skyline on purpose, and more general: nothing is assumed of the order
in which lines come. Pieces from left to right stand in a sorted list; each is a line with the number of
the program line that printed it. Upright lines, whose x-range is lost in the resolution, are kept apart.

Nothing here is compiled: a line meets few pieces, which bisection finds, so that a check in plain Python
takes a sixth longer (docs/results.md, Start-up) and begins at once.
"""

from bisect import bisect_right
from math import sqrt

import numpy as np
from numpy.typing import NDArray

NONE = -1

Line = tuple[float, float, float, float, int]
"""From (xl, yl) to (xr, yr), xl <= xr, printed by a line of the program."""

Obstacle = tuple[int, float, float]
"""(program line of the deepest obstacle or NONE, how far a line passes below it in y, at which x)."""


class _Row:
    """Lines sorted by their right ends."""

    def __init__(self) -> None:
        self.lines: list[Line] = []
        self.ends: list[float] = []
        """The right end of each line."""

    def first_ending_after(self, x: float) -> int:
        return bisect_right(self.ends, x)

    def splice(self, begin: int, end: int, new: list[Line]) -> None:
        """Put ``new`` in the place of lines begin to end."""
        self.lines[begin:end] = new
        self.ends[begin:end] = [line[2] for line in new]


def _at(line: Line, x: float) -> float:
    xl, yl, xr, yr, _ = line
    return yl + (yr - yl) * (x - xl) / (xr - xl)


def _above_upright(pieces: _Row, uprights: _Row, line: Line, tolerance: float, same_x: float) -> Obstacle:
    """What an upright line passes below, by more than rounding explains.

    Each of two lines may be off by ``tolerance`` at right angles, and each end by as much along x.
    """
    worst, who, where = 0.0, NONE, 0.0
    xl, yl, xr, yr, _ = line
    low, high = min(yl, yr), max(yl, yr)
    for k in range(pieces.first_ending_after(xl - tolerance), len(pieces.lines)):
        piece = pieces.lines[k]
        left, at_left, right, at_right, by = piece
        if left >= xl + tolerance:
            break
        if left < xl - tolerance and right > xr + tolerance:
            slope = (at_right - at_left) / (right - left)
            over = _at(piece, (xl + xr) / 2) - low
            allowed = tolerance * (1 + sqrt(1 + slope * slope)) + abs(slope) * tolerance
            if over > allowed and over > worst:
                worst, who, where = over, by, xl
    for k in range(uprights.first_ending_after(xl - 2 * tolerance), len(uprights.lines)):
        left, bottom, right, top, by = uprights.lines[k]
        if left >= xr + 2 * tolerance:
            break
        # Only what is upright beyond doubt is above or below another upright.
        apart = max(xr, right) - min(xl, left)
        over = top - low
        # What overlaps is no stack but two lines of neighbouring columns on their border.
        stacked = high <= bottom + 2 * tolerance
        if stacked and apart <= same_x and over > 2 * tolerance and over > worst:
            worst, who, where = over, by, xl
    return who, worst, where


def _above_slanted(pieces: _Row, uprights: _Row, line: Line, tolerance: float) -> Obstacle:
    """What a line that is not upright passes below, see ``_above_upright``."""
    worst, who, where = 0.0, NONE, 0.0
    xl, yl, xr, yr, _ = line
    rise, run, low = yr - yl, xr - xl, min(yl, yr)
    slope = rise / run
    stretch = sqrt(1 + slope * slope)
    least = 2 * tolerance  # no pair of lines is allowed less
    for k in range(pieces.first_ending_after(xl), len(pieces.lines)):
        left, at_left, right, at_right, by = pieces.lines[k]
        if left >= xr:
            break
        if at_left <= low and at_right <= low:
            continue
        begin = (left if left > xl else xl) + tolerance
        end = (right if right < xr else xr) - tolerance
        if end <= begin:
            continue
        up, wide = at_right - at_left, right - left
        for x in (begin, end):
            over = at_left + up * (x - left) / wide - (yl + rise * (x - xl) / run)
            if over > least and over > worst:
                other = up / wide
                if over > tolerance * (stretch + sqrt(1 + other * other)):
                    worst, who, where = over, by, x
    if uprights.lines:
        for k in range(uprights.first_ending_after(xl + tolerance), len(uprights.lines)):
            x, _, right, top, by = uprights.lines[k]
            if right >= xr - tolerance:
                break
            over = top - _at(line, x)
            allowed = tolerance * (1 + stretch) + abs(slope) * tolerance
            if x > xl + tolerance and over > allowed and over > worst:
                worst, who, where = over, by, x
    return who, worst, where


NOTHING = _Row()


def _append(new: list[Line], xl: float, xr: float, source: Line) -> None:
    """Add the part of ``source`` from xl to xr, or lengthen the last piece if that is its other part."""
    if xr - xl <= 0:
        return
    if new:
        left, at_left, right, _, by = new[-1]
        if by == source[4] and right == xl:
            new[-1] = (left, at_left, xr, _at(source, xr), by)
            return
    new.append((xl, _at(source, xl), xr, _at(source, xr), source[4]))


def _raise_to(pieces: _Row, line: Line) -> None:
    """Make the envelope the greater of itself and a slanted line."""
    xl, _, xr, _, _ = line
    begin = k = pieces.first_ending_after(xl)
    x = xl
    new: list[Line] = []
    lines = pieces.lines
    while k < len(lines) and lines[k][0] < xr:
        piece = lines[k]
        left, _, right, _, _ = piece
        _append(new, left, min(xl, right), piece)
        _append(new, x, left, line)
        x, end = max(x, left), min(right, xr)
        left_gain, right_gain = _at(line, x) - _at(piece, x), _at(line, end) - _at(piece, end)
        if left_gain >= 0 and right_gain >= 0:
            _append(new, x, end, line)
        elif left_gain <= 0 and right_gain <= 0:
            _append(new, x, end, piece)
        else:
            cross = x + (end - x) * left_gain / (left_gain - right_gain)
            first, second = (line, piece) if left_gain > 0 else (piece, line)
            _append(new, x, cross, first)
            _append(new, cross, end, second)
        x = end
        _append(new, max(xr, left), right, piece)
        k += 1
    _append(new, x, xr, line)  # beyond the last piece
    pieces.splice(begin, k, new)


def _forget_passed(uprights: _Row, line: Line, tolerance: float) -> None:
    """What a slanted line has passed over is no obstacle of its own any more."""
    begin = end = uprights.first_ending_after(line[0] + tolerance)
    while end < len(uprights.lines) and uprights.ends[end] < line[2] - tolerance:
        end += 1
    kept = [upright for upright in uprights.lines[begin:end] if upright[3] > _at(line, upright[0])]
    uprights.splice(begin, end, kept)


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
    pieces, uprights = _Row(), _Row()
    who: list[tuple[int, int]] = []
    how: list[tuple[float, float]] = []
    for k, (x0, y0, x1, y1, number) in enumerate(lines.tolist()):
        by = int(number)
        line = (x0, y0, x1, y1, by) if x0 <= x1 else (x1, y1, x0, y0, by)
        upright = line[2] - line[0] <= 2 * tolerance
        if upright and not prints[k]:
            # It may pass along lines that end or stand at its x, but not through one.
            obstacle, depth, x = _above_upright(pieces, NOTHING, line, tolerance, same_x)
        elif upright:
            obstacle, depth, x = _above_upright(pieces, uprights, line, tolerance, same_x)
        else:
            obstacle, depth, x = _above_slanted(pieces, uprights, line, tolerance)
        if obstacle != NONE:
            who.append((k, obstacle))
            how.append((depth, x))
        if not prints[k]:
            continue
        if upright:
            xl, _, xr, _, _ = line
            place = uprights.first_ending_after(xr)
            uprights.splice(place, place, [(xl, min(y0, y1), xr, max(y0, y1), by)])
        else:
            if uprights.lines:
                _forget_passed(uprights, line, tolerance)
            _raise_to(pieces, line)
    return np.array(who, np.int64).reshape(-1, 2), np.array(how, np.float64).reshape(-1, 2)
