"""The random walk of the paper."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slicer.errors import SlicerError
from slicer.generate import random_walk, reflect


def test_the_walk_follows_its_neighbours():
    """With no deviation every tile is the mean of its neighbours, and so all are alike."""
    assert (random_walk(4, 3, seed=1, deviation_deg=0).angles_deg == -45).all()


def test_steps_stay_within_the_deviation():
    angles = random_walk(8, 8, seed=3, deviation_deg=5, low_deg=-89, high_deg=89, start_deg=0).angles_deg
    for row in range(8):
        for col in range(8):
            near = [angles[r, c] for r, c in ((row, col - 1), (row - 1, col)) if r >= 0 and c >= 0]
            if near:
                assert abs(angles[row, col] - np.mean(near)) <= 5
    assert angles[0, 0] == 0


def test_range_shape_and_seed():
    a, b, c = (random_walk(5, 4, seed=s).angles_deg for s in (1, 1, 2))
    assert a.shape == (4, 5)
    np.testing.assert_array_equal(a, b)
    assert (a != c).any()
    assert ((a >= -45) & (a <= 0)).all()


@given(st.floats(-1e4, 1e4), st.floats(-80, 0), st.floats(1, 90))
def test_reflection_folds_into_the_range(value, low, width):
    high = low + width
    folded = reflect(value, low, high)
    assert low <= folded <= high + 1e-9
    if low <= value <= high:
        assert folded == pytest.approx(value, abs=1e-9)
    # A mirror image at either end is the same place.
    assert reflect(2 * high - value, low, high) == pytest.approx(folded, abs=1e-6)
    assert reflect(2 * low - value, low, high) == pytest.approx(folded, abs=1e-6)


def test_reflection_may_take_several_turns():
    assert reflect(-140, -45, 0) == pytest.approx(-40)
    assert reflect(7, 3, 3) == 3


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"cols": 0}, "0 columns and 2 rows"),
        ({"tile_mm": 0.0}, "tile 0 mm"),
        ({"deviation_deg": -1.0}, "deviation -1"),
        ({"low_deg": -95.0}, "low -95"),
        ({"start_deg": 10.0}, "start 10, high 0"),
    ],
)
def test_numbers_out_of_range_are_named(change, says):
    with pytest.raises(SlicerError, match=says):
        random_walk(**({"cols": 2, "rows": 2, "seed": 1} | change))
