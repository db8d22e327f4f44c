"""The area of tiles against what is printed: what it sees, and that it raises no false alarm."""

import json
from pathlib import Path

import numpy as np
import pytest
from fields import grids, rough_outlines, tilts
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from making import make_grid, make_lines, read_lines

import profiles
from gcode import strokes
from gcode.check import check
from gcode.coverage import shortfalls
from slicer import grid
from slicer.grid import Grid
from slicer.hatch import Hatch, hatch
from slicer.outline import repair

ROOT = Path(__file__).parents[2]
CASES = ROOT / "tests" / "data" / "cases"
LOST = json.loads((CASES / "lost_by_clipping_lines.json").read_text())
"""Hatch lines of an earlier vslice, which cut them at every corner of the outline."""

SHEETS = sorted((ROOT / "examples").glob("*.json")) + [
    file
    for file in sorted(CASES.glob("*.json"))
    if file.stem not in ("lost_by_clipping_lines", "spacing_below_resolution")
]


def drawn(lines):
    """Segments as they come out of a program."""
    return lines.segments.round(3)


def lengths(segments):
    return np.hypot(*(segments[:, 1] - segments[:, 0]).T)


@pytest.mark.parametrize("file", SHEETS, ids=lambda file: file.stem)
def test_every_missing_row_is_seen_and_nothing_else(file):
    sheet = grid.read(file)
    lines = hatch(sheet)
    segments = drawn(lines)
    assert shortfalls(segments, sheet) == []
    random = np.random.default_rng(1)
    for k in random.permutation(len(segments))[:40]:
        rest = np.delete(segments, k, axis=0)
        row = sheet.spacing_mm[lines.tile[k, 1], lines.tile[k, 0]]
        if lengths(segments[[k]])[0] > row + 0.006:
            assert shortfalls(rest, sheet), segments[k]


@pytest.mark.parametrize(("case", "needed"), [("outline_many_vertices", 20), ("hole_tip_touches_line", 10)])
def test_what_the_old_hatch_lost_is_seen(case, needed, monkeypatch):
    sheet = grid.read(CASES / f"{case}.json")
    lost = np.array(LOST[case])
    (short,) = shortfalls(lost, sheet)
    assert (short.col, short.row) == (0, 0)
    assert short.needed_mm == pytest.approx(needed, abs=0.02)
    assert short.printed_mm < short.needed_mm - 0.4
    # The whole check sees it, although the hatch that it compares with has lost the same.
    old = Hatch(lost, np.zeros((len(lost), 2), np.int32), 0)
    monkeypatch.setattr("slicer.hatch.hatch", lambda _: old)
    lines = [strokes.Stroke(*line.ravel(), k, k, True, 0.0, 0.0) for k, line in enumerate(lost)]
    (violation,) = strokes.compare_with_hatch(lines, sheet, (0.0, 0.0)).violations
    assert violation.kind == "missing"
    assert violation.message.startswith("tile (0, 0): ")
    assert "mm are printed where its area needs" in violation.message


def test_a_program_is_measured_in_its_own_place():
    sheet = make_grid([[-30, 20], [60, -80]])
    lines = make_lines(sheet)
    profile = profiles.load("paper", ())
    assert check(read_lines(lines), profile, sheet).violations == []


@settings(max_examples=200, deadline=None)
@given(grids())
def test_whole_sheets_raise_no_alarm_and_a_lost_row_does(sheet):
    lines = hatch(sheet)
    segments = drawn(lines)
    assert shortfalls(segments, sheet) == []
    if sheet.outline_mm is None and len(segments):
        least = sheet.spacing_mm.flat[0] if sheet.min_length_mm is None else sheet.min_length_mm
        k = int(np.argmax(lengths(segments)))
        if lengths(segments)[k] > least + 0.006:
            assert shortfalls(np.delete(segments, k, axis=0), sheet)


@settings(max_examples=200, deadline=None)
@given(rough_outlines(), st.lists(tilts, min_size=9, max_size=9), st.sampled_from([0.1, 0.25]),
       st.sampled_from([None, 0.0]))  # fmt: skip
def test_outlines_of_any_shape_raise_no_alarm(polygons, angles, spacing, least):
    try:
        repaired, _ = repair(polygons)
    except ValueError:
        assume(False)
    sheet = Grid(
        np.reshape(angles, (3, 3)),
        np.full((3, 3), spacing),
        (1.0, 1.0),
        outline_mm=repaired,
        min_length_mm=least,
    )
    assert shortfalls(drawn(hatch(sheet)), sheet) == []


@pytest.mark.parametrize("width", [1e-6, 1e-4, 0.0009, 0.004, 0.05])
@pytest.mark.parametrize("angle", [0, 90, 45, 0.01, -63])
def test_slivers_raise_no_alarm(width, angle):
    sliver = [(0.0, 0.0), (3.0, 3.0), (3.0, 3.0 + width), (0.0, width)]
    level = [(0.0, 1.0), (3.0, 1.0), (3.0, 1.0 + width), (0.0, 1.0)]
    for ring in (sliver, level):
        sheet = make_grid([[angle] * 3] * 3, 0.1, outline_mm=[[ring]], min_length_mm=0.0)
        assert shortfalls(drawn(hatch(sheet)), sheet) == []


def test_the_smallest_loss_that_is_seen():
    sheet = make_grid([[0]], 0.25)
    lines = drawn(hatch(sheet))
    for loss, seen in ((0.004, False), (0.006, True)):
        shorter = lines.copy()
        shorter[2, 1, 0] -= loss
        assert bool(shortfalls(shorter, sheet)) == seen


def test_a_line_on_the_border_counts_for_both_tiles():
    sheet = make_grid([[0], [0]], 0.25)
    lines = drawn(hatch(sheet))
    assert len(lines) == 9
    without = lines[lines[:, 0, 1] != 1.0]
    assert [(short.col, short.row, short.rows) for short in shortfalls(without, sheet)] == [
        (0, 0, 1),
        (0, 1, 1),
    ]


def test_nothing_printed_and_no_tiles():
    assert len(shortfalls(np.empty((0, 2, 2)), make_grid([[0, 30]]))) == 2
    assert shortfalls(np.empty((0, 2, 2)), make_grid([[None]])) == []
