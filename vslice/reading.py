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
    piped = str(file) == "-"
    sheet = grid.loads(sys.stdin.read(), source="standard input") if piped else grid.read(file)
    for warning in sheet.warnings:
        say(f"Warning: {warning}")
    return sheet
