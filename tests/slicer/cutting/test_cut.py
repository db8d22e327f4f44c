"""Cutting: every sheet has an order afterwards, nothing is lost, and no fewer cuts would do than is claimed."""

from itertools import permutations, product

import numpy as np
import pytest
import shapely
from calling import from_python
from fields import grids
from hypothesis import HealthCheck, assume, example, given, settings
from hypothesis import strategies as st
from shapely.geometry import LineString, MultiPoint, Polygon

from slicer import nozzle, precedence
from slicer.cutting import cut, press
from slicer.cutting.fewest import fewest_of_pair
from slicer.cutting.hindering import BARREL, NEEDLE, SHOULDER, hindering, hindering_parts
from slicer.cycles import in_cycles
from slicer.errors import SlicerError
from slicer.grid import Grid
from slicer.hatch import hatch
from slicer.nozzle import POINT, NozzleBody

in_the_way = from_python(nozzle.in_the_way)
FAR = 100.0

bodies = st.builds(
    NozzleBody.of,
    st.sampled_from([0.1, 0.3, 0.6, 1.2]),
    st.sampled_from([0.0, 0.0, 8.0, 30.0, 45.0]),
    st.sampled_from([0.3, 1.0, np.inf]),
    st.sampled_from([1.3, 2.5]),
    st.sampled_from([0.02, 0.05, 0.1]),
)


UPRIGHTS = Grid(np.array([[90.0]]), np.array([[0.2]]), (1.0, 1.0), (2.0, 1.0))
"""Uprights 0.2 apart, which is just where a nozzle 0.6 wide ceases to press deeper than 0.1: but for rounding."""


def lines_of(grid):
    segments = hatch(grid).segments
    assume(1 < len(segments) <= 120)
    return segments


@settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
@given(grids(), bodies)
@example(UPRIGHTS, NozzleBody.of(0.6, 0.0, 0.3, 1.3, 0.1))
def test_pieces_are_the_toolpaths_and_have_an_order(grid, body):
    segments = lines_of(grid)
    try:
        done = cut(segments, body)
    except SlicerError as error:
        assert "press_mm" in str(error)
        assume(False)
    cyclic = in_cycles(len(segments), precedence.hindering_edges(segments, body))
    for s, whole in enumerate(segments):
        pieces = done.segments[done.toolpath == s]
        assert len(pieces) == 1 or cyclic[s], "what hinders nobody is left whole"
        assert np.array_equal(pieces[0, 0], whole[0])
        assert np.array_equal(pieces[-1, 1], whole[1])
        assert np.allclose(pieces[1:, 0], pieces[:-1, 1], atol=1e-12)
        assert done.ends[done.toolpath == s].sum() == 2
    later, earlier = np.nonzero(in_the_way(body, done.segments))
    rows = np.concatenate([precedence.covering_edges(done.segments), np.stack([earlier, later], axis=1)])
    assert not in_cycles(len(done.segments), rows.astype(np.int32)).any()
    assert done.fewest <= done.cuts
    assert (done.fewest == 0) == (done.cuts == 0)


def test_a_point_cuts_nothing(examples_sheet):
    done = cut(examples_sheet, POINT)
    assert np.array_equal(done.segments, examples_sheet)
    assert done.cuts == done.fewest == done.toolpaths_cut == 0


@pytest.fixture
def examples_sheet():
    from slicer.generate import random_walk

    return hatch(random_walk(3, 3, seed=4)).segments


PAIR = np.array([[[0.0, 0.0], [0.1, 1.0]], [[0.3, 0.0], [0.4, 1.0]]])
"""Two steep toolpaths side by side, 0.3 apart."""


def test_two_steep_neighbours_are_printed_in_turns():
    # A flat of half width 0.4 over both: each may rise 0.1 above the other, first by 0.1 and then by twice that.
    body = NozzleBody.of(0.8 + 0.2, press_mm=0.1)
    done = cut(PAIR, body)
    assert fewest_of_pair(body, *PAIR) == done.fewest
    assert done.cuts == done.fewest == 9
    assert done.toolpaths_cut == 2
    narrow = NozzleBody.of(0.5, press_mm=0.1)
    assert cut(PAIR, narrow).cuts == 0


def test_pieces_are_no_shorter_than_asked_where_that_can_be():
    body = NozzleBody.of(1.0, press_mm=0.1)
    lengths = np.hypot(*(lambda d: (d[:, 0], d[:, 1]))(np.diff(cut(PAIR, body).segments, axis=1)[:, 0]))
    assert lengths.min() >= 0.05 - 1e-9
    assert cut(PAIR, body, least_mm=0.15).cuts >= cut(PAIR, body).cuts


def test_what_cannot_be_cut_is_an_error_with_its_number():
    with pytest.raises(SlicerError, match="press_mm"):
        cut(PAIR, NozzleBody.of(1.0, press_mm=1e-5))


def turns_by_cells(body, a, b, cells):
    """The least number of turns by breadth-first search over what of two toolpaths in cells is printed."""
    parts = [
        np.ascontiguousarray(s[0] + np.array([[k], [k + 1]]) / cells * (s[1] - s[0]))
        for s in (a, b)
        for k in range(cells)
    ]
    hinders = hindering(body, np.array(parts))
    everything = (1 << 2 * cells) - 1
    sides = [(1 << cells) - 1, everything ^ ((1 << cells) - 1)]
    best = 10**6
    for first in (0, 1):
        printed = 0
        for turn in range(4 * cells):
            side = sides[(first + turn) % 2]
            grown = True
            while grown:
                grown = False
                for k in range(2 * cells):
                    if side >> k & 1 and not printed >> k & 1:
                        waits = any(
                            hinders[k, c] and not printed >> c & 1 and not side >> c & 1
                            for c in range(2 * cells)
                        )
                        if not waits:
                            printed |= 1 << k
                            grown = True
            if printed == everything:
                best = min(best, turn + 1)
                break
    return best


@pytest.mark.parametrize("seed", range(12))
def test_the_fewest_cuts_of_a_pair_are_not_more_than_cells_need(seed):
    random = np.random.default_rng(seed)
    body = NozzleBody.of(random.uniform(0.4, 1.0), random.choice([0.0, 30.0]), press_mm=0.15)
    tilt = random.uniform(60, 89, 2) * random.choice([1, -1], 2)
    a = np.array([[0.0, 0.0], [1 / np.tan(np.radians(tilt[0])), 1.0]])
    b = np.array([[0.0, 0.0], [1 / np.tan(np.radians(tilt[1])), 1.0]])
    a[:, 0] -= a[:, 0].max() + 0.01
    b[:, 0] -= b[:, 0].min() - 0.01
    assert fewest_of_pair(body, a, b) <= turns_by_cells(body, a, b, 40) - 2


@pytest.mark.parametrize("seed", range(40))
def test_the_part_that_hinders_is_that_of_the_minkowski_sum(seed):
    random = np.random.default_rng(seed)
    b, c = random.uniform(-1, 1, (2, 2, 2))
    body = NozzleBody.of(
        random.uniform(0.1, 1),
        random.choice([0.0, 20.0, 45.0]),
        random.uniform(0.2, 1),
        random.uniform(1, 3),
        0.05,
        random.choice([0.0, 2.0]),
        random.choice([0.0, 0.1]),
    )
    p, cosine = body.press, 1 / np.hypot(1, body.flank)
    low = max(p, (p / cosine - body.half_width) / body.flank if body.flank else p)
    at = [max(body.half_width + body.flank * y - p / cosine, 0.0) for y in (low, FAR)]
    cores = []
    if at[1] > 0:
        cores.append([(-at[0], low), (at[0], low), (at[1], FAR), (-at[1], FAR)])
    which = [NEEDLE] * len(cores)
    for part, floor, half in (
        (BARREL, body.barrel_from, body.barrel),
        (SHOULDER, body.length, body.shoulder),
    ):
        if floor < FAR and half > p:
            floor, wide = floor + p, half - p
            cores.append([(-wide, floor), (wide, floor), (wide, FAR), (-wide, FAR)])
            which.append(part)
    parts = hindering_parts(body._replace(press=p - nozzle.EPS_MM / 2), b, c)  # see there
    for part, core in zip(which, cores, strict=True):
        # b(t) hinders c where b(t) - c(s) lies in the core: b meets c + core.
        side = body.barrel - p if part == NEEDLE and body.flank else FAR
        core = Polygon(core).intersection(shapely.box(-side, 0, side, FAR)).exterior.coords
        room = MultiPoint([np.add(q, end) for q in core for end in c]).convex_hull
        meets = LineString(b).intersection(Polygon(room))
        first, last, _, _ = parts[part]
        if meets.is_empty:
            assert last - first < 1e-9
        else:
            along = [LineString(b).project(shapely.Point(q), normalized=True) for q in meets.coords]
            assert (first, last) == pytest.approx((min(along), max(along)), abs=1e-9)


@settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
@given(grids(max_tiles=2), bodies)
def test_pressing_leaves_an_order_and_says_where_it_presses(grid, body):
    segments = lines_of(grid)
    done = press(segments, body)
    n = len(segments)
    assert not in_cycles(n, done.edges).any()
    before = np.zeros((n, n), bool)
    before[done.edges[:, 0], done.edges[:, 1]] = True
    while True:
        more = before | (before.astype(np.float32) @ before.astype(np.float32) > 0)
        if (more == before).all():
            break
        before = more
    given_up = np.zeros((n, n), bool)
    given_up[done.pairs[:, 1], done.pairs[:, 0]] = True
    later, earlier = np.nonzero(hindering(body, segments))
    said = before[earlier, later] | given_up[earlier, later]
    assert said.all(), "every pair is in the precedence or is reported"
    assert (done.depth_mm > body.press).all()
    below = precedence.covering_edges(segments)
    assert before[below[:, 0], below[:, 1]].all(), "what lies straight above stays above"


@pytest.mark.parametrize("seed", range(6))
def test_the_least_pressing_is_that_of_all_orders(seed):
    random = np.random.default_rng(seed)
    tilts = random.uniform(65, 88, 5) * random.choice([1, -1], 5)
    segments = []
    x = 0.0
    for tilt in tilts:
        run = 1 / np.tan(np.radians(tilt))
        start, height = x + max(0.0, -run), random.uniform(0.5, 1.0)
        segments.append([[start, 0.0], [start + run * height, height]])
        x += abs(run) + random.uniform(0.02, 0.2)
    segments = np.array(segments)
    body = NozzleBody.of(0.9, press_mm=0.1)
    done = press(segments, body)
    cyclic = in_cycles(5, precedence.hindering_edges(segments, body))
    assume_cycle = cyclic.any()
    assert assume_cycle
    from slicer.nozzle import press_depths

    depth = np.zeros((5, 5))
    for a, b in product(range(5), repeat=2):
        if a != b:
            depth[a, b] = press_depths(body, segments, np.array([a]), np.array([b]))[0]
    below = {tuple(row) for row in precedence.covering_edges(segments).tolist()}
    best = np.inf
    for order in permutations(range(5)):
        place = {s: k for k, s in enumerate(order)}
        if any(place[a] > place[b] for a, b in below):
            continue
        total = sum(
            max(0.0, depth[a, b] - body.press) for a, b in product(range(5), repeat=2) if place[a] < place[b]
        )
        best = min(best, total)
    assert done.least
    assert float((done.depth_mm - body.press).sum()) == pytest.approx(best, abs=1e-6)


def test_what_lies_straight_above_is_never_printed_first_however_little_that_presses():
    low, high = [[-0.3, 0.9], [0.1, 1.0]], [[0.099, 1.12], [0.4, 0.0]]
    body = NozzleBody.of(1.0, press_mm=0.1)
    done = press(np.array([low, high]), body)
    assert done.pairs.tolist() == [[0, 1]]
    assert done.edges.tolist() == [[0, 1]]
    assert done.depth_mm[0] > 0.3
