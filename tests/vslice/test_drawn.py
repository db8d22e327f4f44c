"""Own toolpaths and regions go through slice, check and preview as a grid does."""

import json
from pathlib import Path

import pytest

TRIANGLE = {"type": "Polygon", "coordinates": [[[0, 0], [12, 0], [0, 9], [0, 0]]]}
BESIDE = {"type": "Polygon", "coordinates": [[[12, 0], [12, 9], [0, 9], [12, 0]]]}
REGIONS = {
    "type": "FeatureCollection",
    "spacing_mm": 0.4,
    "features": [
        {"type": "Feature", "properties": {"angle_deg": 30}, "geometry": TRIANGLE},
        {"type": "Feature", "properties": {"angle_deg": -36.87, "spacing_mm": 0.5}, "geometry": BESIDE},
    ],
}
OWN = {"segments": [[[0, 1], [5, 1]], [[0, 0], [5, 0.2]], [[6, 0], [6, 4]]], "spacing_mm": 0.4}


@pytest.fixture
def files(run):
    Path("regions.geojson").write_text(json.dumps(REGIONS))
    Path("own.json").write_text(json.dumps(OWN))
    Path("own.csv").write_text("\n".join(",".join(map(str, [*a, *b, 0.4])) for a, b in OWN["segments"]))
    return run


@pytest.mark.parametrize(("name", "toolpaths"), [("regions.geojson", None), ("own.json", 3), ("own.csv", 3)])
def test_they_are_sliced_checked_and_drawn(files, name, toolpaths):
    for words in ([], ["--start", "free"]):
        code, _, err = files(name, "-o", "part.gcode", "--method", "greedy", *words)
        assert code == 0, err
        if toolpaths:
            assert f"toolpaths          {toolpaths}" in err
        code, out, _ = files("check", "part.gcode", "--grid", name)
        assert code == 0, out
    assert files("preview", name, "-o", "a.png")[0] == 0
    assert Path("a.png").stat().st_size > 1000


def test_the_check_sees_what_is_left_out(files):
    assert files("regions.geojson", "-o", "part.gcode", "--method", "greedy")[0] == 0
    REGIONS["features"][0]["properties"]["angle_deg"] = 31
    try:
        Path("other.geojson").write_text(json.dumps(REGIONS))
    finally:
        REGIONS["features"][0]["properties"]["angle_deg"] = 30
    code, out, _ = files("check", "part.gcode", "--grid", "other.geojson")
    assert code == 1
    assert "is no hatch line of other.geojson" in out


def test_own_toolpaths_that_cross_end_with_2(files):
    Path("cross.json").write_text('{"segments": [[[0, 0], [4, 4]], [[0, 4], [4, 0]]], "spacing_mm": 0.4}')
    code, _, err = files("cross.json", "-o", "part.gcode")
    assert code == 2
    assert "crosses or overlaps" in err
    assert not Path("part.gcode").exists()
