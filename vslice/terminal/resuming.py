"""``vslice send --resume``: find the interrupted job, ask its printer, say what will happen, and go on."""

from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from vslice.terminal.interrupted import on_terminal
from vslice.terminal.job_display import Display
from vslice.terminal.session import said_if_interrupted
from vslice.terminal.streaming import resume_offered, run, times_of, told
from vslice.terminal.viewing import viewed

if TYPE_CHECKING:
    from printer import Program, Settings
    from printer.ports import Port
    from printer.records import Entry
    from printer.resume import ResumePlan
    from profiles import Profile

NOTHING_MOVED = "Nothing was moved, and the journal is as it was: the job can still be resumed."


@dataclass(frozen=True)
class InterruptedJob:
    """What is to go on: the program, the port and the profile of its job."""

    program_file: Path
    port: str
    profile: str


def interrupted_job(program_file: Path | None) -> InterruptedJob:
    """The job to go on with: that of the file, or the only unfinished one beside the current folder."""
    from printer.journal import SUFFIX, journal_path, read_journal, unfinished

    if program_file is not None:
        job = read_journal(journal_path(program_file)).job
        return InterruptedJob(program_file, job.port, job.profile)
    # A folder that was moved took both along: the program is beside its journal.
    found = [path for path in sorted(Path.cwd().glob(f"*{SUFFIX}")) if unfinished(path) is not None]
    if len(found) != 1:
        names = ", ".join(path.name.removesuffix(SUFFIX) for path in found) or "none"
        raise click.UsageError(f"Interrupted jobs in this folder: {names}. Give the program to resume.")
    job = read_journal(found[0]).job
    return InterruptedJob(found[0].with_name(found[0].name.removesuffix(SUFFIX)), job.port, job.profile)


def resume_program(
    program_file: Path,
    port: str,
    settings: "Settings",
    profile: "Profile",
    height_mm: float | None,
    yes: bool,
    view: bool = False,
) -> int:
    """Go on with the interrupted job of a program, once the user has agreed to the way; the exit code."""
    from printer import Journal, read_program
    from printer.journal import journal_path
    from printer.ports import open_port, port_lock
    from printer.resume import check_unchanged, start_of_work

    program = read_program(program_file)
    path = journal_path(program_file)
    with closing(Journal(path)) as journal, port_lock(port):
        entry = journal.reopen(port)
        check_unchanged(program, entry)
        start_of_work(program, entry)  # before the port is opened, which may reset the printer
        if not yes and not on_terminal():
            raise click.UsageError(
                "Nobody can be asked here whether the way is free: give --yes if it is. Nothing was sent."
            )
        with said_if_interrupted(NOTHING_MOVED):
            opened = open_port(port, settings.baud)
        with closing(opened) as line:
            ready, plan = _agreed(program, entry, line, settings, height_mm, yes)
            with said_if_interrupted(NOTHING_MOVED):
                display = Display(program, times_of(program_file, program, profile))
            with (
                viewed(program_file, program, profile, view) as seen,
                resume_offered(program, path),
            ):
                report = run(program, line, ready, journal, display, plan.start_at, plan.before, seen)
    return told(report, path, program)


@said_if_interrupted(NOTHING_MOVED)
def _agreed(
    program: "Program", entry: "Entry", line: "Port", settings: "Settings", height_mm: float | None, yes: bool
) -> "tuple[Settings, ResumePlan]":
    """Ask the printer where it is, say what will happen, and let the user agree. Nothing moves meanwhile."""
    from printer import Job, MovedError, make_program
    from printer.resume import plan_resume

    # Whether the printer was reset decides how the nozzle may move.
    greeting = Job(make_program(["M114"], name=program.name), line, settings).run()
    plan = plan_resume(
        program,
        entry,
        settings.safety,
        rebooted=greeting.rebooted,
        height_mm=height_mm,
        reported=greeting.position,
    )
    for sentence in plan.text:
        click.echo(sentence, err=True)
    ready = replace(settings, boot_wait_s=0.0)
    if yes:
        return ready, plan
    if not click.confirm("Is the way free? The nozzle will move", err=True):
        raise click.Abort
    again = Job(make_program(["M114"], name=program.name), line, ready).run()  # is it still true?
    if again.rebooted or again.position != greeting.position:
        raise MovedError(
            f"{program.name}: the printer was reset or moved while the question stood. "
            "Nothing was sent; resume again."
        )
    return ready, plan
