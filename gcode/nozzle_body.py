"""The nozzle's body as the check sees it: how deep a printed line pushes into it on the way along another.

It is independent of the planner on purpose. Seen from the tip, the body is a needle, a flat whose flanks open
upwards until they are as far apart as the barrel, or as the shoulder where the profile knows no barrel; and
barrel and shoulder are all that is less than their half width away from the axis, from their height on. None
is narrower than what it stands on. The depth of a point is its distance to the nearest face of the part that
it is deepest in.

With one line printed and the tip on another, the differences of their points fill a parallelogram. In a body
that widens upwards depth grows with height, so the deepest of them lies on its upper edge: two lines, taken
from left to right. Along them depth is the least of a few linear functions, hence concave, and its greatest
value stands at an end, above the axis, or where two of the functions cross. All is done for many pairs at
once.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from profiles.sections import Nozzle

FloatArray = NDArray[np.float64]


class Faces(NamedTuple):
    """One of the parts of a body: a bottom at ``floor``, and two sides that lean outwards by an angle.

    Attributes:
        floor: height of the bottom above the tip, in mm.
        half: half of its width there.
        sine, cosine: of the angle between its sides and the axis.
        widest: half of the width at which its sides turn upright.
    """

    floor: float
    half: float
    sine: float
    cosine: float
    widest: float

    def depth(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """How deep points lie inside, seen from the tip; 0 or less outside."""
        out = np.abs(x)
        leaning = (self.half - out) * self.cosine + y * self.sine
        return np.minimum(np.minimum(y - self.floor, leaning), self.widest - out)


def parts_of(nozzle: Nozzle) -> list[Faces]:
    """The parts of a profile's nozzle; none where it is a point."""
    if nozzle.tip_width_mm <= 0:
        return []
    angle, half = math.radians(nozzle.cone_deg), nozzle.tip_width_mm / 2
    widest = max(nozzle.barrel_width_mm / 2, half) if nozzle.barrel_width_mm > 0 else math.inf
    length = math.inf if nozzle.length_mm is None else nozzle.length_mm
    above = []
    end = min(half + length * math.tan(angle), widest) if angle > 0 else half
    if 0 < nozzle.cone_mm < length:
        end = half + nozzle.cone_mm * math.tan(angle)
        end = widest = max(end, widest) if widest < math.inf else end
        above.append(Faces(nozzle.cone_mm, end, 0.0, 1.0, end))
    if length < math.inf:
        end = max(nozzle.shoulder_width_mm / 2, end)
        above.append(Faces(length, end, 0.0, 1.0, end))
        widest = min(widest, end)
    return [Faces(0.0, half, math.sin(angle), math.cos(angle), widest), *above]


class Depths(NamedTuple):
    """How deep, and where the tip stands then: arrays of one length, in mm."""

    depth: FloatArray
    x: FloatArray
    y: FloatArray


def depths(parts: list[Faces], printed: FloatArray, path: FloatArray) -> Depths:
    """The greatest depth to which printed lines push into the body while the tip goes along paths.

    Args:
        printed, path: float64 (p, 4), x and y of both ends of the one and of the other, pair by pair.
    """
    a, b = _left_to_right(printed), _left_to_right(path)
    rise_a, rise_b = a[:, 2:] - a[:, :2], b[:, 2:] - b[:, :2]
    # The upper edge begins with the steeper line. It is walked to the right; the tip walks to the left.
    a_first = rise_a[:, 1] * rise_b[:, 0] > rise_b[:, 1] * rise_a[:, 0]
    step = np.where(a_first[:, None], rise_a, rise_b)
    corner = a[:, :2] - b[:, 2:]
    middle, end = corner + step, a[:, 2:] - b[:, :2]
    turn = np.where(a_first[:, None], b[:, 2:], b[:, :2])
    best = Depths(np.full(len(a), -np.inf), b[:, 2].copy(), b[:, 3].copy())
    for part in parts:
        for from_, to, tip_from, tip_to in (
            (corner, middle, b[:, 2:], turn),
            (middle, end, turn, b[:, :2]),
        ):
            at, depth = _deepest_along(part, from_, to)
            better = depth > best.depth
            tip = tip_from + at[:, None] * (tip_to - tip_from)
            best = Depths(
                np.where(better, depth, best.depth),
                np.where(better, tip[:, 0], best.x),
                np.where(better, tip[:, 1], best.y),
            )
    return best


def _left_to_right(lines: FloatArray) -> FloatArray:
    """Lines with their left end first; of an upright one the lower end."""
    upright = lines[:, 0] == lines[:, 2]
    turned = (lines[:, 0] > lines[:, 2]) | (upright & (lines[:, 1] > lines[:, 3]))
    return np.where(turned[:, None], lines[:, [2, 3, 0, 1]], lines)


def _deepest_along(part: Faces, from_: FloatArray, to: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Where between two points (p, 2) depth is greatest, as a part of the way, and how great it is."""
    x, y = from_.T
    dx, dy = (to - from_).T
    places = [np.zeros(len(x)), np.ones(len(x)), _zero(x, dx)]
    for side in (1.0, -1.0):
        # The bottom is as far as this side: y - floor = (half - side x) cosine + y sine.
        leaning = (part.half - side * x) * part.cosine + y * part.sine
        slope = -side * dx * part.cosine + dy * part.sine
        places.append(_zero(leaning - (y - part.floor), slope - dy))
        if part.sine > 0.0 and part.widest < math.inf:
            # As far as where this side turns upright is the bottom, or the side itself below.
            upright = part.widest - side * x
            places.append(_zero(upright - (y - part.floor), -side * dx - dy))
            places.append(_zero(upright - leaning, -side * dx - slope))
    found = np.stack([part.depth(x + at * dx, y + at * dy) for at in places])
    best = found.argmax(axis=0)
    rows = np.arange(len(x))
    return np.stack(places)[best, rows], found[best, rows]


def _zero(value: FloatArray, slope: FloatArray) -> FloatArray:
    """Where a linear function is 0, kept between 0 and 1."""
    safe = np.where(slope == 0.0, 1.0, slope)
    return np.clip(np.where(slope == 0.0, 0.0, -value / safe), 0.0, 1.0)


def most(parts: list[Faces], apart: FloatArray, above: FloatArray) -> FloatArray:
    """No pair pushes deeper that is so far apart along x, with the printed at most so far above the path."""
    found = parts[0].depth(apart, above)
    for part in parts[1:]:
        found = np.maximum(found, part.depth(apart, above))
    return found
