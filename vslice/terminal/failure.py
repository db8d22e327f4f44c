"""How an error reaches the user: its text on stderr and an exit code, never a traceback unasked."""

import os
import sys
import traceback

import click

# What no second try changes, until the user gives something else: exit code 2. What the world does (a full
# disk, a printer, another sender) is a failure, 1, and so is a program that the check finds fault with.
# By name, so that `vslice --help` need not import the packages that raise them.
WRONG_INPUT = {
    "SlicerError",
    "GridError",
    "ProfileError",
    "ParseError",
    "ReadError",
    "BuildVolumeError",
    "CrossingError",
    "CycleError",
    "SequenceError",
    "ProtocolError",
    "OptionError",
    "JournalError",
    "ResumeError",
    "PortNameError",
    "TissueError",
    "MissingLibraryError",
    "StudyError",
    "HostInputError",
}
OWN_PACKAGES = {"slicer", "gcode", "printer", "profiles", "dialect", "vslice", "tissue", "studies"}


class InputError(click.ClickException):
    """What the user gave cannot be used: exit code 2 as for wrong use, without the line on usage."""

    exit_code = 2


def report(error: Exception, *, traceback_wanted: bool) -> int:
    """Print ``error`` on stderr and return the exit code: 2 for wrong use or bad input, else 1."""
    if traceback_wanted:
        traceback.print_exception(error, file=sys.stderr)
    if isinstance(error, click.exceptions.Exit):
        return error.exit_code
    if isinstance(error, click.ClickException):
        error.show()
        return error.exit_code
    if isinstance(error, click.Abort):
        print("Aborted.", file=sys.stderr)
        return 130
    known = type(error).__module__.split(".")[0] in OWN_PACKAGES
    _forget_stdout()
    if isinstance(error, BrokenPipeError):
        return 1
    if isinstance(error, OSError) and _came_from_echo(error):
        print(f"Error: standard output: cannot be written: {error.strerror}", file=sys.stderr)
        return 1
    if known or isinstance(error, OSError):
        print(f"Error: {error}", file=sys.stderr)
        return 2 if type(error).__name__ in WRONG_INPUT else 1
    print(
        f"Error: {type(error).__name__}: {error}\n"
        "This is a defect in vslice; run again with -vv and report it.",
        file=sys.stderr,
    )
    return 1


def _forget_stdout() -> None:
    """Drop what standard output has not taken: Python would try again when it ends, and complain itself."""
    if sys.stdout is None:
        return
    try:
        sys.stdout.flush()
    except OSError:
        nothing = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nothing, sys.stdout.fileno())
        os.close(nothing)


def _came_from_echo(error: OSError) -> bool:
    """Whether it was raised while text was printed: such an error names no file."""
    *_, (frame, _) = traceback.walk_tb(error.__traceback__)
    return str(frame.f_globals.get("__name__")) in ("click.utils", "vslice.cli")
