"""Grid files: what is accepted, and what every mistake is answered with."""

import json
from pathlib import Path

import numpy as np
import pytest
from fields import grids
from hypothesis import given, settings

from slicer import grid
from slicer.errors import GridError

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.json"))
GOOD = {"tile_mm": 1.0, "spacing_mm": 0.1, "angles_deg": [[-45, -30.5], [-12, None]]}

BAD = {
    "not an object": ([1, 2], ["holds a list of 2, but a grid is an object"]),
    "missing": ({}, ["tile_mm: is missing", "spacing_mm: is missing", "angles_deg: is missing"]),
    "unknown key": (GOOD | {"spacng_mm": 1}, ["unknown key 'spacng_mm'. Did you mean 'spacing_mm'?"]),
    "strange key": (GOOD | {"colour": 1}, ["unknown key 'colour'. A grid has tile_mm"]),
    "angle above": (
        GOOD | {"angles_deg": [[0, 91]]},
        ["angles_deg[0][1]: tile (1, 0): angle 91 must be above -90"],
    ),
    "angle -90": (
        GOOD | {"angles_deg": [[0], [-90]]},
        ["angles_deg[1][0]: tile (0, 1): angle -90 must be above -90"],
    ),
    "text": (
        GOOD | {"angles_deg": [["steep"]]},
        ["angles_deg[0][0]: tile (0, 0): the text 'steep' where a number"],
    ),
    "number in quotes": (
        GOOD | {"spacing_mm": "0.1"},
        ["spacing_mm: the text '0.1' where a number is needed"],
    ),
    "boolean": (GOOD | {"tile_mm": True}, ["tile_mm: true where a number or [width, height] is needed"]),
    "zero spacing": (GOOD | {"spacing_mm": 0}, ["spacing_mm: 0 must be above 0"]),
    "negative tile": (GOOD | {"tile_mm": [1, -2]}, ["tile_mm[1]: -2 must be above 0"]),
    "three sides": (GOOD | {"tile_mm": [1, 2, 3]}, ["tile_mm: has 3 entries, but needs at most 2"]),
    "ragged": (GOOD | {"angles_deg": [[0, 0], [0]]}, ["angles_deg[1] has 1 tiles, but row 0 has 2"]),
    "no rows": (GOOD | {"angles_deg": []}, ["angles_deg: has 0 entries, but needs at least 1"]),
    "empty row": (GOOD | {"angles_deg": [[]]}, ["angles_deg[0]: has 0 entries, but needs at least 1"]),
    "flat angles": (GOOD | {"angles_deg": [1]}, ["angles_deg[0]: 1 where a list is needed"]),
    "spacing shape": (
        GOOD | {"spacing_mm": [[1, 1]]},
        ["spacing_mm has 1 rows of 2, but angles_deg has 2 rows of 2"],
    ),
    "spacing null": (
        GOOD | {"spacing_mm": [[1, None], [1, 1]]},
        ["spacing_mm[0][1] is null, but tile (1, 0) has an angle"],
    ),
    "outline": (
        GOOD | {"outline_mm": [[[0, 0], [1, 1]]]},
        ["outline_mm[0][0]: has 2 entries, but needs at least 3"],
    ),
    "one ring": (
        GOOD | {"outline_mm": [[0, 0], [1, 1], [1, 0]]},
        ["outline_mm: a ring must stand in a list, [[[x, y], ...]]"],
    ),
    "outline crosses itself": (
        GOOD | {"outline_mm": [[[0, 0], [1, 1], [1, 0], [0, 1]]]},
        ["outline_mm: polygon 0 cannot clip a sheet: Self-intersection"],
    ),
    "origin": (GOOD | {"origin_mm": [0]}, ["origin_mm"]),
    "meta": (GOOD | {"meta": 3}, ["meta: 3 where an object is needed"]),
    "min length": (GOOD | {"min_length_mm": -1}, ["min_length_mm: -1 must be at least 0"]),
}

TEXTS = {
    "no JSON": ("{'tile_mm': 1}", "line 1, column 2: this is no JSON"),
    "empty": ("", "is empty"),
    "no brace": ("G28", "begins with no brace, so it is no grid"),
    "comma": ('{"tile_mm": [1, 2,], "x": 3}', "column 19: a comma stands before ]; take it away"),
    "NaN": ('{"tile_mm": NaN, "spacing_mm": 1, "angles_deg": [[0]]}', "tile_mm"),
    "infinite": (
        '{"tile_mm": 1, "spacing_mm": 1e999, "angles_deg": [[0]]}',
        "spacing_mm: inf is no finite number",
    ),
    "not a number in angles": (
        '{"tile_mm": 1, "spacing_mm": 1, "angles_deg": [[NaN]]}',
        "angles_deg[0][0]: tile (0, 0): nan is no finite number",
    ),
    "twice": ('{"tile_mm": 1, "tile_mm": 2}', "key 'tile_mm' stands twice"),
    "deep": ("[" * 200_000, "nested too deeply"),
    "huge integer": ('{"tile_mm": ' + "9" * 5000 + "}", "number that cannot be read"),
    "large integer": ('{"tile_mm": 1, "spacing_mm": 1' + "0" * 400 + ', "angles_deg": [[0]]}', "spacing_mm"),
}


@pytest.mark.parametrize("case", BAD)
def test_every_mistake_is_named(case):
    data, says = BAD[case]
    with pytest.raises(GridError) as caught:
        grid.loads(json.dumps(data), source="lab.json")
    lines = str(caught.value).splitlines()
    assert len(lines) == len(says)
    for line, start in zip(lines, says, strict=True):
        assert line.startswith(f"lab.json: {start}")


@pytest.mark.parametrize("case", TEXTS)
def test_text_that_is_no_grid_is_named(case):
    text, says = TEXTS[case]
    with pytest.raises(GridError, match="^grid: ") as caught:
        grid.loads(text)
    assert says in str(caught.value)
    assert len(str(caught.value)) < 500


def test_ten_problems_are_shown_and_the_rest_counted():
    with pytest.raises(GridError) as caught:
        grid.loads(json.dumps(GOOD | {"angles_deg": [[100 + k for k in range(25)]]}))
    lines = str(caught.value).splitlines()
    assert len(lines) == 11
    assert lines[-1] == "grid: and 15 more problems"


def test_files_that_are_no_text(tmp_path):
    binary = tmp_path / "image.json"
    binary.write_bytes(b"\x89PNG\r\n")
    with pytest.raises(GridError, match="image.json: is no text: byte 0x89 at offset 0"):
        grid.read(binary)
    with pytest.raises(GridError, match="is a folder"):
        grid.read(tmp_path)
    with pytest.raises(GridError, match="no such file"):
        grid.read(tmp_path / "missing.json")
    big = tmp_path / "big.json"
    with big.open("wb") as out:
        out.truncate(200_000_000)
    with pytest.raises(GridError, match="has 200.0 MB, but a grid file may have 64 MB"):
        grid.read(big)


def test_what_a_file_says_arrives(tmp_path):
    file = tmp_path / "grid.json"
    ring = [[0, 0], [2, 0], [2, 2], [0, 0]]
    file.write_text(
        "\ufeff"
        + json.dumps(
            GOOD
            | {
                "tile_mm": [1, 2],
                "origin_mm": [3, 4],
                "outline_mm": [ring],
                "min_length_mm": 0.3,
                "spacing_mm": [[0.1, 0.2], [0.3, None]],
                "meta": {"source": "here"},
            }
        )
    )
    sheet = grid.read(file)
    assert (sheet.tile_mm, sheet.origin_mm, sheet.min_length_mm) == ((1, 2), (3, 4), 0.3)
    assert (sheet.cols, sheet.rows, sheet.meta) == (2, 2, {"source": "here"})
    np.testing.assert_array_equal(sheet.angles_deg, [[-45, -30.5], [-12, np.nan]])
    assert sheet.spacing_mm.tolist() == [[0.1, 0.2], [0.3, 0.0]]
    assert sheet.outline_mm == [[[tuple(p) for p in ring]]]
    assert len(sheet.sha256) == 64


def test_several_polygons_and_one_are_both_understood():
    ring = [[0, 0], [1, 0], [1, 1]]
    one, two = (grid.loads(json.dumps(GOOD | {"outline_mm": o})) for o in ([ring], [[ring], [ring]]))
    assert (len(one.outline_mm), len(two.outline_mm)) == (1, 2)


@settings(max_examples=50, deadline=None)
@given(grids())
def test_a_grid_that_is_written_reads_the_same(sheet):
    again = grid.loads(grid.dumps(sheet))
    np.testing.assert_array_equal(again.angles_deg, sheet.angles_deg)
    np.testing.assert_array_equal(again.spacing_mm, sheet.spacing_mm)
    assert (again.tile_mm, again.origin_mm, again.min_length_mm) == (
        sheet.tile_mm,
        sheet.origin_mm,
        sheet.min_length_mm,
    )
    assert again.outline_mm == sheet.outline_mm


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda file: file.stem)
def test_examples_are_grids(file):
    sheet = grid.read(file)
    assert sheet.meta["source"]


def test_the_schema_knows_every_key():
    schema = grid.schema()
    assert set(GOOD) <= set(schema["properties"])
    assert schema["required"] == ["tile_mm", "spacing_mm", "angles_deg"]
    assert schema["additionalProperties"] is False
    assert all("description" in entry for entry in schema["properties"].values())
