"""The examples that came from tissue, made again from the pictures and volumes that libraries ship."""

from pathlib import Path

import numpy as np
import pytest
from pictures import axial

from slicer import grid
from tissue.diffusion import measure_volume
from tissue.image import measure_image
from tissue.orient import orient
from tissue.settings import ImageSettings, Layout, VolumeSettings

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize("tiles", [8, 16])
def test_the_stained_colon(tiles):
    skimage = pytest.importorskip("skimage")
    layout = Layout(tiles=(tiles, tiles), size_mm=tiles, spacing_mm=0.1)
    settings = ImageSettings(channel="mean", sigma_px=1.5, rho_px=6)
    found = orient(
        measure_image(Path(skimage.__file__).parent / "data" / "ihc.png", settings, layout), layout
    )
    example = grid.read(EXAMPLES / f"ihc_{tiles}x{tiles}.json")
    assert found.sheet.meta["source"]["sha256"] == example.meta["source"]["sha256"]
    off = axial(found.sheet.angles_deg, example.angles_deg)
    assert np.median(off) < 1
    assert off.mean() < 2
    sure = found.tiles.coherence > 0.4
    assert sure.mean() > 0.4
    assert off[sure].max() < 9


def test_the_brain():
    dipy = pytest.importorskip("dipy")
    files = Path(dipy.__file__).parent / "data" / "files"
    layout = Layout(tiles=(10, 10), size_mm=10, spacing_mm=0.1)
    settings = VolumeSettings(
        plane="sagittal",
        slice_index=1,
        bval=files / "small_101D.bval",
        bvec=files / "small_101D.bvec",
    )
    found = orient(measure_volume(files / "small_101D.nii.gz", settings, layout), layout)
    example = grid.read(EXAMPLES / "dti_small_101D_sagittal_10x10.json")
    off = axial(found.sheet.angles_deg, example.angles_deg)
    # The volume stands 0.9 degrees off the scanner's plane, which the example did not take into account.
    assert off.mean() < 0.5
    assert off.max() < 1.5
