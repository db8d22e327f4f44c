"""Commands that order no toolpaths load neither numba nor what else they do not need, and so start at once."""

import subprocess
import sys
from pathlib import Path

import pytest

RUN = """
import sys
from vslice.cli import main
try:
    main()
except SystemExit as end:
    assert not end.code, end.code
heavy = ("numba", "llvmlite", "scipy", "matplotlib", "shapely")
heavy += ("httpx", "keyring", "tissue", "structure_tensor", "tifffile", "nibabel", "dipy", "skimage")
print(*[name for name in heavy if name in sys.modules], file=sys.stderr)
"""
GRID = '{"tile_mm": 1.0, "spacing_mm": 0.25, "angles_deg": [[-45]]}'


@pytest.mark.parametrize(
    ("words", "needed"),
    [
        ("--help", ""),
        ("slice --help", ""),
        ("orient --help", ""),
        ("check part.gcode", ""),
        ("check part.gcode --grid grid.json", "shapely"),
        ("send part.gcode --dry-run --quiet", ""),
        ("preview part.gcode -o part.png", "matplotlib"),
        ("play part.gcode -o part.html", ""),
        ("play part.gcode -o part.html --grid grid.json", "shapely"),
        ("ports", ""),
        ("upload --help", ""),
        ("config", ""),
        ("completion bash", ""),
        ("help grid", ""),
        ("json-schema check", ""),
        ("profiles --json", ""),
        ("profiles", ""),
        ("profiles show marlin-generic", ""),
        ("grid-schema", "shapely"),
        ("generate -o other.json", "shapely"),
    ],
)
def test_only_what_is_needed_is_loaded(run, words, needed):
    Path("grid.json").write_text(GRID)
    assert run("grid.json", "-o", "part.gcode", "--method", "greedy")[0] == 0
    done = subprocess.run(
        [sys.executable, "-c", RUN, *words.split()], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr.splitlines()[-1].strip() == needed


@pytest.mark.parametrize("name", ["missing.gcode", "missing.json"])
def test_what_draws_is_loaded_once_there_is_something_to_draw(tmp_path, name):
    code = RUN.replace("assert not end.code, end.code", "assert end.code")
    words = [sys.executable, "-c", code, "preview", name, "-o", "part.png"]
    done = subprocess.run(words, capture_output=True, text=True, check=False, cwd=tmp_path)
    *said, loaded = done.stderr.splitlines()
    assert name in said[0]
    assert "matplotlib" not in loaded


def test_a_grid_is_sliced_without_what_measures_tissue(run):
    Path("grid.json").write_text(GRID)
    words = ("grid.json", "-o", "part.gcode", "--method", "greedy")
    code = RUN.replace('heavy = ("numba", "llvmlite", "scipy", "matplotlib", "shapely")', "heavy = ()")
    done = subprocess.run(
        [sys.executable, "-c", code, *words], capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    # The first bytes of the file were looked at, and nothing was imported for more.
    assert done.stderr.splitlines()[-1].strip() in ("", "tissue")


def test_a_folder_with_the_name_of_a_command_hides_no_command(run):
    Path("profiles").mkdir()
    code, out, _ = run("profiles")
    assert code == 0
    assert "marlin-generic" in out
