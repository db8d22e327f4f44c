"""The nozzle's body above the tip: what of it may not be driven into printed material.

Seen from the tip at (0, 0), y up, the body is a needle, a flat of half width r at y = 0 whose flanks open by
the cone angle as far as the half width b of a barrel; the barrel, as wide as that from the height h on; and
from the length L on a shoulder of half width R. Nothing is narrower than what it stands on, so that all three
go up without end:

    {|x| < min(r + y tan(cone), b), y > 0}  and  {|x| < b, y > h}  and  {|x| < R, y > L}

All three are convex and widen upwards, and depth in the deepest of them says all.

Printed material may push by ``press`` into it: every face of the body is moved inwards by so much, and what
is left is the *hard core*. Toolpath A *stands in the way* of B where, with A printed, printing B would push a
point of A into the hard core; or where A lies straight above B, as for a nozzle that is a point.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slicer.errors import SlicerError
from slicer.kernels import allocating_inner_kernel, inner_kernel, kernel

EPS_MM = 1e-7
"""Material that pushes no deeper than ``press`` by this much more only touches the hard core."""


class NozzleBody(NamedTuple):
    """The outline of a nozzle in the plane of the sheet, in mm; a legal argument of kernels.

    Attributes:
        half_width: of the flat around the tip; 0 is a nozzle without a body, a point.
        flank: tangent of the angle between the axis and the flank; 0 for a blunt needle.
        length: from the tip up to the shoulder.
        shoulder: half width of what comes above, no less than that of what it stands on.
        press: how deep printed material may push into the body.
        barrel: half width that the flanks reach at most, no more than ``shoulder`` where there is one.
        barrel_from: height from which it is as wide, below the shoulder; infinity for where the flanks are.
    """

    half_width: float
    flank: float
    length: float
    shoulder: float
    press: float
    barrel: float
    barrel_from: float

    @classmethod
    def of(
        cls,
        tip_width_mm: float,
        cone_deg: float = 0.0,
        length_mm: float = math.inf,
        shoulder_width_mm: float = 0.0,
        press_mm: float = 0.0,
        barrel_width_mm: float = 0.0,
        cone_mm: float = 0.0,
    ) -> "NozzleBody":
        """The body with these dimensions, as a maker's sheet gives them.

        Args:
            shoulder_width_mm: where this is less than the nozzle is wide at ``length_mm``, it goes on as wide
                as there: a hub or a heater block that is said to be narrower, or not said, hides in the cone.
            barrel_width_mm: how wide the cone gets at most, such as a hexagon's corners, and no less than the
                tip; 0 for any width.
            cone_mm: the height of the cone; above it the nozzle is as wide as its barrel. 0 where the flanks
                go on until they are.

        Raises:
            SlicerError: one of them is negative or no number, or the cone is no acute angle.
        """
        for name, value in (
            ("tip_width_mm", tip_width_mm),
            ("cone_deg", cone_deg),
            ("length_mm", length_mm),
            ("shoulder_width_mm", shoulder_width_mm),
            ("press_mm", press_mm),
            ("barrel_width_mm", barrel_width_mm),
            ("cone_mm", cone_mm),
        ):
            if not value >= 0:
                raise SlicerError(f"{name} {value:g} must be at least 0")
        if cone_deg >= 90:
            raise SlicerError(f"cone_deg {cone_deg:g} must be below 90: it is the angle from the axis")
        half, flank = tip_width_mm / 2, math.tan(math.radians(cone_deg))
        barrel = max(barrel_width_mm / 2, half) if barrel_width_mm > 0 else math.inf
        barrel_from = math.inf
        if 0 < cone_mm < length_mm:
            at_end = half + flank * cone_mm
            barrel = max(barrel, at_end) if barrel_width_mm > 0 else at_end
            barrel_from = cone_mm
        shoulder = shoulder_width_mm / 2
        if length_mm < math.inf:
            at_length = barrel if barrel_from < math.inf else min(half + flank * length_mm, barrel)
            shoulder = max(shoulder, at_length)
            barrel = min(barrel, shoulder)
        # Plain floats all: kernels would be compiled once more for whole numbers.
        return cls(*map(float, (half, flank, length_mm, shoulder, press_mm, barrel, barrel_from)))

    @property
    def is_point(self) -> bool:
        """Whether this is the nozzle of the source paper, which has no body at all."""
        return self.half_width == 0.0

    def beside(self, height_mm: float) -> float:
        """How far from the axis material that stands so much higher than the tip is out of the way, in mm."""
        deep = height_mm - self.press
        if self.is_point or deep <= 0:
            return 0.0
        core = self.half_width + self.flank * height_mm - self.press * math.hypot(1.0, self.flank)
        core = self.barrel - self.press if deep > self.barrel_from else min(core, self.barrel - self.press)
        return max(0.0, core, self.shoulder - self.press if deep > self.length else 0.0)


DOWNHILL_SLACK_DEG = 1e-6
"""So that what is exactly as steep as allowed is allowed, however it is rounded."""

POINT = NozzleBody(0.0, 0.0, math.inf, 0.0, 0.0, math.inf, math.inf)
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
    steepest = downhill_deg + DOWNHILL_SLACK_DEG
    return np.stack([rise >= -steepest, rise <= steepest], axis=1)


@inner_kernel
def press_depth(body: NozzleBody, a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """How deep toolpath a, printed, pushes into the body while b is printed, in mm; 0 or less for not at all.

    The depth of a point is its distance to the nearest face of the part that it is deepest in. The
    differences of points of a and b fill a parallelogram, over which the least of linear functions is
    maximised. As the body widens upwards, depth never falls on the way up: the deepest point lies on a side.

    Args:
        a, b: float64 (2, 2), [endpoint, xy] in mm.
    """
    deepest = _deepest(a, b, needle_of(body))
    if body.barrel_from < np.inf:
        deepest = max(deepest, _deepest(a, b, barrel_of(body)))
    if body.length < np.inf:
        deepest = max(deepest, _deepest(a, b, shoulder_of(body)))
    return deepest


@inner_kernel
def stands_in_the_way(body: NozzleBody, a: NDArray[np.float64], b: NDArray[np.float64]) -> bool:
    """Whether a, printed, hinders the printing of b by the body; straight above it is another matter."""
    return body.half_width > 0.0 and press_depth(body, a, b) > body.press + EPS_MM


Faces = tuple[float, float, float, float, float]
"""Of a part: y of its bottom, cosine and sine of its flanks' angle, their distance to (0, 0), half width."""


@inner_kernel
def needle_of(body: NozzleBody) -> Faces:
    cosine = 1.0 / np.sqrt(1.0 + body.flank * body.flank)
    barrel = body.barrel if body.flank > 0.0 else np.inf
    return 0.0, cosine, body.flank * cosine, body.half_width * cosine, barrel


@inner_kernel
def barrel_of(body: NozzleBody) -> Faces:
    return body.barrel_from, 1.0, 0.0, body.barrel, np.inf


@inner_kernel
def shoulder_of(body: NozzleBody) -> Faces:
    return body.length, 1.0, 0.0, body.shoulder, np.inf


@inner_kernel
def face_count(faces: Faces) -> int:
    """How many faces there are to look at: the bottom, two flanks, and two sides where the flanks end."""
    return 3 if faces[4] == np.inf else 5


@inner_kernel
def _deepest(a: NDArray[np.float64], b: NDArray[np.float64], faces: Faces) -> float:
    """The greatest, over the parallelogram a - b, of the least distance to the faces of a part."""
    deepest = -np.inf
    count = face_count(faces)
    for corner in range(4):
        # Corners in turn; sides run from each to the next.
        x0, y0 = _corner(a, b, corner)
        x1, y1 = _corner(a, b, (corner + 1) % 4)
        deepest = max(deepest, _depth(faces, x0, y0))
        if max(y0, y1) - faces[0] <= deepest:
            continue
        # Along a side the least of linear functions is greatest at an end, or where two of them are equal.
        for first in range(count):
            for second in range(first + 1, count):
                d0 = face(faces, first, x0, y0) - face(faces, second, x0, y0)
                d1 = face(faces, first, x1, y1) - face(faces, second, x1, y1)
                if d0 * d1 < 0.0:
                    t = d0 / (d0 - d1)
                    deepest = max(deepest, _depth(faces, x0 + t * (x1 - x0), y0 + t * (y1 - y0)))
    return deepest


@inner_kernel
def face(faces: Faces, number: int, x: float, y: float) -> float:
    """Distance of (x, y) to a face, inwards: the bottom, the flanks, the sides above them, right first."""
    floor, cosine, sine, reach, half = faces
    if number == 0:
        return y - floor
    if number < 3:
        return reach + sine * y - (cosine * x if number == 1 else -cosine * x)
    return half - (x if number == 3 else -x)


@inner_kernel
def _depth(faces: Faces, x: float, y: float) -> float:
    floor, cosine, sine, reach, half = faces
    return min(y - floor, reach + sine * y - cosine * abs(x), half - abs(x))


@inner_kernel
def _corner(a: NDArray[np.float64], b: NDArray[np.float64], corner: int) -> tuple[float, float]:
    i = 1 if corner == 1 or corner == 2 else 0
    j = 1 if corner >= 2 else 0
    return a[i, 0] - b[j, 0], a[i, 1] - b[j, 1]


@allocating_inner_kernel
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
