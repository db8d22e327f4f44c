"""Reading G-code, what vslice writes and what others write."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from making import read_lines

from gcode.errors import ParseError
from gcode.moves import Kind
from gcode.parse import read_moves


def path(*lines, plane="XZ"):
    """[(kind, x, y, e)] of what moves."""
    return [
        (move.kind.name, round(move.x_mm, 6), round(move.y_mm, 6), round(move.e_mm, 6))
        for move in read_lines(lines, plane)
        if move.kind in (Kind.TRAVEL, Kind.EXTRUDE, Kind.FEED)
    ]


def checksummed(text):
    value = 0
    for byte in text.encode():
        value ^= byte
    return f"{text}*{value}"


AT_ZERO = "G92 X0 Y0 Z0 E0"

CASES = {
    "absolute": (["G90", "M83", "G1 X1 Z2 E.5"], [("EXTRUDE", 1, 2, 0.5)]),
    "relative": (["G91", "G1 X1 E1", "G1 X1 E1"], [("EXTRUDE", 1, 0, 1), ("EXTRUDE", 2, 0, 1)]),
    "absolute E": (["M82", "G1 X1 E1", "G1 X2 E3"], [("EXTRUDE", 1, 0, 1), ("EXTRUDE", 2, 0, 2)]),
    "E set": (["M82", "G1 X1 E1", "G92 E0", "G1 X2 E1"], [("EXTRUDE", 1, 0, 1), ("EXTRUDE", 2, 0, 1)]),
    "G91 makes E relative and G90 absolute": (
        ["G91", "G1 X1 E1", "G90", "G1 X2 E3"],
        [("EXTRUDE", 1, 0, 1), ("EXTRUDE", 2, 0, 2)],
    ),
    "M83 after G90": (["G90", "M83", "G1 X1 E1", "G1 X2 E1"], [("EXTRUDE", 1, 0, 1), ("EXTRUDE", 2, 0, 1)]),
    "small letters without blanks": (["g1x10.5z-.25"], [("TRAVEL", 10.5, -0.25, 0)]),
    "blanks inside words": (["G 1 X 10"], [("TRAVEL", 10, 0, 0)]),
    "leading zeros": (["G01 X1", "G00 X2"], [("TRAVEL", 1, 0, 0), ("TRAVEL", 2, 0, 0)]),
    "inches": (["G20", "G1 X1", "G21", "G1 X1"], [("TRAVEL", 25.4, 0, 0), ("TRAVEL", 1, 0, 0)]),
    "comments": (["G1 X1 ; X9", "; G1 X8", "(G1 X7) G1 X2 (X6)"], [("TRAVEL", 1, 0, 0), ("TRAVEL", 2, 0, 0)]),
    "numbered": ([checksummed("N3 G1 X1"), "N4 G1 X2"], [("TRAVEL", 1, 0, 0), ("TRAVEL", 2, 0, 0)]),
    "retraction": (
        ["M83", "G1 E-1 F1800", "G1 X1", "G1 E1"],
        [("FEED", 0, 0, -1), ("TRAVEL", 1, 0, 0), ("FEED", 1, 0, 1)],
    ),
    "nothing moves": (["G1 F3000", "G1 X0", "G1"], []),
    "offsets": (["G1 X10", "G92 X0", "G1 X1"], [("TRAVEL", 10, 0, 0), ("TRAVEL", 11, 0, 0)]),
    "others' commands": (
        ["M117 G1 X9", "START_PRINT BED=60", "T0", "M104 S200", "G29", "G1 X1"],
        [("TRAVEL", 1, 0, 0)],
    ),
    "byte order mark and percent": (["\ufeffG21", "%", "G1 X1", "%"], [("TRAVEL", 1, 0, 0)]),
    "blank lines": (["", "  ", "G1 X1\r"], [("TRAVEL", 1, 0, 0)]),
}


@pytest.mark.parametrize("case", CASES)
def test_what_a_program_says_is_what_moves(case):
    lines, expected = CASES[case]
    assert path(AT_ZERO, *lines) == expected


def test_homing_forgets_the_position_and_speeds_are_per_minute():
    moves = read_lines([AT_ZERO, "G1 X1 F600", "G28", "G0 Z5", "G0 X2 Y3", "G28 X", "G1 Z6"])
    travels = [m for m in moves if m.kind == Kind.TRAVEL]
    assert travels[0].speed_mm_s == 10
    assert math.isnan(travels[1].x_mm)
    assert travels[1].y_mm == 5
    assert (travels[2].x_mm, travels[2].depth_mm) == (2, 3)
    assert math.isnan(travels[3].x_mm)
    assert travels[3].y_mm == 6
    assert [m.line for m in travels] == [2, 4, 5, 7]


def test_the_plane_says_which_axis_runs_along_the_sheet():
    (move,) = [m for m in read_lines([AT_ZERO, "G1 X1 Y2 Z3"], "YZ") if m.kind == Kind.TRAVEL]
    assert (move.x_mm, move.y_mm, move.depth_mm) == (2, 3, 1)


def test_dwells_and_firmware_retraction():
    moves = read_lines(["G4 P250", "G4 S2", "G10", "G11", "G10 P1 S200"])
    assert [m.kind for m in moves] == [
        Kind.DWELL,
        Kind.DWELL,
        Kind.FIRMWARE_RETRACT,
        Kind.FIRMWARE_PRIME,
        Kind.COMMAND,
    ]
    assert [m.seconds for m in moves[:2]] == [0.25, 2]


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("N3 G1 X1*7", "line 2: the line has checksum 7, but its text gives 98"),
        ("G1 X1.2.3", "line 2: G1: 'X1.2.3' is no word"),
        ("G1 Xabc", "line 2: G1: X has no number"),
        ("?", "line 2: '\\?' is no G-code command"),
        ("X500 Z1", "line 2: 'X500 Z1' has words but no G0 or G1"),
        ("G1 X1\0", "line 2: this is no line of G-code"),
    ],
)
def test_what_cannot_be_read_is_named(line, says):
    with pytest.raises(ParseError, match=says):
        read_lines(["G21", line])


def test_files_that_cannot_be_read_are_named(tmp_path):
    with pytest.raises(ParseError, match="nothing.gcode: there is no such file"):
        read_moves(tmp_path / "nothing.gcode")
    with pytest.raises(ParseError, match="is a folder"):
        read_moves(tmp_path)
    file = tmp_path / "part.gcode"
    file.write_bytes(b"G1 X1 ; caf\xe9\nG1 X\n")
    with pytest.raises(ParseError, match="part.gcode: line 2: G1"):
        read_moves(file)


@given(st.lists(st.text("GMNXYZEFPS0123456789.-+*;() \t?", max_size=30), max_size=5))
def test_any_text_gives_moves_or_a_parse_error(lines):
    try:
        moves = read_lines(lines)
    except ParseError as error:
        assert str(error).startswith("line ")
    else:
        assert all(1 <= move.line <= len(lines) for move in moves)


def test_a_speed_that_no_printer_takes_changes_nothing_and_is_shown():
    moves = list(read_lines(["G92 X0 Z0", "G1 X1 F600", "G1 X2 F0", "G1 X3 F-60", "G1 X4"]))
    travels = [move for move in moves if move.kind == Kind.TRAVEL]
    assert [move.speed_mm_s for move in travels] == [10, 10, 10, 10]
    assert [move.text for move in travels] == ["", "G1 X2 F0", "G1 X3 F-60", ""]


def test_what_moves_in_a_way_of_its_own_leaves_no_known_place_and_a_curve_its_end():
    start = ["G92 X0 Y0 Z0", "G1 X1 Y1 Z1 F600"]
    for command in ("G27", "G30", "G61", "M600", "G12", "G38.2 Z-5"):
        assert all(np.isnan(list(read_lines([*start, command]))[-1][1:4])), command
    assert list(read_lines([*start, "G2 X5 Z3 I2", "G1 X6"]))[-1][1:4] == (6, 3, 1)
