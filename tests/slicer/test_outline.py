"""Hatch lines and outlines: borders belong to the sheet, and what is drawn badly is repaired."""

import json
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import shapely
from fields import rough_outlines
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from slicer import grid
from slicer.errors import GridError, SlicerError
from slicer.grid import Grid
from slicer.hatch import hatch
from slicer.outline import area_of, repair

CASES = Path(__file__).parents[1] / "data" / "cases"
SQUARE = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)]


def box(x0, y0, x1, y1):
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


def sheet(angles, spacing, tile, outline, **rest):
    angles = np.array(angles, float)
    return Grid(angles, np.full(angles.shape, spacing), tile, outline_mm=outline, **rest)


def spans(lines, axis=0):
    return sorted(map(tuple, np.sort(lines.segments[:, :, axis], axis=1).tolist()))


@pytest.mark.parametrize(
    ("case", "count", "length"),
    [
        ("outline_many_vertices", 11, 110.0),
        ("hole_tip_touches_line", 11, 110.0),
        ("halves_meet_but_for_rounding", 11, 11.0),
    ],
)
def test_lines_that_a_border_touches_are_whole(case, count, length):
    lines = hatch(grid.read(CASES / f"{case}.json"))
    assert (len(lines.segments), lines.dropped) == (count, 0)
    assert np.hypot(*(lines.segments[:, 1] - lines.segments[:, 0]).T).sum() == pytest.approx(length)


@pytest.mark.parametrize("gap", [0.0, 1e-16, 1e-9, 1e-6, -0.1])
@pytest.mark.parametrize("angle", [0, 90, 30, -75, 1e-3])
def test_polygons_that_meet_within_a_nanometre_are_one(angle, gap):
    whole = hatch(sheet([[angle]], 0.1, (2.0, 2.0), [[box(0, 0, 2, 2)]]))
    for halves in (
        [[box(0, 0, 0.7, 2)], [box(0.7 + gap, 0, 2, 2)]],
        [[box(0, 0, 2, 1)], [box(0, 1 + gap, 2, 2)]],  # a line lies in the gap
    ):
        lines = hatch(sheet([[angle]], 0.1, (2.0, 2.0), halves))
        np.testing.assert_allclose(lines.segments, whole.segments, atol=2e-6)


def test_the_border_of_the_outline_on_the_border_of_tiles_has_its_line_once():
    for y0, y1 in ((0, 1), (1, 2)):
        lines = hatch(sheet([[0], [0]], 0.25, (2.0, 1.0), [[box(0, y0, 2, y1)]]))
        assert sorted(lines.segments[:, 0, 1].tolist()) == [y0, y0 + 0.25, y0 + 0.5, y0 + 0.75, y1]
        assert spans(lines) == [(0.0, 2.0)] * 5


@pytest.mark.parametrize("turn", [1e-3, 1e-5, 1e-7, 1e-9, 1e-12, -1e-9, -1e-6])
def test_a_rectangle_turned_by_next_to_nothing_keeps_its_rows(turn):
    turned = shapely.affinity.rotate(shapely.box(0, 0, 10, 10), turn, origin=(5, 5))
    lines = hatch(sheet([[0]], 1.0, (10.0, 10.0), [[list(turned.exterior.coords)[:-1]]]))
    assert len(lines.segments) == 11
    assert np.hypot(*(lines.segments[:, 1] - lines.segments[:, 0]).T).sum() >= 100


def test_a_hole_between_two_lines_is_nothing_to_them():
    hole = box(1.0, 1.02, 1.05, 1.08)
    lines = hatch(sheet([[0]], 0.1, (2.0, 2.0), [[box(0, 0, 2, 2), hole]]))
    assert spans(lines) == [(0.0, 2.0)] * 21


def test_a_hole_that_a_line_passes_cuts_it_and_one_narrower_than_a_program_can_say_does_not():
    for width, pieces in ((0.5, 2), (0.002, 2), (0.0009, 1)):
        hole = box(1.0, 0.98, 1.0 + width, 1.02)
        lines = hatch(sheet([[0]], 0.1, (2.0, 2.0), [[box(0, 0, 2, 2), hole]]))
        assert len(lines.segments) == 20 + pieces


@pytest.mark.parametrize("outline", [box(50, 50, 60, 60), box(-9e4, -9e4, -1e4, 9e4), box(0, 4, 4, 8)])
def test_an_outline_beside_the_sheet_leaves_no_more_than_a_border(outline):
    lines = hatch(sheet([[30, 0]], 0.3, (2.0, 4.0), [[outline]]))
    on_border = (lines.segments[:, :, 1] == 4.0).all(axis=1)
    assert on_border.all()
    assert len(lines.segments) <= 1


def test_an_outline_around_the_sheet_changes_nothing():
    random = np.random.default_rng(3)
    angles = random.uniform(-90, 90, (6, 6))
    plain = hatch(Grid(angles, np.full(angles.shape, 0.1), (1.0, 1.0)))
    for far in (0.0, 1e-12, 1e-3, 1e5):
        lines = hatch(sheet(angles, 0.1, (1.0, 1.0), [[box(-far, -far, 6 + far, 6 + far)]]))
        np.testing.assert_array_equal(lines.segments, plain.segments)


def test_a_tile_narrower_than_its_spacing_has_the_line_through_its_centre():
    lines = hatch(sheet([[0]], 5.0, (8.0, 2.0), [[box(0, 0, 8, 1)]]))
    assert lines.segments.tolist() == [[[0.0, 1.0], [8.0, 1.0]]]


def test_many_corners_are_taken_and_crossings_beyond_memory_are_refused():
    t = np.linspace(0, 2 * np.pi, 100_001)[:-1]
    circle = np.stack([5 + 4 * np.cos(t), 5 + 4 * np.sin(t)], axis=1).tolist()
    lines = hatch(sheet([[0]], 1.0, (10.0, 10.0), [[circle]]))
    for (x0, y), (x1, _) in lines.segments:
        half = np.sqrt(max(0.0, 16 - (y - 5) ** 2))
        assert (x0, x1) == pytest.approx((5 - half, 5 + half), abs=1e-5)
    comb = [(k / 1e4, 10.0 * (k % 2)) for k in range(100_000)] + [(10.0, 20.0), (0.0, 20.0)]
    with pytest.raises(SlicerError, match=r"^grid: outline_mm crosses hatch lines some .* at most 1e\+07"):
        hatch(sheet([[0]], 0.01, (10.0, 10.0), [[comb]]))


# Exact: corners on a lattice that the lines run through, and rational arithmetic.


def _on_line(polygons, y):
    """The closed stretches of polygons at a height, as Fractions; touching ones are one."""
    found = []
    for rings in polygons:
        sides = [(a, b) for ring in rings for a, b in zip(ring, [*ring[1:], ring[0]], strict=True)]
        sides = [[tuple(map(Fraction, point)) for point in side] for side in sides]
        places, level = [], []
        for (x0, y0), (x1, y1) in sides:
            if y0 == y1 == y:
                places += [x0, x1]
                level.append((min(x0, x1), max(x0, x1)))
            elif min(y0, y1) <= y <= max(y0, y1):
                places.append(x0 + (x1 - x0) * (y - y0) / (y1 - y0))
        places = sorted(set(places))
        for low, high in zip(places, places[1:], strict=False):
            x = (low + high) / 2
            right = sum(
                min(y0, y1) <= y < max(y0, y1) and x0 + (x1 - x0) * (y - y0) / (y1 - y0) > x
                for (x0, y0), (x1, y1) in sides
                if y0 != y1
            )
            if right % 2 or any(a <= x <= b for a, b in level):
                found.append((low, high))
    joined = []
    for low, high in sorted(found):
        if joined and low <= joined[-1][1]:
            joined[-1] = (joined[-1][0], max(high, joined[-1][1]))
        else:
            joined.append((low, high))
    return joined


lattice = st.tuples(st.integers(0, 8), st.integers(0, 8)).map(lambda p: (p[0] / 2, p[1] / 2))


@st.composite
def lattice_polygons(draw):
    polygons = []
    for _ in range(draw(st.integers(1, 4))):
        corners = draw(st.lists(lattice, min_size=3, max_size=7, unique=True))
        polygon = shapely.Polygon(corners)
        if polygon.is_valid and polygon.area > 0:
            polygons.append([corners])
    assume(polygons)
    return polygons


@settings(max_examples=300, deadline=None)
@given(lattice_polygons(), st.booleans())
def test_lines_are_what_exact_arithmetic_gives(polygons, upright):
    drawn = [[[p[::-1] for p in ring] for ring in rings] for rings in polygons] if upright else polygons
    lines = hatch(sheet([[90 if upright else 0]], 0.5, (4.0, 4.0), drawn, min_length_mm=0.0))
    across, along = (0, 1) if upright else (1, 0)
    for y in np.arange(9) / 2:
        mine = lines.segments[lines.segments[:, 0, across] == y][:, :, along]
        exact = [(float(low), float(high)) for low, high in _on_line(polygons, Fraction(y))]
        np.testing.assert_allclose(
            np.sort(np.sort(mine, axis=1), axis=0), np.reshape(exact, (-1, 2)), atol=1e-9
        )


@settings(max_examples=150, deadline=None)
@given(rough_outlines(), st.sampled_from([0, 90, 45, -45, 30, -77.3, 0.5]), st.sampled_from([0.1, 0.25]))
def test_lines_cover_what_lies_in_the_area_and_nothing_else(polygons, angle, spacing):
    try:
        repaired, _ = repair(polygons)
    except ValueError:
        assume(False)
    inside = sheet([[angle] * 3] * 3, spacing, (1.0, 1.0), repaired, min_length_mm=0.0)
    lines, plain = (
        hatch(inside),
        hatch(sheet([[angle] * 3] * 3, spacing, (1.0, 1.0), None, min_length_mm=0.0)),
    )
    area = area_of(repaired)
    drawn = shapely.union_all(shapely.linestrings(lines.segments))
    assert drawn.difference(area.buffer(5e-6)).length <= 0.001 * len(lines.segments)  # gaps that are closed
    if len(plain.segments):
        wanted = shapely.intersection(shapely.linestrings(plain.segments), area)
        missing = shapely.difference(wanted, drawn.buffer(1e-5))
        assert shapely.length(shapely.get_parts(missing)).max(initial=0) <= 0.002  # too short for a program


# Repair.


@pytest.mark.parametrize(
    ("polygon", "area"),
    [
        ([SQUARE, box(0, 1, 2, 2)], 14.0),
        ([[(0, 0), (4, 0), (4, 4), (2, 4), (2, 6), (2, 4), (0, 4)]], 16.0),
        ([[(0, 0), (2, 2), (2, 0), (0, 2)]], 2.0),
        ([SQUARE, box(6, 0, 7, 1)], 16.0),
        ([SQUARE, box(1, 1, 3, 3), box(1.5, 1.5, 2, 2)], 12.0),
        ([SQUARE, box(1, 1, 3, 3), box(2, 2, 3.5, 3.5)], 10.75),
        ([SQUARE, [(1, 1), (2, 2), (3, 3)]], 16.0),
        ([SQUARE + SQUARE], 16.0),
    ],
    ids=[
        "hole on the border",
        "spike",
        "bow tie",
        "hole outside",
        "nested holes",
        "holes that overlap",
        "hole without area",
        "twice round",
    ],
)
def test_outlines_that_touch_themselves_are_repaired_with_a_word(polygon, area):
    text = json.dumps(
        {"tile_mm": 2, "spacing_mm": 0.3, "angles_deg": [[-30, 20], [60, -80]], "outline_mm": polygon}
    )
    read = grid.loads(text, source="lab.json")
    assert area_of(read.outline_mm).area == pytest.approx(area)
    before = max(0.0, shapely.Polygon(polygon[0], polygon[1:]).area)
    (warning,) = read.warnings
    assert warning.startswith("lab.json: outline_mm: polygon 0 touches or crosses itself (")
    assert warning.endswith(f"was repaired: {before:g} mm² before, {area:g} mm² after.")
    again = grid.loads(grid.dumps(read))
    assert again.warnings == ()
    assert again.outline_mm == read.outline_mm
    assert len(hatch(read).segments)


@pytest.mark.parametrize(
    "ring",
    [SQUARE[::-1], [*SQUARE, SQUARE[0]], [p for p in SQUARE for _ in range(3)]],
    ids=["clockwise", "closed", "repeated"],
)
def test_what_is_simple_is_left_alone(ring):
    said = repair([[ring]])
    assert said == ([[ring]], [])


@pytest.mark.parametrize(
    "polygon",
    [
        [[(0, 0), (1, 1), (2, 2)]],
        [[(1, 1)] * 4],
        [box(1, 1, 2, 2), box(0, 0, 3, 3)],
        [[(2.1, 0.5), (2.0, 0.4), (1.9, 0.3)]],
    ],
    ids=["in a line", "a point", "all hole", "in a line but for rounding"],
)
def test_an_outline_without_area_is_refused_and_one_of_several_left_out(polygon):
    fields = {"tile_mm": 4, "spacing_mm": 1, "angles_deg": [[0]]}
    with pytest.raises(GridError, match="^grid: outline_mm: 0 mm² are left of the outline"):
        grid.loads(json.dumps(fields | {"outline_mm": polygon}))
    read = grid.loads(json.dumps(fields | {"outline_mm": [[SQUARE], polygon]}))
    assert read.outline_mm == [[SQUARE]]
    assert "polygon 1 has no area" in read.warnings[0]


def test_corners_within_rounding_of_a_line_are_no_trouble():
    # GEOS's usual way to make this hole valid leaves it invalid, and what follows fails over it.
    far = (1e5, -1e5)
    hole = [(0.0, 0.0), (0.0, 2.2e-313), far, (0.0, -1.0), (0.0, -2.0), far]
    outer = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)]
    ((ring, *rest),), said = repair([[outer, hole]])
    assert shapely.Polygon(ring).equals(shapely.Polygon(outer))
    assert not rest
    assert len(said) == 1


def test_of_many_repairs_ten_are_told():
    bow_ties = [[[(k, 0), (k + 1, 1), (k + 1, 0), (k, 1)]] for k in range(25)]
    fields = {"tile_mm": 4, "spacing_mm": 1, "angles_deg": [[0]], "outline_mm": bow_ties}
    warnings = grid.loads(json.dumps(fields)).warnings
    assert len(warnings) == 11
    assert warnings[-1] == "grid: outline_mm: so it is with 15 more polygons."


def test_an_outline_made_in_memory_is_repaired_too():
    lines = hatch(sheet([[0]], 1.0, (2.0, 2.0), [[[(0, 0), (2, 2), (2, 0), (0, 2)]]]))
    assert spans(lines) == [(0.0, 2.0)]  # its wings meet in the middle
