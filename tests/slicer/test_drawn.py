"""Own toolpaths and regions: read, hatched, and refused."""

import json

import numpy as np
import pytest
import shapely

from slicer import grid
from slicer.drawn import with_first_printable
from slicer.errors import GridError
from slicer.hatch import hatch


def square(x, y, side, **properties):
    ring = [[x, y], [x + side, y], [x + side, y + side], [x, y + side], [x, y]]
    return {
        "type": "Feature",
        "properties": properties,
        "geometry": {"type": "Polygon", "coordinates": [ring]},
    }


def regions(*features, **rest):
    return grid.loads(json.dumps({"type": "FeatureCollection", "features": list(features), **rest}))


def test_own_toolpaths_stay_as_they_are_and_begin_with_one_that_nothing_lies_below():
    segments = [[[0, 2], [4, 2]], [[0, 1], [4, 0.5]], [[1, 3], [1, 4]]]
    sheet = grid.loads(json.dumps({"segments": segments, "spacing_mm": [0.5, 0.4, 0.5], "name": "mine"}))
    lines = hatch(sheet)
    assert lines.segments.tolist() == [segments[1], segments[0], segments[2]]
    assert sheet.spacing_mm[lines.tile[:, 1], lines.tile[:, 0]].tolist() == [0.4, 0.5, 0.5]
    assert sheet.warnings == ()


def test_csv_says_the_same(tmp_path):
    for text in ("x0,y0,x1,y1\n0,2,4,2\n0,1,4,0.5\n", "# mine\n0;2;4;2\n0;1;4;0,5\n"):
        (tmp_path / "a.csv").write_text(text)
        sheet = grid.read(tmp_path / "a.csv")
        assert hatch(sheet).segments.tolist() == [[[0, 1], [4, 0.5]], [[0, 2], [4, 2]]]
        assert "does not say spacing_mm" in sheet.warnings[0]
        assert len(sheet.sha256) == 64
    (tmp_path / "a.csv").write_text("0,2,4,2,0.3\n0,1,4,0.5,0.2\n")
    sheet = grid.read(tmp_path / "a.csv")
    assert sorted(sheet.spacing_mm.ravel().tolist()) == [0.2, 0.3]


def test_nothing_lies_below_the_first_in_random_sheets():
    from slicer.precedence import covering_edges

    rng = np.random.default_rng(5)
    for _ in range(20):
        sheet = regions(
            *(
                square(3 * k, rng.uniform(0, 9), 3, angle_deg=rng.uniform(-90, 90), spacing_mm=0.4)
                for k in range(4)
            )
        )
        segments = hatch(sheet).segments
        shuffled = segments[rng.permutation(len(segments))]
        ordered = shuffled[with_first_printable(shuffled)]
        assert 0 not in covering_edges(ordered)[:, 1]


def test_a_region_is_filled_with_centred_lines():
    sheet = regions(square(1, 2, 3, angle_deg=0, spacing_mm=1))
    assert hatch(sheet).segments[:, 0, 1].tolist() == [2.5, 3.5, 4.5]
    assert np.sort(hatch(sheet).segments[:, :, 0], axis=1).tolist() == [[1, 4]] * 3
    # Whatever the angle, material and area agree to within the border.
    for angle in (10, 45, -70, 90):
        lines = hatch(regions(square(0, 0, 10, angle_deg=angle, spacing_mm=0.2))).segments
        length = np.hypot(*(lines[:, 1] - lines[:, 0]).T).sum()
        assert length * 0.2 == pytest.approx(100, rel=0.03)


def test_neighbours_share_no_line_and_holes_are_left_out():
    sheet = regions(
        square(0, 0, 2, angle_deg=0, spacing_mm=0.5), square(0, 2, 2, angle_deg=0, spacing_mm=0.5)
    )
    lines = hatch(sheet)
    assert len(np.unique(lines.segments[:, 0, 1])) == len(lines.segments) == 8
    assert sorted(lines.tile[:, 0].tolist()) == [0] * 4 + [1] * 4
    ring = [[0.0, 0], [6, 0], [6, 6], [0, 6]]
    hole = [[2.0, 2], [4, 2], [4, 4], [2, 4]]
    holed = {"type": "Polygon", "coordinates": [ring, hole]}
    sheet = regions({"type": "Feature", "properties": {"angle_deg": 30}, "geometry": holed}, spacing_mm=0.3)
    middle = hatch(sheet).segments.mean(axis=1)
    assert not shapely.contains(shapely.box(2, 2, 4, 4), shapely.points(middle)).any()
    assert sheet.spacing_mm.tolist() == [[0.3]]


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ({"segments": []}, "segments must be a list of toolpaths"),
        ({"segments": [[[0, 0], [1, "a"]]]}, "segments[0] must be two points [x, y]"),
        ({"segments": [[[0, 0], [1, 1e9]]]}, "segments[0] must be two points"),
        ({"segments": [[[0, 0], [0, 0]]]}, "toolpath 0: is 0 mm long; 0.002 mm is the least"),
        ({"segments": [[[0, 0], [1, 0]]], "spacing_mm": [1, 2]}, "spacing_mm has 2 numbers, but there are 1 segments"),
        ({"segments": [[[0, 0], [1, 0]]], "spacing_mm": 0}, "every spacing must be from 0.01"),
        ({"segments": [[[0, 0], [1, 0]]], "spacing_mm": "wide"}, "spacing_mm must be a number"),
        ({"type": "FeatureCollection", "features": []}, "features must be a list"),
        ({"type": "FeatureCollection", "features": [square(0, 0, 1)]}, "region 0: properties.angle_deg must be"),
        ({"type": "FeatureCollection", "features": [square(0, 0, 1, angle_deg=3, spacing_mm=0)]}, "region 0: properties.spacing_mm"),
        ({"type": "FeatureCollection", "features": [square(0, 0, 1, angle_deg=3), 5]}, "region 1: is no object"),
        ({"type": "FeatureCollection", "features": [{"type": "Feature", "geometry": None}]}, "region 0: has no geometry"),
        ({"type": "Feature", "properties": {"angle_deg": 1}, "geometry": {"type": "Point"}}, "region 0: has Point"),
        ({"type": "Feature", "properties": {"angle_deg": 1}, "geometry": {"type": "Polygon", "coordinates": [[[0, 0], [1, 1]]]}}, "at least 3 corners"),
        ({"type": "Feature", "properties": {"angle_deg": 1}, "geometry": {"type": "Polygon", "coordinates": [[[0, 0], [1, 1], [2, 2], [0, 0]]]}}, "region 0: 0 mm²"),
        ({"type": "FeatureCollection", "features": [square(0, 0, 2, angle_deg=3), square(1, 1, 2, angle_deg=3)]}, "regions 0 and 1 overlap by 1 mm²"),
    ],
    ids=lambda value: None if isinstance(value, dict) else value[:30],
)  # fmt: skip
def test_what_is_wrong_is_said(data, said):
    with pytest.raises(GridError) as raised:
        grid.loads(json.dumps(data))
    assert said in str(raised.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("0,0,1\n", "line 1: has 3 numbers"),
        ("0,0,1,1\n0,0,1,1,2\n", "line 2: has 5 numbers"),
        ("0,0,1,1\na,b,c,d\n", "line 2: 'a,b,c,d' holds something that is no number"),
        ("x0,y0,x1,y1\n", "holds no toolpaths"),
        ("0,0,nan,1\n", "must be numbers within"),
    ],
)
def test_wrong_csv(tmp_path, text, said):
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(GridError) as raised:
        grid.read(tmp_path / "a.csv")
    assert said in str(raised.value)
