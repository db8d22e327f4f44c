"""How an error reaches the user: its text on stderr and an exit code, never a traceback unasked."""

import os
import sys
import traceback

import click

# By name, so that `vslice --help` need not import the packages that raise them.
WRONG_INPUT = {
    "SlicerError",
    "GridError",
    "ProfileError",
    "ParseError",
    "CrossingError",
    "SequenceError",
    "ProtocolError",
}
OWN_PACKAGES = {"slicer", "gcode", "printer", "profiles", "vslice"}


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
    lost = lose_stdout()
    if isinstance(error, BrokenPipeError):
        return 1
    if lost is not None and isinstance(error, OSError) and str(error).startswith("[Errno"):
        print(f"Error: standard output: cannot be written: {lost}", file=sys.stderr)
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


def lose_stdout() -> str | None:
    """Why standard output cannot be written, if so; what it has not taken is dropped.

    Python would try once more when it ends, and complain in words of its own.
    """
    if sys.stdout is None:
        return None
    try:
        sys.stdout.flush()
    except OSError as error:
        nothing = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nothing, sys.stdout.fileno())
        os.close(nothing)
        return error.strerror or str(error)
    return None
