"""Travels of a nozzle with a body, replayed in fine steps with Shapely against all that is printed."""

import math

import numpy as np
import pytest
import shapely
from bodies import bodies, forbidden_below, hard_core, own_height
from fields import blocked, loose_segments, random_extension, segment_sets
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer import travel
from slicer.nozzle import POINT, NozzleBody
from slicer.precedence import hindering_edges
from slicer.sequence.problem import Problem, true_cost
from slicer.sequence.problem.objective import Objective

SLACK_MM = 1e-5
STEP_MM = 0.02


def printable(segments, body, random):
    """A random sequence of what can be printed with a body: (order, flipped)."""
    order = random_extension(random, len(segments), hindering_edges(segments, body))
    return order, random.random(len(order)) < 0.5


def routes(plan):
    """The points of each travel, both ends included."""
    for k in range(1, len(plan.toolpaths)):
        via = plan.via[plan.via_start[k] : plan.via_start[k + 1]]
        yield k, np.vstack([plan.toolpaths[k - 1, 1], via, plan.toolpaths[k, 0]])


def own_rise(body, toolpath):
    """How far the tip at the end of a toolpath stands in its own bead, and a little more."""
    rise = forbidden_below(body, toolpath, toolpath[1, 0]) - toolpath[1, 1]
    length = np.hypot(*(toolpath[1] - toolpath[0]))
    step = length / 1999 * (1 + (1 / body.flank if body.flank > 0 else 1))
    return max(0.0, rise) + step + SLACK_MM


def collisions(plan, body):
    """Travels that drive the body's hard core into what is printed, or the tip below it."""
    core = hard_core(body, body.press + SLACK_MM)
    found = []
    for k, path in routes(plan):
        for a, b in zip(path, path[1:], strict=False):
            if blocked(plan.toolpaths[:k], a, b, 1e-6):
                found.append((k, "tip"))
        steps = max(2, int(np.hypot(*np.diff(path, axis=0).T).max() / STEP_MM))
        at = np.vstack([np.linspace(a, b, steps) for a, b in zip(path, path[1:], strict=False)])
        others = shapely.multilinestrings(shapely.linestrings(plan.toolpaths[: k - 1]))
        own = shapely.linestrings(plan.toolpaths[k - 1])
        lifted = at + [0.0, own_rise(body, plan.toolpaths[k - 1])]
        for places, obstacle in ((at, others), (lifted, own)):
            hit = np.zeros(1, bool)
            for part in shapely.get_parts(core):
                ring = shapely.get_coordinates(part)
                hit = hit | shapely.intersects(shapely.polygons(places[:, None] + ring), obstacle)
            if hit.any():
                found.append((k, "body"))
    return found


@settings(max_examples=150, deadline=None)
@given(
    segments=segment_sets(max_n=25) | loose_segments(20),
    body=bodies(),
    seed=st.integers(0, 10**6),
    clearance=st.sampled_from([0.0, 0.1]),
)
def test_no_travel_drives_the_body_into_what_is_printed(segments, body, seed, clearance):
    order, flipped = printable(segments, body, np.random.default_rng(seed))
    plan = travel.plan(segments, order, flipped, clearance_mm=clearance, body=body)
    assert collisions(plan, body) == []


def test_a_body_that_is_a_little_wider_than_was_planned_is_noticed():
    noticed = 0
    for seed in range(12):
        random = np.random.default_rng(seed)
        left = np.sort(random.uniform(0, 6, 12))
        heights = random.uniform(0, 3, 12)
        segments = np.array([[[x, y], [x + 0.3, y + 0.1]] for x, y in zip(left, heights, strict=True)])
        body = NozzleBody.of(1.0, 0.0, math.inf, 0.0, 0.05)
        order, flipped = printable(segments, body, random)
        narrow = body._replace(half_width=0.9 * body.half_width)
        assert collisions(travel.plan(segments, order, flipped, body=body), body) == []
        noticed += bool(collisions(travel.plan(segments, order, flipped, body=narrow), body))
    assert noticed >= 6


def height_over(printed, left, end, body, x, points=400):
    """The skyline at x for the travel that leaves the last of ``printed``, by brute force."""
    out = -math.inf
    for k, toolpath in enumerate(printed):
        reached = forbidden_below(body, toolpath, x, points)
        if k == len(printed) - 1:
            reached -= max(0.0, forbidden_below(body, toolpath, left[0], points) - left[1])
        out = max(out, reached, own_height(toolpath, x))
    return out


@settings(max_examples=60, deadline=None)
@given(segments=segment_sets(max_n=10) | loose_segments(10), body=bodies(), seed=st.integers(0, 10**6))
def test_a_travel_is_straight_where_it_can_be_and_else_taut(segments, body, seed):
    order, flipped = printable(segments, body, np.random.default_rng(seed))
    plan = travel.plan(segments, order, flipped, body=body)
    for k, path in routes(plan):
        if len(path) == 2 or abs(path[0, 0] - path[-1, 0]) < 1e-3:
            continue
        printed = plan.toolpaths[:k]
        # A waypoint between the ends holds the string up: a little below it something stands.
        for x, y in path[1:-1]:
            beside = [x - 2e-3, x - 1e-4, x, x + 1e-4, x + 2e-3]
            steep = 1.0 / max(body.flank, 0.1)
            assert max(height_over(printed, path[0], path[-1], body, b) for b in beside) >= y - 0.02 * steep


@settings(max_examples=60, deadline=None)
@given(
    segments=segment_sets(max_n=25) | loose_segments(20),
    body=bodies(),
    seed=st.integers(0, 10**6),
    clearance=st.sampled_from([0.0, 0.1]),
)
def test_the_objective_counts_the_travels_that_are_made(segments, body, seed, clearance):
    order, flipped = printable(segments, body, np.random.default_rng(seed))
    chosen = segments[order]
    problem = Problem.build(chosen, body=body)
    oriented = (2 * np.arange(len(order)) + flipped).astype(np.int32)
    plan = travel.plan(chosen, np.arange(len(order)), flipped, clearance_mm=clearance, body=body)
    assert true_cost(problem, Objective("routed", clearance), oriented) == pytest.approx(plan.routed_mm)
    assert plan.routed_mm >= travel.plan(chosen, np.arange(len(order)), flipped).routed_mm - 1e-5


def test_leaving_a_lower_end_is_a_hop_but_going_back_over_it_is_not():
    body = NozzleBody.of(1.0)
    slope = np.array([[2.0, 2.0], [0.0, 0.0]])  # printed downwards: the flat stands over its own rise
    beside = np.array([[-1.0, 0.5], [-2.0, 0.5]])
    plan = travel.plan(np.array([slope, beside]), [0, 1], [False, False], body=body)
    assert plan.routed_mm == plan.straight_mm
    # Later its reach counts in full: half a tip's width beside it stands as high as it rises there.
    under = np.array([[-2.0, 0.25], [-1.5, 0.25]])
    beyond = np.array([[4.0, 0.0], [3.0, 0.0]])
    plan = travel.plan(np.array([slope, under, beyond]), [0, 1, 2], [False] * 3, body=body)
    _, (_, path) = routes(plan)
    np.testing.assert_allclose(path, [[-1.5, 0.25], [1.5, 2.0], [2.5, 2.0], [4.0, 0.0]], atol=1e-6)


def test_a_point_is_what_it_was():
    segments = np.array([[[0.0, 0.0], [1.0, 0.0]], [[0.0, 0.5], [1.0, 0.7]], [[2.0, 0.0], [3.0, 0.0]]])
    with_body = travel.plan(segments, [0, 1, 2], [False] * 3, body=POINT)
    without = travel.plan(segments, [0, 1, 2], [False] * 3)
    np.testing.assert_array_equal(with_body.via, without.via)
