"""The random walk of the paper."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slicer import grid
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
        ({"deviation_deg": -1.0}, "deviation -1: must be from 0 to 180"),
        ({"deviation_deg": 1e308}, "deviation 1e\\+308: must be from 0 to 180"),
        ({"cols": 100_000, "rows": 11}, "100000 columns and 11 rows are 1100000 tiles; 1000000 is the most"),
        ({"cols": 1000, "tile_mm": 1000.0}, "is 1e\\+06 mm long; 100000 mm is the most"),
        ({"spacing_mm": 0.001}, "spacing 0.001 mm: must be from 0.01 to 10000 mm"),
        ({"seed": -1}, "seed -1: must be from 0"),
        ({"seed": 10**5000}, "seed of 16610 bits: must be from 0"),
        ({"low_deg": -95.0}, "low -95"),
        ({"start_deg": 10.0}, "start 10, high 0"),
    ],
)
def test_numbers_out_of_range_are_named(change, says):
    with pytest.raises(SlicerError, match=says):
        random_walk(**({"cols": 2, "rows": 2, "seed": 1} | change))


@pytest.mark.parametrize(
    "change",
    [
        {"seed": 2**63 - 1},
        {"tile_mm": 0.01, "spacing_mm": 0.01},
        {"tile_mm": 10_000.0, "spacing_mm": 10_000.0},
        {"deviation_deg": 180.0, "low_deg": -89.999, "high_deg": 90.0},
        {"low_deg": 1e-300, "start_deg": 1e-300, "high_deg": 1e-300},
    ],
    ids=str,
)
def test_what_is_made_at_the_limits_can_be_read(change):
    made = random_walk(**({"cols": 3, "rows": 2, "seed": 1} | change))
    read = grid.loads(grid.dumps(made))
    np.testing.assert_array_equal(read.angles_deg, made.angles_deg)
    assert read.meta == made.meta
