"""An option that changes nothing on this input is refused; the same option where it counts is not."""

from pathlib import Path

import pytest

TILE = '{"tile_mm": 1.0, "spacing_mm": 0.25, "angles_deg": [[-45]]}'
INSTANCE = '{"segments": [[[0, 0], [1, 0]], [[0, 1], [1, 1]]], "first": null}'

NOTHING = [
    (["preview", "part.gcode", "--show", "toolpaths"], "--show has no effect on a program"),
    (["preview", "sheet.json", "--hanging"], "--hanging has no effect on a grid"),
    (["send", "part.gcode", "--nozzle", "25G", "--no-check"], "--nozzle with --no-check"),
    (["send", "part.gcode", "--nozzle", "25G", "--resume"], "--nozzle with --resume"),
    (["preview", "sheet.json", "--color", "order"], "--color has no effect on a grid"),
    (["preview", "sheet.json", "-p", "marlin-syringe"], "--profile has no effect on a grid"),
    (
        ["preview", "sheet.json", "-o", "a.svg", "--dpi", "100"],
        "--dpi has no effect on a picture of lines, .svg",
    ),
    (
        ["preview", "part.gcode", "-o", "a.pdf", "--dpi", "100"],
        "--dpi has no effect on a picture of lines, .pdf",
    ),
    (["sheet.json", "--method", "greedy", "--effort", "high"], "--effort has no effect on --method greedy"),
    (["sheet.json", "--method", "greedy", "--seed", "3"], "--seed has no effect on --method greedy"),
    (["sheet.json", "--method", "greedy", "--workers", "2"], "--workers has no effect on --method greedy"),
    (
        ["sheet.json", "--method", "greedy", "--time-limit", "3"],
        "--time-limit has no effect on --method greedy",
    ),
    (
        ["sheet.json", "--method", "multistart", "--effort", "high"],
        "--effort has no effect on --method multistart",
    ),
    (
        ["sheet.json", "--method", "exact", "--objective", "straight", "--seed", "1"],
        "--seed has no effect on --method exact",
    ),
    (["sheet.json", "--port", "x"], "--port goes with --send."),
    (
        ["check", "part.gcode", "--set", "printer.baud=9600"],
        "--set printer.baud=9600 has no effect on the check",
    ),
    (
        ["compare", "sheet.json", "--methods", "greedy", "--seeds", "3"],
        "--seeds has no effect on greedy, which draws no random numbers",
    ),
    (
        ["compare", "sheet.json", "--methods", "greedy,multistart", "--effort", "high"],
        "--effort has no effect on greedy, multistart",
    ),
    (
        ["compare", "sheet.json", "--methods", "greedy", "--set", "printer.baud=9600"],
        "--set printer.baud=9600 has no effect on the order of toolpaths",
    ),
    (
        ["compare", "lines.json", "--methods", "greedy", "--start", "corner"],
        "--start has no effect on an instance without a first toolpath",
    ),
]

SOMETHING = [
    ["preview", "part.gcode", "--color", "order", "-p", "marlin-generic", "--dpi", "50"],
    ["preview", "sheet.json", "--show", "toolpaths", "--dpi", "50"],
    ["preview", "sheet.json", "-o", "a.svg"],
    ["sheet.json", "--method", "greedy", "--workers", "1"],
    ["sheet.json", "--method", "local", "--effort", "quick", "--seed", "3", "--time-limit", "60"],
    ["sheet.json", "--method", "exact", "--seed", "1"],
    ["sheet.json", "--method", "greedy", "--set", "printer.baud=9600"],
    ["check", "part.gcode", "--set", "motion.retract_mm=2"],
    ["compare", "lines.json", "--methods", "greedy", "--start", "free"],
    ["compare", "sheet.json", "--methods", "greedy", "--set", "motion.travel_speed_mm_s=9"],
]  # fmt: skip


@pytest.fixture
def files(run):
    Path("sheet.json").write_text(TILE)
    Path("lines.json").write_text(INSTANCE)
    run("-q", "sheet.json", "-o", "part.gcode", "--method", "greedy", "-p", "marlin-generic")


@pytest.mark.parametrize(("words", "says"), NOTHING, ids=[" ".join(words) for words, _ in NOTHING])
def test_an_option_without_effect_is_refused(run, files, tmp_path, words, says):
    before = sorted(tmp_path.iterdir())
    code, out, err = run(*words)
    assert (code, out) == (2, "")
    assert says in err
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("words", SOMETHING, ids=" ".join)
def test_one_with_effect_is_not(run, files, words):
    code, _, err = run(*words)
    assert "no effect" not in err
    assert code in (0, 1), err
