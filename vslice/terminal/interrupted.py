"""Jobs that were interrupted: what is known of them, and whether another may begin over what they left."""

import sys
from pathlib import Path
from typing import Literal

import click

from vslice.terminal.session import said_if_interrupted

Choice = Literal["restart", "resume"]


def known_of(journal: Path) -> str | None:
    """An interrupted job in words; None if there is none."""
    from printer import JournalError
    from printer.journal import unfinished

    try:
        entry = unfinished(journal)
    except JournalError as error:
        return f"whether its last job ended cannot be told: {error}"
    if entry is None:
        return None
    return f"its last job was interrupted ({entry.ended or 'cut off'}) at line {entry.acknowledged_line}"


@said_if_interrupted("Nothing was sent.")
def ask(program_file: Path, journal: Path, restart: bool) -> Choice | None:
    """Whether the job goes on or begins anew: asked on a terminal. None if no job was interrupted.

    Raises:
        UsageError: one was, and nobody can be asked.
        Abort: the user wants neither.
    """
    known = known_of(journal)
    if known is None or restart:
        return None if known is None else "restart"
    what = f"{program_file.name}: {known}, and what it printed may stand in the printer."
    if (wrong := _cannot_go_on(program_file, journal)) is not None:
        _ask_to_restart(f"{what} It cannot go on, {wrong[0]}", wrong[1], journal)
        return "restart"
    if not on_terminal():
        raise click.UsageError(
            f"{what} Give --resume to go on with it, or, when the plate is clear, --restart to begin anew "
            f"(the journal, {journal}, is kept aside then). Nothing was sent."
        )
    click.echo(what, err=True)
    answer = click.prompt(
        "Go on with it, begin anew on a clear plate, or stop?",
        type=click.Choice(["resume", "restart", "stop"]),
        default="stop",
        err=True,
    )
    if answer == "stop":
        raise click.Abort
    return "resume" if answer == "resume" else "restart"


def _cannot_go_on(program_file: Path, journal: Path) -> tuple[str, str] | None:
    """Why the interrupted job cannot go on, and what would help: its program is another now, or it ended
    before its first toolpath. None if it can."""
    from dialect.source import load
    from printer import JournalError, ResumeError, read_program
    from printer.journal import unfinished
    from printer.resume import start_of_work

    try:
        entry = unfinished(journal)
    except JournalError:
        return None  # then it is not known what was sent
    source = load(program_file)
    if entry is None:
        return None
    if entry.job.sha256 == source.sha256:
        try:
            start_of_work(read_program(source), entry)
        except ResumeError:
            return "as it ended before its first toolpath.", ""
        return None
    return (
        f"since the file was changed after the job began: its sha256 is {source.sha256[:16]}.. now "
        f"and {entry.job.sha256[:16]}.. in the journal.",
        "Put the old file back to go on with --resume, or, when",
    )


def _ask_to_restart(what: str, or_when: str, journal: Path) -> None:
    if not on_terminal():
        raise click.UsageError(
            f"{what} {or_when or 'When'} the plate is clear, give "
            f"--restart to begin anew (the journal, {journal}, is kept aside then). Nothing was sent."
        )
    click.echo(what, err=True)
    answer = click.prompt(
        "Begin anew on a clear plate, or stop?",
        type=click.Choice(["restart", "stop"]),
        default="stop",
        err=True,
    )
    if answer == "stop":
        raise click.Abort


@said_if_interrupted("Nothing was sent.")
def ask_of_port(port: str, journal: Path) -> None:
    """Make sure that the interrupted job of another program does not stand in this printer.

    Raises:
        UsageError: it may, and nobody can be asked.
        Abort: the user does not want to print there.
    """
    from printer.last_job import journal_of

    last = journal_of(port)
    if last is None or last == journal.resolve():
        return
    known = known_of(last)
    if known is None:
        return
    what = f"{port} last printed another program, that of {last}: {known}, and may stand in the printer."
    if not on_terminal():
        raise click.UsageError(f"{what} When the plate is clear, give --restart to begin. Nothing was sent.")
    click.echo(what, err=True)
    if not click.confirm("Is the plate clear?", default=False, err=True):
        raise click.Abort


def on_terminal() -> bool:
    """Whether somebody can read a question and answer it."""
    return sys.stdin.isatty() and sys.stderr.isatty()
