"""What a printer would do, told to the user."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from vslice.terminal.job_display import Display, clock, shown
from vslice.terminal.session import json_wanted, say
from vslice.terminal.streaming import times_of

if TYPE_CHECKING:
    from printer import Settings
    from printer.dry_run import DryRun
    from printer.emulator.motion import Motion
    from profiles import Profile

MOST = 5  # warnings that are shown one by one


def show_dry_run(
    program_file: Path, settings: "Settings", profile: "Profile", resume: bool, height_mm: float | None
) -> None:
    """Stream a program, or the rest of an interrupted job, to the emulated printer, and tell what it did."""
    from printer import read_program
    from printer.dry_run import dry_run, interrupted_printer
    from printer.journal import journal_path, read_journal
    from printer.resume import check_unchanged

    program = read_program(program_file)
    if not resume:
        with shown(Display(program, times_of(program_file, program, profile))) as show:
            ended = dry_run(program, settings, show, motion=motion_of(profile))
        _tell(program.name, ended, "", 0)
        return
    entry = read_journal(journal_path(program_file))
    check_unchanged(program, entry)
    with interrupted_printer(program, entry, settings, height_mm, motion=motion_of(profile)) as (plan, go_on):
        echo = say if json_wanted() else click.echo  # stdout is for JSON
        for sentence in plan.text:
            echo(sentence)
        echo("Before the program goes on:")
        for line in plan.before:
            echo(f"  {line}")
        times = times_of(program_file, program, profile)
        with shown(Display(program, times)) as show:
            _tell(program.name, go_on(show), " from there on", plan.start_at)


def _tell(name: str, ended: "DryRun", rest: str, start_at: int) -> None:
    """What a dry run did."""
    if json_wanted():
        from vslice.figures import of_job

        click.echo(of_job(ended.report, name, ended).text())
        if ended.report.refused:
            click.get_current_context().exit(1)
        return
    where = "  ".join(f"{axis} {value:.3f}" for axis, value in ended.position.items())
    done, of_all = ended.report.acknowledged - start_at, ended.report.total - start_at
    click.echo(f"lines      {done} of {of_all} commands{rest}, each taken once")
    click.echo(f"moves      {ended.moves}{rest}")
    click.echo(f"position   {where} (mm, at the end)")
    click.echo(f"material   {ended.material_mm:.2f} mm of E{rest}")
    waits_s = ended.homing_s + ended.heating_s
    click.echo(f"time       {clock(ended.time_s - waits_s)}, and {clock(waits_s)} for homing and heating")
    warnings = list(dict.fromkeys(ended.report.warnings))
    click.echo(f"warnings   {len(ended.report.warnings)}")
    for warning in warnings[:MOST]:
        click.echo(f"  {warning}")
    if ended.report.unknown:
        names = ", ".join(dict.fromkeys(command.split()[0] for command in ended.report.unknown))
        click.echo(f"not done   {names}: known to another firmware, not carried out by the emulated Marlin")
    if ended.report.refused:
        click.get_current_context().exit(1)  # not all of the program was done


def motion_of(profile: "Profile") -> "Motion":
    """How the emulated printer is to move, so that it is the machine of a profile."""
    from printer.emulator.motion import Motion

    machine, motion = profile.machine, profile.motion
    return Motion(
        speed_mm_s=machine.max_speed_mm_s,
        acceleration_mm_s2=machine.max_acceleration_mm_s2,
        print_mm_s2=motion.print_acceleration_mm_s2,
        retract_mm_s2=motion.retract_acceleration_mm_s2,
        travel_mm_s2=motion.travel_acceleration_mm_s2,
        junction_deviation_mm=machine.junction_deviation_mm,
        retract_mm=motion.retract_mm,
        retract_speed_mm_s=motion.retract_speed_mm_s,
    )
