"""What of a program hangs, by heights that it says itself, and how a picture shows it."""

import numpy as np
import pytest
from making import make_grid, make_lines, make_plan, read_lines

import profiles
from gcode.errors import GcodeError
from gcode.hanging import heights_mm, with_hanging
from gcode.moves import Kind
from gcode.preview import Drawing, draw_sequence
from profiles.sections import Material
from slicer.support import hanging_of

SHEET = make_grid([[10, -40], [-25, 60]])


@pytest.mark.parametrize("join_mm", [0.0, 1.0])
def test_a_program_hangs_as_its_plan_does(join_mm):
    loaded = profiles.load("marlin-generic")
    moves = read_lines(make_lines(SHEET, "marlin-generic", f"motion.join_mm={join_mm}"))
    plan, spacing, _ = make_plan(SHEET, join_mm=join_mm)
    assert plan.joined.any() == (join_mm > 0)
    drawing = with_hanging(Drawing.of_moves(moves, loaded), moves, loaded.material)
    length = np.hypot(*(drawing.hanging[:, 1] - drawing.hanging[:, 0]).T).sum()
    assert length == pytest.approx(hanging_of(plan, spacing).length_mm.sum(), abs=0.02)
    assert length > 0.5
    figure = draw_sequence(drawing)
    assert f"hangs, {length:.1f} mm" in [text.get_text() for text in figure.legends[0].get_texts()]
    assert len(figure.axes[0].collections[-1].get_segments()) == len(drawing.hanging)


def test_each_toolpath_is_as_high_as_the_program_says_before_it():
    moves = read_lines(["G1 X1", ";HEIGHT:0.2", "G1 X2", ";HEIGHT:none", "G1 X3", ";HEIGHT:0.3", "G1 X4"])
    lines = [move.line for move in moves if move.kind != Kind.COMMENT]
    assert heights_mm(moves, lines, Material()) == pytest.approx([0.2, 0.2, 0.2, 0.3])
    assert heights_mm(moves, lines, Material(height_mm=0.1)) == pytest.approx([0.1] * 4)


def test_without_a_height_nobody_knows_what_hangs():
    moves = read_lines(["G1 X1"])
    with pytest.raises(GcodeError, match="--set material.height_mm="):
        heights_mm(moves, [1], Material(height_mm=None, bead_shape="stadium"))
