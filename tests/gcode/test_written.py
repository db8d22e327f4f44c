"""What the text of moves takes, read by whoever reads it: head, hosts and tables say that."""

import math
import re

import pytest
from making import POINT, make_grid, make_lines, make_program, read_lines

import profiles
from gcode.estimate import seconds_of
from gcode.moves import Kind, Move
from gcode.written import seconds_as_read, written

SHEET = make_grid([[-45, -20], [30, 90]])
OWN_MOVES = 'gcode.start=["G28", "G1 Z50 F600", "G4 P2500", "G0 X3 F1200"]'
NAMES = [
    *(
        f"{flavor}-{feed}"
        for flavor in ("marlin", "klipper", "reprapfirmware")
        for feed in ("generic", "pneumatic")
    ),
    "grbl-syringe",
    "grbl-pneumatic",
]


def estimated(lines, profile):
    return seconds_of(read_lines(lines, profile.machine.plane, profile.flavor), profile).sum()


@pytest.mark.parametrize(
    "settings", [[], [OWN_MOVES], ['machine.plane="YZ"'], ["motion.print_speed_mm_s=0.0031"]]
)
@pytest.mark.parametrize("name", NAMES)
def test_a_program_says_the_time_that_its_text_takes(name, settings):
    if "grbl" in name and settings == [OWN_MOVES]:
        settings = [OWN_MOVES.replace("G28", "$H").replace("P2500", "P2.5")]
    profile = profiles.load(name, [POINT, "motion.prime_mm=0", *settings])
    made = make_program(SHEET, profile)
    lines = make_lines(SHEET, name, *settings)
    taken = estimated(lines, profile)
    assert made.seconds == pytest.approx(taken, abs=1e-9)
    assert f";TIME:{math.ceil(taken)}" in lines
    tail = next(line for line in lines if line.startswith("; estimated printing time"))
    parts = {unit: int(count) for count, unit in re.findall(r"(\d+)([dhms])", tail)}
    days, hours, minutes, seconds = (parts.get(unit, 0) for unit in "dhms")
    assert ((days * 24 + hours) * 60 + minutes) * 60 + seconds == math.ceil(taken)


def test_moves_of_a_start_block_are_in_the_time():
    without, with_moves = (
        make_program(SHEET, profiles.load("marlin-generic", [POINT, start])).seconds
        for start in ('gcode.start=["G28", "G0 X3 F1200"]', OWN_MOVES)
    )
    assert with_moves > without + 2.5 + 5  # the dwell, and 50 mm at 10 mm/s


def test_each_move_gets_its_own_seconds_and_one_that_is_not_written_none():
    profile = profiles.load("marlin-generic")
    at = (10.0, 5.0, 110.0)
    moves = [
        Move(Kind.COMMAND, *(math.nan,) * 3, text="G28"),
        Move(Kind.TRAVEL, *at, speed_mm_s=50.0),
        Move(Kind.DWELL, *at, seconds=2.0),
        Move(Kind.TRAVEL, 10.0002, 5.0, 110.0, speed_mm_s=50.0),
        Move(Kind.EXTRUDE, 30.0, 5.0, 110.0, e_mm=1.0, speed_mm_s=10.0),
    ]
    assert [number for number, _ in written(moves, profile)] == [0, 1, 2, 4]
    seconds = seconds_as_read(moves, profile)
    assert seconds[[0, 2, 3]].tolist() == [0.0, 2.0, 0.0]
    assert seconds[4] == pytest.approx(2.0, abs=0.3)
    assert len(seconds_as_read([], profile)) == 0
