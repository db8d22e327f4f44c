"""A disk that is full: the file is named, what was there is still there, and nothing half is left."""

import resource
import subprocess
import sys
from pathlib import Path

import pytest

TILE = '{"tile_mm": 4.0, "spacing_mm": 0.25, "angles_deg": [[-45]]}'
SCRIPT = "import vslice.cli, sys; vslice.cli.main(sys.argv[1:])"
FULL = "No space left on device"

pytestmark = pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")


def vslice(*words, out=subprocess.PIPE, limit=None):
    """Run a command line in a process of its own: (exit code, stderr)."""

    def small_files():
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    root = Path(__file__).parents[2]
    ended = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(root)!r}); {SCRIPT}", *map(str, words)],
        stdout=out, stderr=subprocess.PIPE, text=True, preexec_fn=small_files if limit else None, check=False,
    )  # fmt: skip
    return ended.returncode, ended.stderr


def test_a_full_device_is_named(run):
    Path("sheet.json").write_text(TILE)
    Path("part.gcode").symlink_to("/dev/full")
    code, out, err = run("-q", "sheet.json", "-o", "part.gcode", "--method", "greedy")
    assert (code, out) == (1, "")
    assert err == f"Error: part.gcode: cannot be written: {FULL}\n"
    for words in (["preview", "sheet.json", "-o", "a.png"], ["generate", "-o", "a.png"], ["compare", "sheet.json", "--methods", "greedy", "-o", "a.md"]):  # fmt: skip
        name = words[-1]
        Path(name).unlink(missing_ok=True)
        Path(name).symlink_to("/dev/full")
        code, _, err = run("-q", *words)
        assert code == 1
        assert f"Error: {name}: cannot be written: {FULL}" in err


def test_a_file_that_finds_no_room_leaves_the_old_one_and_no_rest(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("part.gcode").write_text("old")
    before = sorted(tmp_path.iterdir())
    code, err = vslice("generate", "--cols", 30, "--rows", 30, "-o", "part.gcode", limit=4096)
    assert code == 1
    assert "Error: part.gcode: cannot be written: File too large\n" in err
    assert Path("part.gcode").read_text() == "old"
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    "words",
    [["generate", "--cols", "30"], ["sheet.json", "-q", "-o", "-", "--method", "greedy"], ["profiles", "schema"], ["--help"], ["profiles"]],
    ids=" ".join,
)  # fmt: skip
def test_a_full_standard_output_is_named(tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    Path("sheet.json").write_text(TILE)
    with open("/dev/full", "w") as full:
        code, err = vslice(*words, out=full)
    assert code == 1
    assert err.strip() == f"Error: standard output: cannot be written: {FULL}"


@pytest.mark.parametrize(
    "words", [["generate", "--cols", "200", "--rows", "200"], ["profiles", "schema"]], ids=" ".join
)
def test_a_reader_that_goes_away_is_told_nothing(words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    process = subprocess.Popen(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(Path(__file__).parents[2])!r}); {SCRIPT}", *words],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    process.stdout.close()
    assert process.stderr.read() == ""
    process.stderr.close()
    assert process.wait() == 1
