"""The line that fills the nozzle, and where it stands at the end."""

import numpy as np
import pytest
from making import POINT, make_grid, make_plan
from making import make_program as made

import profiles
from dialect.reader import checksum
from gcode import program
from gcode.check import check
from gcode.emit import emit
from gcode.errors import BuildVolumeError
from gcode.moves import Kind
from gcode.parse import parse
from slicer import generate
from slicer.nozzle import NozzleBody

GRID = generate.random_walk(3, 2, seed=4, tile_mm=5.0, spacing_mm=0.4)


def sliced(*settings, profile="marlin-generic", grid=GRID):
    machine = profiles.load(profile, [POINT, *settings])
    program = made(grid, machine)
    return machine, program, list(emit(program, machine, {"version": "0", "profile": profile}))


@pytest.mark.parametrize("offset_mm", [10.0, 30.0])
@pytest.mark.parametrize("profile", ["marlin-generic", "marlin-syringe", "marlin-pneumatic"])
def test_a_prime_line_beside_the_sheet_fills_the_nozzle_and_the_check_knows_it(profile, offset_mm):
    machine, program, text = sliced("motion.prime_mm=12", f"machine.offset_mm={offset_mm}", profile=profile)
    moves = list(parse(text))
    report = check(moves, machine, GRID)
    assert report.violations == []
    assert report.extrusions == len(program.height_mm)
    without = check(
        list(parse(sliced("motion.prime_mm=0", f"machine.offset_mm={offset_mm}", profile=profile)[2])),
        machine,
        GRID,
    )
    assert report.printed_mm == pytest.approx(without.printed_mm)
    k = next(k for k, move in enumerate(moves) if move.text == "TYPE:Skirt/Brim")
    line = next(m for m in moves[k:] if m.kind in (Kind.EXTRUDE, Kind.TRAVEL) and not m.rapid)
    assert line.y_mm == pytest.approx(0.2)  # on the bed, by half a bead
    assert not offset_mm <= line.x_mm <= offset_mm + 15


def test_the_prime_line_counts_in_time_and_feed_apart_from_the_print():
    _, with_line, _ = sliced("motion.prime_mm=20")
    _, without, _ = sliced("motion.prime_mm=0")
    assert with_line.feed_mm == pytest.approx(without.feed_mm)
    assert with_line.primed_mm > 0 == without.primed_mm
    assert with_line.times.other_s > without.times.other_s
    assert with_line.times.printing_s == pytest.approx(without.times.printing_s, rel=1e-3)


def test_the_comment_alone_excuses_no_line_over_the_sheet():
    machine, _, text = sliced("motion.prime_mm=0", "motion.park_mm=0")
    k = next(k for k, line in enumerate(text) if line.startswith(";TOOLPATH 0"))
    x = machine.machine.offset_mm + 5
    forged = [
        *text[:k],
        ";TYPE:Skirt/Brim",
        f"G0 X{x:.3f} Z0.2 F600",
        f"G1 X{x + 3:.3f} E0.156 F600",
        *text[k:],
    ]
    assert "stray" in {violation.kind for violation in check(list(parse(forged)), machine, GRID).violations}


def test_no_room_is_told_with_both_sides():
    with pytest.raises(
        BuildVolumeError, match=r"prime_mm 300: beside the sheet there are 8\.\d+ mm on the left and 19\d"
    ):
        sliced("motion.prime_mm=300")
    with pytest.raises(
        BuildVolumeError, match=r"park_mm 400 is outside the build volume: X runs from 0 to 220 mm"
    ):
        sliced("motion.park_mm=400")


def test_at_the_end_the_nozzle_parks_above_the_print():
    _, program, _ = sliced("motion.park_mm=100")
    moves = [move for move in program.moves if move.kind in (Kind.TRAVEL, Kind.EXTRUDE)]
    assert moves[-1].x_mm == 100
    highest = np.nanmax([move.y_mm for move in moves if move.kind == Kind.EXTRUDE])
    assert moves[-1].y_mm >= highest + 4.9
    assert moves[-2].y_mm == moves[-1].y_mm  # up first, then sideways


def test_a_resumed_job_never_fills_the_nozzle_again():
    from printer import make_program
    from printer.records import Entry, JobRecord
    from printer.resume import start_of_work

    _, _, text = sliced()
    program = make_program(text)
    for line in (program.lines[program.toolpaths[0] + 1], program.lines[program.toolpaths[3]]):
        entry = Entry(JobRecord("p", program.sha256, "port", ""), line, "stopped")
        assert start_of_work(program, entry) >= program.toolpaths[0]


def stripped(text):
    """A program without its comments, as hosts send it."""
    return [command for line in text if (command := line.partition(";")[0].strip())]


@pytest.mark.parametrize("numbered", [False, True])
@pytest.mark.parametrize("profile", ["marlin-generic", "marlin-syringe", "marlin-pneumatic"])
def test_a_program_without_its_comments_has_its_prime_line_still(profile, numbered):
    machine, program, text = sliced("motion.prime_mm=12", profile=profile)
    lines = stripped(text)
    if numbered:
        lines = [f"N{k} {line}" for k, line in enumerate(lines, 1)]
        lines = [f"{line}*{checksum(line.encode())}" for line in lines]
    report = check(list(parse(lines)), machine, GRID)
    assert report.violations == []
    assert report.extrusions == len(program.height_mm)
    assert check(list(parse(lines)), machine).violations == []


@pytest.mark.parametrize(
    "changed", ["motion.prime_mm=0", "motion.prime_mm=11"], ids=["none in the profile", "another length"]
)
def test_a_first_line_that_the_profile_does_not_have_is_one_of_the_sheet(changed):
    _, _, text = sliced("motion.prime_mm=12")
    machine = profiles.load("marlin-generic", [changed])
    assert "stray" in {
        violation.kind for violation in check(list(parse(stripped(text))), machine, GRID).violations
    }


def test_a_thick_prime_line_leaves_room_for_the_body_beside_a_thin_first_toolpath():
    sheet = make_grid([[0.0, 0.0]], tile=(5.0, 5.0))
    sheet.spacing_mm[0] = 0.2, 2.0
    plan, spacing, tile = make_plan(sheet)
    profile = profiles.load(
        "marlin-generic", ["motion.prime_mm=3", "motion.prime_gap_mm=1", "machine.offset_mm=60"]
    )
    left = float(plan.toolpaths[:, :, 0].min()) + 60
    lowest = float(plan.toolpaths[:, :, 1].min()) + program.build(plan, profile, spacing, tile).shift_mm[1]
    higher = spacing.max() / 2 - lowest
    assert higher > 0.3

    def gap(body):
        moves = program.build(plan, profile, spacing, tile, body).moves
        return left - next(move.x_mm for move in moves if move.kind is Kind.EXTRUDE)

    assert gap(None) == gap(NozzleBody.of(0.0)) == gap(NozzleBody.of(1.0)) == pytest.approx(1.0)
    assert gap(NozzleBody.of(20.0)) == pytest.approx(10.0)
    assert gap(NozzleBody.of(20.0, 45.0, press_mm=0.1)) == pytest.approx(10 + higher - 0.1 * np.sqrt(2))
    assert gap(NozzleBody.of(20.0, press_mm=5.0)) == pytest.approx(1.0)  # that much may be pressed
    assert gap(NozzleBody.of(1.0, 0.0, 0.2, 40.0)) == pytest.approx(20.0)
