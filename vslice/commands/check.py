"""``vslice check``: replay a program and verify that it can be printed."""

import dataclasses
import json
import sys
from pathlib import Path

import click

from vslice.options import (
    nozzle_option,
    program_profile_option,
    set_option,
    settings_without_effect,
    with_nozzle,
)
from vslice.pressed import pressed
from vslice.terminal.session import common, progress, say

MOST = 20


@click.command("check", epilog="Example: vslice check part.gcode --grid grid.json -p marlin-syringe")
@click.argument("program_file", metavar="PART.gcode", type=click.Path(path_type=Path, allow_dash=True))
@click.option(
    "--grid",
    "grid_file",
    type=click.Path(path_type=Path),
    help="Also verify that each hatch line of this grid is printed exactly once.",
)
@program_profile_option
@nozzle_option
@set_option
@click.option("--json", "as_json", is_flag=True, help="All violations as JSON on stdout.")
@common
def command(
    program_file: Path,
    grid_file: Path | None,
    profile_name: str | None,
    nozzle_name: str | None,
    overrides: tuple[str, ...],
    as_json: bool,
) -> None:
    """Replay a program and verify that it can be printed.

    Independent of how it was made: every extrusion must be printable, no travel may pass through printed
    material, nor may anything printed push deeper into the nozzle than the profile allows; positions and
    speeds must be within the machine's limits, extrusion must be constant and stop while travelling, and
    only commands that are followed may stand in the print. PART.gcode may be - for standard input. Exits
    with 1 if anything is wrong.
    """
    settings_without_effect("the check", overrides, "printer")
    if str(program_file) == "-" and str(grid_file) == "-":
        raise click.UsageError("Program and grid cannot both come from standard input; name a file for one.")
    from dialect.source import load_stream
    from gcode.check import check
    from vslice.machine import mismatch, read_program

    with progress(2) as step:
        step("reading")
        given = str(program_file) == "-"
        source = load_stream(sys.stdin.buffer, "standard input") if given else program_file
        sheet = None
        if grid_file is not None:
            from vslice.reading import read_grid

            sheet = read_grid(grid_file)
        moves, _, profile = read_program(source, profile_name, with_nozzle(nozzle_name, overrides))
        step("replaying")
        report = check(moves, profile, sheet)
    wrong = report.violations
    if as_json:
        facts = {
            "file": str(program_file),
            "violations": [dataclasses.asdict(violation) for violation in wrong],
            "moves": report.moves,
            "extrusions": report.extrusions,
            "printed_mm": round(report.printed_mm, 3),
            "travel_mm": round(report.travel_mm, 3),
            "joins": report.joins,
            "nozzle": None if report.pressing is None else report.pressing.facts(),
        }
        click.echo(json.dumps(facts, indent=1))
    else:
        for violation in wrong[:MOST]:
            click.echo(str(violation))
        if len(wrong) > MOST:
            click.echo(f"and {len(wrong) - MOST} more violations")
    if wrong:
        for note in mismatch(moves, None if sheet is None else sheet.sha256):
            say(note)
    joins = f", {report.joins} of them joins between hatch lines" if report.joins else ""
    said = "1 violation" if len(wrong) == 1 else f"{len(wrong)} violations" if wrong else "no violations"
    say(
        f"{program_file}: {said} in {report.extrusions} extrusions{joins} "
        f"({report.printed_mm:.1f} mm printed, {report.travel_mm:.1f} mm travelled)"
    )
    if report.pressing is not None:
        say(f"nozzle {pressed(report.pressing, profile)}")
        if report.pressing.allowed_mm == 0 and profile.nozzle.press_mm is None:
            say(
                "Neither program, grid nor profile says how high the beads are, so nothing may press into "
                "the nozzle: --set nozzle.press_mm= says how deep, usually half a bead's height."
            )
    sys.exit(1 if wrong else 0)
