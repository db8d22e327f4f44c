"""A job on a printer as a user sees it: display, keys, Ctrl-C, journal, and how it ended."""

import signal
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any

from vslice.progress import Display, clock, keys, shown
from vslice.session import say

if TYPE_CHECKING:
    from printer import Journal, Program, Report, Settings

MOST_WARNINGS = 5  # that are shown one by one


def stream_program(program_file: Path, port: str, settings: "Settings", profile_name: str) -> int:
    """Stream a file to a port with display, journal and Ctrl-C; returns the exit code."""
    from printer import Journal, read_program
    from printer.journal import JobRecord, journal_path, unfinished

    program = read_program(program_file)
    path = journal_path(program_file)
    with closing(Journal(path)) as journal:
        if (line := unfinished(path)) is not None:
            say(
                f"{program.name}: its last job ended at line {line}; this begins anew (--resume would go on)."
            )
        journal.begin(JobRecord(str(program_file.resolve()), program.sha256, port, profile_name))
        with resume_offered(program, path):
            report = run(program, port, settings, journal)
    return told(report, path, program)


def run(
    program: "Program",
    port: Any,
    settings: "Settings",
    journal: "Journal | None",
    start_at: int = 0,
    before: Sequence[str] = (),
) -> "Report":
    """Stream from command ``start_at`` on, behind the lines ``before``, with display, keys and Ctrl-C."""
    from printer import Job
    from printer.replay import estimate

    display = Display(program, estimate(program, settings.safety.build_axis))
    with shown(display) as show:
        job = Job(
            program, port, settings, on_progress=show, journal=journal, start_at=start_at, before=before
        )

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
    """Say how a job ended, and how to go on with it; the exit code."""
    from printer import State

    for warning in list(dict.fromkeys(report.warnings))[:MOST_WARNINGS]:
        say(f"Printer: {warning}")
    say(
        f"{program.name}: {report.state.value}: {report.acknowledged} of {report.total} commands, "
        f"{report.resent} lines sent again, {clock(report.elapsed_s)}, longest silence "
        f"{report.longest_silence_s:.1f} s"
    )
    if report.state is State.FINISHED:
        return 0
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
    say(f"The journal is {journal}; 'vslice send --resume {program.name}' goes on with the job.")
