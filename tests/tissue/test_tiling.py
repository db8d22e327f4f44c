"""Tiles of a field: exact averages, cover, deviations, turns and flips."""

import numpy as np
import pytest
from pictures import axial

from tissue.errors import TissueError
from tissue.field import Field, axial_difference_deg, coherence, tilt_deg
from tissue.tiling import extent, tile
from tissue.turning import best_turn, mean_tilt_deg, steeper_than


def field_of(angles_deg, weight=None):
    """A field with a fibre of length 1 in each cell of side 1, the first row at the top."""
    angles = np.radians(np.asarray(angles_deg, float))
    c, s = np.cos(angles), np.sin(angles)
    rows = len(angles)
    weight = np.ones(angles.shape) if weight is None else np.asarray(weight, float)
    return Field(
        np.stack([c * c, s * s, c * s]),
        weight,
        np.array([0.5, rows - 0.5]),
        np.array([1.0, 0.0]),
        np.array([0.0, -1.0]),
    )


def test_directions_near_the_half_turn_are_not_averaged_as_numbers():
    found = tile(field_of([[89, -89], [89, -89]]), 1, 1)
    assert axial(found.tilt_deg, 90).max() < 1e-9
    assert found.tilt_deg[0, 0] > 0
    assert found.deviation_deg[0, 0] == pytest.approx(1)


def test_the_bottom_row_of_tiles_is_the_last_one_of_cells():
    found = tile(field_of([[10, 20, 30], [40, 50, 60]]), 3, 2)
    np.testing.assert_allclose(found.tilt_deg, [[40, 50, 60], [10, 20, 30]], atol=1e-9)
    assert found.side == (1.0, 1.0)
    assert found.low == (0.0, 0.0)


def test_tiles_finer_than_cells_miss_none_and_much_finer_ones_are_refused():
    found = tile(field_of([[10, 20], [30, 40]]), 6, 6)
    assert not np.isnan(found.tilt_deg).any()
    np.testing.assert_allclose(found.cover, 1.0, atol=1e-9)
    np.testing.assert_allclose(found.tilt_deg[5, :3], 10, atol=1e-9)
    with pytest.raises(TissueError, match=r"50x50 tiles are finer than what was measured.*at most 1\dx1\d"):
        tile(field_of([[10, 20], [30, 40]]), 50, 50)
    with pytest.raises(TissueError, match="1000000 is the most"):
        tile(field_of([[10, 20], [30, 40]]), 2000, 2000)


def test_deviation_is_weighted_by_what_there_is_of_a_direction():
    field = field_of([[0, 0, 0, 40]])
    strong = tile(field, 1, 1)
    expected = axial_difference_deg(np.array([0, 0, 0, 40.0]), strong.tilt_deg[0, 0]).mean()
    assert strong.deviation_deg[0, 0] == pytest.approx(expected)
    weight = np.array([[1, 1, 1, 0]])
    assert tile(field_of([[0, 0, 0, 40]], weight), 1, 1).deviation_deg[0, 0] == pytest.approx(0, abs=1e-6)
    both = tile(field_of([[0, 0, 30, 60]]), 2, 1)
    assert both.mean_deviation_deg(np.array([[True, True]])) == pytest.approx(7.5)
    assert both.mean_deviation_deg(np.array([[True, False]])) == pytest.approx(0, abs=1e-6)
    assert np.isnan(both.mean_deviation_deg(np.array([[False, False]])))


@pytest.mark.parametrize("turn", [90, 180, 270, -90, 30, -77])
def test_a_turn_turns_places_and_directions_alike(turn):
    angles = np.array([[10.0, 20, 30], [40, 50, 60]])
    turned = field_of(angles).turned(turn)
    np.testing.assert_allclose(axial(tilt_deg(turned.tensor), angles + turn), 0, atol=1e-9)
    low, high = extent(turned)
    c, s = abs(np.cos(np.radians(turn))), abs(np.sin(np.radians(turn)))
    np.testing.assert_allclose(high - low, [3 * c + 2 * s, 3 * s + 2 * c])
    if turn == 90:
        found = tile(turned, 2, 3).tilt_deg
        # What was at the right is now at the top.
        assert axial(found, np.array([[100, 130], [110, 140], [120, 150]])).max() < 1e-9


def test_flips():
    angles = [[10.0, 20, 30], [40, 50, 60]]
    found = tile(field_of(angles).mirrored("x"), 3, 2).tilt_deg
    np.testing.assert_allclose(found, [[-60, -50, -40], [-30, -20, -10]], atol=1e-9)
    found = tile(field_of(angles).mirrored("y"), 3, 2).tilt_deg
    np.testing.assert_allclose(found, [[-10, -20, -30], [-40, -50, -60]], atol=1e-9)


def test_the_best_turn_makes_fibres_flat():
    field = field_of([[60.0, 62, 58, 61]])
    turn = best_turn(field)
    assert turn == pytest.approx(-60.5, abs=1)
    assert mean_tilt_deg(field.turned(turn)) < 2
    # One fibre in four stands across: flat ones win by themselves, but not with a limit.
    mixed = field_of([[0.0, 0, 0, 80]])
    assert best_turn(mixed) == pytest.approx(0, abs=1)
    limited = best_turn(mixed, 45)
    assert steeper_than(mixed, 45) == pytest.approx(0.25)
    assert steeper_than(mixed.turned(limited), 45) == 0


def test_coherence_of_nothing_is_0():
    assert coherence(np.zeros((3, 2))).tolist() == [0, 0]
    assert np.isnan(
        tile(
            Field(np.zeros((3, 4, 4)), np.ones((4, 4)), np.zeros(2), np.array([1.0, 0]), np.array([0, -1.0])),
            2,
            2,
        ).tilt_deg
    ).all()


def test_fibres_that_no_turn_makes_flatter_are_not_turned():
    """Two halves at right angles are as steep at every turn; half a degree is not worth empty corners."""
    halves = np.where(np.arange(8)[:, None] < 4, 10.0, -80.0) * np.ones((8, 8))
    assert best_turn(field_of(halves)) == 0
    assert best_turn(field_of(np.full((8, 8), 0.5))) == 0
    assert best_turn(field_of(np.full((8, 8), 20.0))) == -20
    assert best_turn(field_of(halves), 45) != 0  # the half that is steep can be turned below 45 degrees
