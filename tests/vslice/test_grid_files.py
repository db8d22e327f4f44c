"""Grid files on the command line: warnings reach the user, ``meta`` reaches the program, bad numbers end in words."""

import json
import re
from pathlib import Path

import pytest

from gcode.head import read_head
from gcode.parse import parse
from slicer import grid
from vslice.pipeline import MOST_META, meta_line

CASES = Path(__file__).parents[1] / "data" / "cases"
SPIKE = CASES / "outline_spike.json"
WARNING = "Warning: {}: outline_mm: polygon 0 touches or crosses itself"
FIELDS = {"tile_mm": 1.0, "spacing_mm": 0.25, "angles_deg": [[-45]]}


@pytest.mark.parametrize(
    "words",
    [
        [SPIKE, "-o", "part.gcode", "--method", "greedy"],
        ["preview", SPIKE, "-o", "picture.png"],
        ["compare", SPIKE, "--methods", "greedy", "--seeds", "1"],
    ],
    ids=["slice", "preview", "compare"],
)
def test_what_was_repaired_is_said(run, words):
    code, _, err = run(*words)
    assert code == 0, err
    assert err.count(WARNING.format(SPIKE)) == 1
    assert "16 mm² before, 16 mm² after." in err
    assert "Warning" not in run("-q", *words)[2]


def test_check_and_standard_input_say_it_too(run, monkeypatch):
    import io

    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(SPIKE.read_bytes())))
    code, _, err = run("-", "-o", "part.gcode", "--method", "greedy")
    assert code == 0
    assert WARNING.format("standard input") in err
    code, out, err = run("check", "part.gcode", "--grid", SPIKE)
    assert (code, out) == (0, "")
    assert WARNING.format(SPIKE) in err


@pytest.mark.parametrize(
    "case", [file for file in sorted(CASES.glob("*.json")) if file.stem.startswith(("outline", "h", "angle"))],
    ids=lambda file: file.stem,
)  # fmt: skip
def test_cases_are_sliced_and_pass_the_check(run, case):
    code, _, err = run(case, "-o", "part.gcode", "--method", "greedy")
    assert code == 0, err
    code, out, err = run("check", "part.gcode", "--grid", case)
    assert (code, out) == (0, ""), err


def test_a_lost_row_is_no_program_that_passes(run):
    case = CASES / "outline_many_vertices.json"
    run(case, "-o", "part.gcode", "--method", "greedy", "--set", "motion.prime_mm=0")
    lines = Path("part.gcode").read_text().splitlines(keepends=True)
    k = next(k for k, line in enumerate(lines) if line.startswith("G1") and " E" in line and "X" in line)
    Path("part.gcode").write_text("".join(lines[:k] + lines[k + 1 :]))
    code, out, _ = run("check", "part.gcode", "--grid", case)
    assert code == 1
    assert "missing" in out


def test_a_spacing_that_three_decimals_cannot_carry_is_refused(run):
    case = CASES / "spacing_below_resolution.json"
    code, _, err = run(case, "-o", "part.gcode")
    assert code == 2
    assert "spacing_mm: 0.001 must be at least 0.01 mm, ten times the 0.001 mm to which positions are" in err
    assert not Path("part.gcode").exists()


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--cols", "100000"], "100000 is not in the range 1<=x<=10000"),
        (["--cols", "10000", "--rows", "10000"], "100000000, but a grid may have 1000000"),
        (["--cols", "2000", "--rows", "1", "--tile-mm", "100"], "200000 mm long; 100000 mm is the most"),
        (["--seed", "99999999999999999999"], "99999999999999999999 is not in the range 0<=x<=9223372036854775807"),
        (["--spacing-mm", "1e-308"], "1e-308 is not in the range 0.01<=x<=10000"),
        (["--deviation-deg", "1e308"], "1e+308 is not in the range 0<=x<=180"),
        (["--tile-mm", "nan"], "nan is not in the range 0.01<=x<=10000"),
    ],
)  # fmt: skip
def test_generate_refuses_numbers_without_sense(run, words, says):
    code, out, err = run("generate", *words)
    assert (code, out) == (2, "")
    assert says in err


def test_the_options_of_generate_have_the_ranges_of_the_grid_file():
    from slicer.grid_schema import LEAST_MM, MOST_MM
    from vslice.commands.generate import command

    ranges = {option.name: option.type for option in command.params}
    for name in ("tile_mm", "spacing_mm"):
        assert (ranges[name].min, ranges[name].max) == (LEAST_MM, MOST_MM)


METAS = [
    "a text", ["a", 1], 3, None, True, {"é": "ü"}, "two\nlines\r\x00\x7f\u2028", "; G28\nM112", "(G28) *71 N5 %",
    {"thumbnail begin": {"deep": [[]]}}, "\ud800",
]  # fmt: skip


@pytest.mark.parametrize("meta", METAS, ids=lambda meta: ascii(meta)[:20])
def test_meta_reaches_the_head_as_one_line(run, meta):
    Path("sheet.json").write_text(json.dumps(FIELDS | {"meta": meta}))
    code, out, err = run("sheet.json", "-o", "-")
    assert code == 0, err
    (line,) = re.findall(r"^; vslice meta = ([ -~]*)$", out, re.M)
    assert json.loads(line) == meta
    Path("plain.json").write_text(json.dumps(FIELDS))
    plain = run("plain.json", "-o", "-")[1]
    assert "vslice meta" not in plain
    commands = [[text for text in program.splitlines() if text[:1] != ";"] for program in (out, plain)]
    assert commands[0] == commands[1]
    moves = list(parse(out.splitlines(), plane="XZ"))
    assert json.loads(read_head(moves)["meta"]) == meta
    Path("part.gcode").write_text(out)
    assert run("check", "part.gcode", "--grid", "sheet.json")[0] == 0


def test_long_meta_is_known_by_its_hash(run):
    assert meta_line("x" * (MOST_META - 2)) == json.dumps("x" * (MOST_META - 2))
    Path("sheet.json").write_text(json.dumps(FIELDS | {"meta": "x" * 100_000}))
    _, out, _ = run("sheet.json", "-o", "-")
    (line,) = re.findall(r"^; vslice meta = (.*)$", out, re.M)
    assert json.loads(line)["characters"] == 100_002
    assert len(json.loads(line)["sha256"]) == 64
    assert meta_line("x" * 100_000) != meta_line("y" * 100_000)


def test_meta_of_a_random_grid_survives(run):
    assert run("generate", "--seed", "7", "-o", "sheet.json")[0] == 0
    made = grid.read(Path("sheet.json"))
    _, out, _ = run("sheet.json", "-o", "-", "--method", "greedy")
    assert json.loads(re.search(r"^; vslice meta = (.*)$", out, re.M)[1]) == made.meta


def test_a_grid_on_standard_input_has_the_hash_of_its_bytes_and_can_be_drawn(run, monkeypatch):
    import hashlib
    import io

    data = json.dumps(FIELDS).encode()

    def pipe():
        monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(data)))

    pipe()
    assert run("-", "-o", "part.gcode", "--method", "greedy")[0] == 0
    assert f"; vslice grid_sha256 = {hashlib.sha256(data).hexdigest()}" in Path("part.gcode").read_text()
    pipe()
    assert run("preview", "-", "-o", "grid.png")[0] == 0
    assert Path("grid.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("cut", ['{"tile_mm": 1.0, "angles_deg": [[-45]]', '{"tile_mm": 1.0,\n'])
def test_a_grid_that_ends_too_early_says_so(cut):
    from slicer.errors import GridError

    with pytest.raises(GridError, match="ends too early, after 1 line: "):
        grid.loads(cut + "\n")


@pytest.mark.parametrize(("says", "warned"), [("", True), ("[motion]\nprime_mm = 0.0\n", False)])
def test_a_profile_that_forgets_the_prime_line_is_told(run, says, warned):
    Path("sheet.json").write_text(json.dumps(FIELDS))
    Path("lab.toml").write_text(says)
    code, _, err = run("sheet.json", "-o", "part.gcode", "-p", "lab.toml", "--method", "greedy")
    assert code == 0
    assert ("lab.toml does not say [motion] prime_mm" in err) == warned


def test_the_help_names_what_an_option_may_be(run):
    from slicer.sequence import METHODS

    out = run("slice", "--help")[1]
    assert all(re.search(rf"\b{name}\b", out) for name in METHODS)
    out = run("emulate", "--help")[1]
    assert "homing_s" in out
    assert "keep_path" in out
