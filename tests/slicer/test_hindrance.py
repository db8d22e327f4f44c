"""Precedence under a nozzle with a body, against Shapely's intersections over all pairs."""

import math

import numpy as np
import pytest
import shapely
from fields import closure, loose_segments, relation, segment_sets
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer import generate
from slicer.hatch import hatch
from slicer.nozzle import EPS_MM, POINT, NozzleBody, press_depths
from slicer.precedence import covering_edges, hindered, hindering_edges

FAR = 50.0
"""No sheet of these tests is as large."""

bodies = st.builds(
    NozzleBody.of,
    tip_width_mm=st.sampled_from([0.05, 0.2, 0.5, 3.0]),
    cone_deg=st.sampled_from([0.0, 0.0, 6.0, 30.0, 45.0, 80.0]),
    length_mm=st.sampled_from([math.inf, 0.3, 1.0]),
    shoulder_width_mm=st.sampled_from([0.0, 0.5, 2.0]),
    press_mm=st.sampled_from([0.0, 0.03, 0.1, 0.5]),
    barrel_width_mm=st.sampled_from([0.0, 0.0, 3.0, 4.0]),
    cone_mm=st.sampled_from([0.0, 0.0, 0.2, 0.7]),
)
sheets = loose_segments(30) | segment_sets(max_n=40)


def hard_core(body, press):
    """What is left of the body when each face is moved inwards by ``press``, as polygons from their corners."""
    parts = []
    spread = math.hypot(1.0, body.flank) * press
    foot, head = (body.half_width + y * body.flank - spread for y in (press, FAR))
    if foot > 0:
        parts.append([(-foot, press), (foot, press), (head, FAR), (-head, FAR)])
    elif head > 0:
        parts.append([(0.0, (spread - body.half_width) / body.flank), (head, FAR), (-head, FAR)])
    if body.length < FAR and body.shoulder > press:
        parts.append(
            shapely.box(
                press - body.shoulder, body.length + press, body.shoulder - press, FAR
            ).exterior.coords
        )
    cores = [shapely.Polygon(part) for part in parts]
    if body.flank > 0 and cores:
        side = max(min(body.barrel, FAR) - press, 0.0)
        cores[0] = cores[0].intersection(shapely.box(-side, 0, side, FAR)) if side else shapely.Polygon()
    if body.barrel_from < FAR and body.barrel > press:
        side = body.barrel - press
        cores.append(shapely.box(-side, body.barrel_from + press, side, FAR))
    return shapely.union_all(cores)


def differences(high, low):
    """The polygons of all differences between points of segments (..., 2, 2)."""
    corners = (high[..., :, None, :] - low[..., None, :, :]).reshape(
        *np.broadcast_shapes(high.shape, low.shape)[:-2], 4, 2
    )
    return shapely.convex_hull(shapely.multipoints(corners))


def hinders(body, high, low, press):
    """bool: whether [high], printed, would push a point deeper than ``press`` while [low] is printed."""
    core = hard_core(body, press)
    shapely.prepare(core)
    return shapely.intersects(core, differences(high, low))


def before(body, earlier, later, slack=0.0):
    """bool (e, l): whether [earlier] must come before [later]; a negative slack asks for less."""
    straight = np.array([[relation(np.stack([e, q]))[0, 1] for q in later] for e in earlier], bool)
    straight = straight.reshape(len(earlier), len(later))
    if body.is_point:
        return straight
    press = body.press + EPS_MM - slack
    return straight | hinders(body, later[None], earlier[:, None], press)


def whole(body, segments, slack=0.0):
    """The closure of the whole relation."""
    related = before(body, segments, segments, slack)
    np.fill_diagonal(related, False)
    return closure(related)


def matrix(n, edges):
    out = np.zeros((n, n), bool)
    out[edges[:, 0], edges[:, 1]] = True
    return out


def split(segments, seed):
    """Some toolpaths, and others that are to be queries."""
    asked = np.random.default_rng(seed).random(len(segments)) < 0.4
    return segments[~asked], segments[asked]


@settings(max_examples=50, deadline=None)
@given(loose_segments(8), bodies)
def test_the_depth_is_that_at_which_the_shrunk_body_lets_go(segments, body):
    n = len(segments)
    first, second = (grid.ravel() for grid in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    depth = press_depths(body, segments, first, second)
    for a, b, d in zip(first, second, depth, strict=True):
        if d > 1e-5:
            assert hinders(body, segments[a], segments[b], d - 1e-6)
        if d > 1e-5 or not hinders(body, segments[a], segments[b], 1e-6):
            assert not hinders(body, segments[a], segments[b], max(d, 0.0) + 1e-6)
        else:
            assert d > 0


@settings(max_examples=100, deadline=None)
@given(sheets, bodies)
def test_the_closure_of_the_edges_is_the_whole_relation(segments, body):
    n = len(segments)
    edges = hindering_edges(segments, body)
    found = closure(matrix(n, edges))
    assert not (whole(body, segments, -1e-9) & ~found).any(), "something is missing"
    assert not (found & ~whole(body, segments, 1e-9)).any(), "something is too much"
    assert len(np.unique(edges, axis=0)) == len(edges)
    assert (edges[:, 0] != edges[:, 1]).all()


@settings(max_examples=100, deadline=None)
@given(sheets, bodies | st.just(POINT), st.integers(0, 2**32 - 1))
def test_queries_name_what_they_hinder_or_what_comes_after_it(segments, body, seed):
    laid, queries = split(segments, seed)
    start, toolpath = hindered(laid, queries, body)
    assert len(start) == len(queries) + 1
    order = whole(body, laid, 1e-9)
    least, most = before(body, laid, queries, -1e-9), before(body, laid, queries, 1e-9)
    for k in range(len(queries)):
        named = toolpath[start[k] : start[k + 1]]
        assert most[named, k].all(), "something is named that is not hindered"
        told = order[:, named].any(axis=1)
        told[named] = True
        assert told[least[:, k]].all(), "something is hindered that no name tells"


@pytest.mark.parametrize("cone_deg", [0.0, 30.0, 45.0])
@pytest.mark.parametrize("tilts", [(-45.0, 0.0), (-89.0, -60.0), (0.0, 90.0)], ids=str)
def test_a_larger_sheet(cone_deg, tilts):
    low, high = tilts
    field = generate.random_walk(4, 4, seed=3, spacing_mm=0.15, start_deg=low, low_deg=low, high_deg=high)
    segments = hatch(field).segments
    body = NozzleBody.of(0.2, cone_deg, 1.0, 2.0, 0.06)
    found = closure(matrix(len(segments), hindering_edges(segments, body)))
    np.testing.assert_array_equal(found, whole(body, segments))


def test_few_edges_are_left():
    segments = hatch(generate.random_walk(10, 10, seed=1)).segments
    for cone_deg in (0.0, 45.0):
        edges = hindering_edges(segments, NozzleBody.of(0.13, cone_deg, 3.2, 1.0, 0.05))
        assert len(edges) < 4 * len(segments)


def test_all_of_is_below_is_among_the_edges():
    segments = hatch(generate.random_walk(3, 3, seed=1)).segments
    edges = hindering_edges(segments, NozzleBody.of(0.3, 30.0, 1.0, 2.0, 0.05))
    assert set(map(tuple, covering_edges(segments))) <= set(map(tuple, edges))


def test_neighbours_that_stand_in_each_others_way_name_each_other():
    steep = np.array([[[0.0, 0.0], [0.2, 2.0]], [[0.1, 0.0], [0.3, 2.0]]])
    assert hindering_edges(steep, NozzleBody.of(0.5)).tolist() == [[0, 1], [1, 0]]
    assert hindering_edges(steep, NozzleBody.of(0.02)).tolist() == [[1, 0]]


def test_a_shoulder_reaches_farther_than_the_needle():
    low, high = [[0.0, 0.0], [1.0, 0.0]], [[1.5, 3.0], [2.5, 3.0]]
    needle = NozzleBody.of(0.2, 0.0, 2.0, 0.0)
    assert len(hindering_edges([high, low], needle)) == 0
    assert hindering_edges([high, low], needle._replace(shoulder=0.6)).tolist() == [[1, 0]]
    assert len(hindering_edges([high, low], needle._replace(shoulder=0.6, length=3.0))) == 0
    assert len(hindering_edges([high, low], needle._replace(shoulder=0.5))) == 0  # it touches


def test_uprights_of_one_wall_beside_the_end_of_a_line():
    level = [[0.0, 5.0], [1.0, 5.0]]
    uprights = [[[1.0, y], [1.0, y + 0.9]] for y in (1.0, 2.0, 3.0, 6.0)]
    edges = hindering_edges([level, *uprights], NozzleBody.of(0.2))
    # The highest that begins below the line stands for those under it.
    assert edges.tolist() == [[0, 4], [1, 2], [2, 3], [3, 0], [3, 4]]


def test_a_query_may_touch_the_ends_that_it_joins():
    lines = np.array([[[0.0, 0.0], [1.0, 0.0]], [[0.0, 0.5], [1.0, 0.5]], [[1.2, -0.5], [2.0, -0.5]]])
    joins = [[[1.0, 0.0], [1.0, 0.5]], [[0.0, 0.5], [0.5, 0.8]], [[1.0, 0.0], [1.2, -0.5]]]
    start, toolpath = hindered(lines, joins, POINT)
    assert [sorted(toolpath[start[k] : start[k + 1]].tolist()) for k in range(3)] == [[], [0, 1], []]
    start, toolpath = hindered(lines, joins, NozzleBody.of(0.6))
    assert sorted(toolpath[start[0] : start[1]].tolist()) == [0, 2]
    assert toolpath[start[2] : start[3]].tolist() == [2]


def test_nothing_to_ask_or_nothing_there():
    line = np.array([[[0.0, 0.0], [1.0, 0.0]]])
    none = np.empty((0, 2, 2))
    body = NozzleBody.of(0.5)
    assert [len(part) for part in hindered(none, line, body)] == [2, 0]
    assert [len(part) for part in hindered(line, none, body)] == [1, 0]
    assert hindering_edges(none, body).shape == (0, 2)
    assert hindering_edges(line, body).shape == (0, 2)


def test_a_steep_toolpath_tells_what_its_neighbours_flank_does_not_reach():
    steep, across, low = (
        [[0.0, 0.0], [1.0, -4.0]],
        [[-0.1, 0.8], [0.3, -0.8]],
        [[1.2, -4.3], [1.4, -4.3]],
    )
    edges = hindering_edges([steep, across, low], NozzleBody.of(0.2, 45.0, barrel_width_mm=1.0))
    # The flank of what passes across lies higher, but ends before the line along the first does.
    assert [2, 0] in edges.tolist()


def test_a_barrel_ends_the_flank():
    low, high = [[0.0, 0.0], [1.0, 0.0]], [[1.5, 3.0], [2.5, 3.0]]
    for barrel, found in ((0.0, [[1, 0]]), (1.2, [[1, 0]]), (0.8, [])):
        body = NozzleBody.of(0.2, 30.0, barrel_width_mm=barrel)
        assert hindering_edges([high, low], body).tolist() == found


def test_a_shoulder_is_no_narrower_than_what_it_stands_on():
    cone = NozzleBody.of(0.2, 45.0, 1.0, 0.5)
    assert cone.shoulder == cone.barrel == pytest.approx(1.1)
    assert NozzleBody.of(0.2, 45.0, 1.0, 0.5, barrel_width_mm=1.0).shoulder == 0.5
    assert NozzleBody.of(0.2, 45.0, 1.0, 5.0).barrel == 2.5  # beyond, the shoulder holds the flank
    assert NozzleBody.of(0.2, 45.0, barrel_width_mm=0.1).barrel == 0.1
    collar = NozzleBody.of(0.2, 45.0, 5.0, 0.0, barrel_width_mm=6.0, cone_mm=1.0)
    assert (collar.barrel, collar.barrel_from, collar.shoulder) == (3.0, 1.0, 3.0)
    assert NozzleBody.of(0.2, 45.0, barrel_width_mm=1.0, cone_mm=1.0).barrel == pytest.approx(1.1)
    assert NozzleBody.of(0.2, 45.0, 1.0, cone_mm=2.0).barrel_from == math.inf  # the shoulder comes first


def test_a_barrel_begins_where_the_cone_is_said_to_end():
    low, high = [[0.0, 0.0], [1.0, 0.0]], [[1.5, 3.0], [2.5, 3.0]]
    for cone_mm, found in ((2.0, [[1, 0]]), (3.5, []), (0.0, [])):
        body = NozzleBody.of(0.2, 1.0, barrel_width_mm=1.2, cone_mm=cone_mm)
        assert hindering_edges([high, low], body).tolist() == found
