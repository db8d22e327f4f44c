"""Grid files as commands read them: from a file or standard input, with what the user should know of them."""

import sys
from pathlib import Path

from slicer import grid
from slicer.grid import Grid
from vslice.terminal.session import say


def read_grid(file: Path) -> Grid:
    """Read a grid, - being standard input, and say its warnings on stderr.

    Raises:
        GridError: it is none.
    """
    if str(file) == "-":
        sheet = grid.from_bytes(sys.stdin.buffer.read(), source="standard input")
    else:
        sheet = grid.read(file)
    say_warnings(sheet)
    return sheet


def say_warnings(sheet: Grid) -> None:
    """Say on stderr what the user should know of a grid."""
    for warning in sheet.warnings:
        say(f"Warning: {warning}")
