"""Hatch lines: where they lie, that each is there once, and what is left out."""

import numpy as np
import pytest
import shapely
from fields import grids
from hypothesis import example, given, settings

from slicer.clip import RESOLUTION_MM
from slicer.errors import SlicerError
from slicer.grid import Grid
from slicer.hatch import hatch


def grid(angles, spacing=0.1, tile=(1.0, 1.0), **rest):
    angles = np.array(angles, float)
    return Grid(angles, np.broadcast_to(np.array(spacing, float), angles.shape), tile, **rest)


def as_printed(angle, tile):
    """A tilt that leaves 0 or 90 by less than 0.001 mm over a tile is 0 or 90."""
    diagonal = np.hypot(*tile)
    if abs(np.sin(np.radians(angle))) * diagonal <= 0.001:
        return 0.0
    return 90.0 if abs(np.cos(np.radians(angle))) * diagonal <= 0.001 else angle


HOLE_IN_THE_WAY = [
    (2.17, 0.5),
    (2.085, 0.6472243186433546),
    (1.915, 0.6472243186433546),
    (1.83, 0.5),
    (1.915, 0.3527756813566455),
    (2.085, 0.3527756813566454),
]
"""One corner of it cuts 0.00007 mm out of a line at 9.14 degrees."""


@settings(max_examples=200, deadline=None)
@given(grids())
@example(
    Grid(
        np.array([[np.nan, 9.14]]),
        np.array([[0.2, 0.2]]),
        (2.0, 1.0),
        outline_mm=[[[(0.2, 0.0), (4.0, 0.1), (3.6, 1.0), (0.0, 0.8)], HOLE_IN_THE_WAY]],
    )
)
def test_lines_lie_in_their_tile_at_its_tilt_through_its_centre(sheet):
    lines = hatch(sheet)
    width, height = sheet.tile_mm
    outline = (
        None
        if sheet.outline_mm is None
        else shapely.union_all([shapely.Polygon(outer, holes) for outer, *holes in sheet.outline_mm])
    )
    for (start, end), (col, row) in zip(lines.segments, lines.tile, strict=True):
        angle = np.radians(as_printed(sheet.angles_deg[row, col], sheet.tile_mm))
        along, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
        length = np.hypot(*(end - start))
        assert np.dot(end - start, along) == pytest.approx(length)
        low = np.array([col * width, row * height])
        for point in (start, end):
            assert (point >= low - 1e-9).all()
            assert (point <= low + sheet.tile_mm + 1e-9).all()
        steps = np.dot(start - (low + np.array(sheet.tile_mm) / 2), across) / sheet.spacing_mm[row, col]
        assert steps == pytest.approx(round(steps), abs=1e-6)
        shortest = sheet.spacing_mm[row, col] if sheet.min_length_mm is None else sheet.min_length_mm
        assert length >= shortest - 1e-9
        if outline is not None:
            # A gap of less than a program can say, as over the corner of a hole, is none.
            outside = shapely.LineString([start, end]).difference(outline.buffer(1e-7))
            assert all(part.length <= RESOLUTION_MM for part in shapely.get_parts(outside))


@settings(max_examples=100, deadline=None)
@given(grids(outline=False))
@example(Grid(np.array([[36.88]]), np.array([[0.2]]), (2.0, 1.0)))  # a line of 0.0004 mm in the corner
def test_no_line_is_missing(sheet):
    """The length of all lines, long and short, is what Cauchy's principle gives for each tile."""
    everything = Grid(sheet.angles_deg, sheet.spacing_mm, sheet.tile_mm, min_length_mm=0.0)
    lines = hatch(everything)
    width, height = sheet.tile_mm
    for row, col in np.argwhere(~np.isnan(sheet.angles_deg)):
        degrees = as_printed(sheet.angles_deg[row, col], sheet.tile_mm)
        angle = np.radians(degrees)
        cos, sin = abs(np.cos(angle)), abs(np.sin(angle))
        spacing = sheet.spacing_mm[row, col]
        reach = (width * sin + height * cos) / 2
        offsets = np.arange(-np.floor(reach / spacing), np.floor(reach / spacing) + 1) * spacing
        # Chord of a rectangle at a distance from its centre: a trapezium over the offset.
        flat, slope = abs(width * sin - height * cos) / 2, reach
        longest = min(width / cos if cos > 1e-12 else np.inf, height / sin if sin > 1e-12 else np.inf)
        chord = np.clip((slope - np.abs(offsets)) / max(slope - flat, 1e-12), 0, 1) * longest
        found = lines.segments[(lines.tile == (col, row)).all(axis=1)]
        length = np.hypot(*(found[:, 1] - found[:, 0]).T).sum()
        borders = degrees in (0, 90)  # there a line may belong to the neighbour
        # What is shorter than the clipping resolves may be lost.
        lost = chord[chord < 2 * RESOLUTION_MM].sum()
        assert length == pytest.approx(chord.sum(), abs=1e-6 + lost + borders * 2 * longest)


def test_in_file_order_every_sheet_can_be_printed():
    from slicer.precedence import covering_edges, violations

    lines = hatch(grid(np.random.default_rng(1).uniform(-90, 90, (4, 4))))
    assert len(violations(np.arange(len(lines.segments)), covering_edges(lines.segments))) == 0


@pytest.mark.parametrize(("angle", "axis"), [(0, 1), (90, 0)])
def test_level_and_upright_are_ordinary_angles(angle, axis):
    lines = hatch(grid([[angle]], spacing=0.25))
    assert sorted(lines.segments[:, 0, axis].tolist()) == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert (lines.segments[:, 0, axis] == lines.segments[:, 1, axis]).all()
    np.testing.assert_array_equal(np.sort(lines.segments[:, :, 1 - axis], axis=1), [[0, 1]] * 5)


@pytest.mark.parametrize("angles", [[[0], [0]], [[90, 90]]], ids=["level", "upright"])
def test_a_line_on_a_border_belongs_to_one_tile(angles):
    lines = hatch(grid(angles, spacing=0.1))
    assert len(lines.segments) == 21
    assert len(np.unique(lines.segments.round(9), axis=0)) == 21
    on_border = (lines.segments == 1.0).all(axis=1).any(axis=1)
    assert lines.tile[on_border].tolist() == [[0, 0]]


def test_a_border_line_stays_where_only_one_tile_has_it():
    lines = hatch(grid([[0], [-30]], spacing=0.1))
    assert ((lines.segments[:, :, 1] == 1.0).all(axis=1)).sum() == 1


def test_toolpaths_run_bottom_up_from_the_bottom_left():
    lines = hatch(grid([[-45, -30], [-10, -20]]))
    assert lines.tile[0].tolist() == [0, 0]
    assert (np.diff(lines.tile[:, 1]) >= 0).all()
    assert lines.segments[0].sum() == lines.segments[lines.tile.sum(axis=1) == 0].sum(axis=(1, 2)).min()


def test_short_lines_are_dropped_and_counted():
    kept, everything = hatch(grid([[-45]])), hatch(grid([[-45]], min_length_mm=0.0))
    assert kept.dropped > 0
    assert len(kept.segments) + kept.dropped == len(everything.segments)
    assert everything.dropped == 0


@pytest.mark.parametrize("shortest", [None, 0.35])
def test_exactly_the_short_lines_are_dropped(shortest):
    angles = [[-45, 20], [80, -7]]
    everything = hatch(grid(angles, min_length_mm=0.0)).segments
    length = np.hypot(*(everything[:, 1] - everything[:, 0]).T)
    kept = hatch(grid(angles, min_length_mm=shortest)).segments
    np.testing.assert_array_equal(kept, everything[length >= (shortest or 0.1) - 1e-9])


def test_a_hole_cuts_a_line_in_two():
    square = [(0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (0.0, 1.0)]
    hole = [(1.0, 0.2), (2.0, 0.2), (2.0, 0.8), (1.0, 0.8)]
    sheet = grid([[0]], spacing=0.5, tile=(3.0, 1.0), outline_mm=[[square, hole]])
    assert sorted(hatch(sheet).segments[:, :, 0].tolist()) == [[0.0, 1.0], [0.0, 3.0], [0.0, 3.0], [2.0, 3.0]]


def test_several_outlines_are_joined():
    left, right = ([(x, 0.0), (x + 1, 0.0), (x + 1, 1.0), (x, 1.0)] for x in (0.0, 2.0))
    sheet = grid([[0]], spacing=0.5, tile=(3.0, 1.0), outline_mm=[[left], [right]])
    middle = hatch(sheet).segments[:, :, 0].tolist()
    assert sorted(middle) == [[0.0, 1.0]] * 3 + [[2.0, 3.0]] * 3


@pytest.mark.parametrize("deviation", [1e-15, 1e-14, 1e-9, 1e-7, 1e-5])
def test_angles_that_are_level_or_upright_but_for_rounding_count_as_such(deviation):
    for exact in (0.0, 90.0):
        near = hatch(grid([[exact, exact - deviation], [exact - deviation, exact]]))
        np.testing.assert_array_equal(near.segments, hatch(grid([[exact] * 2] * 2)).segments)


def test_empty_tiles_and_empty_sheets():
    assert hatch(grid([[np.nan]])).segments.shape == (0, 2, 2)
    lines = hatch(grid([[-45, np.nan]]))
    assert set(map(tuple, lines.tile.tolist())) == {(0, 0)}


def test_every_tile_may_have_its_own_spacing():
    lines = hatch(grid([[0, 0]], spacing=[[0.5, 0.25]]))
    assert [(lines.tile[:, 0] == col).sum() for col in (0, 1)] == [3, 5]


def test_origin_moves_the_sheet():
    at_zero, moved = hatch(grid([[-45]])), hatch(grid([[-45]], origin_mm=(10.0, -5.0)))
    np.testing.assert_allclose(moved.segments, at_zero.segments + (10, -5), atol=1e-9)


def test_a_spacing_of_next_to_nothing_is_refused_before_memory_is_gone():
    with pytest.raises(SlicerError, match=r"tile \(0, 0\) alone takes .* at spacing 1e-12 mm"):
        hatch(grid([[-45]], spacing=1e-12))
