"""A program replayed with the nozzle's body: what of the printed pushes into it, how deep, and where.

What a move lays counts for all moves after it, the line that fills the nozzle included. One thing is
excused: a tip that has come down a toolpath stands with the rear edge of its flat in the bead that it has
just laid. So a straight run of extrusions does not count against itself, and for the way from its end to the
next extrusion it counts only where it pushes deeper than it did at that end.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gcode.nozzle_body import Faces, FloatArray, depths, most, parts_of
from gcode.strokes import Stroke, goes_on
from gcode.violation import Violation
from profiles.sections import Nozzle

GROUP = 64
"""Moves that are looked at together: neighbours in the program are mostly neighbours on the sheet."""


class Press(NamedTuple):
    """A move during which something printed pushes into the body.

    Attributes:
        depth_mm: how deep.
        line, against: program lines of the move, and of what was printed.
        x_mm, y_mm: of the tip at that moment, in the plane of the sheet.
    """

    depth_mm: float
    line: int
    against: int
    x_mm: float
    y_mm: float


class Pressing(NamedTuple):
    """What a replay with a body found.

    Attributes:
        deepest: None where nothing pushes into it at all.
        allowed_mm: how deep it may be, by the profile.
    """

    deepest: Press | None
    allowed_mm: float

    def facts(self) -> dict[str, float | int | None]:
        """The same for JSON, in mm and program lines."""
        deepest = dict.fromkeys(Press._fields) if self.deepest is None else self.deepest._asdict()
        values = {**deepest, "allowed_mm": self.allowed_mm}
        return {key: round(value, 4) if isinstance(value, float) else value for key, value in values.items()}


def check_nozzle(
    laid: list[Stroke], nozzle: Nozzle, allowed_mm: float, resolution_mm: float
) -> tuple[list[Violation], Pressing | None]:
    """What pushes deeper into the body than it may, and what moves down too steeply while it extrudes.

    Args:
        laid: every movement of the program.
        allowed_mm: how deep printed material may push.
        resolution_mm: how far off either end of a line may be.

    Returns:
        The violations, and the deepest press even where it is allowed; None for a nozzle that is a point.
    """
    found = _downhill(laid, nozzle, resolution_mm)
    if nozzle.tip_width_mm <= 0:
        return found, None
    deepest: Press | None = None
    limit = allowed_mm + 2 * resolution_mm
    for k, press in presses(laid, nozzle, limit):
        if deepest is None or press.depth_mm > deepest.depth_mm:
            deepest = press
        if press.depth_mm > limit:
            what = "extrusion" if laid[k].prints else "travel"
            text = (
                f"{what} to ({laid[k].x1:.3f}, {laid[k].y1:.3f}) drives the nozzle {press.depth_mm:.3f} mm "
                f"into what line {press.against} printed, its tip at ({press.x_mm:.3f}, {press.y_mm:.3f}); "
                f"{allowed_mm:.3f} mm are allowed"
            )
            found.append(Violation(press.line, "nozzle", text))
    return found, Pressing(deepest, allowed_mm)


def presses(laid: list[Stroke], nozzle: Nozzle, enough_mm: float) -> list[tuple[int, Press]]:
    """The deepest press of each move that has one deeper than ``enough_mm``, or deeper than all before it.

    Returns:
        (index of the move, its press), in the order of the program.
    """
    parts = parts_of(nozzle)
    lines = np.array([stroke[:4] for stroke in laid], np.float64).reshape(-1, 4)
    printed = np.flatnonzero([stroke.prints for stroke in laid])
    first, last, excused = _own_beads(parts, laid, lines)
    boxes, blocks = _boxes(lines), _blocks(_boxes(lines[printed]))
    found: list[tuple[int, Press]] = []
    deepest = 0.0
    for begin in range(0, len(laid), GROUP):
        group = slice(begin, begin + GROUP)
        # What is printed within the group, too: whether before or after a move is seen pair by pair.
        before = int(np.searchsorted(printed, begin + GROUP))
        low, high = boxes[group, 0].min(), boxes[group, 2].max()
        floor = boxes[group, 1].min()
        least = min(enough_mm, deepest)

        def near(other: FloatArray, low: float = low, high: float = high, floor: float = floor) -> FloatArray:
            apart = np.maximum(0.0, np.maximum(other[:, 0] - high, low - other[:, 2]))
            return most(parts, apart, other[:, 3] - floor)

        some = np.flatnonzero(near(blocks[: -(-before // GROUP)]) > least)
        candidates = (some[:, None] * GROUP + np.arange(GROUP)).ravel()
        candidates = printed[candidates[candidates < before]]
        candidates = candidates[near(boxes[candidates]) > least]
        move, other = _pairs(parts, boxes, np.arange(begin, min(begin + GROUP, len(laid))), candidates, least)
        if len(move) == 0:
            continue
        depth, x, y = depths(parts, lines[other], lines[move])
        own = (first[move] <= other) & (other < last[move]) & (depth <= excused[move])
        depth = np.where(own, -np.inf, depth)
        order = np.lexsort((-depth, move))
        order = order[np.concatenate([[True], np.diff(move[order]) > 0])]
        for at in order[depth[order] > least].tolist():
            if depth[at] > min(enough_mm, deepest):
                deepest = max(deepest, float(depth[at]))
                k, by = int(move[at]), laid[int(other[at])].line
                found.append((k, Press(float(depth[at]), laid[k].line, by, float(x[at]), float(y[at]))))
    return found


def _pairs(
    parts: list[Faces],
    boxes: FloatArray,
    moves: NDArray[np.intp],
    printed: NDArray[np.intp],
    least: float,
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Moves and what was printed before them, where their boxes allow a press deeper than ``least``."""
    a, b = boxes[printed][None], boxes[moves][:, None]
    apart = np.maximum(0.0, np.maximum(a[..., 0] - b[..., 2], b[..., 0] - a[..., 2]))
    possible = most(parts, apart, a[..., 3] - b[..., 1]) > least
    possible &= printed[None] < moves[:, None]
    i, j = np.nonzero(possible)
    return moves[i], printed[j]


def _boxes(lines: FloatArray) -> FloatArray:
    """float64 (n, 4), left, bottom, right and top of each line."""
    ends = lines.reshape(-1, 2, 2)
    return np.concatenate([ends.min(axis=1), ends.max(axis=1)], axis=1)


def _blocks(boxes: FloatArray) -> FloatArray:
    """The boxes around ``GROUP`` boxes each."""
    if len(boxes) == 0:
        return boxes
    at = np.arange(0, len(boxes), GROUP)
    low, high = np.minimum.reduceat(boxes[:, :2], at), np.maximum.reduceat(boxes[:, 2:], at)
    return np.concatenate([low, high], axis=1)


def _own_beads(
    parts: list[Faces], laid: Sequence[Stroke], lines: FloatArray
) -> tuple[NDArray[np.intp], NDArray[np.intp], FloatArray]:
    """For each move the strokes of the bead just laid, from ``first`` to before ``last``, and up to which
    depth they are excused: any while that bead goes straight on, on the way from its end that at the end.
    """
    n = len(laid)
    own, straight = np.zeros((n, 2), np.intp), np.zeros(n, np.bool_)
    begin = end = 0  # of the last straight run
    away = True  # whether a travel has led away from its end
    for k, stroke in enumerate(laid):
        ahead = stroke.prints and not away and goes_on(_whole(laid, begin, end), stroke)
        straight[k] = ahead
        if not (stroke.prints and away):
            own[k] = begin, end
        if stroke.prints:
            begin, end = begin if ahead else k, k + 1
        away = not stroke.prints
    excused = _depth_at_end(parts, lines, own) + EXCUSED_MM
    return own[:, 0], own[:, 1], np.where(straight, np.inf, excused)


def _depth_at_end(parts: list[Faces], lines: FloatArray, runs: NDArray[np.intp]) -> FloatArray:
    """How deep strokes from ``runs[k, 0]`` to before ``runs[k, 1]`` push with the tip at their end."""
    length = runs[:, 1] - runs[:, 0]
    start = np.cumsum(length) - length
    stroke = np.repeat(runs[:, 0] - start, length) + np.arange(int(length.sum()))
    tip = np.tile(lines[np.repeat(runs[:, 1] - 1, length), 2:], 2)
    out = np.full(len(runs), -np.inf)
    some = length > 0
    if some.any():
        out[some] = np.maximum.reduceat(depths(parts, lines[stroke], tip).depth, start[some])
    return out


EXCUSED_MM = 0.002
"""Rounding of text may make a departure deeper by this."""


def _whole(laid: Sequence[Stroke], begin: int, end: int) -> Stroke:
    """A straight run as one stroke."""
    return laid[begin]._replace(x1=laid[end - 1].x1, y1=laid[end - 1].y1)


def _downhill(laid: Sequence[Stroke], nozzle: Nozzle, resolution_mm: float) -> list[Violation]:
    if nozzle.downhill_deg >= 90:
        return []
    steepest = math.tan(math.radians(nozzle.downhill_deg))
    found = []
    for stroke in laid:
        drop, run = stroke.y0 - stroke.y1, abs(stroke.x1 - stroke.x0)
        if stroke.prints and drop - 2 * resolution_mm > (run + 2 * resolution_mm) * steepest:
            tilt = math.degrees(math.atan2(drop, run))
            text = (
                f"extrudes downhill at {tilt:.2f} degrees to ({stroke.x1:.3f}, {stroke.y1:.3f}); "
                f"{nozzle.downhill_deg:g} are allowed"
            )
            found.append(Violation(stroke.line, "nozzle", text))
    return found
