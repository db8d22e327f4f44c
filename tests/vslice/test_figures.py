"""What commands print with --json is what their schemas say, and what they tell people."""

import json
from pathlib import Path

import numpy as np
import pytest
from making import BARE, make_grid

from slicer import grid
from vslice.commands.json_schema import COMMANDS
from vslice.figures import SCHEMAS

jsonschema = pytest.importorskip("jsonschema")
SHEET = make_grid([[-45, -20]])


@pytest.fixture
def part(run):
    """A folder with a grid, its program and a picture of stripes."""
    from PIL import Image

    Path("sheet.json").write_text(grid.dumps(SHEET))
    assert run("sheet.json", "-o", "part.gcode", "--method", "greedy", "--set", BARE)[0] == 0
    stripes = 127 + 120 * np.sin(np.arange(96) / 2 + np.zeros((96, 1)))
    Image.fromarray(stripes.astype(np.uint8)).save("stripes.png")
    return run


CASES = {
    "slice": "slice sheet.json -o new.gcode --method greedy --json",
    "orient": "orient stripes.png --tiles 2x2 --size-mm 4 -o new.json --no-picture --json",
    "check": "check part.gcode --grid sheet.json --json",
    "send": "send part.gcode --dry-run --json",
    "compare": "compare sheet.json --methods greedy --json",
    "nozzles": "nozzles sheet.json --only 25G,22G --json",
    "paper": "paper --seeds 10 --grids 1 --effort quick --json",
    "profiles": "profiles --json",
}


def test_every_command_with_json_has_a_schema():
    assert set(COMMANDS) == set(SCHEMAS) == set(CASES) | {"upload"}  # test_upload has that one


@pytest.mark.parametrize("command", CASES)
def test_what_is_printed_is_what_the_schema_says(part, command):
    code, out, err = part(*CASES[command].split())
    assert code == 0, err
    schema = json.loads(part("json-schema", command)[1])
    jsonschema.Draft202012Validator.check_schema(schema)
    found = json.loads(out)
    jsonschema.validate(found, schema)
    if isinstance(found, dict) and "file" in found:
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(found | {"file": 3}, schema)


def test_figures_are_those_of_the_table(part):
    _, out, err = part(*CASES["slice"].split())
    found = json.loads(out)
    table = dict(line.split("  ", 1) for line in err.splitlines() if "  " in line)
    assert table["printed length"].strip() == f"{found['printed_mm']:.1f} mm"
    assert table["travel"].strip() == f"{found['travel_s']:.1f} s"
    whole = sum(round(found[key], 1) for key in ("printing_s", "travel_s", "other_s"))
    assert table["estimated time"].strip().startswith(f"{whole:.1f} s")
    # And the program is the same as without.
    without = part("slice", "sheet.json", "-o", "other.gcode", "--method", "greedy")
    assert without[1] == ""
    assert Path("other.gcode").read_bytes() == Path("new.gcode").read_bytes()


def test_json_and_a_program_on_stdout_exclude_each_other(part):
    assert part("slice", "sheet.json", "-o", "-", "--json")[0] == 2
    assert part("orient", "stripes.png", "--tiles", "2x2", "--size-mm", "4", "-o", "-", "--json")[0] == 2


def test_a_job_tells_how_it_ended(part, monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    code, out, err = part("send", "part.gcode", "--port", "marlin://?clock=fast", "--json")
    assert code == 0, err
    found = json.loads(out)
    assert found["state"] == "finished"
    assert found["acknowledged"] == found["total"] > 10
    jsonschema.validate(found, json.loads(part("json-schema", "send")[1]))
