"""Routes over the skyline against brute force."""

import numpy as np
import pytest
from fields import blocked, loose_segments, random_extension, segment_sets, taut_length
from hypothesis import given, settings

from slicer import travel
from slicer.errors import SlicerError
from slicer.precedence import covering_edges


def legs(plan, k):
    """The points of the k-th travel, both ends included."""
    via = plan.via[plan.via_start[k] : plan.via_start[k + 1]]
    return np.vstack([plan.toolpaths[k - 1, 1], via, plan.toolpaths[k, 0]])


@settings(max_examples=150, deadline=None)
@given(segment_sets(max_n=40) | loose_segments())
def test_routes_are_the_taut_string_over_what_is_printed(segments):
    n = len(segments)
    random = np.random.default_rng(n)
    order = random_extension(random, n, covering_edges(segments))
    plan = travel.plan(segments, order, random.random(n) < 0.5)
    total = 0.0
    for k in range(1, n):
        printed, path = plan.toolpaths[:k], legs(plan, k)
        length = np.hypot(*np.diff(path, axis=0).T).sum()
        total += length
        assert (len(path) > 2) == blocked(printed, path[0], path[-1])
        assert not any(blocked(printed, a, b) for a, b in zip(path, path[1:], strict=False))
        if len(path) > 2:
            assert length == pytest.approx(taut_length(printed, path[0], path[-1]), abs=1e-6)
    assert plan.routed_mm == pytest.approx(total, abs=1e-9)
    assert plan.straight_mm == pytest.approx(travel.straight_mm(plan.toolpaths))
    assert plan.routed_mm >= plan.straight_mm - 1e-9


@settings(max_examples=50, deadline=None)
@given(segment_sets(max_n=40) | loose_segments())
def test_clearance_lifts_a_route_and_leaves_straight_travels_alone(segments):
    n = len(segments)
    order = random_extension(np.random.default_rng(n), n, covering_edges(segments))
    flat = travel.plan(segments, order, np.zeros(n, bool))
    lifted = travel.plan(segments, order, np.zeros(n, bool), clearance_mm=0.3)
    for k in range(1, n):
        low, high = legs(flat, k), legs(lifted, k)
        if len(low) == 2:
            assert len(high) == 2
            continue
        assert high[1, 0] == pytest.approx(high[0, 0])  # first straight up
        assert high[-2, 0] == pytest.approx(high[-1, 0])  # last straight down
        for x, y in low[1:-1]:
            assert np.isclose(high[1:-1], (x, y + 0.3)).all(axis=1).any()


def test_a_wall_is_crossed_at_its_top():
    floor = [[[0.0, 0.0], [1.0, 0.0]], [[3.0, 0.0], [4.0, 0.0]]]
    wall = [[2.0, 0.0], [2.0, 5.0]]
    plan = travel.plan(np.array([wall, *floor]), [0, 1, 2], [False, False, False], clearance_mm=0.5)
    np.testing.assert_allclose(legs(plan, 2), [[1, 0], [1, 0.5], [2, 5.5], [3, 0.5], [3, 0]])


def test_what_is_covered_hides_a_wall():
    # The wall is passed over by the roof, so only the roof is in the way.
    segments = np.array(
        [
            [[2.0, 0.0], [2.0, 1.0]],
            [[1.0, 2.0], [3.0, 2.0]],
            [[0.0, 0.0], [1.0, 0.0]],
            [[3.0, 0.0], [4.0, 0.0]],
        ]
    )
    plan = travel.plan(segments, [0, 1, 2, 3], [False] * 4)
    np.testing.assert_allclose(legs(plan, 3), [[1, 0], [1, 2], [3, 2], [3, 0]])


def test_straight_up_along_one_x_is_free():
    segments = np.array([[[0.0, 0.0], [1.0, 0.0]], [[1.0, 3.0], [2.0, 3.0]]])
    plan = travel.plan(segments, [0, 1], [False, False], clearance_mm=1.0)
    assert plan.routed_mm == plan.straight_mm == 3.0


@pytest.mark.parametrize("n", [0, 1])
def test_nothing_to_travel(n):
    plan = travel.plan(np.array([[[0.0, 0.0], [1.0, 0.0]]])[:n], range(n), [False] * n)
    assert (plan.straight_mm, plan.routed_mm, len(plan.via)) == (0.0, 0.0, 0)
    assert plan.printed_mm == n


def test_clearance_must_not_be_negative():
    with pytest.raises(SlicerError, match="-1 must be at least 0"):
        travel.plan(np.empty((0, 2, 2)), [], [], clearance_mm=-1)
