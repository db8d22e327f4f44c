"""Pictures: that they show what they should, and are the same each time."""

import re
import struct

import numpy as np
import pytest
from making import make_grid, make_lines, make_plan, read_lines

import profiles
from gcode import preview

SHEET = make_grid([[-45, -20], [30, None]])


def test_a_grid_shows_one_stroke_a_tile_or_all_toolpaths():
    borders, strokes = preview.draw_grid(SHEET).axes[0].collections
    assert len(borders.get_segments()) == 6
    directions = [np.degrees(np.arctan2(*(s[1] - s[0])[::-1])) for s in strokes.get_segments()]
    assert sorted(round(d, 6) for d in directions) == [-45, -20, 30]
    plan, _, _ = make_plan(SHEET)
    _, lines = preview.draw_grid(SHEET, show="toolpaths").axes[0].collections
    assert len(lines.get_segments()) == len(plan.toolpaths)


@pytest.mark.parametrize("color", ["kind", "order"])
def test_a_sequence_shows_all_extrusions_and_travels(color):
    plan, _, _ = make_plan(SHEET)
    drawing = preview.Drawing.of_plan(plan)
    figure = preview.draw_sequence(drawing, color=color)
    travels, toolpaths = figure.axes[0].collections
    n = len(plan.toolpaths)
    assert (len(travels.get_segments()), len(toolpaths.get_segments())) == (n - 1, n)
    assert (len(np.unique(toolpaths.get_colors(), axis=0)) > n // 2) == (color == "order")
    assert figure.axes[0].lines[0].get_xydata().tolist() == [plan.toolpaths[0, 0].tolist()]


@pytest.mark.parametrize("profile", ["marlin-generic", "marlin-pneumatic"])
def test_a_program_shows_what_its_plan_does(profile):
    loaded = profiles.load(profile)
    plan, _, _ = make_plan(SHEET)
    drawing = preview.Drawing.of_moves(read_lines(make_lines(SHEET, profile)), loaded)
    moved = drawing.toolpaths - drawing.toolpaths[0, 0] + plan.toolpaths[0, 0]
    np.testing.assert_allclose(moved, plan.toolpaths, atol=0.002)
    long = [
        np.hypot(*(a - b)) > 0.001 for a, b in zip(plan.toolpaths[1:, 0], plan.toolpaths[:-1, 1], strict=True)
    ]
    assert len(drawing.travels) == sum(long)


@pytest.mark.parametrize("file_format", preview.FORMATS)
def test_pictures_are_of_their_kind_and_reproducible(file_format):
    magic = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}[file_format]
    first, second = (preview.picture(preview.draw_grid(SHEET), file_format) for _ in range(2))
    assert first.startswith(magic)
    assert first == second


def test_an_svg_keeps_its_text():
    svg = preview.picture(preview.draw_grid(SHEET), "svg").decode()
    assert re.search(r">x \[mm\]<", svg)


def test_a_thumbnail_has_exactly_the_size_asked_for():
    png = preview.thumbnail(make_plan(SHEET)[0], (120, 90))
    assert struct.unpack(">II", png[16:24]) == (120, 90)


@pytest.mark.parametrize(
    "command", ["G2 X14 Z3 I1 K1", "G3 X14 Z3 R4", "G5 X14 Z3", "G28", "G27", "MY_MACRO A=1"]
)
def test_what_is_not_followed_is_named_and_no_straight_line_is_drawn_for_it(command):
    loaded = profiles.load("marlin-generic")
    lines = make_lines(SHEET)
    k = [k for k, line in enumerate(lines) if line.startswith(";TOOLPATH")][2]
    moves = read_lines([*lines[:k], command, *lines[k:]])
    assert [(move.line, move.text) for move in preview.not_drawn(moves, loaded)] == [(k + 1, command)]
    assert preview.not_drawn(read_lines(lines), loaded) == []
    drawing = preview.Drawing.of_moves(moves, loaded)
    if command.startswith(("G2 ", "G3 ", "G5 ")):
        starts = [tuple(travel[0]) for travel in drawing.travels]
        assert (14.0, 3.0) in starts
        whole = preview.Drawing.of_moves(read_lines(lines), loaded)
        assert len(drawing.toolpaths) == len(whole.toolpaths)
