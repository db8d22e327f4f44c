"""What counts: masks that are given, found masks, and outlines."""

import json

import numpy as np
import pytest
import shapely
from pictures import axes_of, axial, grating, noisy
from PIL import Image

from slicer import grid
from tissue.errors import TissueError
from tissue.image import measure_image
from tissue.mask import read_mask
from tissue.orient import orient
from tissue.settings import ImageSettings, Layout

LAYOUT = Layout(tiles=(8, 6), size_mm=24, spacing_mm=0.4)


@pytest.fixture
def tissue(tmp_path):
    """A round piece of tissue, 100 pixels wide, left above the middle of 240x180."""
    x, y = axes_of(240, 180)
    inside = np.hypot(x - 80, y - 110) < 50
    picture = np.where(inside, 120 + 100 * grating(30), 20.0)
    picture = noisy(picture, 60)
    Image.fromarray(np.clip(picture, 0, 255).astype(np.uint8)).save(tmp_path / "a.png")
    Image.fromarray(inside).save(tmp_path / "mask.png")
    return tmp_path


def oriented(folder, layout=LAYOUT, **settings):
    return orient(measure_image(folder / "a.png", ImageSettings(**settings), layout), layout)


def test_a_mask_image(tissue):
    found = oriented(tissue, mask=tissue / "mask.png")
    assert 8 <= found.kept.sum() <= 18
    assert np.median(axial(found.sheet.angles_deg[found.kept], 30)) < 3
    assert found.kept[3, 2]  # above the middle, at the left
    assert not found.kept[0].any()


def test_polygons_are_in_pixels_with_y_down(tissue):
    corners = [[0, 0], [120, 0], [120, 60], [0, 60], [0, 0]]
    hole = [[30, 15], [60, 15], [60, 30], [30, 30], [30, 15]]
    feature = {"type": "Feature", "geometry": {"type": "Polygon", "coordinates": [corners, hole]}}
    (tissue / "m.json").write_text(json.dumps({"type": "FeatureCollection", "features": [feature]}))
    mask = read_mask(tissue / "m.json", 240, 180)
    assert mask.sum() == pytest.approx(120 * 60 - 30 * 15, rel=0.03)
    assert mask[5, 5]
    assert not mask[20, 40]
    assert not mask[100, 5]


def test_wrong_masks(tissue):
    Image.fromarray(np.ones((10, 20), np.uint8)).save(tissue / "small.png")
    Image.fromarray(np.zeros((180, 240), np.uint8)).save(tissue / "nothing.png")
    (tissue / "text.json").write_text("hello")
    (tissue / "point.json").write_text('{"type": "Point", "coordinates": [1, 2]}')
    (tissue / "line.json").write_text('{"type": "Polygon", "coordinates": [[[1, 2], [3, null]]]}')
    (tissue / "far.json").write_text(
        '{"type": "Polygon", "coordinates": [[[900, 900], [901, 900], [901, 901]]]}'
    )
    for name, said in (
        ("small.png", "has 20x10 pixels, but the picture 240x180"),
        ("nothing.png", "leaves nothing"),
        ("text.json", "a mask is an image"),
        ("point.json", "holds Point where polygons are needed"),
        ("line.json", "at least 3 corners"),
        ("far.json", "leaves nothing"),
        ("none.png", "there is no such file"),
    ):
        with pytest.raises(TissueError, match=said):
            oriented(tissue, mask=tissue / name)


def test_tissue_is_found_and_its_outline_followed(tissue):
    layout = Layout(tiles=(8, 6), size_mm=24, spacing_mm=0.4, outline=True)
    found = oriented(tissue, layout, auto_mask=True)
    area = shapely.union_all([shapely.Polygon(rings[0], rings[1:]) for rings in found.sheet.outline_mm])
    # In mm with y up; a tenth of a pixel's mm. Structure reaches some pixels beyond the border.
    true = shapely.Point(8.0, 11.0).buffer(5.0)
    assert area.intersection(true).area > 0.9 * true.area
    assert area.area < 1.5 * true.area
    assert axial(found.sheet.angles_deg[3, 2], 30) < 3
    again = grid.loads(grid.dumps(found.sheet))
    assert again.warnings == ()


def test_min_coherence_and_nothing_left(tissue):
    found = oriented(tissue, Layout(tiles=(8, 6), size_mm=24, min_coherence=0.9))
    assert 1 <= found.kept.sum() < 20
    with pytest.raises(TissueError, match=r"no tile has an orientation: the most coherent one has"):
        oriented(tissue, Layout(tiles=(8, 6), size_mm=24, min_coherence=1.0))
    with pytest.raises(TissueError, match="none was measured on 100% of its area"):
        oriented(tissue, Layout(tiles=(2, 2), size_mm=24, min_cover=1.0), mask=tissue / "mask.png")
