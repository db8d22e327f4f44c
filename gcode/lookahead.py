"""The speeds at which a planner passes from move to move, as Marlin and Klipper find them.

All functions take the moves of a program that the planner gets, in their order, with arrays of one row for
each: lengths in mm, speeds in mm/s, accelerations in mm/s².
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

STRAIGHT_ON = 0.999999
"""Cosine beyond which two directions count as one, or as opposite."""
SMALL_MM, OCTAGON = 1.0, np.sqrt(0.5)
"""Marlin takes moves shorter than this, that turn by less than 45°, for pieces of an arc."""


@dataclass(frozen=True, eq=False)
class Queue:
    """What the planner is given: m moves.

    Attributes:
        unit: (m, 4), direction in x, y, depth and e; where the feed moves along, by all four.
        length: (m,), of the path, or of the feed where only that moves.
        speed: (m,), the highest that no axis minds.
        acceleration: (m,), likewise.
        asked: (m,), the acceleration along the path that is asked for, whatever the axes can do.
        axis_acceleration: (m, 4), limits of the axes.
        begins: bool (m,), whether the machine stands still before the move.
        moves_nozzle: bool (m,), false where only the feed moves.
        fed: (m,), feed for each mm of the path.
    """

    unit: Floats
    length: Floats
    speed: Floats
    acceleration: Floats
    asked: Floats
    axis_acceleration: Floats
    begins: NDArray[np.bool_]
    moves_nozzle: NDArray[np.bool_]
    fed: Floats


def marlin_times(queue: Queue, deviation_mm: Floats, *, arcs: bool = True) -> Floats:
    """Seconds of each move (m,), with junction deviation as in Marlin's ``planner.cpp``.

    The square of the speed at a junction is a·δ·sin(θ/2)/(1 - sin(θ/2)), with the acceleration that the
    axes allow in the direction in which the corner turns; δ is ``deviation_mm`` (m,). Without ``arcs``, which
    short moves are pieces of is not guessed: so does grbl's ``planner.c``, whence the rule comes.
    """
    if len(queue.length) == 0:
        return np.empty(0)
    return _planned(queue, _marlin_junctions(queue, deviation_mm, arcs))


def reprap_times(queue: Queue, jerk_mm_s: Floats) -> Floats:
    """Seconds of each move (m,), where the speed of no axis jumps by more than ``jerk_mm_s`` (4,).

    So does RepRapFirmware's ``DDA::MatchSpeeds`` (its default, M566 P0, only between moves of a kind).
    """
    if len(queue.length) == 0:
        return np.empty(0)
    # Speeds are along the path, or of the feed where that moves alone.
    part = (
        queue.unit / np.where(queue.moves_nozzle, np.sqrt((queue.unit[:, :3] ** 2).sum(axis=1)), 1.0)[:, None]
    )
    most = np.zeros(len(part))
    jump = np.abs(part[1:] - part[:-1])
    with np.errstate(divide="ignore"):
        corner = (jerk_mm_s / jump).min(axis=1) ** 2
    nominal = np.minimum(queue.speed[1:], queue.speed[:-1]) ** 2
    alike = (queue.fed[1:] > 0) == (queue.fed[:-1] > 0)
    goes_on = ~queue.begins[1:] & alike & queue.moves_nozzle[1:] & queue.moves_nozzle[:-1]
    most[1:] = np.where(goes_on, np.minimum(corner, nominal), 0.0)
    return _planned(queue, most)


def _planned(queue: Queue, most: Floats) -> Floats:
    """Seconds of each move that begins with at most these squares of speeds, and stops at the end."""
    gain = 2 * queue.acceleration * queue.length
    entry = np.array(_reachable(most.tolist(), gain.tolist()))
    leave = np.append(entry[1:], 0.0)
    return _trapezoid(queue.length, queue.acceleration, entry, leave, queue.speed**2)


def _marlin_junctions(queue: Queue, deviation_mm: Floats, arcs: bool) -> Floats:
    """The highest square of the speed with which each move may begin."""
    unit = queue.unit
    most = np.zeros(len(unit))
    if len(unit) < 2:
        return most
    cosine = -(unit[1:] * unit[:-1]).sum(axis=1)  # 1 where the path turns back
    turn = unit[1:] - unit[:-1]
    size = np.sqrt((turn**2).sum(axis=1, keepdims=True))
    turn = np.divide(turn, size, out=np.zeros_like(turn), where=size > 0)
    limits = queue.axis_acceleration[1:]
    per_axis = np.divide(limits, np.abs(turn), out=np.full_like(turn, np.inf), where=turn != 0)
    acceleration = np.minimum(queue.acceleration[1:], per_axis.min(axis=1))
    clipped = np.maximum(cosine, -STRAIGHT_ON)
    sine = np.sqrt(np.maximum(0.0, (1 - clipped) / 2))
    square = acceleration * deviation_mm[1:] * sine / (1 - sine)
    arc = (queue.length[1:] < SMALL_MM) & (cosine < -OCTAGON) & arcs
    angle = np.arccos(np.clip(-clipped, -1.0, 1.0))
    square = np.where(arc, np.minimum(square, queue.length[1:] * acceleration / angle), square)
    square = np.where(cosine > STRAIGHT_ON, 0.0, square)
    nominal = np.minimum(queue.speed[1:], queue.speed[:-1]) ** 2
    most[1:] = np.where(queue.begins[1:], 0.0, np.minimum(square, nominal))
    return most


def klipper_times(
    queue: Queue, corner_mm_s: float, cruise_ratio: float, instant_corner_mm_s: float = 1.0
) -> Floats:
    """Seconds of each move (m,), with square corner velocity as in Klipper's ``toolhead.py``.

    Corners are those of Marlin, with δ = v²·(√2 - 1)/a and never faster than a circle that touches both
    moves in their middles. Where a move would only speed up to slow down again, Klipper takes the highest
    speed from a plan with an acceleration of (1 - ``cruise_ratio``)·a. The feed may jump by
    ``instant_corner_mm_s``. Moves of the feed alone begin and end at rest.
    """
    if len(queue.length) == 0:
        return np.empty(0)
    gain = 2 * queue.acceleration * queue.length
    smooth = np.minimum(gain, 2 * queue.asked * (1 - cruise_ratio) * queue.length)
    most = _klipper_junctions(queue, gain, corner_mm_s, instant_corner_mm_s)
    top = (queue.speed**2).tolist()
    start, cruise, leave = _klipper_plan(most.tolist(), gain.tolist(), smooth.tolist(), top)
    return _trapezoid(queue.length, queue.acceleration, start, leave, cruise)


def _klipper_junctions(queue: Queue, gain: Floats, corner_mm_s: float, instant_mm_s: float) -> Floats:
    """The highest square of the speed with which each move may begin."""
    most = np.zeros(len(gain))
    if len(gain) < 2:
        return most
    # Klipper's directions are those of the nozzle alone.
    nozzle = queue.unit[:, :3]
    size = np.sqrt((nozzle**2).sum(axis=1, keepdims=True))
    nozzle = np.divide(nozzle, size, out=np.zeros_like(nozzle), where=size > 0)
    cosine = -(nozzle[1:] * nozzle[:-1]).sum(axis=1)
    sine, other = np.sqrt(np.maximum((1 - cosine) / 2, 0)), np.sqrt(np.maximum((1 + cosine) / 2, 0))
    bends = (sine < 1) & (other > 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        radius = sine / (1 - sine)
        tangent = sine / other / 4
        jump = instant_mm_s / np.abs(queue.fed[1:] - queue.fed[:-1])
    # The deviation goes with the acceleration that is asked for: what an axis slows turns slower too.
    part = queue.acceleration / queue.asked
    turning = corner_mm_s**2 * (np.sqrt(2) - 1) * np.minimum(part[1:], part[:-1])
    with np.errstate(invalid="ignore"):  # where nothing bends the radius is infinite
        bound = np.minimum(radius * turning, np.minimum(gain[1:], gain[:-1]) * tangent)
    square = np.where(bends, bound, np.inf)
    nominal = np.minimum(queue.speed[1:], queue.speed[:-1]) ** 2
    square = np.minimum(np.minimum(square, nominal), np.where(np.isnan(jump), np.inf, jump**2))
    stops = queue.begins[1:] | ~queue.moves_nozzle[1:] | ~queue.moves_nozzle[:-1]
    most[1:] = np.where(stops, 0.0, square)
    return most


def _klipper_plan(
    most: list[float], gain: list[float], smooth: list[float], top: list[float]
) -> tuple[Floats, Floats, Floats]:
    """Squares of the speeds at the start, in the middle and at the end of each move."""
    count = len(most)
    smoothed_most = [0.0] * count
    before = 0.0
    for k in range(count):
        # A move cannot begin faster than the one before it can end.
        reach = before + (gain[k - 1] if k else 0.0)
        most[k] = before = min(most[k], reach)
        if k:
            smoothed_most[k] = min(most[k], smoothed_most[k - 1] + smooth[k - 1])
    start, cruise, leave = [0.0] * count, [0.0] * count, [0.0] * count
    slowing: list[int] = []  # moves that only slow down, until it is known from which speed
    next_start = next_smoothed = peak = 0.0
    for k in range(count - 1, -1, -1):
        reach, smooth_reach = next_start + gain[k], next_smoothed + smooth[k]
        begin, smoothed = min(most[k], reach), min(smoothed_most[k], smooth_reach)
        start[k], leave[k] = begin, next_start
        if smoothed < smooth_reach:  # it can speed up
            if smoothed + smooth[k] > next_smoothed or slowing:
                peak = min(top[k], (smoothed + smooth_reach) / 2)
                limit = peak
                for j in reversed(slowing):
                    limit = min(limit, start[j])
                    start[j], cruise[j] = min(start[j], limit), limit
                    leave[j] = min(leave[j], limit)
                slowing = []
            cruise[k] = min((begin + reach) / 2, top[k], peak)
            start[k], leave[k] = min(begin, cruise[k]), min(next_start, cruise[k])
        else:
            slowing.append(k)
        next_start, next_smoothed = begin, smoothed
    return np.array(start), np.array(cruise), np.array(leave)


def _reachable(most: list[float], gain: list[float]) -> list[float]:
    """Squares of the entry speeds that every move can slow down to and speed up from."""
    entry = most.copy()
    after = 0.0
    for k in range(len(entry) - 1, -1, -1):
        entry[k] = after = min(entry[k], after + gain[k])
    for k in range(1, len(entry)):
        entry[k] = min(entry[k], entry[k - 1] + gain[k - 1])
    return entry


def _trapezoid(length: Floats, acceleration: Floats, entry: Floats, leave: Floats, top: Floats) -> Floats:
    """Seconds of moves that speed up, hold and slow down; speeds are given by their squares."""
    peak = np.minimum(top, acceleration * length + (entry + leave) / 2)
    peak = np.maximum(peak, np.maximum(entry, leave))  # rounding
    changing = (2 * peak - entry - leave) / (2 * acceleration)
    root = np.sqrt(peak)
    ramps = (2 * root - np.sqrt(entry) - np.sqrt(leave)) / acceleration
    return ramps + np.maximum(0.0, length - changing) / root
