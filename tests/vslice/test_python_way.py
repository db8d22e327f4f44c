"""The documented Python way, its notebook, and the API page."""

import importlib
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from making import BARE, make_grid

from gcode.errors import ParseError
from profiles import ProfileError
from slicer import grid
from slicer.errors import GridError
from vslice import api

ROOT = Path(__file__).parents[2]
SHEET = make_grid([[-45, -20]])
SMALL = make_grid([[-40, -20, 10], [-30, 0, 20]], spacing=0.4, tile=(4.0, 4.0))
"""It stands for the examples, which take half a minute each."""


def test_ten_lines_lead_from_a_grid_to_a_checked_program(tmp_path, monkeypatch, capsys):
    block = re.search(
        r"^```python\n(.*?)^```$", (ROOT / "docs" / "python.md").read_text(), re.DOTALL | re.MULTILINE
    )[1]
    assert len([line for line in block.splitlines() if line.strip()]) <= 10
    (tmp_path / "ihc_8x8.json").write_text(grid.dumps(SMALL))
    monkeypatch.chdir(tmp_path)
    exec(compile(block, "python.md", "exec"), {})
    assert "toolpaths" in capsys.readouterr().out
    assert (tmp_path / "part.gcode").stat().st_size > 5_000


def test_it_gives_the_bytes_of_the_command_line(run):
    Path("sheet.json").write_text(grid.dumps(SHEET))
    words = ("-p", "klipper-syringe", "--nozzle", "25G", "--set", BARE, "--method", "greedy")
    assert run("sheet.json", "-o", "a.gcode", *words)[0] == 0
    sliced = api.slice_grid("sheet.json", "klipper-syringe", nozzle="25G", settings=[BARE], method="greedy")
    assert api.write_program(sliced, "b.gcode").read_bytes() == Path("a.gcode").read_bytes()
    report = api.check_program("b.gcode", SHEET)
    assert report.violations == []
    read = api.read_program("b.gcode")
    assert read.profile == sliced.profile
    assert read.facts["method"] == "greedy"
    other = make_grid([[30]])
    assert {v.kind for v in api.check_program("b.gcode", other).violations} >= {"missing", "stray"}


def test_what_cannot_be_done_is_raised(tmp_path):
    foreign = tmp_path / "foreign.gcode"
    foreign.write_text("G28\n")
    with pytest.raises(ProfileError, match="does not say which machine"):
        api.check_program(foreign)
    with pytest.raises(ProfileError, match="no such profile"):
        api.load_profile("marlin")
    with pytest.raises(GridError):
        api.read_grid(foreign)
    with pytest.raises(ParseError):
        api.read_program(tmp_path)


def test_every_name_of_the_api_page_is_there_and_explained():
    text = (ROOT / "docs" / "api.md").read_text()
    found = re.findall(r"^::: (\S+)\n(?:    options: \{members: \[(.*?)\]\})?", text, re.MULTILINE)
    assert len(found) > 10
    for module, members in found:
        package = importlib.import_module(module)
        assert package.__doc__
        for name in re.split(r", ", members) if members else package.__all__:
            assert getattr(package, name).__doc__ or not callable(getattr(package, name)), f"{module}.{name}"


def test_the_notebook_runs(tmp_path):
    nbclient, nbformat = pytest.importorskip("nbclient"), pytest.importorskip("nbformat")
    pytest.importorskip("ipykernel")
    shutil.copy(ROOT / "examples" / "from_grid_to_program.ipynb", tmp_path)
    (tmp_path / "muscle_us_8x8.json").write_text(grid.dumps(SMALL))
    notebook = nbformat.read(tmp_path / "from_grid_to_program.ipynb", as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells)  # outputs are made, not kept
    client = nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}})
    # The kernel takes the vslice that is tested here, wherever it is installed.
    client.execute(env=os.environ | {"PYTHONPATH": str(Path(api.__file__).parents[1])})
    shown = [out for cell in notebook.cells for out in cell.get("outputs", [])]
    assert any("0 violations" in out.get("text", "") for out in shown)
    assert any("text/html" in out.get("data", {}) for out in shown)  # the player
    assert any("image/png" in out.get("data", {}) for out in shown)
    assert (tmp_path / "part.gcode").exists()


def test_the_site_builds_with_one_command(tmp_path):
    for needed in ("mkdocs", "mkdocstrings", "material"):
        pytest.importorskip(needed, reason="the site needs the extra 'docs'")
    words = [
        sys.executable,
        "-m",
        "mkdocs",
        "build",
        "--strict",
        "--quiet",
        "--site-dir",
        str(tmp_path / "site"),
    ]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    page = (tmp_path / "site" / "api" / "index.html").read_text()
    assert "check_program" in page
    assert "It cannot be judged" in page or "cannot be judged" in page
