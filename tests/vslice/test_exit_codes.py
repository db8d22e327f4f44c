"""One rule for exit codes: 2 for what the user gave and cannot be used, 1 for what went wrong outside."""

from pathlib import Path

import pytest

TILE = '{"tile_mm": 1.0, "spacing_mm": 0.25, "angles_deg": [[-45]]}'


@pytest.fixture
def files(run):
    """A grid, a program, a profile that has a fault, and a folder."""
    Path("sheet.json").write_text(TILE)
    Path("part.gcode").write_text("G28\n")
    Path("lab.toml").write_text("[machine]\nfixed_mm = 300.0\n")
    Path("folder").mkdir()
    return run


WRONG = [
    "folder -o a.gcode",
    "sheet.json -o folder",
    "sheet.json -o none/a.gcode",
    "sheet.json -o a.gcode -p lab.toml",
    "sheet.json -o a.gcode --set motion.park_mm=300",
    "sheet.json -o a.gcode --set machine.offset_mm=300",
    "sheet.json -o a.gcode --set motion.prime_mm=300",
    "sheet.json -o a.gcode --set machine.width_mm=3",
    "generate -o folder",
    "generate -o none/a.json",
    "preview sheet.json -o folder",
    "preview sheet.json -o none/a.png",
    "preview part.gcode -p marlin-generic -o a.png",
    "compare sheet.json -o none/a.md",
    "compare sheet.json --plot none/a.png",
    "paper -o sheet.json",
    "paper -o sheet.json/paper",
    "check folder",
    "send folder --dry-run",
    "send none.gcode --dry-run",
    "send part.gcode --resume",
    "send part.gcode --resume --dry-run -p marlin-generic",
    "send --resume",
    "upload none.gcode --to duet --url http://127.0.0.1:1",
    "upload part.gcode --to nowhere",
    "upload part.gcode --to duet",
    "upload part.gcode --to duet --url nowhere --no-check",
    "sheet.json -o a.gcode --upload nowhere",
    "config set profile none.toml",
    "config host duet --to duet --url http://a",
    "config key nowhere",
    "help nothing",
    "completion tcsh",
]


@pytest.mark.parametrize("words", WRONG)
def test_what_cannot_be_used_ends_with_2(files, words):
    code, _, err = files(*words.split())
    assert code == 2, err
    assert "Traceback" not in err


def test_a_profile_is_named_whatever_is_wrong_with_it(files):
    assert "Error: lab.toml: [machine] fixed_mm 300 is outside" in files("sheet.json", "-p", "lab.toml")[2]


@pytest.mark.parametrize(
    "words",
    [
        "check part.gcode -p marlin-generic",
        "send part.gcode -p marlin-generic --dry-run",
        "send part.gcode -p marlin-generic --no-check --port none",
        "upload part.gcode --to duet --url http://127.0.0.1:1 --no-check",
    ],
)
def test_what_went_wrong_outside_or_was_found_at_fault_ends_with_1(files, words):
    code, _, err = files(*words.split())
    assert code == 1, err


def test_a_picture_in_a_wrong_place_is_told_of_the_place(files):
    assert "folder is a folder; name a file in it" in files("preview", "sheet.json", "-o", "folder")[2]
    code, _, err = files("preview", "sheet.json", "-o", "/dev/full")
    assert (code, "/dev/full is no ordinary file" in err) == (2, Path("/dev/full").exists())
