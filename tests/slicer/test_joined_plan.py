"""Plans in which the bead goes on over short hops."""

import numpy as np
import pytest
from fields import grids
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from shapely.geometry import LineString

from slicer.errors import CycleError
from slicer.hatch import hatch
from slicer.joins import joinable
from slicer.nozzle import POINT, NozzleBody
from slicer.sequence import Problem, solve
from slicer.travel import plan

ROWS = np.array([[[0.0, y], [1.0, y]] for y in (0.0, 0.1, 0.2, 0.4)])


def test_a_meander_is_one_bead_up_to_the_longest_join():
    made = plan(ROWS, [0, 1, 2, 3], [0, 1, 0, 1], join_mm=0.15)
    assert made.joined.tolist() == [False, True, True, False]
    assert made.beads == 2
    assert (made.joined_mm, made.routed_mm, made.straight_mm) == pytest.approx((0.2, 0.2, 0.4))
    assert plan(ROWS, [0, 1, 2, 3], [0, 1, 0, 1]).beads == 4
    assert plan(ROWS[:0], [], [], join_mm=1.0).beads == 0
    falling = ROWS[::-1]
    assert plan(falling, [0, 1, 2, 3], [0, 1, 0, 1], join_mm=0.15, downhill_deg=60).beads == 4


def test_toolpaths_that_meet_are_one_bead_without_a_join():
    halves = np.array([[[0.0, 0.0], [0.5, 0.0]], [[0.5, 0.0], [1.0, 0.0]]])
    made = plan(halves, [0, 1], [0, 0])
    assert (made.beads, made.joined.tolist()) == (1, [False, False])


def test_a_hop_over_what_is_printed_is_travelled():
    lines = np.array([[[0.0, 0.0], [1.0, 0.0]], [[1.05, 0.0], [1.15, 0.3]], [[1.2, 0.0], [2.0, 0.0]]])
    made = plan(lines, [1, 0, 2], [0, 0, 0], join_mm=0.5)
    assert not made.joined[2], "the second toolpath stands between"


@settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
@given(grids(max_tiles=2), st.sampled_from([POINT, NozzleBody.of(0.3, press_mm=0.1)]), st.integers(0, 3))
def test_joins_are_free_of_what_is_printed(grid, body, seed):
    segments = hatch(grid).segments
    assume(1 < len(segments) <= 80)
    try:
        problem = Problem.build(segments, body=body)
    except CycleError:
        assume(False)
    found = solve(problem, method="greedy", seed=seed)
    made = plan(segments, found.order, found.flipped, body=body, join_mm=0.6)
    may = joinable(segments, found.order, found.flipped, body, 0.6)
    assert not (made.joined & ~may).any()
    printed = []
    for k, toolpath in enumerate(made.toolpaths):
        if made.joined[k]:
            hop = LineString([made.toolpaths[k - 1, 1], toolpath[0]])
            assert made.via_start[k] == made.via_start[k + 1]
            assert not any(hop.crosses(line) for line in printed)
            printed.append(hop)
        printed.append(LineString(toolpath))
