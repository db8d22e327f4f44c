"""``vslice send``: stream a program to a printer, for real or dry, or go on with an interrupted job."""

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from vslice.options import (
    Number,
    baud_rate,
    nozzle_option,
    program_profile_option,
    set_option,
    with_nozzle,
)
from vslice.terminal.dry_running import show_dry_run
from vslice.terminal.interrupted import ask, ask_of_port
from vslice.terminal.resuming import interrupted_job, resume_program
from vslice.terminal.session import common, json_option, said_if_interrupted
from vslice.terminal.streaming import stream_program

if TYPE_CHECKING:
    from printer import Settings
    from profiles import Profile


MOST = 5  # violations that are shown one by one


@click.command("send", epilog="Example: vslice send part.gcode --port /dev/ttyUSB0 -p marlin-syringe")
@click.argument("program_file", metavar="[PART.gcode]", required=False, type=click.Path(path_type=Path))
@click.option(
    "--port", metavar="PORT", help="A device, socket://HOST:PORT, rfc2217://.., spy://PORT, marlin://"
)
@program_profile_option
@nozzle_option
@set_option
@click.option("--dry-run", is_flag=True, help="Run the same code against an emulated printer, time flying.")
@click.option("--resume", is_flag=True, help="Go on with an interrupted job, from its journal.")
@click.option("--restart", is_flag=True, help="Begin anew though a job was interrupted; the plate is clear.")
@click.option(
    "--height",
    "height_mm",
    type=Number(0, 10_000),
    metavar="MM",
    help="With --resume: where the nozzle stands.",
)
@click.option("-y", "--yes", is_flag=True, help="Do not ask before the nozzle moves to resume.")
@click.option(
    "--view",
    is_flag=True,
    help="Show the job in a browser on this computer, with pause, resume and stop behind a token.",
)
@click.option("--no-check", is_flag=True, help="Send even what 'vslice check' finds fault with.")
@click.option("--baud", type=baud_rate, help="Instead of the profile's [printer] baud.")
@click.option(
    "--window", "window_lines", type=click.IntRange(1, 64), metavar="LINES", help="Lines in flight."
)
@click.option(
    "--probe-after", type=Number(0.05, 3600), metavar="S", help="Silence after which the printer is asked."
)
@click.option(
    "--give-up-after", type=Number(0.1, 86_400), metavar="S", help="Silence after which the job fails."
)
@json_option
@common
def command(
    program_file: Path | None,
    port: str | None,
    profile_name: str | None,
    nozzle_name: str | None,
    overrides: tuple[str, ...],
    dry_run: bool,
    resume: bool,
    restart: bool,
    height_mm: float | None,
    yes: bool,
    view: bool,
    no_check: bool,
    baud: int | None,
    window_lines: int | None,
    probe_after: float | None,
    give_up_after: float | None,
) -> None:
    """Stream a program to a Marlin printer; each line is printed exactly once, or the job stops.

    Programs for Klipper, RepRapFirmware and grbl are refused, as their consoles do not allow that: see
    'vslice help hosts'.

    Ctrl-C stops in a controlled way: the queue ends, the nozzle leaves the print, heaters do as the
    profile says. Ctrl-C twice halts the printer at once (M112). The key p pauses and resumes.
    """
    from vslice.machine import read_profile

    given: dict[str, Any] = {
        "baud": baud, "window_lines": window_lines,
        "probe_after_s": probe_after, "give_up_after_s": give_up_after,
    }  # fmt: skip
    _refuse_without_effect(
        {
            "--height without --resume": height_mm is not None and not resume,
            "--yes without --resume": yes and not resume,
            "--yes with --dry-run, which asks nothing": yes and dry_run,
            "--port with --dry-run": port is not None and dry_run,
            "--baud with --dry-run": baud is not None and dry_run,
            "--baud on a port without a wire": baud is not None
            and str(port).startswith(("socket", "marlin")),
            "--view with --dry-run, whose time flies ('vslice play' shows the program)": view and dry_run,
            "--restart with --resume": restart and resume,
            "--restart with --dry-run": restart and dry_run,
            "--no-check with --resume, which checks nothing": no_check and resume,
            "--nozzle with --no-check, since the check alone looks at it,": nozzle_name is not None
            and no_check,
            "--nozzle with --resume, which checks nothing": nozzle_name is not None and resume,
        }
    )
    if program_file is not None:
        _refuse_stream(program_file)
    if resume:
        entry = interrupted_job(program_file)
        program_file, port = entry.program_file, port or entry.port
        profile_name = profile_name or entry.profile or None  # else the program carries it
    if program_file is None:
        raise click.UsageError(
            "Which program? Give PART.gcode, or --resume to go on with an interrupted job."
        )
    with said_if_interrupted("Nothing was sent."):
        _, profile = read_profile(program_file, profile_name, with_nozzle(nozzle_name, overrides))
    refuse_unsure(profile)
    settings = replace(settings_of(profile), **{k: v for k, v in given.items() if v is not None})
    if settings.give_up_after_s <= settings.probe_after_s:
        raise click.UsageError(
            f"Giving up after {settings.give_up_after_s:g} s must come after probing, at "
            f"{settings.probe_after_s:g} s: see --give-up-after and --probe-after."
        )
    if not (resume or dry_run):
        from printer.journal import journal_path

        choice = ask(program_file, journal_path(program_file), restart)
        resume, restart = choice == "resume", restart or choice == "restart"
    if not no_check and not resume:
        check(program_file, profile)
    if dry_run:
        left = "the journal is as it was" if resume else "there is nothing to resume"
        with said_if_interrupted(f"A dry run sends nothing to a printer, and {left}."):
            show_dry_run(program_file, settings, profile, resume, height_mm)
        return
    port = port or (interrupted_job(program_file).port if resume else _only_port())
    if resume:
        code = resume_program(program_file, port, settings, profile, height_mm, yes, view)
    else:
        code = _send(program_file, port, settings, profile, profile_name or "", restart, view)
    click.get_current_context().exit(code)


def refuse_unsure(profile: "Profile") -> None:
    """Refuse a firmware to which no line can be sent exactly once.

    Raises:
        UsageError: it is one.
    """
    if (why := profile.flavor.unsure) is None:
        return
    raise click.UsageError(
        f"{profile.flavor.title} cannot be sent each line exactly once: {why}. Nothing was sent. Hand the "
        "file over instead, with 'vslice upload' or on a card ('vslice help hosts')."
    )


def _refuse_without_effect(wrong: dict[str, bool]) -> None:
    """Refuse options that would do nothing: whoever gives one expects that it does."""
    for what, is_so in wrong.items():
        if is_so:
            raise click.UsageError(f"{what} has no effect; leave it out.")


def _refuse_stream(program_file: Path) -> None:
    """A program must be there tomorrow too, and its journal beside it."""
    if str(program_file) == "-" or (program_file.exists() and not program_file.is_file()):
        raise click.UsageError(
            f"{program_file} is no ordinary file: a job that is interrupted goes on from its program and the "
            "journal beside it. Write the program to a file first, and send that."
        )


def _send(
    program_file: Path,
    port: str,
    settings: "Settings",
    profile: "Profile",
    profile_name: str,
    restart: bool,
    view: bool = False,
) -> int:
    from printer.journal import journal_path

    if not restart:
        ask_of_port(port, journal_path(program_file))
    return stream_program(program_file, port, settings, profile, profile_name, restart, view)


def send_file(
    program_file: Path, port: str | None, profile: "Profile", profile_name: str, restart: bool
) -> int:
    """Stream a program that has been checked, to the only port where none is named; the exit code."""
    port = port or _only_port()
    return _send(program_file, port, settings_of(profile), profile, profile_name, restart)


def settings_of(profile: "Profile") -> "Settings":
    """What `printer` wants to know, from a profile."""
    from printer import Safety, Settings
    from printer.safety import feed, feed_of
    from profiles import render

    serial, motion, material = profile.printer, profile.motion, profile.material
    close = list(render(profile.gcode.valve_close, profile.values))
    if motion.firmware_retraction:
        close.append("G10")
    elif material.feed != "pneumatic" and (word := feed_of(-motion.retract_mm)):
        close.append(f"G1 {word} {feed(motion.retract_speed_mm_s)}")
    speeds = profile.machine.max_speed_mm_s
    safety = Safety(
        build_axis="Z",
        build_axis_homes_up=serial.build_axis_homes_up,
        lift_mm=serial.stop_lift_mm,
        lift_speed_mm_s=min(speeds[2], motion.travel_speed_mm_s),
        travel_speed_mm_s=motion.travel_speed_mm_s,
        retract_speed_mm_s=motion.retract_speed_mm_s,
        close_lines=tuple(close),
        open_lines=tuple(render(profile.gcode.valve_open, profile.values)),
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


@said_if_interrupted("Nothing was sent.")
def check(program_file: Path, profile: "Profile", what: str = "sent") -> None:
    """Refuse a program that `vslice check` finds fault with."""
    from gcode.check import check_file

    wrong = check_file(program_file, profile).violations
    if wrong:
        shown_ones = [f"  {violation}" for violation in wrong[:MOST]]
        more = [f"  and {len(wrong) - MOST} more"] if len(wrong) > MOST else []
        listing = "\n".join([*shown_ones, *more])
        raise click.ClickException(
            f"{program_file} cannot be printed on this machine; nothing was {what}:\n{listing}\n"
            "Slice it again for this profile, or insist with --no-check."
        )


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
