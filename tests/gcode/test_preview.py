"""Pictures: that they show what they should, and are the same each time."""

import itertools
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


@pytest.mark.parametrize("file_format", ["png", "svg", "pdf"])
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


# Widths and heights in mm: a wide, low sheet; lower ones; an upright one; narrow ones; small and large squares.
SHAPES = [(30, 16), (30, 3), (100, 0.1), (16, 30), (3, 30), (0.1, 100), (0.5, 0.5), (200, 200)]


def lattice(width_mm, height_mm, prime):
    """Uprights side by side, with or without a line that fills the nozzle."""
    toolpaths = np.array([[[x, 5], [x, 5 + height_mm]] for x in np.linspace(100, 100 + width_mm, 25)])
    travels = [np.array([a[1], b[0]]) for a, b in zip(toolpaths, toolpaths[1:], strict=False)]
    line = np.array([[[78.0, 5.1], [98.0, 5.1]]]) if prime else np.empty((0, 2, 2))
    return preview.Drawing(toolpaths, travels, list(range(1, 25)), line)


def boxes_of(figure):
    """Where everything with words stands on the picture, once it is laid out."""
    figure.draw_without_rendering()
    plot = figure.axes[0]
    parts = {"x label": plot.xaxis.label, "y label": plot.yaxis.label, "title": plot.title}
    parts |= {f"legend {k}": legend for k, legend in enumerate(figure.legends)}
    for axis, (low, high) in ((plot.xaxis, plot.get_xlim()), (plot.yaxis, plot.get_ylim())):
        inside = [tick for tick in axis.get_major_ticks() if low <= tick.get_loc() <= high]
        parts |= {f"{axis.axis_name} at {tick.get_loc():g}": tick.label1 for tick in inside}
    boxes = {name: part.get_window_extent() for name, part in parts.items()}
    boxes |= {f"colour bar {k}": axes.get_tightbbox() for k, axes in enumerate(figure.axes[1:])}
    return boxes | {"plot": plot.get_window_extent()}


def assert_apart(figure):
    """No two of them touch, and none leaves the picture."""
    boxes = boxes_of(figure)
    for name, box in boxes.items():
        assert figure.bbox.x0 <= box.x0 <= box.x1 <= figure.bbox.x1, name
        assert figure.bbox.y0 <= box.y0 <= box.y1 <= figure.bbox.y1, name
    for (name, a), (other, b) in itertools.combinations(boxes.items(), 2):
        apart = a.x1 <= b.x0 or b.x1 <= a.x0 or a.y1 <= b.y0 or b.y1 <= a.y0
        assert apart, (name, other)
    return boxes


@pytest.mark.parametrize("prime", [False, True], ids=["bare", "primed"])
@pytest.mark.parametrize("color", ["kind", "order"])
@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_nothing_is_printed_over_anything_else_whatever_the_shape_of_the_sheet(shape, color, prime):
    boxes = assert_apart(preview.draw_sequence(lattice(*shape, prime), color=color, axes="XZ"))
    assert "legend 0" in boxes
    assert ("colour bar 0" in boxes) == (color == "order")


@pytest.mark.parametrize("show", ["tilts", "toolpaths"])
@pytest.mark.parametrize("tiles", [(1, 12), (12, 1), (3, 6)], ids=str)
def test_nor_is_it_in_the_picture_of_a_grid(tiles, show):
    assert_apart(preview.draw_grid(make_grid(np.full(tiles, -30.0)), show=show))


@pytest.mark.parametrize("profile", ["marlin-generic", "marlin-syringe", "marlin-pneumatic"])
@pytest.mark.parametrize("comments", [True, False], ids=["whole", "without comments"])
def test_what_fills_the_nozzle_is_drawn_and_is_no_toolpath(profile, comments):
    loaded = profiles.load(profile, ["motion.prime_mm=7"])
    plan, _, _ = make_plan(SHEET)
    lines = make_lines(SHEET, profile, "motion.prime_mm=7")
    if not comments:
        lines = [command for line in lines if (command := line.partition(";")[0].strip())]
    drawing = preview.Drawing.of_moves(read_lines(lines), loaded)
    assert (len(drawing.toolpaths), len(drawing.prime)) == (len(plan.toolpaths), 1)
    assert np.ptp(drawing.prime[0, :, 0]) == pytest.approx(7)
    figure = preview.draw_sequence(drawing, color="order")
    plot, bar = figure.axes
    assert plot.get_title() == f"{len(plan.toolpaths)} toolpaths"
    assert (1, len(plan.toolpaths)) in (bar.get_xlim(), bar.get_ylim())
    assert "prime line" in [text.get_text() for text in figure.legends[0].get_texts()]
    # A command between that line and the print leaves no gap in what is drawn of the print.
    k = next(k for k, line in enumerate(lines) if line == ";TOOLPATH 0") if comments else None
    if k is not None:
        assert preview.not_drawn(read_lines([*lines[:k], "G28 X", *lines[k:]]), loaded) == []


def test_the_end_is_marked_and_arrows_show_directions_and_numbers():
    drawing = preview.Drawing.of_plan(make_plan(SHEET)[0])
    plot = preview.draw_sequence(drawing).axes[0]
    assert plot.lines[1].get_xydata().tolist() == [drawing.toolpaths[-1, 1].tolist()]
    assert len(plot.texts) == 0
    texts = preview.draw_sequence(drawing, arrows=True).axes[0].texts
    numbers = {text.get_text() for text in texts} - {""}
    arrows = [text for text in texts if text.get_text() == ""]
    assert 0 < len(numbers) <= len(arrows) <= len(drawing.toolpaths)
    assert numbers <= {str(k + 1) for k in range(len(drawing.toolpaths))}
    for arrow in arrows:  # each points as its toolpath runs
        middle = (np.array(arrow.xy) + np.array(arrow.xyann)) / 2
        points = drawing.toolpaths[:, 0] + 0.65 * (drawing.toolpaths[:, 1] - drawing.toolpaths[:, 0])
        begin, end = drawing.toolpaths[np.hypot(*(points - middle).T).argmin()]
        assert np.dot(np.array(arrow.xy) - arrow.xyann, end - begin) > 0
