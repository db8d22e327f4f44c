"""The nozzle's body above the tip: what of it may not be driven into printed material.

Seen from the tip at (0, 0), y up, the body is a flat of half width r at y = 0 whose flanks open by the cone
angle, up to the length L of the nozzle; above that stands a shoulder of half width R:

    {|x| < r + y tan(cone), 0 < y <= L}  and  {|x| < R, y > L}

Printed material may push by ``press`` into it: every face of the body is moved inwards by so much, and what
is left is the *hard core*. Toolpath A *stands in the way* of B where, with A printed, printing B would push a
point of A into the hard core; or where A lies straight above B, as for a nozzle that is a point.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.errors import SlicerError
from slicer.kernels import inner_kernel, kernel

EPS_MM = 1e-7
"""Material that pushes no deeper than ``press`` by this much more only touches the hard core."""


class NozzleBody(NamedTuple):
    """The outline of a nozzle in the plane of the sheet, in mm; a legal argument of kernels.

    Attributes:
        half_width: of the flat around the tip; 0 is a nozzle without a body, a point.
        flank: tangent of the angle between the axis and the flank; 0 for a blunt needle.
        length: from the tip up to the shoulder.
        shoulder: half width of what comes above.
        press: how deep printed material may push into the body.
    """

    half_width: float
    flank: float
    length: float
    shoulder: float
    press: float

    @classmethod
    def of(
        cls,
        tip_width_mm: float,
        cone_deg: float = 0.0,
        length_mm: float = math.inf,
        shoulder_width_mm: float = 0.0,
        press_mm: float = 0.0,
    ) -> "NozzleBody":
        """The body with these dimensions, as a maker's sheet gives them.

        Raises:
            SlicerError: one of them is negative or no number, or the cone is no acute angle.
        """
        for name, value in (
            ("tip_width_mm", tip_width_mm),
            ("cone_deg", cone_deg),
            ("length_mm", length_mm),
            ("shoulder_width_mm", shoulder_width_mm),
            ("press_mm", press_mm),
        ):
            if not value >= 0:
                raise SlicerError(f"{name} {value:g} must be at least 0")
        if cone_deg >= 90:
            raise SlicerError(f"cone_deg {cone_deg:g} must be below 90: it is the angle from the axis")
        # Plain floats all: kernels would be compiled once more for whole numbers.
        return cls(
            float(tip_width_mm / 2),
            math.tan(math.radians(cone_deg)),
            float(length_mm),
            float(shoulder_width_mm / 2),
            float(press_mm),
        )

    @property
    def is_point(self) -> bool:
        """Whether this is the nozzle of the source paper, which has no body at all."""
        return self.half_width == 0.0

    def beside(self, height_mm: float) -> float:
        """How far from the axis material that stands so much higher than the tip is out of the way, in mm."""
        deep = height_mm - self.press
        if self.is_point or deep <= 0:
            return 0.0
        core = self.half_width + self.flank * min(height_mm, self.length + self.press)
        core -= self.press * math.hypot(1.0, self.flank)
        return max(0.0, core, self.shoulder - self.press if deep > self.length else 0.0)


POINT = NozzleBody(0.0, 0.0, math.inf, 0.0, 0.0)
"""The nozzle of the source paper."""


def allowed_directions(segments: NDArray[np.float64], downhill_deg: float) -> NDArray[np.bool_]:
    """bool (n, 2): whether toolpath s may be printed from its endpoint f.

    A flat tip that moves down while it extrudes scrapes with its rear edge what it has just laid; how steep
    that may be is a matter of the material. Upwards and level is always allowed.

    Args:
        segments: float (n, 2, 2), [endpoint, xy] in mm.
        downhill_deg: the steepest tilt, in degrees, at which the tip may move downwards; 90 for any.
    """
    d = segments[:, 1] - segments[:, 0]
    rise = np.degrees(np.arctan2(d[:, 1], np.abs(d[:, 0])))
    steepest = downhill_deg + 1e-6
    return np.stack([rise >= -steepest, rise <= steepest], axis=1)


@inner_kernel
def press_depth(body: NozzleBody, a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """How deep toolpath a, printed, pushes into the body while b is printed, in mm; 0 or less for not at all.

    The depth of a point is its distance to the nearest face of the needle or of the shoulder. The differences
    of points of a and b fill a parallelogram, over which the least of three linear functions is maximised: a
    linear programme whose optimum lies where three of the faces and sides meet.

    Args:
        a, b: float64 (2, 2), [endpoint, xy] in mm.
    """
    cosine = 1.0 / np.sqrt(1.0 + body.flank * body.flank)
    needle = _deepest(a, b, 0.0, cosine, body.flank * cosine, body.half_width * cosine)
    if body.length == np.inf:
        return needle
    return max(needle, _deepest(a, b, body.length, 1.0, 0.0, body.shoulder))


@inner_kernel
def stands_in_the_way(body: NozzleBody, a: NDArray[np.float64], b: NDArray[np.float64]) -> bool:
    """Whether a, printed, hinders the printing of b by the body; straight above it is another matter."""
    return body.half_width > 0.0 and press_depth(body, a, b) > body.press + EPS_MM


@inner_kernel
def _face(face: int, x: float, y: float, floor: float, sx: float, sy: float, c: float) -> float:
    """Distance of (x, y) to a face, inwards: the bottom, or the side on the right or on the left."""
    if face == 0:
        return y - floor
    return c + sy * y - (sx * x if face == 1 else -sx * x)


@inner_kernel
def _deepest(
    a: NDArray[np.float64], b: NDArray[np.float64], floor: float, sx: float, sy: float, c: float
) -> float:
    """The greatest, over the parallelogram a - b, of the least distance to three faces; see ``_face``."""
    # Corners in turn; sides run from each to the next.
    deepest = -np.inf
    low_x = low_y = np.inf
    high_x = high_y = -np.inf
    for corner in range(4):
        x0, y0 = _corner(a, b, corner)
        x1, y1 = _corner(a, b, (corner + 1) % 4)
        low_x, high_x = min(low_x, x0), max(high_x, x0)
        low_y, high_y = min(low_y, y0), max(high_y, y0)
        deepest = max(deepest, _least(x0, y0, floor, sx, sy, c))
        for first in range(3):
            for second in range(first + 1, 3):
                d0 = _face(first, x0, y0, floor, sx, sy, c) - _face(second, x0, y0, floor, sx, sy, c)
                d1 = _face(first, x1, y1, floor, sx, sy, c) - _face(second, x1, y1, floor, sx, sy, c)
                if d0 * d1 < 0.0:
                    t = d0 / (d0 - d1)
                    x, y = x0 + t * (x1 - x0), y0 + t * (y1 - y0)
                    deepest = max(deepest, _least(x, y, floor, sx, sy, c))
    # Inside, all three faces are equally far at one point on the axis; two alone have no greatest there, but
    # where the sides are upright: then any point of the axis will do that lies high enough, also on a side.
    if sy < 1.0:
        y = (c + floor) / (1.0 - sy)
        if low_x < 0.0 < high_x and low_y < y < high_y and _holds(a, b, 0.0, y):
            deepest = max(deepest, _least(0.0, y, floor, sx, sy, c))
    return deepest


@inner_kernel
def _least(x: float, y: float, floor: float, sx: float, sy: float, c: float) -> float:
    return min(y - floor, c + sy * y - sx * abs(x))


@inner_kernel
def _corner(a: NDArray[np.float64], b: NDArray[np.float64], corner: int) -> tuple[float, float]:
    i = 1 if corner == 1 or corner == 2 else 0
    j = 1 if corner >= 2 else 0
    return a[i, 0] - b[j, 0], a[i, 1] - b[j, 1]


@inner_kernel
def _holds(a: NDArray[np.float64], b: NDArray[np.float64], x: float, y: float) -> bool:
    """Whether (x, y) lies in the parallelogram a - b."""
    left = right = False
    for corner in range(4):
        x0, y0 = _corner(a, b, corner)
        x1, y1 = _corner(a, b, (corner + 1) % 4)
        turn = (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0)
        left |= turn > 0.0
        right |= turn < 0.0
    return not (left and right)


@kernel
def in_the_way(body: NozzleBody, segments: NDArray[np.float64]) -> NDArray[np.bool_]:
    """bool (n, n): whether toolpath [a] stands in the way of [b] by the body. For few toolpaths."""
    n = len(segments)
    out = np.zeros((n, n), np.bool_)
    for i in range(n):
        for j in range(n):
            if i != j:
                out[i, j] = stands_in_the_way(body, segments[i], segments[j])
    return out


@kernel
def press_depths(
    body: NozzleBody, segments: NDArray[np.float64], first: NDArray[np.int64], second: NDArray[np.int64]
) -> NDArray[np.float64]:
    """float64 (m,): how deep ``first[k]``, printed, pushes into the body while ``second[k]`` is printed."""
    out = np.empty(len(first))
    for k in range(len(first)):
        out[k] = press_depth(body, segments[first[k]], segments[second[k]])
    return out
