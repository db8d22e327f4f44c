"""Nozzle bodies for property tests, and what they forbid by definition: Shapely and brute force."""

import math

import numpy as np
import shapely
from fields import height_at
from hypothesis import strategies as st

from slicer.nozzle import EPS_MM as PRESS_EPS_MM
from slicer.nozzle import NozzleBody

FAR = 100.0


@st.composite
def bodies(draw, press=(0.0, 0.0, 0.05, 0.2)):
    """Blunt, conical, with a shoulder or without one, with a press of nothing and more."""
    return NozzleBody.of(
        tip_width_mm=draw(st.sampled_from([0.05, 0.3, 0.8, 2.0])),
        cone_deg=draw(st.sampled_from([0.0, 0.0, 8.0, 30.0, 60.0])),
        length_mm=draw(st.sampled_from([math.inf, math.inf, 0.5, 1.2])),
        shoulder_width_mm=draw(st.sampled_from([0.0, 1.0, 4.0])),
        press_mm=draw(st.sampled_from(press)),
        barrel_width_mm=draw(st.sampled_from([0.0, 0.0, 2.5])),
        cone_mm=draw(st.sampled_from([0.0, 0.0, 0.3])),
    )


def hard_core(body: NozzleBody, press: float) -> shapely.Geometry:
    """The body with every face moved inwards, with the tip at (0, 0); closed, so that it touches what it may."""
    top = min(body.length + press, FAR)
    parts = []
    side = max(min(body.barrel, FAR) - press, 0.0)
    slope = math.hypot(1.0, body.flank) * press
    low = press
    if body.flank > 0:
        low = max(press, (slope - body.half_width) / body.flank)
    at_low, at_top = (body.half_width + body.flank * y - slope for y in (low, top))
    if low < top and at_top > 0:
        at_low = max(0.0, at_low)
        cone = shapely.Polygon([(-at_low, low), (at_low, low), (at_top, top), (-at_top, top)])
        parts.append(cone.intersection(shapely.box(-side, 0, side, FAR)) if side else shapely.Polygon())
    wide = body.shoulder - press
    if body.length < FAR and wide > 0:
        parts.append(shapely.box(-wide, top, wide, FAR))
    if body.barrel_from < FAR and side > 0:
        parts.append(shapely.box(-side, body.barrel_from + press, side, FAR))
    return shapely.unary_union(parts)


def lower_boundary(body: NozzleBody, d: float) -> float:
    """Height of the hard core's lower boundary at distance d from the axis; infinite outside of it."""
    press = body.press + PRESS_EPS_MM
    out = math.inf
    slope = math.hypot(1.0, body.flank) * press
    if d >= body.barrel - press and body.flank > 0:
        out = math.inf
    elif d < body.half_width + body.flank * press - slope:
        out = press
    elif body.flank > 0:
        y = (d + slope - body.half_width) / body.flank
        if y <= body.length + press:
            out = y
    if out > body.length + press:
        out = math.inf
    if d < body.barrel - press:
        out = min(out, body.barrel_from + press)
    if d < body.shoulder - press:
        out = min(out, body.length + press)
    return out


def forbidden_below(body: NozzleBody, segment: np.ndarray, x: float, points: int = 2000) -> float:
    """What a printed toolpath forbids to the tip at x, point by point, itself apart; never too much."""
    t = np.linspace(0.0, 1.0, points)[:, None]
    along = segment[0] + t * (segment[1] - segment[0])
    return max(y - lower_boundary(body, abs(x - a)) for a, y in along.tolist())


def own_height(segment: np.ndarray, x: float) -> float:
    """y of a toolpath at x; minus infinity where it is not."""
    low, high = np.sort(segment[:, 0])
    if not low <= x <= high:
        return -math.inf
    return float(segment[:, 1].max()) if high - low <= 1e-9 else height_at(segment, x)
