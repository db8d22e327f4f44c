"""A program in toolpaths, and what of it was printed: for tests that interrupt it."""

from functools import cache
from itertools import pairwise

from pump import Bench

from printer import Safety, State, make_program
from printer.records import Entry, JobRecord

SAFETY = Safety(
    lift_mm=5,
    lift_speed_mm_s=10,
    close_lines=("G1 E-1 F1800", "M42 P4 S0"),
    stop_lines=("M104 S0",),
    home_lines=("G28 X Y",),
)


@cache
def sheet(toolpaths=60, marked=True):
    """Rows of short lines, each extruded in two moves, with a valve on pin 4."""
    return make_program(sheet_lines(toolpaths, marked), name="sheet.gcode")


def sheet_lines(toolpaths, marked=True):
    lines = ["M302 P1", "G21", "G90", "M104 S60", "G0 X0 Y0 Z0.2 F6000", "M83"]
    for k in range(toolpaths):
        x, z = (k % 6) * 5, 0.2 + 0.2 * (k // 6)
        lines += [f";TOOLPATH {k}"] if marked else ["; the next one"]
        lines += [f"G0 X{x} Z{z:.3f} F6000", "G1 E1 F1800", "M42 P4 S255"]
        lines += [f"G1 X{x + 2} E0.1 F1200", f"G1 X{x + 4} E0.1 F1200", "M42 P4 S0", "G1 E-1 F1800"]
    return [*lines, "G0 Z20"]


def entry(program, line, ended=""):
    return Entry(JobRecord("sheet.gcode", program.sha256, "marlin://", "lab"), line, ended)


def printed(firmware):
    """The moves that laid material."""
    moves = firmware.path.moves
    return [
        (round(a.x, 3), round(a.z, 3), round(b.x, 3), round(b.z, 3), round(b.e, 5))
        for a, b in pairwise(moves)
        if b.e > 0 and (a.x, a.z) != (b.x, b.z)
    ]


@cache
def whole(toolpaths=60):
    bench = Bench(sheet(toolpaths).commands)
    assert bench.run() is State.FINISHED
    return printed(bench.firmware)


def assert_same_print(before, after, toolpaths=60):
    """``before`` is a beginning of the whole, ``after`` an end of it, and nothing is missing between.

    Returns how many extruded moves were made twice.
    """
    all_of_it = whole(toolpaths)
    assert before == all_of_it[: len(before)]
    assert after == all_of_it[len(all_of_it) - len(after) :]
    assert len(before) + len(after) >= len(all_of_it)
    return len(before) + len(after) - len(all_of_it)
