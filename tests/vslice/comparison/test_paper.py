"""``vslice paper`` and what the documentation says of it."""

import os
import re
from pathlib import Path

import numpy as np
import pytest

from slicer.generate import random_walk
from slicer.hatch import hatch
from vslice import comparison
from vslice.comparison import reproduction

ROOT = Path(__file__).parents[3]
ALL = [f"figure{k}.png" for k in range(1, 6)]


def test_paper_prints_both_tables_and_draws_five_figures(run):
    code, out, _ = run("paper", "-o", "figures", "--seeds", "10", "--grids", "1", "--effort", "quick")
    assert code == 0
    assert out.count("| 2x2 |") == 3
    assert "| 1 of 4x4 | *optimum* (1 of 1 proved) |" in out
    assert sorted(path.name for path in Path("figures").iterdir()) == ALL


def test_at_most_two_toolpaths_of_the_steepest_column_are_printable():
    """The caption of Figure 3: the maximum number of printable toolpaths per column is two."""
    lines = hatch(reproduction.steepest_column())
    most = 0
    for printed, ready in reproduction.states_of_column(lines):
        ends = lines.segments[np.flatnonzero(~printed)]
        # By hand: nothing that is not printed lies below a ready toolpath. All have one tilt, so that of
        # two that share an x the one with less x + y is below.
        for segment in lines.segments[np.flatnonzero(ready)]:
            share = (ends[:, :, 0].max(axis=1) > segment[:, 0].min() + 1e-9) & (
                ends[:, :, 0].min(axis=1) < segment[:, 0].max() - 1e-9
            )
            assert not (share & (ends[:, 0].sum(axis=1) < segment[0].sum() - 1e-9)).any()
        most = max(most, int(ready.sum()))
    assert most == 2


def test_figure_3_shows_two_printable_toolpaths_and_the_angle():
    sheet = reproduction.steepest_column()
    lines = hatch(sheet)
    axes = reproduction._two_printable(sheet).axes[0]
    colors = [tuple(np.round(color[:3], 2)) for color in axes.collections[-1].get_colors()]
    green = np.array([color == (0.17, 0.63, 0.17) for color in colors])
    assert green.sum() == 2
    assert sorted(lines.tile[green, 1]) == [0, 1]
    assert axes.get_title().endswith("printable green: 2")
    assert [text.get_text() for text in axes.texts] == ["-45°"]


@pytest.mark.parametrize(("tiles", "toolpaths"), [(2, 52), (4, 200)])
def test_figures_1_4_and_5_have_as_many_toolpaths_as_the_papers_and_straight_travels(tiles, toolpaths):
    sheet = reproduction._walk_with(tiles, toolpaths)
    axes = reproduction._hill_climbed(sheet).axes[0]
    travels, extruded = (collection.get_segments() for collection in axes.collections)
    assert (len(travels), len(extruded)) == (toolpaths - 1, toolpaths)
    assert {len(line) for line in travels} == {2}, "a travel of the paper goes straight"
    drawn = sum(np.hypot(*(line[1] - line[0])) for line in travels)
    assert axes.get_title() == f"hill climbing, J = {drawn:.3f}"


def test_figure_2_has_tilts_between_0_and_minus_45():
    angles = random_walk(10, 10, seed=1).angles_deg
    assert angles.shape == (10, 10)
    assert -45 <= angles.min() < angles.max() <= 0


def test_paper_refuses_bad_places_before_it_begins(run, monkeypatch):
    monkeypatch.setattr(comparison, "table_one", lambda _: pytest.fail("the work began"))
    Path("file").write_text("mine")
    code, _, err = run("paper", "-o", "file")
    assert (code, err) == (2, "Error: file is a file; name a folder with -o.\n")
    code, _, err = run("paper", "-o", "file/deeper")
    assert code == 2
    assert "file/deeper: this folder cannot be made: Not a directory" in err
    Path("full/figure3.png").mkdir(parents=True)
    code, _, err = run("paper", "-o", "full")
    assert (code, err) == (2, "Error: full/figure3.png is a folder; name a file in it.\n")
    assert Path("file").read_text() == "mine"


def test_a_folder_that_must_not_be_written_is_refused_before_it_begins(run, monkeypatch):
    monkeypatch.setattr(comparison, "table_one", lambda _: pytest.fail("the work began"))
    # Root may write anywhere, so the answer of the system is made up.
    monkeypatch.setattr("os.access", lambda _, kind: kind != os.W_OK)
    Path("locked").mkdir()
    code, _, err = run("paper", "-o", "locked")
    assert code == 2
    assert "locked/figure1.png: you may not write to" in err


def table_rows(text, heads):
    """The cells of each row of the Markdown table whose head begins with ``heads``."""
    begin = text.index("| " + " | ".join(heads) + " |")
    table = text[begin:].split("\n\n")[0].splitlines()
    names = [cell.strip() for cell in table[0].strip("| ").split("|")]
    return [
        dict(zip(names, (cell.strip() for cell in line.strip("| ").split("|")), strict=True))
        for line in table[2:]
    ]


def test_the_documents_hold_what_the_command_prints():
    made = table_rows(reproduction.table_one(500), ["grid", "figure", "paper"])
    assert table_rows((ROOT / "docs/results.md").read_text(), ["grid", "figure", "paper"]) == made
    readme = table_rows((ROOT / "README.md").read_text(), ["grid", "figure", "paper"])
    assert len(readme) == len(made) == 6
    for short, whole in zip(readme, made, strict=True):
        for name in ("grid", "figure", "1 %", "50 %", "99 %"):
            assert short[name] == whole[name], (short["grid"], short["figure"], name)
        assert float(short["paper"]) == float(whole["paper"])


def test_the_documents_show_the_five_figures():
    text = (ROOT / "docs/results.md").read_text()
    section = text[text.index("## The source paper's Table 1") :]
    shown = re.findall(r"images/(figure\d)\.svg", section)
    assert sorted(shown) == [f"figure{k}" for k in range(1, 6)]


def test_the_figures_in_the_documents_are_the_ones_that_are_drawn(tmp_path):
    for name in reproduction.draw_figures(tmp_path, "svg"):
        kept = ROOT / "docs/images" / name
        assert kept.stat().st_size < 100_000
        assert content(kept) == content(tmp_path / name)


def content(file):
    """The words of a picture, and how many lines of each colour it has; not how they are written."""
    text = file.read_text()
    colors = ("#d62728", "#1f77b4", "#2ca02c", "#bbbbbb")
    return re.findall(r"<text[^>]*>([^<]*)", text), [text.count(f"stroke: {color}") for color in colors]
