"""Directions that are known come out of pictures: gratings, rings, spirals, noise, any shape and any strip."""

import numpy as np
import pytest
from pictures import axial, grating, noisy, rings, spiral

from tissue import structure
from tissue.errors import TissueError
from tissue.field import tilt_deg
from tissue.structure import structure_field
from tissue.tiling import extent, tile


def grey(rows):
    return rows.astype(np.float32)


def measured(picture, cols=6, rows=4, *, sigma=1.0, rho=6.0, cell=1, keep=None):
    field = structure_field(picture, grey, sigma_px=sigma, rho_px=rho, cell_px=cell, keep=keep)
    return tile(field, cols, rows)


@pytest.mark.parametrize("tilt", [0, 10, 33, 45, 67, 89, 90, -1, -30, -45, -80])
@pytest.mark.parametrize("cell", [1, 3])
def test_a_grating_has_its_direction(tilt, cell):
    found = measured(grating(tilt), cell=cell)
    assert axial(found.tilt_deg, tilt).max() < 0.05
    assert found.coherence.min() > 0.99
    assert np.nanmax(found.deviation_deg) < 0.1


@pytest.mark.parametrize(("width", "height"), [(201, 303), (303, 201), (97, 97), (64, 511)])
def test_odd_sizes_portrait_and_landscape(width, height):
    found = measured(grating(25, width, height), 3, 3)
    assert axial(found.tilt_deg, 25).max() < 0.1


@pytest.mark.parametrize("cell", [1, 7, 31])
def test_the_tissue_is_as_large_as_its_picture_whatever_the_cells(cell):
    field = structure_field(grating(25, 201, 303), grey, sigma_px=1.0, rho_px=6.0, cell_px=cell)
    low, high = extent(field)
    assert [*low, *(high - low)] == pytest.approx([0, 0, 201, 303])
    assert tile(field, 3, 3).side == pytest.approx((67, 101))
    assert tile(field, 1, 1).cover[0, 0] == pytest.approx(1.0, abs=0.15)  # but for the border


def test_all_eight_orientations_of_a_picture():
    picture = grating(25, 211, 131)
    for turns in range(4):
        for mirrored in (False, True):
            shown = np.rot90(picture, turns)
            expected = 25 + 90 * turns
            if mirrored:
                shown, expected = shown[:, ::-1], -expected
            assert axial(measured(shown, 3, 3).tilt_deg, expected).max() < 0.1, (turns, mirrored)


def test_a_grating_in_a_quarter_of_a_picture_lies_in_its_tiles():
    """Which corner a tile stands for, not only which direction: y points up."""
    picture = grating(0, 200, 200)
    picture[:100, 100:] = grating(60, 200, 200)[:100, 100:]
    found = measured(picture, 4, 4)
    assert axial(found.tilt_deg[2:, 2:], 60).max() < 8
    assert axial(found.tilt_deg[3, 3], 60) < 0.1
    assert axial(found.tilt_deg[:2], 0).max() < 8
    assert axial(found.tilt_deg[0], 0).max() < 0.1


@pytest.mark.parametrize("made", [rings, lambda: spiral(30), lambda: spiral(70)])
def test_rings_and_spirals_turn_as_they_should(made):
    picture, direction = made()
    field = structure_field(picture, grey, sigma_px=1.0, rho_px=3.0, cell_px=1)
    found = tilt_deg(field.tensor)
    x, y = np.meshgrid(np.arange(256) - 127.5, np.arange(256) - 127.5)
    clear = (np.hypot(x, y) > 40) & (np.hypot(x, y) < 110)
    assert axial(found, direction)[clear].max() < 2
    assert axial(found, direction)[clear].mean() < 0.5


def test_fibres_that_cross_give_their_middle_and_little_coherence():
    found = measured(grating(30) + grating(-30))
    assert axial(found.tilt_deg, 0).max() < 2
    assert 0.3 < found.coherence.mean() < 0.7
    single = measured(grating(30))
    assert single.coherence.min() > found.coherence.max()


@pytest.mark.parametrize(("snr", "most"), [(100, 0.5), (3, 2.0), (1, 4.0)])
def test_noise(snr, most):
    worst = [
        axial(measured(noisy(grating(33, 512, 512), snr, seed), 16, 16, sigma=1.5).tilt_deg, 33).max()
        for seed in range(3)
    ]
    assert max(worst) < most


def test_strips_and_threads_change_nothing(monkeypatch):
    picture = noisy(grating(33, 300, 400), 2)
    keep = np.zeros(picture.shape, bool)
    keep[30:370, 20:250] = True
    whole = structure_field(picture, grey, sigma_px=2, rho_px=5, cell_px=4, keep=keep)
    monkeypatch.setattr(structure, "STRIP_PIXELS", 300 * 37)
    told = []
    parts = structure_field(picture, grey, sigma_px=2, rho_px=5, cell_px=4, keep=keep, progress=told.append)
    assert len(told) > 5
    assert told == sorted(told)
    assert told[-1] == 1.0
    np.testing.assert_allclose(parts.tensor, whole.tensor, rtol=1e-4, atol=1e-9)
    np.testing.assert_array_equal(parts.weight, whole.weight)


def test_a_mask_keeps_what_is_outside_from_mattering():
    picture = grating(20, 240, 180)
    picture[:, 120:] = 5 * grating(-70, 240, 180)[:, 120:]
    keep = np.zeros(picture.shape, bool)
    keep[:, :110] = True
    found = measured(picture, 6, 4, keep=keep)
    assert axial(found.tilt_deg[:, :2], 20).max() < 0.1
    assert np.isnan(found.tilt_deg[:, 3:]).all()
    assert found.cover[:, 4:].max() == 0


def test_nan_is_left_out_with_what_it_touches():
    picture = grating(20, 240, 180)
    picture[60:100, 60:100] = np.nan
    picture[0, 0] = np.inf
    found = measured(picture, 6, 4)
    assert axial(found.tilt_deg[~np.isnan(found.tilt_deg)], 20).max() < 0.1
    assert found.cover.min() < 0.7
    with pytest.raises(TissueError, match="no pixel counts"):
        measured(np.full((50, 50), np.nan))
