"""``vslice orient``, and ``slice`` of an image: from a picture to a checked program."""

import hashlib
import json
from pathlib import Path

import nibabel
import numpy as np
import pytest
from pictures import axial, grating
from PIL import Image

from slicer import grid

SIZE = ["--tiles", "4x3", "--size-mm", "8"]


@pytest.fixture
def picture(run):
    """A picture of fibres at 30 degrees in the folder of the run."""
    Image.fromarray(np.round(grating(30) * 255).astype(np.uint8)).save("muscle.png")
    return run


def test_an_image_becomes_a_grid_with_its_record_and_a_picture(picture):
    code, out, err = picture("orient", "muscle.png", *SIZE, "-o", "sheet.json")
    assert code == 0, err
    assert out == ""
    sheet = grid.read(Path("sheet.json"))
    assert axial(sheet.angles_deg, 30).max() < 0.1
    assert sheet.tile_mm == (2, 2)
    meta = sheet.meta
    assert len(meta["source"]["sha256"]) == 64
    assert meta["source"]["size_px"] == [240, 180]
    assert meta["method"]["sigma_px"] == 1.5
    assert meta["versions"]["structure-tensor"]
    assert np.array(meta["coherence"]).min() > 0.99
    assert Path("sheet.orient.png").read_bytes().startswith(b"\x89PNG")
    assert "12 of 4x3, 2 x 2 mm each" in err
    assert sorted(path.name for path in Path().iterdir()) == ["muscle.png", "sheet.json", "sheet.orient.png"]


def test_a_sidecar_keeps_the_record_under_the_names_of_bids(picture):
    run, name = picture, "muscle.png"
    code, _, _ = run(
        "orient", name, "--tiles", "4x4", "--pixel-um", "2", "-o", "g.json", "--sidecar", "g.meta.json"
    )
    assert code == 0
    kept = json.loads(Path("g.meta.json").read_text())
    assert kept["Sources"] == [Path(name).name]
    assert kept["GeneratedBy"][0]["Name"] == "vslice"
    assert kept["PixelSize"] == [2, 2]
    assert kept["SourceSHA256"] == hashlib.sha256(Path(name).read_bytes()).hexdigest()
    assert kept["coherence"] == json.loads(Path("g.json").read_text())["meta"]["coherence"]
    code, _, err = run("orient", name, "--pixel-um", "2", "-o", "g.json", "--sidecar", "./g.json")
    assert code == 2
    assert "--sidecar" in err


def test_the_same_input_gives_the_same_bytes(picture):
    for name in ("a", "b"):
        assert picture("orient", "muscle.png", *SIZE, "-o", f"{name}.json")[0] == 0
    assert Path("a.json").read_bytes() == Path("b.json").read_bytes()
    assert Path("a.orient.png").read_bytes() == Path("b.orient.png").read_bytes()


def test_by_default_names_stand_beside_the_input_and_never_on_it(picture):
    assert picture("orient", "muscle.png", *SIZE)[0] == 0
    assert Path("muscle.json").is_file()
    assert Path("muscle.orient.png").is_file()
    code, _, err = picture("orient", "muscle.png", *SIZE, "--picture", "muscle.png")
    assert code == 2
    assert "is the input itself" in err


def test_stdout_and_no_picture(picture):
    code, out, _ = picture("orient", "muscle.png", *SIZE, "-o", "-")
    assert code == 0
    assert axial(grid.loads(out).angles_deg, 30).max() < 0.1
    assert picture("orient", "muscle.png", *SIZE, "-o", "a.json", "--no-picture")[0] == 0
    assert sorted(path.name for path in Path().iterdir()) == ["a.json", "muscle.png"]


def test_an_image_is_sliced_at_once_and_the_program_passes_the_check(picture):
    code, _, err = picture("muscle.png", *SIZE, "-o", "part.gcode", "--method", "greedy")
    assert code == 0, err
    assert "mean deviation" in err
    assert picture("check", "part.gcode")[0] == 0
    assert picture("orient", "muscle.png", *SIZE, "-o", "sheet.json")[0] == 0
    assert picture("sheet.json", "-o", "again.gcode", "--method", "greedy")[0] == 0
    # The same bytes, the hash of the grid included.
    assert Path("again.gcode").read_bytes() == Path("part.gcode").read_bytes()
    assert picture("check", "part.gcode", "--grid", "sheet.json")[0] == 0


def test_a_table_of_angles_is_sliced_at_once_where_its_tiles_have_a_size(run):
    Path("angles.csv").write_text("10,20\n-10,5\n")
    words = ("-p", "paper", "--effort", "quick")
    code, _, err = run("angles.csv", "--tile-mm", "3", "-o", "part.gcode", *words)
    assert code == 0, err
    assert "2x2" in err
    code, _, err = run("angles.csv", "-o", "part.gcode", *words)
    assert code == 2
    assert "--tile-mm" in err


def test_what_is_called_a_picture_and_is_none_is_refused_as_one(run):
    Path("text.png").write_text("no picture")
    for words in (("orient", "text.png"), ("text.png", "-o", "x.gcode")):
        code, _, err = run(*words, "--tiles", "4x3", "--size-mm", "12")
        assert code == 2
        assert "is no PNG, JPEG, BMP or TIFF" in err


def test_turns_are_told(picture):
    code, _, err = picture("orient", "muscle.png", "--size-mm", "8", "--rotate", "best", "-o", "a.json")
    assert code == 0
    assert "turned by -30°: mean tilt 30.0° becomes 0.0°" in err
    code, _, err = picture("orient", "muscle.png", "--size-mm", "8", "--max-tilt", "10", "-o", "a.json")
    assert "100% of the fibres were steeper than 10°, now 0%" in err
    for words, angle in (
        (["--rotate", "90"], -60),
        (["--flip", "x"], -30),
        (["--flip", "y", "--rotate", "5"], -25),
    ):
        assert picture("orient", "muscle.png", "--size-mm", "8", *words, "-o", "a.json")[0] == 0
        sheet = grid.read(Path("a.json"))
        assert axial(sheet.angles_deg[~np.isnan(sheet.angles_deg)], angle).max() < 0.1


def test_a_sweep_shows_the_trade(run):
    x, y = np.meshgrid(np.arange(256) - 60.0, np.arange(256) - 60.0)
    rings = np.round(127 + 120 * np.sin(np.hypot(x, y) * 0.6)).astype(np.uint8)
    Image.fromarray(rings).save("rings.png")
    code, _, err = run("orient", "rings.png", "--size-mm", "8", "--sweep", "2,4,8", "-o", "a.json")
    assert code == 0, err
    heads, *rows = Path("a.sweep.csv").read_text().splitlines()
    assert heads == "cols,tile_mm,deviation_deg,toolpaths,printed_mm,travel_mm,time_s"
    deviation = [float(row.split(",")[2]) for row in rows]
    assert deviation[0] > deviation[1] > deviation[2]
    assert [float(row.split(",")[1]) for row in rows] == [4, 2, 1]
    assert Path("a.sweep.png").is_file()
    assert "deviation" in err


def test_tables_and_volumes(run):
    Path("a.csv").write_text("10,20\n30,40\n")
    assert run("orient", "a.csv", "--tile-mm", "2", "-o", "a.json")[0] == 0
    assert grid.read(Path("a.json")).angles_deg.tolist() == [[30, 40], [10, 20]]
    assert Path("a.orient.png").is_file()
    vectors = np.tile(np.array([0.6, 0.8, 0], np.float32), (12, 12, 3, 1))
    nibabel.save(nibabel.Nifti1Image(vectors, np.diag([2.0, 2, 2, 1])), "V1.nii.gz")
    words = ("--plane", "axial", "--vectors", "voxel", "--tiles", "4")
    assert run("orient", "V1.nii.gz", *words, "-o", "v.json")[0] == 0
    sheet = grid.read(Path("v.json"))
    assert axial(sheet.angles_deg, 53.13).max() < 0.01
    assert sheet.tile_mm == (6, 6)
    assert run("V1.nii.gz", *words, "-o", "v.gcode", "--method", "greedy")[0] == 0


WRONG = [
    ("orient none.png", "there is no such file"),
    ("orient text.png --size-mm 8", "is no PNG, JPEG, BMP or TIFF"),
    ("orient muscle.png", "does not say how large a pixel is"),
    ("orient muscle.png --size-mm 8 --tiles 0x3", "no number of tiles"),
    ("orient muscle.png --size-mm 8 --tiles many", "no number of tiles"),
    ("orient muscle.png --size-mm 8 --tiles 2000x2000", "1000000 is the most"),
    ("orient muscle.png --size-mm 8 --tiles 9999x99", "finer than what was measured"),
    ("orient muscle.png --size-mm 0.05 --tiles 9", "tile_mm"),
    ("orient muscle.png --size-mm 8 --tiles 4 --tile-mm 2", "--tiles and --tile-mm"),
    ("orient muscle.png --size-mm 8 --rotate 5 --max-tilt 30", "--rotate and --max-tilt"),
    ("orient muscle.png --size-mm 8 --channel 0 --stain dab", "--channel and --stain"),
    ("orient muscle.png --size-mm 8 --mask text.png --auto-mask", "--mask and --auto-mask"),
    ("orient muscle.png --size-mm 8 --mask text.png", "a mask is an image"),
    ("orient muscle.png --size-mm 8 --plane axial", "--plane has no effect on an image"),
    ("orient muscle.png --size-mm 8 --unit radians", "--unit has no effect on an image"),
    ("orient muscle.png --size-mm 8 --crop 1,2,3", "must be 4 whole numbers"),
    ("orient muscle.png --size-mm 8 --min-coherence 1", "no tile has an orientation"),
    ("orient muscle.png --size-mm 8 -p marlin-syringe", "--profile has no effect"),
    ("orient muscle.png --size-mm 8 --no-picture --hatch-lines", "--hatch-lines has no effect"),
    ("orient muscle.png --size-mm 8 --picture a.svg", "must end in .png"),
    ("orient muscle.png --size-mm 8 -o none/a.json", "there is no folder none"),
    ("orient black.png --size-mm 8", "has no structure"),
    ("orient a.csv", "give the side of a tile"),
    ("orient a.csv --tile-mm 2 --sigma 2", "--sigma has no effect on a table"),
    ("orient a.csv --tile-mm 2 --sweep 2", "--sweep has no effect on a table"),
    ("orient v.nii --sigma 2", "--sigma has no effect on a volume"),
    ("orient v.nii --bval a.csv", "--bval and --bvec go together"),
    ("orient v.nii", "principal directions (V1) need"),
    ("sheet.json --tiles 4", "--tiles has no effect on a grid"),
    ("none.png --tiles 4", "there is no such file"),
    ("muscle.png --size-mm 8 --set x", "--set"),
]


@pytest.mark.parametrize(("words", "said"), WRONG, ids=[words for words, _ in WRONG])
def test_what_cannot_be_used_ends_with_2_and_leaves_nothing(picture, words, said):
    Path("text.png").write_text("hello")
    Path("a.csv").write_text("10,20\n")
    Path("sheet.json").write_text('{"tile_mm": 1.0, "spacing_mm": 0.25, "angles_deg": [[-45]]}')
    Image.fromarray(np.zeros((50, 50), np.uint8)).save("black.png")
    nibabel.save(nibabel.Nifti1Image(np.ones((4, 5, 6), np.float32), np.eye(4)), "v.nii")
    before = sorted(path.name for path in Path().iterdir())
    code, _, err = picture(*words.split())
    assert code == 2, err
    assert said in err
    assert "Traceback" not in err
    assert sorted(path.name for path in Path().iterdir()) == before


def test_without_the_libraries_the_extra_is_named(picture, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "structure_tensor", None)
    code, _, err = picture("orient", "muscle.png", *SIZE)
    assert code == 2
    assert "pip install 'vslice[tissue]'" in err


def test_the_help_of_slice_is_short_and_that_of_orient_whole(run):
    assert "--stain" not in run("slice", "--help")[1]
    assert "--size-mm" in run("slice", "--help")[1]
    assert "--stain" in run("orient", "--help")[1]


def test_notes_are_silent_when_asked(picture):
    assert picture("orient", "muscle.png", *SIZE, "--quiet")[2] == ""
    assert json.loads(Path("muscle.json").read_text())
