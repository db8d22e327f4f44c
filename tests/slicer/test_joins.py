"""Hops that may be extruded, held against every pair of a hop and a toolpath."""

import itertools

import numpy as np
import pytest
from fields import grids
from hypothesis import HealthCheck, assume, example, given, settings
from hypothesis import strategies as st
from shapely.geometry import LineString, Point

from slicer.cutting.hindering import hindering
from slicer.errors import CycleError
from slicer.grid import Grid
from slicer.hatch import hatch
from slicer.joins import fewest_beads, joinable
from slicer.nozzle import POINT, NozzleBody
from slicer.sequence import Problem, solve
from slicer.travel import plan

bodies = st.sampled_from(
    [POINT, NozzleBody.of(0.3, press_mm=0.1), NozzleBody.of(0.2, 30, 0.8, 2.0, 0.1), NozzleBody.of(0.5, 0)]
)


def halved_lines() -> Grid:
    """A tile whose hatch lines are parted by a hole: a hop may go over the hole and along a whole half."""
    width, height = 0.7, 1.3
    outer = [(0.05 * width, 0.0), (width, 0.1 * height), (0.9 * width, height), (0.0, 0.8 * height)]
    turns = np.linspace(0, 2 * np.pi, 7)[:-1]
    hole = [(0.35 + 0.119 * np.cos(t), 0.65 + 0.119 * np.sin(t)) for t in turns]
    return Grid(
        np.array([[1.72]]),
        np.array([[0.25]]),
        (width, height),
        outline_mm=[[outer, hole]],
        min_length_mm=0.05,
    )


def shares(hop: np.ndarray, toolpath: np.ndarray) -> float:
    """How much of a hop is no farther than 0.02 mm from a toolpath, in mm."""
    t = (np.arange(2000) + 0.5) / 2000
    points = hop[0] + t[:, None] * (hop[1] - hop[0])
    along = toolpath[1] - toolpath[0]
    s = np.clip((points - toolpath[0]) @ along / (along @ along), 0.0, 1.0)
    near = np.hypot(*(points - toolpath[0] - s[:, None] * along).T) <= 0.02
    return float(near.mean() * np.hypot(*(hop[1] - hop[0])))


@settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
@given(grids(max_tiles=2), bodies, st.integers(0, 3))
@example(halved_lines(), POINT, 2)
def test_a_join_hinders_nothing_that_comes_later(grid, body, seed):
    segments = hatch(grid).segments
    assume(1 < len(segments) <= 80)
    try:
        problem = Problem.build(segments, body=body)
    except CycleError:
        assume(False)
    # Cheap sequences hop past little: one of chance, and the methods' own.
    found = solve(problem, method="greedy", seed=seed)
    order, flipped = found.order, found.flipped ^ (np.random.default_rng(seed).random(problem.n) < 0.3)
    allowed = joinable(segments, order, flipped, body, 0.6)
    assert not allowed[0]
    for k in range(1, len(order)):
        hop = np.array([segments[order[k - 1], 1 - int(flipped[k - 1])], segments[order[k], int(flipped[k])]])
        length = np.hypot(*(hop[1] - hop[0]))
        if not 1e-6 < length < 0.6 - 1e-9:
            assert not allowed[k] or length <= 0.6
            continue
        later = segments[order[k:]]
        line = LineString(hop)
        points = [Point(*hop[0]), Point(*hop[1]), Point(*hop.mean(axis=0))]
        shared = [shares(hop, other) for other in segments]
        least = [max(0.1, min(length, np.hypot(*(other[1] - other[0]))) / 2) for other in segments]
        if np.isclose(shared, least, rtol=0.02).any():
            continue  # as near to the limit as circles are round
        crosses = any(
            line.crosses(LineString(other))
            or all(LineString(other).distance(q) <= 0.02 for q in points)
            or length_mm > least_mm
            for other, length_mm, least_mm in zip(segments, shared, least, strict=True)
        )
        in_the_way = hindering(body, np.ascontiguousarray(np.concatenate([hop[None], later])))[0].any()
        assert allowed[k] == (not crosses and not in_the_way), (hop, length)


@pytest.mark.parametrize("seed", range(8))
def test_no_order_makes_fewer_beads_than_are_needed(seed):
    random = np.random.default_rng(seed)
    # Lines of their own columns in a row, so that every order can be printed.
    x = np.cumsum(random.uniform(0.02, 0.3, 8)).reshape(4, 2)
    lines = np.stack([x, random.uniform(0.0, 0.15, (4, 2))], axis=2)
    join_mm = 0.25
    found = min(
        plan(lines, order, flipped, join_mm=join_mm).beads
        for order in itertools.permutations(range(4))
        for flipped in itertools.product([False, True], repeat=4)
    )
    bound = fewest_beads(lines, join_mm)
    assert 1 <= bound <= found
    gaps = np.hypot(*(lines[1:, 0] - lines[:-1, 1]).T)
    if (gaps[:2] > join_mm).all() or (gaps <= join_mm).all():
        assert bound == found, "rows that hang together by their neighbours alone"


def test_beads_end_where_nothing_can_be_joined():
    rows = np.array([[[0.0, y], [1.0, y]] for y in (0.0, 0.1, 0.2, 0.3)])
    assert fewest_beads(rows, 0.15) == 1
    assert fewest_beads(rows, 0.0) == fewest_beads(rows, 0.05) == 4
    assert fewest_beads(rows[:3], 0.15) == 1
    assert fewest_beads(rows[[0, 1, 3]], 0.15) == 2
    cuts = np.ones((4, 2), np.bool_)
    cuts[1] = False
    assert fewest_beads(rows, 0.15, cuts) == 3
    halves = np.array([[[0.0, 0.0], [0.5, 0.0]], [[0.5, 0.0], [1.0, 0.0]]])
    assert fewest_beads(halves, 0.0) == 1
    between = np.array([[[0.0, 0.0], [1.0, 0.0]], [[1.05, -1.0], [1.06, 1.0]], [[1.1, 0.0], [2.0, 0.0]]])
    assert fewest_beads(between, 0.2) == 3, "a hop across a toolpath is never extruded"
    assert fewest_beads(rows[:0], 1.0) == 0


@pytest.mark.parametrize("off", [0.0, 5e-7, 2e-6, 4e-4, 0.01, -0.01])
def test_no_hop_is_laid_where_a_toolpath_lies(off):
    """Whether it is printed before or after, and whether the hop goes over all of it or a part."""
    a, b, c = [(0.0, 0.0), (0.3, 0.0)], [(0.35, off), (0.6, off)], [(0.65, 0.0), (1.0, 0.0)]
    for order in ([0, 2, 1], [1, 0, 2]):
        assert not joinable(np.array([a, b, c]), order, [0, 0, 0], POINT, 0.6)[2 if order[0] else 1]
    touching = np.array([[(0.5, -1.0), (0.5, 0.0)], [(0.0, off), (0.8, off)], [(1.0, 0.0), (2.0, 0.0)]])
    if off >= 0.0:
        assert joinable(touching, [0, 2, 1], [0, 0, 0], POINT, 0.6).tolist() == [False, False, False]


def test_a_hop_may_go_on_in_line_leave_at_a_small_angle_and_turn_round():
    rows = np.array([[(0.0, 0.0), (1.0, 0.0)], [(1.3, 0.0), (2.0, 0.0)], [(1.3, 0.2), (2.0, 0.2)]])
    assert joinable(rows, [0, 1, 2], [0, 0, 1], POINT, 0.5).tolist() == [False, True, True]
    for degrees, may in ((8.0, True), (3.0, False)):
        turn = np.radians(degrees)
        back = 1.0 - 0.4 * np.cos(turn), 0.4 * np.sin(turn)
        lines = np.array([[(0.0, 0.0), (1.0, 0.0)], [back, (back[0], back[1] + 1.0)]])
        assert joinable(lines, [0, 1], [0, 0], POINT, 0.5)[1] == may


def test_a_hop_that_is_extruded_goes_no_more_steeply_downhill_than_a_toolpath():
    steps = np.array([[[0.0, 0.0], [1.0, 0.0]], [[1.1, 0.0], [2.0, 0.3]], [[2.1, 0.0], [3.0, 0.0]]])
    order, ahead, back = [0, 1, 2], [0, 0, 0], [1, 1, 1]
    said = {}
    for downhill in (90.0, 72.0, 71.0, 0.0):
        said[downhill] = joinable(steps, order, ahead, POINT, 0.5, downhill_deg=downhill).tolist()
    # Level, then 0.3 mm down over 0.1 mm, which is 71.6 degrees.
    assert said[90.0] == said[72.0] == [False, True, True]
    assert said[71.0] == said[0.0] == [False, True, False]
    upwards = joinable(steps, order[::-1], back, POINT, 0.5, downhill_deg=0.0)
    assert upwards.tolist() == [False, True, True]


def test_no_hop_is_joined_where_none_may_be():
    rows = np.array([[[0.0, y], [1.0, y]] for y in (0.0, 0.1, 0.2)])
    assert not joinable(rows, [0, 1, 2], [0, 1, 0], POINT, 0.0).any()
    assert joinable(rows, [0, 1, 2], [0, 1, 0], POINT, 0.15).tolist() == [False, True, True]
    assert len(joinable(rows[:0], [], [], POINT, 1.0)) == 0
