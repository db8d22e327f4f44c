"""What a printed toolpath forbids to the tip, against its definition and against the pressing depth."""

import math

import numpy as np
import pytest
from bodies import bodies, forbidden_below
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from slicer.kernels import kernel
from slicer.nozzle import EPS_MM as PRESS_EPS_MM
from slicer.nozzle import NozzleBody, press_depth
from slicer.reach import MOST_LINES, highest, reach

FLOOR = -3.0


@kernel
def _reach(body, floor, segment):
    lines = np.empty((MOST_LINES, 4))
    count = reach(body, floor, segment, lines)
    return lines[:count].copy()


@kernel
def _highest(lines, x):
    return highest(lines, len(lines), x)


@kernel
def _depth(body, a, b):
    return press_depth(body, a, b)


ends = st.tuples(st.floats(-2, 2), st.floats(-2, 2))
toolpaths = st.one_of(
    st.tuples(ends, ends),
    st.builds(lambda a, y: (a, (a[0], y)), ends, st.floats(-2, 2)),  # upright
    st.builds(lambda a, x: (a, (x, a[1])), ends, st.floats(-2, 2)),  # level
).map(np.array)


@settings(max_examples=300, deadline=None)
@given(body=bodies(), segment=toolpaths, x=st.floats(-4, 4))
def test_it_is_the_greatest_over_all_points_of_the_toolpath(body, segment, x):
    lines = _reach(body, FLOOR, segment)
    length = float(np.hypot(*(segment[1] - segment[0])))
    assume(length > 0.01)
    expected = forbidden_below(body, segment, x)
    # Point by point the greatest is missed by a step, along the toolpath or up the flank.
    step = length / 1999 * (1 + 1 / body.flank if body.flank > 0 else 1) + 1e-6
    edges = [*lines[:, 0], *lines[:, 2]]
    if min((abs(x - edge) for edge in edges), default=1.0) <= length / 1999 + 1e-6:
        return  # at a jump brute force may miss all of it
    assert _highest(lines, x) >= max(expected, -math.inf) - 1e-6 or expected < FLOOR
    if _highest(lines, x) > FLOOR:
        assert _highest(lines, x) <= expected + step


@settings(max_examples=300, deadline=None)
@given(body=bodies(), segment=toolpaths, x=st.floats(-4, 4), above=st.floats(0.001, 1.0))
def test_above_it_nothing_presses_too_deep_and_below_it_something_does(body, segment, x, above):
    assume(float(np.hypot(*(segment[1] - segment[0]))) > 0.01)  # no toolpath is a point
    across = abs(float(segment[1, 0] - segment[0, 0]))
    assume(across == 0.0 or across > 1e-6)  # one narrower than can be said is an upright
    y = _highest(_reach(body, FLOOR, segment), x)
    if math.isfinite(y):
        tip = np.array([[x, y - above], [x, y - above]])
        assert _depth(body, segment, tip) > body.press
    y = max(y, FLOOR) + above
    tip = np.array([[x, y], [x, y]])
    assert _depth(body, segment, tip) <= body.press + 2 * PRESS_EPS_MM


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        (NozzleBody.of(1.0), [[-0.5, 0, 0.5, 2], [0.5, 2, 1.5, 2]]),
        (NozzleBody.of(1.0, press_mm=0.25), [[-0.25, -0.25, 0.75, 1.75], [0.75, 1.75, 1.25, 1.75]]),
        (NozzleBody.of(0.0, 0.0, 1.0, 4.0), [[-2, -1, -1, 1], [-1, 1, 3, 1]]),
        (
            NozzleBody.of(2.0, 45.0, 1.0),  # steeper than its flank: first along it, then up the flank
            [[-2, -1, -1, 1], [-1, 1, 0, 2], [0, 2, 2, 2], [2, 2, 3, 1], [-2, -1, -1, 1], [-1, 1, 3, 1]],
        ),
        (
            NozzleBody.of(2.0, 45.0, barrel_width_mm=3.0),
            [[-1.5, -0.5, -0.5, 1.5], [-0.5, 1.5, 0, 2], [0, 2, 2, 2], [2, 2, 2.5, 1.5]],
        ),
        (NozzleBody.of(0.2, press_mm=0.3), []),
    ],
    ids=["blunt", "pressed", "shoulder", "cone", "barrel", "pressed away"],
)
def test_lines(body, expected):
    got = _reach(body, FLOOR, np.array([[1.0, 2.0], [0.0, 0.0]]))
    np.testing.assert_allclose(got, np.array(expected).reshape(-1, 4), atol=1e-6)
    mirrored = _reach(body, FLOOR, np.array([[-1.0, 2.0], [0.0, 0.0]]))
    np.testing.assert_allclose(
        mirrored * [-1, 1, -1, 1], np.array(expected).reshape(-1, 4)[:, [2, 3, 0, 1]], atol=1e-6
    )


def test_the_flank_ends_where_no_tip_goes():
    lines = _reach(NozzleBody.of(1.0, 45.0), 0.0, np.array([[0.0, 2.0], [1.0, 2.0]]))
    np.testing.assert_allclose(lines[0], [-2.5, 0.0, -0.5, 2.0], atol=1e-6)
    np.testing.assert_allclose(lines[-1], [1.5, 2.0, 3.5, 0.0], atol=1e-6)
