"""Grid files: what is accepted, and what every mistake is answered with."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from fields import grids
from hypothesis import given, settings
from hypothesis import strategies as st

from slicer import grid
from slicer.errors import GridError

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.json"))
GOOD = {"tile_mm": 1.0, "spacing_mm": 0.1, "angles_deg": [[-45, -30.5], [-12, None]]}

BAD = {
    "not an object": ([1, 2], ["holds a list of 2, but a grid is an object"]),
    "missing": ({}, ["tile_mm: is missing", "spacing_mm: is missing", "angles_deg: is missing"]),
    "unknown key": (GOOD | {"spacng_mm": 1}, ["unknown key 'spacng_mm'. Did you mean 'spacing_mm'?"]),
    "strange key": (GOOD | {"colour": 1}, ["unknown key 'colour'. A grid has tile_mm"]),
    "text": (
        GOOD | {"angles_deg": [["steep"]]},
        ["angles_deg[0][0]: tile (0, 0): the text 'steep' where a number"],
    ),
    "number in quotes": (
        GOOD | {"spacing_mm": "0.1"},
        ["spacing_mm: the text '0.1' where a number is needed"],
    ),
    "boolean": (GOOD | {"tile_mm": True}, ["tile_mm: true where a number or [width, height] is needed"]),
    "zero spacing": (
        GOOD | {"spacing_mm": 0},
        ["spacing_mm: 0 must be at least 0.01 mm, ten times the 0.001 mm to which positions are written"],
    ),
    "negative tile": (GOOD | {"tile_mm": [1, -2]}, ["tile_mm[1]: -2 must be at least 0.01 mm"]),
    "three sides": (GOOD | {"tile_mm": [1, 2, 3]}, ["tile_mm: has 3 entries, but needs at most 2"]),
    "ragged": (GOOD | {"angles_deg": [[0, 0], [0]]}, ["angles_deg[1] has 1 tiles, but row 0 has 2"]),
    "no rows": (GOOD | {"angles_deg": []}, ["angles_deg: has 0 entries, but needs at least 1"]),
    "empty row": (GOOD | {"angles_deg": [[]]}, ["angles_deg[0]: has 0 entries, but needs at least 1"]),
    "flat angles": (GOOD | {"angles_deg": [1]}, ["angles_deg[0]: 1 where a list is needed"]),
    "spacing shape": (
        GOOD | {"spacing_mm": [[1, 1]]},
        ["spacing_mm has 1 rows, but angles_deg has 2"],
    ),
    "spacing row": (
        GOOD | {"spacing_mm": [[1, 1], [1]]},
        ["spacing_mm[1] has 1 numbers, but angles_deg[1] has 2"],
    ),
    "far away": (GOOD | {"origin_mm": [1e18, 0]}, ["origin_mm[0]: 1e+18 must be at most 100000 mm"]),
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
    "outline far away": (
        GOOD | {"outline_mm": [[[0, 0], [1, 1], [1, 2e5]]]},
        ["outline_mm[0][0][2][1]: 200000 must be at most 100000 mm"],
    ),
    "no polygons": (GOOD | {"outline_mm": []}, ["outline_mm[0]: has 0 entries, but needs at least 1"]),
    "nanometres": (
        GOOD | {"spacing_mm": [[1, 1], [5e-3, 1]]},
        ["spacing_mm[1][0]: tile (0, 1): 0.005 must be at least 0.01 mm, ten times the 0.001 mm"],
    ),
    "kilometres": (
        GOOD | {"tile_mm": 1e6},
        [f"tile_mm[{k}]: 1e+06 must be at most 10000 mm" for k in (0, 1)],
    ),
    "long sheet": (
        GOOD | {"tile_mm": [1, 6e3], "angles_deg": [[0]] * 20},
        ["20 rows of 6000 mm from 0 mm reach 120000 mm, but 100000 mm is the farthest"],
    ),
    "long min length": (GOOD | {"min_length_mm": 1e9}, ["min_length_mm: 1e+09 must be at most 100000 mm"]),
    "origin": (GOOD | {"origin_mm": [0]}, ["origin_mm"]),
    "deep meta": (
        GOOD | {"meta": eval("[" * 99 + "]" * 99), "origin_mm": [0, "0"]},
        ["origin_mm[1]: the text '0' where a number is needed"],
    ),
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
        grid.loads(json.dumps(GOOD | {"angles_deg": [[str(k) for k in range(25)]]}))
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


METAS = [
    None, True, 0, 3.5, 12345678901234567890123, "", "text", "\ud800 half a pair", "\n\x7f\u2028; (é*", [], [{}],
    {"a": {"b": [1, None, "ü"]}}, "x" * 5000,
]  # fmt: skip


@pytest.mark.parametrize("meta", METAS, ids=lambda meta: ascii(meta)[:20])
def test_meta_of_any_kind_is_kept(meta):
    read = grid.loads(json.dumps(GOOD | {"meta": meta}))
    assert read.meta == meta
    text = grid.dumps(read)
    assert grid.loads(text).meta == meta
    text.encode("utf-8")


def test_meta_that_is_no_number_twice_or_too_deep():
    read = grid.loads(json.dumps(GOOD)[:-1] + ', "meta": [NaN, 1e999]}')
    assert str(grid.loads(grid.dumps(read)).meta) == "[nan, inf]"
    with pytest.raises(GridError, match="key 'a' stands twice"):
        grid.loads(json.dumps(GOOD)[:-1] + ', "meta": {"a": 1, "a": 2}}')
    with pytest.raises(GridError, match="meta: is nested 300 levels deep; 200 is the most"):
        grid.loads(json.dumps(GOOD)[:-1] + ', "meta": ' + "[" * 300 + "]" * 300 + "}")
    assert grid.loads(json.dumps(GOOD)).meta == {}
    assert "meta" not in grid.dumps(grid.loads(json.dumps(GOOD)))


def values(schema):
    """What a JSON Schema accepts, as far as those of grid files go."""
    if "anyOf" in schema or "oneOf" in schema:
        return st.one_of(*map(values, schema.get("anyOf") or schema["oneOf"]))
    match schema.get("type"):
        case None:
            return st.recursive(st.none() | st.text() | st.floats(allow_nan=False), st.lists, max_leaves=3)
        case "null":
            return st.none()
        case "number":
            low, high = schema.get("minimum"), schema.get("maximum")
            ends = [st.just(end) for end in (low, high) if end is not None]
            return st.one_of(st.floats(low, high, allow_nan=False, allow_infinity=False), *ends)
        case "array" if "prefixItems" in schema:
            return st.tuples(*map(values, schema["prefixItems"])).map(list)
        case "array":
            low = schema.get("minItems", 0)
            most = schema.get("maxItems", low + 3)
            return st.lists(values(schema["items"]), min_size=low, max_size=most)
    raise AssertionError(schema)


@settings(max_examples=300, deadline=None)
@given(st.data())
def test_the_reader_takes_what_the_schema_accepts(data):
    """But for what no schema can say: how many entries belong together, and what encloses an area."""
    schema = grid.schema()
    fields = {}
    for key, entry in schema["properties"].items():
        if key in schema["required"] or data.draw(st.booleans()):
            fields[key] = data.draw(values(entry), label=key)
    try:
        grid.loads(json.dumps(fields))
    except GridError as error:
        unsayable = (
            r"every row must have as many|give every tile its own|numbers, but angles_deg|is null, but tile|"
        )
        unsayable += r"mm is the farthest|mm² are left of the outline"
        for line in str(error).splitlines():
            assert re.search(unsayable, line), line


def test_the_schema_knows_every_key():
    schema = grid.schema()
    assert set(GOOD) <= set(schema["properties"])
    assert schema["required"] == ["tile_mm", "spacing_mm", "angles_deg"]
    assert schema["additionalProperties"] is False
    assert all("description" in entry for entry in schema["properties"].values())
