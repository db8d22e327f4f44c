"""``vslice send``: stream a program to a printer, for real or dry, or go on with an interrupted job."""

import sys
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from vslice.options import program_profile_option, set_option
from vslice.progress import Display, clock, shown
from vslice.session import common
from vslice.streaming import resume_offered, run, stream_program, told

if TYPE_CHECKING:
    from printer import Settings
    from profiles import Profile

MOST = 5  # violations and warnings that are shown one by one


@click.command("send", epilog="Example: vslice send part.gcode --port /dev/ttyUSB0 -p marlin-syringe")
@click.argument("program_file", metavar="[PART.gcode]", required=False, type=click.Path(path_type=Path))
@click.option(
    "--port", metavar="PORT", help="A device, socket://HOST:PORT, rfc2217://.., spy://PORT, marlin://"
)
@program_profile_option
@set_option
@click.option("--dry-run", is_flag=True, help="Run the same code against an emulated printer, time flying.")
@click.option("--resume", is_flag=True, help="Go on with an interrupted job, from its journal.")
@click.option(
    "--height", "height_mm", type=float, metavar="MM", help="With --resume: where the nozzle stands."
)
@click.option("-y", "--yes", is_flag=True, help="Do not ask before the nozzle moves to resume.")
@click.option("--no-check", is_flag=True, help="Send even what 'vslice check' finds fault with.")
@click.option("--baud", type=int, help="Instead of the profile's [printer] baud.")
@click.option(
    "--window", "window_lines", type=click.IntRange(1, 64), metavar="LINES", help="Lines in flight."
)
@click.option("--probe-after", type=float, metavar="S", help="Silence after which the printer is asked.")
@click.option("--give-up-after", type=float, metavar="S", help="Silence after which the job fails.")
@common
def command(
    program_file: Path | None,
    port: str | None,
    profile_name: str | None,
    overrides: tuple[str, ...],
    dry_run: bool,
    resume: bool,
    height_mm: float | None,
    yes: bool,
    no_check: bool,
    baud: int | None,
    window_lines: int | None,
    probe_after: float | None,
    give_up_after: float | None,
) -> None:
    """Stream a program to a Marlin printer; each line is printed exactly once, or the job stops.

    Ctrl-C stops in a controlled way: the queue ends, the nozzle leaves the print, heaters do as the
    profile says. Ctrl-C twice halts the printer at once (M112). The key p pauses and resumes.
    """
    from vslice.machine import read_profile

    if resume:
        entry = _interrupted(program_file)
        program_file, port = entry.program_file, port or entry.port
        profile_name = profile_name or entry.profile or None  # else the program carries it
    if program_file is None:
        raise click.UsageError(
            "Which program? Give PART.gcode, or --resume to go on with an interrupted job."
        )
    _, profile = read_profile(program_file, profile_name, overrides)
    given: dict[str, Any] = {
        "baud": baud, "window_lines": window_lines,
        "probe_after_s": probe_after, "give_up_after_s": give_up_after,
    }  # fmt: skip
    settings = replace(settings_of(profile), **{k: v for k, v in given.items() if v is not None})
    if not no_check and not resume:
        check(program_file, profile)
    if dry_run:
        _dry_run(program_file, settings)
        return
    port = port or _only_port()
    if resume:
        code = _resume(program_file, port, settings, profile_name or "", height_mm, yes)
    else:
        code = stream_program(program_file, port, settings, profile_name or "")
    click.get_current_context().exit(code)


def send_file(program_file: Path, port: str | None, profile: "Profile", profile_name: str) -> int:
    """Stream a program that has been checked, to the only port where none is named; the exit code."""
    return stream_program(program_file, port or _only_port(), settings_of(profile), profile_name)


def settings_of(profile: "Profile") -> "Settings":
    """What `printer` wants to know, from a profile."""
    from printer import Safety, Settings
    from profiles import render

    serial, motion, material = profile.printer, profile.motion, profile.material
    close = list(render(profile.gcode.valve_close, profile.values))
    if motion.firmware_retraction:
        close.append("G10")
    elif material.feed != "pneumatic" and motion.retract_mm:
        close.append(f"G1 E-{motion.retract_mm:g} F{motion.retract_speed_mm_s * 60:g}")
    speeds = profile.machine.max_speed_mm_s
    safety = Safety(
        build_axis="Z",
        build_axis_homes_up=serial.build_axis_homes_up,
        lift_mm=serial.stop_lift_mm,
        lift_speed_mm_s=min(speeds[2], motion.travel_speed_mm_s),
        travel_speed_mm_s=motion.travel_speed_mm_s,
        retract_speed_mm_s=motion.retract_speed_mm_s,
        close_lines=tuple(close),
        stop_lines=tuple(render(serial.stop_lines, profile.values)),
        home_lines=tuple(render(serial.resume_home_lines, profile.values)),
    )
    return Settings(
        baud=serial.baud,
        window_lines=serial.window_lines,
        window_bytes=serial.window_bytes,
        probe_after_s=serial.probe_after_s,
        give_up_after_s=serial.give_up_after_s,
        boot_wait_s=serial.boot_wait_s,
        safety=safety,
    )


def check(program_file: Path, profile: "Profile") -> None:
    """Refuse a program that `vslice check` finds fault with."""
    from gcode.check import check_file

    wrong = check_file(program_file, profile).violations
    if wrong:
        shown_ones = [f"  {violation}" for violation in wrong[:MOST]]
        more = [f"  and {len(wrong) - MOST} more"] if len(wrong) > MOST else []
        listing = "\n".join([*shown_ones, *more])
        raise click.ClickException(
            f"{program_file} cannot be printed on this machine; nothing was sent:\n{listing}\n"
            "Slice it again for this profile, or insist with --no-check."
        )


# --- dry run -------------------------------------------------------------------------------------------


def _dry_run(program_file: Path, settings: "Settings") -> None:
    from printer import read_program
    from printer.dry_run import dry_run
    from printer.replay import estimate

    program = read_program(program_file)
    with shown(Display(program, estimate(program), clock_runs=False)) as show:
        ended = dry_run(program, settings, show)
    where = "  ".join(f"{axis} {value:.3f}" for axis, value in ended.position.items())
    click.echo(f"lines      {ended.report.acknowledged} of {ended.report.total} commands, each taken once")
    click.echo(f"moves      {ended.path.count}")
    click.echo(f"position   {where} (mm, at the end)")
    click.echo(f"material   {ended.material_mm:.2f} mm of E")
    click.echo(f"time       {clock(ended.time_s)} (moves at their programmed speed, waits and heating)")
    warnings = list(dict.fromkeys(ended.report.warnings))
    click.echo(f"warnings   {len(ended.report.warnings)}")
    for warning in warnings[:MOST]:
        click.echo(f"  {warning}")


# --- resume --------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Interrupted:
    program_file: Path
    port: str
    profile: str


def _interrupted(program_file: Path | None) -> _Interrupted:
    """The job to go on with: that of the file, or the only unfinished one beside the current folder."""
    from printer.journal import SUFFIX, journal_path, read_journal, unfinished

    if program_file is not None:
        job = read_journal(journal_path(program_file)).job
        return _Interrupted(program_file, job.port, job.profile)
    journals = sorted(Path.cwd().glob(f"*{SUFFIX}"))
    # One without a whole record is of a job that never began.
    found = [read_journal(path).job for path in journals if unfinished(path) is not None]
    if len(found) != 1:
        names = ", ".join(Path(job.program).name for job in found) or "none"
        raise click.UsageError(f"Interrupted jobs in this folder: {names}. Give the program to resume.")
    return _Interrupted(Path(found[0].program), found[0].port, found[0].profile)


def _resume(
    program_file: Path, port: str, settings: "Settings", profile_name: str, height_mm: float | None, yes: bool
) -> int:
    from printer import Job, Journal, make_program, read_program
    from printer.journal import journal_path
    from printer.ports import open_port, port_lock
    from printer.resume import check_unchanged, plan_resume

    program = read_program(program_file)
    path = journal_path(program_file)
    with closing(Journal(path)) as journal, port_lock(port):
        entry = journal.reopen(port)
        check_unchanged(program, entry)
        with closing(open_port(port, settings.baud)) as line:
            # First only ask the printer: whether it was reset decides how the nozzle may move.
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
            if not yes and not click.confirm("Is the way free? The nozzle will move", err=True):
                raise click.Abort
            ready = replace(settings, boot_wait_s=0.0)
            with resume_offered(program, path):
                report = run(program, line, ready, journal, plan.start_at, plan.before)
    return told(report, path, program)


def _only_port() -> str:
    """The one serial port there is, if the user agrees."""
    from printer.ports import list_serial_ports

    ports = list_serial_ports()
    if len(ports) != 1:
        listing = "".join(f"\n  {port.device}  {port.description}" for port in ports) or " none."
        raise click.UsageError(f"Which printer? Give --port. Serial ports of this machine:{listing}")
    only = ports[0]
    question = f"Use the only serial port, {only.device} ({only.description})?"
    if not sys.stdin.isatty() or not click.confirm(question, default=True, err=True):
        raise click.UsageError(f"Which printer? Give --port; {only.device} is there.")
    return only.device
