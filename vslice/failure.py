"""How an error reaches the user: its text on stderr and an exit code, never a traceback unasked."""

import sys
import traceback

import click

# By name, so that `vslice --help` need not import the packages that raise them.
WRONG_INPUT = {"GridError", "ProfileError", "ParseError", "CrossingError", "SequenceError", "ProtocolError"}
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
    if isinstance(error, BrokenPipeError):
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
