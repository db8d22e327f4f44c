"""The check's model of the nozzle's body: depths against Shapely, and what a replay makes of them."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from gcode.nozzle_body import depths, most, parts_of
from profiles.sections import Nozzle

BODIES = {
    "blunt": Nozzle(tip_width_mm=0.8),
    "cone": Nozzle(tip_width_mm=0.6, cone_deg=30),
    "wide cone": Nozzle(tip_width_mm=1.0, cone_deg=60),
    "shoulder": Nozzle(tip_width_mm=0.5, length_mm=1.5, shoulder_width_mm=3.0),
    "cone and shoulder": Nozzle(tip_width_mm=0.5, cone_deg=10, length_mm=1.0, shoulder_width_mm=2.0),
    "cone up to a barrel": Nozzle(tip_width_mm=0.5, cone_deg=60, barrel_width_mm=1.5),
    "all of them": Nozzle(
        tip_width_mm=0.4, cone_deg=50, length_mm=0.8, barrel_width_mm=1.6, shoulder_width_mm=2.4
    ),
    "cone under a collar": Nozzle(
        tip_width_mm=0.4, cone_deg=45, cone_mm=0.3, length_mm=0.8, barrel_width_mm=1.2, shoulder_width_mm=2.4
    ),
    "cone that ends": Nozzle(tip_width_mm=0.4, cone_deg=45, cone_mm=0.3),
    "cone that ends under a shoulder as wide": Nozzle(tip_width_mm=0.4, cone_deg=45, length_mm=0.5),
}
FAR = 100.0
coordinate = st.integers(-40, 40).map(lambda k: k / 20)
line = st.tuples(coordinate, coordinate, coordinate, coordinate)


def polygons(nozzle, press):
    """The parts of a body, every face moved inwards by ``press``: what nothing may enter."""
    lean = np.tan(np.radians(nozzle.cone_deg))
    half = nozzle.tip_width_mm / 2
    barrel = nozzle.barrel_width_mm / 2 or (FAR if not nozzle.cone_mm else half + nozzle.cone_mm * lean)
    needle = shapely.Polygon([(-half, 0), (half, 0), (half + FAR * lean, FAR), (-half - FAR * lean, FAR)])
    outlines = [needle.intersection(shapely.box(-barrel, 0, barrel, FAR))]
    if nozzle.cone_mm:
        outlines.append(shapely.box(-barrel, nozzle.cone_mm, barrel, FAR))
    if nozzle.length_mm is not None:
        low = nozzle.length_mm
        # What the shoulder stands on is as wide as the needle's edge just below it.
        level = shapely.LineString([(-FAR, low), (FAR, low)])
        wide = max(nozzle.shoulder_width_mm / 2, shapely.union_all(outlines).intersection(level).bounds[2])
        outlines[0] = outlines[0].intersection(shapely.box(-wide, 0, wide, FAR))
        outlines.append(shapely.box(-wide, low, wide, FAR))
    return [outline.buffer(-press, join_style="mitre") for outline in outlines]


def differences(printed, path):
    """All differences of points of the one and of the other."""
    a, b = np.reshape(printed, (2, 2)), np.reshape(path, (2, 2))
    return shapely.MultiPoint((a[:, None] - b[None]).reshape(-1, 2)).convex_hull


@pytest.mark.parametrize("body", BODIES)
@settings(max_examples=150, deadline=None)
@given(line, line)
def test_depth_is_where_shapely_sees_the_shrunken_body_touched(body, printed, path):
    nozzle = BODIES[body]
    found = depths(parts_of(nozzle), np.array([printed]), np.array([path]))
    depth, tip = float(found.depth[0]), (float(found.x[0]), float(found.y[0]))
    area = differences(printed, path)
    if depth > 1e-3:
        assert any(area.distance(part) < 1e-7 for part in polygons(nozzle, depth - 1e-3))
    deeper = polygons(nozzle, max(depth, 0.0) + 1e-3)
    assert not any(area.distance(part) < 1e-7 for part in deeper if not part.is_empty)
    assert shapely.LineString(np.reshape(path, (2, 2))).distance(shapely.Point(tip)) < 1e-7
    there = depths(parts_of(nozzle), np.array([printed]), np.array([[*tip, *tip]]))
    assert there.depth[0] == pytest.approx(depth, abs=1e-7)


@pytest.mark.parametrize("body", BODIES)
@settings(max_examples=100, deadline=None)
@given(line, line)
def test_no_pair_pushes_deeper_than_its_box_tells(body, printed, path):
    parts = parts_of(BODIES[body])
    a, b = np.reshape(printed, (2, 2)), np.reshape(path, (2, 2))
    apart = max(0.0, a[:, 0].min() - b[:, 0].max(), b[:, 0].min() - a[:, 0].max())
    above = a[:, 1].max() - b[:, 1].min()
    depth = depths(parts, np.array([printed]), np.array([path])).depth[0]
    assert depth <= most(parts, np.array([apart]), np.array([above]))[0] + 1e-12


def test_a_point_has_no_parts():
    assert parts_of(Nozzle(cone_deg=30, length_mm=2, shoulder_width_mm=5)) == []
