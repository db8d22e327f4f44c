"""Lines of grbl: several commands in one, and moves that go on without saying so."""

import pytest

from dialect.errors import ReadError
from dialect.flavor import GRBL
from dialect.reader import clean, read


def commands(*lines):
    return [(line.number, line.command) for line in read(lines, flavor=GRBL) if line.command]


def test_a_block_becomes_commands_in_the_order_in_which_grbl_obeys_them():
    assert commands("g1x10y20f600 G90 g21 (fast) M8 ; on") == [
        (1, "M8"), (1, "G21"), (1, "G90"), (1, "G1 X10 Y20 F600"),
    ]  # fmt: skip
    assert commands("N5 G4 P0.5 M3 S1000") == [(1, "M3 S1000"), (1, "G4 P0.5")]
    assert commands("G38.2 Z-10 F50") == [(1, "G38.2 Z-10 F50")]
    assert commands("G92 A0", "G01 A-0.5") == [(1, "G92 E0"), (2, "G1 E-0.5")]


def test_a_move_goes_on():
    assert commands("X5", "G1 Y6 F60", "X7", "F120", "G0 X1", "Y2") == [
        (1, "G0 X5"), (2, "G1 Y6 F60"), (3, "G1 X7"), (4, "G1 F120"), (5, "G0 X1"), (6, "G0 Y2"),
    ]  # fmt: skip


def test_comments_come_once_and_nothing_is_nothing():
    lines = list(read(["G21 G90 ; both", "", "%", "$H"], flavor=GRBL))
    assert [(line.command, line.comment) for line in lines] == [
        ("G21", " both"), ("G90", None), ("", None), ("", None), ("$H", None),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("G1 E5", "its feed is A"),
        ("G0 G1 X5", "exclude each other"),
        ("G1 X5 X6", "X stands twice"),
        ("G28 G1 X5", "both want the axes"),
        ("G1 X", "is no word"),
        ("M117 Hello", "is no word"),
        ("$G1", "is no command of grbl"),
        ("G1 X1" + "0" * 80, "takes at most 79"),
        ("G1 Xé", "is no letter of G-code"),
    ],
)
def test_what_grbl_would_not_obey_is_refused(line, says):
    with pytest.raises(ReadError, match=says):
        commands(line)


def test_a_line_of_a_profile_is_one_command():
    assert clean("G54", GRBL) == "G54"
    with pytest.raises(ReadError, match="a line of its own"):
        clean("G21 G90", GRBL)
