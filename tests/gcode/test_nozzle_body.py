"""The check's model of the nozzle's body: depths against Shapely, and what a replay makes of them."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from gcode.nozzle_body import depths, most, parts_of
from profiles.profile import Nozzle

BODIES = {
    "blunt": Nozzle(tip_width_mm=0.8),
    "cone": Nozzle(tip_width_mm=0.6, cone_deg=30),
    "wide cone": Nozzle(tip_width_mm=1.0, cone_deg=60),
    "shoulder": Nozzle(tip_width_mm=0.5, length_mm=1.5, shoulder_width_mm=3.0),
    "cone and shoulder": Nozzle(tip_width_mm=0.5, cone_deg=10, length_mm=1.0, shoulder_width_mm=2.0),
}
FAR = 100.0
coordinate = st.integers(-40, 40).map(lambda k: k / 20)
line = st.tuples(coordinate, coordinate, coordinate, coordinate)


def polygons(nozzle, press):
    """The parts of a body, every face moved inwards by ``press``: what nothing may enter."""
    lean = np.tan(np.radians(nozzle.cone_deg))
    half = nozzle.tip_width_mm / 2
    outlines = [[(-half, 0), (half, 0), (half + FAR * lean, FAR), (-half - FAR * lean, FAR)]]
    if nozzle.length_mm is not None:
        low, wide = nozzle.length_mm, nozzle.shoulder_width_mm / 2
        outlines.append([(-wide, low), (wide, low), (wide, FAR), (-wide, FAR)])
    return [shapely.Polygon(outline).buffer(-press, join_style="mitre") for outline in outlines]


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
