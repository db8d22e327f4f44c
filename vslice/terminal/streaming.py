"""A job on a printer as a user sees it: display, keys, Ctrl-C, journal, and how it ended."""

import signal
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any

import click

from vslice.terminal.interrupted import known_of
from vslice.terminal.job_display import Display, clock, keys, shown
from vslice.terminal.session import json_wanted, said_if_interrupted, say
from vslice.terminal.viewing import viewed

if TYPE_CHECKING:
    from printer import Journal, Program, Progress, Report, Settings
    from profiles import Profile
    from vslice.terminal.timeline import Timeline
    from vslice.terminal.viewing import View

MOST_WARNINGS = 5  # that are shown one by one


def stream_program(
    program_file: Path,
    port: str,
    settings: "Settings",
    profile: "Profile",
    profile_name: str,
    restart: bool = False,
    view: bool = False,
) -> int:
    """Stream a file to a port with display, journal and Ctrl-C; returns the exit code.

    Raises:
        UsageError: a job of this program was interrupted, and ``restart`` does not say to begin anew.
    """
    from printer import Journal, read_program
    from printer.journal import journal_path
    from printer.records import JobRecord

    with said_if_interrupted("Nothing was sent."):
        program = read_program(program_file)
    path = journal_path(program_file)
    with closing(Journal(path)) as journal:
        if not restart and (known := known_of(path)) is not None:  # since we asked
            raise click.UsageError(f"{program.name}: {known}. Give --resume or --restart. Nothing was sent.")
        aside = journal.begin(JobRecord(str(program_file.resolve()), program.sha256, port, profile_name))
        if aside is not None:
            say(f"{program.name}: begins anew; the journal of the interrupted job is kept as {aside}.")
        with said_if_interrupted("Nothing was sent."):
            display = Display(program, times_of(program_file, program, profile))
        with (
            viewed(program_file, program, profile, view) as seen,
            resume_offered(program, path),
        ):
            report = run(program, port, settings, journal, display, view=seen)
    return told(report, path, program)


def times_of(program_file: Path, program: "Program", profile: "Profile") -> "Timeline | None":
    """The times of a program; None, and why, if it holds what no estimate can read."""
    from gcode.errors import ParseError
    from vslice.terminal.timeline import timeline

    try:
        return timeline(program_file, program, profile)
    except ParseError as error:
        say(f"The time that is left is unknown, percent is of commands: {program_file.name}: {error}.")
        return None


def run(
    program: "Program",
    port: Any,
    settings: "Settings",
    journal: "Journal | None",
    display: Display,
    start_at: int = 0,
    before: Sequence[str] = (),
    view: "View | None" = None,
) -> "Report":
    """Stream from command ``start_at`` on, behind the lines ``before``, with display, keys and Ctrl-C."""
    from printer import Job

    with shown(display) as show:

        def tell(progress: "Progress") -> None:
            show(progress)
            if view is not None:
                view.tell(progress)

        job = Job(
            program, port, settings, on_progress=tell, journal=journal, start_at=start_at, before=before
        )
        if view is not None:
            view.follow(job)

        def key(pressed: str) -> None:
            if pressed == "p":
                job.pause(not job.paused)

        with _interrupts(job), keys(key):
            return job.run()


@contextmanager
def _interrupts(job: Any) -> Iterator[None]:
    """Ctrl-C once, or SIGTERM: a controlled stop. Twice: M112."""
    count = 0

    def interrupted(signal_number: int, frame: FrameType | None) -> None:
        nonlocal count
        count += 1
        if count == 1:
            job.cancel()
        else:
            job.abort()

    before = {number: signal.signal(number, interrupted) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def told(report: "Report", journal: Path, program: "Program") -> int:
    """Say how a job ended, and how to go on with it; the exit code: 0 only if everything was done."""
    from printer import State

    if json_wanted():
        from vslice.figures import of_job

        click.echo(of_job(report, program.name).text())
    for warning in list(dict.fromkeys(report.warnings))[:MOST_WARNINGS]:
        say(f"Printer: {warning}")
    say(
        f"{program.name}: {report.state.value}: {report.acknowledged} of {report.total} commands, "
        f"{report.resent} lines sent again, {clock(report.elapsed_s)}, longest silence "
        f"{report.longest_silence_s:.1f} s"
    )
    if report.refused:
        count = len(report.refused)
        what = "1 command was" if count == 1 else f"{count} commands were"
        say(f"{program.name}: {what} not carried out by the printer, in its words: {report.refused[0]}")
    if report.state is State.FINISHED:
        return 1 if report.refused else 0
    if report.message:
        say(f"{program.name}: {report.message}")
    _offer_resume(program, journal)
    return 130


@contextmanager
def resume_offered(program: "Program", journal: Path) -> Iterator[None]:
    """Say how to go on with the job if the stream breaks."""
    from printer import StreamError

    try:
        yield
    except StreamError:
        _offer_resume(program, journal)
        raise


def _offer_resume(program: "Program", journal: Path) -> None:
    """Offer what works: what ended before its first toolpath cannot go on."""
    from printer.errors import ResumeError
    from printer.journal import read_journal
    from printer.resume import start_of_work

    entry = read_journal(journal)
    if entry.nothing_laid:
        say(f"Nothing was printed: 'vslice send {program.name}' begins anew.")
        return
    try:
        start_of_work(program, entry)
    except ResumeError as error:
        say(str(error))
        return
    say(f"The journal is {journal}; 'vslice send --resume {program.name}' goes on with the job.")
